// The holes of a blade in figures: as cut, as corrected, and what makes a value uncertain.
import { CopyCsv, Table, type Column } from '../view/table';
import { Verdict, type HolePitch } from '#proto/sixpoint/inspection/v1/inspection_pb';
import type { UncertaintyComponent } from '#proto/sixpoint/uncertainty/v1/uncertainty_pb';
import type { Correction } from '#proto/sixpoint/correction/v1/correction_pb';
import { kNotMeasured, number, percent, quantity, withUncertainty } from '../words/quantity';
import { dateOf, full } from '../words/time';
import { VerdictMark } from '../view/mark';
import { length } from '../scene/frames';
import type { HoleFacts } from './blade_facts';
import { DrawnBudget } from './drawn_budget';
import { Displaced, Displacements } from './hole_displacement';

export const verdictName = (verdict: Verdict | undefined): string => Verdict[verdict ?? Verdict.UNSPECIFIED] ?? '';
const mmOf = (um: number | undefined) => (um === undefined ? undefined : um / 1000);

const kAsCut: Column<HoleFacts>[] = [
  { head: 'Hole', cell: (h) => h.key, csv: (h) => h.key },
  { head: 'Verdict', cell: (h) => (h.result ? <VerdictMark verdict={verdictName(h.result.verdict)} /> : <span class="muted">not judged</span>), csv: (h) => (h.result ? verdictName(h.result.verdict) : '') },
  { head: 'Position ± U', unit: 'mm', isNumber: true, cell: (h) => (h.result ? withUncertainty(h.result.positionErrorMm, mmOf(h.result.positionExpandedUncertaintyUm), 'mm').replace(/\u202fmm$/, '') : ''), csv: (h) => h.result?.positionErrorMm },
  { head: 'at most', unit: 'mm', isNumber: true, cell: (h) => (h.result ? number(h.result.positionToleranceMm, 3) : ''), csv: (h) => h.result?.positionToleranceMm },
  { head: 'Inclination ± U', unit: 'deg', isNumber: true, cell: (h) => (h.result ? withUncertainty(h.result.inclinationErrorDeg, h.result.inclinationExpandedUncertaintyDeg, 'deg').replace(/\u202fdeg$/, '') : ''), csv: (h) => h.result?.inclinationErrorDeg },
  { head: 'at most ', unit: 'deg', isNumber: true, cell: (h) => (h.result ? number(h.result.inclinationToleranceDeg, 2) : ''), csv: (h) => h.result?.inclinationToleranceDeg },
  { head: 'Pin', unit: 'mm', isNumber: true, cell: (h) => (h.result ? number(h.result.pinDiameterMm, 4) : ''), csv: (h) => h.result?.pinDiameterMm },
  { head: 'Why', cell: (h) => h.result?.reason ?? '', csv: (h) => h.result?.reason ?? '' },
];
const kAsCutCsv: Column<HoleFacts>[] = [
  ...kAsCut,
  { head: 'position U', unit: 'um', cell: () => '', csv: (h) => h.result?.positionExpandedUncertaintyUm },
  { head: 'inclination U', unit: 'deg', cell: () => '', csv: (h) => h.result?.inclinationExpandedUncertaintyDeg },
];

export function AsCut({ holes, pitches, picked, onPick }: { holes: HoleFacts[]; pitches: HolePitch[]; picked: string | undefined; onPick: (key: string) => void }) {
  return (
    <section class="section" aria-labelledby="holes-title">
      <div class="table-head"><h2 id="holes-title">Holes as cut</h2><CopyCsv columns={kAsCutCsv} rows={holes} what="the holes as cut" /></div>
      <Table caption="Holes as cut" showCaption={false} isCopied={false} columns={kAsCut} rows={holes} rowKey={(h) => h.key} onPick={(h) => onPick(h.key)} picked={picked} />
      <p class="small muted">U: expanded uncertainty, 95&#8239;%. Conform only where value + U is within the limit, not conform only where value − U is beyond it (ISO 14253-1).</p>
      <Displacements holes={holes} pitches={pitches} />
    </section>
  );
}

const changed = (axis: 0 | 1 | 2, word: string): Column<HoleFacts> => ({ head: `Δ${word}`, unit: 'mm', isNumber: true, cell: (h) => number(h.shiftMm?.[axis], 3), csv: (h) => h.shiftMm?.[axis] });

export function Changes({ holes, correction }: { holes: HoleFacts[]; correction: Correction }) {
  const [a, b] = [correction.axes[0] ?? 'A', correction.axes[1] ?? 'B'];
  const rows = holes.filter((h) => h.corrected);
  const columns: Column<HoleFacts>[] = [
    { head: 'Hole', cell: (h) => (h.correctedGroup?.poses.length ? `${h.correctedGroup.group}, a path of ${h.correctedGroup.poses.length} poses` : h.key), csv: (h) => h.key },
    { head: a, unit: 'deg', isNumber: true, cell: (h) => number(h.correctedGroup?.aDeg, 4), csv: (h) => h.correctedGroup?.aDeg },
    { head: `Δ${a}`, unit: 'deg', isNumber: true, cell: (h) => number(h.correctedGroup && h.correctedGroup.aDeg - h.correctedGroup.aNominalDeg, 4), csv: (h) => h.correctedGroup && h.correctedGroup.aDeg - h.correctedGroup.aNominalDeg },
    { head: b, unit: 'deg', isNumber: true, cell: (h) => number(h.correctedGroup?.bDeg, 4), csv: (h) => h.correctedGroup?.bDeg },
    { head: `Δ${b}`, unit: 'deg', isNumber: true, cell: (h) => number(h.correctedGroup && h.correctedGroup.bDeg - h.correctedGroup.bNominalDeg, 4), csv: (h) => h.correctedGroup && h.correctedGroup.bDeg - h.correctedGroup.bNominalDeg },
    changed(0, 'X'), changed(1, 'Y'), changed(2, 'Z'),
    { head: 'Start moved', unit: 'mm', isNumber: true, cell: (h) => number(h.shiftMm && length(h.shiftMm), 3), csv: (h) => h.shiftMm && length(h.shiftMm) },
    { head: 'U of start', unit: 'µm', isNumber: true, cell: (h) => number(h.corrected?.expandedUncertaintyUm, 1), csv: (h) => h.corrected?.expandedUncertaintyUm },
    { head: 'Reported cut', cell: (h) => (h.corrected?.reportedCutAt ? full(dateOf(h.corrected.reportedCutAt)) : 'not reported'), csv: (h) => dateOf(h.corrected?.reportedCutAt)?.toISOString() },
  ];
  return (
    <section class="section no-print" aria-labelledby="changes-title">
      <Table caption="What changed against the nominal program" columns={columns} rows={rows} rowKey={(h) => h.key} />
      <p class="small muted" id="changes-title">Machine coordinates of the program, corrected less nominal.</p>
    </section>
  );
}

function Budget({ components, unit }: { components: UncertaintyComponent[]; unit: string }) {
  if (components.length === 0) return <p class="muted">No budget was kept with it.</p>;
  return (
    <ol class="budget">{components.map((component) => (
      <li key={component.source}><span>{component.source}</span><meter min={0} max={1} value={component.share} aria-label={`Share of ${component.source}`}>{percent(component.share)}</meter>
        <span class="num">{number(component.standardUncertaintyUm, 2)}&#8239;{unit}</span></li>
    ))}</ol>
  );
}

export function PickedHole({ hole, correction, isPicked }: { hole: HoleFacts | undefined; correction: Correction | undefined; isPicked: boolean }) {
  if (!hole) return <div class="sheet"><h3>No hole picked</h3><p class="muted">Click one in the picture, or its name in the table below, for what makes its position uncertain.</p></div>;
  const { result, corrected } = hole;
  return (
    <div class="sheet" aria-live="polite">
      <div class="table-head"><h3>{isPicked ? `Hole ${hole.key}` : `Worst hole: ${hole.key}`}</h3>{result && <VerdictMark verdict={verdictName(result.verdict)} />}</div>
      {result && <>
        <dl class="pairs">
          <dt>Position error</dt><dd>{withUncertainty(result.positionErrorMm, mmOf(result.positionExpandedUncertaintyUm), 'mm')} <span class="muted">of at most {quantity(result.positionToleranceMm, 'mm', 3)}</span></dd>
          <dt>Inclination error</dt><dd>{withUncertainty(result.inclinationErrorDeg, result.inclinationExpandedUncertaintyDeg, 'deg')} <span class="muted">of at most {quantity(result.inclinationToleranceDeg, 'deg', 2)}</span></dd>
          <dt>Pin seen</dt><dd>{quantity(result.pinDiameterMm, 'mm', 4)}{result.pinDiameterMm !== undefined && <span class="muted"> from {result.pointCount} points, scatter {quantity(result.pinResidualRmsUm, 'µm', 1)}</span>}</dd>
          <Displaced result={result} />
          {result.reason && <><dt>Why</dt><dd>{result.reason}</dd></>}
        </dl>
        {result.positionErrorMm !== undefined && <><h3>What makes the position uncertain</h3>
          <p class="small muted">Standard uncertainties (k = 1), the greatest first; bars: share of the variance.</p><Budget components={result.budget} unit="µm" /></>}
        {!isPicked && <p class="small muted">Click a hole in the picture, or its name in the table, for another.</p>}
      </>}
      {!result && <p class="muted">As cut: {kNotMeasured}.</p>}
      {corrected && <details open={!result}><summary>Of its corrected start: U = {quantity(corrected.expandedUncertaintyUm, 'µm', 1)}</summary><Budget components={corrected.budget} unit="µm" />
        {correction && hole.correctedGroup && <DrawnBudget correction={correction.name} group={hole.correctedGroup.group} hole={corrected.hole} />}</details>}
    </div>
  );
}
