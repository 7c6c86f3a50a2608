// The page as `bench/run face` measures it, in Debian's Chromium: node bench/face.mjs record|paint|events|cloud|pages --url URL ... Prints one JSON
// object as its last line.
import { createHash } from 'node:crypto';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import axe from 'axe-core';
import { chromium } from 'playwright-core';

const { positionals: [part], values: given } = parseArgs({
  allowPositionals: true,
  options: Object.fromEntries(['url', 'static', 'password', 'out', 'blade', 'rounds'].map((name) => [name, { type: 'string' }])),
});
const kTile = 'li.tile';
const median = (values) => [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];

const browser = await chromium.launch({
  executablePath: process.env['CHROMIUM'] ?? '/usr/bin/chromium', args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
});

async function signedIn() {
  const context = await browser.newContext({ viewport: { width: 1366, height: 768 } });
  const answer = await context.request.post(`${given.url}/session`, { data: { name: 'users/jane', password: given.password } });
  if (!answer.ok()) throw new Error(`sign-in: ${answer.status()} ${await answer.text()}`);
  return context;
}

// As a browser that was never here: its own context, and so its own cache; when the first tile is on the screen, in ms of its own clock.
async function paintOf(url, cookies) {
  const context = await browser.newContext({ viewport: { width: 1366, height: 768 } });
  await context.addCookies(cookies.map(({ name, value }) => ({ name, value, url })));
  await context.addInitScript((tile) => {
    const look = new MutationObserver(() => {
      if (!document.querySelector(tile)) return;
      look.disconnect();
      requestAnimationFrame(() => requestAnimationFrame(() => { window.paintedAt = performance.now(); }));
    });
    look.observe(document, { childList: true, subtree: true });
  }, kTile);
  const page = await context.newPage();
  await page.goto(url);
  const painted = await page.waitForFunction(() => window.paintedAt, undefined, { timeout: 60_000 });
  const ms = await painted.jsonValue();
  await context.close();
  return ms;
}

const parts = {
  // What the plant answers the fleet page once, for a server that answers the same for ever.
  async record() {
    mkdirSync(given.out, { recursive: true });
    const context = await signedIn(), page = await context.newPage(), answers = new Map(), waiting = [];
    let sent = 0;
    page.on('response', (response) => {
      const { pathname } = new URL(response.url()), type = response.headers()['content-type'] ?? '';
      if (/^\/(assets\/|$)/.test(pathname)) {
        waiting.push(response.request().sizes().then((sizes) => { sent += sizes.responseBodySize; }));
      } else if (response.ok() && !type.includes('connect+') && (pathname === '/session' || pathname.startsWith('/sixpoint.'))) {
        waiting.push(response.body().then((body) => answers.set(pathname, { body, type })));
      }
    });
    await page.goto(given.url);
    await page.waitForSelector(kTile);
    await page.waitForTimeout(3000);  // what comes after the first tiles, too
    await Promise.all(waiting);
    const index = [...answers].map(([path, { body, type }], i) => {
      writeFileSync(join(given.out, `${i}.bin`), body);
      return { path, file: `${i}.bin`, type: type.split(';')[0] };
    });
    writeFileSync(join(given.out, 'index.json'), JSON.stringify(index));
    return { page_kb: sent / 1000, answers: index.map(({ path }) => path) };
  },

  async paint() {
    const context = await signedIn(), cookies = await context.cookies(), ours = [], still = [], over = [];
    for (let i = 0; i <= Number(given.rounds); ++i) {
      const one = await paintOf(given.url, cookies), other = await paintOf(given.static, cookies);
      if (i === 0) continue;  // Chromium itself warms up
      ours.push(one);
      still.push(other);
      over.push(one / other);
    }
    return { paint_ms: median(ours), static_ms: median(still), over: median(over) };
  },

  // A machine's scan by plain PUT, and its tile of the fleet page that says so: from before the request that records it, so more than from the
  // commit.
  async events() {
    const context = await signedIn(), page = await context.newPage(), took = [];
    const call = async (path, how, options) => {
      const answer = await context.request[how](`${given.url}${path}`, options);
      if (!answer.ok()) throw new Error(`${path}: ${await answer.text()}`);
      return answer.json();
    };
    const method = (name, data) => call(`/sixpoint.plant.v1.PlantService/${name}`, 'post', { data });
    const { parts: [known] } = await method('ListParts', {});
    await page.goto(given.url);
    await page.waitForSelector(kTile);
    await page.waitForTimeout(3000);
    for (let i = 0; i < Number(given.rounds); ++i) {
      const serial = `FACE-${Date.now()}`, points = new Float64Array(3 * 600);
      for (let k = 0; k < 600; ++k) points.set([0.1 * Math.floor(k / 300), -10 + (k % 300) / 15, 0.001 * i], 3 * k);
      const payload = Buffer.from(points.buffer);
      await method('CreateBlade', { serial, part: known.name, requestId: crypto.randomUUID() });
      await call(`/scans/${serial}`, 'put', { data: {
        machine: 'machines/sim-1', subject: `blades/${serial}`, kind: 'SCAN_KIND_AIRFOIL', v0Mm: { xMm: 0, yMm: 0, zMm: 0 }, profilePitchMm: 0.1,
        columnsPerProfile: 640, encoding: 'ENCODING_XYZ_F64' } });
      await call(`/scans/${serial}/blocks/0?points=600`, 'put', { data: payload, headers: { 'Content-Type': 'application/octet-stream' } });
      const shown = page.evaluate((text) => new Promise((resolve) => {
        const look = () => { if (document.body.textContent.includes(text)) { watch.disconnect(); requestAnimationFrame(() => resolve(Date.now())); } };
        const watch = new MutationObserver(look);
        watch.observe(document.body, { childList: true, subtree: true, characterData: true });
        setTimeout(() => resolve(Infinity), 10_000);
      }), `${serial} scanned`);
      const digest = createHash('sha256').update(createHash('sha256').update(payload).digest()).digest('hex'), asked = Date.now();
      await call(`/scans/${serial}/end`, 'put', { data: { blockCount: 1, pointCount: '600', sha256: digest } });
      took.push((await shown) - asked);
      await page.waitForTimeout(500);
    }
    return { median_ms: median(took), greatest_ms: Math.max(...took) };
  },

  async cloud() {
    const context = await signedIn(), page = await context.newPage();
    await page.goto(`${given.url}/${given.blade}`);
    const canvas = page.locator('.view3d canvas').first();
    await page.getByRole('button', { name: 'Every point' }).click({ timeout: 120_000 });
    await page.waitForFunction(() => Number(document.querySelector('.view3d canvas')?.dataset.drawn) > 2e6, undefined, { timeout: 300_000 });
    await page.waitForTimeout(3000);
    const points = Number(await canvas.getAttribute('data-drawn'));
    const box = await canvas.boundingBox();
    const frames = page.evaluate(() => new Promise((resolve) => {
      const view = document.querySelector('.view3d canvas'), seen = [];
      const watch = new MutationObserver(() => seen.push({ at: performance.now(), points: Number(view.dataset.drawn) }));
      watch.observe(view, { attributes: true, attributeFilter: ['data-drawn'] });
      window.endOfTurning = (at) => {
        // In full: the frame that shows all, and the next one that the compositor has room for.
        const look = () => (seen.some((frame) => frame.at > at && frame.points > 2e6) ? requestAnimationFrame(() => requestAnimationFrame(() => resolve({ seen, at, fullAt: performance.now() }))) : requestAnimationFrame(look));
        look();
      };
    }));
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    const until = Date.now() + 5000;
    for (let i = 0; Date.now() < until; ++i) {
      await page.mouse.move(box.x + box.width / 2 + 150 * Math.sin(i / 20), box.y + box.height / 2 + 60 * Math.cos(i / 20));
      await page.waitForTimeout(10);
    }
    await page.mouse.up();
    await page.evaluate(() => window.endOfTurning(performance.now()));
    const { seen, at, fullAt } = await frames;
    // Not the first second: the turning begins from a drawing in full.
    if (process.env['FACE_DEBUG']) console.error(JSON.stringify({ at, fullAt, seen }));
    const turning = seen.filter((frame) => frame.at > at - 4000 && frame.at <= at);
    const span_s = (turning.at(-1).at - turning[0].at) / 1000;
    return { points, frames_per_s: (turning.length - 1) / span_s, turning_points: median(turning.map((frame) => frame.points)), full_s: (fullAt - at) / 1000 };
  },

  async pages() {
    const context = await signedIn(), complaints = [], seen = new Set();
    let violations = 0, errors = 0;
    const page = await context.newPage();
    let where = '/';
    const complain = (text) => { ++errors; complaints.push(`${where}: ${text}`); };
    page.on('pageerror', (error) => complain(error.message));
    page.on('console', (message) => { if (message.type() === 'error') complain(message.text()); });
    const kinds = () => page.$$eval('a[href^="/"]', (links) => links.map((link) => new URL(link.href).pathname));
    const look = async (path) => {
      // One page of a kind is looked at.
      const kind = path.split('/')[1] + (path.split('/').length > 2 ? '/' : '');
      if (seen.has(kind)) return;
      seen.add(kind);
      where = path;
      await page.goto(given.url + path);
      await page.waitForSelector('main');
      await page.waitForTimeout(4000);
      await page.evaluate(axe.source);
      const found = await page.evaluate(async () => (await window.axe.run({ resultTypes: ['violations'] })).violations.flatMap(({ id, nodes }) => nodes.map(({ html }) => `${id}: ${html.slice(0, 120)}`)));
      violations += found.length;
      complaints.push(...found.map((text) => `${path}: ${text}`));
      for (const next of await kinds()) await look(next);
    };
    await look('/');
    await look(`/${given.blade}`);
    return { pages: seen.size, kinds: [...seen], axe_violations: violations, console_errors: errors, complaints };
  },
};

try {
  console.log(JSON.stringify(await parts[part]()));
} finally {
  await browser.close();
}
