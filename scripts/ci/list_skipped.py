#!/usr/bin/env python3
"""Prints how many cases ran and which were skipped, by reason.

    list_skipped.py TESTS.xml RESULTS

TESTS.xml: of ctest --output-junit. RESULTS: the folder of GoogleTest's own reports, one a suite, whose cases are
counted in place of ctest's entry for the suite.
"""
import collections
import pathlib
import sys
import xml.etree.ElementTree

reasons = collections.defaultdict(list)
count = 0
suites = set()
for report in sorted(pathlib.Path(sys.argv[2]).glob("*.xml")):
    for suite in xml.etree.ElementTree.parse(report).iter("testsuite"):
        suites.add(suite.get("name"))
        for case in suite.iter("testcase"):
            count += 1
            skipped = case.find("skipped")
            if skipped is not None:
                reason = (skipped.get("message") or "").strip() or "no reason given"
                reasons[reason.splitlines()[-1]].append(f"{suite.get('name')}.{case.get('name')}")
for case in xml.etree.ElementTree.parse(sys.argv[1]).iter("testcase"):
    if case.get("name") in suites:
        continue
    count += 1
    skipped = case.find("skipped")
    if skipped is not None or case.get("status") in ("notrun", "disabled"):
        message = skipped.get("message") if skipped is not None else None
        reasons[message or "no reason given"].append(case.get("name"))
skipped = sum(map(len, reasons.values()))
print(f"test: {skipped} of {count} cases were skipped" + (":" if skipped else ""))
for reason, names in sorted(reasons.items(), key=lambda item: -len(item[1])):
    print(f"  {len(names):3} {reason}: {', '.join(names[:3])}{', …' if len(names) > 3 else ''}")
