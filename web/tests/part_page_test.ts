import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { create } from '@bufbuild/protobuf';
import type { Page } from 'playwright-core';
import { CadFormat, PartSchema } from '#proto/sixpoint/plant/v1/part_pb';
import { descriptionOf, formatOf } from '../src/pages/part_description';
import { differencesOf } from '../src/pages/part_revisions';
import { axeFindings, complaintsOf, setStage, signedIn, type Stage } from './browser';
import * as world from './fixtures/blade_world';

let stage: Stage;
before(async () => { stage = await setStage(12); });
after(async () => { await stage.stop(); });

const plain = (text: string) => text.replaceAll('\u202f', ' ').replaceAll('\u2212', '-');
const drawn = (page: Page, holes: number) => page.locator(`.view3d canvas[data-holes="${holes}"]`).waitFor({ timeout: 60_000 });

test('what a request may not hold is not sent, and formats are told by the ending', () => {
  const sent = descriptionOf(world.part);
  assert.ok(sent.name === '' && sent.revision === 0 && sent.surface === undefined && sent.holeGroups.length === 2);
  assert.equal(world.part.revision, 3);
  assert.deepEqual(['a.STEP', 'b.stp', 'c.igs', 'd.stl', 'e.obj'].map(formatOf), [CadFormat.STEP, CadFormat.STEP, CadFormat.IGES, CadFormat.STL, undefined]);
});

test('two revisions differ by what was changed, and by nothing else', () => {
  const other = create(PartSchema, { ...world.part, holeGroups: world.part.holeGroups.map((group, i) => (i === 0 ? { ...group, diameterMm: 0.9 } : group)) } as never);
  assert.deepEqual(differencesOf(world.part, world.part), []);
  assert.deepEqual(differencesOf(world.part, other), [{ of: 'Group G1', what: 'diameter', before: '0.8', now: '0.9', unit: 'mm' }]);
});

test('a part shows its CAD, holes and datum points, in 3D and in figures', async () => {
  const page = await signedIn(stage, '/parts');
  const complaints = complaintsOf(page);
  await page.getByText('3 parts').waitFor();
  await page.getByRole('link', { name: 'vane-7' }).click();
  await drawn(page, 12);
  const text = plain((await page.locator('main').textContent())!);
  assert.match(text, /Size30\.00 × 16\.00 × 60\.00 mm/);
  assert.match(text, /12 800 triangles, at most 0\.040 µm off the CAD/);
  assert.match(text, /Open 2 open rims, 118\.4 mm together/);
  assert.match(text, /Solidblade of the file’s/);
  assert.match(text, /Healededges up to 33\.2 µm off their faces[^]*Faces do not meet by up to 14\.0 µm, at 6340\.0, 40\.0, -49\.5 mm/);
  assert.match(plain((await page.getByRole('region', { name: 'Table: Stations of its fixture' }).locator('tbody').textContent())!), /left-6350\.00000\.00000\.00005\.0right-6310\.0000/);
  assert.match(plain((await page.getByRole('region', { name: 'Table: What may follow a blank' }).locator('tbody').textContent())!), /leading edgemachinedto 6338\.00, 50\.00, 10\.00, looking to [−-]1\.000, 0\.000, 0\.000 within 70 deg0\.0200[−-]0\.10000\.3000bodystays as the blank iswhatever no other has/);
  assert.equal(await page.getByRole('region', { name: 'Table: Holes' }).locator('tbody tr').count(), 12);
  assert.equal(await page.getByRole('region', { name: 'Table: Datum points, 3-2-1' }).locator('tbody tr').count(), 6);
  assert.match(plain((await page.getByRole('region', { name: 'Table: Machining models' }).locator('tbody').textContent())!), /vane-edm210: G1, ⌀ 0\.400, 80\.0 long; 20: G2, ⌀ 0\.350, 80\.0 long; 30: paths F1, F2, ⌀ 0\.500, 60\.0 long120\.00035e1f00c2aa/);
  const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name: 'Download PNG of the 3D view' }).click()]);
  assert.equal(download.suggestedFilename(), 'vane-7_revision_3.png');
  assert.deepEqual(complaints, []);
  await page.context().close();
});

test('revisions are compared, by link', async () => {
  const page = await signedIn(stage, '/parts/vane-7?revision=3&against=2');
  const table = page.getByRole('region', { name: 'Table: What differs' });
  await table.waitFor();
  assert.match((await table.textContent())!, /Hole G1\/H3start[^]*-23\.2[^]*-23\.6mmGroup G2position tolerance0\.05 radius0\.03 radiusmm/);
  await page.getByText('1 start that moved').waitFor();
  await page.getByLabel('Compared with').selectOption('1');
  await table.getByText('Group G2').waitFor();
  assert.match(page.url(), /against=1/);
  await page.context().close();
});

test('a CAD file becomes the next revision, or is refused in words', async () => {
  const page = await signedIn(stage, '/parts/vane-7');
  await page.getByRole('button', { name: 'New revision…' }).click();
  await page.getByLabel('CAD file').setInputFiles({ name: 'vane.step', mimeType: 'application/step', buffer: Buffer.from('solid no step') });
  await page.getByRole('button', { name: 'Send' }).click();
  await page.getByText('cad: no STEP file, want ISO-10303-21').waitFor();
  await page.getByLabel('CAD file').setInputFiles({ name: 'vane.step', mimeType: 'application/step', buffer: Buffer.from('ISO-10303-21; HEADER;') });
  await page.getByRole('button', { name: 'Send' }).click();
  await page.getByText('Revision 4 against 3').waitFor();
  assert.match((await page.getByRole('region', { name: 'Table: What differs' }).textContent())!, /CADtriangles1280013100/);
  await page.context().close();
});

test('a new part is described by a file, and one that is none is said so', async () => {
  const page = await signedIn(stage, '/parts');
  await page.getByRole('button', { name: 'New part…' }).click();
  await page.getByLabel('Its id').fill('vane-8');
  await page.getByLabel('CAD file').setInputFiles({ name: 'v.stl', mimeType: 'model/stl', buffer: Buffer.from('solid v') });
  await page.getByLabel('Unit of the file').selectOption('25.4');
  await page.getByLabel('Description').setInputFiles({ name: 'v.json', mimeType: 'application/json', buffer: Buffer.from('{"holes": 1}') });
  await page.getByRole('button', { name: 'Send' }).click();
  await page.getByText('The description is no Part in JSON').waitFor();
  await page.getByLabel('Description').setInputFiles({ name: 'v.json', mimeType: 'application/json', buffer: Buffer.from('{"zeroFromPartNominal": {"rotation": [1,0,0,0,1,0,0,0,1], "translationMm": {}}}') });
  await page.getByRole('button', { name: 'Send' }).click();
  await page.getByRole('heading', { name: 'vane-8' }).waitFor();
  await page.getByText('its numbers in 25.400 mm').waitFor();
  await page.context().close();
});

test('mes-reader sees the figures, no shape and no button', async () => {
  const page = await signedIn(stage, '/parts/vane-7', 'mes');
  await page.getByText("The part's shape is shown to engineers and quality.").waitFor();
  assert.equal(await page.getByRole('button', { name: /New/ }).count(), 0);
  await page.context().close();
});

for (const colorScheme of ['light', 'dark'] as const) {
  test(`axe finds nothing on parts, ${colorScheme}`, async () => {
    const page = await signedIn(stage, '/parts', 'jane', { colorScheme });
    await page.locator('tbody tr').first().waitFor();
    await page.getByRole('button', { name: 'New part…' }).click();
    assert.deepEqual(await axeFindings(page), []);
    await page.goto(`${stage.gateway.url}/parts/vane-7?revision=3&against=2`);
    await drawn(page, 12);
    assert.deepEqual(await axeFindings(page), []);
    await page.context().close();
  });
}
