// What rests on a calibration: counted and listed as far as the plant tells in two thousand entries at a time; and judged anew, which verdicts flip.
import { useEffect, useRef, useState } from 'preact/hooks';
import { timestampFromDate } from '@bufbuild/protobuf/wkt';
import { InspectionService, Verdict, type FlippedHole, type RejudgeResponse } from '#proto/sixpoint/inspection/v1/inspection_pb';
import { RecordService, type RecordEntry } from '#proto/sixpoint/plant/v1/record_pb';
import { client } from '../plant/clients';
import { useMay } from '../plant/may';
import { usePaged } from '../plant/paged';
import { refusalOf, type Refusal } from '../plant/refusal';
import { idOf, pageOf, personOf, shortId } from '../words/name';
import { count, plural } from '../words/quantity';
import { dateOf, full } from '../words/time';
import { AskWhy } from '../view/ask_why';
import { VerdictMark } from '../view/mark';
import { ListState, Refused } from '../view/states';
import { CopyCsv, Table, type Column } from '../view/table';

const kPageSize = 1000, kShown = 200;
const kKinds = ['calibration', 'registration', 'correction', 'inspection', 'study'];

const Link = ({ name }: { name: string }) => {
  const page = pageOf(name);
  return page ? <a href={page} title={name}>{shortId(name)}</a> : <span title={name}>{shortId(name)}</span>;
};
const kColumns: Column<RecordEntry>[] = [
  { head: 'What', cell: (e) => e.kind, csv: (e) => e.kind }, { head: 'Name', cell: (e) => <Link name={e.name} />, csv: (e) => e.name },
  { head: 'Blade', cell: (e) => (e.blade ? <Link name={e.blade} /> : ''), csv: (e) => e.blade && idOf(e.blade) },
  { head: 'Verdict or outcome', cell: (e) => (e.verdict ? <VerdictMark verdict={e.verdict} /> : ''), csv: (e) => e.verdict },
  { head: 'State', cell: (e) => (e.state ? <VerdictMark verdict={e.state} /> : ''), csv: (e) => e.state },
  { head: 'Recorded', cell: (e) => full(dateOf(e.recordedAt)), csv: (e) => dateOf(e.recordedAt)?.toISOString() }, { head: 'By', cell: (e) => personOf(e.requestedBy), csv: (e) => e.requestedBy },
];

export function Resting({ name }: { name: string }) {
  const [kind, setKind] = useState('');
  const list = usePaged([name], async (pageToken, signal) => {
    const page = await client(RecordService).recall({ name, kinds: kKinds, pageSize: kPageSize, pageToken }, { signal });
    return { rows: page.entries, nextPageToken: page.nextPageToken };
  }, ({ entry }) => entry?.inputs.includes(name) ?? false);
  const entries = list.rows ?? [], blades = new Set(entries.map(({ blade }) => blade).filter((blade) => blade !== ''));
  const rows = kind === '' ? entries : entries.filter((entry) => entry.kind === kind);
  const number = (of: string) => entries.filter((entry) => entry.kind === of).length;
  return (
    <section class="section" aria-labelledby="resting-title">
      <div class="table-head"><h2 id="resting-title">What rests on it</h2><CopyCsv columns={kColumns} rows={rows} what="what rests on it" /></div>
      <ListState list={list} what="what rests on it" />
      {list.rows && <>
        <dl class="sums">
          <div><dt>Blades</dt><dd>{list.hasMore && <span class="muted">at least </span>}{count(blades.size)}</dd></div>
          {kKinds.filter((one) => number(one) > 0).map((one) => <div key={one}><dt>{one[0]!.toUpperCase() + one.slice(1)}s</dt><dd>{list.hasMore && <span class="muted">at least </span>}{count(number(one))}</dd></div>)}
        </dl>
        {entries.length === 0 ? <p class="muted">Nothing was made from it{' '}that you may see.</p> : <>
          <div class="view-tools"><label>Only <select value={kind} onChange={(event) => setKind(event.currentTarget.value)}>
            <option value="">all</option>{kKinds.map((one) => <option key={one} value={one}>{one}s</option>)}</select></label>
            {list.hasMore && <button type="button" disabled={list.isAsking} onClick={list.more}>{list.isAsking ? 'Counting…' : 'Count on'}</button>}
            <span class="small muted" role="status">{rows.length > kShown ? `The first ${kShown} of ${count(rows.length)} are shown, all are copied.` : plural(rows.length, 'entry', 'entries')}</span></div>
          <Table caption="Entries of the record that rest on it" showCaption={false} isCopied={false} columns={kColumns} rows={rows.slice(0, kShown)} rowKey={(e) => e.name} />
        </>}
      </>}
    </section>
  );
}

type Flip = { blade: string; before: Verdict; now: Verdict | undefined; inspection: string; refusal: string; holes: FlippedHole[] };
const word = (verdict: Verdict | undefined) => Verdict[verdict ?? Verdict.UNSPECIFIED] ?? '';
const holesWords = (holes: FlippedHole[]) => holes.map((hole) => `${hole.group}/${hole.hole}: ${word(hole.before)} to ${word(hole.now)}`).join('; ').toLowerCase().replaceAll('_', ' ');
const kFlips: Column<Flip>[] = [
  { head: 'Blade', cell: (f) => <Link name={f.blade} />, csv: (f) => idOf(f.blade) },
  { head: 'Before', cell: (f) => <VerdictMark verdict={word(f.before)} />, csv: (f) => word(f.before) }, { head: 'Now', cell: (f) => (f.now === undefined ? <span class="tone-bad">{f.refusal}</span> : <VerdictMark verdict={word(f.now)} />), csv: (f) => (f.now === undefined ? f.refusal : word(f.now)) },
  { head: 'Holes that flip', cell: (f) => holesWords(f.holes), csv: (f) => holesWords(f.holes) },
];

// Judges by what is in force now. A call that broke off goes on behind the last answer, by the same request.
export function Rejudge({ name }: { name: string }) {
  const may = useMay(InspectionService.method.rejudge);
  const [flips, setFlips] = useState<Flip[]>([]);
  const [told, setTold] = useState<{ finished: number; total: number; flipped: number; isOver: boolean }>();
  const [refusal, setRefusal] = useState<Refusal>();
  const stop = useRef(new AbortController()), asked = useRef<{ requestId: string; before: Date; after: string }>();
  useEffect(() => () => stop.current.abort(), []);
  const take = (answer: RejudgeResponse) => {
    asked.current!.after = answer.rejudged;
    setTold({ finished: answer.finishedCount, total: answer.totalCount, flipped: answer.flipCount, isOver: false });
    const { result } = answer;
    if (!answer.flips && answer.flippedHoles.length === 0 && result.case !== 'refusal') return;
    setFlips((old) => [...old, {
      blade: answer.blade, before: answer.before, now: result.case === 'inspection' ? result.value.verdict : undefined, inspection: result.case === 'inspection' ? result.value.name : '',
      refusal: result.case === 'refusal' ? result.value.message : '', holes: answer.flippedHoles,
    }]);
  };
  const goOn = async () => {
    const { requestId, before, after } = asked.current!;
    setRefusal(undefined);
    try {
      for await (const answer of client(InspectionService).rejudge({ recall: name, recordedBefore: timestampFromDate(before), requestId, after }, { signal: stop.current.signal })) take(answer);
      setTold((old) => ({ ...(old ?? { finished: 0, total: 0, flipped: 0 }), isOver: true }));
    } catch (error) {
      if (!stop.current.signal.aborted) setRefusal(refusalOf(error));
    }
  };
  if (!may && !told) return null;
  return (
    <section class="section no-print" aria-labelledby="rejudge-title">
      <div class="table-head"><h2 id="rejudge-title">Which verdicts flip</h2>
        {!told && <AskWhy button="Judge anew…" title="Judge anew what rests on it" verb="Judge anew" reason="none" act={async (_, requestId) => { asked.current = { requestId, before: new Date(), after: '' }; setTold({ finished: 0, total: 0, flipped: 0, isOver: false }); void goOn(); }}>
          Every inspection that rests on this calibration is judged once more, by the calibrations in force now. Each becomes a new inspection in the record; the old ones stay.</AskWhy>}</div>
      {!told && <p class="muted">The plant tells it by judging the same scans anew, by what is in force now.</p>}
      {told && <p role="status">{told.total > 0 ? `${count(told.finished)} of ${plural(told.total, 'inspection')} judged anew, ` : told.isOver ? 'No inspection rests on it, ' : 'Begun, '}{plural(told.flipped, 'verdict')} {told.flipped === 1 ? 'flips' : 'flip'}{told.isOver ? '.' : refusal ? ' so far.' : '…'}</p>}
      {told && told.total > 0 && <progress max={told.total} value={told.finished} aria-label="Inspections judged anew" />}
      {refusal && <Refused refusal={refusal} again={() => void goOn()} />}
      {flips.length > 0 && <Table caption="Flips, holes that flip, and refusals" columns={kFlips} rows={flips} rowKey={(f) => `${f.blade} ${f.inspection} ${f.refusal}`} />}
    </section>
  );
}
