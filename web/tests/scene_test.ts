// The page's own geometry, held to what can be known without it.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import draco3d from 'draco3d';
import { create } from '@bufbuild/protobuf';
import { PerspectiveCamera, Vector3 } from 'three';
import { LineSchema } from '#proto/sixpoint/geometry/v1/geometry_pb';
import { colourOf, colourTable, kColourCount, kColourReach } from '../src/scene/colours';
import { shuffled } from '../src/scene/cloud';
import { decodeBlock } from '../src/scene/draco_block';
import { DistanceField } from '../src/scene/distance';
import { PointRaster } from '../src/scene/point_raster';
import { after, apply, fieldAt, inverse, turnAbout } from '../src/scene/frames';
import { readSurface } from '../src/scene/surface';
import { scanPoints, surfaceBytes, surfaceNormal, surfacePoint } from './fixtures/blade_world';
import { encodePlain } from './fixtures/draco_blocks';

test('a positive turn is right-handed: about machine Y it takes Z towards X', () => {
  const line = create(LineSchema, { direction: { x: 0, y: 1, z: 0 }, pointMm: { xMm: 5, yMm: 0, zMm: 5 } });
  const turned = apply(turnAbout(line, Math.PI / 2), [5, 3, 6]);
  assert.ok(Math.hypot(turned[0] - 6, turned[1] - 3, turned[2] - 5) < 1e-12, String(turned));
});

test('an inverse after its mapping changes nothing, also where it shears', () => {
  const sheared = { linear: [1, 0.01, -0.02, 0, 0.999, 0.03, 0, -0.031, 1.001], shift: [6350, -3, 12] as [number, number, number] };
  const p = apply(after(inverse(sheared), sheared), [1, 2, 3]);
  assert.ok(Math.hypot(p[0] - 1, p[1] - 2, p[2] - 3) < 1e-9, String(p));
});

test('each term of the field has a mean square of 1, and they are orthogonal', () => {
  const means = Array.from({ length: 9 }, () => new Array<number>(9).fill(0)), n = 60;
  for (let i = 0; i < n; ++i) for (let j = 0; j < n; ++j) {
    const y = ((i + 0.5) / n) * 2 - 1, z = ((j + 0.5) / n) * 2 - 1;
    const terms = Array.from({ length: 9 }, (_, k) => fieldAt({ halfWidthMm: 3, halfRangeMm: 2, termsMm: Array.from({ length: 9 }, (_, m) => Number(m === k)) }, 3 * y, 2 * z));
    for (let a = 0; a < 9; ++a) for (let b = 0; b < 9; ++b) means[a]![b]! += (terms[a]! * terms[b]!) / (n * n);
  }
  for (let a = 0; a < 9; ++a) for (let b = 0; b < 9; ++b) assert.ok(Math.abs(means[a]![b]! - Number(a === b)) < 0.02, `${a} ${b}: ${means[a]![b]}`);
});

test('points known to stand off the surface are measured so, metres from the origin and over a coarse mesh', () => {
  const surface = readSurface(surfaceBytes(160, 40)), field = new DistanceField(surface);
  const flat = new DistanceField({ ...surface, normals: undefined });
  let worst = 0, worstFlat = 0;
  for (let i = 0; i < 400; ++i) {
    const t = 0.1 + 0.25 * ((i * 0.618) % 1), s = 0.1 + 0.8 * ((i * 0.417) % 1), off = 0.05 * Math.sin(i);
    const p = surfacePoint(t, s), n = surfaceNormal(t, s), c = surface.centre;
    const at: [number, number, number] = [p[0] + off * n[0] - c[0], p[1] + off * n[1] - c[1], p[2] + off * n[2] - c[2]];
    worst = Math.max(worst, Math.abs(field.at(...at) - off));
    worstFlat = Math.max(worstFlat, Math.abs(flat.at(...at) - off));
  }
  // The patch's own error on triangles of 0.5 x 1.5 mm; without patches the chords stand off by some um.
  assert.ok(worst < 0.0003, `worst ${1000 * worst} um`);
  assert.ok(worstFlat > 5 * worst, `flat ${1000 * worstFlat} um: the patches would not be needed`);
  assert.ok(Number.isNaN(field.at(0, 25, 0)), 'what is far off is not measured');
});

test('a range image of the plant decodes to the points that were sent, within its bound', async () => {
  // 20 profiles of 50 columns, written by EncodeRangeImage with a bound of 0.25 um, in steps of two bounds.
  const decoded = decodeBlock((await draco3d.createDecoderModule({})) as never, readFileSync('tests/fixtures/range_image_block.drc'));
  assert.equal(decoded.length, 3000);
  let worst = 0;
  for (let i = 0; i < 20; ++i) for (let c = 0; c < 50; ++c) {
    const z = 2 * Math.sin(0.2 * i) + 0.01 * c, wanted = [0.1 * i, (66 - z) * Math.tan(-0.1745 + 0.0005 * c), z];
    for (let k = 0; k < 3; ++k) worst = Math.max(worst, Math.abs(decoded[3 * (50 * i + c) + k]! - wanted[k]!));
  }
  assert.ok(worst <= 0.00025, `worst ${1000 * worst} um`);
});

test('plain Draco decodes to the points that were sent, as float32', async () => {
  const { points } = scanPoints('scans/sn412_pins_1', 3000);
  const decoded = decodeBlock((await draco3d.createDecoderModule({})) as never, await encodePlain(points));
  assert.equal(decoded.length, points.length);
  for (let i = 0; i < points.length; ++i) assert.equal(decoded[i], Math.fround(points[i]!));
});

test('bytes that are no block are refused', async () => {
  const draco = (await draco3d.createDecoderModule({})) as never;
  assert.throws(() => decodeBlock(draco, new TextEncoder().encode('not a block at all, nothing of it')));
});

test('shuffling keeps every point once', () => {
  const piece = (from: number, count: number) => ({ positions: Float32Array.from({ length: 3 * count }, (_, i) => from + Math.floor(i / 3)), deviationsUm: Float32Array.from({ length: count }, (_, i) => from + i) });
  const cloud = shuffled([piece(0, 1000), piece(1000, 236)]);
  assert.deepEqual([...cloud.deviationsUm].sort((a, b) => a - b), Array.from({ length: 1236 }, (_, i) => i));
  for (let i = 0; i < cloud.count; ++i) assert.equal(cloud.positions[3 * i], cloud.deviationsUm[i]);
  const first = [...cloud.deviationsUm.slice(0, 100)];
  assert.ok(Math.max(...first) > 1100 && Math.min(...first) < 120, 'a first part is spread over all');
});

test('the legend has the colours that points have', () => {
  const table = colourTable(50, 10);
  for (const um of [-60, -49, -20, -9, 0, 9, 20, 49, 60]) {
    const clamped = Math.max(-0.999, Math.min(0.999, um / (50 * kColourReach))), i = Math.floor((0.5 + 0.5 * clamped) * kColourCount);
    const wanted = colourOf(um, 50, 10), got = [table[4 * i]!, table[4 * i + 1]!, table[4 * i + 2]!];
    for (let k = 0; k < 3; ++k) assert.ok(Math.abs(wanted[k]! - got[k]!) <= 3, `${um}: ${got} for ${wanted}`);
  }
});

test('a surface that is cut short or of another format is refused', () => {
  const bytes = surfaceBytes(12, 3);
  assert.throws(() => readSurface(bytes.slice(0, bytes.length - 1)), /cut short/);
  assert.throws(() => readSurface(new Uint8Array(100)), /another format/);
});

test('points drawn by the page stand where three.js puts them, the nearer one seen, and what is behind or beside is not', () => {
  const camera = new PerspectiveCamera(32, 160 / 90, 1, 500), raster = new PointRaster();
  camera.position.set(30, -80, 12);
  camera.up.set(0, 0, 1);
  camera.lookAt(1, 2, 3);
  camera.updateMatrixWorld();
  const count = 4000, positions = new Float32Array(3 * count), colours = new Uint32Array(count);
  for (let i = 0; i < count; ++i) {
    // All around who looks.
    positions.set([((i * 0.8191725134) % 1) * 300 - 150, ((i * 0.6710436067) % 1) * 300 - 150, ((i * 0.5497004779) % 1) * 200 - 100], 3 * i);
    colours[i] = i + 1;
  }
  for (const size of [1, 2]) {
    const nearest = new Map<number, { depth: number; colour: number }>();
    let seen = 0;
    for (let i = 0; i < count; ++i) {
      const at = new Vector3().fromArray(positions, 3 * i), before = at.clone().applyMatrix4(camera.matrixWorldInverse).z < -1;
      at.project(camera);
      const x = Math.floor((at.x + 1) * 80 - (size - 1) / 2), y = Math.floor((at.y + 1) * 45 - (size - 1) / 2), depth = (at.z + 1) / 2;
      if (!before || x < 0 || y < 0 || x >= 160 || y >= 90 || depth >= 1) continue;
      seen += 1;
      for (let v = y; v < Math.min(90, y + size); ++v) for (let u = x; u < Math.min(160, x + size); ++u) {
        if (depth < (nearest.get(v * 160 + u)?.depth ?? 1)) nearest.set(v * 160 + u, { depth, colour: i + 1 });
      }
    }
    raster.begin(160, 90);
    raster.draw(positions, colours, count, camera.projectionMatrix.clone().multiply(camera.matrixWorldInverse).elements, size);
    let differing = 0, drawn = 0;
    raster.pixels.forEach((colour, at) => {
      const wanted = nearest.get(at);
      if (colour) drawn += 1;
      if (colour !== (wanted?.colour ?? 0)) differing += 1;
      else if (wanted) assert.ok(Math.abs(raster.depths[at]! - wanted.depth) < 1e-6);
    });
    assert.ok(seen > 200 && drawn > 200, `${seen} seen, ${drawn} drawn`);
    assert.ok(differing <= 2, `${differing} of ${drawn} pixels differ`);  // one on a pixel's border may fall to either side
  }
  raster.begin(160, 90);
  assert.ok(raster.pixels.every((colour) => colour === 0), 'begun anew, nothing is there');
});
