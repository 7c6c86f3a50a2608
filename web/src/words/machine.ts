// What a machine does now, as far as what it recorded last says; and its alarms, steps and calibrations in words.
import { AlarmKind, BladeStep, type MachineCalibration, type MachineState } from '#proto/sixpoint/plant/v1/fleet_pb';
import type { Tone } from '../view/mark';
import { idOf, kindOf, pageOf } from './name';
import { dateOf } from './time';

export type Doing = { tone: Tone; word: string; detail: string; isWorking: boolean };

const kStillMs = 45 * 60_000;  // after so long without a word a machine is said to stand

// By the kind of its last entry: what was done, and so what comes next.
const kAfter: Record<string, [Tone, string, string]> = {
  scan: ['busy', 'Scanned', 'is registered next'],
  registration: ['busy', 'Registered', 'is corrected next'],
  correction: ['busy', 'Corrected', 'its program is fetched next'],
  release: ['busy', 'Released', 'its program is fetched next'],
  fetch: ['busy', 'Cutting', 'program fetched'],
  cut: ['busy', 'Cut', 'pins are scanned next'],
  inspection: ['good', 'Judged', 'ready for the next blade'],
  calibration: ['busy', 'Calibrated', 'ready'],
  study: ['busy', 'Checked', 'ready'],
};

export function doingOf(machine: MachineState, now: Date): Doing {
  const upload = machine.uploads.find((one) => now.getTime() - (dateOf(one.touchedAt)?.getTime() ?? 0) < 60_000);
  if (upload) return { tone: 'busy', word: 'Scanning', detail: upload.subject ? idOf(upload.subject) : '', isWorking: true };
  const waits = machine.alarms.find((alarm) => alarm.kind === AlarmKind.CORRECTION_AWAITS);
  const last = machine.contacts.find((contact) => contact.kind in kAfter);
  const lastAt = dateOf(last?.recordedAt);
  if (waits && last?.kind !== 'fetch' && last?.kind !== 'cut') return { tone: 'wait', word: 'Waits for a person', detail: 'a correction is not released', isWorking: false };
  if (!lastAt) return { tone: 'none', word: 'Nothing yet', detail: 'nothing was recorded of it', isWorking: false };
  if (now.getTime() - lastAt.getTime() > kStillMs) return { tone: 'none', word: 'Stands', detail: '', isWorking: false };
  const [tone, word, detail] = kAfter[last!.kind]!;
  return { tone, word, detail, isWorking: last!.kind !== 'inspection' };
}

const kAlarms: Record<AlarmKind, [word: string, isUrgent: boolean]> = {
  [AlarmKind.UNSPECIFIED]: ['Unknown', false],
  [AlarmKind.NOT_CALIBRATED]: ['Not calibrated', true],
  [AlarmKind.CALIBRATION_EXPIRED]: ['Calibration expired', true],
  [AlarmKind.CALIBRATION_EXPIRES]: ['Calibration ends soon', false],
  [AlarmKind.SENSOR_MOVED]: ['Scanner moved', true],
  [AlarmKind.DRIFT]: ['Drift', false],
  [AlarmKind.CORRECTION_AWAITS]: ['Waits for a person', true],
  [AlarmKind.NOT_CONFORM_IN_A_ROW]: ['Not conform in a row', true],
  [AlarmKind.YIELD_LOW]: ['Yield low', false],
  [AlarmKind.UPLOAD_STALLED]: ['Upload stalled', false],
  [AlarmKind.SILENT]: ['Silent', false],
  [AlarmKind.DAMAGED_BLOBS]: ['Damaged scans', true],
};
export const alarmWord = (kind: AlarmKind): string => kAlarms[kind]?.[0] ?? 'Alarm';
// Of what it is: its page, or the machine's, where studies stand too.
export const alarmPage = (subject: string, machine: string): string => pageOf(subject) ?? `${pageOf(machine)}${kindOf(subject) === 'studies' ? '#checks' : ''}`;
export const isUrgent = (kind: AlarmKind): boolean => kAlarms[kind]?.[1] ?? true;

export const kStepWords: Record<BladeStep, string> = {
  [BladeStep.UNSPECIFIED]: '',
  [BladeStep.SCAN_TO_REGISTRATION]: 'Scan to registration',
  [BladeStep.REGISTRATION_TO_CORRECTION]: 'Registration to correction',
  [BladeStep.CORRECTION_TO_FETCH]: 'Correction to program fetched',
  [BladeStep.FETCH_TO_CUT]: 'Program fetched to cut',
  [BladeStep.CUT_TO_PINS_SCAN]: 'Cut to scan with pins',
  [BladeStep.PINS_SCAN_TO_VERDICT]: 'Scan with pins to verdict',
  [BladeStep.FIRST_SCAN_TO_PROGRAM]: 'First scan to program',
  [BladeStep.FIRST_SCAN_TO_VERDICT]: 'Whole way to the verdict',
};

export const stepOf = (machine: MachineState, step: BladeStep) => machine.steps.find((one) => one.step === step);

const kCalibrations: Record<string, string> = { sensor: 'Scanner', rotation: 'Rotary axes', probe: 'Point probe', axis: 'Axis' };
export const calibrationWord = (one: MachineCalibration): string => (one.kind === 'axis' ? `Axis ${one.axis}` : (kCalibrations[one.kind] ?? one.kind));

// alpha_deg -> ["alpha", "deg"]; the unit is the last word of the name where it is one.
export function parameterWords(parameter: string): { name: string; unit: string } {
  const found = /^(.*)_(deg|mm|um)$/.exec(parameter);
  return found ? { name: found[1]!.replaceAll('_', ' '), unit: found[2] === 'um' ? 'µm' : found[2]! } : { name: parameter.replaceAll('_', ' '), unit: '' };
}

// An event's entry as one line of what just happened on a machine.
const kHappened: Record<string, string> = {
  scan: 'scanned', registration: 'registered', correction: 'corrected', release: 'released', refusal: 'refused', fetch: 'program fetched',
  cut: 'holes reported cut', inspection: 'judged', calibration: 'calibrated', study: 'checked', withdrawal: 'withdrawn', disposition: 'decided', assessment: 'judged by its drawing',
};
export const happened = (kind: string, blade: string): string => `${blade && kindOf(blade) === 'blades' ? `${idOf(blade)} ` : ''}${kHappened[kind] ?? kind}`;
