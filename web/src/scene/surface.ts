// A prepared surface, as the plant stores it (metrology/mesh/mesh_bytes.cc tells the format).
import type { Vector } from './frames';

export type Surface = {
  centre: Vector;  // of its box: what is drawn is drawn about it, for float32 holds no micrometres metres from the origin
  radius: number;
  vertices: Float64Array;  // x, y, z about the centre, mm
  triangles: Uint32Array;
  normals: Float32Array | undefined;  // of each triangle's corners; none: facets are the truth
};

export class SurfaceUnreadable extends Error {}

export function readSurface(bytes: Uint8Array): Surface {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (bytes.length < 40 || new TextDecoder().decode(bytes.subarray(0, 8)) !== 'SIXPMESH') throw new SurfaceUnreadable('The surface is of another format.');
  if (view.getUint32(8, true) !== 1) throw new SurfaceUnreadable('The surface is of a newer format than this page reads.');
  const flags = view.getUint32(12, true);
  const vertexCount = Number(view.getBigUint64(16, true)), triangleCount = Number(view.getBigUint64(24, true));
  const size = 40 + 24 * vertexCount + (12 + (flags & 1 ? 36 : 0) + (flags & 2 ? 2 : 0)) * triangleCount;
  if (size !== bytes.length) throw new SurfaceUnreadable('The surface is cut short.');
  const vertices = new Float64Array(bytes.slice(40, 40 + 24 * vertexCount).buffer);
  let at = 40 + 24 * vertexCount;
  const triangles = new Uint32Array(bytes.slice(at, at + 12 * triangleCount).buffer);
  at += 12 * triangleCount;
  const normals = flags & 1 ? new Float32Array(bytes.slice(at, at + 36 * triangleCount).buffer) : undefined;
  const low: Vector = [Infinity, Infinity, Infinity], high: Vector = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < vertices.length; ++i) {
    const axis = i % 3;
    low[axis] = Math.min(low[axis]!, vertices[i]!);
    high[axis] = Math.max(high[axis]!, vertices[i]!);
  }
  const centre: Vector = vertexCount > 0 ? [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2] : [0, 0, 0];
  for (let i = 0; i < vertices.length; ++i) vertices[i]! -= centre[i % 3]!;
  const radius = vertexCount > 0 ? Math.hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]) / 2 : 1;
  return { centre, radius, vertices, triangles, normals };
}
