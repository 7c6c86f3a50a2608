import assert from 'node:assert/strict';
import { gzipSync } from 'node:zlib';
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

test('who signs in by the house comes back to where he was, or with the reason in words', async () => {
  const page = await stage.browser.newPage();
  await page.goto(`${stage.gateway.url}/blades?serial=SN-04`);
  await page.getByLabel('Name').waitFor();
  assert.equal(await page.getByRole('button', { name: /Sign in with/ }).count(), 0, 'no such button where there is no provider');
  stage.gateway.faults.directory = { name: 'Müller Turbinen', refuses: 'stranger' };
  try {
    await page.reload();
    await page.getByRole('button', { name: 'Sign in with Müller Turbinen' }).click();
    await page.getByText('none of your groups at Müller Turbinen gives a role here').waitFor();
    await page.waitForURL(/blades\?serial=SN-04$/);
    assert.deepEqual(await axeFindings(page), []);
    await page.goto(`${stage.gateway.url}/blades?sign_in=constructor`);
    await page.getByRole('button', { name: 'Sign in with Müller Turbinen' }).waitFor();
    assert.equal(await page.getByText('Not signed in').count(), 0, 'another word says nothing');
    await page.goto(`${stage.gateway.url}/blades?serial=SN-04`);
    stage.gateway.faults.directory = { name: 'Müller Turbinen' };
    await page.getByRole('button', { name: 'Sign in with Müller Turbinen' }).click();
    await page.getByRole('heading', { name: 'Blades' }).waitFor();
    assert.match(page.url(), /blades\?serial=SN-04$/);
  } finally {
    delete stage.gateway.faults.directory;
    await page.close();
  }
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

test('the first load of the fleet is under 200 KB', async () => {
  const context = await stage.browser.newContext();
  const page = await context.newPage();
  let sum = 0;
  page.on('response', (response) => {
    if (/\.(js|css|svg|wasm)$|\/$/.test(new URL(response.url()).pathname)) void response.body().then((body) => { sum += response.headers()['content-encoding'] === 'gzip' ? gzipSync(body).length : body.length; }, () => undefined);
  });
  await page.goto(stage.gateway.url);
  await signIn(page, 'jane');
  await page.locator('.strip svg').first().waitFor();
  await page.waitForTimeout(300);
  assert.ok(sum > 40_000 && sum < 200_000, `${sum} bytes`);
  console.log(`first load: ${Math.round(sum / 1000)} KB`);
  await context.close();
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
  await page.locator('[data-machine="sarix-1"]').waitFor();  // the shell may be live before the page of the fleet listens
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
  await page.getByText('Live', { exact: true }).waitFor();
  stage.gateway.faults.isSessionOver = true;
  // Whatever is asked next is refused: what was in flight already, or what this event makes the page ask.
  stage.plant.journal.put({ kind: 'scan', name: 'scans/1', machine: 'machines/sarix-12' });
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
