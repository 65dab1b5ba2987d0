# SPDX-License-Identifier: MIT
"""An emulated Mesa card in a network namespace of its own, and a driver under `hal run` that reaches it over a veth pair: what the tests of Mesa's peers share."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from checks import check, checked, skip, wait_for

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests/cli"))
from own_network import own_network  # noqa: E402

MODULES = Path(os.environ.get("HAL_RTMOD_DIR", "/usr/lib/linuxcnc/modules"))
HAL = str(Path(sys.argv[1]).resolve())
HOST = "10.10.10.10"
SETTINGS = (("watchdog.timeout_ns", 1000000000), ("packet-error-limit", 1000000))


def hm2_eth_netlist(card, config, between="", settings=""):
    """Loads LinuxCNC's driver. `between`: lines between its functions; `settings`: further ones."""
    loads = f'loadrt hostmot2\nloadrt hm2_eth board_ip={HOST} config="{config}"'
    return netlist(card, loads, between, settings)


def native_netlist(card, config):
    return netlist(card, f'loadrt mesa board=eth:{HOST} config="{config}"')


def netlist(card, loads, between="", settings=""):
    """A busy host loses packets: the driver may not give up for that."""
    lines = ["loadrt threads name1=servo period1=4000000", loads, f"addf {card}.read servo"]
    lines += [between, f"addf {card}.write servo"]
    lines += [f"setp {card}.{name} {value}" for name, value in SETTINGS]
    return "\n".join(lines + [settings, "start"]) + "\n"


class Machine:
    """A card and its driver, in a folder for their files."""

    def __init__(self, folder):
        self.folder = folder
        environment = {"HOME": str(folder), "XDG_STATE_HOME": str(folder)}
        self.environment = os.environ | environment | {"HAL_RTMOD_DIR": str(MODULES)}
        self.running = []

    def start(self, log, *command):
        with open(self.folder / log, "w") as out:
            process = subprocess.Popen(
                command,
                cwd=self.folder,
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=subprocess.STDOUT,
            )
        self.running.append(process)
        return process

    def run(self, *command):
        return subprocess.run(command, capture_output=True, text=True, env=self.environment)

    def connect(self):
        """Makes the veth pair, m0 here and s0 beside the card. Returns whether that is possible."""
        inside = self.start("namespace.log", "unshare", "--net", "sleep", "600")
        here = os.readlink("/proc/self/ns/net")
        wait_for(lambda: os.readlink(f"/proc/{inside.pid}/ns/net") != here)
        enter = ("nsenter", "--target", str(inside.pid), "--net")
        peer = ("peer", "name", "s0", "netns", str(inside.pid))
        commands = (
            ("ip", "link", "add", "m0", "type", "veth", *peer),
            ("ip", "addr", "add", "10.10.10.1/24", "dev", "m0"),
            ("ip", "link", "set", "m0", "up"),
            (*enter, "ip", "addr", "add", f"{HOST}/24", "dev", "s0"),
            (*enter, "ip", "link", "set", "s0", "up"),
        )
        self.enter = enter
        return not any(self.run(*command).returncode for command in commands)

    def start_card(self, text):
        """Starts a card; returns its process."""
        (self.folder / "card.mesa").write_text(text)
        fast = ("chrt", "--fifo", "30")
        real_time = fast if self.run(*fast, "true").returncode == 0 else ()
        node = (*real_time, HAL, "node", "mesa", "card.mesa", "--address", HOST, "--verbose")
        card = self.start("card.log", *self.enter, *node)
        check("the card starts", wait_for(lambda: f" at {HOST}" in self.log("card.log")))
        return card

    def load(self, netlist):
        """Runs a netlist. One late answer among some thousand ends the load of hm2_eth (it has no retries), so a busy host needs several attempts. None: none
        succeeded."""
        (self.folder / "mill.hal").write_text(netlist)
        for _ in range(20):
            run = self.start("hal.log", HAL, "run", "mill.hal", "--no-picture")
            wait_for(lambda: "hal shell" in self.log("hal.log") or run.poll() is not None, 60)
            if run.poll() is None:
                return run
            self.running.remove(run)
        check("the driver loads", False, self.log("hal.log")[-2000:])
        return None

    def stop(self, process):
        self.running.remove(process)
        process.terminate()
        process.wait(60)

    def log(self, name):
        return (self.folder / name).read_text()

    def get(self, pin):
        return self.run(HAL, "shell", "getp", pin).stdout.strip()

    def set(self, pin, value):
        done = self.run(HAL, "shell", "setp", pin, str(value))
        if done.returncode:
            check(f"setp {pin} {value}", False, done.stdout, done.stderr)

    def end(self):
        for process in reversed(self.running):
            process.terminate()
            process.wait(60)


def drive_machine(make, *steps):
    """Calls each step with `make(folder)`, a Machine that is connected, and ends the program. 77: LinuxCNC's modules or network namespaces are missing."""
    if not (MODULES / "hm2_eth.so").exists():
        skip("LinuxCNC's hm2_eth is missing; type: apt-get install linuxcnc-uspace")
    if not own_network():
        skip("no network namespaces here; run it as root, or where user namespaces are allowed")
    with tempfile.TemporaryDirectory(prefix="hal-hm2-") as name:
        machine = make(Path(name))
        try:
            if not machine.connect():
                skip("no veth pairs here")
            for step in steps:
                step(machine)
        finally:
            machine.end()
    sys.exit(checked())
