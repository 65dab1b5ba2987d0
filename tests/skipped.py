#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""skipped.py RESULTS.xml: why tests were left out, and how many for each reason, from what `ctest --output-junit` wrote."""
import collections
import re
import sys
import xml.etree.ElementTree as xml

reasons = collections.Counter()
for case in xml.parse(sys.argv[1]).iter("testcase"):
    said = (case.findtext("system-out") or "").strip()
    if case.find("skipped") is None:
        # A program of many tests: GoogleTest's short output has the reasons of those that it skipped.
        reasons.update(
            found[1].strip() for found in re.finditer(r": Skipped\n(.*?)\n\n", said + "\n\n", re.S)
        )
        continue
    googletest = re.search(r": Skipped\n(.*?)\n\[  SKIPPED ", said, re.S)
    reasons[
        googletest[1].strip()
        if googletest
        else said.splitlines()[-1]
        if said
        else "no reason given"
    ] += 1
for reason, count in sorted(reasons.items()):
    print(f"    {count:>4}  {reason}")
