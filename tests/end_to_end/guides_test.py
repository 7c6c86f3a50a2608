#!/usr/bin/python3
"""The guides in docs/guides as their readers follow them: on a plant that `sixpoint up` starts in a folder of its own, every block that is
marked as run (```sh run) is run, in order, in one folder that has docs, proto and deploy as the repository has them. A block that ends with
anything but 0 is told with its place and its output. What the blocks leave is then looked at by the CLI."""
import array
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile

SOURCE = pathlib.Path(os.environ['SIXPOINT_SOURCE_DIR'])
BIN = pathlib.Path(os.environ['SIXPOINT_BIN_DIR'])
BLOCK = re.compile(r'^```sh run\n(.*?)^```$', re.MULTILINE | re.DOTALL)


class Failed(Exception):
    pass


def skip_without():
    try:
        import grpc  # noqa: F401
        import google.protobuf  # noqa: F401
    except ImportError as missing:
        return f'no {missing.name or missing} for /usr/bin/python3 (python3-grpcio, python3-protobuf)'
    for program in ('supervisord', 'protoc', 'grpc_python_plugin', 'curl', 'psql', 'pg_basebackup'):
        if not shutil.which(program):
            return f'no {program}'
    return None


def is_free(port):
    with socket.socket() as one:
        try:
            one.bind(('127.0.0.1', port))
            return True
        except OSError:
            return False


def free_base_port():
    """Of a plant's six services, the seven ports at which it is seen, and the gateway."""
    for base in (20000 + (os.getpid() + i) % 100 * 100 for i in range(100)):
        if all(map(is_free, [*range(base, base + 6), *range(base + 20, base + 27), base + 80])):
            return base
    raise Failed('no free ports')


def run(words, environment, folder, what, timeout_s=300):
    done = subprocess.run(words, env=environment, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, timeout=timeout_s, check=False)
    if done.returncode != 0:
        raise Failed(f'{what} ended with {done.returncode}:\n{done.stdout}')
    return done.stdout


def listed(words, environment, folder):
    done = subprocess.run(['sixpoint', *words, '--json'], env=environment, cwd=folder, capture_output=True, text=True, timeout=60, check=False)
    if done.returncode not in (0, 4):
        raise Failed(f"sixpoint {' '.join(words)}: {done.stdout}{done.stderr}")
    return json.loads(done.stdout)


def follow(guide, environment, folder):
    """Runs the blocks of one guide. Each is a shell of its own, as a reader's may be."""
    text = (SOURCE / 'docs' / 'guides' / guide).read_text(encoding='utf-8')
    blocks = list(BLOCK.finditer(text))
    if not blocks:
        raise Failed(f'{guide} has no block that is run')
    for found in blocks:
        line = text.count('\n', 0, found.start()) + 1
        output = run(['bash', '-euo', 'pipefail', '-c', found[1]], environment, folder, f'{guide}:{line}\n{found[1]}')
        print(f'{guide}:{line}: runs', flush=True)
        if os.environ.get('SIXPOINT_GUIDES_SHOW'):
            print(output)


def want(holds, sentence):
    if not holds:
        raise Failed(sentence)


def check_uploads(environment, folder):
    """Three programs sent the same points, and two were switched off once: three scans that are the same."""
    scans = {one['header']['scan_id']: one for one in listed(['scan', 'list', '--subject', 'blades/SN-1'], environment, folder)}
    sent = array.array('d', (folder / 'points.f64').read_bytes())
    want({'sn1_python', 'sn1_cpp', 'sn1_put'} <= set(scans), f'stored: {sorted(scans)}')
    for scan in (scans['sn1_python'], scans['sn1_cpp'], scans['sn1_put']):
        want(int(scan['header']['point_count']) == 300_000, f'{scan["name"]} has {scan["header"]["point_count"]} points')
        want(scan['proven_error_um'] <= 0.25, f'{scan["name"]} is kept within {scan["proven_error_um"]} um')
        run(['sixpoint', 'scan', 'download', scan['name'], '--out', 'came_back.xyz'], environment, folder, 'download')
        came = [float(word) for line in open(folder / 'came_back.xyz', encoding='ascii') for word in line.split()]
        want(len(came) == len(sent), f'{len(came) // 3} points of {scan["name"]} came back of {len(sent) // 3}')
        # As proven, and the last digit of the file.
        off_um = 1000 * max(abs(a - b) for a, b in zip(came, sent))
        want(off_um <= scan['proven_error_um'] + 0.001, f'{scan["name"]} is off by {off_um} um')
    record = listed(['scan', 'show', 'sn1_python'], environment, folder)
    want(record['header']['machine'] == 'machines/sarix-1', f'{record["header"]}')


def check_break(name, words, environment, folder, data):
    """Ingest is killed as soon as a longer upload goes on: the same program brings it to its end."""
    header = json.loads((folder / 'header.json').read_text(encoding='utf-8'))
    (folder / 'header_break.json').write_text(json.dumps({**header, 'scanId': name}), encoding='utf-8')
    with subprocess.Popen(words, env={**environment, 'PYTHONPATH': 'stubs'}, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True) as upload:
        said = upload.stdout.readline()
        os.kill(int(run(['supervisorctl', '-c', str(data / 'supervisord.conf'), 'pid', 'ingest'], environment, folder, 'pid of ingest')), signal.SIGKILL)
        said += upload.communicate(timeout=120)[0]
        want(upload.returncode == 0, f'{words[0]} did not get over a break:\n{said}')
    want(said.count('goes on from block') >= 2, f'{words[0]} met no break:\n{said}')
    scan = listed(['scan', 'show', name], environment, folder)
    want(int(scan['header']['point_count']) == 3_000_000, f'{name} has {scan["header"]["point_count"]} points:\n{said}')


def check_breaks(environment, folder, data):
    points = array.array('d', (folder / 'points.f64').read_bytes())
    with open(folder / 'long.f64', 'wb') as file:
        for turn in range(10):  # each further along x by the width of one
            points[0::3] = array.array('d', [x + (20 if turn else 0) for x in points[0::3]])
            points.tofile(file)
    server = environment['SERVER']
    check_break('break_python', ['/usr/bin/python3', 'docs/examples/upload_scan.py', server, 'header_break.json', 'long.f64', '--identity', 'sarix-1'],
                environment, folder, data)
    check_break('break_cpp', ['sixpoint-example-upload-scan', server, 'header_break.json', 'long.f64', 'sarix-1'], environment, folder, data)


def follow_all(root):
    folder, data = root / 'reader', root / 'plant'
    folder.mkdir()
    for name in ('docs', 'proto', 'deploy'):
        (folder / name).symlink_to(SOURCE / name)
    port = free_base_port()
    environment = {name: value for name, value in os.environ.items() if not name.startswith('SIXPOINT_')}
    environment.update(PATH=f"{BIN}:/usr/bin:/bin:{os.environ['PATH']}", HOME=str(folder), DATA=str(data), SERVER=f'127.0.0.1:{port}',
                       GATEWAY=f'http://127.0.0.1:{port + 80}', SIXPOINT_SERVER=f'127.0.0.1:{port}',
                       SIXPOINT_IDENTITY=str(data / 'certificates' / 'local'))
    with socket.socket() as one:
        one.bind(('127.0.0.1', 0))
        environment['PORT'] = str(one.getsockname()[1])
    try:
        run(['sixpoint', 'up', '--data', str(data), '--base-port', str(port)], environment, folder, 'sixpoint up')
        follow('machine_builder.md', environment, folder)
        check_uploads(environment, folder)
        check_breaks(environment, folder, data)
        # A blade that went the whole way, and a program of it that waits for a person: its holes are cut already.
        run(['sixpoint-simulator', 'demo', '--server', f'127.0.0.1:{port}', '--machines', '1', '--airfoil-pitch-mm', '0.4',
             '--pins-pitch-mm', '0.15'], environment, folder, 'demo')
        inspection = listed(['inspection', 'list'], environment, folder)[0]
        machine = inspection['positioning']['machine'] if 'machine' in inspection.get('positioning', {}) else 'machines/sim-1'
        registration = next(one for one in listed(['registration', 'list'], environment, folder) if one['blade'] == inspection['blade'])
        correction = listed(['correct', '--registration', registration['name']], environment, folder)
        calibration = listed(['calibration', 'list', '--machine', machine, '--kind', 'sensor'], environment, folder)[0]
        environment.update(BLADE=inspection['blade'].split('/')[1], INSPECTION=inspection['name'], MACHINE=machine.split('/')[1],
                           CORRECTION=correction['name'], CALIBRATION=calibration['name'])
        follow('mes_plm.md', environment, folder)
        follow('operator.md', environment, folder)
        want(listed(['correction', 'show', correction['name']], environment, folder)['state'].endswith('REFUSED'), 'the program is not refused')
        follow('it.md', environment, folder)
    except BaseException:
        log = subprocess.run(['sixpoint', 'logs', '--data', str(data), '--level', 'warning'], env=environment, capture_output=True,
                             text=True, timeout=60, check=False).stdout
        print(log[-4000:], flush=True)
        raise
    finally:
        for one in (data, root / 'reader' / 'restored'):
            subprocess.run(['sixpoint', 'down', '--data', str(one)], env=environment, capture_output=True, timeout=120, check=False)


def main():
    if why := skip_without():
        print(f'SKIPPED: {why}')
        return 77
    root = pathlib.Path(tempfile.mkdtemp(prefix='sixpoint-guides-'))
    root.chmod(0o755)  # the services run as another user
    try:
        follow_all(root)
    except (Failed, subprocess.TimeoutExpired) as failed:
        print(failed)
        return 1
    finally:
        shutil.rmtree(root, ignore_errors=True)
    return 0


sys.exit(main())
