import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { axeFindings, complaintsOf, setStage, signedIn, signIn, type Stage } from './browser';

let stage: Stage;
before(async () => { stage = await setStage(); });
after(async () => { await stage.stop(); });

test('a wrong password is refused in words, and the right one leads to where one wanted', async () => {
  const page = await stage.browser.newPage();
  await page.goto(`${stage.gateway.url}/blades?serial=SN-04`);
  await page.fill('input[name=name]', 'jane');
  await page.fill('input[name=password]', 'guess');
  await page.click('button[type=submit]');
  await page.getByText('Not signed in').waitFor();
  await signIn(page, 'jane');
  await page.getByRole('heading', { name: 'Blades' }).waitFor();
  assert.match(page.url(), /blades\?serial=SN-04$/);
  await page.context().close().catch(() => undefined);
});

test('200 machines are there, the urgent first, without complaints', async () => {
  const page = await signedIn(stage, '/');
  const complaints = complaintsOf(page);
  await page.getByText('200 machines.').waitFor();
  assert.equal(await page.locator('.tile').count(), 200);
  const isUrgent = await page.locator('.tile').evaluateAll((tiles) => tiles.map((tile) => tile.classList.contains('tile-urgent')));
  assert.ok(isUrgent[0], 'an urgent tile is first');
  assert.ok(!isUrgent.slice(isUrgent.indexOf(false)).includes(true), 'none stands behind one that is not');
  assert.deepEqual(complaints, []);
  await page.context().close();
});

test('what is off the screen is not asked for', async () => {
  stage.gateway.faults.requests.length = 0;
  const page = await signedIn(stage, '/');
  await page.locator('.strip svg').first().waitFor();
  await page.waitForTimeout(500);
  const asked = stage.gateway.faults.requests.filter((request) => request.includes('GetMachineActivity')).length;
  assert.ok(asked >= 4 && asked < 40, `${asked} time lines of 200 asked for`);
  await page.context().close();
});

test('filter and span stand in the link', async () => {
  const page = await signedIn(stage, '/?find=sarix-17&hours=8');
  await page.getByText('11 of 200 machines').waitFor();  // sarix-17 and sarix-170 to sarix-179
  assert.equal(await page.getByLabel('Counted').inputValue(), '8');
  await page.getByLabel('Find', { exact: true }).fill('nothing-like-it');
  await page.getByText('No machine is like that').waitFor();
  await page.context().close();
});

test('an event shows on its tile within 300 ms, as the median of ten', async () => {
  const page = await signedIn(stage, '/?find=sarix-1');
  await page.getByText('Live', { exact: true }).waitFor();
  const times: number[] = [];
  for (let i = 0; i < 10; ++i) {
    const began = Date.now();
    stage.plant.journal.put({ kind: 'inspection', name: `inspections/${i}`, machine: 'machines/sarix-1', blade: `blades/SN-9${i}`, verdict: 'CONFORM' });
    await page.locator('[data-machine="sarix-1"]').getByText(`SN-9${i} judged`).waitFor();
    times.push(Date.now() - began);
  }
  const median = times.sort((a, b) => a - b)[5]!;
  assert.ok(median <= 300, `median ${median} ms of ${times.join(', ')}`);
  await page.context().close();
});

test('a service that is away is said, what was there stays, and the page recovers by itself', async () => {
  const page = await signedIn(stage, '/');
  await page.getByText('200 machines.').waitFor();
  stage.gateway.faults.servicesAway.add('plant');
  await page.getByLabel('Counted').selectOption('8');
  await page.getByText('The plant service is away').waitFor();
  assert.equal(await page.locator('.tile').count(), 200);
  stage.gateway.faults.servicesAway.clear();
  await page.getByText('The plant service is away').waitFor({ state: 'detached', timeout: 15_000 });
  await page.context().close();
});

test('a session that is over leads to the sign-in and back to where one was', async () => {
  const page = await signedIn(stage, '/?find=sarix-12');
  await page.getByText('of 200 machines').waitFor();
  stage.gateway.faults.isSessionOver = true;
  await page.getByLabel('Counted').selectOption('8');
  await page.getByText('Your session is over').waitFor();
  await signIn(page, 'jane');
  await page.getByText('of 200 machines').waitFor();
  assert.match(page.url(), /find=sarix-12/);
  await page.context().close();
});

for (const colorScheme of ['light', 'dark'] as const) {
  test(`axe finds nothing on sign-in and fleet, ${colorScheme}`, async () => {
    const context = await stage.browser.newContext({ colorScheme });
    const out = await context.newPage();
    await out.goto(stage.gateway.url);
    await out.getByLabel('Name').waitFor();
    assert.deepEqual(await axeFindings(out), []);
    await context.close();
    const page = await signedIn(stage, '/?find=sarix-1', 'jane', { colorScheme });
    await page.locator('.strip svg').first().waitFor();
    await page.locator('summary').first().click();
    assert.deepEqual(await axeFindings(page), []);
    await page.context().close();
  });
}
