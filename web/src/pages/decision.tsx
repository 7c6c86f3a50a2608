// A correction that waits for a person: what did not pass, and the two ways out, each with a reason.
import { useId } from 'preact/hooks';
import { CorrectionService, CorrectionState, ReleaseCheckKind, type Correction, type ReleaseCheck } from '#proto/sixpoint/correction/v1/correction_pb';
import { client } from '../plant/clients';
import { useMay } from '../plant/may';
import { AskWhy } from '../view/ask_why';
import { Mark } from '../view/mark';
import { Table, type Column } from '../view/table';

const kChecks: Partial<Record<ReleaseCheckKind, [word: string, unit: string, isLeast?: boolean]>> = {
  [ReleaseCheckKind.START_SHIFT]: ['Start moved', 'mm'],
  [ReleaseCheckKind.AXIS_CHANGE]: ['Rotary axis turned', 'deg'],
  [ReleaseCheckKind.START_UNCERTAINTY]: ['U of a start', 'µm'],
  [ReleaseCheckKind.AXIS_UNCERTAINTY]: ['U of a direction', 'deg'],
  [ReleaseCheckKind.DISAGREEMENT]: ['Disagreement with the best fit', 'u'],
  [ReleaseCheckKind.MERGE]: ['Scans put the surface at one place', 'χ²'],
  [ReleaseCheckKind.CONDITION]: ['Condition number', ''],
  [ReleaseCheckKind.INFORMATION]: ['Information kept', '', true],
  [ReleaseCheckKind.HELD_DIRECTIONS]: ['Directions not fitted', ''],
  [ReleaseCheckKind.REGISTRATION_AGE]: ['Age of the registration', 'h'],
  [ReleaseCheckKind.CLAMPING]: ['Registrations against its clamping', ''],
  [ReleaseCheckKind.TRAVEL]: ['Beyond a linear axis', 'mm'],
  [ReleaseCheckKind.KEEP_OUT]: ['Tool from the part', 'mm', true],
  [ReleaseCheckKind.LINE_OF_SIGHT]: ['Tool axis from the part', 'mm', true],
  [ReleaseCheckKind.CUT_BEFORE]: ['Holes cut before', ''],
  [ReleaseCheckKind.SENSOR_CALIBRATION]: ['Sensor calibrations asked for', ''],
  [ReleaseCheckKind.INTERIM_CHECK]: ['Interim checks missing', ''],
  [ReleaseCheckKind.SCRAPPED]: ['Decided to be scrap', ''],
  [ReleaseCheckKind.TOOL_CYLINDER]: ['Electrode from the part', 'mm', true],
  [ReleaseCheckKind.MODEL_NOT_NAMED]: ['Machining models not named', ''],
  [ReleaseCheckKind.SHAPE_GOUGE]: ['Deeper into the shape than the template', 'µm'],
};
export const short = (value: number) => String(Number(value.toPrecision(4))).replace('-', '\u2212');
export const unitOf = (check: ReleaseCheck): string => kChecks[check.kind]?.[1] ?? '';
export const isLeast = (check: ReleaseCheck): boolean => kChecks[check.kind]?.[2] ?? false;
export const wordOf = (check: ReleaseCheck): string => kChecks[check.kind]?.[0] ?? ReleaseCheckKind[check.kind] ?? '';

const kColumns: Column<ReleaseCheck>[] = [
  { head: 'Question', cell: wordOf, csv: (c) => `${wordOf(c)} [${unitOf(c)}]` },
  { head: 'Answer', cell: (c) => <Mark tone={c.passed ? 'good' : 'bad'}>{c.passed ? 'Passes' : 'Does not pass'}</Mark>, csv: (c) => (c.passed ? 'passes' : 'does not pass') },
  { head: 'Found', isNumber: true, cell: (c) => (c.value === undefined ? 'could not be told' : `${short(c.value)}\u202f${unitOf(c)}`), csv: (c) => c.value },
  { head: 'Limit', isNumber: true, cell: (c) => `${isLeast(c) ? 'at least' : 'at most'} ${short(c.limit)}\u202f${unitOf(c)}`, csv: (c) => c.limit },
  { head: 'Where', cell: (c) => c.subject + (c.failedCount > 1 ? ` and ${c.failedCount - 1} more` : ''), csv: (c) => c.subject },
];

export const GateTable = ({ correction, caption = 'What the gate asked' }: { correction: Correction; caption?: string }) => (
  <Table caption={caption} columns={kColumns} rows={[...correction.checks.filter((check) => !check.passed), ...correction.checks.filter((check) => check.passed)]} rowKey={(c) => `${c.kind}${c.subject}`} />
);

// The two ways out of waiting; who may go neither reads who may.
export function DecisionButtons({ correction, onDecided }: { correction: Correction; onDecided: () => void }) {
  const mayRelease = useMay(CorrectionService.method.releaseCorrection), mayRefuse = useMay(CorrectionService.method.refuseCorrection);
  const failed = correction.checks.filter((check) => !check.passed);
  return (
    <span class="buttons">
      {mayRefuse && <AskWhy button="Refuse…" title="Refuse this program for ever" verb="Refuse"
        act={async (reason, requestId) => { await client(CorrectionService).refuseCorrection({ name: correction.name, reason, requestId }); onDecided(); }}>
        No program leaves by this correction any more. Your name and reason stay in the record.</AskWhy>}
      {mayRelease && <AskWhy isMain button="Release…" title="Release this program" verb="Release"
        act={async (reason, requestId) => { await client(CorrectionService).releaseCorrection({ name: correction.name, reason, requestId }); onDecided(); }}>
        It may be fetched and cut in spite of {failed.length === 1 ? 'the check' : `the ${failed.length} checks`} that did not pass. Your name and reason stay in the record.</AskWhy>}
      {!mayRelease && !mayRefuse && <span class="muted">An engineer or quality decides.</span>}
    </span>
  );
}

export function Decision({ correction, onDecided }: { correction: Correction; onDecided: () => void }) {
  const id = useId();
  if (correction.state !== CorrectionState.DRAFT) return null;
  return (
    <section class="section sheet waits no-print" aria-labelledby={id}>
      <div class="table-head"><h2 id={id}><Mark tone="wait">This program waits for a person</Mark></h2>
        <DecisionButtons correction={correction} onDecided={onDecided} /></div>
      <GateTable correction={correction} />
    </section>
  );
}
