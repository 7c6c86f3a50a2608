// Where each hole lies beside where it was drawn, how it leans, how wide it is, and how far it is to the next.
import { AlongIs, HoleMeasuredBy, type HolePitch, type HoleResult, type SignedValue } from '#proto/sixpoint/inspection/v1/inspection_pb';
import { kNotMeasured, number, withUncertainty } from '../words/quantity';
import { Table, type Column } from '../view/table';
import type { HoleFacts } from './blade_facts';

const kAlong: Record<AlongIs, string> = {
  [AlongIs.UNSPECIFIED]: '', [AlongIs.AXIS_IN_SURFACE]: 'as the hole leans', [AlongIs.PART_Z]: 'the part’s Z', [AlongIs.PART_X]: 'the part’s X',
};
const kMeasuredBy: Record<HoleMeasuredBy, string> = { [HoleMeasuredBy.UNSPECIFIED]: '', [HoleMeasuredBy.PIN]: 'pin', [HoleMeasuredBy.BORE]: 'its wall' };

// Older inspections were kept without it: that is not the same as not measured.
const lacking = (result: HoleResult): string => (result.positionErrorMm === undefined ? kNotMeasured : 'not kept');
const signed = (value: SignedValue | undefined, unit: string): string => withUncertainty(value?.value, value?.expandedUncertainty, unit, unit === 'deg' ? 3 : 1).trim();

export function diameterWords(result: HoleResult, unit = ''): string {
  const { diameter } = result;
  if (diameter) return withUncertainty(diameter.diameterMm, diameter.expandedUncertaintyUm / 1000, unit).trim();
  return result.diameterReason || lacking(result);
}

type Of = 'alongUm' | 'acrossUm' | 'inclinationAlongDeg' | 'inclinationAcrossDeg';
const along = (head: string, of: Of, unit: string): Column<HoleResult> => ({
  head, unit, isNumber: true, cell: (r) => (r.displacement ? signed(r.displacement[of], '') : lacking(r)), csv: (r) => r.displacement?.[of]?.value,
});
const uncertain = (head: string, of: Of, unit: string): Column<HoleResult> => ({ head, unit, cell: () => '', csv: (r) => r.displacement?.[of]?.expandedUncertainty });

const kColumns: Column<HoleResult>[] = [
  { head: 'Hole', cell: (r) => `${r.group}/${r.hole}`, csv: (r) => `${r.group}/${r.hole}` },
  along('Along ± U', 'alongUm', 'µm'), along('Across ± U', 'acrossUm', 'µm'), along('Leans along ± U', 'inclinationAlongDeg', 'deg'), along('Leans across ± U', 'inclinationAcrossDeg', 'deg'),
  { head: 'Along is', cell: (r) => kAlong[r.displacement?.alongIs ?? AlongIs.UNSPECIFIED], csv: (r) => r.displacement && AlongIs[r.displacement.alongIs] },
  { head: 'Diameter ± U', unit: 'mm', isNumber: true, cell: (r) => (r.diameter ? diameterWords(r) : ''), csv: (r) => r.diameter?.diameterMm },
  { head: 'By', cell: (r) => kMeasuredBy[r.measuredBy ?? HoleMeasuredBy.UNSPECIFIED], csv: (r) => kMeasuredBy[r.measuredBy ?? HoleMeasuredBy.UNSPECIFIED] },
  { head: 'Why no diameter', cell: (r) => (r.diameter ? '' : <span class="wrapped">{diameterWords(r)}</span>), csv: (r) => (r.diameter ? '' : diameterWords(r)) },
];
const kCsv: Column<HoleResult>[] = [...kColumns, uncertain('along U', 'alongUm', 'um'), uncertain('across U', 'acrossUm', 'um'), uncertain('leans along U', 'inclinationAlongDeg', 'deg'), uncertain('leans across U', 'inclinationAcrossDeg', 'deg'),
  { head: 'diameter U', unit: 'um', cell: () => '', csv: (r) => r.diameter?.expandedUncertaintyUm }];

const kPitches: Column<HolePitch>[] = [
  { head: 'Row', cell: (p) => p.group, csv: (p) => p.group }, { head: 'From', cell: (p) => p.from, csv: (p) => p.from }, { head: 'To', cell: (p) => p.to, csv: (p) => p.to },
  { head: 'Pitch ± U', unit: 'mm', isNumber: true, cell: (p) => withUncertainty(p.pitchMm, p.expandedUncertaintyUm === undefined ? undefined : p.expandedUncertaintyUm / 1000, '').trim(), csv: (p) => p.pitchMm },
  { head: 'Drawn', unit: 'mm', isNumber: true, cell: (p) => number(p.nominalPitchMm, 3), csv: (p) => p.nominalPitchMm },
  { head: 'P/D ± U', isNumber: true, cell: (p) => withUncertainty(p.pitchOverDiameter, p.pitchOverDiameterExpandedUncertainty, '').trim(), csv: (p) => p.pitchOverDiameter },
  { head: 'Why', cell: (p) => (p.reason ? <span class="wrapped">{p.reason}</span> : ''), csv: (p) => p.reason },
];
const kPitchesCsv: Column<HolePitch>[] = [...kPitches, { head: 'pitch U', unit: 'um', cell: () => '', csv: (p) => p.expandedUncertaintyUm }, { head: 'P/D U', cell: () => '', csv: (p) => p.pitchOverDiameterExpandedUncertainty }];

// Of one hole, for where it is picked.
export function Displaced({ result }: { result: HoleResult }) {
  const { displacement: d } = result;
  return (
    <>
      {d && <><dt>Displaced</dt><dd>along {signed(d.alongUm, 'µm')}, across {signed(d.acrossUm, 'µm')} <span class="muted">along: {kAlong[d.alongIs]}</span></dd>
        <dt>Leans</dt><dd>along {signed(d.inclinationAlongDeg, 'deg')}, across {signed(d.inclinationAcrossDeg, 'deg')}</dd></>}
      {(result.diameter || result.diameterReason) && <><dt>Diameter</dt><dd>{diameterWords(result, 'mm')}</dd></>}
    </>
  );
}

// Below the verdicts, folded: nothing of it is judged here.
export function Displacements({ holes, pitches }: { holes: HoleFacts[]; pitches: HolePitch[] }) {
  const results = holes.flatMap(({ result }) => result ?? []);
  if (pitches.length === 0 && !results.some((one) => one.displacement ?? one.diameter)) return null;
  return (
    <details class="no-print" id="displacements"><summary>Displacement, lean, diameter and pitch</summary>
      <div class="section">
        <Table caption="Displacement, lean and diameter" columns={kColumns} copiedColumns={kCsv} rows={results} rowKey={(r) => `${r.group}/${r.hole}`} />
        <p class="small muted">In the surface at the drawn start. Along: as the drawn hole leans, or where it stands upright an axis of the part; across: by the right hand about the normal. Leans along: flatter than drawn.</p>
        {pitches.length > 0 && <Table caption="Pitch" columns={kPitches} copiedColumns={kPitchesCsv} rows={pitches} rowKey={(p) => `${p.group} ${p.from} ${p.to}`} />}
      </div>
    </details>
  );
}
