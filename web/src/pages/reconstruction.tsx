// The shape that a blade's blank contains: what its regions leave, what holds it or contradicts it, other limits tried, and the stock as a picture.
import { useState } from 'preact/hooks';
import { ReconstructionOutcome, ReconstructionService, ShapeLimit, type HoldingPlace, type LeastRelaxation, type ReconstructedRegion, type Reconstruction as Made } from '#proto/sixpoint/correction/v1/reconstruction_pb';
import { View } from '#proto/sixpoint/list/v1/list_pb';
import { ShapeRegionKind, type Part } from '#proto/sixpoint/plant/v1/part_pb';
import { PlantService } from '#proto/sixpoint/plant/v1/plant_pb';
import { Method } from '#proto/sixpoint/registration/v1/method_pb';
import { useAsked } from '../plant/asked';
import { client } from '../plant/clients';
import { useMay } from '../plant/may';
import { firstRows } from '../plant/paged';
import { refusalOf } from '../plant/refusal';
import { newRequestId } from '../plant/request_id';
import { vectorOf } from '../scene/frames';
import { pageOf, personOf, shortId } from '../words/name';
import { count, number, percent } from '../words/quantity';
import { dateOf, full } from '../words/time';
import { PickOne } from '../view/pick_one';
import { Shown } from '../view/states';
import { Table, type Column } from '../view/table';
import type { BladeFacts } from './blade_facts';
import { methodWords } from './blade_story';
import { TiledSurface, type Tiling } from './tiled_surface';

const kOutcome: Record<number, [string, string]> = {
  [ReconstructionOutcome.RECONSTRUCTED]: ['good', 'A shape was found'],
  [ReconstructionOutcome.INFEASIBLE]: ['bad', 'Cannot be made from this blank'],
  [ReconstructionOutcome.NOT_DETERMINED]: ['unsure', 'Not determined'],
};
const kKind: Record<number, string> = { [ShapeRegionKind.MACHINED]: 'machined', [ShapeRegionKind.FIXED]: 'fixed', [ShapeRegionKind.DATUM]: 'datum' };
const kLimit: Record<number, string> = { [ShapeLimit.STOCK]: 'stock', [ShapeLimit.TOLERANCE]: 'tolerance', [ShapeLimit.FIXED]: 'fixed surface', [ShapeLimit.DATUM]: 'datum' };

const um = (value: number | undefined, places = 1): string => (value === undefined ? '' : number(value, places));
const bandOf = (r: ReconstructedRegion): string => (r.region?.lowerMm === undefined ? '' : `${number(r.region.lowerMm, 3)} to ${number(r.region.upperMm, 3)}`);
const kRegions: Column<ReconstructedRegion>[] = [
  { head: 'Region', cell: (r) => r.region?.region, csv: (r) => r.region?.region },
  { head: 'Kind', cell: (r) => kKind[r.region?.kind ?? 0], csv: (r) => kKind[r.region?.kind ?? 0] },
  { head: 'Allowance', unit: 'mm', isNumber: true, cell: (r) => (r.region?.allowanceMm === undefined ? '' : number(r.region.allowanceMm, 3)), csv: (r) => r.region?.allowanceMm },
  { head: 'Band', unit: 'mm', isNumber: true, cell: bandOf, csv: bandOf },
  { head: 'Seen', isNumber: true, cell: (r) => percent(r.seenPart), csv: (r) => r.seenPart },
  { head: 'Least stock', unit: 'µm', isNumber: true, cell: (r) => um(r.leastAllowanceUm), csv: (r) => r.leastAllowanceUm },
  { head: 'Beyond wanted', unit: 'µm', isNumber: true, cell: (r) => um(r.leastSpareUm), csv: (r) => r.leastSpareUm },
  { head: 'Of the band', isNumber: true, cell: (r) => percent(r.greatestBandUse), csv: (r) => r.greatestBandUse },
  { head: 'Off fixed', unit: 'µm', isNumber: true, cell: (r) => um(r.worstFixedUm, 2), csv: (r) => r.worstFixedUm },
  { head: 'Datum moved', unit: 'µm', isNumber: true, cell: (r) => um(r.worstDatumUm, 2), csv: (r) => r.worstDatumUm },
];
const kHolding: Column<HoldingPlace>[] = [
  { head: 'Limit', cell: (h) => `${kLimit[h.limit] ?? ''}, ${h.upper ? 'upper' : 'lower'}`, csv: (h) => `${kLimit[h.limit] ?? ''} ${h.upper ? 'upper' : 'lower'}` },
  { head: 'Region', cell: (h) => h.region, csv: (h) => h.region },
  { head: 'At', unit: 'mm', isNumber: true, cell: (h) => vectorOf(h.placeInPartMm).map((x) => number(x, 1)).join(', '), csv: (h) => vectorOf(h.placeInPartMm).join(' ') },
  { head: 'Limit', unit: 'mm', isNumber: true, cell: (h) => number(h.limitMm, 4), csv: (h) => h.limitMm },
  { head: 'Share', isNumber: true, cell: (h) => percent(h.share), csv: (h) => h.share },
];

function Cure({ what, relaxation }: { what: string; relaxation: LeastRelaxation | undefined }) {
  return <li>{what}: {relaxation ? <>at least {number(relaxation.atLeastUm, 1)}&#8239;µm more; with {number(relaxation.atMostUm, 1)}&#8239;µm there is a shape</> : 'alone no cure'}</li>;
}

function tilingOf(made: Made): Tiling {
  const over = made.outcome === ReconstructionOutcome.RECONSTRUCTED ? 'the shape' : 'the CAD';
  const most = Math.max(40, ...made.regions.map((r) => r.worstFixedUm ?? 0), ...made.regions.map((r) => 4e3 * (r.region?.allowanceMm ?? 0)));
  return {
    name: made.name, title: `Stock of ${made.blade}, ${shortId(made.name)}`, what: `the blank's stock over ${over}`, patchCount: made.patchCount, patchMm: made.method?.patchMm ?? 0.5, mostUm: most,
    note: `What the blank has outside ${over}: red is stock, blue is lacking. Only what was seen is drawn.`, fetch: (module, signal) => module.fetchStock(made.name, made.method?.patchMm ?? 0.5, signal),
  };
}

function Shape({ made, part }: { made: Made; part: Part | undefined }) {
  const [isOpen, setOpen] = useState(false);
  const maySurface = useMay(PlantService.method.downloadSurface);
  const [tone, words] = kOutcome[made.outcome] ?? ['unsure', 'Not known to this page'];
  return (
    <>
      <p class="small"><strong class={`tone-${tone}`}>{words}</strong>{!made.ofPartLimits && <> with other limits than the part’s: a try</>}. {full(dateOf(made.recordedAt))} by {personOf(made.requestedBy)}; positioned by <a href={pageOf(made.registration)}>{methodWords(Method[made.registrationMethod] ?? '')}</a>;{' '}
        {count(made.points?.taken ?? 0n)} points in {count(made.patchCount)} patches, {count(made.points?.farOff ?? 0n)} far off, {count(made.points?.shapeless ?? 0n)} without a surface.
        {made.worstStepUm !== undefined && <> Beside what is not cut: step {number(made.worstStepUm, 2)}&#8239;µm, kink {number(made.worstKinkDeg ?? 0, 3)}°.</>}</p>
      {made.remark && <p>{made.remark}</p>}
      {made.proof && <><p>Proven: {made.proof.ofAnyShape ? 'no shape of any kind' : 'none on the finest lattice'}; the limits lack {number(made.proof.lackingUm, 1)}&#8239;µm. What would cure it:</p>
        <ul><Cure what="Wider profile tolerances" relaxation={made.proof.tolerance} /><Cure what="More stock" relaxation={made.proof.stock} /></ul></>}
      <Table caption="Shape by region" columns={kRegions} rows={made.regions} rowKey={(r) => r.region?.region ?? ''} />
      {made.holding.length > 0 && <details><summary>{made.proof ? 'What contradicts each other' : 'What holds the shape'}</summary>
        <Table caption={made.proof ? 'Contradicting limits' : 'Holding limits'} columns={kHolding} rows={made.holding} rowKey={(h) => `${h.region} ${vectorOf(h.placeInPartMm).join()} ${h.limit} ${h.upper}`} /></details>}
      {maySurface && part && (isOpen ? <TiledSurface tiling={tilingOf(made)} part={part} /> : <p class="no-print"><button type="button" onClick={() => setOpen(true)}>Show the stock in 3D</button></p>)}
    </>
  );
}

type Limits = { allowanceMm: number | undefined; lowerMm: number | undefined; upperMm: number | undefined };
const limitsOf = (part: Part): Map<string, Limits> => new Map(part.shapeRegions.filter((r) => r.kind !== ShapeRegionKind.DATUM).map((r) => [r.region, { allowanceMm: r.allowanceMm, lowerMm: r.lowerMm, upperMm: r.upperMm }]));

// A number of a limit: a slider to try, and the number itself.
function Limit({ name, value, least, most, onChange }: { name: string; value: number | undefined; least: number; most: number; onChange: (mm: number) => void }) {
  if (value === undefined) return null;
  const change = (text: string) => { const mm = Number(text); if (text !== '' && Number.isFinite(mm)) onChange(mm); };
  return <label>{name} <input type="range" min={least} max={most} step={0.005} value={value} aria-label={`${name}, slider`} onInput={(event) => change(event.currentTarget.value)} />
    <input type="number" aria-label={`${name}, mm`} min={-5} max={5} step={0.001} value={value} onInput={(event) => change(event.currentTarget.value)} /> mm</label>;
}

function Tries({ part, doing, onTry }: { part: Part; doing: boolean; onTry: (limits: Map<string, Limits>) => void }) {
  const [limits, setLimits] = useState(() => limitsOf(part));
  const set = (region: string, change: Partial<Limits>) => setLimits((old) => new Map(old).set(region, { ...old.get(region)!, ...change }));
  return (
    <details class="no-print"><summary>Try other limits</summary>
      {[...limits].map(([region, one]) => <fieldset key={region}><legend>{region}</legend>
        <Limit name="Allowance" value={one.allowanceMm} least={0} most={1} onChange={(allowanceMm) => set(region, { allowanceMm })} />{' '}
        <Limit name="Lower" value={one.lowerMm} least={-2} most={0} onChange={(lowerMm) => set(region, { lowerMm })} />{' '}
        <Limit name="Upper" value={one.upperMm} least={0} most={2} onChange={(upperMm) => set(region, { upperMm })} /></fieldset>)}
      <p class="buttons"><button type="button" disabled={doing} onClick={() => onTry(limits)}>Try these limits</button> <button type="button" class="quiet" onClick={() => setLimits(limitsOf(part))}>The part’s</button></p>
    </details>
  );
}

export function Reconstruction({ facts }: { facts: BladeFacts }) {
  const blade = facts.blade.name, of = facts.before ?? facts.after, part = facts.part;
  const may = useMay(ReconstructionService.method.listReconstructions), mayMake = useMay(ReconstructionService.method.reconstruct);
  const [doing, setDoing] = useState(''), [picked, setPicked] = useState(0);
  const asked = useAsked([blade, may], async (signal) => (may ? firstRows(20, async (pageToken, pageSize) => {
    const page = await client(ReconstructionService).listReconstructions({ blade, pageSize, pageToken, view: View.FULL }, { signal });
    return { rows: page.reconstructions, nextPageToken: page.nextPageToken };
  }) : []),
    ({ entry }) => entry?.kind === 'reconstruction' && entry.blade === blade);
  if (!may || !part || part.shapeRegions.length === 0) return null;
  const make = async (limits: Map<string, Limits>) => {
    const own = limitsOf(part), tried = [...limits].filter(([region, one]) => JSON.stringify(one) !== JSON.stringify(own.get(region))).map(([region, one]) => ({ region, ...one }));
    setDoing('Fitting the shape into the blank…');
    try {
      await client(ReconstructionService).reconstruct({ registration: of!.name, requestId: newRequestId(), triedLimits: tried });
      setPicked(0);
      setDoing('');
      asked.again();
    } catch (error) {
      setDoing(refusalOf(error).text);
    }
  };
  const isDoing = doing.endsWith('…');
  return (
    <section class="section no-print" aria-labelledby="reconstruction-title" id="reconstruction">
      <div class="table-head"><h2 id="reconstruction-title">Shape in the blank</h2>
        {mayMake && of?.zeroFromPart && <span class="buttons no-print"><button type="button" disabled={isDoing} onClick={() => void make(limitsOf(part))}>Find the shape</button></span>}</div>
      <p role="status" class="small">{doing}</p>
      {mayMake && of?.zeroFromPart && <Tries part={part} doing={isDoing} onTry={(limits) => void make(limits)} />}
      <Shown asked={asked} what="reconstructions">{(all) => (all.length === 0 ? <p class="muted">No shape was looked for in its blank.</p> : (
        <PickOne all={all} label="Result" picked={picked} onPick={setPicked} words={(one) => `${full(dateOf(one.recordedAt))}, ${(kOutcome[one.outcome] ?? ['', ''])[1]}${one.ofPartLimits ? '' : ', a try'}`}>
          {(one) => <Shape key={one.name} made={one} part={part} />}</PickOne>))}</Shown>
    </section>
  );
}
