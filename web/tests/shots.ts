// Pictures of pages, for a person to judge: URL... after the folder.
import { join } from 'node:path';
import { chromium } from 'playwright-core';
import { startGateway } from './fixtures/gateway';
import { makePlant } from './fixtures/plant';

const [folder, scheme, size, ...paths] = process.argv.slice(2);
const [width, height] = size!.split('x').map(Number);
const gateway = await startGateway(join(process.cwd(), 'dist'), makePlant(200).routes);
const browser = await chromium.launch({ executablePath: process.env['CHROMIUM'] ?? '/usr/bin/chromium', args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'] });
const page = await browser.newPage({ viewport: { width: width!, height: height! }, colorScheme: scheme as 'dark' });
page.on('console', (message) => { if (message.type() === 'error') console.log('console:', message.text()); });
page.on('pageerror', (error) => console.log('page error:', error.message));
await page.goto(gateway.url);
await page.screenshot({ path: join(folder!, `sign_in_${scheme}.png`) });
await page.fill('input[name=name]', 'jane');
await page.fill('input[name=password]', 'six points hold');
await page.click('button[type=submit]');
for (const path of paths) {
  await page.goto(gateway.url + path);
  await page.waitForTimeout(Number(process.env['WAIT_MS'] ?? 2500));
  await page.screenshot({ path: join(folder!, `${path.replaceAll(/[^a-z0-9]+/gi, '_')}_${scheme}_${size}.png`), fullPage: process.env['FULL'] === '1' });
}
await browser.close();
await gateway.stop();
