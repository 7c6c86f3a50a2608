// Characteristic by characteristic: limits, value with U, verdict and why; what is out comes first.
import { useEffect, useMemo, useState } from 'preact/hooks';
import { Cure, type Assessment, type CharacteristicFinding } from '#proto/sixpoint/inspection/v1/assessment_pb';
import { Verdict } from '#proto/sixpoint/inspection/v1/inspection_pb';
import { CharacteristicClass, CharacteristicQuantity, CharacteristicUnit } from '#proto/sixpoint/plant/v1/drawing_pb';
import { Method } from '#proto/sixpoint/registration/v1/method_pb';
import { byWords, countsOf, groupWords, isZeroBest, kClassWords, kCureWords, kWorstFirst, limitsWords, otherWords, ruleWords, valueWords } from '../words/assessment';
import { count, plural } from '../words/quantity';
import { VerdictMark, verdictTone, verdictWords } from '../view/mark';
import { CopyCsv, Table, type Column } from '../view/table';
import { WithinLimits } from '../view/within_limits';
import { verdictName } from './blade_holes';
import { methodWords } from './blade_story';

const kPage = 100;

const methodOf = (method: Method): string => (method === Method.UNSPECIFIED ? '' : methodWords(Method[method] ?? ''));
const keyOf = (one: CharacteristicFinding): string => `${one.characteristic} ${one.feature}`;

function Bar({ one }: { one: CharacteristicFinding }) {
  const limited = { value: one.value, expanded: one.expandedUncertainty, lower: one.lowerLimit, upper: one.upperLimit, isZeroBest: isZeroBest(one) }, verdict = verdictName(one.verdict);
  return <WithinLimits limited={limited} tone={verdictTone(verdict)} words={`${valueWords(one)}, ${limitsWords(one)}: ${verdictWords(verdict)}`} />;
}

const Wrapped = ({ text }: { text: string }) => (text === '' ? null : <span class="wrapped">{text}</span>);
const othersOf = (one: CharacteristicFinding): string[] => one.others.map((other) => otherWords(one, other, methodOf(other.method)));

// Some columns stand only where a finding has something for them.
const kColumns: (Column<CharacteristicFinding> & { isShown?: (finding: CharacteristicFinding) => boolean })[] = [
  { head: 'No.', cell: (f) => f.characteristic, csv: (f) => f.characteristic },
  { head: 'Verdict', cell: (f) => <VerdictMark verdict={verdictName(f.verdict)} />, csv: (f) => verdictName(f.verdict) },
  { head: 'Name', cell: (f) => <Wrapped text={f.name} />, csv: (f) => f.name },
  { head: 'At', cell: (f) => f.feature, csv: (f) => f.feature, isShown: (f) => f.feature !== '' },
  { head: 'Class', cell: (f) => (f.characteristicClass === CharacteristicClass.CRITICAL ? <strong>critical</strong> : kClassWords[f.characteristicClass]), csv: (f) => kClassWords[f.characteristicClass] },
  { head: 'Limits', isNumber: true, cell: limitsWords, csv: limitsWords },
  { head: 'Value ± U', isNumber: true, cell: valueWords, csv: (f) => f.value },
  { head: 'Between its limits', cell: (f) => <Bar one={f} />, csv: () => undefined },
  { head: 'Cure', cell: (f) => kCureWords[f.cure], csv: (f) => kCureWords[f.cure], isShown: (f) => f.cure !== Cure.UNSPECIFIED },
  { head: 'Why', cell: (f) => <Wrapped text={f.reason} />, csv: (f) => f.reason, isShown: (f) => f.reason !== '' },
  { head: 'By', cell: (f) => byWords(f.result, methodOf(f.method)), csv: (f) => f.result },
  { head: 'Other values', cell: (f) => othersOf(f).map((text) => <div key={text}>{text}</div>), csv: (f) => othersOf(f).join('; '), isShown: (f) => f.others.length > 0 },
  { head: 'Rule', cell: (f) => ruleWords(f.decisionRule), csv: (f) => ruleWords(f.decisionRule) },
];

// Figures in full, a column each.
const kCsv: Column<CharacteristicFinding>[] = [
  ...kColumns.filter(({ head }) => !['Limits', 'Value ± U', 'Between its limits'].includes(head)),
  { head: 'quantity', cell: () => '', csv: (f) => CharacteristicQuantity[f.quantity] }, { head: 'unit', cell: () => '', csv: (f) => CharacteristicUnit[f.unit] },
  { head: 'nominal', cell: () => '', csv: (f) => f.nominal }, { head: 'lower limit', cell: () => '', csv: (f) => f.lowerLimit }, { head: 'upper limit', cell: () => '', csv: (f) => f.upperLimit },
  { head: 'value', cell: () => '', csv: (f) => f.value }, { head: 'U', cell: () => '', csv: (f) => f.expandedUncertainty }, { head: 'method', cell: () => '', csv: (f) => methodOf(f.method) },
];

export type Wanted = { verdict: Verdict; group: string; text: string; isAsDrawn: boolean };

export function findingsOf(findings: CharacteristicFinding[], places: Map<string, string> | undefined, { verdict, group, text, isAsDrawn }: Wanted): CharacteristicFinding[] {
  const sought = text.trim().toLowerCase();
  const some = findings.filter((one) => (verdict === Verdict.UNSPECIFIED || one.verdict === verdict) && (group === '' || places?.get(one.characteristic) === group)
    && (sought === '' || [one.characteristic, one.name, one.feature].some((word) => word.toLowerCase().includes(sought))));
  return isAsDrawn ? some : some.sort((a, b) => kWorstFirst.indexOf(a.verdict) - kWorstFirst.indexOf(b.verdict));
}

function Filters({ wanted, counts, groups, onChange }: { wanted: Wanted; counts: Map<Verdict, number>; groups: string[]; onChange: (change: Partial<Wanted>) => void }) {
  return (
    <div class="filters" role="group" aria-label="Which findings">
      <label>Verdict <select value={wanted.verdict} onChange={(event) => onChange({ verdict: Number(event.currentTarget.value) })}>
        <option value={Verdict.UNSPECIFIED}>Any</option>
        {kWorstFirst.map((verdict) => <option key={verdict} value={verdict}>{verdictWords(verdictName(verdict))} ({count(counts.get(verdict) ?? 0)})</option>)}</select></label>
      {groups.length > 1 && <label>Place <select value={wanted.group} onChange={(event) => onChange({ group: event.currentTarget.value })}>
        <option value="">Any</option>{groups.map((group) => <option key={group} value={group}>{groupWords(group)}</option>)}</select></label>}
      <label>Number, name or hole <input type="search" value={wanted.text} maxLength={64} spellcheck={false} autocomplete="off" onInput={(event) => onChange({ text: event.currentTarget.value })} /></label>
      <label>Order <select value={wanted.isAsDrawn ? 'drawn' : ''} onChange={(event) => onChange({ isAsDrawn: event.currentTarget.value === 'drawn' })}>
        <option value="">Not conform first</option><option value="drawn">As drawn</option></select></label>
    </div>
  );
}

export function Findings({ assessment, places, group, onGroup }: { assessment: Assessment; places: Map<string, string> | undefined; group: string; onGroup: (group: string) => void }) {
  const { findings } = assessment;
  const [wanted, setWanted] = useState<Omit<Wanted, 'group'>>({ verdict: Verdict.UNSPECIFIED, text: '', isAsDrawn: false });
  const [shown, setShown] = useState(kPage);
  const rows = useMemo(() => findingsOf(findings, places, { ...wanted, group }), [findings, places, wanted, group]);
  const counts = useMemo(() => countsOf(findings), [findings]);
  useEffect(() => setShown(kPage), [wanted, group]);
  const columns = useMemo(() => kColumns.filter(({ isShown }) => !isShown || findings.some(isShown)), [findings]);
  const change = ({ group: place, ...rest }: Partial<Wanted>) => {
    if (place !== undefined) onGroup(place);
    else setWanted({ ...wanted, ...rest });
  };
  return (
    <>
      <div class="table-head"><h3>Characteristics</h3><CopyCsv columns={kCsv} rows={rows} what="the characteristics" /></div>
      <Filters wanted={{ ...wanted, group }} counts={counts} groups={places ? assessment.groups.map((one) => one.group) : []} onChange={change} />
      <p class="small muted" role="status">{plural(rows.length, 'finding')}{rows.length < findings.length && ` of ${count(findings.length)}`}{rows.length > shown && `; the first ${shown} are shown, all are copied`}.</p>
      {rows.length > 0 && <Table caption="Characteristics" showCaption={false} isCopied={false} columns={columns} rows={rows.slice(0, shown)} rowKey={keyOf} />}
      {rows.length > shown && <p><button type="button" onClick={() => setShown(shown + kPage)}>Show {Math.min(kPage, rows.length - shown)} more</button></p>}
      <p class="small muted">U: expanded uncertainty, 95&#8239;%. In each bar the shaded part lies within the limits, the line is the value ± U. What was not measured has no value, and is no pass.</p>
    </>
  );
}
