"""What a build is: its steps, and with no compiler cache its processor minutes and its slowest source."""
import os
import resource
import shutil
import subprocess

LAUNCHER = os.path.abspath('bench/house/timed')


def configure(folder, *options):
    command = ['cmake', '-S', '.', '-B', folder, '-G', 'Ninja', '-DCMAKE_BUILD_TYPE=Release', '-DSIXPOINT_BENCH=OFF', *options]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(done.stdout[-2000:] + done.stderr[-2000:])


def steps():
    """Of ./run and of ./test."""
    counts = []
    for tests in ('OFF', 'ON'):
        configure('build/house', f'-DSIXPOINT_TESTS={tests}')
        counts.append(len(subprocess.check_output(['ninja', '-C', 'build/house', '-t', 'commands', 'all'], text=True).splitlines()))
    return counts


def processor_s():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def built(folder):
    """Processor minutes of what is not built there yet."""
    before = processor_s()
    done = subprocess.run(['ninja', '-C', folder], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        raise SystemExit(done.stdout[-4000:])
    return (processor_s() - before) / 60


def cold():
    """(product's minutes, product's and tests' minutes, the slowest source's seconds, its name), all in a fresh folder."""
    folder, times = 'build/house-cold', os.path.abspath('build/house-cold.times')
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs('build', exist_ok=True)
    open(times, 'w').close()
    os.environ.update(CCACHE_DISABLE='1', SIXPOINT_COMPILE_TIMES=times)
    without_cache = ['-DCCACHE=OFF', f'-DCMAKE_CXX_COMPILER_LAUNCHER={LAUNCHER}']
    configure(folder, '-DSIXPOINT_TESTS=OFF', *without_cache)
    product = built(folder)
    configure(folder, '-DSIXPOINT_TESTS=ON', *without_cache)
    tests = product + built(folder)
    slowest = max((float(line.split()[0]), line.split()[1]) for line in open(times))
    return product, tests, *slowest
