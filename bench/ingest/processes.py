"""The processes that `bench/run ingest` measures: a PostgreSQL, sixpoint-plant and sixpoint-ingest of its own."""
import glob
import json
import os
import pwd
import random
import shutil
import signal
import socket
import subprocess
import tempfile
import time

BIN = os.environ.get('SIXPOINT_BIN_DIR', os.path.abspath('build/release/bin'))
BENCH = f'{BIN}/sixpoint-bench-ingest'
TICKS = os.sysconf('SC_CLK_TCK')


def free_ports(count):
    sockets = [socket.socket() for _ in range(count)]
    for s in sockets:
        s.bind(('127.0.0.1', 0))
    ports = [s.getsockname()[1] for s in sockets]
    for s in sockets:
        s.close()
    return ports


def children_of(pid):
    found = []
    for path in glob.glob(f'/proc/{pid}/task/*/children'):
        try:
            found += [int(word) for word in open(path).read().split()]
        except OSError:
            pass
    return found


def tree_of(pid):
    pids = [pid]
    for child in children_of(pid):
        pids += tree_of(child)
    return pids


def cpu_s(pid):
    """Of the process, its living children and those that it has waited for."""
    total = 0.0
    for one in tree_of(pid):
        try:
            fields = open(f'/proc/{one}/stat').read().rsplit(')', 1)[1].split()
        except OSError:
            continue
        total += sum(int(f) for f in fields[11:15]) / TICKS  # utime stime cutime cstime
    return total


def machine_cpu_s():
    """(busy, waiting for the disk) of all cores."""
    fields = [int(f) for f in open('/proc/stat').readline().split()[1:]]
    return (sum(fields[:3]) + sum(fields[5:8])) / TICKS, fields[4] / TICKS


def memory_mb(pid, what):
    file = 'smaps_rollup' if what == 'Pss' else 'status'
    for line in open(f'/proc/{pid}/{file}'):
        if line.startswith(what + ':'):
            return int(line.split()[1]) / 1024
    return 0.0


class Certificates:
    """An authority of the bench's own, and a folder of credentials for each whom it lets in."""

    def __init__(self, folder):
        self.folder, self.authority = folder, f'{folder}/authority'
        self.revoked = f'{self.authority}/revoked.pem'
        os.mkdir(folder, 0o700)
        self.certs('init', '--plant', 'bench')

    def issue(self, name, *options):
        out = f'{self.folder}/{name}'
        os.makedirs(os.path.dirname(out), exist_ok=True)
        self.certs('issue', name, '--folder', out, *options)
        return out

    def certs(self, *words):
        subprocess.run([f'{BIN}/sixpoint', 'certs', *words, '--authority', self.authority], check=True, stdout=subprocess.DEVNULL)


class Plant:
    """PostgreSQL, sixpoint-plant and sixpoint-ingest, gone at the end."""

    def __init__(self):
        self.folder = tempfile.mkdtemp(prefix='sixpoint-bench-')
        os.chmod(self.folder, 0o755)
        self.as_server = []
        versions = sorted(glob.glob('/usr/lib/postgresql/*/bin'), key=lambda p: int(p.split('/')[-2]))
        self.postgres_bin = versions[-1]
        for name in ('run', 'postgres'):
            os.mkdir(f'{self.folder}/{name}', 0o700)
        if os.geteuid() == 0:  # PostgreSQL refuses root
            user = pwd.getpwnam('postgres')
            self.as_server = ['setpriv', '--reuid=postgres', '--regid=postgres', '--clear-groups']
            for name in ('run', 'postgres'):
                os.chown(f'{self.folder}/{name}', user.pw_uid, user.pw_gid)
        self.conninfo = f'host={self.folder}/run dbname=sixpoint user=sixpoint'
        self.plant_port, self.ingest_port, self.sink_port = free_ports(3)
        self.ingest_address = f'127.0.0.1:{self.ingest_port}'
        self.log = open(f'{self.folder}/log', 'ab')
        self.postgres = self.plant = self.ingest = None
        self.certificates, self.credentials = None, {}  # of up()
        self.to_ingest = []  # the words by which the bench's program finds it, and is let in

    def up_database(self):
        """A database of the newest schema, without services."""
        subprocess.run(self.as_server + [f'{self.postgres_bin}/initdb', '-D', f'{self.folder}/postgres', '-U', 'sixpoint',
                                         '-A', 'trust', '--data-checksums', '--encoding=UTF8', '--locale=C'],
                       cwd='/', stdout=self.log, stderr=self.log, check=True)
        self.start_postgres()
        subprocess.run([f'{self.postgres_bin}/psql', '-q', '-h', f'{self.folder}/run', '-U', 'sixpoint', 'postgres', '-c',
                        'CREATE DATABASE sixpoint'], stdout=self.log, stderr=self.log, check=True)
        subprocess.run([f'{BIN}/sixpoint-migrate', '--database', self.conninfo, '--migrations', 'migrations'],
                       stdout=self.log, stderr=self.log, check=True)

    def up(self, machines):
        self.up_database()
        self.certificates = Certificates(f'{self.folder}/certificates')
        for area in ('plant', 'ingest'):
            self.credentials[area] = self.certificates.issue(f'services/{area}', '--host', '127.0.0.1')
        roles = [word for role in ('engineer', 'quality', 'mes-reader', 'admin') for word in ('--role', role)]
        user = ['--identity', self.certificates.issue('users/bench', *roles)]
        self.to_ingest = ['--ingest', self.ingest_address, *user]
        self.plant = self.service('plant', self.plant_port)
        bench('register', '--plant', f'127.0.0.1:{self.plant_port}', *user, '--machines', machines)
        self.start_ingest()
        self.wait_for_ingest()

    def start_postgres(self):
        """As `sixpoint up` starts it. Refused for some seconds after a crash, so tried again."""
        end = time.monotonic() + 60
        while time.monotonic() < end:
            if self.postgres is None or self.postgres.poll() is not None:
                self.postgres = subprocess.Popen(
                    self.as_server + [f'{self.postgres_bin}/postgres', '-D', f'{self.folder}/postgres', '-k',
                                      f'{self.folder}/run', '-c', 'listen_addresses=', '-c', 'max_connections=100', '-c',
                                      'shared_buffers=128MB', '-c', 'wal_compression=on'],
                    cwd='/', stdout=self.log, stderr=self.log)
            ready = subprocess.run([f'{self.postgres_bin}/pg_isready', '-q', '-h', f'{self.folder}/run'])
            if ready.returncode == 0:
                return
            time.sleep(0.1)
        raise SystemExit(f'PostgreSQL does not start: {self.folder}/log')

    def kill_postgres(self):
        """The postmaster first, so that it cannot mourn its children, then all of them."""
        for pid in tree_of(self.postgres.pid):
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
        self.postgres.wait()

    def service(self, area, port):
        return subprocess.Popen(
            [f'{BIN}/sixpoint-{area}', '--listen', f'127.0.0.1:{port}', '--database', f'{self.conninfo}_{area}', '--workers', BIN,
             '--certificates', self.credentials[area], '--revoked', self.certificates.revoked,
             '--peer', f'plant=127.0.0.1:{self.plant_port}', '--peer', f'ingest={self.ingest_address}'],
            stdout=self.log, stderr=self.log)

    def start_ingest(self):
        self.ingest = self.service('ingest', self.ingest_port)

    def kill_ingest(self):
        self.ingest.kill()
        self.ingest.wait()

    def restart_ingest(self):
        self.kill_ingest()
        self.start_ingest()
        self.wait_for_ingest()

    def wait_for_ingest(self):
        end = time.monotonic() + 30
        while time.monotonic() < end:
            if self.ingest.poll() is not None:
                self.start_ingest()
            stored = bench('small-scans', *self.to_ingest, '--count', 1, '--seed',
                           random.randrange(1 << 30), may_fail=True)
            if stored.get('stored') == 1:
                return
            time.sleep(0.1)
        raise SystemExit(f'ingest does not answer: {self.folder}/log')

    def sql(self, statement):
        out = subprocess.run([f'{self.postgres_bin}/psql', '-At', '-h', f'{self.folder}/run', '-U', 'sixpoint', 'sixpoint',
                              '-c', statement], capture_output=True, text=True, check=True)
        return out.stdout.strip()

    def down(self):
        for process in (self.ingest, self.plant):
            if process is not None and process.poll() is None:
                process.kill()
                process.wait()
        if self.postgres is not None and self.postgres.poll() is None:
            self.postgres.send_signal(signal.SIGQUIT)
            self.postgres.wait()
        self.log.close()
        if os.environ.get('SIXPOINT_BENCH_KEEP'):
            shutil.copy(f'{self.folder}/log', os.environ['SIXPOINT_BENCH_KEEP'])
        shutil.rmtree(self.folder, ignore_errors=True)


def bench(*words, may_fail=False):
    done = subprocess.run([BENCH] + [str(w) for w in words], capture_output=True, text=True)
    lines = done.stdout.strip().splitlines()
    result = json.loads(lines[-1]) if lines else {'error': done.stderr.strip()[-500:] or f'exit {done.returncode}'}
    if 'error' in result and not may_fail:
        raise SystemExit(f'{words[0]}: {result["error"]}')
    return result
