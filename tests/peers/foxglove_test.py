#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: panel
"""foxglove_test.py HAL: the npm package @foxglove/ws-protocol is a client of `hal panel`, by both names of the protocol. The package is installed in
build/peers/foxglove. 77: node, npm, its registry or hal-panel are missing."""
import os
import shutil
import subprocess
import sys
from pathlib import Path

from checks import skip

HERE = Path(__file__).resolve().parent
os.environ["HAL_BIN"] = sys.argv[1]
sys.path.insert(0, str(HERE.parent / "cli"))
from harness import SERVO, Case  # noqa: E402
from web import PANEL, start_panel  # noqa: E402

FILES = ("package.json", "package-lock.json", "client.mjs")
TARGET = HERE.parents[1] / "build" / "peers" / "foxglove"
NETLIST = (
    SERVO
    + """loadrt siggen names=wave
loadrt comp names=above
addf wave.update servo
addf above servo
setp wave.frequency 5
net sine wave.sine => above.in1
net high above.out
start
"""
)
CHECKS = 14


def install():
    """The package of the lock file, once."""
    wanted = "".join((HERE / "foxglove" / name).read_text() for name in FILES[:2])
    stamp = TARGET / "installed"
    TARGET.mkdir(parents=True, exist_ok=True)
    for name in FILES:
        shutil.copy(HERE / "foxglove" / name, TARGET / name)
    if not stamp.exists() or stamp.read_text() != wanted:
        done = subprocess.run(
            ["npm", "ci", "--no-fund", "--no-audit", "--ignore-scripts"],
            cwd=TARGET,
            capture_output=True,
            text=True,
        )
        if done.returncode != 0:
            skip(
                f"@foxglove/ws-protocol cannot be installed here: {(done.stderr.strip().splitlines() or ['no reason given'])[-1]}"
            )
        stamp.write_text(wanted)


class Peer(Case):
    def runTest(self):
        pass


if not PANEL.exists():
    skip("hal-panel is not built: install libwebsockets-dev and libpugixml-dev")
if not shutil.which("node") or not shutil.which("npm"):
    skip("node or npm is missing; type: apt-get install nodejs npm")
install()
case = Peer()
case.setUp()
checks = []
try:
    case.start("run", case.write("m.hal", NETLIST))
    _, port, token = start_panel(case, "--write")
    for name in ("foxglove.sdk.v1", "foxglove.websocket.v1"):
        client = subprocess.run(
            ["node", TARGET / "client.mjs", f"ws://localhost:{port}/?t={token}", name],
            capture_output=True,
            text=True,
            timeout=120,
        )
        print(f"{name}:\n{client.stdout}{client.stderr}", end="")
        checks += client.stdout.splitlines()
finally:
    case.doCleanups()
good = sum(line.startswith("ok ") for line in checks)
print(f"{good} of {len(checks)} checks hold")
sys.exit(0 if good == len(checks) == 2 * CHECKS else 1)
