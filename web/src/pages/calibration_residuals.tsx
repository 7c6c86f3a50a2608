// How far what was measured lies from what a calibration says: what its fit used, and what it did not.
import type { Calibration } from '#proto/sixpoint/calibration/v1/calibration_pb';
import type { AxisCharacterisation } from '#proto/sixpoint/calibration/v1/axis_pb';
import type { FeatureResidual } from '#proto/sixpoint/calibration/v1/sensor_pb';
import type { PoseResidual } from '#proto/sixpoint/calibration/v1/rotation_pb';
import type { ProbeResidual } from '#proto/sixpoint/calibration/v1/probe_pb';
import type { ResidualJudgement } from '#proto/sixpoint/calibration/v1/state_pb';
import { idOf } from '../words/name';
import { number, quantity, withUncertainty } from '../words/quantity';
import { Curves, DotStrips } from '../view/bars';
import { Mark } from '../view/mark';
import { Picture } from '../view/picture';
import { Table, type Column } from '../view/table';

type Feature = { one: FeatureResidual; isCheck: boolean };
const um = (head: string, of: (one: FeatureResidual) => number): Column<Feature> => ({ head, unit: 'µm', isNumber: true, cell: ({ one }) => number(of(one), 2), csv: ({ one }) => of(one) });
const kFeatures: Column<Feature>[] = [
  { head: 'Scan', cell: ({ one }) => idOf(one.scan), csv: ({ one }) => one.scan }, { head: 'Feature', cell: ({ one }) => one.feature, csv: ({ one }) => one.feature },
  { head: 'In the fit', cell: ({ isCheck }) => (isCheck ? 'no' : 'yes'), csv: ({ isCheck }) => (isCheck ? 'no' : 'yes') },
  um('dx', (one) => one.dxUm), um('dy', (one) => one.dyUm), um('dz', (one) => one.dzUm), um('Distance', (one) => Math.hypot(one.dxUm, one.dyUm, one.dzUm)),
];
const kPoses: Column<PoseResidual>[] = [
  { head: 'First axis', unit: 'deg', isNumber: true, cell: (p) => number(p.aDeg, 3), csv: (p) => p.aDeg }, { head: 'Second axis', unit: 'deg', isNumber: true, cell: (p) => number(p.bDeg, 3), csv: (p) => p.bDeg },
  { head: 'Distance', unit: 'µm', isNumber: true, cell: (p) => number(p.distanceUm, 2), csv: (p) => p.distanceUm }, { head: 'In the fit', cell: (p) => (p.heldOut ? 'no, held out' : 'yes'), csv: (p) => (p.heldOut ? 'no' : 'yes') },
  { head: 'By the machine’s record', unit: 'µm', isNumber: true, cell: (p) => (p.beforeUm === undefined ? 'not kept' : number(p.beforeUm, 1)), csv: (p) => p.beforeUm },
];
const kReadings: Column<ProbeResidual>[] = [
  { head: 'Face', cell: (r) => r.face, csv: (r) => r.face }, { head: 'Displacement', unit: 'mm', isNumber: true, cell: (r) => number(r.displacementMm, 4), csv: (r) => r.displacementMm },
  { head: 'Residual', unit: 'µm', isNumber: true, cell: (r) => number(r.residualUm, 2), csv: (r) => r.residualUm },
];
type Step = { atDeg: number; forward: number; backward: number };
const kSteps: Column<Step>[] = [
  { head: 'Angle', unit: 'deg', isNumber: true, cell: (s) => number(s.atDeg, 2), csv: (s) => s.atDeg }, { head: 'Forward', unit: 'deg', isNumber: true, cell: (s) => number(s.forward, 5), csv: (s) => s.forward },
  { head: 'Backward', unit: 'deg', isNumber: true, cell: (s) => number(s.backward, 5), csv: (s) => s.backward },
];
const kJudgements: Column<ResidualJudgement>[] = [
  { head: 'What was asked', cell: (j) => j.of, csv: (j) => j.of }, { head: 'Over expected (F)', isNumber: true, cell: (j) => number(j.ratio, 2), csv: (j) => j.ratio }, { head: 'Residuals', isNumber: true, cell: (j) => number(j.count, 0), csv: (j) => j.count },
  { head: 'By chance', isNumber: true, cell: (j) => (j.probability < 0.001 ? 'under 1 in 1000' : number(j.probability, 3)), csv: (j) => j.probability },
  { head: 'Agrees', cell: (j) => <Mark tone={j.agrees ? 'good' : 'bad'}>{j.agrees ? 'Agrees' : 'Does not agree'}</Mark>, csv: (j) => (j.agrees ? 'yes' : 'no') },
];

export const Judgements = ({ judgements }: { judgements: ResidualJudgement[] }) =>
  (judgements.length === 0 ? null : <Table caption="Whether the residuals are what its uncertainty explains" columns={kJudgements} rows={judgements} rowKey={(j) => j.of} />);

export function AxisTable({ axis, of }: { axis: AxisCharacterisation; of: string }) {
  const table = axis.table;
  if (!table || table.forwardErrorDeg.length === 0) return <p class="muted">Its table is not told here.</p>;
  const rows = table.forwardErrorDeg.map((forward, i) => ({ atDeg: i * table.stepDeg, forward, backward: table.backwardErrorDeg[i] ?? 0 }));
  const limit = 2 * table.standardUncertaintyDeg;
  return (
    <>
      <Picture title={`Axis ${axis.axis}: reached less commanded`} file={`${of} axis ${axis.axis} table`}>
        <Curves curves={[{ name: 'forward', className: 'curve-one', values: table.forwardErrorDeg }, { name: 'backward', className: 'curve-two', values: table.backwardErrorDeg }]} fromX={0} stepX={table.stepDeg} unitX="command, deg" unit="deg" decimals={4} label={`Axis ${axis.axis}, reached less commanded over a turn`} />
      </Picture>
      <p class="small muted">U of one value: {quantity(limit, 'deg', 5)} (k = 2). What one position contributes without the table: u = {quantity(axis.standardUncertainty?.valueDeg, 'deg', 5)}, with it {quantity(axis.compensatedStandardUncertainty?.valueDeg, 'deg', 5)}.
        Greatest error {withUncertainty(axis.greatestError?.valueDeg, axis.greatestError && 2 * axis.greatestError.standardUncertaintyDeg, 'deg')} at {number(axis.greatestErrorAtDeg, 1)}&#8239;deg.</p>
      <details><summary>The table in figures</summary><Table caption={`Table of axis ${axis.axis}`} showCaption={false} columns={kSteps} rows={rows} rowKey={(s) => String(s.atDeg)} /></details>
    </>
  );
}

const rms = (values: number[]) => Math.sqrt(values.reduce((sum, value) => sum + value * value, 0) / Math.max(1, values.length));

// What the calibration brings: how far a probed centre lay from where the axes of the machine's record put it, and from where the identified ones do.
export function broughtBy(poses: PoseResidual[]): { beforeUm: number; afterUm: number; isHeldOut: boolean } | undefined {
  const known = poses.filter(({ beforeUm }) => beforeUm !== undefined), heldOut = known.filter(({ heldOut: out }) => out), some = heldOut.length > 0 ? heldOut : known;
  return some.length === 0 ? undefined : { beforeUm: rms(some.map(({ beforeUm }) => beforeUm!)), afterUm: rms(some.map(({ distanceUm }) => distanceUm)), isHeldOut: heldOut.length > 0 };
}

function Drawn({ calibration }: { calibration: Calibration }) {
  const { result } = calibration, of = idOf(calibration.machine);
  switch (result.case) {
    case 'sensor': {
      const rows: Feature[] = [...result.value.fitted.map((one) => ({ one, isCheck: false })), ...result.value.check.map((one) => ({ one, isCheck: true }))];
      if (rows.length === 0) return <p class="muted">No residuals were kept with it.</p>;
      const strip = (name: string, axis: (one: FeatureResidual) => number) => ({ name, dots: rows.map(({ one, isCheck }) => ({ value: axis(one), isHollow: isCheck, title: `${one.feature} in ${idOf(one.scan)}: ${number(axis(one), 2)} µm` })) });
      return (
        <>
          <div><Picture title="Laser less touch, feature by feature" file={`${of} scanner residuals`}>
            <DotStrips strips={[strip('along X', (one) => one.dxUm), strip('along Y', (one) => one.dyUm), strip('along Z', (one) => one.dzUm)]} unit="µm" decimals={1} label="Laser less touch, machine axes" />
          </Picture>
          <p class="small muted">Full: cones, which the fit used. Hollow: slots, which took no part. Brackets: root mean square.</p></div>
          <Table caption="Residuals" columns={kFeatures} rows={rows} rowKey={({ one }) => `${one.scan} ${one.feature}`} />
        </>
      );
    }
    case 'rotation': {
      const { residuals } = result.value, brought = broughtBy(residuals);
      if (residuals.length === 0) return <p class="muted">No residuals were kept with it.</p>;
      const dots = (some: PoseResidual[], value: (p: PoseResidual) => number) => some.map((p) => ({ value: value(p), isHollow: p.heldOut, title: `at ${number(p.aDeg, 1)}, ${number(p.bDeg, 1)} deg: ${number(value(p), 2)} µm` }));
      return (
        <>
          <div><Picture title="Probed centre from where the axes put it" file={`${of} rotary axes residuals`}>
            <DotStrips strips={[{ name: 'in the fit', dots: dots(residuals.filter((p) => !p.heldOut), (p) => p.distanceUm) }, { name: 'held out', dots: dots(residuals.filter((p) => p.heldOut), (p) => p.distanceUm) }].filter((strip) => strip.dots.length > 0)} unit="µm" decimals={1} label="Distance of probed centres" />
          </Picture>
          {brought && <p>By the axes of the machine’s record the centres lay {quantity(brought.beforeUm, 'µm', 1)} off (rms), by these {quantity(brought.afterUm, 'µm', 2)}: {number(brought.beforeUm / Math.max(1e-9, brought.afterUm), 0)} times nearer{brought.isHeldOut && ', over the poses held out of the fit'}.</p>}</div>
          <Table caption="Residuals" columns={kPoses} rows={residuals} rowKey={(p) => `${p.aDeg} ${p.bDeg} ${p.distanceUm}`} />
        </>
      );
    }
    case 'probe': {
      const { residuals } = result.value, faces = [...new Set(residuals.map(({ face }) => face))];
      if (residuals.length === 0) return <p class="muted">No residuals were kept with it.</p>;
      return (
        <>
          <div><Picture title="Displacement read less expected, face by face" file={`${of} probe residuals`}>
            <DotStrips strips={faces.map((face) => ({ name: face, dots: residuals.filter((r) => r.face === face).map((r) => ({ value: r.residualUm, title: `${number(r.displacementMm, 3)} mm: ${number(r.residualUm, 2)} µm` })) }))} unit="µm" decimals={1} label="Displacement read less expected" />
          </Picture></div>
          <Table caption="Residuals" columns={kReadings} rows={residuals} rowKey={(r) => `${r.face} ${r.displacementMm} ${r.residualUm}`} />
        </>
      );
    }
    case 'axis': return <div><AxisTable axis={result.value} of={of} /></div>;
    default: return null;
  }
}

export const Residuals = ({ calibration }: { calibration: Calibration }) => (
  <section class="section" aria-labelledby="residuals-title">
    <h2 id="residuals-title">{calibration.result.case === 'axis' ? 'How the axis positions' : 'Residuals'}</h2>
    <div class="sheet two"><Drawn calibration={calibration} /></div>
    <Judgements judgements={calibration.judgements} />
  </section>
);
