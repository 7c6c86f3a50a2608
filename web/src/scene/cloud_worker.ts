// Beside the page's own thread: decodes stored blocks, maps their points to the part, and measures how far they lie from the CAD.
import makeDraco from 'three/examples/jsm/libs/draco/draco_wasm_wrapper.js';
import wasmUrl from 'three/examples/jsm/libs/draco/draco_decoder.wasm?url';
import { decodeBlock, type Draco } from './draco_block';
import { DistanceField, kFarMm } from './distance';
import { fieldAt, type Mapping, type Vector } from './frames';
import type { Surface } from './surface';

export type Work =
  | { kind: 'surface'; surface: Surface }
  | { kind: 'points'; id: number; mapping: Mapping; points: Float32Array }  // of the sensor frame, mm
  | { kind: 'block'; id: number; mapping: Mapping; bytes: Uint8Array };
export type Measured = { id: number; positions: Float32Array; deviationsUm: Float32Array } | { id: number; problem: string };

let field: DistanceField | undefined;
let centre: Vector = [0, 0, 0];
let draco: Promise<Draco> | undefined;

const loadDraco = (): Promise<Draco> => (draco ??= fetch(wasmUrl).then((answer) => answer.arrayBuffer()).then((wasmBinary) => makeDraco({ wasmBinary })));

function measure(points: ArrayLike<number>, mapping: Mapping): { positions: Float32Array; deviationsUm: Float32Array } {
  const count = points.length / 3, positions = new Float32Array(3 * count), deviationsUm = new Float32Array(count);
  const m = mapping.partFromSensor.linear, s = mapping.partFromSensor.shift;
  const sx = s[0] - centre[0], sy = s[1] - centre[1], sz = s[2] - centre[2];
  for (let i = 0; i < count; ++i) {
    const px = points[3 * i]!, py = points[3 * i + 1]!;
    const pz = points[3 * i + 2]! - (mapping.field ? fieldAt(mapping.field, py, points[3 * i + 2]!) : 0);
    const x = m[0]! * px + m[1]! * py + m[2]! * pz + sx, y = m[3]! * px + m[4]! * py + m[5]! * pz + sy, z = m[6]! * px + m[7]! * py + m[8]! * pz + sz;
    positions[3 * i] = x; positions[3 * i + 1] = y; positions[3 * i + 2] = z;
    const distance = field ? field.at(x, y, z) : NaN;
    deviationsUm[i] = Math.abs(distance) < kFarMm ? 1000 * distance : NaN;
  }
  return { positions, deviationsUm };
}

self.onmessage = async ({ data }: MessageEvent<Work>) => {
  if (data.kind === 'surface') {
    centre = data.surface.centre;
    field = new DistanceField(data.surface);
    return;
  }
  try {
    const points = data.kind === 'points' ? data.points : decodeBlock(await loadDraco(), data.bytes);
    const { positions, deviationsUm } = measure(points, data.mapping);
    postMessage({ id: data.id, positions, deviationsUm } satisfies Measured, { transfer: [positions.buffer, deviationsUm.buffer] });
  } catch (error) {
    postMessage({ id: data.id, problem: error instanceof Error ? error.message : String(error) } satisfies Measured);
  }
};
