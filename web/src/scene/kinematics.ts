// A machine's joints as data: where each stands for given commands, carried by those before it.
import { JointKind, type Joint } from '#proto/sixpoint/plant/v1/machine_pb';
import { after, directionOf, times, turnAbout, type Affine, type Vector } from './frames';

export type Commands = Record<string, number>;  // by axis letter, mm or degrees
export const kStill: Affine = { linear: [1, 0, 0, 0, 1, 0, 0, 0, 1], shift: [0, 0, 0] };

export function motionOf(joint: Joint, command: number): Affine {
  const sense = joint.sign < 0 ? -1 : 1;
  if (joint.kind === JointKind.LINEAR) return { linear: kStill.linear, shift: times(directionOf(joint.direction), sense * command) };
  return turnAbout({ direction: joint.direction, pointMm: joint.pointMm } as never, (sense * command * Math.PI) / 180);
}

// Of each joint what it is carried by, and at last what the end of the chain does.
export function chainOf(joints: Joint[], commands: Commands): { carriers: Affine[]; end: Affine } {
  const carriers: Affine[] = [];
  let so = kStill;
  for (const joint of joints) {
    carriers.push(so);
    so = after(so, motionOf(joint, commands[joint.axis] ?? 0));
  }
  return { carriers, end: so };
}

// What a slider may go to: a record may state a million degrees for an axis that turns on and on.
export function reachOf(joint: Joint): { minimum: number; maximum: number } {
  const most = joint.kind === JointKind.ROTARY ? 360 : 2000;
  return { minimum: Math.max(-most, joint.minimum), maximum: Math.min(most, joint.maximum) };
}

// The tool over a point, as near as its axes let it.
export function commandsTowards(joints: Joint[], point: Vector): Commands {
  const commands: Commands = {};
  for (const joint of joints) {
    if (joint.kind !== JointKind.LINEAR) continue;
    const d = directionOf(joint.direction), { minimum, maximum } = reachOf(joint), wanted = (joint.sign < 0 ? -1 : 1) * (d[0] * point[0] + d[1] * point[1] + d[2] * point[2]);
    commands[joint.axis] = Math.min(maximum, Math.max(minimum, wanted));
  }
  return commands;
}
