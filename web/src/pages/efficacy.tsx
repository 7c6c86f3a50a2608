// Whether a machine cuts where its corrections predict: what it is off by, blade by blade, and what may be taken as its known offset.
import { useEffect, useRef, useState } from 'preact/hooks';
import { EfficacyService, NotOffered, OffsetComponent, type BladeMean, type EfficacyPeriod, type HoleBias, type OffsetEstimate } from '#proto/sixpoint/inspection/v1/efficacy_pb';
import { useAsked } from '../plant/asked';
import { useCell } from '../plant/cell';
import { client } from '../plant/clients';
import { useMay } from '../plant/may';
import { go } from '../plant/route';
import { idOf, pageOf, shortId } from '../words/name';
import { number, plural, withUncertainty } from '../words/quantity';
import { dateOf, full } from '../words/time';
import { Mark } from '../view/mark';
import { Shown } from '../view/states';
import { Table, type Column } from '../view/table';
import { isDark } from '../view/theme';
import { inksNow } from './calibration_trend';

const kReasons: Record<number, string> = {
  [NotOffered.TOO_FEW_BLADES]: 'not enough blades', [NotOffered.NOT_SIGNIFICANT]: 'the blades’ scatter explains it', [NotOffered.WITHIN_UNCERTAINTY]: 'nothing is beyond its own uncertainty',
  [NotOffered.DRIFTS]: 'it moves over time', [NotOffered.NEWEST_BLADE_OFF]: 'the newest blade does not fit those before it', [NotOffered.NOT_IN_FORCE]: 'its calibrations, or the machine’s record, are not those of now',
};
const isAngle = ({ component }: OffsetEstimate) => component >= OffsetComponent.A;
const named = (component: OffsetComponent) => OffsetComponent[component] ?? '';
// Micrometres, or thousandths of a degree.
const written = (o: OffsetEstimate, value: number | undefined, expanded: number | undefined) => withUncertainty(value === undefined ? undefined : 1e3 * value, expanded === undefined ? undefined : 1e3 * expanded, isAngle(o) ? 'mdeg' : 'µm', 1);

const offsetColumns = (period: EfficacyPeriod): Column<OffsetEstimate>[] => [
  { head: 'Found less predicted', cell: (o) => named(o.component), csv: (o) => named(o.component) },
  { head: 'Value ± U', isNumber: true, cell: (o) => written(o, o.value, o.expandedUncertainty), csv: (o) => o.value },
  { head: 'Of one blade', isNumber: true, cell: (o) => (o.standardDeviation === undefined ? '' : number(1e3 * o.standardDeviation, 1)), csv: (o) => o.standardDeviation },
  { head: 'Offered', cell: (o) => (period.offeredOffset?.components.some(({ component }) => component === o.component) ? <Mark tone="good">Yes</Mark> : 'No'), csv: (o) => (period.offeredOffset?.components.some(({ component }) => component === o.component) ? 'offered' : '') },
];
const micrometres = (mm: number | undefined) => (mm === undefined ? '' : number(1e3 * mm, 1));
const kBlades: Column<BladeMean>[] = [
  { head: 'Blade', cell: (b) => <a href={pageOf(b.blade)}>{idOf(b.blade)}</a>, csv: (b) => b.blade }, { head: 'Corrected', cell: (b) => full(dateOf(b.correctedAt)), csv: (b) => dateOf(b.correctedAt)?.toISOString() },
  { head: 'Holes', isNumber: true, cell: (b) => b.holeCount, csv: (b) => b.holeCount }, { head: 'X', unit: 'µm', isNumber: true, cell: (b) => micrometres(b.xMm), csv: (b) => b.xMm }, { head: 'Y', unit: 'µm', isNumber: true, cell: (b) => micrometres(b.yMm), csv: (b) => b.yMm },
];
const kHoles: Column<HoleBias>[] = [
  { head: 'Hole', cell: (h) => h.hole, csv: (h) => h.hole }, { head: 'Blades', isNumber: true, cell: (h) => h.bladeCount, csv: (h) => h.bladeCount },
  { head: 'Own X', unit: 'µm', isNumber: true, cell: (h) => micrometres(h.ownInMachineMm?.xMm), csv: (h) => h.ownInMachineMm?.xMm }, { head: 'Own Y', unit: 'µm', isNumber: true, cell: (h) => micrometres(h.ownInMachineMm?.yMm), csv: (h) => h.ownInMachineMm?.yMm },
  { head: 'U', unit: 'µm', isNumber: true, cell: (h) => (h.ownExpandedUncertaintyUm === undefined ? '' : number(h.ownExpandedUncertaintyUm, 1)), csv: (h) => h.ownExpandedUncertaintyUm },
];

// Blade means over time, each with what its own holes leave uncertain of it.
function Means({ period, component }: { period: EfficacyPeriod; component: OffsetComponent.X | OffsetComponent.Y }) {
  const place = useRef<HTMLDivElement>(null), dark = useCell(isDark);
  const [problem, setProblem] = useState('');
  const within = period.spreads.find((spread) => spread.component === component)?.withinUm ?? 0, trend = period.trends.find((one) => one.component === component);
  const dots = period.blades.flatMap((blade) => {
    const value = component === OffsetComponent.X ? blade.xMm : blade.yMm, at = dateOf(blade.correctedAt);
    return value === undefined || !at ? [] : [{ at, value: 1e3 * value, standardUncertainty: within / Math.sqrt(Math.max(1, blade.holeCount)), isAlarm: false, name: blade.blade, step: undefined }];
  });
  if (period.newestBladeOff && dots.length > 0) dots.at(-1)!.isAlarm = true;
  useEffect(() => {
    let stop: (() => void) | undefined, isOver = false;
    void import('../view/trend_chart').then((module) => {
      if (isOver) return;
      stop = module.drawTrend(place.current!, { dots, aside: [], slopePerDay: trend?.slopeUmPerDay, isTrendAlarm: trend?.significant ?? false, limit: undefined, current: '', decimals: 1, unit: 'µm' }, inksNow(), (blade) => { const page = pageOf(blade); if (page) go(page); }).stop;
    }, () => setProblem('The drawing could not be fetched.'));
    return () => { isOver = true; stop?.(); };
  }, [period, dark]);
  return (
    <figure class="sheet picture">
      <figcaption><h3>{named(component)} of each blade, µm {trend?.significant && <Mark tone="unsure">Drifts</Mark>}</h3></figcaption>
      <div ref={place} class="trend-place" role="img" aria-label={`${named(component)} of ${plural(dots.length, 'blade')}, found less predicted. The same in figures: the table of blades.`} />
      {problem && <p class="problem">{problem}</p>}
    </figure>
  );
}

function Period({ period }: { period: EfficacyPeriod }) {
  const off = period.holes.filter(({ significant }) => significant), missing = period.notDetermined.map(named);
  return (
    <>
      <p class="small">{plural(period.blades.length, 'blade')}, {plural(period.holeCount, 'hole')}; scanner <a href={pageOf(period.sensorCalibration)}>{shortId(period.sensorCalibration)}</a>, axes <a href={pageOf(period.rotationCalibration)}>{shortId(period.rotationCalibration)}</a>{period.inForce ? '' : ', not in force any more'}.
        {' '}{period.offeredOffset ? 'Offered as its known offset; nothing applies it.' : `No offset is offered: ${period.notOffered.map((reason) => kReasons[reason] ?? NotOffered[reason]).join('; ')}.`}
        {missing.length > 0 && ` These holes do not tell ${missing.join(', ')}.`}</p>
      <Table caption={`What it is off by, axes ${shortId(period.rotationCalibration)}`} showCaption={false} columns={offsetColumns(period)} rows={period.offsets} rowKey={(o) => named(o.component)} />
      <div class="charts"><Means period={period} component={OffsetComponent.X} /><Means period={period} component={OffsetComponent.Y} /></div>
      {off.length > 0 && <Table caption={`Holes that are off on every blade, axes ${shortId(period.rotationCalibration)}`} columns={kHoles} rows={off} rowKey={(h) => h.hole} />}
      <details><summary>Every blade</summary><Table caption={`Blades, axes ${shortId(period.rotationCalibration)}`} showCaption={false} columns={kBlades} rows={period.blades} rowKey={(b) => b.blade} /></details>
    </>
  );
}

export function Efficacy({ name }: { name: string }) {
  const may = useMay(EfficacyService.method.computeEfficacy);
  const asked = useAsked([name, may], async (signal) => (may ? client(EfficacyService).computeEfficacy({ machine: name }, { signal }) : undefined));
  if (!may) return null;
  return (
    <section class="section" aria-labelledby="efficacy-title" id="efficacy">
      <h2 id="efficacy-title">Cut against predicted</h2>
      <Shown asked={asked} what="what it is off by">{(value) => (
        !value || value.periods.length === 0 ? <p class="muted">No inspected blade that it cut by a correction.</p>
          : <><Period period={value.periods[0]!} />{value.periods.length > 1 && <details><summary>{plural(value.periods.length - 1, 'earlier period')}</summary>{value.periods.slice(1).map((period) => <Period key={`${period.machine} ${period.sensorCalibration} ${period.rotationCalibration}`} period={period} />)}</details>}</>
      )}</Shown>
    </section>
  );
}
