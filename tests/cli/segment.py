# SPDX-License-Identifier: MIT
"""An Ethernet segment for tests: stations in network namespaces, a switch between them, all of it in namespaces of this program's own."""
import os
import re
import signal
import subprocess
import sys

from harness import HAL, Case, wait_until

MARK = "HALCYON_TEST_IN_NAMESPACE"


def enter():
    """This program again in namespaces of its own; where they are not to be had it ends with 77."""
    if os.environ.get(MARK):
        return
    for flags in (["--net", "--mount"], ["--user", "--map-root-user", "--net", "--mount"]):
        probe = "mount -t tmpfs tmpfs /run && ip netns add probe && ip -n probe link add a0 type veth peer name a1"
        if (
            subprocess.run(
                ["unshare", *flags, "sh", "-c", probe],
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            ).returncode
            == 0
        ):
            os.execvpe(
                "unshare", ["unshare", *flags, sys.executable, *sys.argv], {**os.environ, MARK: "1"}
            )
    print(
        "skipped: no network namespaces, `ip` or veth here; run it as root, or where user namespaces are allowed",
        file=sys.stderr,
    )
    sys.exit(77)


def ip(*words):
    subprocess.run(["ip", *words], check=True, stdout=subprocess.DEVNULL)


class Segment(Case):
    """Stations `names` on a switch; in each one an interface wire0."""

    names = ("m", "x")

    def setUp(self):
        super().setUp()
        self.logs = {}
        if not os.path.ismount("/run"):
            subprocess.run(["mount", "-t", "tmpfs", "tmpfs", "/run"], check=True)
        for name in ("switch", *self.names):
            self.addCleanup(subprocess.run, ["ip", "netns", "delete", name])
            ip("netns", "add", name)
            subprocess.run(
                [
                    "ip",
                    "netns",
                    "exec",
                    name,
                    "sysctl",
                    "-qw",
                    "net.ipv6.conf.all.disable_ipv6=1",
                    "net.ipv6.conf.default.disable_ipv6=1",
                ],
                stderr=subprocess.DEVNULL,
            )
        ip(
            "-n",
            "switch",
            "link",
            "add",
            "bridge0",
            "type",
            "bridge",
            "stp_state",
            "0",
            "forward_delay",
            "0",
            "mcast_snooping",
            "0",
        )
        ip("-n", "switch", "link", "set", "bridge0", "up")
        for name in self.names:
            ip(
                "-n",
                "switch",
                "link",
                "add",
                f"to-{name}",
                "type",
                "veth",
                "peer",
                "name",
                "wire0",
                "netns",
                name,
            )
            ip("-n", "switch", "link", "set", f"to-{name}", "master", "bridge0", "up")
            ip("-n", name, "link", "set", "wire0", "up")
            ip("-n", name, "link", "set", "lo", "up")
        for name in self.names:
            wait_until(
                lambda: ",LOWER_UP" in self.at(name, "ip", "link", "show", "wire0").stdout,
                f"the line of {name} is there",
            )

    def at(self, name, *words, **how):
        """A command in the station's namespace, to its end."""
        return subprocess.run(
            ["ip", "netns", "exec", name, *map(str, words)],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            cwd=self.folder,
            **{"timeout": 240, **how},
        )

    def mac(self, name):
        return re.search(r"link/ether (\S+)", self.at(name, "ip", "link", "show", "wire0").stdout)[
            1
        ]

    def cable(self, name, plugged):
        """Pulls the station's cable out at the switch, or puts it in: its own interface stays up, without a carrier."""
        ip("-n", "switch", "link", "set", f"to-{name}", "up" if plugged else "down")

    def station(self, name, text):
        """`hal run` of a netlist at a station; a restart appends to the same log."""
        self.write(f"{name}.hal", text)
        log = self.logs.setdefault(name, self.folder / f"{name}.log")
        with open(log, "a") as out:
            process = subprocess.Popen(
                [
                    "ip",
                    "netns",
                    "exec",
                    name,
                    HAL,
                    "run",
                    "--name",
                    f"test-{name}",
                    "--no-picture",
                    f"{name}.hal",
                ],
                cwd=self.folder,
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=out,
            )
        self.addCleanup(self.stop, process)
        return process

    @staticmethod
    def stop(process, number=signal.SIGINT):
        if process.poll() is None:
            process.send_signal(number)
        try:
            process.wait(60)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def said(self, name):
        return self.logs[name].read_text()

    def all_said(self):
        return "".join(f"--- {name}:\n{self.said(name)}" for name in self.logs)

    def pin(self, name, pin):
        return self.value(f"tdma.0.{pin}", instance=f"test-{name}")

    def number(self, name, pin):
        return int(self.pin(name, pin), 0)

    def wait_for(self, name, pin, value):
        try:
            wait_until(lambda: self.pin(name, pin) == value, f"{pin} of {name} is {value}")
        except AssertionError as late:
            raise AssertionError(f"{late}\n{self.all_said()}") from None

    def wait_for_words(self, name, words, times=1):
        try:
            wait_until(lambda: self.said(name).count(words) >= times, f"{name} prints '{words}'")
        except AssertionError as late:
            raise AssertionError(f"{late}\n{self.all_said()}") from None
