"""How many files a reader opens to follow one call from wire to row (paths/*.txt): every entry must be included by the one
that it is indented under, so that a list cannot stay behind when files move."""
import glob
import os
import re


def includes(stem):
    found = set()
    for path in (stem + '.h', stem + '.cc'):
        if os.path.exists(path):
            found |= {name[:-2] for name in re.findall(r'#include "([^"]+\.h)"', open(path, encoding='utf-8').read())}
    return found


def counted(path):
    above, count = [], 0  # above: (indentation, stem)
    for line in open(path, encoding='utf-8').read().splitlines():
        stem = line.strip()
        if not stem or stem.startswith('#'):
            continue
        if not glob.glob(stem + '.*'):
            raise SystemExit(f'{path}: there is no {stem}')
        indentation = len(line) - len(line.lstrip())
        above = [each for each in above if each[0] < indentation]
        if above and stem not in includes(above[-1][1]):
            raise SystemExit(f'{path}: {above[-1][1]} does not include {stem}')
        above.append((indentation, stem))
        count += 1
    return count


def all_counted():
    return {os.path.basename(path)[:-4]: counted(path) for path in sorted(glob.glob('bench/house/paths/*.txt'))}
