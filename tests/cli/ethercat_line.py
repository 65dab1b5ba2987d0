# SPDX-License-Identifier: MIT
"""An emulated EtherCAT line at one end of a veth pair: m0 is for the master, s0 for the line. For our master and those of others."""
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

from own_network import own_network

MISSING = "no network namespaces here; run it as root, or where user namespaces are allowed"


def up(interface):
    return (
        ",LOWER_UP"
        in subprocess.run(["ip", "link", "show", interface], capture_output=True, text=True).stdout
    )


def veth():
    """Makes m0 and s0 and waits until both have a link. False where there are no veth pairs."""
    if (
        subprocess.run(
            ["ip", "link", "add", "m0", "type", "veth", "peer", "name", "s0"], capture_output=True
        ).returncode
        != 0
    ):
        return False
    for interface in ("m0", "s0"):
        subprocess.run(["ip", "link", "set", interface, "up"], check=True)
    wait_for(lambda: up("m0") and up("s0"))
    return True


def network():
    """Moves the script into a network of its own with m0 and s0; ends it with 77 where that is not possible."""
    if not own_network():
        print(MISSING)
        sys.exit(77)
    if not veth():
        print("no veth pairs here")
        sys.exit(77)


def wait_for(condition, seconds=30.0):
    """Calls `condition` until it returns something true, for at most this time. Returns its last result."""
    end = time.monotonic() + seconds
    while not (answer := condition()) and time.monotonic() < end:
        time.sleep(0.002)
    return answer


class Line:
    """`hal node ethercat` with a device per line of `devices`."""

    def __init__(self, hal, folder, devices, *words):
        (folder / "devices.line").write_text(devices)
        self.log = folder / "line.txt"
        with open(self.log, "w", encoding="utf-8") as out:
            self.process = subprocess.Popen(
                [hal, "node", "ethercat", folder / "devices.line", "--link", "eth:s0", *words],
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=out,
            )
        if (
            not wait_for(lambda: "press Ctrl-C" in self.said() or self.process.poll() is not None)
            or self.process.poll() is not None
        ):
            self.process.kill()
            raise AssertionError("the line does not start: " + self.said())

    def said(self):
        return self.log.read_text()

    def end(self):
        self.process.terminate()
        return self.process.wait(60)


@contextmanager
def line(hal, devices):
    """A line in a folder of its own, which ends with status 0."""
    with tempfile.TemporaryDirectory(prefix="hal-line-") as folder:
        node = Line(hal, Path(folder), devices)
        try:
            yield node
        finally:
            if (status := node.end()) != 0:
                raise AssertionError(f"the line ended with status {status}: " + node.said())
