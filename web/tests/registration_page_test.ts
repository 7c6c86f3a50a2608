import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import type { Page } from 'playwright-core';
import { eigenOf, shadowOf } from '../src/scene/ellipsoid';
import { axeFindings, complaintsOf, setStage, signedIn, type Stage } from './browser';
import * as world from './fixtures/blade_world';

let stage: Stage;
before(async () => { stage = await setStage(12); });
after(async () => { await stage.stop(); });

const plain = (text: string) => text.replaceAll('\u202f', ' ').replaceAll('\u2212', '-');
const kPath = `/${world.before.name}`;
const marked = (page: Page) => page.locator('.view3d canvas[data-marks="32"]').waitFor({ timeout: 60_000 });

test('an ellipsoid has the axes that its covariance says', () => {
  const [a, b, c] = eigenOf([4, 0, 0, 0, 9, 0, 0, 0, 1]);
  assert.deepEqual([a!.value, b!.value, c!.value], [9, 4, 1]);
  const tilted = eigenOf([2, 1, 0, 1, 2, 0, 0, 0, 5]);  // 3 along (1, 1, 0), 1 along (1, -1, 0)
  assert.ok(Math.abs(tilted[1]!.value - 3) < 1e-12 && Math.abs(Math.abs(tilted[1]!.vector[0]) - Math.SQRT1_2) < 1e-12);
  const shadow = shadowOf([2, 1, 0, 1, 2, 0, 0, 0, 5], 0, 1);
  assert.ok(Math.abs(shadow.longer - Math.sqrt(3)) < 1e-12 && Math.abs(shadow.shorter - 1) < 1e-12 && Math.abs(shadow.turnRad - Math.PI / 4) < 1e-12);
});

test('the evidence of a registration is linked from its blade, drawn and in figures', async () => {
  const page = await signedIn(stage, '/blades/SN-0412');
  await page.getByRole('link', { name: 'Registered, six-point' }).first().click();
  await page.getByRole('heading', { name: /^Registration/ }).waitFor();
  const complaints = complaintsOf(page);
  await marked(page);
  const text = plain((await page.locator('main').textContent())!);
  assert.match(text, /They agree by at most 2\.1 ± 3\.0 µm: 1\.4 standard uncertainties of at most 4\.1/);
  assert.match(text, /1 overlap disagrees by more than twice what noise explains: sn412_airfoil_1 and sn412_airfoil_3/);
  assert.match(text, /χ² = 13\.2 of at most 20\.5, 5 degrees of freedom/);
  // Of the fixture's shifts: 0.35, 0.4 and 0.9 um, x and z correlated by 0.6; the ellipsoid turns with the part, its axes do not grow.
  const axes = [...plain((await page.getByRole('img', { name: /^Ellipsoid of the shifts/ }).getAttribute('aria-label'))!).matchAll(/\d\.\d\d(?=[,\s])/g)].slice(0, 3).map(Number);
  const truth = eigenOf([0.35 ** 2, 0, 0.6 * 0.35 * 0.9, 0, 0.4 ** 2, 0, 0.6 * 0.35 * 0.9, 0, 0.9 ** 2]).map(({ value }) => 2 * Math.sqrt(value));
  axes.forEach((axis, i) => assert.ok(Math.abs(axis - truth[i]!) < 0.006, `${axes} of ${truth}`));
  assert.match(plain((await page.getByRole('img', { name: /^Distance at each datum point/ }).getAttribute('aria-label'))!), /D1 1\.2 ± 1\.0 µm; D2 -0\.8 ± 1\.2 µm/);
  assert.equal(await page.getByRole('region', { name: 'Table: Places' }).locator('tbody tr').count(), 32);
  assert.deepEqual(complaints, []);
  await page.context().close();
});

test('a place is picked by its name, and the 3D view downloads as PNG', async () => {
  const page = await signedIn(stage, kPath);
  await marked(page);
  await page.getByRole('button', { name: 'R9', exact: true }).click();
  assert.equal(await page.getByRole('button', { name: 'R9', exact: true }).getAttribute('aria-pressed'), 'true');
  const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name: 'Download PNG of the 3D view' }).click()]);
  assert.match(download.suggestedFilename(), /^registrations_.*\.png$/);
  await page.context().close();
});

test('a blank that is too small is said so, with the patches that conflict', async () => {
  const page = await signedIn(stage, `/${world.infeasible.name}`);
  const complaints = complaintsOf(page);
  await page.locator('.mark-big', { hasText: 'Infeasible' }).waitFor();
  const text = plain((await page.locator('main').textContent())!);
  assert.match(text, /It cannot be made from this blank Least stock -0\.042 mm, 0\.042 mm short/);
  assert.match(text, /There is no pose, and so no uncertainty of it/);
  assert.match(plain((await page.getByRole('region', { name: 'Table: Patches that conflict' }).textContent())!), /-0\.0420 ± 0\.004252/);
  assert.equal(await page.getByText('Six points against the best fit').count(), 0);
  assert.deepEqual(await axeFindings(page), []);
  assert.deepEqual(complaints, []);
  await page.context().close();
});

test('mes-reader reads the evidence without the shape; one that is not recorded is said so', async () => {
  const page = await signedIn(stage, kPath, 'mes');
  await page.getByText("The part's shape is shown to engineers and quality.").waitFor();
  await page.goto(`${stage.gateway.url}/registrations/none`);
  await page.getByText('Not found').waitFor();
  await page.context().close();
});

for (const colorScheme of ['light', 'dark'] as const) {
  test(`axe finds nothing on a registration, ${colorScheme}`, async () => {
    const page = await signedIn(stage, kPath, 'jane', { colorScheme });
    await marked(page);
    assert.deepEqual(await axeFindings(page), []);
    await page.context().close();
  });
}
