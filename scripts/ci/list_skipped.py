#!/usr/bin/env python3
"""Prints the tests that ctest skipped, by reason.   list_skipped.py TESTS.xml (of ctest --output-junit)"""
import collections
import re
import sys
import xml.etree.ElementTree

reasons = collections.defaultdict(list)
cases = list(xml.etree.ElementTree.parse(sys.argv[1]).iter("testcase"))
for case in cases:
    skipped = case.find("skipped")
    if skipped is None and case.get("status") not in ("notrun", "disabled"):
        continue
    output = case.findtext("system-out") or ""
    # GoogleTest prints the place of GTEST_SKIP(), "Skipped", and its message.
    said = re.search(r": Skipped\n(.+?)\n", output)
    message = skipped.get("message") if skipped is not None else None
    reasons[said.group(1).strip() if said else message or "no reason given"].append(case.get("name"))
count = sum(map(len, reasons.values()))
print(f"test: {count} of {len(cases)} tests were skipped" + (":" if count else ""))
for reason, names in sorted(reasons.items(), key=lambda item: -len(item[1])):
    print(f"  {len(names):3} {reason}: {', '.join(names[:3])}{', …' if len(names) > 3 else ''}")
