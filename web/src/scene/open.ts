// What a picture of a blade needs, fetched: the CAD's surface, and the scans of before and after. In a file of its own with three.js, which only
// who looks at a blade loads.
import { Code, ConnectError } from '@connectrpc/connect';
import type { Registration } from '#proto/sixpoint/registration/v1/registration_pb';
import { PointFormat, ScanService } from '#proto/sixpoint/ingest/v1/ingest_pb';
import type { Scan } from '#proto/sixpoint/ingest/v1/scan_pb';
import { MachiningPassService } from '#proto/sixpoint/correction/v1/machining_pass_pb';
import { ReconstructionService, type BlankPatches } from '#proto/sixpoint/correction/v1/reconstruction_pb';
import { RepairService } from '#proto/sixpoint/correction/v1/repair_pb';
import { DeviationService } from '#proto/sixpoint/inspection/v1/deviation_pb';
import { PlantService } from '#proto/sixpoint/plant/v1/plant_pb';
import { client } from '../plant/clients';
import type { BladeFacts } from '../pages/blade_facts';
import { CloudWorkers, shuffled, statisticsOf, type Cloud } from './cloud';
import { partFromSensor, type Mapping } from './frames';
import { readSurface, type Surface } from './surface';
import type { Patches } from './tiles';

export { BladeScene } from './blade_scene';
export { colourOf, colourTable, kColourCount, roundScale } from './colours';
export { CloudWorkers, statisticsOf };

const kPreviewPoints = 40_000;  // a scan
const kPreviewsAtOnce = 2;
const kAtOnce = 4;  // blocks that are decoded

export async function fetchSurface(part: string, signal: AbortSignal): Promise<Surface> {
  const chunks: Uint8Array[] = [];
  let size = 0;
  for await (const { chunk } of client(PlantService).downloadSurface({ name: part }, { signal })) { chunks.push(chunk); size += chunk.length; }
  const bytes = new Uint8Array(size);
  let at = 0;
  for (const chunk of chunks) { bytes.set(chunk, at); at += chunk.length; }
  return readSurface(bytes);
}

// All patches of a deviation map, seen or not.
export async function fetchPatches(name: string, signal: AbortSignal): Promise<Patches> {
  const patches: Patches = { centresMm: [], normals: [], areasMm2: [], meansUm: [] };
  for await (const some of client(DeviationService).downloadDeviationPatches({ name }, { signal })) {
    for (const [from, to] of [[some.centresInPartMm, patches.centresMm], [some.normalsInPart, patches.normals], [some.areasMm2, patches.areasMm2], [some.meansUm, patches.meansUm]] as const) for (const value of from) to.push(value);
  }
  return patches;
}

async function stockOf(all: AsyncIterable<BlankPatches>, patchMm: number): Promise<Patches> {
  const patches: Patches = { centresMm: [], normals: [], areasMm2: [], meansUm: [] };
  for await (const some of all) {
    for (const [from, to] of [[some.pointsInPartMm, patches.centresMm], [some.normalsInPart, patches.normals], [some.stockUm, patches.meansUm]] as const) for (const value of from) to.push(value);
    for (let i = 0; i < some.stockUm.length; ++i) patches.areasMm2.push(patchMm * patchMm);
  }
  return patches;
}
// The blank's patches of a reconstruction, by the stock of each over the shape; and what a pass left of it.
export const fetchStock = (name: string, patchMm: number, signal: AbortSignal): Promise<Patches> => stockOf(client(ReconstructionService).downloadBlankPatches({ name }, { signal }), patchMm);
export const fetchLeft = (name: string, patchMm: number, signal: AbortSignal): Promise<Patches> => stockOf(client(MachiningPassService).downloadPassPatches({ name }, { signal }), patchMm);

// Places of a repair's target: by what the path leaves there, or by their expanded uncertainty.
export async function fetchTarget(name: string, isRest: boolean, signal: AbortSignal): Promise<Patches> {
  const patches: Patches = { centresMm: [], normals: [], areasMm2: [], meansUm: [] };
  for await (const contour of client(RepairService).downloadTargetContours({ name }, { signal })) {
    const at = contour.pointsInPartMm, count = contour.restUm.length;
    for (let i = 0; i < count; ++i) {
      const before = 3 * ((i + count - 1) % count), after = 3 * ((i + 1) % count);
      // Contours run counter-clockwise about Z: outward is to the right.
      const x = at[after]! - at[before]!, y = at[after + 1]! - at[before + 1]!, length = Math.hypot(x, y) || 1;
      patches.centresMm.push(at[3 * i]!, at[3 * i + 1]!, at[3 * i + 2]!);
      patches.normals.push(y / length, -x / length, 0);
      patches.areasMm2.push((length / 2) ** 2);
      patches.meansUm.push(isRest ? contour.restUm[i]! : contour.expandedUncertaintiesUm[i]!);
    }
  }
  return patches;
}

// The ball's way along the finishing laps of a repair.
export async function fetchFinishingLaps(name: string, signal: AbortSignal): Promise<number[][]> {
  const laps: number[][] = [];
  for await (const lap of client(RepairService).downloadRepairPath({ name }, { signal })) if (lap.allowanceMm === 0) laps.push(lap.centresInPartMm);
  return laps;
}

function mappingOf(facts: BladeFacts, registration: Registration, scan: Scan): Mapping {
  const sensor = facts.calibrations.get(registration.sensorCalibration)?.result, rotation = facts.calibrations.get(registration.rotationCalibration)?.result;
  if (sensor?.case !== 'sensor' || rotation?.case !== 'rotation' || !registration.zeroFromPart || !scan.header)
    throw new Error('The calibrations that map its scans are not there.');
  return partFromSensor(scan.header, sensor.value, rotation.value, registration, facts.machine?.sensor);
}

export type Fetched = { cloud: Cloud; scans: Scan[]; isWhole: boolean };

// A service that has its hands full says so, and is asked again.
async function patiently<T>(ask: () => Promise<T>, tries = 6): Promise<T> {
  for (let pauseMs = 500; ; pauseMs *= 2) {
    try {
      return await ask();
    } catch (error) {
      if (ConnectError.from(error).code !== Code.ResourceExhausted || --tries === 0) throw error;
      await new Promise((resolve) => setTimeout(resolve, pauseMs));
    }
  }
}

// A thinned picture at once. A blade may have dozens of scans, and others download too.
export async function fetchPreview(facts: BladeFacts, registration: Registration, workers: CloudWorkers, signal: AbortSignal): Promise<Fetched> {
  const names = registration.scans, scans: Scan[] = [], pieces: { positions: Float32Array; deviationsUm: Float32Array }[] = [];
  let next = 0;
  const work = async () => {
    while (next < names.length) {
      const i = next++, name = names[i]!;
      const answer = await patiently(() => client(ScanService).previewScan({ name, pointCount: kPreviewPoints }, { signal }));
      scans[i] = answer.scan!;
      const points = new Float32Array(answer.xyzF32.slice().buffer);
      pieces[i] = await workers.measurePoints(points, mappingOf(facts, registration, answer.scan!));
    }
  };
  await Promise.all(Array.from({ length: kPreviewsAtOnce }, work));
  return { cloud: shuffled(pieces), scans, isWhole: false };
}

// Every point: the stored blocks, as they are, decoded while the next ones come.
export async function fetchWhole(facts: BladeFacts, registration: Registration, scans: Scan[], workers: CloudWorkers, signal: AbortSignal, onProgress: (share: number) => void): Promise<Fetched> {
  const total = scans.reduce((sum, scan) => sum + scan.blockCount, 0);
  const measured: Promise<{ positions: Float32Array; deviationsUm: Float32Array }>[] = [];
  let done = 0;
  for (const scan of scans) {
    const mapping = mappingOf(facts, registration, scan);
    for await (const { part } of client(ScanService).downloadScan({ name: scan.name, format: PointFormat.STORED }, { signal })) {
      if (part.case !== 'block') continue;
      measured.push(workers.measureBlock(part.value.payload.slice(), mapping).finally(() => onProgress(++done / total)));
      // No more than the workers are about to decode is held.
      if (measured.length >= kAtOnce) await measured[measured.length - kAtOnce];
    }
  }
  const pieces = await Promise.all(measured);
  return { cloud: shuffled(pieces), scans, isWhole: true };
}
