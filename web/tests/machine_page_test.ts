import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { create } from '@bufbuild/protobuf';
import type { Page } from 'playwright-core';
import { JointKind, JointSchema } from '#proto/sixpoint/plant/v1/machine_pb';
import { apply } from '../src/scene/frames';
import { chainOf, reachOf } from '../src/scene/kinematics';
import { axeFindings, complaintsOf, setStage, signedIn, type Stage } from './browser';

let stage: Stage;
before(async () => { stage = await setStage(12); });
after(async () => { await stage.stop(); });

const plain = (text: string) => text.replaceAll('\u202f', ' ').replaceAll('\u2212', '-');
const open = (page: Page) => page.locator('.view3d canvas[data-table]').waitFor({ timeout: 60_000 });

test('an axis carries those after it, by its sense, and a slider stays within a turn', () => {
  const rotary = (axis: string, direction: object, sign: number) => create(JointSchema, { axis, kind: JointKind.ROTARY, direction, pointMm: {}, sign, minimum: -1e6, maximum: 1e6 } as never);
  const chain = chainOf([rotary('A', { x: 1, y: 0, z: 0 }, 1), rotary('B', { x: 0, y: 0, z: 1 }, -1)], { A: 90, B: 90 });
  // B turns first, backwards: x to -y; A then takes -y to -z.
  apply(chain.end, [1, 0, 0]).forEach((value, i) => assert.ok(Math.abs(value - [0, 0, -1][i]!) < 1e-12));
  assert.deepEqual(reachOf(rotary('A', { x: 1 }, 1)), { minimum: -360, maximum: 360 });
});

test('a machine shows what is wrong, its axes that move, its scanner and its tables', async () => {
  const page = await signedIn(stage, '/machines/sarix-1');
  const complaints = complaintsOf(page);
  await open(page);
  const before_ = await page.locator('.view3d canvas').getAttribute('data-table');
  await page.getByRole('slider', { name: 'Axis B' }).focus();
  for (let i = 0; i < 25; ++i) await page.keyboard.press('ArrowRight');
  await page.getByText('18.0\u202fdeg').waitFor();
  assert.match(before_!, /^1\.0000 0\.0000/);
  // 25 thousandths of 720 degrees about X of the machine.
  await page.waitForFunction(() => {
    const table = document.querySelector<HTMLCanvasElement>('.view3d canvas')!.dataset['table']!.split(' ').map(Number);
    return Math.abs(Math.atan2(table[7]!, table[8]!) * (180 / Math.PI) - 18) < 0.1;
  });
  const text = plain((await page.locator('main').textContent())!);
  assert.match(text, /Waits for a person/);
  assert.match(text, /53\.5 mm away, 18\.9 mm wide/);
  assert.match(text, /probed centre from where the axes put it, rms, poses held out/);
  assert.match(text, /u of one position0\.00230 deg0\.00040 deg5\.8/);
  assert.match((await page.getByRole('region', { name: /Table: Interim checks/ }).locator('tr').nth(1).textContent())!, /Rejected/);
  assert.equal(await page.getByRole('img', { name: /reached less commanded/ }).count(), 2);
  const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name: 'Download PNG of the 3D view' }).click()]);
  assert.equal(download.suggestedFilename(), 'sarix-1_axes.png');
  assert.deepEqual(complaints, []);
  await page.context().close();
});

test('what a machine cuts beside its corrections is told blade by blade, and what is offered of it', async () => {
  const page = await signedIn(stage, '/machines/sarix-1');
  const complaints = complaintsOf(page);
  const section = page.getByRole('region', { name: 'Cut against predicted' });
  await section.getByText(/Offered as its known offset; nothing applies it/).waitFor();
  await section.locator('.trend-place canvas').nth(1).waitFor();
  const text = plain((await section.textContent())!);
  assert.match(text, /X30\.2 ± 4\.4 µm/);
  assert.match(text, /These holes do not tell Z/);
  assert.match(text, /G1\/H2/);
  await section.getByText('1 earlier period').click();
  await section.getByText(/not enough blades; its calibrations/).waitFor();
  assert.deepEqual(await axeFindings(page), []);
  assert.deepEqual(complaints, []);
  await page.context().close();
});

test('alarms of the fleet lead to what they are of', async () => {
  const page = await signedIn(stage, '/?find=sarix-1');
  const tile = page.locator('[data-machine="sarix-1"]');
  await tile.getByRole('link', { name: 'Waits for a person' }).click();
  await page.getByRole('heading', { name: /^Correction / }).waitFor();
  await page.goBack();
  await tile.getByRole('link', { name: 'Scanner moved' }).click();
  await page.getByRole('region', { name: /Table: Interim checks/ }).waitFor();
  assert.match(page.url(), /machines\/sarix-1#checks$/);
  await page.goBack();
  await tile.getByRole('rowheader', { name: 'Scanner' }).getByRole('link').click();
  await page.getByRole('heading', { name: /^Scanner of sarix-1/ }).waitFor();
  await page.goBack();
  await page.locator('[data-machine="sarix-1"]').getByRole('link', { name: 'sarix-1', exact: true }).click();
  await page.getByRole('heading', { name: 'sarix-1', exact: true }).waitFor();
  await page.context().close();
});

test('one without joints, and one that is not recorded, are said so; mes-reader reads it', async () => {
  const page = await signedIn(stage, '/machines/sarix-12', 'mes');
  await page.getByText('No joints are recorded of it').waitFor();
  await page.getByText('No axis is characterised').waitFor();
  await page.goto(`${stage.gateway.url}/machines/none`);
  await page.getByText('Not found').waitFor();
  await page.context().close();
});

for (const colorScheme of ['light', 'dark'] as const) {
  test(`axe finds nothing on a machine, ${colorScheme}`, async () => {
    const page = await signedIn(stage, '/machines/sarix-1', 'jane', { colorScheme });
    await open(page);
    await page.getByRole('region', { name: /Table: Interim checks/ }).waitFor();
    assert.deepEqual(await axeFindings(page), []);
    await page.context().close();
  });
}
