// One machine: what it does now and what is wrong, its axes to move, its scanner, its axis tables, what calibrating it brings, its limits.
import { useEffect } from 'preact/hooks';
import { CalibrationService, type Calibration } from '#proto/sixpoint/calibration/v1/calibration_pb';
import { CalibrationKind } from '#proto/sixpoint/calibration/v1/kind_pb';
import { CalibrationState } from '#proto/sixpoint/calibration/v1/state_pb';
import { StudyKind, StudyService, type Study } from '#proto/sixpoint/calibration/v1/study_pb';
import { StudyVerdict } from '#proto/sixpoint/calibration/v1/verdict_pb';
import { View } from '#proto/sixpoint/list/v1/list_pb';
import { FleetService, type MachineCalibration, type MachineState } from '#proto/sixpoint/plant/v1/fleet_pb';
import { Approach, JointKind, SensorKind, type Joint, type Machine, type Sensor } from '#proto/sixpoint/plant/v1/machine_pb';
import { PlantService } from '#proto/sixpoint/plant/v1/plant_pb';
import { useAsked } from '../plant/asked';
import { client } from '../plant/clients';
import { useMay } from '../plant/may';
import { firstRows } from '../plant/paged';
import { kindWord, parameterName } from '../words/calibration';
import { alarmPage, alarmWord, calibrationWord, doingOf, isUrgent, parameterWords } from '../words/machine';
import { idOf, pageOf, shortId, withoutRevision } from '../words/name';
import { number, percent, plural, quantity, withUncertainty } from '../words/quantity';
import { ago, dateOf, duration, full } from '../words/time';
import { Mark, VerdictMark } from '../view/mark';
import { Picture } from '../view/picture';
import { useNow } from '../view/now';
import { Heading } from '../view/shell';
import { Shown } from '../view/states';
import { Table, type Column } from '../view/table';
import { AxisTable, broughtBy } from './calibration_residuals';
import { Efficacy } from './efficacy';
import { MachineView } from './machine_view';

type Facts = { machine: Machine; inForce: Calibration[] };

async function factsOf(name: string, signal: AbortSignal): Promise<Facts> {
  const [machine, inForce] = await Promise.all([
    client(PlantService).getMachine({ name }, { signal }),
    firstRows(50, async (pageToken, pageSize) => {
      const page = await client(CalibrationService).listCalibrations({ machine: name, state: CalibrationState.IN_FORCE, view: View.FULL, pageSize, pageToken }, { signal });
      return { rows: page.calibrations, nextPageToken: page.nextPageToken };
    }),
  ]);
  return { machine, inForce };
}

const kJoints: Column<Joint & { side: string }>[] = [
  { head: 'Axis', cell: (j) => j.axis, csv: (j) => j.axis }, { head: 'Carries', cell: (j) => j.side, csv: (j) => j.side }, { head: 'Moves', cell: (j) => (j.kind === JointKind.ROTARY ? 'turns' : 'slides'), csv: (j) => JointKind[j.kind] },
  { head: 'Direction', cell: (j) => (j.direction ? [j.direction.x, j.direction.y, j.direction.z].map((c) => number(c, 4)).join(', ') : ''), csv: (j) => j.direction && `${j.direction.x} ${j.direction.y} ${j.direction.z}` },
  { head: 'Through', unit: 'mm', cell: (j) => (j.pointMm && j.kind === JointKind.ROTARY ? [j.pointMm.xMm, j.pointMm.yMm, j.pointMm.zMm].map((c) => number(c, 3)).join(', ') : ''), csv: (j) => j.pointMm && `${j.pointMm.xMm} ${j.pointMm.yMm} ${j.pointMm.zMm}` },
  { head: 'Sense', isNumber: true, cell: (j) => (j.sign < 0 ? '−1' : '+1'), csv: (j) => j.sign },
  { head: 'From', isNumber: true, cell: (j) => quantity(j.minimum, j.kind === JointKind.ROTARY ? 'deg' : 'mm', 1), csv: (j) => j.minimum }, { head: 'To', isNumber: true, cell: (j) => quantity(j.maximum, j.kind === JointKind.ROTARY ? 'deg' : 'mm', 1), csv: (j) => j.maximum },
  { head: 'u of an angle, by data sheet', isNumber: true, cell: (j) => (j.positioningStandardUncertaintyDeg === undefined ? '' : quantity(j.positioningStandardUncertaintyDeg, 'deg', 4)), csv: (j) => j.positioningStandardUncertaintyDeg },
];

// The measuring field in its plane, to scale.
function FieldPicture({ sensor, of }: { sensor: Sensor; of: string }) {
  const near = sensor.midRangeMm - sensor.rangeMm / 2, far = sensor.midRangeMm + sensor.rangeMm / 2, half = (sensor.lineAngleDeg * Math.PI) / 360, wide = (range: number) => 2 * range * Math.tan(half);
  const kHigh = 210, scale = Math.min((kHigh - 30) / far, 190 / wide(far)), x = (y: number) => 130 + y * scale, y = (range: number) => 24 + range * scale;
  const line = (range: number, words: string) => <g key={words}><path class="axis" d={`M${x(-wide(range) / 2)} ${y(range)}H${x(wide(far) / 2) + 14}`} /><text x={x(wide(far) / 2) + 18} y={y(range) + 4}>{words}</text></g>;
  return (
    <Picture title="The scanner’s measuring field" file={`${of} measuring field`}>
      <svg class="chart" viewBox={`0 0 430 ${y(far) + 12}`} role="img" aria-label={`Measuring field: from ${number(near, 1)} to ${number(far, 1)} mm before the scanner, ${number(wide(near), 1)} mm wide near, ${number(wide(far), 1)} mm far.`}>
        <rect class="panel-dark" x={x(0) - 26} y={4} width={52} height={20} rx={3} />
        <path class="laser" d={`M${x(0)} ${y(0)}L${x(-wide(near) / 2)} ${y(near)}H${x(wide(near) / 2)}Z`} />
        <path class="laser-field" d={`M${x(-wide(near) / 2)} ${y(near)}H${x(wide(near) / 2)}L${x(wide(far) / 2)} ${y(far)}H${x(-wide(far) / 2)}Z`} />
        {line(near, `${number(near, 1)} mm away, ${number(wide(near), 1)} mm wide`)}{line(sensor.midRangeMm, `${number(sensor.midRangeMm, 1)} mm: middle, z = 0`)}{line(far, `${number(far, 1)} mm away, ${number(wide(far), 1)} mm wide`)}
      </svg>
    </Picture>
  );
}

function Scanner({ sensor, of }: { sensor: Sensor; of: string }) {
  return (
    <section class="section" aria-labelledby="scanner-title">
      <h2 id="scanner-title">Scanner</h2>
      <div class="sheet two"><FieldPicture sensor={sensor} of={of} />
        <dl class="pairs">
          <dt>Model</dt><dd>{sensor.model || <span class="muted">not stated</span>}</dd>
          <dt>Serial number</dt><dd>{sensor.serialNumber || <span class="muted">not stated</span>}</dd>
          <dt>Measures</dt><dd>{sensor.kind === SensorKind.SNAPSHOT ? 'a cloud at once, mapped by a stated pose' : `profiles of ${plural(sensor.columnCount, 'column')}`}</dd>
          <dt>Noise</dt><dd>{quantity(sensor.noiseUm, 'µm', 2)} standard deviation of a reading</dd>
          <dt>Range</dt><dd>{quantity(sensor.rangeMm, 'mm', 1)} about {quantity(sensor.midRangeMm, 'mm', 1)}</dd>
          <dt>Line</dt><dd>{quantity(sensor.lineAngleDeg, 'deg', 1)} open</dd>
        </dl></div>
    </section>
  );
}

type Brought = { of: Calibration; without: number; withIt: number; unit: string; words: string };
const kBrought: Column<Brought>[] = [
  { head: 'Calibration', cell: (b) => <a href={pageOf(b.of.name)}>{kindWord(b.of)}</a>, csv: (b) => b.of.name }, { head: 'What', cell: (b) => b.words, csv: (b) => b.words },
  { head: 'Without it', isNumber: true, cell: (b) => quantity(b.without, b.unit, b.unit === 'deg' ? 5 : 2), csv: (b) => b.without }, { head: 'With it', isNumber: true, cell: (b) => quantity(b.withIt, b.unit, b.unit === 'deg' ? 5 : 2), csv: (b) => b.withIt },
  { head: 'Times better', isNumber: true, cell: (b) => number(b.without / Math.max(1e-12, b.withIt), 1), csv: (b) => b.without / Math.max(1e-12, b.withIt) },
];

// As far as calibrations keep both figures: rotary axes and axis tables do.
export function broughtOf(inForce: Calibration[]): Brought[] {
  return inForce.flatMap((of): Brought[] => {
    if (of.result.case === 'rotation') {
      const found = broughtBy(of.result.value.residuals);
      return found ? [{ of, without: found.beforeUm, withIt: found.afterUm, unit: 'µm', words: `probed centre from where the axes put it, rms${found.isHeldOut ? ', poses held out' : ''}` }] : [];
    }
    if (of.result.case === 'axis' && of.result.value.standardUncertainty && of.result.value.compensatedStandardUncertainty)
      return [{ of, without: of.result.value.standardUncertainty.valueDeg, withIt: of.result.value.compensatedStandardUncertainty.valueDeg, unit: 'deg', words: 'u of one position' }];
    return [];
  });
}

const kAges: Column<MachineCalibration>[] = [
  { head: 'Calibration', cell: (c) => <a href={pageOf(c.name)}>{calibrationWord(c)}</a>, csv: (c) => c.name }, { head: 'In force', cell: (c) => (c.inForce ? <Mark tone="good">In force</Mark> : <Mark tone="bad">Over</Mark>), csv: (c) => (c.inForce ? 'yes' : 'no') },
  { head: 'Age', isNumber: true, cell: (c) => duration(c.ageDays * 86400), csv: (c) => c.ageDays }, { head: 'Valid until', cell: (c) => full(dateOf(c.validUntil)), csv: (c) => dateOf(c.validUntil)?.toISOString() },
  { head: 'Moved most', cell: (c) => { const w = c.drift && parameterWords(c.drift.parameter); return w ? `${parameterName(w.name)} by ${c.drift!.change.toPrecision(3).replace('-', '−')} ${w.unit}` : 'the first'; }, csv: (c) => c.drift && `${c.drift.parameter} ${c.drift.change}` },
  { head: 'Drift over u', isNumber: true, cell: (c) => (c.drift ? <span class={c.drift.flaggedParameters.length > 0 ? 'tone-unsure' : ''}>{number(c.drift.changeRatio, 1)}</span> : ''), csv: (c) => c.drift?.changeRatio },
];

function Now({ state }: { state: MachineState | undefined }) {
  const now = useNow();
  if (!state) return <p class="muted">Nothing is known of what it does.</p>;
  const doing = doingOf(state, now);
  return (
    <>
      <div class="blade-top">
        <div class="sheet"><Mark tone={doing.tone} big>{doing.word}</Mark><p class="muted">{doing.detail}{doing.detail && ', '}last heard {ago(dateOf(state.lastContact), now)}</p>
          <dl class="pairs"><dt>In work</dt><dd>{plural(state.bladesInWorkCount, 'blade')}</dd><dt>Judged, last 24 hours</dt><dd>{plural(state.throughput?.bladesJudgedCount ?? 0, 'blade')}{state.yield?.conformShare !== undefined && `, ${percent(state.yield.conformShare)} conform`}</dd></dl></div>
        <div class="sheet"><h2>Alarms</h2>{state.alarms.length === 0 ? <p class="muted">Nothing is known to be wrong.</p> : (
          <ul class="alarms">{state.alarms.map((alarm) => (
            <li key={`${alarm.kind}${alarm.subject}`} class={isUrgent(alarm.kind) ? 'urgent' : ''}><strong><a href={alarmPage(alarm.subject, state.machine)}>{alarmWord(alarm.kind)}</a></strong> <span class="small">{alarm.message} <em>{alarm.action}</em> <span class="muted">Since {ago(dateOf(alarm.since), now).replace(' ago', '')}.</span></span></li>
          ))}</ul>
        )}</div>
      </div>
      <section class="section"><Table caption="Calibrated by" columns={kAges} rows={state.calibrations} rowKey={(c) => c.name} /><p class="small"><a href={`/calibrations?machine=${encodeURIComponent(idOf(state.machine))}`}>All its calibrations</a></p></section>
    </>
  );
}

type Limit = { what: string; value: number | undefined; unit: string; decimals: number; unset: string };
const kLimits: Column<Limit>[] = [
  { head: 'What', cell: (l) => l.what, csv: (l) => l.what }, { head: 'Value', isNumber: true, cell: (l) => (l.value === undefined ? <span class="muted">{l.unset}</span> : number(l.value, l.decimals)), csv: (l) => l.value }, { head: 'Unit', cell: (l) => l.unit, csv: (l) => l.unit },
];

function Stated({ machine }: { machine: Machine }) {
  const e = machine.safetyEnvelope, s = machine.errorSources, probe = machine.touchProbe, now = useNow();
  const limits: Limit[] = [
    { what: 'A start may move', value: e?.translationMm, unit: 'mm', decimals: 2, unset: 'not told' }, { what: 'A rotary axis may turn', value: e?.rotationDeg, unit: 'deg', decimals: 2, unset: 'not told' }, { what: 'U may take of a tolerance', value: e?.uncertaintyShare === undefined ? undefined : 100 * e.uncertaintyShare, unit: '%', decimals: 0, unset: 'not told' },
    { what: 'A registration holds', value: e?.registrationAgeH, unit: 'h', decimals: 1, unset: 'not told' }, { what: 'The tool keeps out by', value: e?.keepOutMm, unit: 'mm', decimals: 2, unset: 'not told' }, { what: 'An interim check accepts', value: e?.interimCheckLimitUm, unit: 'µm', decimals: 1, unset: 'none is wanted' },
  ];
  const errors: Limit[] = [
    { what: 'Touch probe, common offset', value: s?.touchOffsetUm, unit: 'µm', decimals: 2, unset: 'not stated' }, { what: 'Scanner’s field', value: s?.scannerFieldUm, unit: 'µm', decimals: 2, unset: 'not stated' }, { what: 'Tool’s tip against touch probe', value: s?.toolOffsetUm, unit: 'µm', decimals: 2, unset: 'not stated' },
    { what: 'Scale of a linear axis', value: s?.linearScaleUmPerM, unit: 'µm/m', decimals: 1, unset: 'not stated' }, { what: 'Squareness of two', value: s?.squarenessUmPerM, unit: 'µm/m', decimals: 1, unset: 'not stated' }, { what: 'Temperature that a scan states', value: s?.temperatureK, unit: 'K', decimals: 2, unset: 'not stated' },
    { what: 'Encoder’s latency along X', value: s?.encoderLatencyUm, unit: 'µm', decimals: 2, unset: 'not stated' },
  ];
  const until = dateOf(probe?.certificate?.expiresAt);
  return (
    <section class="section" aria-labelledby="stated-title">
      <h2 id="stated-title">What its record states</h2>
      <div class="two">
        <Table caption="Released without a person, as far as" columns={kLimits} rows={limits} rowKey={(l) => l.what} />
        <Table caption="Standard uncertainties beside its calibrations" columns={kLimits} rows={errors} rowKey={(l) => l.what} />
      </div>
      <p class="small muted">Rotary axes come to their angles {s?.approach === Approach.UPWARDS ? 'from smaller ones' : s?.approach === Approach.DOWNWARDS ? 'from greater ones' : 'either way, so that half of a reversal stays uncertain'}.
        {probe && <> Touch probe {probe.serialNumber}{probe.certificate && <>, certificate {probe.certificate.number} until {full(until)}{until && until < now && ', over: nothing is calibrated by it'}</>}.</>}
        {' '}Revision {machine.revision}{machine.createdAt && `, recorded ${full(dateOf(machine.createdAt))}`}.</p>
    </section>
  );
}

const worst = (study: Study) => (study.result.case === 'interimCheck' ? study.result.value.places[study.result.value.worstPlace] : undefined);
const limitOf = (study: Study) => (study.result.case === 'interimCheck' ? study.result.value.limitUm : 0);
const kChecks: Column<Study>[] = [
  { head: 'Made', cell: (s) => <span title={s.name}>{full(dateOf(s.recordedAt))}</span>, csv: (s) => dateOf(s.recordedAt)?.toISOString() }, { head: 'Verdict', cell: (s) => <VerdictMark verdict={StudyVerdict[s.verdict] ?? ''} />, csv: (s) => StudyVerdict[s.verdict] },
  { head: 'Greatest displacement ± bound', isNumber: true, cell: (s) => { const w = worst(s); return w ? withUncertainty(w.distanceUm, w.boundUm, 'µm') : ''; }, csv: (s) => worst(s)?.distanceUm }, { head: 'At most', isNumber: true, cell: (s) => (limitOf(s) > 0 ? quantity(limitOf(s), 'µm', 1) : 'none stated'), csv: limitOf },
  { head: 'Calibration', cell: (s) => (s.result.case === 'interimCheck' ? <a href={pageOf(s.result.value.sensorCalibration)}>{shortId(s.result.value.sensorCalibration)}</a> : ''), csv: (s) => (s.result.case === 'interimCheck' ? s.result.value.sensorCalibration : '') },
  { head: 'Clamping', cell: (s) => (s.result.case === 'interimCheck' ? s.result.value.clamping : ''), csv: (s) => (s.result.case === 'interimCheck' ? s.result.value.clamping : '') },
];

function Checks({ name }: { name: string }) {
  const may = useMay(StudyService.method.listStudies);
  const asked = useAsked([name, may], async (signal) => (may ? firstRows(20, async (pageToken, pageSize) => {
    const page = await client(StudyService).listStudies({ machine: name, kind: StudyKind.INTERIM_CHECK, pageSize, pageToken, view: View.FULL }, { signal });
    return { rows: page.studies, nextPageToken: page.nextPageToken };
  }) : []), ({ entry }) => entry?.kind === 'study');
  // A link leads here before there is anything.
  useEffect(() => { if (asked.value && location.hash === '#checks') document.getElementById('checks')?.scrollIntoView(); }, [asked.value !== undefined]);
  return (
    <section class="section" aria-label="Interim checks" id="checks">
      <Shown asked={asked} what="its interim checks">{(studies) => (studies.length === 0 ? <><h2>Interim checks</h2><p class="muted">None was made: whether the scanner still stands as it was calibrated is not known.</p></>
        : <Table caption="Interim checks, the newest 20" columns={kChecks} rows={studies} rowKey={(s) => s.name} />)}</Shown>
    </section>
  );
}

export default function MachinePage({ argument: id }: { argument: string }) {
  const name = `machines/${id}`;
  const asked = useAsked([name], (signal) => factsOf(name, signal), ({ entry }) => (entry?.kind === 'machine' || entry?.kind === 'calibration' || entry?.kind === 'release' || entry?.kind === 'withdrawal') && withoutRevision(entry.machine || entry.name) === name);
  const state = useAsked([name, 'state'], async (signal) => (await client(FleetService).listMachineStates({ machine: name }, { signal })).machines[0], ({ entry }) => withoutRevision(entry?.machine ?? '') === name);
  return (
    <>
      <div class="page-head"><Heading title={id}>{id}</Heading><a href={`/blades?machine=${encodeURIComponent(id)}`}>Its blades</a></div>
      <Shown asked={asked} what={`the machine ${id}`}>{({ machine, inForce }) => {
        const { partSide = [], toolSide = [] } = machine.kinematics ?? {};
        const sensorCalibration = inForce.find(({ kind }) => kind === CalibrationKind.SENSOR)?.result, axes = inForce.filter(({ result }) => result.case === 'axis'), brought = broughtOf(inForce);
        const joints = [...partSide.map((joint) => ({ ...joint, side: 'part' })), ...toolSide.map((joint) => ({ ...joint, side: 'tool' }))];
        return (
          <>
            <Shown asked={state} what="its state">{(value) => <Now state={value} />}</Shown>
            <MachineView machine={machine} title={id} sensorCalibration={sensorCalibration?.case === 'sensor' ? sensorCalibration.value : undefined} />
            {joints.length > 0 && <section class="section"><Table caption="Joints" columns={kJoints} rows={joints} rowKey={(j) => j.axis} /></section>}
            {machine.sensor && <Scanner sensor={machine.sensor} of={id} />}
            <section class="section" aria-labelledby="tables-title"><h2 id="tables-title">Axis tables</h2>
              {axes.length === 0 ? <p class="muted">No axis is characterised: what an angle is off by is what the data sheet says.</p> : <div class="two">{axes.map((one) => <div class="sheet" key={one.name}>{one.result.case === 'axis' && <AxisTable axis={one.result.value} of={id} />}<p class="small"><a href={pageOf(one.name)}>Calibration {shortId(one.name)}</a></p></div>)}</div>}
            </section>
            {brought.length > 0 && <section class="section"><Table caption="What calibrating brings" columns={kBrought} rows={brought} rowKey={(b) => b.of.name} /></section>}
            <Checks name={name} />
            <Efficacy name={name} />
            <Stated machine={machine} />
          </>
        );
      }}</Shown>
    </>
  );
}
