// How far a blade's surface is off its CAD: the newest map's figures, its profile tolerances, and a picture of its patches.
import { useState } from 'preact/hooks';
import { DeviationService, ProfileZone, type DeviationMap, type DeviationStatistics, type PatchDeviation, type ProfileFinding } from '#proto/sixpoint/inspection/v1/deviation_pb';
import type { Part } from '#proto/sixpoint/plant/v1/part_pb';
import { PlantService } from '#proto/sixpoint/plant/v1/plant_pb';
import { Method } from '#proto/sixpoint/registration/v1/method_pb';
import { View } from '#proto/sixpoint/list/v1/list_pb';
import { useAsked } from '../plant/asked';
import { client } from '../plant/clients';
import { useMay } from '../plant/may';
import { firstRows } from '../plant/paged';
import { refusalOf } from '../plant/refusal';
import { newRequestId } from '../plant/request_id';
import { vectorOf } from '../scene/frames';
import { pageOf, personOf, shortId } from '../words/name';
import { count, number, percent, plural, withUncertainty } from '../words/quantity';
import { dateOf, full } from '../words/time';
import { VerdictMark } from '../view/mark';
import { PickOne } from '../view/pick_one';
import { Shown } from '../view/states';
import { Table, type Column } from '../view/table';
import type { BladeFacts } from './blade_facts';
import { verdictName } from './blade_holes';
import { methodWords } from './blade_story';
import { TiledSurface, type Tiling } from './tiled_surface';

const placeOf = (patch: PatchDeviation | undefined): string => (patch ? vectorOf(patch.centreInPartMm).map((x) => number(x, 1)).join(', ') : '');
const meanOf = (patch: PatchDeviation | undefined): string => (patch ? withUncertainty(patch.meanUm, patch.expandedUncertaintyUm, 'µm', 1) : '');
const um = (value: number | undefined): string => (value === undefined ? '' : number(value, 1));

const kRegions: Column<DeviationStatistics>[] = [
  { head: 'Region', cell: (r) => r.region || 'whole surface', csv: (r) => r.region },
  { head: 'Seen', isNumber: true, cell: (r) => percent(r.seenAreaMm2 / r.areaMm2), csv: (r) => r.seenAreaMm2 / r.areaMm2 },
  { head: 'Mean', unit: 'µm', isNumber: true, cell: (r) => (r.meanUm === undefined ? 'not seen' : um(r.meanUm)), csv: (r) => r.meanUm },
  { head: 'Rms', unit: 'µm', isNumber: true, cell: (r) => um(r.rmsUm), csv: (r) => r.rmsUm },
  { head: '5 %', unit: 'µm', isNumber: true, cell: (r) => um(r.p05Um), csv: (r) => r.p05Um },
  { head: 'Median', unit: 'µm', isNumber: true, cell: (r) => um(r.p50Um), csv: (r) => r.p50Um },
  { head: '95 %', unit: 'µm', isNumber: true, cell: (r) => um(r.p95Um), csv: (r) => r.p95Um },
  { head: 'Lowest patch', isNumber: true, cell: (r) => <span title={`at ${placeOf(r.lowest)} mm`}>{meanOf(r.lowest)}</span>, csv: (r) => r.lowest?.meanUm },
  { head: 'Highest patch', isNumber: true, cell: (r) => <span title={`at ${placeOf(r.highest)} mm`}>{meanOf(r.highest)}</span>, csv: (r) => r.highest?.meanUm },
];
const kProfiles: Column<ProfileFinding>[] = [
  { head: 'Profile', cell: (p) => p.tolerance?.characteristic, csv: (p) => p.tolerance?.characteristic },
  { head: 'Verdict', cell: (p) => <VerdictMark verdict={verdictName(p.verdict)} />, csv: (p) => verdictName(p.verdict) },
  { head: 'Of', cell: (p) => `${p.tolerance?.region || 'whole surface'}, ${p.tolerance?.zone === ProfileZone.FORM ? 'form' : 'form and location'}`, csv: (p) => p.tolerance?.region },
  { head: 'Limits', unit: 'mm', isNumber: true, cell: (p) => `${number(p.tolerance?.lowerMm, 3)} to ${number(p.tolerance?.upperMm, 3)}`, csv: (p) => `${p.tolerance?.lowerMm} to ${p.tolerance?.upperMm}` },
  { head: 'Seen', isNumber: true, cell: (p) => percent(p.coverage), csv: (p) => p.coverage },
  { head: 'Out', unit: 'mm²', isNumber: true, cell: (p) => (p.areaCount > 0 ? `${number(p.outMm2, 1)} in ${plural(p.areaCount, 'area')}` : '0'), csv: (p) => p.outMm2 },
  { head: 'Lowest', isNumber: true, cell: (p) => <span title={`at ${placeOf(p.lowest)} mm`}>{meanOf(p.lowest)}</span>, csv: (p) => p.lowest?.meanUm },
  { head: 'Highest', isNumber: true, cell: (p) => <span title={`at ${placeOf(p.highest)} mm`}>{meanOf(p.highest)}</span>, csv: (p) => p.highest?.meanUm },
  { head: 'Why', cell: (p) => p.reason, csv: (p) => p.reason },
];

function tilingOf(map: DeviationMap): Tiling {
  const whole = map.statistics[0];
  return {
    name: map.name, title: `Deviation of ${map.blade}, ${shortId(map.name)}`, what: 'their mean deviation, dark where nothing was seen', patchCount: map.patchCount, patchMm: map.patchMm,
    note: `Means of patches of ${number(map.patchMm, map.patchMm < 1 ? 2 : 1)} mm. Dark tiles were not seen: that is no pass.`,
    mostUm: 1.25 * Math.max(Math.abs(whole?.p05Um ?? 40), Math.abs(whole?.p95Um ?? 40)), fetch: (module, signal) => module.fetchPatches(map.name, signal),
  };
}

function Map({ map, part }: { map: DeviationMap; part: Part | undefined }) {
  const [isOpen, setOpen] = useState(false);
  const maySurface = useMay(PlantService.method.downloadSurface);
  return (
    <>
      <p class="small">{map.profiles.length > 0 && <VerdictMark verdict={verdictName(map.verdict)} />} {full(dateOf(map.recordedAt))} by {personOf(map.requestedBy)}; positioned by <a href={pageOf(map.registration)}>{methodWords(Method[map.method] ?? '')}</a>;{' '}
        {count(map.points?.compared ?? 0n)} points compared, {count(map.points?.atEdges ?? 0n)} at edges, {count(map.points?.setAside ?? 0n)} at pins, {count(map.points?.farOff ?? 0n)} farther than 1 mm.
        {map.budget[0] && <> Most of what is uncertain of a patch: {map.budget[0].source}, u = {number(map.budget[0].standardUncertaintyUm, 2)} µm.</>}</p>
      {map.profiles.length > 0 && <Table caption="Profile tolerances" columns={kProfiles} rows={map.profiles} rowKey={(p) => p.tolerance?.characteristic ?? ''} />}
      <Table caption="Deviation by region" columns={kRegions} rows={map.statistics} rowKey={(r) => r.region} />
      {map.decisionRule && <p class="small muted">{map.decisionRule}</p>}
      {maySurface && part && (isOpen ? <TiledSurface tiling={tilingOf(map)} part={part} /> : <p class="no-print"><button type="button" onClick={() => setOpen(true)}>Show the map in 3D</button></p>)}
    </>
  );
}

export function Deviation({ facts }: { facts: BladeFacts }) {
  const blade = facts.blade.name, of = facts.after ?? facts.before;
  const may = useMay(DeviationService.method.listDeviationMaps), mayMap = useMay(DeviationService.method.mapDeviation);
  const [doing, setDoing] = useState(''), [picked, setPicked] = useState(0);
  const asked = useAsked([blade, may], async (signal) => (may ? firstRows(20, async (pageToken, pageSize) => {
    const page = await client(DeviationService).listDeviationMaps({ blade, pageSize, pageToken, view: View.FULL }, { signal });
    return { rows: page.deviations, nextPageToken: page.nextPageToken };
  }) : []),
    ({ entry }) => entry?.kind === 'deviation' && entry.blade === blade);
  if (!may) return null;
  const compare = async () => {
    setDoing('Comparing every point with the CAD…');
    try {
      await client(DeviationService).mapDeviation({ registration: of!.name, requestId: newRequestId() });
      setPicked(0);
      setDoing('');
      asked.again();
    } catch (error) {
      setDoing(refusalOf(error).text);
    }
  };
  return (
    <section class="section" aria-labelledby="deviation-title" id="deviation">
      <div class="table-head"><h2 id="deviation-title">Surface against CAD</h2>
        {mayMap && of?.zeroFromPart && <span class="buttons no-print"><button type="button" disabled={doing.endsWith('…')} onClick={() => void compare()}>Compare {facts.after ? 'as cut' : 'as scanned'}</button></span>}</div>
      <p role="status" class="small">{doing}</p>
      <Shown asked={asked} what="deviation maps">{(maps) => (maps.length === 0 ? <p class="muted">Its surface was not mapped yet.</p> : (
        <PickOne all={maps} label="Map" picked={picked} onPick={setPicked} words={(one) => `${full(dateOf(one.recordedAt))}, ${methodWords(Method[one.method] ?? '')}`}>
          {(one) => <Map key={one.name} map={one} part={facts.part} />}</PickOne>))}</Shown>
    </section>
  );
}
