# SPDX-License-Identifier: MIT
"""The Python packages of requirements.txt: those of this Python, else those that `./hal test` put into build/peers."""
import importlib
import os
import sys
from pathlib import Path

PEERS = Path(__file__).resolve().parents[2] / "build" / "peers" / "bin" / "python"


def package(*names):
    """The modules. A Python without them hands over to the one that has them; without that either the test ends with 77: skipped."""
    try:
        return [importlib.import_module(name) for name in names]
    except ImportError as missing:
        if PEERS.exists() and Path(sys.prefix) != PEERS.parents[1]:
            sys.stdout.flush()
            os.execv(PEERS, [str(PEERS), *sys.argv])
        print(
            f"{missing}; type: python3 -m pip install -r {Path(__file__).with_name('requirements.txt')}; ./hal test does it by itself"
        )
        sys.exit(77)


def packages():
    """(can, canopen)."""
    return tuple(package("can", "canopen"))
