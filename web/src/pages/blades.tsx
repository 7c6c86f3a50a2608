// Finding blades: by serial, machine, verdict, state, work order, part. The search stands in the URL.
import type { Blade } from '#proto/sixpoint/plant/v1/blade_pb';
import { PlantService } from '#proto/sixpoint/plant/v1/plant_pb';
import { client } from '../plant/clients';
import { usePaged } from '../plant/paged';
import { setQuery, useRoute } from '../plant/route';
import { idOf } from '../words/name';
import { plural } from '../words/quantity';
import { dateOf, full } from '../words/time';
import { verdictWords } from '../view/mark';
import { Heading } from '../view/shell';
import { Empty, Loading, Refused } from '../view/states';
import { Table, type Column } from '../view/table';

const kFields = ['serial', 'machine', 'part', 'order', 'verdict', 'state'] as const;
const kVerdicts = ['CONFORM', 'NOT_CONFORM', 'UNDECIDABLE', 'NOT_MEASURED'], kStates = ['DRAFT', 'RELEASED', 'CUT', 'REFUSED', 'SUPERSEDED', 'EXPIRED', 'WITHDRAWN'];
const kPageSize = 100;

// By kind of entry: what brings a blade, and what changes what is asked of one.
const kBringing = new Set(['blade', 'scan']), kJudging = new Set(['registration', 'correction', 'release', 'refusal', 'withdrawal', 'cut', 'inspection', 'assignment']);
const kPauseMs = 5000;  // a fleet at work tells of its blades all the time

const kColumns: Column<Blade>[] = [
  { head: 'Serial', cell: (b) => <a href={`/blades/${encodeURIComponent(idOf(b.name))}`}>{idOf(b.name)}</a>, csv: (b) => idOf(b.name) },
  { head: 'Part', cell: (b) => idOf(b.part), csv: (b) => idOf(b.part) },
  { head: 'Work order', cell: (b) => b.workOrder || <span class="muted">none</span>, csv: (b) => b.workOrder },
  { head: 'Operation', cell: (b) => b.operation, csv: (b) => b.operation },
  { head: 'Registered', cell: (b) => full(dateOf(b.createdAt)), csv: (b) => dateOf(b.createdAt)?.toISOString() },
];

export default function BladesPage() {
  const { query } = useRoute();
  const asked = Object.fromEntries(kFields.map((field) => [field, query.get(field) ?? ''])) as Record<(typeof kFields)[number], string>;
  const isJudged = ['machine', 'order', 'verdict', 'state'].some((name) => asked[name as keyof typeof asked] !== '');
  const found = usePaged([asked], async (from, signal) => {
    // With a filter a page may hold fewer than asked, or none, and not be the last: on to the first that brings something.
    const rows: Blade[] = [];
    let pageToken = from;
    do {
      const page = await client(PlantService).listBlades({
        pageSize: kPageSize, pageToken, serialPrefix: asked.serial, workOrder: asked.order, verdict: asked.verdict, state: asked.state,
        machine: asked.machine && `machines/${asked.machine}`, part: asked.part && `parts/${asked.part}`,
      }, { signal });
      rows.push(...page.blades);
      pageToken = page.nextPageToken;
    } while (pageToken !== '' && rows.length < 20);
    return { rows, nextPageToken: pageToken };
  }, ({ entry }) => kBringing.has(entry?.kind ?? '') || (isJudged && kJudging.has(entry?.kind ?? '')), kPauseMs);
  const blades = found.rows ?? [];

  const field = (name: (typeof kFields)[number], text: string, placeholder = '') => (
    <label>{text} <input type="search" value={asked[name]} placeholder={placeholder} maxLength={64} spellcheck={false} autocomplete="off" onChange={(event) => setQuery({ [name]: event.currentTarget.value.trim() })} /></label>
  );
  const choice = (name: (typeof kFields)[number], text: string, values: string[]) => (
    <label>{text} <select value={asked[name]} onChange={(event) => setQuery({ [name]: event.currentTarget.value })}>
      <option value="">Any</option>{values.map((value) => <option key={value} value={value}>{verdictWords(value)}</option>)}
    </select></label>
  );
  const isFiltered = kFields.some((name) => asked[name] !== '');

  return (
    <>
      <div class="page-head">
        <Heading title="Blades">Blades</Heading>
        <form class="filters" role="search" aria-label="Blades" onSubmit={(event) => event.preventDefault()}>
          {field('serial', 'Serial begins with', 'SN-')}{field('machine', 'Machine')}{field('part', 'Part')}{field('order', 'Work order')}
          {choice('verdict', 'Verdict', kVerdicts)}{choice('state', 'Program', kStates)}
        </form>
      </div>
      {found.refusal && <Refused refusal={found.refusal} again={found.again} />}
      {blades.length > 0 && <>
        <p class="small muted" role="status">{plural(blades.length, 'blade')}{found.hasMore && ', and more'}.</p>
        <Table caption="Blades found" showCaption={false} columns={kColumns} rows={blades} rowKey={(b) => b.name} />
        {found.hasMore && <p><button type="button" disabled={found.isAsking} onClick={found.more}>{found.isAsking ? 'Fetching…' : 'Show more'}</button></p>}
      </>}
      {blades.length === 0 && found.isAsking && <Loading what="blades" />}
      {blades.length === 0 && !found.isAsking && !found.refusal && (isFiltered
        ? <Empty title="No blade is like that">Serial numbers are compared from their beginning, letter by letter. <a href="/blades">Search anew</a></Empty>
        : <Empty title="No blade is registered yet">A blade shows here with its first scan.</Empty>)}
    </>
  );
}
