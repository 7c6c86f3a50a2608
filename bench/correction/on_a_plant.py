#!/usr/bin/python3
"""usage: on_a_plant.py BIN [foils|chain] [ARG...]      Both, or one, with ARGs for its program. On a plant of its own.
foils: where corrected holes begin with a foil of 0.05 to 0.6 mm under the blade, and where they would have begun without (foils.cc).
chain: from stored scans of a million points about a group of holes to their released program in one call, over the bare kernels of the same work in the same run, and of
four machines at once (chain.cc); plant-a's machine four times. Ends with 1 where a goal is missed."""
import json
import os
import shutil
import subprocess
import sys
import tempfile

import data_sets

# At least, at most.
GOALS = {'foil_worst_error_um': (None, 3), 'foil_least_uncorrected_over_radius': (1, None), 'foil_released': (1, None),
         'chain_p50_over_kernels': (None, 1.5), 'chain_p99_over_kernels': (None, 2.5)}
PORT = 7540
# Two angles, two strips each, about one group of holes: a program from one scan alone waits for a person, for nothing speaks of its merging.
PORTIONS = ('sn1_b000_0', 'sn1_b000_1', 'sn1_b060_0', 'sn1_b060_1')


def machine_names(number):
    """Of the first they stay."""
    if number == 1:
        return {}
    names = data_sets.scan_names(f'_{number}')
    return {**names, 'sarix-1': f'sarix-1-{number}', 'SN-0001': f'SN-0001-{number}', 'blade:SN-0001': f'blade:SN-0001-{number}'}


def four_machines(tool, data, identity):
    for number in range(1, 5):
        one = data_sets.put(f'{data}/{number}', machine_names(number), lambda scan: scan['kind'] in ('artefact', 'arm') or scan['id'] in PORTIONS)
        subprocess.run([tool, '--server', f'127.0.0.1:{PORT}', 'plant', 'run', one, '--out', f'{data}/{number}.json'], stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL, env={**os.environ, 'SIXPOINT_IDENTITY': identity})
    return ['--dataset', f'{data}/1']


def measured(bin_folder, parts, arguments):
    """The figures; nothing where a program failed."""
    data = tempfile.mkdtemp(prefix='sixpoint-bench-')
    os.chmod(data, 0o755)
    tool, up = os.path.join(bin_folder, 'sixpoint'), os.path.join(data, 'plant')
    identity, figures = f'{up}/certificates/local', {}
    try:
        subprocess.run([tool, 'up', '--data', up, '--base-port', str(PORT)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for part in parts:
            more = four_machines(tool, data, identity) if part == 'chain' else []
            ran = subprocess.run([os.path.join(bin_folder, f'sixpoint-bench-{part}'), '--server', f'127.0.0.1:{PORT}', '--identity', identity, *more,
                                  *arguments], stdout=subprocess.PIPE, text=True)
            if ran.returncode != 0:
                return None
            *table, last = ran.stdout.splitlines()
            print('\n'.join(table), flush=True)
            figures.update(json.loads(last))
    finally:
        subprocess.run([tool, 'down', '--data', up], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        shutil.rmtree(data, ignore_errors=True)
    return figures


def main():
    wanted = sys.argv[2:3] if sys.argv[2:3] in (['foils'], ['chain']) else ['foils', 'chain']
    arguments = sys.argv[3:] if len(wanted) == 1 else []
    parts = [part for part in wanted if part == 'foils' or data_sets.is_there()]
    figures = measured(sys.argv[1], parts, arguments)
    if figures is None:
        return 2
    missed = 0
    for figure, value in figures.items():
        least, most = GOALS.get(figure, (None, None))
        over = (most is not None and value > most) or (least is not None and value < least)
        missed += over
        want = f'  want at most {most}' if most is not None else f'  want at least {least}' if least is not None else ''
        print(f'{figure:38}{value:10.3f}{want}{"  MISSED" if over else ""}')
    print(json.dumps({'bench': 'correction', 'figures': {key: round(value, 4) for key, value in figures.items()}}))
    return 1 if missed else 0


if __name__ == '__main__':
    sys.exit(main())
