// What says that a blade stands where a registration puts it: residuals place by place, the direction that is held least, scans against each other, datum points.
import { useMemo, useState } from 'preact/hooks';
import { PlantService } from '#proto/sixpoint/plant/v1/plant_pb';
import type { Part } from '#proto/sixpoint/plant/v1/part_pb';
import { Method, Outcome } from '#proto/sixpoint/registration/v1/method_pb';
import type { Allowance, AllowancePatch, AllowanceSide, DatumResidual, Evidence, RegionResidual, ScanAgreement, ScanEvidence } from '#proto/sixpoint/registration/v1/evidence_pb';
import { RegistrationService, type Registration } from '#proto/sixpoint/registration/v1/registration_pb';
import { useAsked } from '../plant/asked';
import { client } from '../plant/clients';
import { idOf, pageOf, personOf, shortId } from '../words/name';
import { count, number, orNone, percent, plural, quantity, withUncertainty } from '../words/quantity';
import { dateOf, full } from '../words/time';
import { AboutZero, AgainstLimit } from '../view/bars';
import { Mark, VerdictMark } from '../view/mark';
import { Picture } from '../view/picture';
import { Heading } from '../view/shell';
import { Shown } from '../view/states';
import { Table, type Column } from '../view/table';
import { displacementOf, multiplied, transposed } from '../scene/displacement';
import { eigenOf, shadowOf } from '../scene/ellipsoid';
import { apply, inverse, length, rigid, times, vectorOf, type Vector } from '../scene/frames';
import { methodWords } from './blade_story';
import { SixDegrees } from './corrections';
import { PartScene, moved, type Drawn, type SceneModule } from './part_scene';

const kRatioLimit = 4.1;  // registration.v1.Disagreement.beyond

type Facts = { registration: Registration; part: Part | undefined };

async function factsOf(name: string, signal: AbortSignal): Promise<Facts> {
  const registration = await client(RegistrationService).getRegistration({ name }, { signal });
  const part = await client(PlantService).getPart({ name: `${registration.part}@${registration.partRevision}` }, { signal }).catch(() => undefined);
  return { registration, part };
}

// The shifts' covariance about its point, turned into the part's axes, um^2.
export function shiftCovarianceInPart(registration: Registration): number[] | undefined {
  const values = registration.covariance?.values;
  if (values?.length !== 36 || !registration.zeroFromPart) return undefined;
  const inMachine = [3, 4, 5].flatMap((i) => [3, 4, 5].map((j) => values[6 * i + j]! * 1e6)), r = rigid(registration.zeroFromPart).linear;
  return multiplied(multiplied(transposed(r), inMachine), r);
}

const kPlanes: [number, number][] = [[0, 1], [0, 2], [1, 2]];

// The ellipsoid of the shifts on three planes, one scale; the line is its longest axis.
function Ellipsoid({ covariance, of }: { covariance: number[]; of: string }) {
  const axes = eigenOf(covariance), k = 2, most = k * Math.sqrt(axes[0]!.value) * 1.12 || 1;
  const kSide = 190, kGap = 18, r = kSide / 2 - 16, scale = r / most;
  const along = axes[0]!.vector, weakest = k * Math.sqrt(axes[0]!.value);
  return (
    <Picture title="How well its place is held" file={`${of} ellipsoid`}>
      <svg class="chart wide" viewBox={`0 0 ${3 * kSide + 2 * kGap} ${kSide + 26}`} role="img" aria-label={`Ellipsoid of the shifts, k = 2, part axes: semi-axes ${axes.map(({ value }) => number(k * Math.sqrt(value), 2)).join(', ')} micrometres; the longest along (${along.map((c) => number(c, 2)).join(', ')}).`}>
        {kPlanes.map(([i, j], n) => {
          const { longer, shorter, turnRad } = shadowOf(covariance, i, j), cx = n * (kSide + kGap) + kSide / 2, cy = kSide / 2;
          return (
            <g key={n}>
              <rect class="panel" x={cx - kSide / 2} y={0} width={kSide} height={kSide} rx={4} />
              <path class="axis" d={`M${cx - r} ${cy}h${2 * r}M${cx} ${cy - r}v${2 * r}`} />
              <ellipse class="ellipse" cx={cx} cy={cy} rx={k * longer * scale} ry={k * shorter * scale} transform={`rotate(${(-turnRad * 180) / Math.PI} ${cx} ${cy})`} />
              <path class="weakest" d={`M${cx - along[i]! * weakest * scale} ${cy + along[j]! * weakest * scale}L${cx + along[i]! * weakest * scale} ${cy - along[j]! * weakest * scale}`} />
              <text x={cx + r + 2} y={cy - 5} text-anchor="end">{'xyz'[i]}</text><text x={cx + 5} y={cy - r + 8}>{'xyz'[j]}</text>
            </g>
          );
        })}
        <path class="whisker" d={`M2 ${kSide + 12}v8m0 -4h${most * scale / 2}m0 -4v8`} /><text x={most * scale / 2 + 10} y={kSide + 20}>{number(most / 2, 2)}&#8239;µm</text>
      </svg>
      <p class="small muted">Part axes; semi-axes U (k = 2) {axes.map(({ value }) => number(k * Math.sqrt(value), 2)).join(', ')}&#8239;µm of the shift, everything counted: noise, calibrations, angles. The line is the direction that is held least.</p>
    </Picture>
  );
}

const kRegions: Column<RegionResidual & { key: string }>[] = [
  { head: 'Place', cell: (r) => r.key, csv: (r) => r.key },
  { head: 'x', unit: 'mm', isNumber: true, cell: (r) => number(r.centreMm?.xMm, 2), csv: (r) => r.centreMm?.xMm }, { head: 'y', unit: 'mm', isNumber: true, cell: (r) => number(r.centreMm?.yMm, 2), csv: (r) => r.centreMm?.yMm }, { head: 'z', unit: 'mm', isNumber: true, cell: (r) => number(r.centreMm?.zMm, 2), csv: (r) => r.centreMm?.zMm },
  { head: 'Mean offset', unit: 'µm', isNumber: true, cell: (r) => number(r.meanUm, 1), csv: (r) => r.meanUm }, { head: 'Points', isNumber: true, cell: (r) => count(r.pointCount), csv: (r) => r.pointCount },
  { head: 'Used', isNumber: true, cell: (r) => percent(r.usedPart), csv: (r) => r.usedPart },
];
const kScans: Column<ScanEvidence>[] = [
  { head: 'Scan', cell: (s) => idOf(s.scan), csv: (s) => s.scan }, { head: 'Points', isNumber: true, cell: (s) => count(s.pointCount), csv: (s) => s.pointCount },
  { head: 'Used', isNumber: true, cell: (s) => count(s.pointsUsed), csv: (s) => s.pointsUsed }, { head: 'Median offset', unit: 'µm', isNumber: true, cell: (s) => number(orNone(s.residualMedianUm), 2), csv: (s) => orNone(s.residualMedianUm) },
];
const kPairs: Column<ScanAgreement>[] = [
  { head: 'Scan', cell: (a) => idOf(a.scan), csv: (a) => a.scan }, { head: 'Other scan', cell: (a) => idOf(a.otherScan), csv: (a) => a.otherScan }, { head: 'Patches', isNumber: true, cell: (a) => count(a.patchCount), csv: (a) => a.patchCount },
  { head: 'Differ by, rms', unit: 'µm', isNumber: true, cell: (a) => number(a.differenceRmsUm, 2), csv: (a) => a.differenceRmsUm }, { head: 'By noise', unit: 'µm', isNumber: true, cell: (a) => number(a.expectedRmsUm, 2), csv: (a) => a.expectedRmsUm },
  { head: 'Of noise', cell: (a) => <AgainstLimit value={a.differenceRmsUm} limit={a.expectedRmsUm} isLeast={false} passed={a.differenceRmsUm <= 2 * a.expectedRmsUm} words={`${number(a.differenceRmsUm / Math.max(1e-9, a.expectedRmsUm), 1)} times what noise explains`} />, csv: (a) => a.differenceRmsUm / a.expectedRmsUm },
];
const kDatums: Column<DatumResidual>[] = [
  { head: 'Datum', cell: (d) => d.datum, csv: (d) => d.datum }, { head: 'Distance ± U', unit: 'µm', isNumber: true, cell: (d) => withUncertainty(d.distanceUm, 2 * d.standardUncertaintyUm, '').trim(), csv: (d) => d.distanceUm },
  { head: 'u', unit: 'µm', isNumber: true, cell: (d) => number(d.standardUncertaintyUm, 2), csv: (d) => d.standardUncertaintyUm }, { head: 'Points', isNumber: true, cell: (d) => count(d.pointCount), csv: (d) => d.pointCount },
];

function Pose({ evidence, part }: { evidence: Evidence; part: Part | undefined }) {
  const d = evidence.disagreement;
  return (
    <section class="section" aria-labelledby="datums-title">
      <h2 id="datums-title">Six points against the best fit</h2>
      <div class="sheet two">
        <div>
          {d ? <>
            <p>{d.beyond ? <Mark tone="bad">They disagree</Mark> : <Mark tone="good">They agree</Mark>} by at most {withUncertainty(d.greatestUm, 2 * d.standardUncertaintyUm, 'µm')}: {number(d.ratio, 1)} standard uncertainties of at most {kRatioLimit}.</p>
            <AgainstLimit value={d.ratio} limit={kRatioLimit} isLeast={false} passed={!d.beyond} words={`${number(d.ratio, 1)} standard uncertainties of at most ${kRatioLimit}`} />
            <p class="small muted">{d.pointMm && <>Greatest at ({[d.pointMm.xMm, d.pointMm.yMm, d.pointMm.zMm].map((mm) => number(mm, 1)).join(', ')})&#8239;mm of the part. </>}{d.beyond ? 'Part and CAD differ in shape, or the datum areas in place.' : 'As far as noise and calibrations explain.'}</p>
          </> : <p class="muted">The two were not compared: the method is none of six points, or all points allow no best fit.</p>}
          {evidence.datums.length > 0 && <Picture title="Scanned surface from the best-fitted CAD at the datum points" file="datum points">
            <AboutZero bars={evidence.datums.map((one) => ({ name: one.datum, value: one.distanceUm, expanded: 2 * one.standardUncertaintyUm }))} unit="µm" decimals={1} label="Distance at each datum point" /></Picture>}
        </div>
        {evidence.datums.length > 0 ? <Table caption="Datum points" columns={kDatums} rows={evidence.datums} rowKey={(one) => one.datum} /> : <p class="muted">{part?.sixPoints.length === 0 ? 'The part has no datum points.' : 'No datum points took part.'}</p>}
      </div>
    </section>
  );
}

const kPatches: Column<AllowancePatch>[] = [
  { head: 'x', unit: 'mm', isNumber: true, cell: (p) => number(p.pointMm?.xMm, 2), csv: (p) => p.pointMm?.xMm }, { head: 'y', unit: 'mm', isNumber: true, cell: (p) => number(p.pointMm?.yMm, 2), csv: (p) => p.pointMm?.yMm }, { head: 'z', unit: 'mm', isNumber: true, cell: (p) => number(p.pointMm?.zMm, 2), csv: (p) => p.pointMm?.zMm },
  { head: 'Stock ± U', unit: 'mm', isNumber: true, cell: (p) => withUncertainty(p.stockMm, (2 * p.standardUncertaintyUm) / 1000, '').trim(), csv: (p) => p.stockMm }, { head: 'Share', isNumber: true, cell: (p) => percent(p.share), csv: (p) => p.share },
];
const kSides: Column<AllowanceSide>[] = [
  { head: 'Looks along', cell: (s) => (s.direction ? [s.direction.x, s.direction.y, s.direction.z].map((c) => number(c, 0)).join(', ') : ''), csv: (s) => s.direction && `${s.direction.x} ${s.direction.y} ${s.direction.z}` },
  { head: 'Area', unit: 'mm²', isNumber: true, cell: (s) => number(s.areaMm2, 0), csv: (s) => s.areaMm2 }, { head: 'Seen', isNumber: true, cell: (s) => percent(s.seenPart), csv: (s) => s.seenPart },
];

// Whether the part lies inside its blank, and what keeps it from lying better.
function InBlank({ allowance, regionsWord }: { allowance: Allowance; regionsWord: string }) {
  return (
    <section class="section" aria-labelledby="blank-title">
      <h2 id="blank-title">The part in its blank</h2>
      <p>{allowance.lackingMm > 0 ? <Mark tone="bad">It cannot be made from this blank</Mark> : <Mark tone="good">It lies inside the blank</Mark>} Least stock {quantity(allowance.leastStockMm, 'mm', 3)}{allowance.lackingMm > 0 && `, ${quantity(allowance.lackingMm, 'mm', 3)} short`}{regionsWord}.</p>
      <div class="two">
        {allowance.holding.length > 0 ? <Table caption={allowance.lackingMm > 0 ? 'Patches that conflict' : 'Patches that hold it'} columns={kPatches} rows={allowance.holding} rowKey={(p) => `${p.pointMm?.xMm} ${p.pointMm?.yMm} ${p.pointMm?.zMm}`} /> : <p class="muted">Nothing holds it: it may still move.</p>}
        <Table caption="Sides, and what of them was seen" columns={kSides} rows={allowance.sides} rowKey={(s) => `${s.direction?.x} ${s.direction?.y} ${s.direction?.z}`} />
      </div>
    </section>
  );
}

function Overlaps({ evidence }: { evidence: Evidence }) {
  const merge = evidence.merge, off = evidence.agreements.filter((one) => one.differenceRmsUm > 2 * one.expectedRmsUm);
  return (
    <section class="section" aria-labelledby="overlaps-title">
      <h2 id="overlaps-title">Scans against each other</h2>
      {merge && (merge.freedom === 0 ? <p class="muted">The scans share no surface: nothing is known of how they agree.</p>
        : <p>{merge.beyond ? <Mark tone="bad">They do not put the surface at one place</Mark> : <Mark tone="good">They put the surface at one place</Mark>} χ² = {number(merge.chiSquared, 1)} of at most {number(merge.limit, 1)}, {plural(merge.freedom, 'degree')} of freedom{merge.beyond && '. A rotation centre, an angle or the sensor is not where its calibration says'}.</p>)}
      {off.length > 0 && <p><Mark tone="unsure">{plural(off.length, 'overlap')} {off.length === 1 ? 'disagrees' : 'disagree'}</Mark> by more than twice what noise explains: {off.map((one) => `${idOf(one.scan)} and ${idOf(one.otherScan)}`).join('; ')}.</p>}
      {evidence.agreements.length > 0 && <Table caption="Overlaps" columns={kPairs} rows={[...evidence.agreements].sort((a, b) => b.differenceRmsUm / b.expectedRmsUm - a.differenceRmsUm / a.expectedRmsUm)} rowKey={(a) => `${a.scan} ${a.otherScan}`} />}
      <Table caption="Scans" columns={kScans} rows={evidence.scans} rowKey={(s) => s.scan} />
    </section>
  );
}

function Body({ facts }: { facts: Facts }) {
  const { registration, part } = facts, evidence = registration.evidence!;
  const [picked, setPicked] = useState<string>();
  const covariance = useMemo(() => shiftCovarianceInPart(registration), [registration]);
  const displacement = useMemo(() => part && displacementOf(registration, part), [registration, part]);
  const regions = evidence.regions.map((region, i) => ({ ...region, key: `R${i + 1}` }));
  const most = Math.max(1, ...regions.map(({ meanUm }) => Math.abs(meanUm)));
  // Regions as balls of their deviation's colour; the ellipsoid, and how the weakest direction would move the datum points, both magnified alike.
  const drawn = useMemo(() => (module: SceneModule): Drawn => {
    const scale = module.roundScale(most), marks = regions.map(({ key, centreMm, meanUm }) => ({ key, pointMm: vectorOf(centreMm), colour: module.colourOf(meanUm, scale, scale / 5), size: 0.7 + Math.abs(meanUm) / most }));
    if (!covariance || !registration.covariance?.referenceMm || !registration.zeroFromPart) return { marks };
    const zeroFromPart = rigid(registration.zeroFromPart), back = inverse(zeroFromPart), centreMm = apply(back, vectorOf(registration.covariance.referenceMm));
    const axes = eigenOf(covariance), longest = 2 * Math.sqrt(axes[0]!.value) || 1, mmPerUm = 9 / longest;
    const ellipsoid = { centreMm, colour: [226, 150, 30] as [number, number, number], semiAxesMm: axes.map(({ value, vector }) => times(vector, 2 * Math.sqrt(value) * mmPerUm)) as [Vector, Vector, Vector] };
    const w = evidence.weakestDirection;
    if (w.length !== 6) return { marks, ellipsoid };
    const turn: Vector = [w[0]!, w[1]!, w[2]!], shift: Vector = [w[3]!, w[4]!, w[5]!], about = vectorOf(registration.covariance.referenceMm);
    const points = (part?.sixPoints ?? []).map(({ pointInPartMm }) => vectorOf(pointInPartMm));
    const gyration = Math.max(1, Math.sqrt(points.reduce((sum, p) => sum + length([p[0] - centreMm[0], p[1] - centreMm[1], p[2] - centreMm[2]]) ** 2, 0) / Math.max(1, points.length)));
    const linear = { linear: back.linear, shift: [0, 0, 0] as Vector };
    const arrows = points.map((p) => {
      const m = apply(zeroFromPart, p), d: Vector = [m[0] - about[0], m[1] - about[1], m[2] - about[2]];
      const move: Vector = [shift[0] + (turn[1] * d[2] - turn[2] * d[1]) / gyration, shift[1] + (turn[2] * d[0] - turn[0] * d[2]) / gyration, shift[2] + (turn[0] * d[1] - turn[1] * d[0]) / gyration];
      return { fromMm: p, toMm: moved(p, times(apply(linear, move), 9)), colour: [226, 150, 30] as [number, number, number] };
    });
    return { marks, ellipsoid, arrows };
  }, [registration, part]);
  const one = regions.find(({ key }) => key === picked);
  return (
    <>
      <div class="blade-top">
        <div class="sheet">
          <VerdictMark verdict={Outcome[evidence.outcome] ?? ''} big />
          {evidence.remark && <p><Mark tone="unsure">{evidence.remark}</Mark></p>}
          <dl class="pairs">
            <dt>Blade</dt><dd><a href={pageOf(registration.blade)}>{idOf(registration.blade)}</a>{registration.forInspection && <span class="muted"> for its verdict</span>}</dd>
            <dt>Part</dt><dd><a href={pageOf(`${registration.part}@${registration.partRevision}`)}>{idOf(registration.part)}</a> <span class="muted">revision {registration.partRevision}</span></dd>
            <dt>Machine</dt><dd><a href={pageOf(registration.machine)}>{idOf(registration.machine)}</a>{registration.clamping && `, clamping ${registration.clamping}`}</dd>
            <dt>Method</dt><dd>{methodWords(Method[registration.method] ?? '')}</dd>
            <dt>Scanner</dt><dd><a href={pageOf(registration.sensorCalibration)}>{shortId(registration.sensorCalibration)}</a>{registration.sensorCalibrationAsked && <Mark tone="unsure">asked for, not the one of then</Mark>}</dd>
            <dt>Rotary axes</dt><dd><a href={pageOf(registration.rotationCalibration)}>{shortId(registration.rotationCalibration)}</a></dd>
            <dt>Made</dt><dd>{full(dateOf(registration.recordedAt))} by {personOf(registration.requestedBy)}</dd>
          </dl>
        </div>
        <div class="sheet">
          <h2>Evidence</h2>
          <dl class="pairs">
            <dt>Residuals</dt><dd>rms {quantity(orNone(evidence.residualRmsUm), 'µm', 1)}, robust {quantity(orNone(evidence.residualSigmaUm), 'µm', 1)}</dd>
            <dt>Points used</dt><dd>{count(evidence.pointsUsed)} of {count(evidence.pointCount)}</dd>
            {evidence.surfacePart !== undefined && <><dt>CAD seen</dt><dd>{percent(evidence.surfacePart)} of its area</dd></>}
            {evidence.informationKept !== undefined && <><dt>Information kept</dt><dd>{percent(evidence.informationKept)} <span class="muted">at least 50&#8239;%</span></dd></>}
            <dt>Condition number</dt><dd>{number(orNone(evidence.conditionNumber), 1)} <span class="muted">at most 100</span></dd>
            <dt>Held least</dt><dd>{evidence.weakestDirectionInWords || 'not told'}: u = {quantity(orNone(evidence.weakestStandardUncertaintyUm), 'µm', 2)} <span class="muted">from noise and model</span></dd>
            {evidence.noiseSigmaUm !== undefined && <><dt>Noise, model</dt><dd>{quantity(evidence.noiseSigmaUm, 'µm', 2)} a point, {quantity(evidence.modelSigmaUm, 'µm', 2)} a patch of {quantity(evidence.patchMm, 'mm', 1)}</dd></>}
            <dt>Fit</dt><dd>{plural(evidence.iterationCount, 'iteration')}, {quantity(evidence.seconds, 's', 1)}{evidence.lastStepUm !== undefined && <>, last step {quantity(evidence.lastStepUm, 'µm', 3)}</>}</dd>
          </dl>
        </div>
      </div>
      <section class="section" aria-labelledby="places-title">
        <h2 id="places-title">Residuals by place</h2>
        <div class="two">
          {part ? <PartScene part={part} title={`${registration.name}, residuals by place`} markWord="Places and weakest direction" picked={picked} onPick={setPicked} drawn={drawn}
            label={`The part in 3D with ${regions.length} places coloured by their mean offset, the ellipsoid of the shifts, and how the weakest direction would move the datum points.`} /> : <p class="muted">The part's record is not there: nothing can be drawn.</p>}
          <div>
            <p class="small muted">Balls: mean offset of the scans from the CAD, blue inside, red outside, grey within a fifth of {number(most, 0)}&#8239;µm; greater where it is greater. Orange: ellipsoid of the shifts, and arrows along which the datum points would move least noticed; not to scale.</p>
            <Table caption="Places" columns={kRegions} rows={regions} rowKey={(r) => r.key} picked={one?.key} onPick={(r) => setPicked(r.key === picked ? undefined : r.key)} />
          </div>
        </div>
      </section>
      <section class="section" aria-label="Pose"><div class="sheet two">{covariance ? <Ellipsoid covariance={covariance} of={idOf(registration.blade)} /> : <p class="muted">There is no pose, and so no uncertainty of it.</p>}
        {displacement && <SixDegrees displacement={displacement} of={idOf(registration.blade)} />}</div></section>
      {evidence.allowance && <InBlank allowance={evidence.allowance} regionsWord={(registration.options?.regionsIn.length ?? 0) > 0 ? ', within the regions asked for' : ''} />}
      {registration.method !== Method.ALLOWANCE && <Pose evidence={evidence} part={part} />}
      <Overlaps evidence={evidence} />
    </>
  );
}

export default function RegistrationPage({ argument: id }: { argument: string }) {
  const name = `registrations/${id}`;
  const asked = useAsked([name], (signal) => factsOf(name, signal));
  return (
    <>
      <div class="page-head"><Heading title={`Registration ${shortId(name)}`}>Registration <span class="muted">{shortId(name)}</span></Heading></div>
      <Shown asked={asked} what="the registration">{(facts) => (facts.registration.evidence ? <Body facts={facts} /> : <p class="muted">No evidence was kept with it.</p>)}</Shown>
    </>
  );
}
