// Calibrations of the plant's machines, the newest first; the filter stands in the URL.
import { CalibrationService, type Calibration } from '#proto/sixpoint/calibration/v1/calibration_pb';
import { CalibrationKind } from '#proto/sixpoint/calibration/v1/kind_pb';
import { CalibrationState } from '#proto/sixpoint/calibration/v1/state_pb';
import { client } from '../plant/clients';
import { usePaged } from '../plant/paged';
import { setQuery, useRoute } from '../plant/route';
import { kindWord } from '../words/calibration';
import { idOf, pageOf, personOf, shortId } from '../words/name';
import { plural, quantity } from '../words/quantity';
import { dateOf, full } from '../words/time';
import { VerdictMark, verdictWords } from '../view/mark';
import { Heading } from '../view/shell';
import { Empty, ListState, More } from '../view/states';
import { Table, type Column } from '../view/table';

const kPageSize = 100;
const kKinds = ['SENSOR', 'ROTATION', 'PROBE', 'AXIS'] as const, kStates = ['DRAFT', 'IN_FORCE', 'NOT_YET_VALID', 'SUPERSEDED', 'EXPIRED', 'WITHDRAWN'] as const;
const kTouching = new Set(['calibration', 'release', 'withdrawal']);
export const stateName = (state: CalibrationState): string => CalibrationState[state] ?? '';

// Of the values that its fit used; what was stated has none.
export const residualOf = ({ result }: Calibration): number | undefined =>
  (result.case === 'sensor' && result.value.certificate ? undefined : result.case === 'sensor' || result.case === 'rotation' || result.case === 'probe' ? result.value.residualRmsUm : undefined);

export const kCalibrationColumns: Column<Calibration>[] = [
  { head: 'Calibration', cell: (c) => <a href={pageOf(c.name)} title={c.name}>{shortId(c.name)}</a>, csv: (c) => c.name },
  { head: 'Machine', cell: (c) => <a href={pageOf(c.machine)}>{idOf(c.machine)}</a>, csv: (c) => idOf(c.machine) },
  { head: 'Kind', cell: kindWord, csv: kindWord },
  { head: 'State', cell: (c) => <VerdictMark verdict={stateName(c.state)} />, csv: (c) => stateName(c.state) },
  { head: 'Valid from', cell: (c) => full(dateOf(c.validFrom)), csv: (c) => dateOf(c.validFrom)?.toISOString() },
  { head: 'Valid until', cell: (c) => full(dateOf(c.validUntil)), csv: (c) => dateOf(c.validUntil)?.toISOString() },
  { head: 'Residual rms', isNumber: true, cell: (c) => (residualOf(c) === undefined ? '' : quantity(residualOf(c), 'µm', 2)), csv: residualOf },
  { head: 'Method', cell: (c) => c.method.toLowerCase().replaceAll('_', ' '), csv: (c) => c.method },
  { head: 'By', cell: (c) => personOf(c.requestedBy), csv: (c) => c.requestedBy },
];
const kWithUnit = kCalibrationColumns.map((column) => (column.head === 'Residual rms' ? { ...column, unit: 'µm', cell: (c: Calibration) => (residualOf(c) === undefined ? '' : quantity(residualOf(c), '', 2).trim()) } : column));

export default function CalibrationsPage() {
  const { query } = useRoute();
  const machine = query.get('machine') ?? '', kind = query.get('kind') ?? '', state = query.get('state') ?? '';
  const list = usePaged([machine, kind, state], async (pageToken, signal) => {
    const page = await client(CalibrationService).listCalibrations({
      pageSize: kPageSize, pageToken, machine: machine && `machines/${machine}`, kind: CalibrationKind[kind as 'SENSOR'] ?? 0, state: CalibrationState[state as 'DRAFT'] ?? 0,
    }, { signal });
    return { rows: page.calibrations, nextPageToken: page.nextPageToken };
  }, ({ entry }) => kTouching.has(entry?.kind ?? ''));
  const choice = (name: string, text: string, value: string, values: readonly string[], word: (one: string) => string) => (
    <label>{text} <select value={value} onChange={(event) => setQuery({ [name]: event.currentTarget.value })}>
      <option value="">Any</option>{values.map((one) => <option key={one} value={one}>{word(one)}</option>)}
    </select></label>
  );
  return (
    <>
      <div class="page-head">
        <Heading title="Calibrations">Calibrations{machine && ` of ${machine}`}</Heading>
        <form class="filters" role="search" aria-label="Calibrations" onSubmit={(event) => event.preventDefault()}>
          <label>Machine <input type="search" value={machine} maxLength={64} spellcheck={false} autocomplete="off" onChange={(event) => setQuery({ machine: event.currentTarget.value.trim() })} /></label>
          {choice('kind', 'Kind', kind, kKinds, (one) => kindWord({ kind: CalibrationKind[one as 'SENSOR'] }))}
          {choice('state', 'State', state, kStates, verdictWords)}
        </form>
      </div>
      <ListState list={list} what="the calibrations" />
      {list.rows?.length === 0 && (machine || kind || state
        ? <Empty title="No calibration is like that">A machine is named whole: sarix-1. <a href="/calibrations">Show all</a></Empty>
        : <Empty title="No machine was calibrated yet">A calibration shows here as it is made: <code>sixpoint calibrate sensor</code>, or by the machine itself.</Empty>)}
      {list.rows && list.rows.length > 0 && <>
        <p class="small muted" role="status">{plural(list.rows.length, 'calibration')}{list.hasMore && ', and more'}. The newest first.</p>
        <Table caption="Calibrations" showCaption={false} columns={kWithUnit} rows={list.rows} rowKey={(c) => c.name} />
        <More list={list} />
      </>}
    </>
  );
}
