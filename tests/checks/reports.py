#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""reports.py ROOT: runs the scripts that summarise a run of the tests on a small run, and compares what they print."""
import subprocess
import sys
import tempfile
from pathlib import Path

RESULTS = """<?xml version="1.0" encoding="UTF-8"?>
<testsuite name="Linux-c++" tests="5" failures="1" disabled="0" skipped="1" time="9">
  <testcase name="netlists/abs" classname="netlists/abs" time="0.25" status="run"/>
  <testcase name="cli/run_test" classname="cli/run_test" time="6" status="run"/>
  <testcase name="cli/drive_test" classname="cli/drive_test" time="1.75" status="fail">
    <failure message="Failed"/>
  </testcase>
  <testcase name="cli/abc_test" classname="cli/abc_test" time="1.75" status="run"/>
  <testcase name="peers/dds_cyclone_test" classname="peers/dds_cyclone_test" time="30" status="notrun">
    <skipped message="SKIP_RETURN_CODE=77"/>
    <system-out>cyclonedds is not installed
</system-out>
  </testcase>
  <testcase name="unit_tests/1" classname="unit_tests/1" time="0" status="notrun">
    <skipped message="Unable to find executable"/>
    <system-out>Unable to find executable: unit_tests
</system-out>
  </testcase>
</testsuite>
"""
PACKAGES = "vision HALCYON_PACKAGE_VISION\npython a build without sanitizers\n"
EXPECTED = {
    (
        "slowest.py",
    ): """the 4 slowest of 4 tests: 100 % of 10 s
        6.0 s  cli/run_test
        1.8 s  cli/abc_test
        1.8 s  cli/drive_test
        0.2 s  netlists/abs
""",
    (
        "slowest.py",
        "1",
    ): """the 1 slowest of 4 tests: 62 % of 10 s
        6.0 s  cli/run_test
""",
    ("skipped.py",): "       1  cyclonedds is not installed\n",
    (
        "skipped.py",
        "packages_left_out",
    ): """       1  cyclonedds is not installed
     all  of the package vision: HALCYON_PACKAGE_VISION=OFF
     all  of the package python: needs a build without sanitizers
""",
}


def main(root):
    failures = 0
    with tempfile.TemporaryDirectory() as folder:
        results = Path(folder) / "results.xml"
        results.write_text(RESULTS)
        (Path(folder) / "packages_left_out").write_text(PACKAGES)
        for (script, *arguments), expected in EXPECTED.items():
            command = [
                sys.executable,
                str(Path(root).resolve() / "tests" / script),
                str(results),
                *arguments,
            ]
            printed = subprocess.run(command, cwd=folder, stdout=subprocess.PIPE, text=True).stdout
            if printed != expected:
                failures += 1
                print(f"{' '.join([script, *arguments])} prints\n{printed}expected:\n{expected}")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
