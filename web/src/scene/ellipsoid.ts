// Of a symmetric 3 x 3 matrix: its eigenvectors, unit, with their eigenvalues, the greatest first. Jacobi's turns: exact enough, and nothing to go wrong.
import type { Vector } from './frames';

export function eigenOf(matrix: number[]): { value: number; vector: Vector }[] {
  const a = [...matrix], v = [1, 0, 0, 0, 1, 0, 0, 0, 1];
  for (let sweep = 0; sweep < 40; ++sweep) {
    if (Math.abs(a[1]!) + Math.abs(a[2]!) + Math.abs(a[5]!) < 1e-18 * (Math.abs(a[0]!) + Math.abs(a[4]!) + Math.abs(a[8]!))) break;
    for (const [p, q] of [[0, 1], [0, 2], [1, 2]] as const) {
      const apq = a[3 * p + q]!;
      if (apq === 0) continue;
      const theta = (a[4 * q]! - a[4 * p]!) / (2 * apq), t = Math.sign(theta || 1) / (Math.abs(theta) + Math.hypot(theta, 1)), c = 1 / Math.hypot(t, 1), s = t * c;
      for (let k = 0; k < 3; ++k) { const x = a[3 * k + p]!, y = a[3 * k + q]!; a[3 * k + p] = c * x - s * y; a[3 * k + q] = s * x + c * y; }
      for (let k = 0; k < 3; ++k) { const x = a[3 * p + k]!, y = a[3 * q + k]!; a[3 * p + k] = c * x - s * y; a[3 * q + k] = s * x + c * y; }
      for (let k = 0; k < 3; ++k) { const x = v[3 * k + p]!, y = v[3 * k + q]!; v[3 * k + p] = c * x - s * y; v[3 * k + q] = s * x + c * y; }
    }
  }
  return [0, 1, 2].map((i) => ({ value: Math.max(0, a[4 * i]!), vector: [v[i]!, v[3 + i]!, v[6 + i]!] as Vector })).sort((x, y) => y.value - x.value);
}

// The shadow of the ellipsoid x' C^-1 x = 1 on two of its axes: semi-axes, and the turn of the longer one.
export function shadowOf(covariance: number[], i: number, j: number): { longer: number; shorter: number; turnRad: number } {
  const a = covariance[4 * i]!, b = covariance[3 * i + j]!, c = covariance[4 * j]!, middle = (a + c) / 2, reach = Math.hypot((a - c) / 2, b);
  return { longer: Math.sqrt(Math.max(0, middle + reach)), shorter: Math.sqrt(Math.max(0, middle - reach)), turnRad: 0.5 * Math.atan2(2 * b, a - c) };
}
