// What machining to a blank's shape left, pass by pass: regions, what the tool was seen to leave, what is to be done, and the rest as a picture.
import { useState } from 'preact/hooks';
import { MachiningPassOutcome, MachiningPassService, type MachinedRegion, type MachiningPass } from '#proto/sixpoint/correction/v1/machining_pass_pb';
import { ReconstructionService } from '#proto/sixpoint/correction/v1/reconstruction_pb';
import { View } from '#proto/sixpoint/list/v1/list_pb';
import type { Part } from '#proto/sixpoint/plant/v1/part_pb';
import { PlantService } from '#proto/sixpoint/plant/v1/plant_pb';
import { Method } from '#proto/sixpoint/registration/v1/method_pb';
import { useAsked } from '../plant/asked';
import { client } from '../plant/clients';
import { useMay } from '../plant/may';
import { firstRows } from '../plant/paged';
import { pageOf, personOf, shortId } from '../words/name';
import { count, number, percent } from '../words/quantity';
import { dateOf, full } from '../words/time';
import { PickOne } from '../view/pick_one';
import { hasNone, Shown } from '../view/states';
import { Table, type Column } from '../view/table';
import type { BladeFacts } from './blade_facts';
import { methodWords } from './blade_story';
import { TiledSurface, type Tiling } from './tiled_surface';

const kOutcome: Record<number, [string, string]> = {
  [MachiningPassOutcome.DONE]: ['good', 'Done'],
  [MachiningPassOutcome.ANOTHER_PASS]: ['unsure', 'Another pass'],
  [MachiningPassOutcome.SCRAP]: ['bad', 'Scrap'],
  [MachiningPassOutcome.NOT_DETERMINED]: ['unsure', 'Not determined'],
};

const um = (value: number | undefined): string => (value === undefined ? '' : number(value, 1));
const kRegions: Column<MachinedRegion>[] = [
  { head: 'Region', cell: (r) => r.region, csv: (r) => r.region },
  { head: 'Seen', isNumber: true, cell: (r) => percent(r.seenPart), csv: (r) => r.seenPart },
  { head: 'Left, mean', unit: 'µm', isNumber: true, cell: (r) => um(r.meanRestUm), csv: (r) => r.meanRestUm },
  { head: 'Least', unit: 'µm', isNumber: true, cell: (r) => um(r.leastRestUm), csv: (r) => r.leastRestUm },
  { head: 'Most', unit: 'µm', isNumber: true, cell: (r) => um(r.greatestRestUm), csv: (r) => r.greatestRestUm },
  { head: 'Above lower limit', unit: 'µm', isNumber: true, cell: (r) => um(r.leastLowerSpareUm), csv: (r) => r.leastLowerSpareUm },
  { head: 'Below upper limit', unit: 'µm', isNumber: true, cell: (r) => um(r.leastUpperSpareUm), csv: (r) => r.leastUpperSpareUm },
  { head: 'Tool leaves', unit: 'µm', isNumber: true, cell: (r) => um(r.offsetUm), csv: (r) => r.offsetUm },
  { head: 'Gives way', isNumber: true, cell: (r) => (r.deflectionShare === undefined ? '' : percent(r.deflectionShare)), csv: (r) => r.deflectionShare },
];

function tilingOf(pass: MachiningPass, patchMm: number): Tiling {
  return {
    name: pass.name, title: `Rest on ${pass.blade}, pass ${pass.number}, ${shortId(pass.name)}`, what: 'what the pass left above the shape', patchCount: pass.patchCount, patchMm,
    mostUm: Math.max(10, ...pass.regions.map((r) => Math.max(Math.abs(r.greatestRestUm ?? 0), Math.abs(r.leastRestUm ?? 0)))),
    note: 'What stands above the shape: red is left, blue is cut too deep. Only what was seen is drawn.', fetch: (module, signal) => module.fetchLeft(pass.name, patchMm, signal),
  };
}

function Left({ pass, part }: { pass: MachiningPass; part: Part | undefined }) {
  const [isOpen, setOpen] = useState(false);
  const maySurface = useMay(PlantService.method.downloadSurface);
  const shape = useAsked([pass.reconstruction], async (signal) => client(ReconstructionService).getReconstruction({ name: pass.reconstruction }, { signal }));
  const [tone, words] = kOutcome[pass.outcome] ?? ['unsure', 'Not known to this page'], patchMm = shape.value?.method?.patchMm;
  return (
    <>
      <p class="small"><strong class={`tone-${tone}`}>{words}</strong> after pass {count(pass.number)} over its shape. {full(dateOf(pass.recordedAt))} by {personOf(pass.requestedBy)}; positioned by <a href={pageOf(pass.registration)}>{methodWords(Method[pass.registrationMethod] ?? '')}</a>;{' '}
        {count(pass.points?.taken ?? 0n)} points in {count(pass.patchCount)} patches.</p>
      {pass.remark && <p>{pass.remark}</p>}
      <Table caption="What the pass left by region" columns={kRegions} rows={pass.regions} rowKey={(r) => r.region} />
      {maySurface && part && patchMm !== undefined && (isOpen ? <TiledSurface tiling={tilingOf(pass, patchMm)} part={part} /> : <p class="no-print"><button type="button" onClick={() => setOpen(true)}>Show what it left in 3D</button></p>)}
    </>
  );
}

export function Passes({ facts }: { facts: BladeFacts }) {
  const blade = facts.blade.name, may = useMay(MachiningPassService.method.listMachiningPasses);
  const [picked, setPicked] = useState(0);
  const asked = useAsked([blade, may], async (signal) => (may ? firstRows(20, async (pageToken, pageSize) => {
    const page = await client(MachiningPassService).listMachiningPasses({ blade, pageSize, pageToken, view: View.FULL }, { signal });
    return { rows: page.machiningPasses, nextPageToken: page.nextPageToken };
  }) : []),
    ({ entry }) => entry?.kind === 'machining_pass' && entry.blade === blade);
  if (!may || hasNone(asked)) return null;
  return (
    <section class="section no-print" aria-labelledby="passes-title" id="passes">
      <div class="table-head"><h2 id="passes-title">Passes over the shape</h2></div>
      <Shown asked={asked} what="machining passes">{(all) => (
        <PickOne all={all} label="Pass" picked={picked} onPick={setPicked} words={(one) => `${one.number}, ${full(dateOf(one.recordedAt))}, ${(kOutcome[one.outcome] ?? ['', ''])[1]}`}>
          {(one) => <Left key={one.name} pass={one} part={facts.part} />}</PickOne>)}</Shown>
    </section>
  );
}
