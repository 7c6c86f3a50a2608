// A correction that waits for a person: what did not pass, and the two ways out, each with a reason.
import { useRef, useState } from 'preact/hooks';
import { CorrectionService, CorrectionState, ReleaseCheckKind, type Correction, type ReleaseCheck } from '#proto/sixpoint/correction/v1/correction_pb';
import { client } from '../plant/clients';
import { useMay } from '../plant/may';
import { refusalOf, type Refusal } from '../plant/refusal';
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
};
const short = (value: number) => String(Number(value.toPrecision(4))).replace('-', '\u2212');
const wordOf = (check: ReleaseCheck) => kChecks[check.kind]?.[0] ?? ReleaseCheckKind[check.kind] ?? '';

const kColumns: Column<ReleaseCheck>[] = [
  { head: 'Question', cell: wordOf, csv: wordOf },
  { head: 'Answer', cell: (c) => <Mark tone={c.passed ? 'good' : 'bad'}>{c.passed ? 'Passes' : 'Does not pass'}</Mark>, csv: (c) => (c.passed ? 'passes' : 'does not pass') },
  { head: 'Found', isNumber: true, cell: (c) => (c.value === undefined ? 'could not be told' : `${short(c.value)}\u202f${kChecks[c.kind]?.[1] ?? ''}`), csv: (c) => c.value },
  { head: 'Limit', isNumber: true, cell: (c) => `${kChecks[c.kind]?.[2] ? 'at least' : 'at most'} ${short(c.limit)}`, csv: (c) => c.limit },
  { head: 'Where', cell: (c) => c.subject + (c.failedCount > 1 ? ` and ${c.failedCount - 1} more` : ''), csv: (c) => c.subject },
];

export function Decision({ correction, onDecided }: { correction: Correction; onDecided: () => void }) {
  const mayRelease = useMay(CorrectionService.method.releaseCorrection), mayRefuse = useMay(CorrectionService.method.refuseCorrection);
  const dialog = useRef<HTMLDialogElement>(null), reason = useRef<HTMLTextAreaElement>(null);
  const [asks, setAsks] = useState<'release' | 'refuse'>('release');
  const [refusal, setRefusal] = useState<Refusal>();
  const [isBusy, setBusy] = useState(false);
  const requestId = useRef('');  // the same for a retry: what was decided is decided once
  if (correction.state !== CorrectionState.DRAFT) return null;
  const failed = correction.checks.filter((check) => !check.passed);
  const rows = [...failed, ...correction.checks.filter((check) => check.passed)];

  const open = (what: 'release' | 'refuse') => {
    setAsks(what);
    setRefusal(undefined);
    requestId.current = newRequestId();
    dialog.current!.showModal();
  };
  const decide = async (event: Event) => {
    event.preventDefault();
    setBusy(true);
    setRefusal(undefined);
    try {
      const request = { name: correction.name, reason: reason.current!.value.trim(), requestId: requestId.current };
      await (asks === 'release' ? client(CorrectionService).releaseCorrection(request) : client(CorrectionService).refuseCorrection(request));
      dialog.current!.close();
      onDecided();
    } catch (error) {
      setRefusal(refusalOf(error));
    } finally {
      setBusy(false);
    }
  };

  return (
    <section class="section sheet waits no-print" aria-labelledby="waits-title">
      <div class="table-head"><h2 id="waits-title"><Mark tone="wait">This program waits for a person</Mark></h2>
        <span class="buttons">
          {mayRefuse && <button type="button" onClick={() => open('refuse')}>Refuse…</button>}
          {mayRelease && <button type="button" class="main" onClick={() => open('release')}>Release…</button>}
          {!mayRelease && !mayRefuse && <span class="muted">An engineer or quality decides.</span>}
        </span></div>
      <Table caption="What the gate asked" columns={kColumns} rows={rows} rowKey={(c) => `${c.kind}${c.subject}`} />
      <dialog ref={dialog} aria-labelledby="decide-title">
        <form onSubmit={(event) => void decide(event)}>
          <h2 id="decide-title">{asks === 'release' ? 'Release this program' : 'Refuse this program for ever'}</h2>
          <p>{asks === 'release' ? `It may be fetched and cut in spite of ${failed.length === 1 ? 'the check' : `the ${failed.length} checks`} that did not pass. Your name and reason stay in the record.`
            : 'No program leaves by this correction any more. Your name and reason stay in the record.'}</p>
          <label>Why<textarea ref={reason} required maxLength={1000} /></label>
          <div role="alert">{refusal && <p class="problem"><strong>{refusal.title}.</strong> {refusal.text}</p>}</div>
          <div class="buttons"><button type="button" onClick={() => dialog.current!.close()}>Leave it</button>
            <button type="submit" class="main" disabled={isBusy}>{isBusy ? 'Sending…' : asks === 'release' ? 'Release' : 'Refuse'}</button></div>
        </form>
      </dialog>
    </section>
  );
}

// randomUUID is missing where the page came over plain http.
function newRequestId(): string {
  if (crypto.randomUUID) return crypto.randomUUID();
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  bytes[6] = (bytes[6]! & 0x0f) | 0x40; bytes[8] = (bytes[8]! & 0x3f) | 0x80;
  const hex = [...bytes].map((byte) => byte.toString(16).padStart(2, '0')).join('');
  return `${hex.slice(0, 8)}-${hex.slice(8, 12)}-${hex.slice(12, 16)}-${hex.slice(16, 20)}-${hex.slice(20)}`;
}
