#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""skipped.py RESULTS.xml [PACKAGES]: why tests were left out, and how many for each reason, from what `ctest --output-junit` wrote; and which
packages of the tree are not in the build, whose tests are not in the results, from the table that CMake made."""
import collections
import re
import sys
import xml.etree.ElementTree as xml
from pathlib import Path

reasons = collections.Counter()
for case in xml.parse(sys.argv[1]).iter("testcase"):
    said = (case.findtext("system-out") or "").strip()
    if case.find("skipped") is None:
        # A program of many tests: GoogleTest's short output has the reasons of those that it skipped.
        reasons.update(
            found[1].strip() for found in re.finditer(r": Skipped\n(.*?)\n\n", said + "\n\n", re.S)
        )
        continue
    if not case.find("skipped").get("message").startswith("SKIP_"):
        continue  # a test whose program is missing: it counts as failed
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
for table in map(Path, sys.argv[2:]):
    for row in table.read_text(encoding="utf-8").splitlines():
        name, reason = row.split(" ", 1)
        reason = f"{reason}=OFF" if reason.startswith("HALCYON_PACKAGE_") else f"needs {reason}"
        print(f"     all  of the package {name}: {reason}")
