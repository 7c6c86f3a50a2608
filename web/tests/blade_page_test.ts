import assert from 'node:assert/strict';
import { after, afterEach, before, test } from 'node:test';
import type { Page } from 'playwright-core';
import { axeFindings, complaintsOf, setStage, signedIn, type Stage } from './browser';

let stage: Stage;
before(async () => { stage = await setStage(12); });
after(async () => { await stage.stop(); });
afterEach(() => { stage.gateway.faults.servicesAway.clear(); });  // of a test that failed

const drawn = (page: Page, least: number) => page.waitForFunction((n) => Number(document.querySelector<HTMLCanvasElement>('.view3d canvas')?.dataset['drawn'] ?? 0) >= n, least, { timeout: 60_000 });

// How many pixels of the canvas are red, blue, grey (of the scale), by a picture of it.
async function coloursOf(page: Page, of = '.view3d canvas'): Promise<{ red: number; blue: number; grey: number; dark: number }> {
  const png = (await page.locator(of).screenshot()).toString('base64');
  return page.evaluate(async (data) => {
    const image = new Image();
    image.src = `data:image/png;base64,${data}`;
    await image.decode();
    const canvas = document.createElement('canvas');
    canvas.width = image.width; canvas.height = image.height;
    const pen = canvas.getContext('2d')!;
    pen.drawImage(image, 0, 0);
    const pixels = pen.getImageData(0, 0, image.width, image.height).data, sums = { red: 0, blue: 0, grey: 0, dark: 0 };
    for (let i = 0; i < pixels.length; i += 4) {
      const [r, g, b] = [pixels[i]!, pixels[i + 1]!, pixels[i + 2]!];
      if (r > g + 90 && r > 150) sums.red += 1;
      else if (b > r + 90 && b > 130) sums.blue += 1;
      else if (Math.abs(r - 214) < 6 && Math.abs(g - 218) < 6 && Math.abs(b - 214) < 6) sums.grey += 1;
      else if (Math.abs(r - 66) < 6 && Math.abs(g - 74) < 6 && Math.abs(b - 82) < 6) sums.dark += 1;
    }
    return sums;
  }, png);
}

test('the verdict is first, and every hole has its value, U and limit', async () => {
  const page = await signedIn(stage, '/blades/SN-0412');
  const complaints = complaintsOf(page);
  await page.locator('.mark-big', { hasText: 'Not conform' }).waitFor();
  assert.match(await page.locator('.blade-top').innerText(), /10 of 12 holes conform, 1 not measured\. Worst position: G2\/H3 with 0\.0412 ± 0\.00\d\d\s?mm of at most 0\.030/);
  const table = page.getByRole('region', { name: 'Table: Holes as cut' });
  assert.equal(await table.locator('tbody tr').count(), 12);
  assert.match(await table.locator('tr', { hasText: 'G1/H6' }).innerText(), /Not measured.*not measured.*41 points of a pin/s);
  assert.match(await table.locator('tr', { hasText: 'G2/H3' }).innerText(), /0\.0412 ± 0\.00\d\d/);
  await drawn(page, 50_000);
  assert.deepEqual(complaints, []);
  await page.context().close();
});

test('a blade that has no repair and no pass stays drawn while their service is away, and goes on by itself', async () => {
  const page = await signedIn(stage, '/blades/SN-0417');
  const complaints = complaintsOf(page);
  await page.getByText('It was not judged by a drawing yet').waitFor();
  await page.getByText('Live', { exact: true }).waitFor();
  await page.waitForTimeout(1000);  // its lists are there, two of them empty
  stage.gateway.faults.servicesAway.add('correction');
  for (const kind of ['repair', 'machining_pass']) stage.plant.journal.put({ kind, name: `${kind}s/1`, blade: 'blades/SN-0417' });
  const notice = page.getByRole('status').locator('.notice');
  await notice.filter({ hasText: /The correction service is away for [1-9]\d*\s+s/ }).waitFor();  // what time draws again still is
  assert.equal(await page.getByRole('heading', { name: 'Repair' }).count(), 0);
  stage.gateway.faults.servicesAway.clear();
  await notice.waitFor({ state: 'detached', timeout: 15_000 });
  assert.deepEqual(complaints.filter((text) => !text.includes('503')), []);
  await page.context().close();
});

// By the page's own drawing, as this browser has no graphics processor; and by WebGL, as if it had one.
for (const by of ['the page', 'WebGL']) test(`the blade stands in its colours by ${by}: red where it stands out, blue where it lacks, and the scale moves them`, async () => {
  const page = await signedIn(stage, '/');
  if (by === 'WebGL') await page.addInitScript(() => {
    const ask = WebGL2RenderingContext.prototype.getParameter;
    WebGL2RenderingContext.prototype.getParameter = function (name: number) { return name === 0x9246 || name === this.RENDERER ? 'A graphics processor' : ask.call(this, name) as unknown; };
  });
  await page.goto(`${stage.gateway.url}/blades/SN-0412`);
  await drawn(page, 50_000);
  assert.equal(await page.locator('.view3d canvas').getAttribute('data-points-by'), by);
  await page.waitForTimeout(600);
  const said = await page.locator('.scale-box').innerText();
  // Of the deviation that the fixture put in: rms 7.5 um with its noise, as it was drawn from the same formula.
  const rms = Number(/rms ([\d.]+)/.exec(said)![1]);
  assert.ok(Math.abs(rms - 7.5) < 0.6, `rms ${rms} um, about 7.5 wanted`);
  const colours = await coloursOf(page);
  assert.ok(colours.red > 1500 && colours.blue > 1500 && colours.grey > 3000, JSON.stringify(colours));
  await page.getByLabel('Scale').fill('100');
  await page.waitForTimeout(600);
  const wide = await coloursOf(page);
  assert.ok(wide.red < colours.red / 4, `red ${wide.red} at 1 mm, ${colours.red} before`);
  await page.context().close();
});

test('every point is fetched as stored blocks and decoded', async () => {
  const page = await signedIn(stage, '/blades/SN-0412');
  const complaints = complaintsOf(page);
  await drawn(page, 50_000);
  await page.getByRole('button', { name: 'Every point' }).click();
  await drawn(page, 2 * 120_000);
  const said = await page.locator('.scale-box').innerText();
  const rms = Number(/rms ([\d.]+)/.exec(said)![1]);
  assert.ok(!said.includes('thinned') && Math.abs(rms - 7.5) < 0.6, said);
  assert.deepEqual(complaints, []);
  await page.context().close();
});

test('a hole is picked by its name, and its budget adds up to its uncertainty', async () => {
  const page = await signedIn(stage, '/blades/SN-0412');
  await page.getByRole('button', { name: 'G1/H2' }).click();
  const panel = page.locator('[aria-live=polite]');
  await panel.getByText('Hole G1/H2').waitFor();
  const shares = await panel.locator('meter').evaluateAll((meters) => meters.map((meter) => (meter as HTMLMeterElement).value));
  assert.ok(shares.length >= 6);
  assert.ok(Math.abs(shares.slice(0, 6).reduce((a, b) => a + b, 0) - 1) < 1e-6, 'the shares of the first budget are one');
  await page.context().close();
});

test('the view turns by keys, and a picture of it downloads as PNG', async () => {
  const page = await signedIn(stage, '/blades/SN-0412');
  await drawn(page, 50_000);
  await page.waitForTimeout(500);
  const before_ = await page.locator('.view3d canvas').screenshot();
  await page.locator('.view3d canvas').focus();
  for (let i = 0; i < 5; ++i) await page.keyboard.press('ArrowLeft');
  await page.waitForTimeout(500);
  assert.notDeepEqual(await page.locator('.view3d canvas').screenshot(), before_);
  const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name: 'Download PNG', exact: true }).click()]);
  assert.equal(download.suggestedFilename(), 'blades_SN-0412.png');
  await page.context().close();
});

test('its sections stand beside the CAD: a plot with its gap, values with U, and what was not seen in words', async () => {
  const page = await signedIn(stage, '/blades/SN-0412');
  const complaints = complaintsOf(page);
  const sections = page.locator('#sections');
  await sections.locator('.outline-measured').waitFor();
  // One gap parts the outline once: one piece, open. The nominal is closed.
  assert.equal(await sections.locator('.outline-measured').count(), 1);
  assert.match((await sections.locator('.outline-nominal').getAttribute('d'))!, /Z$/);
  assert.doesNotMatch((await sections.locator('.outline-measured').getAttribute('d'))!, /Z/);
  // The bump of 20 um is drawn 30 times as large: 0.6 mm above the ellipse's 2 mm.
  const top = async () => -Math.min(...(await sections.locator('.outline-measured').getAttribute('d'))!.split(/[ML]/).filter(Boolean).map((point) => Number(point.split(' ')[1])));
  assert.ok(Math.abs((await top()) - 2.6) < 0.005, String(await top()));
  await sections.locator('select').filter({ hasText: 'as they are' }).selectOption('as they are');
  assert.ok(Math.abs((await top()) - 2.02) < 0.001, String(await top()));
  const table = sections.getByRole('region', { name: 'Table: Section root' });
  assert.match(await table.locator('tr', { hasText: 'chord nose tail' }).innerText(), /mm\s+30\.0000\s+30\.0123\s+0\.0123\s+0\.0041/);
  assert.match(await table.locator('tr', { hasText: 'trailing radius' }).innerText(), /not measured.*square/s);
  assert.deepEqual(await axeFindings(page), []);
  await sections.locator('select').filter({ hasText: 'not measured' }).selectOption({ label: 'tip (not measured)' });
  await sections.getByText('Not measured: no point was seen there').waitFor();
  assert.equal(await sections.locator('.outline-measured').count(), 0);
  await sections.getByLabel('Heights, mm').fill('15, x');
  await sections.getByRole('button', { name: 'Measure' }).click();
  await sections.getByText('Heights are numbers').waitFor();
  await sections.getByLabel('Heights, mm').fill('15, 22.5');
  await sections.getByRole('button', { name: 'Measure' }).click();
  await sections.getByRole('region', { name: 'Table: Section z 15' }).waitFor();
  assert.deepEqual(complaints, []);
  await page.context().close();
});

test('the surface stands against its CAD: verdicts, regions, and tiles that are dark where nothing was seen', async () => {
  const page = await signedIn(stage, '/blades/SN-0412');
  const complaints = complaintsOf(page);
  const section = page.locator('#deviation');
  const profiles = section.getByRole('region', { name: 'Table: Profile tolerances' });
  assert.match(await profiles.locator('tr', { hasText: 'form and location' }).innerText(), /17\s+Not conform.*14\.2 in 1 area.*±/s);
  assert.match(await section.getByRole('region', { name: 'Table: Deviation by region' }).locator('tr', { hasText: 'tip' }).innerText(), /0\s?%\s+not seen/);
  await section.getByRole('button', { name: 'Show the map in 3D' }).click();
  await page.waitForFunction(() => document.querySelector<HTMLCanvasElement>('#deviation canvas')?.dataset['tiles'] === '1800', undefined, { timeout: 60_000 });
  await section.locator('.scale-box').waitFor();
  await section.getByLabel('Scale').fill('45');
  await page.waitForTimeout(600);
  const colours = await coloursOf(page, '#deviation .view3d canvas');
  assert.ok(colours.red > 150 && colours.blue > 50 && colours.grey > 3000 && colours.dark > 2000, JSON.stringify(colours));
  assert.deepEqual(await axeFindings(page), []);
  await section.getByRole('button', { name: 'Compare as cut' }).click();
  await section.getByRole('option').nth(1).waitFor({ state: 'attached' });
  assert.equal(await section.getByRole('option').count(), 2);
  assert.deepEqual(complaints, []);
  await page.context().close();
});

test('the shape in the blank: its regions, its stock in colours, and other limits tried until there is none', async () => {
  const page = await signedIn(stage, '/blades/SN-0412');
  const complaints = complaintsOf(page);
  const section = page.locator('#reconstruction');
  const regions = section.getByRole('region', { name: 'Table: Shape by region' });
  assert.match(await regions.locator('tr', { hasText: 'leading edge' }).innerText(), /machined.*0\.020.*97\.0\s?%.*31\.4.*0\.3.*83\s?%/s);
  assert.match(await section.innerText(), /A shape was found.*step 0\.84/s);
  await section.getByRole('button', { name: 'Show the stock in 3D' }).click();
  await page.waitForFunction(() => document.querySelector<HTMLCanvasElement>('#reconstruction canvas')?.dataset['tiles'] === '800', undefined, { timeout: 60_000 });
  await section.locator('.scale-box').waitFor();
  await page.waitForTimeout(600);
  const colours = await coloursOf(page, '#reconstruction .view3d canvas');
  assert.ok(colours.red > 100 && colours.grey > 100, JSON.stringify(colours));
  await section.getByText('Try other limits').click();
  const edge = section.getByRole('group', { name: 'leading edge' });
  await edge.getByLabel('Lower, mm', { exact: true }).fill('-0.03');
  assert.deepEqual(await axeFindings(page), []);
  await section.getByRole('button', { name: 'Try these limits' }).click();
  await section.getByText('Cannot be made from this blank', { exact: true }).waitFor();
  assert.match(await section.innerText(), /with other limits than the part’s: a try.*at least 89\.0.*µm more.*alone no cure/s);
  assert.equal(await section.getByRole('option').count(), 2);
  assert.deepEqual(complaints, []);
  await page.context().close();
});

test('passes over the shape: what each left by region and in colours, and what is to be done', async () => {
  const page = await signedIn(stage, '/blades/SN-0412');
  const complaints = complaintsOf(page);
  const section = page.locator('#passes');
  assert.match(await section.innerText(), /Done after pass 2/);
  await section.getByRole('combobox').selectOption('1');
  assert.match(await section.innerText(), /Another pass after pass 1.*stands 42\.0 um above its shape/s);
  assert.match(await section.getByRole('region', { name: 'Table: What the pass left by region' }).locator('tr', { hasText: 'leading edge' }).innerText(), /97\.0\s?%.*31\.2.*42\.0.*51\.0.*12\.0.*4\.2.*21/s);
  await section.getByRole('button', { name: 'Show what it left in 3D' }).click();
  await page.waitForFunction(() => document.querySelector<HTMLCanvasElement>('#passes canvas')?.dataset['tiles'] === '800', undefined, { timeout: 60_000 });
  await section.locator('.scale-box').waitFor();
  await page.waitForTimeout(600);
  const colours = await coloursOf(page, '#passes .view3d canvas');
  assert.ok(colours.red > 100 && colours.grey > 100, JSON.stringify(colours));
  assert.deepEqual(complaints, []);
  await page.context().close();
});

test('the repair: heights with their uncertainty, what the path leaves in colours, and the ball on its way', async () => {
  const page = await signedIn(stage, '/blades/SN-0412');
  const complaints = complaintsOf(page);
  const section = page.locator('#repair');
  const heights = section.getByRole('region', { name: 'Table: Repair by height' });
  assert.match(await heights.locator('tr', { hasText: '3.00' }).first().innerText(), /left out.*the trailing end was not seen/s);
  assert.match(await heights.locator('tr', { hasText: '19.00' }).innerText(), /target.*18\.0.*30\.0.*5\.2.*0\.0/s);
  assert.match(await section.innerText(), /Gaussian processes.*stands out by 1\.212.*0\.00.*µm cut below the line/s);
  await section.getByRole('button', { name: 'Show what is left in 3D' }).click();
  await page.waitForFunction(() => document.querySelector<HTMLCanvasElement>('#repair canvas')?.dataset['tiles'] === '480', undefined, { timeout: 60_000 });
  assert.equal(await section.locator('canvas').first().getAttribute('data-laps'), '8');
  await section.locator('.scale-box').waitFor();
  assert.deepEqual(await axeFindings(page), []);
  await section.getByRole('button', { name: 'Show U in 3D' }).click();
  await page.waitForFunction(() => document.querySelector<HTMLCanvasElement>('#repair canvas')?.dataset['tiles'] === '480', undefined, { timeout: 60_000 });
  assert.deepEqual(complaints, []);
  await page.context().close();
});

test('mes-reader sees no buttons that change something', async () => {
  const page = await signedIn(stage, '/blades/SN-0413', 'mes');
  await page.getByText('This program waits for a person').waitFor();
  assert.equal(await page.getByRole('button', { name: /Release|Refuse/ }).count(), 0);
  await page.getByText('An engineer or quality decides').waitFor();
  await page.context().close();
});

test('a person releases a program, with a reason, and the page says so', async () => {
  const page = await signedIn(stage, '/blades/SN-0413');
  await page.getByRole('button', { name: 'Release…' }).click();
  await page.getByRole('button', { name: 'Release', exact: true }).click();
  assert.equal(await page.getByRole('dialog').count(), 1, 'without a reason nothing is sent');
  await page.getByLabel('Why').fill('The casting is 2.3 mm off, seen and measured.');
  await page.getByRole('button', { name: 'Release', exact: true }).click();
  await page.getByText('This program waits for a person').waitFor({ state: 'detached' });
  await page.locator('.blade-top').getByText('Released').waitFor();
  await page.context().close();
});

test('a blade that is not recorded is said so, and search finds by prefix and verdict', async () => {
  const page = await signedIn(stage, '/blades/SN-9999');
  await page.getByText('Not found').waitFor();
  await page.goto(`${stage.gateway.url}/blades?serial=SN-04&verdict=NOT_CONFORM`);
  await page.getByRole('link', { name: 'SN-0412' }).click();
  await page.locator('.mark-big', { hasText: 'Not conform' }).waitFor();
  await page.context().close();
});

test('the report prints to one page', async () => {
  const page = await signedIn(stage, '/blades/SN-0412');
  await drawn(page, 50_000);
  // What is printed has to be there when the event returns: a browser's print waits for nothing.
  const inks = await page.evaluate(() => {
    window.dispatchEvent(new Event('beforeprint'));
    const paper = document.querySelector<HTMLCanvasElement>('canvas.view-printed')!;
    const pixels = paper.getContext('2d')!.getImageData(0, 0, paper.width, paper.height).data;
    let red = 0, drawn = 0;
    for (let i = 0; i < pixels.length; i += 4) { if (pixels[i + 3]! > 0) drawn += 1; if (pixels[i]! > pixels[i + 1]! + 90) red += 1; }
    return { red, drawn };
  });
  assert.ok(inks.drawn > 20_000 && inks.red > 1500, JSON.stringify(inks));
  const pdf = (await page.pdf({ preferCSSPageSize: true, printBackground: true })).toString('latin1');
  assert.equal([...pdf.matchAll(/\/Type \/Page\b/g)].length, 1);
  assert.match(pdf, /\/Subtype \/Image/);
  await page.context().close();
});

for (const colorScheme of ['light', 'dark'] as const) {
  test(`axe finds nothing on a blade, one that waits, and the search, ${colorScheme}`, async () => {
    const page = await signedIn(stage, '/blades/SN-0412', 'jane', { colorScheme });
    await drawn(page, 50_000);
    assert.deepEqual(await axeFindings(page), []);
    for (const path of ['/blades/SN-0413', '/blades']) {
      await page.goto(stage.gateway.url + path);
      await page.locator('table').first().waitFor();
      assert.deepEqual(await axeFindings(page), [], path);
    }
    await page.context().close();
  });
}

test('a start\'s budget is checked by draws: U, its interval and each source beside the first order, and who may not ask sees no button', async () => {
  const page = await signedIn(stage, '/blades/SN-0412');
  const complaints = complaintsOf(page);
  const sheet = page.locator('.sheet', { hasText: 'Worst hole' });
  await sheet.locator('summary', { hasText: 'Of its corrected start' }).click();
  await sheet.getByRole('button', { name: 'Check it by draws' }).click();
  const table = sheet.getByRole('region', { name: 'Table: Sources, k = 1' });
  await table.waitFor();
  const said = await sheet.innerText();
  const numbers = /U = (\d+\.\d+)\s?µm by first order; (\d+\.\d+)\s?µm by 10\s?000 draws, (\d+\.\d+) to (\d+\.\d+)\s?µm with 95\s?%\. The drawing allows 30\s?µm/.exec(said);
  assert.ok(numbers, said);
  const [first, drawn, low, high] = numbers.slice(1).map(Number) as [number, number, number, number];
  assert.ok(Math.abs(drawn / first - 1.02) < 0.01 && low < drawn && drawn < high, said);
  assert.ok(await table.locator('tbody tr').count() >= 3);
  assert.match(await table.locator('tbody tr').first().innerText(), /\d\.\d\d\s+\d\.\d\d\s+\d+\s?%/);
  assert.deepEqual(await axeFindings(page), []);
  assert.deepEqual(complaints, []);
  await page.context().close();

  const other = await signedIn(stage, '/blades/SN-0412', 'mes');
  const same = other.locator('.sheet', { hasText: 'Worst hole' });
  await same.locator('summary', { hasText: 'Of its corrected start' }).click();
  await same.locator('.budget li').first().waitFor();
  assert.equal(await same.getByRole('button', { name: 'Check it by draws' }).count(), 0);
  await other.context().close();
});

test('a path of the tool is drawn on the blade and named in its table', async () => {
  const page = await signedIn(stage, '/blades/SN-0412');
  const complaints = complaintsOf(page);
  await page.waitForFunction(() => document.querySelector<HTMLCanvasElement>('.view3d canvas')?.dataset['paths'] === '1', undefined, { timeout: 60_000 });
  assert.match((await page.locator('.view3d canvas').getAttribute('aria-label'))!, /12 holes, 1 path of the tool/);
  const table = page.getByRole('region', { name: 'Table: What changed against the nominal program' });
  assert.match(await table.locator('tr', { hasText: 'F1' }).innerText(), /F1, a path of 9 poses/);
  const blue = async () => page.evaluate(async (data) => {
    const image = new Image();
    image.src = `data:image/png;base64,${data}`;
    await image.decode();
    const canvas = document.createElement('canvas');
    canvas.width = image.width; canvas.height = image.height;
    const pen = canvas.getContext('2d')!;
    pen.drawImage(image, 0, 0);
    const pixels = pen.getImageData(0, 0, image.width, image.height).data;
    let sum = 0;
    for (let i = 0; i < pixels.length; i += 4) if (pixels[i + 2]! > pixels[i]! + 60 && pixels[i + 2]! > 100) sum += 1;
    return sum;
  }, (await page.locator('.view3d canvas').screenshot()).toString('base64'));
  for (const points of ['Before cutting', 'As cut']) await page.getByRole('checkbox', { name: points, exact: true }).uncheck();
  await page.waitForTimeout(400);
  const shown = await blue();
  await page.getByRole('checkbox', { name: 'Holes and paths' }).uncheck();
  await page.waitForTimeout(400);
  assert.ok(shown > 40 + await blue(), `${shown} blue pixels with the path`);
  assert.deepEqual(complaints, []);
  await page.context().close();
});
