"""What a list of packages brings to a bare Debian: apt is asked what it would install beside the essential packages."""
import os
import re
import subprocess
import tempfile


def simulated(status, packages):
    answer = subprocess.run(
        ['apt-get', '-s', '--no-install-recommends', '-o', f'Dir::State::status={status}', '-o', 'Debug::NoLocking=1',
         'install', *packages], capture_output=True, text=True, env={**os.environ, 'LC_ALL': 'C'})
    if answer.returncode != 0:
        raise SystemExit('apt-get -s: ' + answer.stdout[-2000:] + answer.stderr[-500:] + '\n(apt-get update first)')
    return sorted(set(re.findall(r'^Inst (\S+)', answer.stdout, re.M)))


def descriptions(packages):
    text = subprocess.check_output(['apt-cache', 'show', '--no-all-versions', *packages], text=True)
    return {re.search(r'^Package: (\S+)', each, re.M)[1]: each for each in text.strip().split('\n\n')}


def bare_debian():
    """The packages that every Debian has: apt, and those that are essential or required, with what they depend on."""
    all_of_them = subprocess.check_output(['apt-cache', 'dumpavail'], text=True, errors='replace').split('\n\n')
    needed = {re.search(r'^Package: (\S+)', each, re.M)[1] for each in all_of_them
              if re.search(r'^(Essential: yes|Priority: required)$', each, re.M)}
    return sorted(needed | {'apt'})


def read_lists(names):
    words = []
    for name in names:
        lines = open(f'deploy/packages/{name}.txt').read().splitlines()
        words += [line for line in lines if line and not line.startswith('#')]
    return words


def measured(names):
    """How many packages, and how many bytes installed, the lists of these names bring."""
    with tempfile.TemporaryDirectory() as folder:
        nothing, bare = f'{folder}/nothing', f'{folder}/bare'
        open(nothing, 'w').close()
        base = descriptions(simulated(nothing, bare_debian()))
        with open(bare, 'w') as status:
            for text in base.values():
                status.write(re.sub(r'^(Package: .*)', r'\1\nStatus: install ok installed', text, count=1) + '\n\n')
        brought = simulated(bare, read_lists(names))
    kilobytes = sum(int(re.search(r'^Installed-Size: (\d+)', text, re.M)[1]) for text in descriptions(brought).values())
    return len(brought), kilobytes * 1024
