#!/usr/bin/python3
"""usage: inspections.py BEFORE_BIN NOW_BIN [RUNS]      How long plant-a's pins are inspected by now's programs, over how long by those of a
commit before, both in turn on this machine, each on fresh databases; and whether both find the same bits. A plant's first inspection of a part, and one
of scans that came later. A source of uncertainty that came since is no difference, nor the U that it is in: all else is.
BEFORE_BIN: bin folder of another checkout, for instance
  git worktree add ../before 80fe60e && (cd ../before && deploy/build release -DSIXPOINT_TESTS=OFF -DSIXPOINT_BENCH=OFF)
Ends with 1 where the ratio of the later ones' medians is over 0.5 or a value differs."""
import collections
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile

import data_sets

GOAL = 0.5
PORT = 7560


def run(tool, dataset, data):
    """Seconds of the inspection, and what it found."""
    subprocess.run([tool, '--server', f'127.0.0.1:{PORT}', 'plant', 'run', dataset, '--out', f'{data}/out.json'], stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL, env={**os.environ, 'SIXPOINT_IDENTITY': f'{data}/plant/certificates/local'})
    results = json.load(open(f'{data}/out.json'))
    for one in results['inspection']:
        for of_this_run in ('inspection', 'registration', 'scans', 'seconds'):
            one.pop(of_this_run, None)
        for hole in one['holes']:  # the budget names its calibrations, each run's own
            hole['budget_um'] = sorted(hole['budget_um'].values())
    return results['timing_s']['inspection'], results['inspection']


def differ(before, now):
    """How many holes differ, or blades in what they say beside them."""
    count = len(before) != len(now)
    for one, other in zip(before, now):
        count += len(one['holes']) != len(other['holes']) or {**one, 'holes': 0} != {**other, 'holes': 0}
        for hole, again in zip(one['holes'], other['holes']):
            came_since = collections.Counter(again['budget_um']) - collections.Counter(hole['budget_um'])
            had = not collections.Counter(hole['budget_um']) - collections.Counter(again['budget_um'])
            told = [name for name in hole if not came_since or not (name == 'budget_um' or name.startswith('u95_'))]
            count += not had or any(hole[name] != again.get(name) for name in told)
    return count


def inspected(bin_folder):
    """Of the first inspection and of a later one."""
    data = tempfile.mkdtemp(prefix='sixpoint-bench-')
    os.chmod(data, 0o755)
    tool, up = os.path.join(bin_folder, 'sixpoint'), os.path.join(data, 'plant')
    try:
        subprocess.run([tool, 'up', '--data', up, '--base-port', str(PORT)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        again = data_sets.put(f'{data}/again', data_sets.scan_names('_again'))  # to a plant they are new scans
        return run(tool, data_sets.PLANT, data), run(tool, again, data)
    finally:
        subprocess.run([tool, 'down', '--data', up], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        shutil.rmtree(data, ignore_errors=True)


def main():
    bins = {'before': sys.argv[1], 'now': sys.argv[2]}
    runs = int(sys.argv[3]) if len(sys.argv) > 3 else 5
    if not data_sets.is_there():
        return 0
    first, later, found = {'before': [], 'now': []}, {'before': [], 'now': []}, ([], [])
    for _ in range(runs):
        for which, bin_folder in bins.items():
            of_both = inspected(bin_folder)
            for times, (seconds, _), all_found, (_, here) in zip((first, later), of_both, found, of_both):
                times[which].append(seconds)
                all_found.append(here)
            print(f'{which:8}{first[which][-1]:8.2f} s the first{later[which][-1]:8.2f} s a later one', flush=True)
    ratios = [statistics.median(times['now']) / statistics.median(times['before']) for times in (first, later)]
    # All beside the first of before; now's beside the first of their own, too, of which nothing is left out.
    different = sum(differ(each[0], again) for each in found for again in each[1:])
    different += sum(differ(each[1], again) for each in found for again in each[3::2])
    print(f'a part\'s first inspection over before{ratios[0]:20.3f}')
    print(f'a later one over before{ratios[1]:34.3f}  want at most {GOAL}{"  MISSED" if ratios[1] > GOAL else ""}')
    print(f'different findings{different:39}  want 0{"  MISSED" if different else ""}')
    print(json.dumps({'bench': 'correction', 'figures': {'inspection_over_before': round(ratios[1], 3), 'first_inspection_over_before': round(ratios[0], 3)}}))
    return 1 if ratios[1] > GOAL or different else 0


if __name__ == '__main__':
    sys.exit(main())
