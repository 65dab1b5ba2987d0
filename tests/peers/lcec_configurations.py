#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Loads ethercat-conf.xml files of other people's machines: lcec_configurations.py HAL FOLDER

HAL is our program, FOLDER has the files, at any depth. Each one is loaded by the component lcec in
`hal check`, which needs neither a bus nor ethercat.conf. Files beside it that it names (initCmds)
must be there as well. Prints the number that load, and for each other one the first error."""
import re
import subprocess
import sys
import tempfile
from pathlib import Path


def check(hal, path):
    """Returns the errors of a file."""
    with tempfile.TemporaryDirectory() as folder:
        netlist = Path(folder, "check.hal")
        netlist.write_text(f"loadrt lcec config={path.resolve()}\n")
        done = subprocess.run(
            [hal, "check", str(netlist)], capture_output=True, text=True, timeout=60
        )
    return [
        line for line in done.stderr.splitlines() + done.stdout.splitlines() if ": error: " in line
    ]


def main():
    hal, folder = sys.argv[1], Path(sys.argv[2])
    loaded, failed = 0, []
    for path in sorted(folder.rglob("*.xml")):
        if b"<masters" not in path.read_bytes():
            continue
        errors = check(hal, path)
        if errors:
            failed.append((path.relative_to(folder), errors))
        else:
            loaded += 1
    print(f"{loaded} of {loaded + len(failed)} load")
    for path, errors in failed:
        reason = re.sub(r"^.*?: error: ", "", errors[0])
        print(f"  {path}: {reason}" + (f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""))
    return 0 if not failed else 1


if __name__ == "__main__":
    sys.exit(main())
