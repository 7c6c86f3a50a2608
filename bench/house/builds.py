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
    """User and system seconds of all that was run and waited for."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime, used.ru_stime


# What every build here is made of: Eigen's templates, and no line of ours.
YARDSTICK = '#include <Eigen/Dense>\nEigen::MatrixXd f(Eigen::MatrixXd m) { return m.ldlt().solve(m) * m.inverse(); }\n'


def yardstick_s():
    """Processor seconds that the compiler takes for it, the least of three: the measure of how fast this machine is just now. Compiled on all
    processors at once, as a build is: two that share a core take longer beside each other."""
    least = float('inf')
    for _ in range(3):
        before, together = sum(processor_s()), os.cpu_count()
        compilers = [subprocess.Popen(['g++', '-std=c++17', '-O3', '-I/usr/include/eigen3', '-x', 'c++', '-c', '-o', os.devnull, '-'],
                                      stdin=subprocess.PIPE, text=True) for _ in range(together)]
        for compiler in compilers:
            compiler.stdin.write(YARDSTICK)
            compiler.stdin.close()
        if any(compiler.wait() for compiler in compilers):
            raise SystemExit('the yardstick is not compiled')
        least = min(least, (sum(processor_s()) - before) / together)
    return least


def built(folder):
    """User and system minutes of what is not built there yet."""
    before = processor_s()
    done = subprocess.run(['ninja', '-C', folder], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode != 0:
        raise SystemExit(done.stdout[-4000:])
    return [(now - then) / 60 for now, then in zip(processor_s(), before)]


def cold():
    """Of a fresh folder: user and system minutes of the product, and of product and tests; seconds of the yardstick before, between and
    after; the slowest source's seconds and name."""
    folder, times = 'build/house-cold', os.path.abspath('build/house-cold.times')
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs('build', exist_ok=True)
    open(times, 'w').close()
    os.environ.update(CCACHE_DISABLE='1', SIXPOINT_COMPILE_TIMES=times)
    without_cache = ['-DCCACHE=OFF', f'-DCMAKE_CXX_COMPILER_LAUNCHER={LAUNCHER}']
    configure(folder, '-DSIXPOINT_TESTS=OFF', *without_cache)
    yardsticks = [yardstick_s()]
    product = built(folder)
    yardsticks.append(yardstick_s())
    configure(folder, '-DSIXPOINT_TESTS=ON', *without_cache)
    tests = [of_product + more for of_product, more in zip(product, built(folder))]
    yardsticks.append(yardstick_s())
    slowest = max((float(line.split()[0]), line.split()[1]) for line in open(times))
    return product, tests, yardsticks, slowest
