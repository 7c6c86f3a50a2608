// A browser on a page of the made-up plant, for tests: signed in, with what the page complained of.
import { join } from 'node:path';
import axe from 'axe-core';
import { chromium, type Browser, type Page } from 'playwright-core';
import { startGateway, type Gateway } from './fixtures/gateway';
import { makePlant, type Plant } from './fixtures/plant';

export type Stage = { gateway: Gateway; plant: Plant; browser: Browser; stop: () => Promise<void> };

export async function setStage(machineCount = 200): Promise<Stage> {
  const plant = makePlant(machineCount);
  const gateway = await startGateway(join(process.cwd(), 'dist'), plant.routes);
  const browser = await chromium.launch({
    executablePath: process.env['CHROMIUM'] ?? '/usr/bin/chromium', args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
  });
  return { gateway, plant, browser, stop: async () => { await browser.close(); await gateway.stop(); } };
}

// What a page must not do: throw, or write an error. That nobody was signed in at first is none.
export function complaintsOf(page: Page): string[] {
  const complaints: string[] = [];
  page.on('pageerror', (error) => complaints.push(error.message));
  page.on('console', (message) => { if (message.type() === 'error' && !message.location().url.endsWith('/session')) complaints.push(message.text()); });
  return complaints;
}

export async function signedIn(stage: Stage, path: string, user: 'jane' | 'mes' = 'jane', options: { colorScheme?: 'dark' | 'light'; width?: number; height?: number } = {}): Promise<Page> {
  const context = await stage.browser.newContext({ viewport: { width: options.width ?? 1366, height: options.height ?? 768 }, colorScheme: options.colorScheme ?? 'light' });
  const page = await context.newPage();
  await page.goto(stage.gateway.url + path);
  await signIn(page, user);
  return page;
}

export async function signIn(page: Page, user: 'jane' | 'mes'): Promise<void> {
  await page.fill('input[name=name]', user);
  await page.fill('input[name=password]', user === 'jane' ? 'six points hold' : 'reads only');
  await page.click('button[type=submit]');
  await page.waitForSelector('header.top');
}

// What axe finds against WCAG 2.1 AA, as "rule: element". The policy of content lets no script in, so it is evaluated.
export async function axeFindings(page: Page): Promise<string[]> {
  await page.evaluate(axe.source);
  return page.evaluate(async () => {
    const found = await (window as unknown as { axe: { run: (options: object) => Promise<{ violations: { id: string; nodes: { html: string }[] }[] }> } }).axe.run({ resultTypes: ['violations'] });
    return found.violations.flatMap(({ id, nodes }) => nodes.slice(0, 4).map(({ html }) => `${id}: ${html.slice(0, 160)}`));
  });
}
