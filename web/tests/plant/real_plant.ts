// A plant as `sixpoint up` starts it, in a folder of the test's own: a simulated machine has made one blade on it, and a program of that blade waits
// for a person, since its holes are cut already. A killed process comes back as in a real plant: its supervisor starts it again.
import { execFile } from 'node:child_process';
import { chmodSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { promisify } from 'node:util';

const kSource = process.env['SIXPOINT_SOURCE_DIR'] ?? join(process.cwd(), '..');
const kBin = process.env['SIXPOINT_BIN_DIR'] ?? join(kSource, 'build/release/bin');
const kMachine = 'machines/sim-1', kOtherMachine = 'machines/sarix-1';
export const kPeople = { jane: 'six points hold a blade', mes: 'reads, and no more' } as const;
export const example = (name: string): string => join(kSource, 'docs/examples', name);

const kWaits = 4;  // of `sixpoint`: recorded, and not in force before a person looked at it
const execute = promisify(execFile);

async function run(program: string, words: string[], more: { env?: NodeJS.ProcessEnv; input?: string } = {}): Promise<string> {
  const going = execute(program, words, { timeout: 120_000, maxBuffer: 64 << 20, env: { ...process.env, ...more.env } });
  going.child.stdin!.on('error', () => undefined);  // one that reads nothing may be gone first
  going.child.stdin!.end(more.input);
  try {
    return (await going).stdout;
  } catch (error) {
    const { code, stdout, stderr } = error as { code?: number; stdout?: string; stderr?: string };
    if (code === kWaits && stdout) return stdout;
    throw new Error(`${program} ${words.join(' ')}:\n${(stdout ?? '').slice(-2000)}${stderr ?? String(error)}`);
  }
}

const isFree = (port: number) => new Promise<boolean>((resolve) => {
  const server = createServer().once('error', () => resolve(false));
  server.listen(port, '127.0.0.1', () => server.close(() => resolve(true)));
});

// Of six services, the seven ports at which the plant is seen, and the gateway.
async function freeBase(): Promise<number> {
  for (let i = 0; i < 100; ++i) {
    const base = 20_000 + ((process.pid + i) % 100) * 100;
    const ports = [...Array(6).keys(), ...[...Array(7).keys()].map((n) => 20 + n), 80].map((n) => base + n);
    if ((await Promise.all(ports.map(isFree))).every(Boolean)) return base;
  }
  throw new Error('no free ports');
}

type Group = { group: string; a_nominal_deg: number; b_nominal_deg: number; holes: { hole: string; nominal_start_mm: { x_mm: number; y_mm: number; z_mm: number } }[] };

// The nominal program of one group, as its machine was given it: docs/nc_template.md.
const programOf = ({ group, a_nominal_deg, b_nominal_deg, holes }: Group) => ['%', 'G21 G90', ...holes.flatMap(({ hole, nominal_start_mm: at }) => [
  'G0 Z-73.0', `A${a_nominal_deg.toFixed(6)} B${b_nominal_deg.toFixed(6)} X${at.x_mm.toFixed(6)} Y${at.y_mm.toFixed(6)} (SIXPOINT ${group}/${hole})`, `G1 Z${at.z_mm.toFixed(6)} F200 (SIXPOINT ${group}/${hole})`,
]), 'G0 Z-73.0', 'M30', '%', ''].join('\n');

// What the tests name of it.
export type Made = { blade: string; clamping: string; sensorCalibration: string; draftCalibration: string; waiting: string };

export class RealPlant {
  private constructor(private readonly folder: string, private readonly base: number) {}
  made!: Made;
  private scanCount = 0;

  static async start(): Promise<RealPlant> {
    const folder = mkdtempSync(join(tmpdir(), 'sixpoint-page-'));
    chmodSync(folder, 0o755);  // the services run as another user
    const plant = new RealPlant(folder, await freeBase());
    try {
      await plant.sixpoint('up', '--base-port', String(plant.base));
      plant.made = await plant.fill();
    } catch (error) {
      await plant.stop();
      throw error;
    }
    return plant;
  }

  async stop(): Promise<void> {
    await this.sixpoint('down').catch((error: unknown) => console.error(error));
    rmSync(this.folder, { recursive: true, force: true });
  }

  get url(): string { return `http://127.0.0.1:${this.base + 80}`; }
  private get data(): string { return join(this.folder, 'plant'); }
  private get server(): string { return `127.0.0.1:${this.base}`; }
  private identity = (): string => join(this.data, 'certificates/local');

  private sixpoint(...words: string[]): Promise<string> {
    return run(join(kBin, 'sixpoint'), ['--data', this.data, '--server', this.server, ...words], { env: { SIXPOINT_IDENTITY: this.identity() } });
  }
  async asked<T>(...words: string[]): Promise<T> { return JSON.parse(await this.sixpoint(...words, '--json')) as T; }

  private async fill(): Promise<Made> {
    await run(join(kBin, 'sixpoint-simulator'), ['demo', '--server', this.server, '--identity', this.identity(), '--machines', '1', '--airfoil-pitch-mm', '0.4', '--pins-pitch-mm', '0.15']);
    for (const [name, password] of Object.entries(kPeople)) {
      const roles = name === 'jane' ? ['--role', 'engineer', '--role', 'quality'] : ['--role', 'mes-reader'];
      await run(join(kBin, 'sixpoint'), ['--data', this.data, '--server', this.server, 'accounts', 'create', name, ...roles, '--password-file', '-'], { env: { SIXPOINT_IDENTITY: this.identity() }, input: `${password}\n` });
    }
    await this.sixpoint('certs', 'issue', kMachine, '--folder', join(this.folder, 'sim-1'));
    const registrations = await this.asked<{ name: string; blade: string; clamping: string; method: string; sensor_calibration: string }[]>('registration', 'list');
    const registration = registrations.find((one) => one.clamping !== '' && one.method === 'METHOD_SIX_POINT')!;
    const [cut] = await this.asked<{ name: string }[]>('correction', 'list', '--machine', kMachine);
    const { groups: [group] } = await this.asked<{ groups: Group[] }>('correction', 'show', cut!.name);
    const template = join(this.folder, 'template.nc');
    writeFileSync(template, programOf(group!));
    const correction = await this.asked<{ name: string; state: string }>('correct', '--registration', registration.name, '--template', template, '--groups', group!.group);
    if (correction.state !== 'CORRECTION_STATE_DRAFT') throw new Error(`the second program of a blade does not wait: ${correction.state}`);
    await this.sixpoint('machine', 'add', example('machine.yaml'));
    await this.sixpoint('part', 'add', example('part.yaml'));
    const draft = await this.asked<{ name: string }>('calibrate', 'rotation', '--machine', kOtherMachine, '--poses', example('sphere_poses.yaml'), '--draft');
    return { blade: registration.blade.replace('blades/', ''), clamping: registration.clamping, sensorCalibration: registration.sensor_calibration, draftCalibration: draft.name, waiting: correction.name };
  }

  private async machineToken(): Promise<string> { return (await this.sixpoint('certs', 'token', '--identity', join(this.folder, 'sim-1'))).trim(); }

  // As the machine's control sends one, by plain HTTP.
  async sendScan(): Promise<void> {
    const id = `page-${++this.scanCount}`, header = join(this.folder, `${id}.json`), points = join(this.folder, `${id}.f64`);
    writeFileSync(header, JSON.stringify({
      scanId: id, machine: kMachine, subject: `blades/${this.made.blade}`, kind: 'SCAN_KIND_LOCAL', v0Mm: {}, profilePitchMm: 0.1, columnsPerProfile: 640, encoding: 'ENCODING_XYZ_F64',
    }));
    writeFileSync(points, Float64Array.from({ length: 3 * 600 }, (_, i) => [0.1 * Math.floor(i / 900), -10 + ((i / 3) % 300) / 15, 0.001][i % 3]!));
    await run('/usr/bin/python3', [example('put_scan.py'), this.url, header, points], { env: { SIXPOINT_TOKEN: await this.machineToken() } });
  }

  // As the machine's control asks for its program.
  async fetchProgram(correction: string): Promise<Response> {
    const { blade, clamping } = this.made, query = new URLSearchParams({ machine: kMachine, blade: `blades/${blade}`, clamping });
    return fetch(`${this.url}/programs/${correction.replace('corrections/', '')}?${query}`, { headers: { authorization: `Bearer ${await this.machineToken()}` } });
  }

  // SIGKILL, and again as often as it comes back, until what is waited for is seen: it may be back before anybody asked it something.
  async killUntil(program: string, seen: Promise<unknown>): Promise<void> {
    let isSeen = false;
    const done = seen.finally(() => { isSeen = true; });
    done.catch(() => undefined);
    while (!isSeen) {
      const pid = Number((await run('supervisorctl', ['-c', join(this.data, 'supervisord.conf'), 'pid', program]).catch(() => '0')).trim());
      if (pid > 0) try { process.kill(pid, 'SIGKILL'); } catch { /* gone already */ }
      await new Promise((resolve) => setTimeout(resolve, 100));
    }
    await done;
  }
}
