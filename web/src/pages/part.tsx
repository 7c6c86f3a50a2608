// One part: its CAD, holes and datum points in 3D and in figures, revision by revision.
import { useMemo, useState } from 'preact/hooks';
import { CadFormat, PositionZone, ShapeRegionKind, type DatumPoint, type Hole, type HoleGroup, type Part } from '#proto/sixpoint/plant/v1/part_pb';
import type { MachiningModel } from '#proto/sixpoint/plant/v1/machining_model_pb';
import { View } from '#proto/sixpoint/list/v1/list_pb';
import { PlantService } from '#proto/sixpoint/plant/v1/plant_pb';
import { useAsked } from '../plant/asked';
import { client } from '../plant/clients';
import { usePaged } from '../plant/paged';
import { setQuery, useRoute } from '../plant/route';
import { idOf, withoutRevision } from '../words/name';
import { count, number, plural, quantity, withUncertainty } from '../words/quantity';
import { dateOf, full } from '../words/time';
import { Mark } from '../view/mark';
import { Heading } from '../view/shell';
import { Refused, Shown } from '../view/states';
import { Table, type Column } from '../view/table';
import { directionOf, minus, plus, times, vectorOf } from '../scene/frames';
import { PartScene, type Drawn } from './part_scene';
import { differencesOf, movedStarts, type Difference } from './part_revisions';
import { UploadPart } from './part_upload';

const kShown = 300;
type Facts = { part: Part; newest: number; against: Part | undefined };
const kModels: Column<MachiningModel>[] = [
  { head: 'Model', cell: (m) => idOf(m.name), csv: (m) => idOf(m.name) }, { head: 'Revision', isNumber: true, cell: (m) => count(m.revision), csv: (m) => m.revision },
  { head: 'Operations', cell: (m) => m.operations.map(({ operation, holeGroup, paths, electrode }) => `${operation}: ${holeGroup || `path${paths.length > 1 ? 's' : ''} ${paths.map((p) => p.path).join(', ')}`}, ⌀ ${number(electrode?.diameterMm, 3)}, ${number(electrode?.lengthMm, 1)} long`).join('; '), csv: (m) => m.operations.map((o) => o.operation).join(' ') },
  { head: 'W', unit: 'mm', isNumber: true, cell: (m) => (m.wMm === undefined ? <span class="muted">any</span> : number(m.wMm, 3)), csv: (m) => m.wMm },
  { head: 'Of the part’s revision', isNumber: true, cell: (m) => count(m.partRevision), csv: (m) => m.partRevision },
  { head: 'Template', cell: (m) => <code title={`SHA-256 ${m.ncTemplateSha256}`}>{m.ncTemplateSha256.slice(0, 12)}</code>, csv: (m) => m.ncTemplateSha256 },
  { head: 'Recorded', cell: (m) => full(dateOf(m.createdAt)), csv: (m) => dateOf(m.createdAt)?.toISOString() },
];

// How it is machined: each model's newest revision.
function Models({ part }: { part: string }) {
  const found = usePaged([part], async (pageToken, signal) => {
    const page = await client(PlantService).listMachiningModels({ part, view: View.FULL, pageSize: 50, pageToken }, { signal });
    return { rows: page.machiningModels, nextPageToken: page.nextPageToken };
  }, ({ entry }) => entry?.kind === 'machining_model');
  return (
    <section class="section">
      {found.refusal && <Refused refusal={found.refusal} again={found.again} />}
      {found.rows && found.rows.length > 0 && <Table caption="Machining models" columns={kModels} rows={found.rows} rowKey={(m) => m.name} />}
      {found.rows?.length === 0 && <><h2>Machining models</h2><p class="muted">None: its program’s template is sent with each correction.</p></>}
      {found.hasMore && <p><button type="button" disabled={found.isAsking} onClick={found.more}>Show more</button></p>}
    </section>
  );
}

const kGroups: Column<HoleGroup>[] = [
  { head: 'Group', cell: (g) => g.group, csv: (g) => g.group }, { head: 'Holes', isNumber: true, cell: (g) => count(g.holes.length), csv: (g) => g.holes.length },
  { head: 'Diameter', unit: 'mm', isNumber: true, cell: (g) => number(g.diameterMm, 3), csv: (g) => g.diameterMm }, { head: 'Depth', unit: 'mm', isNumber: true, cell: (g) => number(g.depthMm, 2), csv: (g) => g.depthMm },
  { head: 'First axis', unit: 'deg', isNumber: true, cell: (g) => number(g.aNominalDeg, 3), csv: (g) => g.aNominalDeg }, { head: 'Second axis', unit: 'deg', isNumber: true, cell: (g) => number(g.bNominalDeg, 3), csv: (g) => g.bNominalDeg },
  { head: 'Position', unit: 'mm', isNumber: true, cell: (g) => `${g.positionZone === PositionZone.DIAMETER ? '⌀ ' : ''}${number(g.positionToleranceMm, 3)}`, csv: (g) => g.positionToleranceMm }, { head: 'Zone', cell: (g) => (PositionZone[g.positionZone] ?? '').toLowerCase(), csv: (g) => PositionZone[g.positionZone] },
  { head: 'Inclination', unit: 'deg', isNumber: true, cell: (g) => number(g.inclinationToleranceDeg, 2), csv: (g) => g.inclinationToleranceDeg },
  { head: 'Gauge pin', cell: (g) => (g.gaugePin ? withUncertainty(g.gaugePin.diameterMm, (2 * g.gaugePin.diameterStandardUncertaintyUm) / 1000, 'mm') : <span class="muted">any that goes in</span>), csv: (g) => g.gaugePin?.diameterMm },
];
type HoleRow = { key: string; hole: Hole };
const mm = <Row,>(head: string, of: (row: Row) => number | undefined): Column<Row> => ({ head, unit: 'mm', isNumber: true, cell: (row) => number(of(row), 4), csv: of });
const cosine = <Row,>(head: string, of: (row: Row) => number | undefined): Column<Row> => ({ head, isNumber: true, cell: (row) => number(of(row), 5), csv: of });
const kHoles: Column<HoleRow>[] = [
  { head: 'Hole', cell: (h) => h.key, csv: (h) => h.key }, mm('x', (h) => h.hole.startInPartMm?.xMm), mm('y', (h) => h.hole.startInPartMm?.yMm), mm('z', (h) => h.hole.startInPartMm?.zMm),
  cosine('Normal x', (h) => h.hole.normalInPart?.x), cosine('Normal y', (h) => h.hole.normalInPart?.y), cosine('Normal z', (h) => h.hole.normalInPart?.z),
];
const kDatums: Column<DatumPoint>[] = [
  { head: 'Datum', cell: (d) => d.datum, csv: (d) => d.datum }, mm('x', (d) => d.pointInPartMm?.xMm), mm('y', (d) => d.pointInPartMm?.yMm), mm('z', (d) => d.pointInPartMm?.zMm),
  cosine('Normal x', (d) => d.normalInPart?.x), cosine('Normal y', (d) => d.normalInPart?.y), cosine('Normal z', (d) => d.normalInPart?.z),
];
type Stationed = Part['stations'][number];
const kStations: Column<Stationed>[] = [
  { head: 'Station', cell: (s) => s.station, csv: (s) => s.station }, mm('Shift x', (s) => s.zeroFromPartNominal?.translationMm?.xMm), mm('Shift y', (s) => s.zeroFromPartNominal?.translationMm?.yMm), mm('Shift z', (s) => s.zeroFromPartNominal?.translationMm?.zMm),
  { head: 'Captures within', unit: 'mm', isNumber: true, cell: (s) => number(s.captureMm, 1), csv: (s) => s.captureMm },
];
type Shaped = Part['shapeRegions'][number];
const whereOf = ({ rest, minimumInPartMm: low, maximumInPartMm: high, facingInPart: facing, facingWithinDeg: within }: Shaped) => {
  if (rest) return 'whatever no other has';
  const corner = (p: typeof low) => [p?.xMm, p?.yMm, p?.zMm].map((x) => number(x, 2)).join(', ');
  return [low && `from ${corner(low)}`, high && `to ${corner(high)}`, facing && `looking to ${[facing.x, facing.y, facing.z].map((x) => number(x, 3)).join(', ')} within ${number(within, 0)} deg`].filter(Boolean).join(', ');
};
const kBecomes: Record<ShapeRegionKind, string> = { [ShapeRegionKind.UNSPECIFIED]: '', [ShapeRegionKind.MACHINED]: 'machined', [ShapeRegionKind.FIXED]: 'stays as the blank is', [ShapeRegionKind.DATUM]: 'stays as drawn' };
const kShapeRegions: Column<Shaped>[] = [
  { head: 'Region', cell: (r) => r.region, csv: (r) => r.region }, { head: 'Becomes', cell: (r) => kBecomes[r.kind], csv: (r) => ShapeRegionKind[r.kind] }, { head: 'Where', cell: whereOf, csv: whereOf },
  mm('Allowance', (r) => r.allowanceMm), mm('Lower', (r) => r.lowerMm), mm('Upper', (r) => r.upperMm),
];
const kDifferences: Column<Difference>[] = [
  { head: 'Of', cell: (d) => d.of, csv: (d) => d.of }, { head: 'What', cell: (d) => d.what, csv: (d) => d.what }, { head: 'Before', cell: (d) => d.before, csv: (d) => d.before }, { head: 'Now', cell: (d) => d.now, csv: (d) => d.now }, { head: 'Unit', cell: (d) => d.unit, csv: (d) => d.unit },
];

async function factsOf(name: string, revision: number, against: number, signal: AbortSignal): Promise<Facts> {
  const newest = await client(PlantService).getPart({ name }, { signal });
  const of = async (n: number) => (n === newest.revision ? newest : client(PlantService).getPart({ name: `${name}@${n}` }, { signal }));
  const [part, other] = await Promise.all([of(revision || newest.revision), against > 0 ? of(against) : undefined]);
  return { part, newest: newest.revision, against: other };
}

function Cad({ part }: { part: Part }) {
  const s = part.surface, size = s?.minimumMm && s.maximumMm ? minus(vectorOf(s.maximumMm), vectorOf(s.minimumMm)) : undefined, pose = part.zeroFromPartNominal;
  return (
    <div class="sheet">
      <h2>CAD</h2>
      <dl class="pairs">
        <dt>File</dt><dd>{CadFormat[part.cadFormat] ?? ''}{part.cadFormat === CadFormat.STL && `, its numbers in ${number(part.cadUnitMm, 3)} mm`}</dd>
        {part.solid && <><dt>Solid</dt><dd>{part.solid} <span class="muted">of the file’s; the others are ignored</span></dd></>}
        {size && <><dt>Size</dt><dd>{size.map((x) => number(x, 2)).join(' × ')}&#8239;mm</dd></>}
        <dt>Surface</dt><dd>{plural(s?.triangleCount ?? 0, 'triangle')}, {part.cadFormat === CadFormat.STL ? 'its own truth' : <>at most {quantity(s?.chordalErrorUm, 'µm', 3)} off the CAD</>}</dd>
        <dt>Closed</dt><dd>{s?.closed ? <Mark tone="good">Encloses a volume</Mark> : <Mark tone="unsure">Open</Mark>}{s?.openRimCount !== undefined && s.openRimCount > 0n && <span class="muted"> {plural(s.openRimCount, 'open rim')}, {quantity(s.openRimLengthMm, 'mm', 1)} together</span>}</dd>
        {s?.degenerateTriangleCount !== undefined && s.degenerateTriangleCount > 0n && <><dt>Left out</dt><dd>{plural(s.degenerateTriangleCount, 'triangle')} without area</dd></>}
        {(s?.healedUm ?? 0) > 0 && <><dt>Healed</dt><dd>edges up to {quantity(s?.healedUm, 'µm', 1)} off their faces were put onto them</dd></>}
        {(s?.gapUm ?? 0) > 0 && <><dt>Gap</dt><dd><Mark tone="unsure">Faces do not meet</Mark> <span class="muted">by up to {quantity(s?.gapUm, 'µm', 1)}{s?.gapAtMm && `, at ${[s.gapAtMm.xMm, s.gapAtMm.yMm, s.gapAtMm.zMm].map((x) => number(x, 1)).join(', ')} mm`}: a source of what is found within 1 mm of it</span></dd></>}
        {part.thermalExpansion && <><dt>Expansion</dt><dd>{withUncertainty(part.thermalExpansion.umPerMK, 2 * part.thermalExpansion.standardUncertaintyUmPerMK, 'µm/(m K)')}</dd></>}
        <dt>Nominal pose</dt><dd>shift {pose?.translationMm ? [pose.translationMm.xMm, pose.translationMm.yMm, pose.translationMm.zMm].map((x) => number(x, 3)).join(', ') : 'none'}&#8239;mm{pose && pose.rotation.some((x, i) => Math.abs(x - (i % 4 === 0 ? 1 : 0)) > 1e-12) ? ', turned' : ', not turned'}</dd>
        {part.customer && <><dt>Customer</dt><dd>{part.customer}</dd></>}
        <dt>Recorded</dt><dd>{full(dateOf(part.createdAt))}</dd>
        <dt>Digests</dt><dd><code title={`CAD file, SHA-256 ${s?.cadSha256}`}>{s?.cadSha256.slice(0, 16)}</code> <span class="muted">of the file</span></dd>
      </dl>
    </div>
  );
}

function Body({ facts }: { facts: Facts }) {
  const { part, newest, against } = facts;
  const [picked, setPicked] = useState<string>();
  const holes: HoleRow[] = useMemo(() => part.holeGroups.flatMap((group) => group.holes.map((hole) => ({ key: `${group.group}/${hole.hole}`, hole }))), [part]);
  const differences = useMemo(() => (against ? differencesOf(against, part) : []), [part, against]);
  const moves = useMemo(() => (against ? movedStarts(against, part) : []), [part, against]);
  const drawn = useMemo(() => (): Drawn => ({
    arrows: moves.map(({ key, fromMm, toMm }) => {
      const normal = directionOf(holes.find((row) => row.key === key)?.hole.normalInPart), off = times(normal, 0.3), by = minus(toMm, fromMm);
      return { fromMm: plus(fromMm, off), toMm: plus(plus(fromMm, times(by, 10)), off), colour: [210, 59, 47] as [number, number, number] };
    }),
  }), [moves, holes]);
  const pick = (key: string) => setPicked((old) => (old === key ? undefined : key));
  const revisions = Array.from({ length: Math.min(newest, 500) }, (_, i) => newest - i);
  const title = `${idOf(withoutRevision(part.name))} revision ${part.revision}`;
  return (
    <>
      <div class="filters" role="group" aria-label="Revisions">
        <label>Revision <select value={String(part.revision)} onChange={(event) => setQuery({ revision: event.currentTarget.value === String(newest) ? '' : event.currentTarget.value })}>{revisions.map((n) => <option key={n} value={String(n)}>{n}{n === newest && ', the newest'}</option>)}</select></label>
        <label>Compared with <select value={against ? String(against.revision) : ''} onChange={(event) => setQuery({ against: event.currentTarget.value })}><option value="">none</option>{revisions.filter((n) => n !== part.revision).map((n) => <option key={n} value={String(n)}>revision {n}</option>)}</select></label>
        <a href={`/blades?part=${encodeURIComponent(idOf(withoutRevision(part.name)))}`}>Its blades</a>
      </div>
      {against && (
        <section class="section" aria-labelledby="differences-title">
          <h2 id="differences-title">Revision {part.revision} against {against.revision}</h2>
          {differences.length === 0 ? <p class="muted">Nothing differs in what is recorded.</p> : <Table caption="What differs" columns={kDifferences} rows={differences} rowKey={(d) => `${d.of} ${d.what}`} />}
          {moves.length > 0 && <p class="small muted">Red arrows in the picture: {plural(moves.length, 'start')} that moved, ×10.</p>}
        </section>
      )}
      <div class="blade-body section">
        <PartScene part={part} title={title} picked={picked} onPick={pick} drawn={drawn} label={`The part in 3D: CAD, ${holes.length} holes, ${part.sixPoints.length} datum points. The same in figures: the tables.`} />
        <Cad part={part} />
      </div>
      <section class="section"><Table caption="Hole groups" columns={kGroups} rows={part.holeGroups} rowKey={(g) => g.group} />{part.holeGroups.length === 0 && <p class="muted">It has no holes: nothing is corrected or judged.</p>}</section>
      {part.stations.length > 0 && <section class="section"><Table caption="Stations of its fixture" columns={kStations} rows={part.stations} rowKey={(s) => s.station} /></section>}
      {part.shapeRegions.length > 0 && <section class="section"><Table caption="What may follow a blank" columns={kShapeRegions} rows={part.shapeRegions} rowKey={(r) => r.region} /></section>}
      <Models part={withoutRevision(part.name)} />
      <section class="section">
        {part.sixPoints.length > 0 ? <Table caption="Datum points, 3-2-1" columns={kDatums} rows={part.sixPoints} rowKey={(d) => d.datum} /> : <><h2>Datum points</h2><p class="muted">None: it cannot be registered by six points.</p></>}
      </section>
      {holes.length > 0 && <section class="section">
        <Table caption="Holes" columns={kHoles} rows={holes.slice(0, kShown)} copied={holes} rowKey={(h) => h.key} picked={picked} onPick={(h) => pick(h.key)} />
        {holes.length > kShown && <p class="small muted">The first {kShown} of {count(holes.length)} are shown, all are copied.</p>}
      </section>}
    </>
  );
}

export default function PartPage({ argument: id }: { argument: string }) {
  const { query } = useRoute(), name = `parts/${id}`;
  const whole = (key: string) => Math.max(0, Math.floor(Number(query.get(key) ?? 0)) || 0);
  const revision = whole('revision'), against = whole('against');
  const asked = useAsked([name, revision, against], (signal) => factsOf(name, revision, against, signal), ({ entry }) => entry?.kind === 'part' && withoutRevision(entry.name) === name);
  return (
    <>
      <div class="page-head"><Heading title={id}>{id}</Heading>{asked.value && <UploadPart part={asked.value.part} />}</div>
      <Shown asked={asked} what={`the part ${id}`}>{(facts) => <Body key={`${facts.part.revision}`} facts={facts} />}</Shown>
    </>
  );
}
