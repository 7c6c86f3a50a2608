// How a blade whose worn tip was welded on again is machined: the target over its height with its uncertainty, what the path leaves, and both as a picture.
import { useState } from 'preact/hooks';
import { RepairExtrapolation, RepairSectionKind, RepairService, type Repair as Planned, type RepairSection } from '#proto/sixpoint/correction/v1/repair_pb';
import { View } from '#proto/sixpoint/list/v1/list_pb';
import type { Part } from '#proto/sixpoint/plant/v1/part_pb';
import { PlantService } from '#proto/sixpoint/plant/v1/plant_pb';
import { Method } from '#proto/sixpoint/registration/v1/method_pb';
import { useAsked } from '../plant/asked';
import { client } from '../plant/clients';
import { useMay } from '../plant/may';
import { firstRows } from '../plant/paged';
import { pageOf, personOf, shortId } from '../words/name';
import { count, number } from '../words/quantity';
import { dateOf, full } from '../words/time';
import { PickOne } from '../view/pick_one';
import { hasNone, Shown } from '../view/states';
import { Table, type Column } from '../view/table';
import type { BladeFacts } from './blade_facts';
import { methodWords } from './blade_story';
import { TiledSurface, type Tiling } from './tiled_surface';

const kKind: Record<number, string> = { [RepairSectionKind.MEASURED]: 'measured', [RepairSectionKind.LEFT_OUT]: 'left out', [RepairSectionKind.TARGET]: 'target' };
const kHow: Record<number, string> = { [RepairExtrapolation.POLYNOMIAL]: 'polynomials over the height', [RepairExtrapolation.POLYNOMIAL_OF_DEVIATION]: 'polynomials of its deviation', [RepairExtrapolation.PROCESS_OF_DEVIATION]: 'Gaussian processes of its deviation' };

const um = (value: number | undefined): string => (value === undefined ? '' : number(value, 1));
const kSections: Column<RepairSection>[] = [
  { head: 'Height', unit: 'mm', isNumber: true, cell: (s) => number(s.zMm, 2), csv: (s) => s.zMm },
  { head: 'Taken for', cell: (s) => kKind[s.kind] ?? '', csv: (s) => kKind[s.kind] ?? '' },
  { head: 'Mean U', unit: 'µm', isNumber: true, cell: (s) => um(s.meanExpandedUncertaintyUm), csv: (s) => s.meanExpandedUncertaintyUm },
  { head: 'Greatest U', unit: 'µm', isNumber: true, cell: (s) => um(s.greatestExpandedUncertaintyUm), csv: (s) => s.greatestExpandedUncertaintyUm },
  { head: 'Left', unit: 'µm', isNumber: true, cell: (s) => um(s.greatestRestUm), csv: (s) => s.greatestRestUm },
  { head: 'Cut into', unit: 'µm', isNumber: true, cell: (s) => um(s.deepestCutUm), csv: (s) => s.deepestCutUm },
  { head: 'Why', cell: (s) => s.remark, csv: (s) => s.remark },
];

function tilingOf(plan: Planned, isRest: boolean): Tiling {
  const targets = plan.sections.filter((s) => s.kind === RepairSectionKind.TARGET), what = isRest ? 'what the path leaves above the target' : 'the target’s expanded uncertainty';
  const most = Math.max(10, ...targets.map((s) => (isRest ? s.greatestRestUm : s.greatestExpandedUncertaintyUm) ?? 0));
  return {
    name: `${plan.name}${isRest ? '' : '#u'}`, title: `${isRest ? 'Rest' : 'Uncertainty'} of ${plan.blade}, ${shortId(plan.name)}`, what, patchCount: targets.length, patchMm: plan.stepOverMm, mostUm: most,
    note: `The target's places, coloured by ${what}; the lines are the ball's way along the finishing laps.`,
    fetch: (module, signal) => module.fetchTarget(plan.name, isRest, signal), fetchLaps: (module, signal) => module.fetchFinishingLaps(plan.name, signal),
  };
}

function Plan({ plan, part }: { plan: Planned; part: Part | undefined }) {
  const [figure, setFigure] = useState<'none' | 'rest' | 'uncertainty'>('none');
  const mayPath = useMay(RepairService.method.downloadRepairPath), maySurface = useMay(PlantService.method.downloadSurface);
  const removal = plan.removal, tiling = figure === 'none' ? undefined : tilingOf(plan, figure === 'rest');
  return (
    <>
      <p class="small">From {number(plan.heights?.repairLineMm ?? 0, 2)} to {number(plan.heights?.targetMm ?? 0, 2)}&#8239;mm, continued by {kHow[plan.method?.extrapolation ?? 0] ?? 'a method that this page does not know'}. {full(dateOf(plan.recordedAt))} by {personOf(plan.requestedBy)}; positioned by <a href={pageOf(plan.registration)}>{methodWords(Method[plan.registrationMethod] ?? '')}</a>;{' '}
        {count(plan.points?.belowLine ?? 0n)} points below the line, {count(plan.points?.aboveLine ?? 0n)} of the weld, {count(plan.points?.leftOut ?? 0n)} left out.</p>
      <p class="small">The weld stands out by {number(plan.greatestStockMm, 3)}&#8239;mm: {count(plan.roughingLayerCount)} roughing layers, {count(plan.lapCount)} laps {number(plan.stepOverMm, 3)}&#8239;mm apart, {number(plan.pathLengthMm / 1000, 2)}&#8239;m in {count(plan.placeCount)} places.
        {removal && <> Simulated: {number(removal.deepestBelowLineUm, 2)}&#8239;µm cut below the line, {number(removal.deepestBeyondUncertaintyUm, 2)}&#8239;µm into the target beyond its U; {number(removal.greatestRestUm, 1)}&#8239;µm left at most.</>}</p>
      <Table caption="Repair by height" columns={kSections} rows={plan.sections} rowKey={(s) => `${s.zMm} ${s.kind}`} />
      {maySurface && mayPath && part && <p class="buttons no-print"><button type="button" aria-pressed={figure === 'rest'} onClick={() => setFigure('rest')}>Show what is left in 3D</button> <button type="button" class="quiet" aria-pressed={figure === 'uncertainty'} onClick={() => setFigure('uncertainty')}>Show U in 3D</button></p>}
      {tiling && part && <TiledSurface key={tiling.name} tiling={tiling} part={part} />}
    </>
  );
}

export function Repair({ facts }: { facts: BladeFacts }) {
  const blade = facts.blade.name, may = useMay(RepairService.method.listRepairs);
  const [picked, setPicked] = useState(0);
  const asked = useAsked([blade, may], async (signal) => (may ? firstRows(20, async (pageToken, pageSize) => {
    const page = await client(RepairService).listRepairs({ blade, pageSize, pageToken, view: View.FULL }, { signal });
    return { rows: page.repairs, nextPageToken: page.nextPageToken };
  }) : []),
    ({ entry }) => entry?.kind === 'repair' && entry.blade === blade);
  if (!may || hasNone(asked)) return null;
  return (
    <section class="section no-print" aria-labelledby="repair-title" id="repair">
      <div class="table-head"><h2 id="repair-title">Repair</h2></div>
      <Shown asked={asked} what="repairs">{(all) => (
        <PickOne all={all} label="Result" picked={picked} onPick={setPicked} words={(one) => full(dateOf(one.recordedAt))}>
          {(one) => <Plan key={one.name} plan={one} part={facts.part} />}</PickOne>)}</Shown>
    </section>
  );
}
