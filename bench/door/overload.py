"""Ten times as many calls as can be answered: the callers on one core, the service and its PostgreSQL on another."""
import glob
import json
import os
import shutil
import statistics
import subprocess
import tempfile
import time

from processes import BIN, Plant, cpu_s, free_ports, memory_mb, tree_of

DOOR = f'{BIN}/sixpoint-bench-door'
ID = '00000000-0000-7000-8000-000000000000'  # another in each call
CORES = sorted(os.sched_getaffinity(0))


def pin(pids, core):
    for pid in pids:
        for one in tree_of(pid):
            subprocess.run(['taskset', '-a', '-p', '-c', str(core), str(one)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


class Server:
    """A service that is asked: its address, the pids that share its core, and who asks."""

    def __init__(self, port, pids, identity):
        self.address, self.pids, self.identity = f'127.0.0.1:{port}', pids, identity

    def load(self, words, identity=None, **options):
        pin(self.pids, CORES[0])  # those too that PostgreSQL started since
        options = [word for name, value in options.items() for word in ('--' + name.replace('_', '-'), str(value))]
        command = ['taskset', '-c', str(CORES[-1]), DOOR, '--server', self.address, '--identity', identity or self.identity]
        return subprocess.Popen(command + list(words) + options, stdout=subprocess.PIPE, text=True)

    def result(self, load):
        out, _ = load.communicate()
        if load.returncode != 0:
            raise SystemExit(f'{DOOR} ended with {load.returncode}')
        return json.loads(out)

    def measure(self, words, **options):
        before = sum(cpu_s(pid) for pid in self.pids)
        seen = self.result(self.load(words, **options))
        seen['cpu_s'] = sum(cpu_s(pid) for pid in self.pids) - before
        return seen


def overload(server, words, quick, deadline_ms, in_flight, connections=4, times=10, seconds=None):
    """Figures of one kind of call. Capacity and overload take turns, short ones and many, for a machine is not equally fast all the time."""
    seconds = seconds or (2 if quick else 3)
    rounds = 2 if quick else 9
    capacities = [server.measure(words, connections=connections, in_flight=n, seconds=seconds, deadline_ms=deadline_ms)['goodput_per_s']
                  for n in in_flight]
    best = in_flight[capacities.index(max(capacities))]
    pairs, refusals, p99s, without, ends = [], 0, [], 0, {}
    for _ in range(rounds):
        peak = server.measure(words, connections=connections, in_flight=best, seconds=seconds, deadline_ms=deadline_ms)
        over = server.measure(words, connections=connections, rate=times * max(peak['goodput_per_s'], 0.1), seconds=seconds,
                              deadline_ms=deadline_ms)
        pairs.append((peak['goodput_per_s'], over['goodput_per_s'], over['asked_per_s']))
        refusals += over['refused']
        if over['refused']:
            p99s.append(over['refusal_p99_ms'])
        without += over['refused_without_retry_info']
        for end, count in over['ends'].items():
            ends[end] = ends.get(end, 0) + count
    return {'peak_per_s': statistics.median(p for p, _, _ in pairs), 'asked_per_s': statistics.median(a for _, _, a in pairs),
            'goodput_percent': 100 * statistics.median(o / p for p, o, _ in pairs),
            'scatter_percent': 100 * (max(o / p for p, o, _ in pairs) - min(o / p for p, o, _ in pairs)),
            'refused': refusals, 'refusal_p99_ms': statistics.median(p99s) if p99s else None,
            'without_retry_info': without, 'ends': ends}


def beside(server, words, quick, other_identity, healthy_words, **options):
    """p99 of one who asks now and then with a certificate of his own, alone and beside the overload."""
    seconds = 3 if quick else 8
    calm = {'connections': 1, 'rate': 20, 'seconds': seconds, 'deadline_ms': 5000, 'identity': other_identity, 'source': '127.0.0.3'}
    alone = server.result(server.load(healthy_words, **calm))
    flood = server.load(words, seconds=seconds + 1, **options)
    time.sleep(0.5)
    seen = server.result(server.load(healthy_words, **calm))
    server.result(flood)
    return {'alone_p99_ms': alone['ok_p99_ms'], 'p99_ms': seen['ok_p99_ms'],
            'served_percent': 100 * seen['ends'].get('0', 0) / max(1, seen['asked'] - seen['never_sent'])}


def call(method, **request):
    return ['--method', method, '--request', json.dumps(request)]


def reads_and_uploads(quick):
    """Yields (name, words, figures): a small read of the plant, a page of blades, uploads of small scans."""
    plant = Plant()
    try:
        plant.up(4)
        user, other = plant.to_ingest[3], plant.certificates.issue('users/other', '--role', 'engineer')
        server = Server(plant.plant_port, [plant.plant.pid, plant.postgres.pid], user)
        read = call('sixpoint.plant.v1.PlantService.GetMachine', name='machines/bench-0')
        yield 'read', 'GetMachine', overload(server, read, quick, 1000, [2, 4, 8])
        many = overload(server, read, quick, 1000, [1, 2], connections=16)
        yield 'read_many', 'the same on 16 connections', many
        rate = 10 * many['peak_per_s']
        yield 'beside', None, beside(server, read, quick, other, read, rate=rate, connections=4, deadline_ms=1000)
        pages = call('sixpoint.plant.v1.PlantService.ListBlades', pageSize=10)
        yield 'list', 'ListBlades', overload(server, pages, quick, 1000, [2, 4, 8])
        rss_mb = memory_mb(plant.plant.pid, 'VmHWM')
        bodies = f'{plant.folder}/bodies'
        os.mkdir(bodies)
        subprocess.run([f'{BIN}/sixpoint-bench-ingest', 'upload-bodies', '--folder', bodies, '--count', '64', '--scan-id', ID],
                       check=True, stdout=subprocess.DEVNULL)
        files = sorted(glob.glob(f'{bodies}/*'))
        ingest = Server(plant.ingest_port, [plant.ingest.pid, plant.postgres.pid], user)
        upload = ['--method', 'sixpoint.ingest.v1.ScanService.UploadScan', *[w for f in files for w in ('--bodies', f)]]
        yield 'upload', 'UploadScan of a small scan', overload(ingest, upload, quick, 5000, [1, 2, 4])
        yield 'memory', None, {'plant_mb': rss_mb, 'ingest_mb': memory_mb(plant.ingest.pid, 'VmHWM')}
    finally:
        plant.down()


def computed(quick):
    """Yields the same of a Correct that is worked out and recorded anew each time, on a whole plant after its demo."""
    data = tempfile.mkdtemp(prefix='sixpoint-overload-')
    os.chmod(data, 0o755)
    base = free_ports(1)[0] // 10 * 10
    supervisorctl = ['supervisorctl', '-c', f'{data}/plant/supervisord.conf']
    try:
        subprocess.run([f'{BIN}/sixpoint', 'up', '--data', f'{data}/plant', '--base-port', str(base)], check=True,
                       stdout=subprocess.DEVNULL)
        identity = f'{data}/plant/certificates/local'
        environment = {**os.environ, 'SIXPOINT_IDENTITY': identity}
        subprocess.run([f'{BIN}/sixpoint-simulator', 'demo', '--server', f'127.0.0.1:{base}', '--machines', '1', '--seed', '7'],
                       check=True, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        names = subprocess.run(['psql', '-h', f'{data}/plant/run', '-U', 'sixpoint', '-d', 'sixpoint', '-Atc',
                                "SELECT name FROM record_names WHERE name LIKE 'registrations/%' ORDER BY name LIMIT 1"],
                               capture_output=True, text=True, check=True).stdout.split()
        pids = []
        for program in ('plant', 'ingest', 'calibration', 'registration', 'correction', 'inspection', 'postgres'):
            pid = subprocess.run([*supervisorctl, 'pid', program], capture_output=True, text=True).stdout.strip()
            pids += [int(pid)] if pid.isdigit() and int(pid) > 0 else []
        server = Server(base + 4, pids, identity)  # as `sixpoint up` gives ports out
        words = call('sixpoint.correction.v1.CorrectionService.Correct', registration=names[0], requestId=ID)
        yield 'correct', 'Correct, recorded', overload(server, words, quick, 5000, [1, 2], connections=4, seconds=4 if quick else 5)
    finally:
        subprocess.run([f'{BIN}/sixpoint', 'down', '--data', f'{data}/plant'], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        shutil.rmtree(data, ignore_errors=True)

