# SPDX-License-Identifier: MIT
"""A separate network namespace for a test: its addresses and ports are separate from those of other tests."""
import fcntl
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

VARIABLE = "HALCYON_OWN_NETWORK"


def own_network():
    """Starts the script once more in network and mount namespaces of its own, with nothing but `lo` and with folders /dev/shm and /run of its own.
    False where these cannot be made."""
    if os.environ.get(VARIABLE) == "1":
        return True
    words = ["unshare", "--net", "--mount", *([] if os.geteuid() == 0 else ["--map-root-user"])]
    prepare = "ip link set lo up && mount -t tmpfs tmpfs /dev/shm && mount -t tmpfs tmpfs /run"
    if not shutil.which("unshare") or not shutil.which("ip"):
        return False
    if (
        subprocess.run(
            [*words, "sh", "-c", prepare], stdin=subprocess.DEVNULL, capture_output=True
        ).returncode
        != 0
    ):
        return False
    os.environ[VARIABLE] = "1"
    sys.stdout.flush()
    os.execvp(
        "unshare", [*words, "sh", "-c", prepare + ' && exec "$@"', "sh", sys.executable, *sys.argv]
    )


def dds_domain():
    """A domain that no other test has while this process runs: any in a network of one's own; else one that is locked, with ports below those
    that the kernel gives to everybody (7400 + 250 * 100 < 32768)."""
    if own_network():
        return 7
    for number in range(1, 101):
        try:
            file = os.open(
                Path(tempfile.gettempdir()) / f"halcyon-dds-domain-{number}",
                os.O_RDWR | os.O_CREAT,
                0o666,
            )  # stays open
        except OSError:
            continue
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return number
        except OSError:
            os.close(file)
    sys.exit("own_network.py: all DDS domains from 1 to 100 are locked")
