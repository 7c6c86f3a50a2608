import assert from 'node:assert/strict';
import { test } from 'node:test';
import { create } from '@bufbuild/protobuf';
import { timestampFromDate } from '@bufbuild/protobuf/wkt';
import { CorrectionService } from '#proto/sixpoint/correction/v1/correction_pb';
import { ScanService } from '#proto/sixpoint/ingest/v1/ingest_pb';
import { MachineStateSchema, AlarmKind } from '#proto/sixpoint/plant/v1/fleet_pb';
import { mayCall } from '../src/plant/may';
import { doingOf } from '../src/words/machine';
import { decimalsFor, number, percent, withUncertainty } from '../src/words/quantity';
import { personOf, shortId, withoutRevision } from '../src/words/name';
import { duration } from '../src/words/time';
import { csvOf } from '../src/view/table';

const plain = (text: string) => text.replaceAll('\u202f', ' ');

test('a value has as many digits as two of its uncertainty', () => {
  assert.equal(plain(withUncertainty(0.041234, 0.0082, 'mm')), '0.0412 ± 0.0082 mm');
  assert.equal(plain(withUncertainty(0.041234, 0.01, 'mm')), '0.041 ± 0.010 mm');
  assert.equal(plain(withUncertainty(123.456, 12, 'um')), '123 ± 12 um');
  assert.equal(decimalsFor(undefined, 3), 3);
});

test('what was not measured is never 0', () => {
  assert.equal(withUncertainty(undefined, undefined, 'mm'), 'not measured');
  assert.equal(number(NaN, 2), 'not measured');
  assert.equal(percent(undefined), 'not measured');
  assert.match(withUncertainty(0, undefined, 'mm'), /U not known/);
});

test('minus is a minus, and there is no minus zero', () => {
  assert.equal(number(-1.5, 1), '\u22121.5');
  assert.equal(number(-0.0001, 1), '0.0');
});

test('durations as people say them', () => {
  assert.deepEqual([42, 60, 3599, 3660, 7200, 86400 * 4.2].map((s) => plain(duration(s))), ['42 s', '1 min', '60 min', '1 h 1 min', '2 h', '4.2 d']);
});

test('names', () => {
  assert.equal(personOf('users/jane via services/gateway'), 'jane');
  assert.equal(personOf('machines/m1'), 'm1');
  assert.equal(personOf('persons/00ff00ff00ff00ff'), 'persons/00ff00ff00ff00ff');
  assert.equal(withoutRevision('parts/vane-7@3'), 'parts/vane-7');
  assert.equal(shortId('scans/sn1_1'), 'sn1_1');
});

test('CSV quotes, and gives a spreadsheet nothing to run', () => {
  const rows = ['a,b', 'say "x"', '=1+1', 'plain'];
  assert.equal(csvOf([{ head: 'v', unit: 'mm', cell: () => '', csv: (row: string) => row }, { head: 'n', cell: () => '', csv: () => -1.5 }], rows),
    'v [mm],n\r\n"a,b",-1.5\r\n"say ""x""",-1.5\r\n\'=1+1,-1.5\r\nplain,-1.5\r\n');
});

test('who may call what is read from the contract', () => {
  const { releaseCorrection, getCorrection } = CorrectionService.method;
  assert.ok(mayCall(['ENGINEER'], releaseCorrection) && mayCall(['QUALITY'], releaseCorrection));
  assert.ok(!mayCall(['MES_READER'], releaseCorrection) && !mayCall(['ADMIN'], releaseCorrection));
  assert.ok(mayCall(['MES_READER'], getCorrection));
  assert.ok(!mayCall(['MES_READER'], ScanService.method.downloadScan));
});

test('what a machine does follows from its last entry, its uploads and who it waits for', () => {
  const now = new Date(1_790_000_000_000), at = (minutes: number) => timestampFromDate(new Date(now.getTime() - 60_000 * minutes));
  const state = (fields: object) => create(MachineStateSchema, { machine: 'machines/m1', ...fields });
  const contact = (kind: string, minutes: number) => ({ contacts: [{ kind, recordedAt: at(minutes) }] });
  assert.equal(doingOf(state({}), now).word, 'Nothing yet');
  assert.equal(doingOf(state(contact('fetch', 10)), now).word, 'Cutting');
  assert.equal(doingOf(state(contact('fetch', 50)), now).word, 'Stands');
  assert.equal(doingOf(state({ ...contact('cut', 1), uploads: [{ subject: 'blades/SN-1', touchedAt: at(0.2) }] }), now).word, 'Scanning');
  assert.equal(doingOf(state({ ...contact('correction', 1), alarms: [{ kind: AlarmKind.CORRECTION_AWAITS }] }), now).word, 'Waits for a person');
});
