// How a part stands off its nominal pose: six numbers about one point, machine frame, with their standard uncertainties.
import type { Part } from '#proto/sixpoint/plant/v1/part_pb';
import type { Registration } from '#proto/sixpoint/registration/v1/registration_pb';
import { apply, inverse, minus, plus, rigid, times, vectorOf, type Affine, type Vector } from './frames';

export type Displacement = {
  aboutMm: Vector;  // machine frame: where the shift is that of this point of the part
  shiftMm: Vector;
  turnDeg: Vector;  // rotation vector
  shiftStandardUncertaintyMm: Vector | undefined;
  turnStandardUncertaintyDeg: Vector | undefined;
};

const kDegPerRad = 180 / Math.PI;

// Of a rotation, row-major: axis times angle.
export function rotationVectorRad(r: number[]): Vector {
  const sine: Vector = [(r[7]! - r[5]!) / 2, (r[2]! - r[6]!) / 2, (r[3]! - r[1]!) / 2], s = Math.hypot(...sine);
  const angle = Math.atan2(s, (r[0]! + r[4]! + r[8]! - 1) / 2);
  return s < 1e-12 ? [0, 0, 0] : times(sine, angle / s);
}

export function displacementOf(registration: Registration, part: Part): Displacement | undefined {
  if (!registration.zeroFromPart || !part.zeroFromPartNominal) return undefined;
  const found = rigid(registration.zeroFromPart), nominal = rigid(part.zeroFromPartNominal), covariance = registration.covariance;
  const box = part.surface;
  const middle: Vector = box?.minimumMm && box.maximumMm ? times(plus(vectorOf(box.minimumMm), vectorOf(box.maximumMm)), 0.5) : vectorOf(part.sixPoints[0]?.pointInPartMm);
  // Where the covariance is stated, it is stated about its own point: there its diagonal is what belongs to the six numbers.
  const about: Vector = covariance?.referenceMm ? vectorOf(covariance.referenceMm) : apply(found, middle);
  const turn: Affine = { linear: multiplied(found.linear, transposed(nominal.linear)), shift: [0, 0, 0] };
  const deviation = (i: number) => Math.sqrt(Math.max(0, covariance!.values[7 * i]!));
  const has = covariance?.values.length === 36;
  return {
    aboutMm: about,
    shiftMm: minus(about, apply(nominal, apply(inverse(found), about))),
    turnDeg: times(rotationVectorRad(turn.linear), kDegPerRad),
    turnStandardUncertaintyDeg: has ? [deviation(0) * kDegPerRad, deviation(1) * kDegPerRad, deviation(2) * kDegPerRad] : undefined,
    shiftStandardUncertaintyMm: has ? [deviation(3), deviation(4), deviation(5)] : undefined,
  };
}

export const transposed = (m: number[]): number[] => [m[0]!, m[3]!, m[6]!, m[1]!, m[4]!, m[7]!, m[2]!, m[5]!, m[8]!];

export function multiplied(a: number[], b: number[]): number[] {
  return Array.from({ length: 9 }, (_, i) => [0, 1, 2].reduce((sum, k) => sum + a[3 * Math.floor(i / 3) + k]! * b[3 * k + (i % 3)]!, 0));
}
