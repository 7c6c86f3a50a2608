// Signed distances of points from a surface, for colours: nearest triangle by a grid, and over it the cubic patch of docs/methods/surface.md.
// The plant's own figures stand beside the picture; they are the ones that count.
import type { Surface } from './surface';

export const kFarMm = 1;  // an inspection sets points aside that are as far off

export class DistanceField {
  private readonly cellMm: number;
  private readonly low: [number, number, number];
  private readonly counts: [number, number, number];
  private readonly starts: Uint32Array;  // of each cell in `members`
  private readonly members: Uint32Array;
  private readonly normal = new Float64Array(3);

  constructor(private readonly surface: Surface) {
    const { vertices, triangles } = surface;
    const low: [number, number, number] = [Infinity, Infinity, Infinity], high: [number, number, number] = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < vertices.length; ++i) { const k = i % 3; low[k] = Math.min(low[k]!, vertices[i]!); high[k] = Math.max(high[k]!, vertices[i]!); }
    const triangleCount = triangles.length / 3;
    // As many cells as triangles, about: each holds a few.
    const extent = Math.max(1e-6, high[0] - low[0]) * Math.max(1e-6, high[1] - low[1]) * Math.max(1e-6, high[2] - low[2]);
    let cellMm = Math.max(0.15, Math.cbrt(extent / Math.max(1000, 2 * triangleCount)));
    const countsAt = (cell: number): [number, number, number] => [0, 1, 2].map((k) => Math.max(1, Math.floor((high[k]! - low[k]!) / cell) + 1)) as [number, number, number];
    while (countsAt(cellMm).reduce((a, b) => a * b) > 8e6) cellMm *= 1.3;
    this.cellMm = cellMm;
    this.low = low;
    this.counts = countsAt(cellMm);
    const cellCount = this.counts[0] * this.counts[1] * this.counts[2];
    const starts = new Uint32Array(cellCount + 1);
    const eachCell = (t: number, visit: (cell: number) => void) => {
      const from = [0, 0, 0], to = [0, 0, 0];
      for (let k = 0; k < 3; ++k) {
        const a = vertices[3 * triangles[3 * t]! + k]!, b = vertices[3 * triangles[3 * t + 1]! + k]!, c = vertices[3 * triangles[3 * t + 2]! + k]!;
        from[k] = Math.floor((Math.min(a, b, c) - low[k]!) / cellMm);
        to[k] = Math.min(this.counts[k]! - 1, Math.floor((Math.max(a, b, c) - low[k]!) / cellMm));
      }
      for (let z = from[2]!; z <= to[2]!; ++z) for (let y = from[1]!; y <= to[1]!; ++y) for (let x = from[0]!; x <= to[0]!; ++x) visit((z * this.counts[1] + y) * this.counts[0] + x);
    };
    for (let t = 0; t < triangleCount; ++t) eachCell(t, (cell) => { starts[cell + 1]! += 1; });
    for (let i = 0; i < cellCount; ++i) starts[i + 1]! += starts[i]!;
    const members = new Uint32Array(starts[cellCount]!);
    const next = starts.slice(0, cellCount);
    for (let t = 0; t < triangleCount; ++t) eachCell(t, (cell) => { members[next[cell]!++] = t; });
    this.starts = starts;
    this.members = members;
  }

  // mm, positive outside; NaN farther off than kFarMm. The point is about the surface's centre.
  at(x: number, y: number, z: number): number {
    const { counts, cellMm, low } = this;
    const cx = Math.floor((x - low[0]) / cellMm), cy = Math.floor((y - low[1]) / cellMm), cz = Math.floor((z - low[2]) / cellMm);
    let best = kFarMm * kFarMm, nearest = -1;
    this.bestU = this.bestV = 0;
    const most = Math.ceil(kFarMm / cellMm) + 1;
    for (let ring = 0; ring <= most; ++ring) {
      // What lies in this ring of cells is at least so far off.
      const least = (ring - 1) * cellMm;
      if (least > 0 && least * least > best) break;
      for (let dz = -ring; dz <= ring; ++dz) {
        const iz = cz + dz;
        if (iz < 0 || iz >= counts[2]) continue;
        for (let dy = -ring; dy <= ring; ++dy) {
          const iy = cy + dy;
          if (iy < 0 || iy >= counts[1]) continue;
          const isFace = Math.abs(dz) === ring || Math.abs(dy) === ring;
          for (let dx = -ring; dx <= ring; dx += isFace || ring === 0 ? 1 : 2 * ring) {
            const ix = cx + dx;
            if (ix < 0 || ix >= counts[0]) continue;
            const cell = (iz * counts[1] + iy) * counts[0] + ix;
            for (let m = this.starts[cell]!; m < this.starts[cell + 1]!; ++m) {
              const t = this.members[m]!;
              const d = this.squaredTo(t, x, y, z);
              if (d < best) { best = d; nearest = t; this.bestU = this.u; this.bestV = this.v; }
            }
          }
        }
      }
    }
    return nearest < 0 ? NaN : this.signed(nearest, x, y, z, best);
  }

  private u = 0; private v = 0; private bestU = 0; private bestV = 0;

  // Squared distance to a triangle; leaves the foot's barycentric coordinates of the second and third corner (Ericson's regions).
  private squaredTo(t: number, x: number, y: number, z: number): number {
    const { vertices: p, triangles } = this.surface;
    const a = 3 * triangles[3 * t]!, b = 3 * triangles[3 * t + 1]!, c = 3 * triangles[3 * t + 2]!;
    const ax = p[a]!, ay = p[a + 1]!, az = p[a + 2]!;
    const abx = p[b]! - ax, aby = p[b + 1]! - ay, abz = p[b + 2]! - az, acx = p[c]! - ax, acy = p[c + 1]! - ay, acz = p[c + 2]! - az;
    const apx = x - ax, apy = y - ay, apz = z - az;
    const d1 = abx * apx + aby * apy + abz * apz, d2 = acx * apx + acy * apy + acz * apz;
    let v = 0, w = 0;
    if (d1 <= 0 && d2 <= 0) { v = 0; w = 0; } else {
      const bpx = apx - abx, bpy = apy - aby, bpz = apz - abz;
      const d3 = abx * bpx + aby * bpy + abz * bpz, d4 = acx * bpx + acy * bpy + acz * bpz;
      const cpx = apx - acx, cpy = apy - acy, cpz = apz - acz;
      const d5 = abx * cpx + aby * cpy + abz * cpz, d6 = acx * cpx + acy * cpy + acz * cpz;
      const vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
      if (d3 >= 0 && d4 <= d3) v = 1;
      else if (vc <= 0 && d1 >= 0 && d3 <= 0) v = d1 / (d1 - d3);
      else if (d6 >= 0 && d5 <= d6) w = 1;
      else if (vb <= 0 && d2 >= 0 && d6 <= 0) w = d2 / (d2 - d6);
      else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) { w = (d4 - d3) / (d4 - d3 + (d5 - d6)); v = 1 - w; }
      else { const sum = va + vb + vc; v = vb / sum; w = vc / sum; }
    }
    this.u = v; this.v = w;
    const ex = apx - v * abx - w * acx, ey = apy - v * aby - w * acy, ez = apz - v * abz - w * acz;
    return ex * ex + ey * ey + ez * ez;
  }

  private signed(t: number, x: number, y: number, z: number, squared: number): number {
    const { vertices: p, triangles, normals } = this.surface;
    const corner = [3 * triangles[3 * t]!, 3 * triangles[3 * t + 1]!, 3 * triangles[3 * t + 2]!] as const;
    const [a, b, c] = corner;
    const abx = p[b]! - p[a]!, aby = p[b + 1]! - p[a + 1]!, abz = p[b + 2]! - p[a + 2]!, acx = p[c]! - p[a]!, acy = p[c + 1]! - p[a + 1]!, acz = p[c + 2]! - p[a + 2]!;
    const n = this.normal;
    n[0] = aby * acz - abz * acy; n[1] = abz * acx - abx * acz; n[2] = abx * acy - aby * acx;
    const size = Math.hypot(n[0]!, n[1]!, n[2]!) || 1;
    n[0]! /= size; n[1]! /= size; n[2]! /= size;
    const height = (x - p[a]!) * n[0]! + (y - p[a + 1]!) * n[1]! + (z - p[a + 2]!) * n[2]!;
    const weights = [1 - this.bestU - this.bestV, this.bestU, this.bestV];
    let patch = 0;
    if (normals) {
      let all = 0;
      for (let i = 0; i < 3; ++i) {
        const nx = normals[9 * t + 3 * i]!, ny = normals[9 * t + 3 * i + 1]!, nz = normals[9 * t + 3 * i + 2]!;
        const along = nx * n[0]! + ny * n[1]! + nz * n[2]!;
        if (along < 0.3) return Math.sign(height || 1) * Math.sqrt(squared);  // no height field over so bent a triangle
        for (let j = 0; j < 3; ++j) {
          if (i === j) continue;
          const from = corner[i]!, to = corner[j]!;
          const rise = -(nx * (p[to]! - p[from]!) + ny * (p[to + 1]! - p[from + 1]!) + nz * (p[to + 2]! - p[from + 2]!)) / (3 * along);
          all += rise;
          patch += 3 * weights[i]! * weights[i]! * weights[j]! * rise;
        }
      }
      patch += 6 * weights[0]! * weights[1]! * weights[2]! * (all / 4);
    }
    const onBorder = Math.abs(Math.sqrt(squared) - Math.abs(height)) > 1e-9 + 1e-6 * Math.abs(height);
    // Beside a foot on an edge the plane's height is no distance; the patch still says by how much the surface stands off its chord.
    return onBorder ? Math.sign(height || 1) * Math.sqrt(squared) - patch : height - patch;
  }
}
