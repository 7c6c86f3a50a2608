// A blade's points, measured against its CAD by workers; shuffled, so that any first part of them is a fair picture of all.
import type { Measured, Work } from './cloud_worker';
import type { Mapping } from './frames';
import type { Surface } from './surface';

export type Cloud = { positions: Float32Array; deviationsUm: Float32Array; count: number };

export class CloudWorkers {
  private readonly workers: Worker[];
  private readonly waiting = new Map<number, { resolve: (measured: Exclude<Measured, { problem: string }>) => void; reject: (error: Error) => void }>();
  private next = 0;

  constructor(surface: Surface, workerCount = Math.min(4, Math.max(1, (navigator.hardwareConcurrency || 2) - 1))) {
    this.workers = Array.from({ length: workerCount }, () => {
      const worker = new Worker(new URL('./cloud_worker.ts', import.meta.url), { type: 'module' });
      worker.onmessage = ({ data }: MessageEvent<Measured>) => {
        const waiting = this.waiting.get(data.id);
        this.waiting.delete(data.id);
        if ('problem' in data) waiting?.reject(new Error(data.problem));
        else waiting?.resolve(data);
      };
      worker.onerror = () => { for (const { reject } of this.waiting.values()) reject(new Error('A worker of the page ended.')); this.waiting.clear(); };
      worker.postMessage({ kind: 'surface', surface } satisfies Work);
      return worker;
    });
  }

  private send(work: (id: number) => Work, transfer: Transferable[]): Promise<Exclude<Measured, { problem: string }>> {
    const id = this.next++;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject });
      this.workers[id % this.workers.length]!.postMessage(work(id), transfer);
    });
  }

  measurePoints(points: Float32Array, mapping: Mapping) { return this.send((id) => ({ kind: 'points', id, mapping, points }), [points.buffer]); }
  measureBlock(bytes: Uint8Array, mapping: Mapping) { return this.send((id) => ({ kind: 'block', id, mapping, bytes }), []); }

  stop(): void {
    for (const worker of this.workers) worker.terminate();
    for (const { reject } of this.waiting.values()) reject(new DOMException('The page was left.', 'AbortError'));
    this.waiting.clear();
  }
}

function greatestCommonDivisor(a: number, b: number): number { return b === 0 ? a : greatestCommonDivisor(b, a % b); }

export function shuffled(pieces: { positions: Float32Array; deviationsUm: Float32Array }[]): Cloud {
  const count = pieces.reduce((sum, piece) => sum + piece.deviationsUm.length, 0);
  const positions = new Float32Array(3 * count), deviationsUm = new Float32Array(count);
  // Steps of the golden section, made coprime to the count: each place is taken once, and neighbours go far apart.
  let step = Math.max(1, Math.round(count * 0.6180339887));
  while (count > 1 && greatestCommonDivisor(step, count) !== 1) step += 1;
  let to = 0;
  for (const piece of pieces) {
    for (let i = 0; i < piece.deviationsUm.length; ++i) {
      positions[3 * to] = piece.positions[3 * i]!; positions[3 * to + 1] = piece.positions[3 * i + 1]!; positions[3 * to + 2] = piece.positions[3 * i + 2]!;
      deviationsUm[to] = piece.deviationsUm[i]!;
      to = (to + step) % count;
    }
  }
  return { positions, deviationsUm, count };
}

// Of the points that are compared: what stands beside the plant's own figures.
export function statisticsOf(cloud: Cloud): { rmsUm: number; p05Um: number; p95Um: number; comparedCount: number } | undefined {
  const sample: number[] = [];
  let squares = 0, compared = 0;
  const stride = Math.max(1, Math.floor(cloud.count / 200_000));
  for (let i = 0; i < cloud.count; ++i) {
    const d = cloud.deviationsUm[i]!;
    if (Number.isNaN(d)) continue;
    compared += 1;
    squares += d * d;
    if (i % stride === 0) sample.push(d);
  }
  if (sample.length === 0) return undefined;
  sample.sort((a, b) => a - b);
  const at = (share: number) => sample[Math.min(sample.length - 1, Math.floor(share * sample.length))]!;
  return { rmsUm: Math.sqrt(squares / compared), p05Um: at(0.05), p95Um: at(0.95), comparedCount: compared };
}
