// A blade against its drawing, and its holes beside where they were drawn.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import type { Locator, Page } from 'playwright-core';
import { axeFindings, complaintsOf, setStage, signedIn, type Stage } from './browser';

let stage: Stage;
before(async () => { stage = await setStage(12); });
after(async () => { await stage.stop(); });

const sectionOf = (page: Page): Locator => page.locator('#assessment');
const findingsOf = (page: Page): Locator => sectionOf(page).getByRole('region', { name: 'Table: Characteristics' });
const rowOf = (page: Page, ...words: (string | RegExp)[]): Locator => words.reduce((row, hasText) => row.filter({ hasText }), findingsOf(page).locator('tbody tr'));

test('a machined blade is judged characteristic by characteristic: limits, value with U, verdict, rule, why, and what others found', async () => {
  const page = await signedIn(stage, '/blades/SN-0412');
  const complaints = complaintsOf(page);
  await findingsOf(page).waitFor();
  assert.match(await page.locator('.blade-top').innerText(), /Not conform By its drawing vane-7-final rev\. 3, machined\./);
  assert.match(await sectionOf(page).locator('.assessed').innerText(), /6 of 10 findings conform, 1 not conform, 2 not measured, 1 undecidable\..*machined.*vane-7-final rev\. 3 \(1203-77, revision C\)/s);
  const groups = sectionOf(page).getByRole('region', { name: 'Table: By place' });
  assert.match(await groups.locator('tr', { hasText: 'G1' }).innerText(), /G1\s+Not conform\s+2\s+5/);
  assert.match(await groups.locator('tr', { hasText: 'the whole part' }).innerText(), /Not measured\s+0\s+1/);
  assert.match(await rowOf(page, 'H2').innerText(), /^12\s+Not conform\s.*leading row\s+H2\s+critical\s+at most 0\.03\smm\s+0\.0412 ± 0\.0082\smm\s.*six-point\s+0\.0281 ± 0\.0079\smm by best fit\s+0\.0390\smm \(U not known\) by measurement 3b4a5d31\s+ISO 14253-1:2017/s);
  assert.match(await rowOf(page, 'Undecidable').innerText(), /0\.0263 ± 0\.0079.*so near to a limit/s);
  assert.match(await rowOf(page, 'second row').innerText(), /0\.75 to 0\.85\smm\s+0\.8032 ± 0\.0061\smm.*guard band 50\s?% of U/s);
  assert.match(await rowOf(page, 'Chord').innerText(), /29\.9 to 30\.1\smm.*simple acceptance/s);
  assert.deepEqual(complaints, []);
  await page.context().close();
});

test('what was not measured has no number and no place on its bar; 0 that was measured is 0', async () => {
  const page = await signedIn(stage, '/blades/SN-0412');
  await findingsOf(page).waitFor();
  const wall = rowOf(page, 'ultrasonic');
  assert.match(await wall.innerText(), /Not measured.*at least 1\.2\smm\s+not measured.*no measurement of another instrument/s);
  assert.doesNotMatch((await wall.innerText()).replace('1.2', '').replace('21', '').replace('14253-1:2017', ''), /\d/);
  assert.equal(await wall.locator('[class^=knot]').count(), 0);
  assert.equal(await wall.getByRole('img').getAttribute('aria-label'), 'not measured, at least 1.2\u202fmm: Not measured');
  assert.match(await rowOf(page, 'Inclination').innerText(), /0\.000 ± 0\.031\sdeg/);
  assert.equal(await rowOf(page, 'Inclination').locator('.knot-good').count(), 1);
  await page.context().close();
});

test('a bar shows value and U where they lie between the limits, and says so in words', async () => {
  const page = await signedIn(stage, '/blades/SN-0412');
  await findingsOf(page).waitFor();
  const bar = rowOf(page, 'second row').getByRole('img');
  assert.equal(await bar.getAttribute('aria-label'), '0.8032 ± 0.0061\u202fmm, 0.75 to 0.85\u202fmm: Conform');
  // Limits at 44 and 100: 0.8032 is 53.2 % of the way, U 6.1 %.
  assert.ok(Math.abs(Number(await bar.locator('.knot-good').getAttribute('cx')) - (44 + 56 * 0.532)) < 0.01);
  const [from, to] = [...(await bar.locator('.within-whisker').getAttribute('d'))!.matchAll(/H([\d.]+)m0 -3v6/g)].map((found) => Number(found[1]));
  assert.ok(Math.abs(to! - from! - 2 * 56 * 0.061) < 0.01, `${from} to ${to}`);
  // A side without a limit is not closed.
  assert.match((await rowOf(page, 'H2').locator('.knot-bad').getAttribute('d'))!, /^M120\.9/);
  assert.equal(await rowOf(page, 'H2').locator('.within-limit').count(), 1);
  await page.context().close();
});

test('what is not conform comes first, and findings are chosen by verdict, place and words', async () => {
  const page = await signedIn(stage, '/blades/SN-0412');
  await findingsOf(page).waitFor();
  const verdicts = async () => findingsOf(page).locator('tbody td:nth-child(2)').allInnerTexts();
  assert.deepEqual((await verdicts()).slice(0, 5), ['Not conform', 'Not measured', 'Not measured', 'Undecidable', 'Conform']);
  await sectionOf(page).getByLabel('Order').selectOption('As drawn');
  assert.deepEqual((await verdicts()).slice(0, 2), ['Conform', 'Not conform']);
  await sectionOf(page).getByLabel('Verdict').selectOption('Not measured (2)');
  assert.deepEqual(await verdicts(), ['Not measured', 'Not measured']);
  await sectionOf(page).getByLabel('Verdict').selectOption('Any');
  await sectionOf(page).getByRole('button', { name: 'root' }).click();
  await sectionOf(page).getByText('2 findings of 10.').waitFor();
  assert.equal(await sectionOf(page).getByRole('combobox', { name: 'Place' }).inputValue(), 'root');
  await sectionOf(page).getByLabel('Number, name or hole').fill('chord');
  await sectionOf(page).getByText('1 finding of 10.').waitFor();
  await sectionOf(page).getByLabel('Number, name or hole').fill('no such');
  await sectionOf(page).getByText('0 findings of 10.').waitFor();
  assert.equal(await findingsOf(page).count(), 0);
  await page.context().close();
});

test('an earlier assessment is looked at: before machining, with what a correction cures', async () => {
  const page = await signedIn(stage, '/blades/SN-0412');
  await findingsOf(page).waitFor();
  await sectionOf(page).getByLabel('Assessment').selectOption({ index: 1 });
  await sectionOf(page).locator('.assessed', { hasText: 'Can be machined' }).waitFor();
  assert.match(await rowOf(page, 'Profile').innerText(), /Not conform.*a correction cures it/s);
  await page.context().close();
});

test('a blank that is discarded says so first, why, and which places conflict: as a table and on the part', async () => {
  const page = await signedIn(stage, '/blades/SN-0414');
  const complaints = complaintsOf(page);
  await page.locator('.blade-top .mark-big', { hasText: 'Discard' }).waitFor();
  assert.match(await page.locator('.blade-top').innerText(), /no rigid motion of the part brings it within its limits/);
  const conflicts = sectionOf(page).getByRole('region', { name: 'Table: Places whose limits conflict' });
  await conflicts.waitFor();
  assert.match(await conflicts.locator('tr', { hasText: 'patch 211' }).innerText(), /lower: too little material\s+−142\.0 ± 1\.3.*34\s?%/s);
  assert.match(await rowOf(page, 'Profile').innerText(), /−0\.1420 ± 0\.0013\smm\s.*no motion cures it/s);
  assert.match((await rowOf(page, 'Profile').locator('.knot-bad').getAttribute('d'))!, /^M1 9/);
  await sectionOf(page).getByRole('button', { name: 'Show the places in 3D' }).click();
  await page.waitForFunction(() => document.querySelector<HTMLCanvasElement>('#assessment canvas')?.dataset['marks'] === '4', undefined, { timeout: 60_000 });
  await conflicts.getByRole('button', { name: '17, patch 308' }).click();
  assert.equal(await conflicts.locator('tr.picked').count(), 1);
  assert.deepEqual(complaints, []);
  await page.context().close();
});

test('a blank that nothing is said of yet is neither good nor bad', async () => {
  const page = await signedIn(stage, '/blades/SN-0413', 'mes');
  await page.locator('.blade-top .mark-big.tone-unsure', { hasText: 'Open whether it can be machined' }).waitFor();
  assert.match(await page.locator('.blade-top').innerText(), /want a deviation map with this profile tolerance/);
  await page.context().close();
});

test('2000 findings: the one that is out stands first, a hundred are shown, and a word finds any', async () => {
  const page = await signedIn(stage, '/blades/SN-0415');
  await findingsOf(page).waitFor();
  const rows = findingsOf(page).locator('tbody tr');
  assert.equal(await rows.count(), 100);
  assert.match(await rows.first().innerText(), /Not conform.*H1778/s);
  await sectionOf(page).getByText('the first 100 are shown, all are copied').waitFor();
  await sectionOf(page).getByRole('button', { name: 'Show 100 more' }).click();
  assert.equal(await rows.count(), 200);
  const began = Date.now();
  await sectionOf(page).getByLabel('Number, name or hole').fill('H1999');
  await sectionOf(page).getByText('1 finding of 2').waitFor();
  assert.ok(Date.now() - began < 2000, 'a choice among 2000 is not waited for');
  await page.context().close();
});

test('no assessment, a refused list, and a service that is away are said in words', async () => {
  const page = await signedIn(stage, '/blades/SN-0417');
  await sectionOf(page).getByText('It was not judged by a drawing yet').waitFor();
  await page.locator('.blade-top .mark-big', { hasText: 'Not judged yet' }).waitFor();
  await page.goto(`${stage.gateway.url}/blades/SN-0416`);
  await sectionOf(page).getByRole('alert').getByText('of a part that you may not see').waitFor();
  assert.equal(await sectionOf(page).getByText('It was not judged').count(), 0);
  stage.gateway.faults.servicesAway.add('inspection');
  await page.goto(`${stage.gateway.url}/blades/SN-0414`);
  await sectionOf(page).getByRole('alert').getByText('It is asked again every few seconds').waitFor();
  stage.gateway.faults.servicesAway.clear();
  await findingsOf(page).waitFor();
  await page.context().close();
});

test('the keyboard reaches places, choices, and the rows of the table', async () => {
  const page = await signedIn(stage, '/blades/SN-0412');
  await findingsOf(page).waitFor();
  await sectionOf(page).getByRole('button', { name: 'G1' }).focus();
  await page.keyboard.press('Enter');
  await sectionOf(page).getByText('5 findings of 10.').waitFor();
  const reached = new Set<string>();
  for (let i = 0; i < 14; ++i) {
    await page.keyboard.press('Tab');
    reached.add(await page.evaluate(() => document.activeElement?.closest('label')?.firstChild?.textContent?.trim() || document.activeElement?.getAttribute('aria-label') || ''));
  }
  for (const wanted of ['Verdict', 'Place', 'Number, name or hole', 'Order', 'Table: Characteristics', 'Copy as CSV: the characteristics']) assert.ok(reached.has(wanted), `${wanted} not among ${[...reached].join('; ')}`);
  await page.context().close();
});

test('holes show displacement, lean and diameter with U, or why not, and rows their pitch', async () => {
  const page = await signedIn(stage, '/blades/SN-0412');
  const complaints = complaintsOf(page);
  await page.locator('#displacements summary').click();
  const table = page.getByRole('region', { name: 'Table: Displacement, lean and diameter' }), pitch = page.getByRole('region', { name: 'Table: Pitch' });
  assert.equal(await table.locator('tbody tr').count(), 12);
  assert.match(await table.locator('tr', { hasText: 'G1/H1' }).innerText(), /(−?\d+\.\d ± \d+\.\d\s+){2}(−?\d\.\d{3} ± 0\.0\d\d\s+){2}as the hole leans\s+0\.8032 ± 0\.0061\s+pin/);
  assert.match(await table.locator('tr', { hasText: 'G2/H1' }).innerText(), /the part’s Z\s+pin\s+the part’s record states no play of its pins/);
  const missing = await table.locator('tr', { hasText: 'G1/H6' }).innerText();
  assert.equal(missing.match(/not measured/g)?.length, 5);
  assert.doesNotMatch(missing.replace('G1/H6', ''), /\d/);
  assert.equal(await pitch.locator('tbody tr').count(), 10);
  assert.match(await pitch.locator('tr', { hasText: 'G1' }).first().innerText(), /H1\s+H2\s+\d\.\d{4} ± 0\.0052\s+\d\.\d{3}\s+\d\.\d{3} ± 0\.068/);
  assert.match(await pitch.locator('tr', { hasText: 'H6 was not measured' }).innerText(), /H5\s+H6\s+not measured\s+\d\.\d{3}\s+not measured/);
  await page.getByRole('button', { name: 'G1/H2', exact: true }).click();
  assert.match(await page.locator('[aria-live=polite]').innerText(), /Displaced\s+along .* ± .*µm, across .* ± .*µm.*Leans\s+along .*deg.*Diameter\s+0\.8032 ± 0\.0061\smm/s);
  assert.deepEqual(complaints, []);
  await page.context().close();
});

for (const colorScheme of ['light', 'dark'] as const) {
  test(`axe finds nothing on assessed blades, ${colorScheme}`, async () => {
    const page = await signedIn(stage, '/blades/SN-0414', 'jane', { colorScheme });
    await findingsOf(page).waitFor();
    assert.deepEqual(await axeFindings(page), []);
    await page.goto(`${stage.gateway.url}/blades/SN-0412`);
    await findingsOf(page).waitFor();
    await page.locator('#displacements summary').click();
    assert.deepEqual(await axeFindings(page), []);
    await page.context().close();
  });
}

test('nothing is wider than a narrow screen but what scrolls by itself', async () => {
  const page = await signedIn(stage, '/blades/SN-0412', 'jane', { width: 400, height: 800 });
  await findingsOf(page).waitFor();
  await page.locator('#displacements summary').click();
  assert.ok(await page.evaluate(() => document.querySelector('#assessment')!.scrollWidth <= document.querySelector('#assessment')!.clientWidth + 1));
  assert.ok(await page.evaluate(() => document.querySelector('#displacements')!.scrollWidth <= document.querySelector('#displacements')!.clientWidth + 1));
  await page.context().close();
});
