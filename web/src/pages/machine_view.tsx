// The machine's axes in 3D, moved by sliders.
import { useEffect, useRef, useState } from 'preact/hooks';
import { JointKind, type Joint, type Machine } from '#proto/sixpoint/plant/v1/machine_pb';
import type { SensorCalibration } from '#proto/sixpoint/calibration/v1/sensor_pb';
import { number } from '../words/quantity';
import { commandsTowards, reachOf, type Commands } from '../scene/kinematics';
import { vectorOf } from '../scene/frames';
import type { MachineScene } from '../scene/machine_scene';
import { download, fileNameOf } from '../view/picture';

const unitOf = (joint: Joint) => (joint.kind === JointKind.ROTARY ? 'deg' : 'mm');

export function MachineView({ machine, sensorCalibration, title }: { machine: Machine; sensorCalibration: SensorCalibration | undefined; title: string }) {
  const canvas = useRef<HTMLCanvasElement>(null), scene = useRef<MachineScene>();
  const { partSide = [], toolSide = [] } = machine.kinematics ?? {}, joints = [...partSide, ...toolSide];
  const sizeMm = Math.max(60, 1.6 * (machine.sensor?.midRangeMm ?? 60));
  const [isOpen, setOpen] = useState(false), [problem, setProblem] = useState(''), [showsField, setShowsField] = useState(true);
  const rest = (): Commands => {
    const centre = vectorOf(machine.nominalCentreMm);
    return { ...Object.fromEntries(joints.map((joint) => { const { minimum, maximum } = reachOf(joint); return [joint.axis, Math.min(maximum, Math.max(minimum, 0))]; })), ...commandsTowards(toolSide, [centre[0] + 0.95 * sizeMm, centre[1] + 0.2 * sizeMm, centre[2] + 0.5 * sizeMm]) };
  };
  const [commands, setCommands] = useState<Commands>(rest);
  useEffect(() => {
    let isOver = false;
    import('../scene/machine_scene').then((module) => {
      if (isOver) return;
      scene.current = new module.MachineScene(canvas.current!, machine, sizeMm);
      setOpen(true);
    }).catch((error: unknown) => setProblem(error instanceof Error ? error.message : String(error)));
    return () => { isOver = true; scene.current?.stop(); scene.current = undefined; setOpen(false); };
  }, [machine]);
  useEffect(() => { scene.current?.setCommands(commands); }, [commands, isOpen]);
  useEffect(() => {
    const sensor = machine.sensor;
    scene.current?.setField(showsField && sensor ? {
      midRangeMm: sensor.midRangeMm, nearMm: sensor.midRangeMm - sensor.rangeMm / 2, farMm: sensor.midRangeMm + sensor.rangeMm / 2, halfAngleRad: (sensor.lineAngleDeg * Math.PI) / 360,
      machineFromSensorRotation: sensorCalibration?.machineFromSensorRotation ?? [],
    } : undefined);
  }, [showsField, sensorCalibration, machine, isOpen]);
  if (joints.length === 0) return <p class="muted">No joints are recorded of it: it cannot be drawn.</p>;
  return (
    <div class="blade-body section">
      <div class="part-scene">
        <div class="view3d"><canvas ref={canvas} tabIndex={0} role="img" aria-label={`The machine's axes in 3D: ${joints.map((joint) => `${joint.axis} at ${number(commands[joint.axis], 1)} ${unitOf(joint)}`).join(', ')}. Arrow keys turn the view, plus and minus come nearer and go away, Home shows all.`} />
          {(problem || !isOpen) && <div class="over" role="status">{problem ? <span class="tone-bad">{problem}</span> : 'Loading the picture…'}</div>}</div>
        <div class="view-tools no-print">
          <label><input type="checkbox" checked={showsField} onChange={(event) => setShowsField(event.currentTarget.checked)} />Scanner and its field</label>
          <button type="button" class="quiet" onClick={() => scene.current?.home()}>Show all</button>
          <button type="button" class="quiet" disabled={!isOpen} aria-label="Download PNG of the 3D view" onClick={() => { void scene.current!.picture(`${title}, ${joints.map((joint) => `${joint.axis} ${number(commands[joint.axis], 1)} ${unitOf(joint)}`).join(', ')}`).then((blob) => download(blob, fileNameOf(`${title} axes`))); }}>Download PNG</button>
        </div>
      </div>
      <div class="sheet">
        <div class="table-head"><h2>Axes</h2><button type="button" class="quiet" onClick={() => setCommands(rest())}>Back to rest</button></div>
        {([['carry the part, from the bed on', partSide], ['carry tool and scanner', toolSide]] as const).map(([words, some]) => some.length > 0 && (
          <fieldset key={words} class="axes"><legend class="small muted">{words}</legend>
            {some.map((joint) => {
              const { minimum, maximum } = reachOf(joint), unit = unitOf(joint);
              return (
                <label key={joint.axis}><strong>{joint.axis}</strong>
                  <input type="range" min={minimum} max={maximum} step={(maximum - minimum) / 1000} value={commands[joint.axis]} aria-label={`Axis ${joint.axis}`} aria-valuetext={`${number(commands[joint.axis], 1)} ${unit}`}
                    onInput={(event) => setCommands({ ...commands, [joint.axis]: Number(event.currentTarget.value) })} />
                  <span class="num">{number(commands[joint.axis], 1)}&#8239;{unit}</span></label>
              );
            })}
          </fieldset>
        ))}
        <p class="small muted">A schema of the recorded joints about their nominal crossing: housing, bearings and table are drawn as they may be. Of the scanner only its field is to scale, laid over the crossing{sensorCalibration ? ', turned as it was calibrated' : ''}.</p>
      </div>
    </div>
  );
}
