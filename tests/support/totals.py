"""Sums GoogleTest's result files under ctest's verdicts and prints the closing line.

usage: totals.py CTEST_JUNIT.xml GTEST_RESULT_FOLDER      exit 1 when anything failed or nothing ran
"""
import pathlib
import sys
import xml.etree.ElementTree as xml


def main():
    junit, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    passed = failed = skipped = 0
    reasons = {}
    for case in xml.parse(junit).getroot().iter('testcase'):
        name, ok = case.get('name'), case.get('status') == 'run'
        if case.get('status') == 'notrun':
            skipped += 1
            reasons.setdefault('not run by ctest', []).append(name)
            continue
        own = folder / f'{name}.xml'
        tests = list(xml.parse(own).getroot().iter('testcase')) if own.exists() else []
        bad = sum(1 for t in tests if t.find('failure') is not None)
        for t in tests:
            skip = t.find('skipped')
            if skip is not None:
                skipped += 1
                reasons.setdefault((skip.get('message') or 'no reason given').strip().split('\n')[-1], []).append(
                    f"{t.get('classname')}.{t.get('name')}")
            elif t.find('failure') is None and t.get('status') == 'run':
                passed += 1
        # A crash or a time-out leaves no count of its own, or one that looks clean.
        failed += bad if bad or ok else 1
        if ok and not tests:
            passed += 1
    for reason, names in reasons.items():
        print(f'SKIPPED {len(names)}: {reason} ({", ".join(names[:3])}{" ..." if len(names) > 3 else ""})')
    print(f'{passed} passed, {failed} failed, {skipped} skipped')
    sys.exit(1 if failed or not passed else 0)


main()
