# SPDX-License-Identifier: MIT
"""The Python packages canopen and python-can: those of this Python, else those that `./hal test` put into build/peers."""
import os
import sys
from pathlib import Path

PEERS = Path(__file__).resolve().parents[2] / "build" / "peers" / "bin" / "python"


def packages():
    """(can, canopen). A Python without them hands over to the one that has them; without that either the test ends with 77: skipped."""
    try:
        import can
        import canopen
    except ImportError as missing:
        if PEERS.exists() and Path(sys.prefix) != PEERS.parents[1]:
            sys.stdout.flush()
            os.execv(PEERS, [str(PEERS), *sys.argv])
        print(f"{missing}; type: python3 -m pip install -r {Path(__file__).with_name('requirements.txt')}; ./hal test does it by itself")
        sys.exit(77)
    return can, canopen
