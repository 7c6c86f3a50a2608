"""100 results of simulated blades, replayed by the plant that made them, and by services on other numbers of threads, of narrower vectors
and with the C library's functions for lesser processors."""
import json
import os
import shutil
import subprocess
import tempfile
import time

from processes import BIN, free_ports

AREAS = ('registration', 'correction', 'inspection')
WAYS = (
    ('as they were made', [], {}, True),
    ('on one thread', ['--threads', '1'], {}, True),
    ('on five threads, vectors as AVX2 has them', ['--threads', '5'],
     {'SIXPOINT_LANES': '8', 'GLIBC_TUNABLES': 'glibc.cpu.hwcaps=-AVX512F'}, True),
    ('on three threads, neither AVX nor FMA', ['--threads', '3'],
     {'SIXPOINT_LANES': '4', 'GLIBC_TUNABLES': 'glibc.cpu.hwcaps=-AVX512F,-AVX2,-FMA,-AVX'}, False),  # told, no goal: before 2013
)


class WholePlant:
    """By `sixpoint up`; gone at the end."""

    def __init__(self):
        self.folder = tempfile.mkdtemp(prefix='sixpoint-bench-')
        os.chmod(self.folder, 0o755)
        self.data = f'{self.folder}/plant'
        self.port = next(port for port in free_ports(8) if port < 60000)
        self.own = []
        self.sixpoint('--data', self.data, 'up', '--base-port', str(self.port))
        self.server = ['--server', f'127.0.0.1:{self.port}', '--identity', f'{self.data}/certificates/local']

    def sixpoint(self, *words, may_be=(0,)):
        done = subprocess.run([f'{BIN}/sixpoint', *words], capture_output=True, text=True)
        if done.returncode not in may_be:
            raise SystemExit(' '.join(words) + '\n' + done.stdout + done.stderr)
        return done.stdout

    def ask(self, *words, may_be=(0,)):
        return json.loads(self.sixpoint(*words, '--json', *self.server, may_be=may_be))

    def names(self):
        return [one['name'] for area in AREAS for one in self.ask(area, 'list')]

    def start_services(self, flags, environment):
        """Those that compute, in place of the supervisor's or of those started before."""
        for area in AREAS:
            if not self.own or len(self.own) < len(AREAS):
                pid = int(subprocess.check_output(['pgrep', '-of', f'{BIN}/sixpoint-{area} .*{self.data}']))
                owner = os.stat(f'/proc/{pid}')
                words = open(f'/proc/{pid}/cmdline').read().split('\0')[:-1]
                subprocess.run(['supervisorctl', '-c', f'{self.data}/supervisord.conf', 'stop', area], check=True,
                               stdout=subprocess.DEVNULL, user=owner.st_uid, group=owner.st_gid, extra_groups=[])
                self.own.append({'words': words, 'owner': owner, 'process': None})
        for service in self.own:
            if service['process']:
                service['process'].terminate()
                service['process'].wait()
            owner = service['owner']
            service['process'] = subprocess.Popen(
                [*service['words'], *flags], env={**os.environ, **environment}, cwd='/', stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL, user=owner.st_uid, group=owner.st_gid, extra_groups=[])
        for area in AREAS:
            for _ in range(200):
                if subprocess.run([f'{BIN}/sixpoint', area, 'list', '--limit', '1', *self.server],
                                  capture_output=True).returncode == 0:
                    break
                time.sleep(0.1)

    def down(self):
        for service in self.own:
            if service['process']:
                service['process'].kill()
                service['process'].wait()
        subprocess.run([f'{BIN}/sixpoint', '--data', self.data, 'down'], capture_output=True)
        shutil.rmtree(self.folder, ignore_errors=True)


def replay_same_bits(count):
    """[(way, results, of the same bits, whether it is a goal)]"""
    plant = WholePlant()
    try:
        names = []
        for seed in range(1, 200):
            shape = ['--casting-mm', '0.3'] if seed % 2 else []
            subprocess.run([f'{BIN}/sixpoint-simulator', 'demo', *plant.server, '--machines', '1', '--seed', str(seed),
                            '--airfoil-pitch-mm', '0.4', '--pins-pitch-mm', '0.15', *shape], capture_output=True)
            names = plant.names()
            if len(names) >= count:
                break
        names = sorted(names)[:count]
        told = []
        for words, flags, environment, is_goal in WAYS:
            if flags or environment:
                plant.start_services(flags, environment)
            answers = [plant.ask('replay', name, may_be=(0, 4)) for name in names]
            same = [one for one in answers if one['outcome'] == 'REPLAY_OUTCOME_SAME_BITS']
            for one in answers:
                if one not in same:
                    print(json.dumps(one)[:2000], flush=True)
            told.append((words, len(answers), len(same), is_goal))
        return told
    finally:
        plant.down()
