// Why a blank is discarded: patches whose limits no motion of the part meets all, as a table and on the part.
import { useMemo, useState } from 'preact/hooks';
import type { Assessment, LimitConflict } from '#proto/sixpoint/inspection/v1/assessment_pb';
import { PlantService } from '#proto/sixpoint/plant/v1/plant_pb';
import type { Part } from '#proto/sixpoint/plant/v1/part_pb';
import { useMay } from '../plant/may';
import { vectorOf } from '../scene/frames';
import { number, percent, plural, withUncertainty } from '../words/quantity';
import { Table, type Column } from '../view/table';
import { PartScene, type Drawn } from './part_scene';

const kAbove: [number, number, number] = [198, 69, 61], kBelow: [number, number, number] = [31, 95, 168];

const keyOf = (one: LimitConflict): string => `${one.characteristic}, patch ${one.patch?.patch}`;
const at = (axis: 'x' | 'y' | 'z'): Column<LimitConflict> => ({ head: axis, unit: 'mm', isNumber: true, cell: (c) => number(c.patch?.centreInPartMm?.[`${axis}Mm`], 2), csv: (c) => c.patch?.centreInPartMm?.[`${axis}Mm`] });

const kColumns: Column<LimitConflict>[] = [
  { head: 'Place', cell: keyOf, csv: keyOf },
  { head: 'Limit', cell: (c) => (c.above ? 'upper: too much material' : 'lower: too little material'), csv: (c) => (c.above ? 'upper' : 'lower') },
  { head: 'Deviation ± U', unit: 'µm', isNumber: true, cell: (c) => withUncertainty(c.patch?.meanUm, c.patch?.expandedUncertaintyUm, '', 1).trim(), csv: (c) => c.patch?.meanUm },
  at('x'), at('y'), at('z'),
  { head: 'Share', isNumber: true, cell: (c) => percent(c.share), csv: (c) => c.share },
];

const marksOf = (conflicts: LimitConflict[]): Drawn => ({
  marks: conflicts.flatMap((one) => (one.patch?.centreInPartMm ? [{ key: keyOf(one), pointMm: vectorOf(one.patch.centreInPartMm), colour: one.above ? kAbove : kBelow, size: 0.7 + one.share }] : [])),
});

export function Conflicts({ assessment, part }: { assessment: Assessment; part: Part | undefined }) {
  const { conflicts } = assessment;
  const [isOpen, setOpen] = useState(false), [picked, setPicked] = useState<string>();
  const drawn = useMemo(() => () => marksOf(conflicts), [conflicts]);
  const pick = (key: string) => setPicked((old) => (old === key ? undefined : key));
  // Of another revision the places would lie on another surface.
  const may = useMay(PlantService.method.downloadSurface), of = part?.name === assessment.part && part.revision === assessment.partRevision ? part : undefined;
  return (
    <div class="conflicts">
      <Table caption="Places whose limits conflict" columns={kColumns} rows={conflicts} rowKey={keyOf} picked={picked} onPick={(one) => pick(keyOf(one))} />
      <p class="small muted">No motion of the part meets these limits all: what frees one place hurts another. Share: of the pushes that balance.</p>
      {may && of && (isOpen ? <>
        <PartScene part={of} title={`${assessment.blade}, places that conflict`} markWord="Places that conflict" picked={picked} onPick={pick} drawn={drawn}
          label={`The part in 3D with ${plural(conflicts.length, 'place')} whose limits conflict. The same in figures: the table.`} />
        <p class="small muted">Red: too much material; blue: too little. Greater balls push more.</p>
      </> : <p><button type="button" onClick={() => setOpen(true)}>Show the places in 3D</button></p>)}
    </div>
  );
}
