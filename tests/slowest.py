#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""slowest.py RESULTS.xml [COUNT]: the slowest tests (20), from what `ctest --output-junit` wrote, slowest first."""
import sys
import xml.etree.ElementTree as xml


def durations(path):
    """The duration in seconds and the name of each test that ran, slowest first."""
    ran = [
        (float(case.get("time", "0")), case.get("name", ""))
        for case in xml.parse(path).iter("testcase")
        if case.get("status") != "disabled" and case.find("skipped") is None
    ]
    return sorted(ran, key=lambda test: (-test[0], test[1]))


def table(path, count=20):
    """The lines of the table."""
    ran = durations(path)
    slowest = ran[:count]
    total = sum(seconds for seconds, _ in ran)
    share = 100 * sum(seconds for seconds, _ in slowest) / total if total else 0
    heading = f"the {len(slowest)} slowest of {len(ran)} tests: {share:.0f} % of {total:.0f} s"
    return [heading] + [f"    {seconds:>7.1f} s  {name}" for seconds, name in slowest]


if __name__ == "__main__":
    print("\n".join(table(sys.argv[1], *map(int, sys.argv[2:]))))
