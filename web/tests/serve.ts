// The made-up plant to look at: tests/run serve [port]
import { join } from 'node:path';
import { startGateway } from './fixtures/gateway';
import { makePlant } from './fixtures/plant';

const plant = makePlant(200);
const gateway = await startGateway(join(process.cwd(), 'dist'), plant.routes, Number(process.argv[2] ?? 0));
console.log(gateway.url, '  users/jane  "six points hold"');
const kinds = ['scan', 'registration', 'correction', 'fetch', 'cut', 'inspection'];
setInterval(() => {
  const i = Math.floor(Math.random() * 200);
  plant.journal.put({ kind: kinds[i % kinds.length]!, name: `scans/${i}`, machine: `machines/sarix-${i + 1}`, blade: `blades/SN-${400 + i}` });
}, 2000);
