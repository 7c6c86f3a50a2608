// The plant's parts, each by its newest revision.
import { CadFormat, type Part } from '#proto/sixpoint/plant/v1/part_pb';
import { PlantService } from '#proto/sixpoint/plant/v1/plant_pb';
import { client } from '../plant/clients';
import { usePaged } from '../plant/paged';
import { idOf, withoutRevision } from '../words/name';
import { count, number, plural } from '../words/quantity';
import { dateOf, full } from '../words/time';
import { Heading } from '../view/shell';
import { Empty, ListState, More } from '../view/states';
import { Table, type Column } from '../view/table';
import { UploadPart } from './part_upload';

const id = (p: Part) => idOf(withoutRevision(p.name));
const kColumns: Column<Part>[] = [
  { head: 'Part', cell: (p) => <a href={`/parts/${encodeURIComponent(id(p))}`}>{id(p)}</a>, csv: id },
  { head: 'Revision', isNumber: true, cell: (p) => String(p.revision), csv: (p) => p.revision },
  { head: 'CAD', cell: (p) => CadFormat[p.cadFormat] ?? '', csv: (p) => CadFormat[p.cadFormat] },
  { head: 'Triangles', isNumber: true, cell: (p) => count(p.surface?.triangleCount ?? 0), csv: (p) => p.surface?.triangleCount },
  { head: 'Chordal error', unit: 'µm', isNumber: true, cell: (p) => number(p.surface?.chordalErrorUm, 3), csv: (p) => p.surface?.chordalErrorUm },
  { head: 'Encloses a volume', cell: (p) => (p.surface?.closed ? 'yes' : 'no'), csv: (p) => (p.surface?.closed ? 'yes' : 'no') },
  { head: 'Customer', cell: (p) => p.customer || <span class="muted">nobody’s</span>, csv: (p) => p.customer },
  { head: 'Recorded', cell: (p) => full(dateOf(p.createdAt)), csv: (p) => dateOf(p.createdAt)?.toISOString() },
];

export default function PartsPage() {
  const list = usePaged([], async (pageToken, signal) => {
    const page = await client(PlantService).listParts({ pageSize: 100, pageToken }, { signal });
    return { rows: page.parts, nextPageToken: page.nextPageToken };
  }, ({ entry }) => entry?.kind === 'part');
  return (
    <>
      <div class="page-head"><Heading title="Parts">Parts</Heading><UploadPart part={undefined} /></div>
      <ListState list={list} what="the parts" />
      {list.rows?.length === 0 && <Empty title="No part is registered that you may see">A part shows here once it is: <code>sixpoint part add FILE</code>, or by a CAD file here. One of a customer is seen by who is cleared for it.</Empty>}
      {list.rows && list.rows.length > 0 && <>
        <p class="small muted" role="status">{plural(list.rows.length, 'part')}{list.hasMore && ', and more'}, each by its newest revision.</p>
        <Table caption="Parts" showCaption={false} columns={kColumns} rows={list.rows} rowKey={(p) => p.name} />
        <More list={list} />
      </>}
    </>
  );
}
