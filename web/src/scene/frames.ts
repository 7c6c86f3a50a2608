// The chain of a point, as docs/methods/frames.md has it: sensor -> machine -> zero -> part. In doubles: a part may stand metres from its origin.
import type { Line, RigidTransform } from '#proto/sixpoint/geometry/v1/geometry_pb';
import type { RotationCalibration } from '#proto/sixpoint/calibration/v1/rotation_pb';
import type { SensorCalibration } from '#proto/sixpoint/calibration/v1/sensor_pb';
import type { ScanHeader } from '#proto/sixpoint/ingest/v1/scan_pb';
import type { Sensor } from '#proto/sixpoint/plant/v1/machine_pb';
import type { Registration } from '#proto/sixpoint/registration/v1/registration_pb';

export type Vector = [number, number, number];
export type Affine = { linear: number[]; shift: Vector };  // linear: 3 x 3, row-major

const kRadPerDeg = Math.PI / 180;

export const vectorOf = (p: { xMm: number; yMm: number; zMm: number } | undefined): Vector => (p ? [p.xMm, p.yMm, p.zMm] : [0, 0, 0]);
export const directionOf = (d: { x: number; y: number; z: number } | undefined): Vector => (d ? [d.x, d.y, d.z] : [0, 0, 1]);
export const minus = (a: Vector, b: Vector): Vector => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const plus = (a: Vector, b: Vector): Vector => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const times = (a: Vector, s: number): Vector => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a: Vector, b: Vector): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a: Vector, b: Vector): Vector => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a: Vector): number => Math.hypot(a[0], a[1], a[2]);

export function apply(t: Affine, p: Vector): Vector {
  const m = t.linear;
  return [m[0]! * p[0] + m[1]! * p[1] + m[2]! * p[2] + t.shift[0], m[3]! * p[0] + m[4]! * p[1] + m[5]! * p[2] + t.shift[1], m[6]! * p[0] + m[7]! * p[1] + m[8]! * p[2] + t.shift[2]];
}

// c_from_a = after(c_from_b, b_from_a)
export function after(outer: Affine, inner: Affine): Affine {
  const linear: number[] = [];
  for (let i = 0; i < 3; ++i) for (let j = 0; j < 3; ++j) linear.push(outer.linear[3 * i]! * inner.linear[j]! + outer.linear[3 * i + 1]! * inner.linear[3 + j]! + outer.linear[3 * i + 2]! * inner.linear[6 + j]!);
  return { linear, shift: apply(outer, inner.shift) };
}

export function inverse(t: Affine): Affine {
  const [a, b, c, d, e, f, g, h, i] = t.linear as [number, number, number, number, number, number, number, number, number];
  const A = e * i - f * h, B = f * g - d * i, C = d * h - e * g, det = a * A + b * B + c * C;
  const linear = [A, c * h - b * i, b * f - c * e, B, a * i - c * g, c * d - a * f, C, b * g - a * h, a * e - b * d].map((x) => x / det);
  const shift = apply({ linear, shift: [0, 0, 0] }, t.shift);
  return { linear, shift: [-shift[0], -shift[1], -shift[2]] };
}

export function rigid(t: RigidTransform): Affine {
  return { linear: t.rotation.length === 9 ? [...t.rotation] : [1, 0, 0, 0, 1, 0, 0, 0, 1], shift: vectorOf(t.translationMm) };
}

export function turnAbout(line: Line, angleRad: number): Affine {
  const [x, y, z] = directionOf(line.direction), c = Math.cos(angleRad), s = Math.sin(angleRad), k = 1 - c;
  const linear = [c + k * x * x, k * x * y - s * z, k * x * z + s * y, k * x * y + s * z, c + k * y * y, k * y * z - s * x, k * x * z - s * y, k * y * z + s * x, c + k * z * z];
  const point = vectorOf(line.pointMm);
  return { linear, shift: minus(point, apply({ linear, shift: [0, 0, 0] }, point)) };
}

export function machineFromZero(axes: RotationCalibration, aDeg: number, bDeg: number): Affine {
  return after(turnAbout(axes.aAxis!, aDeg * kRadPerDeg), turnAbout(axes.bAxis!, bDeg * kRadPerDeg));
}

function machineFromSensor(sensor: SensorCalibration, v0: Vector): Affine {
  const r = sensor.machineFromSensorRotation;
  // R_sm (0, y, z) + (x, 0, 0) - V0 + T_sm; of a snapshot, whose sensor's pose was stated, R_sm (x, y, z) - V0 + T_sm
  const isSnapshot = sensor.certificate !== '';
  const linear = isSnapshot ? [...r] : [1, r[1]!, r[2]!, 0, r[4]!, r[5]!, 0, r[7]!, r[8]!];
  return { linear, shift: minus(vectorOf(sensor.tSmMm), v0) };
}

// By the axis tables that the registration applied; without one what was commanded.
function reachedDeg(registration: Registration, axis: string | undefined, commandedDeg: number): number {
  const found = registration.angles.find((angle) => angle.axis === axis && Math.abs(angle.commandedDeg - commandedDeg) < 1e-9);
  return found?.characterisation ? found.reachedDeg : commandedDeg;
}

export type Mapping = { partFromSensor: Affine; field: Field | undefined };
export type Field = { halfWidthMm: number; halfRangeMm: number; termsMm: number[] };

export function partFromSensor(header: ScanHeader, sensor: SensorCalibration, rotation: RotationCalibration, registration: Registration, optics: Sensor | undefined): Mapping {
  const zeroFromPart = rigid(registration.zeroFromPart!);
  const [a, b] = rotation.axes;
  const machineFromZeroNow = machineFromZero(rotation, reachedDeg(registration, a, header.aDeg), reachedDeg(registration, b, header.bDeg));
  let zeroFromSensor = after(inverse(machineFromZeroNow), machineFromSensor(sensor, vectorOf(header.v0Mm)));
  const stretch = registration.thermalStretch;
  if (stretch) {  // about the inner axis, as the registration did
    const about = vectorOf(rotation.bAxis!.pointMm), ratio = 1 / stretch;
    zeroFromSensor = after({ linear: [ratio, 0, 0, 0, ratio, 0, 0, 0, ratio], shift: times(about, 1 - ratio) }, zeroFromSensor);
  }
  const field = sensor.fieldTermsUm.length === 9 && optics
    ? { halfWidthMm: (optics.midRangeMm + optics.rangeMm / 2) * Math.tan(optics.lineAngleDeg * kRadPerDeg / 2), halfRangeMm: optics.rangeMm / 2, termsMm: sensor.fieldTermsUm.map((um) => um / 1000) }
    : undefined;
  return { partFromSensor: after(inverse(zeroFromPart), zeroFromSensor), field };
}

// Legendre's polynomials, each of mean square 1 over [-1, 1]; beyond the field a reading counts as one on its border.
function legendre(t: number): Vector {
  const x = Math.min(1, Math.max(-1, t));
  return [Math.sqrt(3) * x, Math.sqrt(5) * (1.5 * x * x - 0.5), Math.sqrt(7) * (2.5 * x * x * x - 1.5 * x)];
}

// How far a reading is off along z by the calibration's field.
export function fieldAt(field: Field, yMm: number, zMm: number): number {
  const y = [1, ...legendre(yMm / field.halfWidthMm)], z = [1, ...legendre(zMm / field.halfRangeMm)];
  let sum = 0, at = 0;
  for (let order = 1; order <= 3; ++order) for (let ofZ = 0; ofZ <= order; ++ofZ) sum += y[order - ofZ]! * z[ofZ]! * field.termsMm[at++]!;
  return sum;
}
