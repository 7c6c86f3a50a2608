// Writes .gz and .br beside each file of dist that gains by it, so that the gateway compresses nothing while it serves, and says what
// the first load costs.
import { readdirSync, readFileSync, statSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { brotliCompressSync, constants, gzipSync } from 'node:zlib';

function* filesIn(folder) {
  for (const name of readdirSync(folder)) {
    const path = join(folder, name);
    if (statSync(path).isDirectory()) yield* filesIn(path);
    else yield path;
  }
}

for (const path of [...filesIn('dist')]) {
  if (!/\.(html|js|css|svg|wasm|json)$/.test(path)) continue;
  const bytes = readFileSync(path);
  const gzipped = gzipSync(bytes, { level: 9 });
  if (gzipped.length >= 0.95 * bytes.length) continue;
  writeFileSync(path + '.gz', gzipped);
  writeFileSync(path + '.br', brotliCompressSync(bytes, { params: { [constants.BROTLI_PARAM_QUALITY]: 9 } }));
}
