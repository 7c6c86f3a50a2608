import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import type { Page } from 'playwright-core';
import { axeFindings, complaintsOf, setStage, signedIn, type Stage } from './browser';
import * as world from './fixtures/blade_world';
import { kRestingCount } from './fixtures/calibration_world';

let stage: Stage;
before(async () => { stage = await setStage(12); });
after(async () => { await stage.stop(); });

const plain = (text: string) => text.replaceAll('\u202f', ' ').replaceAll('\u2212', '-');
const kSensor = `/${world.sensor.name}`, kRotation = `/${world.rotation.name}`;
const charted = (page: Page) => page.locator('.trend-place canvas').nth(5).waitFor();
const one = async (page: Page, kind: string, state: string) => {
  await page.goto(`${stage.gateway.url}/calibrations?machine=sarix-1&kind=${kind}&state=${state}`);
  await page.locator('tbody a').first().click();
  await page.getByRole('heading', { name: 'Trend', exact: true }).waitFor();
};

test('calibrations are listed page by page, and filtered by machine, kind and state in the link', async () => {
  const page = await signedIn(stage, '/calibrations');
  await page.getByText('100 calibrations, and more').waitFor();
  await page.getByRole('button', { name: 'Show more' }).click();
  await page.locator('tbody tr').nth(120).waitFor({ state: 'attached' });
  await page.goto(`${stage.gateway.url}/calibrations?machine=sarix-1&kind=SENSOR`);
  await page.getByText('12 calibrations.').waitFor();
  await page.getByLabel('State').selectOption('WITHDRAWN');
  await page.getByText('1 calibration.').waitFor();
  assert.match(page.url(), /state=WITHDRAWN/);
  await page.context().close();
});

test('a trend shows every value with U, its step is an alarm, and a limit in the link another', async () => {
  const page = await signedIn(stage, kSensor);
  const complaints = complaintsOf(page);
  await charted(page);
  const table = page.getByRole('region', { name: 'Table: Trend in figures' });
  const row = plain((await table.locator('tr', { hasText: 'T_sm x' }).textContent())!);
  assert.match(row, /15\.1000 ± 0\.0018 mm/);
  assert.match(row, /Step/);
  assert.match((await table.locator('tr', { hasText: 'T_sm y' }).textContent())!, /None/);
  assert.match((await table.locator('tr', { hasText: 'α' }).textContent())!, /Slope/);
  await page.getByLabel('Limit of T_sm z from the first value, mm').fill('0.0001');
  await page.keyboard.press('Enter');
  await table.locator('tr', { hasText: 'T_sm z' }).getByText('Beyond its limit').waitFor();
  assert.match(page.url(), /limit_t_sm_z_mm=0\.0001/);
  const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name: 'Download PNG: T_sm x, mm' }).click()]);
  assert.match(download.suggestedFilename(), /T_sm_x_mm\.png$/);
  assert.deepEqual(complaints, []);
  await page.context().close();
});

test('residuals of each kind are drawn and stand in a table', async () => {
  const page = await signedIn(stage, kRotation);
  await page.getByRole('img', { name: /^Distance of probed centres/ }).waitFor();
  assert.match(plain((await page.locator('main').textContent())!), /By the axes of the machine’s record the centres lay \d+\.\d µm off \(rms\), by these \d\.\d\d µm: \d+ times nearer, over the poses held out/);
  assert.equal(await page.getByRole('region', { name: 'Table: Residuals' }).locator('tbody tr').count(), 32);
  await page.goto(stage.gateway.url + kSensor);
  await page.getByRole('img', { name: /^Laser less touch/ }).waitFor();
  await one(page, 'AXIS', 'IN_FORCE');
  await page.getByRole('img', { name: /reached less commanded/ }).waitFor();
  await one(page, 'PROBE', 'IN_FORCE');
  await page.getByRole('img', { name: /^Displacement read less expected/ }).waitFor();
  await page.context().close();
});

test('what rests on it is counted in pages, and verdicts that flip are told as they are judged anew', async () => {
  const page = await signedIn(stage, kSensor);
  const resting = page.locator('section', { has: page.getByRole('heading', { name: 'What rests on it' }) });
  await resting.getByText('at least').first().waitFor();
  await resting.getByRole('button', { name: 'Count on' }).click();
  await page.waitForTimeout(300);
  await resting.getByRole('button', { name: 'Count on' }).click();
  await resting.getByRole('button', { name: 'Count on' }).waitFor({ state: 'detached' });
  assert.match(plain((await resting.locator('.sums').textContent())!), new RegExp(`Blades${kRestingCount / 4}`));
  assert.equal(await resting.locator('tbody tr').count(), 200);
  await page.getByRole('button', { name: 'Judge anew…' }).click();
  await page.getByRole('button', { name: 'Judge anew', exact: true }).click();
  await page.getByText('6 of 6 inspections judged anew, 2 verdicts flip.').waitFor();
  const flips = page.getByRole('region', { name: 'Table: Flips, holes that flip, and refusals' });
  assert.equal(await flips.locator('tbody tr').count(), 3);
  assert.match((await flips.textContent())!, /SN-1001ConformNot conformg2\/h3: conform to not conform/);
  await page.context().close();
});

test('mes-reader reads it all, and sees no button that changes something', async () => {
  const page = await signedIn(stage, kSensor, 'mes');
  await charted(page);
  assert.equal(await page.getByRole('button', { name: /Withdraw|Release|Judge anew/ }).count(), 0);
  await page.context().close();
});

test('a draft is released, with or without a reason', async () => {
  const page = await signedIn(stage, '/calibrations');
  await one(page, 'SENSOR', 'DRAFT');
  await page.getByText('Its residuals are not what its uncertainty explains.').waitFor();
  await page.getByRole('button', { name: 'Release…' }).click();
  await page.getByRole('button', { name: 'Release', exact: true }).click();
  await page.locator('.mark-big', { hasText: 'In force' }).waitFor();
  await page.context().close();
});

test('a withdrawal says what it means, and marks the blades that rest on it', async () => {
  const blade = await signedIn(stage, '/blades/SN-0412');
  await blade.locator('.mark-big', { hasText: 'Not conform' }).waitFor();
  await blade.getByText('Live', { exact: true }).waitFor();
  const page = await signedIn(stage, kSensor);
  await page.getByRole('button', { name: 'Withdraw…' }).click();
  await page.getByLabel('Why').fill('The scanner was knocked.');
  await page.getByRole('button', { name: 'Withdraw', exact: true }).click();
  await page.getByText('It is withdrawn for ever.').waitFor();
  assert.match(plain((await page.locator('main').textContent())!), /2 300 results of 575 blades rest on it/);
  await page.locator('.mark-big', { hasText: 'Withdrawn' }).waitFor();
  await blade.getByText('It rests on a calibration that was withdrawn').waitFor();
  assert.match((await blade.getByRole('alert').textContent())!, /“The scanner was knocked.”/);
  await page.context().close();
  await blade.context().close();
});

for (const colorScheme of ['light', 'dark'] as const) {
  test(`axe finds nothing on calibrations, ${colorScheme}`, async () => {
    const page = await signedIn(stage, '/calibrations', 'jane', { colorScheme });
    await page.locator('tbody tr').first().waitFor();
    assert.deepEqual(await axeFindings(page), []);
    for (const path of [kSensor, kRotation]) {
      await page.goto(stage.gateway.url + path);
      await page.locator('.trend-place canvas').nth(2).waitFor();
      await page.getByRole('region', { name: 'Table: Residuals' }).waitFor();
      assert.deepEqual(await axeFindings(page), [], path);
    }
    await page.context().close();
  });
}
