import assert from 'node:assert/strict';
import { test } from 'node:test';
import { create } from '@bufbuild/protobuf';
import { timestampFromDate } from '@bufbuild/protobuf/wkt';
import { CorrectionService } from '#proto/sixpoint/correction/v1/correction_pb';
import { ScanService } from '#proto/sixpoint/ingest/v1/ingest_pb';
import { MachineStateSchema, AlarmKind } from '#proto/sixpoint/plant/v1/fleet_pb';
import { CharacteristicFindingSchema } from '#proto/sixpoint/inspection/v1/assessment_pb';
import { CharacteristicUnit, DecisionRuleKind, DecisionRuleSchema } from '#proto/sixpoint/plant/v1/drawing_pb';
import { RecordEntrySchema } from '#proto/sixpoint/plant/v1/record_pb';
import { stepWords } from '../src/pages/blade_story';
import { mayCall } from '../src/plant/may';
import { drawingWords, limitsWords, otherWords, ruleWords, valueWords } from '../src/words/assessment';
import { doingOf } from '../src/words/machine';
import { decimalsFor, number, percent, withUncertainty } from '../src/words/quantity';
import { personOf, shortId, withoutRevision } from '../src/words/name';
import { duration } from '../src/words/time';
import { csvOf } from '../src/view/table';
import { scaleOf } from '../src/view/within_limits';

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

test('limits as they were drawn, values with the uncertainty that is theirs', () => {
  const finding = (fields: object) => create(CharacteristicFindingSchema, { unit: CharacteristicUnit.MM, ...fields });
  assert.equal(plain(limitsWords(finding({ lowerLimit: -0.0625, upperLimit: 0.05 }))), '\u22120.0625 to 0.0500 mm');
  assert.equal(plain(limitsWords(finding({ upperLimit: 0.03 }))), 'at most 0.03 mm');
  assert.equal(limitsWords(finding({ lowerLimit: 0, unit: CharacteristicUnit.RATIO })), 'at least 0');
  const one = finding({ value: 0, expandedUncertainty: 0.0021, others: [{ result: 'measurements/0197b0a4-7c1a-7e5b-9d5a-2f1c3b4a5d31', value: 1.5 }] });
  assert.equal(plain(valueWords(one)), '0.0000 ± 0.0021 mm');
  assert.equal(valueWords(finding({})), 'not measured');
  assert.equal(plain(otherWords(one, one.others[0]!, '')), '1.5000 mm (U not known) by measurement 3b4a5d31');
});

test('rules and drawings in words', () => {
  const { ISO_14253_1, GUARD_FACTOR } = DecisionRuleKind;
  assert.equal(ruleWords(create(DecisionRuleSchema, { kind: ISO_14253_1, edition: '2017' })), 'ISO 14253-1:2017');
  assert.equal(plain(ruleWords(create(DecisionRuleSchema, { kind: GUARD_FACTOR, guardFactor: 0.5 }))), 'guard band 50 % of U');
  assert.equal(ruleWords(undefined), 'not told');
  assert.equal(drawingWords('drawings/vane-7-final@12'), 'vane-7-final rev. 12');
});

test('a bar reaches from limit to limit, from 0 where that is best, else as far as the value', () => {
  const none = { value: undefined, expanded: undefined, lower: undefined, upper: undefined, isZeroBest: false };
  assert.deepEqual(scaleOf({ ...none, lower: -1, upper: 3 }), { low: -1, high: 3 });
  assert.deepEqual(scaleOf({ ...none, upper: 0.03, isZeroBest: true, value: 0.5 }), { low: 0, high: 0.03 });
  assert.deepEqual(scaleOf({ ...none, lower: 2, value: 5, expanded: 1 }), { low: 2, high: 6 });
  assert.deepEqual(scaleOf({ ...none, upper: 4, value: 4 }), { low: 3, high: 4 });
  assert.equal(scaleOf(none), undefined);
});

test('a blade that was judged by its drawing says so in its story', () => {
  const summary = { verdict: 'NOT_CONFORM', findings: 45, conform: 41, fate: 'DISCARD', reason: '17 is out' };
  assert.deepEqual(stepWords(create(RecordEntrySchema, { kind: 'assessment', method: 'BEFORE_MACHINING', summary })), { title: 'Judged by its drawing, before machining', figures: '41 of 45 findings conform, discard, 17 is out' });
});
