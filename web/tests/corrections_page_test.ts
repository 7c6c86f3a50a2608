import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { axeFindings, complaintsOf, setStage, signedIn, type Stage } from './browser';
import { kWaitingCount } from './fixtures/waiting';

let stage: Stage;
before(async () => { stage = await setStage(12); });
after(async () => { await stage.stop(); });

test('every waiting correction is listed page by page, with what lies beyond the gate', async () => {
  const page = await signedIn(stage, '/corrections');
  const complaints = complaintsOf(page);
  await page.getByText('20 corrections wait, and more').waitFor();
  await page.getByRole('button', { name: 'Show more' }).click();
  await page.getByText(`${kWaitingCount} corrections wait.`).waitFor();
  const first = page.locator('.card').first();
  assert.match((await first.textContent())!, /SN-0413[^]*Start moved of G2\/H4 and 1 more[^]*2\.314\s?mm at most 2\s?mm/);
  await first.getByRole('img', { name: 'Start moved: 2.314 mm, at most 2 mm' }).waitFor();
  const keepOut = page.locator('.card', { hasText: 'line 48' }).first();
  assert.match((await keepOut.textContent())!, /0\.31\s?mm at least 0\.5\s?mm[^]*4\.2\s?deg at most 3\s?deg/);
  assert.match((await page.locator('.card', { hasText: 'Scans put the surface' }).first().textContent())!, /could not be told/);
  assert.deepEqual(complaints, []);
  await page.context().close();
});

test('the displacement has six values with U, and downloads as PNG', async () => {
  const page = await signedIn(stage, '/corrections');
  const card = page.locator('.card').first();
  const words = await card.getByRole('img', { name: /^Shift:/ }).getAttribute('aria-label');
  // The fixture clamps the blade 0.6, -0.4, 0.3 mm off, turned by 12, -7.2, 9.6 mrad; U of z is twice 0.9 um.
  assert.match(words!.replaceAll('\u202f', ' ').replaceAll('\u2212', '-'), /shift X 0\.60000 ± 0\.00070 mm; shift Y -0\.40000 ± 0\.00080 mm; shift Z 0\.3000 ± 0\.0018 mm/);
  const turn = (await card.getByRole('img', { name: /^Turn:/ }).getAttribute('aria-label'))!.replaceAll('\u2212', '-');
  const [x, y, z] = [...turn.matchAll(/turn [XYZ] (-?[\d.]+)/g)].map((found) => Number(found[1]) * (Math.PI / 180));
  assert.ok(Math.abs(x! - 0.012) < 1e-4 && Math.abs(y! + 0.0072) < 1e-4 && Math.abs(z! - 0.0096) < 1e-4, turn);
  const [download] = await Promise.all([page.waitForEvent('download'), card.getByRole('button', { name: /Download PNG/ }).click()]);
  assert.equal(download.suggestedFilename(), 'SN-0413_displacement.png');
  await page.context().close();
});

test('a release with a reason takes it from the list, there and on another screen', async () => {
  const other = await signedIn(stage, '/corrections');
  await other.getByText('Live', { exact: true }).waitFor();
  const page = await signedIn(stage, '/corrections');
  const card = (of: typeof page) => of.locator('.card', { hasText: 'SN-0301' });
  await card(page).getByRole('button', { name: 'Release…' }).click();
  await card(page).getByRole('button', { name: 'Release', exact: true }).click();
  assert.equal(await page.getByRole('dialog').count(), 1, 'without a reason nothing is sent');
  await card(page).getByLabel('Why').fill('The tool was measured by hand.');
  await card(page).getByRole('button', { name: 'Release', exact: true }).click();
  await card(page).waitFor({ state: 'detached' });
  await card(other).waitFor({ state: 'detached' });
  await page.context().close();
  await other.context().close();
});

test('one correction has a page of its own, and says what was decided', async () => {
  const page = await signedIn(stage, '/corrections?machine=sarix-2');
  await page.locator('.card').getByRole('link', { name: /questions of the gate/ }).click();
  await page.getByRole('heading', { name: /^Correction / }).waitFor();
  await page.getByRole('button', { name: 'Refuse…' }).click();
  await page.getByLabel('Why').fill('Clamp it anew.');
  await page.getByRole('button', { name: 'Refuse', exact: true }).click();
  await page.locator('.mark-big', { hasText: 'Refused' }).waitFor();
  await page.getByText('“Clamp it anew.”').waitFor();
  await page.goto(`${stage.gateway.url}/corrections?machine=sarix-2`);
  await page.getByText('None of these waits').waitFor();
  await page.context().close();
});

test('mes-reader sees what waits, and no button that decides', async () => {
  const page = await signedIn(stage, '/corrections', 'mes');
  await page.locator('.card').first().waitFor();
  await page.getByText('An engineer or quality decides.').first().waitFor();
  assert.equal(await page.getByRole('button', { name: /Release|Refuse/ }).count(), 0);
  await page.context().close();
});

test('while the correction service is away the page says so, and goes on by itself', async () => {
  stage.gateway.faults.servicesAway.add('correction');
  const page = await signedIn(stage, '/corrections');
  await page.getByRole('alert').getByText('A service is away').waitFor();
  // The fleet asks nothing of that service: the notice does not stand on it until somebody does.
  const notice = page.getByRole('status').locator('.notice', { hasText: 'The correction service is away' });
  await notice.waitFor();
  await page.getByRole('link', { name: 'Fleet', exact: true }).click();
  await notice.waitFor({ state: 'detached' });
  await page.getByRole('link', { name: 'Corrections', exact: true }).click();
  await notice.waitFor();
  stage.gateway.faults.servicesAway.clear();
  await page.locator('.card').first().waitFor({ timeout: 15_000 });
  await page.context().close();
});

for (const colorScheme of ['light', 'dark'] as const) {
  test(`axe finds nothing on the corrections, ${colorScheme}`, async () => {
    const page = await signedIn(stage, '/corrections', 'jane', { colorScheme });
    await page.getByRole('img', { name: /^Turn:/ }).first().waitFor();
    assert.deepEqual(await axeFindings(page), []);
    await page.locator('.card').first().getByRole('link', { name: /of the gate/ }).click();
    await page.getByRole('img', { name: /^Turn:/ }).waitFor();
    assert.deepEqual(await axeFindings(page), []);
    await page.context().close();
  });
}
