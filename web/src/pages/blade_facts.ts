// All that the page of a blade shows, fetched: the record says what there is, and each thing is asked of its service.
import { Code, ConnectError } from '@connectrpc/connect';
import { CalibrationService, type Calibration } from '#proto/sixpoint/calibration/v1/calibration_pb';
import { CorrectionService, type Correction } from '#proto/sixpoint/correction/v1/correction_pb';
import { InspectionService, type HoleResult, type Inspection } from '#proto/sixpoint/inspection/v1/inspection_pb';
import type { Blade } from '#proto/sixpoint/plant/v1/blade_pb';
import { PlantService } from '#proto/sixpoint/plant/v1/plant_pb';
import type { Machine } from '#proto/sixpoint/plant/v1/machine_pb';
import type { Hole, HoleGroup, Part } from '#proto/sixpoint/plant/v1/part_pb';
import { RecordService, type RecordEntry } from '#proto/sixpoint/plant/v1/record_pb';
import { RegistrationService, type Registration } from '#proto/sixpoint/registration/v1/registration_pb';
import type { RotationCalibration } from '#proto/sixpoint/calibration/v1/rotation_pb';
import type { CorrectedGroup, CorrectedHole } from '#proto/sixpoint/correction/v1/correction_pb';
import type { RigidTransform } from '#proto/sixpoint/geometry/v1/geometry_pb';
import { client } from '../plant/clients';
import { refusalOf } from '../plant/refusal';
import { apply, inverse, after, machineFromZero, rigid, vectorOf, type Vector } from '../scene/frames';

export type BladeFacts = {
  blade: Blade;
  entries: RecordEntry[];
  inspection: Inspection | undefined;  // the newest
  correction: Correction | undefined;  // the newest
  before: Registration | undefined;  // that the correction follows
  after: Registration | undefined;  // that the verdict rests on
  part: Part | undefined;
  machine: Machine | undefined;
  calibrations: Map<string, Calibration>;
  missing: string[];  // what a service refused or could not say, in words
};

const kMostEntries = 5000;

async function recordOf(name: string, signal: AbortSignal): Promise<{ blade: Blade; entries: RecordEntry[] }> {
  const entries: RecordEntry[] = [];
  let pageToken = '', blade: Blade | undefined;
  do {
    const page = await client(RecordService).getBladeRecord({ name, pageSize: 500, pageToken }, { signal });
    blade = page.blade ?? blade;
    entries.push(...page.entries);
    pageToken = page.nextPageToken;
  } while (pageToken !== '' && entries.length < kMostEntries);
  return { blade: blade!, entries };
}

export async function factsOf(serial: string, signal: AbortSignal): Promise<BladeFacts> {
  const { blade, entries } = await recordOf(`blades/${serial}`, signal);
  const missing: string[] = [];
  const newest = (kind: string, lets: (entry: RecordEntry) => boolean = () => true) => entries.findLast((entry) => entry.kind === kind && lets(entry))?.name;
  const ask = async <T>(what: string, name: string | undefined, call: (name: string) => Promise<T>): Promise<T | undefined> => {
    if (!name) return undefined;
    try {
      return await call(name);
    } catch (error) {
      const code = ConnectError.from(error).code;
      // What is away is asked again with everything else; what is refused stays so.
      if (signal.aborted || code === Code.Unavailable || code === Code.Unauthenticated || error instanceof TypeError) throw error;
      missing.push(`${what}: ${refusalOf(error).text}`);
      return undefined;
    }
  };
  const registration = (name: string | undefined) => ask('Registration', name, (n) => client(RegistrationService).getRegistration({ name: n }, { signal }));
  const [inspection, correction] = await Promise.all([
    ask('Inspection', newest('inspection'), (n) => client(InspectionService).getInspection({ name: n }, { signal })),
    ask('Correction', newest('correction'), (n) => client(CorrectionService).getCorrection({ name: n }, { signal })),
  ]);
  const [before, after_] = await Promise.all([
    registration(correction?.registration ?? newest('registration', (entry) => entry.verdict === 'CONVERGED' && entry.name !== inspection?.registration)),
    registration(inspection?.registration),
  ]);
  const of = after_ ?? before;
  const names = new Set([before, after_].flatMap((one) => (one ? [one.sensorCalibration, one.rotationCalibration] : [])).filter((name) => name !== ''));
  const calibrations = new Map<string, Calibration>();
  const [part, machine] = await Promise.all([
    ask('Part', of ? `${of.part}@${of.partRevision}` : blade.part, (n) => client(PlantService).getPart({ name: n }, { signal })),
    ask('Machine', of ? `${of.machine}@${of.machineRevision}` : undefined, (n) => client(PlantService).getMachine({ name: n }, { signal })),
    ...[...names].map(async (name) => {
      const calibration = await ask('Calibration', name, (n) => client(CalibrationService).getCalibration({ name: n }, { signal }));
      if (calibration) calibrations.set(name, calibration);
    }),
  ]);
  return { blade, entries, inspection, correction, before, after: after_, part, machine, calibrations, missing };
}

// One hole, from everything that says something of it.
export type HoleFacts = {
  key: string;  // G1/H3
  group: HoleGroup | undefined;
  hole: Hole | undefined;
  result: HoleResult | undefined;
  correctedGroup: CorrectedGroup | undefined;
  corrected: CorrectedHole | undefined;
  shiftMm: Vector | undefined;  // of the start in the program, machine coordinates
  withoutCorrection: Vector | undefined;  // where the nominal program would have cut, part frame, mm
  path: PathPose[];  // of a path of the tool, pose by pose; none: a straight hole
};
// Where the corrected program takes the tool's tip on the part, and from there to its holder; part frame, mm.
export type PathPose = { tip: Vector; axis: Vector };

function pathOf(group: CorrectedGroup, rotation: RotationCalibration, pose: RigidTransform): PathPose[] {
  const partFromZero = inverse(rigid(pose));
  return group.poses.map(({ tipMm, aDeg, bDeg, aReachedDeg, bReachedDeg }) => {
    const partFromMachine = after(partFromZero, inverse(machineFromZero(rotation, aReachedDeg ?? aDeg, bReachedDeg ?? bDeg))), m = partFromMachine.linear;
    return { tip: apply(partFromMachine, vectorOf(tipMm)), axis: [m[2]!, m[5]!, m[8]!] };
  });
}

export function holesOf(facts: BladeFacts): HoleFacts[] {
  const holes = new Map<string, HoleFacts>();
  const at = (group: string, hole: string): HoleFacts => {
    const key = `${group}/${hole}`;
    let found = holes.get(key);
    if (!found) holes.set(key, (found = { key, group: undefined, hole: undefined, result: undefined, correctedGroup: undefined, corrected: undefined, shiftMm: undefined, withoutCorrection: undefined, path: [] }));
    return found;
  };
  for (const group of facts.part?.holeGroups ?? []) for (const hole of group.holes) Object.assign(at(group.group, hole.hole), { group, hole });
  for (const result of facts.inspection?.holes ?? []) at(result.group, result.hole).result = result;
  const rotation = facts.calibrations.get(facts.correction?.rotationCalibration ?? '')?.result;
  const pose = facts.before?.zeroFromPart;
  for (const group of facts.correction?.groups ?? []) {
    const partFromMachine = rotation?.case === 'rotation' && pose
      ? after(inverse(rigid(pose)), inverse(machineFromZero(rotation.value, group.aNominalDeg, group.bNominalDeg))) : undefined;
    for (const corrected of group.holes) {
      const found = at(group.group, corrected.hole), start = vectorOf(corrected.startMm), nominal = vectorOf(corrected.nominalStartMm);
      found.correctedGroup = group;
      found.corrected = corrected;
      found.shiftMm = [start[0] - nominal[0], start[1] - nominal[1], start[2] - nominal[2]];
      if (partFromMachine) found.withoutCorrection = apply(partFromMachine, nominal);
      if (rotation?.case === 'rotation' && pose) found.path = pathOf(group, rotation.value, pose);
    }
  }
  return [...holes.values()];
}
