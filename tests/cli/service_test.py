#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""`hal run` as a service: readiness, the watchdog and the end, as systemd receives them; and what hal doctor --fix carries out."""
import contextlib
import os
import queue
import shutil
import signal
import socket
import subprocess
import threading
import time
import unittest

from harness import HAL, SERVO, TIMEOUT, Case, wait_until

STALL = """newthread servo 1000000
loadrt stall names=s file=events.txt
addf s servo
"""


class Service(Case):
    def setUp(self):
        super().setUp()
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.settimeout(0.1)
        self.addCleanup(self.socket.close)
        self.messages, self.ending = queue.Queue(), False

    def listen(self, address):
        self.socket.bind(address)
        reader = threading.Thread(
            target=self.read
        )  # as systemd, it reads at once: a socket holds few messages
        reader.start()
        self.addCleanup(reader.join)
        self.addCleanup(setattr, self, "ending", True)
        self.environment["NOTIFY_SOCKET"] = address.replace("\0", "@")

    def read(self):
        while not self.ending:
            with contextlib.suppress(TimeoutError):
                self.messages.put(self.socket.recv(4096).decode())
        self.socket.close()

    def receive(self, timeout=TIMEOUT):
        """The next message, or None."""
        with contextlib.suppress(queue.Empty):
            return self.messages.get(timeout=timeout)

    def until(self, text):
        deadline = time.monotonic() + TIMEOUT
        while (message := self.receive()) is not None and time.monotonic() < deadline:
            if message == text:
                return
        self.fail(f"{text!r} is not sent")

    def test_reports_ready_and_stopping_and_does_not_pass_the_socket_on(self):
        self.listen(str(self.folder / "notify"))
        netlist = self.write("a.hal", "loadusr -w sh show.sh\n" + SERVO)
        self.write("show.sh", 'echo "socket: $NOTIFY_SOCKET"\n')
        machine = self.start("run", netlist)
        self.assertEqual(
            "READY=1\nSTATUS=machine 'default' runs; to control it: hal shell --name default",
            self.receive(),
        )
        self.assertIsNone(self.receive(0.3), "without WatchdogSec= nothing else is sent")
        out, err = self.end(machine)
        self.assertEqual("STOPPING=1", self.receive())
        self.assertIn("socket: \n", out + err)

    def test_feeds_the_watchdog_while_every_thread_makes_progress_and_not_while_one_hangs(self):
        self.listen(f"\0halcyon-test-{os.getpid()}")
        self.environment["WATCHDOG_USEC"] = "400000"
        machine = self.start("run", self.write("a.hal", STALL))
        self.assertTrue(self.receive().startswith(("READY=1\n", "WATCHDOG=1")))
        self.until("WATCHDOG=1")
        self.until("WATCHDOG=1")
        self.shell("setp", "s.mode", "1")
        wait_until(lambda: self.receive(0.6) is None, "the watchdog is no longer fed")
        self.assertIsNone(self.receive(1.0))
        machine.send_signal(signal.SIGKILL)

    def test_the_watchdog_ends_with_the_machine_and_belongs_to_one_process(self):
        self.listen(str(self.folder / "notify"))
        self.environment.update(WATCHDOG_USEC="400000")
        machine = self.start("run", self.write("a.hal", SERVO))
        while not self.receive().startswith("READY=1"):
            pass  # signs of life may come first; a machine that is ended before sends nothing
        self.end(machine)
        self.until("STOPPING=1")
        while self.receive(0.3) is not None:
            pass  # a last sign of life may follow
        self.environment.update(WATCHDOG_PID="1")
        machine = self.start("run", self.write("b.hal", SERVO))
        self.assertTrue(self.receive().startswith("READY=1"))
        self.assertIsNone(self.receive(0.5))
        self.end(machine)

    def test_a_watchdog_without_a_thread_is_an_error(self):
        self.listen(str(self.folder / "notify"))
        said = self.bad(
            "run", self.write("a.hal", "newsig a bit\n"), environment={"WATCHDOG_USEC": "400000"}
        )
        self.assertEqual(
            "hal run: WatchdogSec= of the service needs a thread whose progress feeds the watchdog; the netlist has none\n",
            said,
        )
        said = self.bad(
            "run",
            self.write("b.hal", SERVO),
            "--watchdog",
            "/dev/null",
            environment={"WATCHDOG_USEC": "400000"},
        )
        self.assertEqual(
            "hal run: --watchdog and WatchdogSec= of the service exclude each other; leave one out\n",
            said,
        )

    def test_a_service_manager_that_does_not_read_does_not_stop_the_end(self):
        address = str(self.folder / "deaf")
        self.socket.bind(address)
        self.environment.update(NOTIFY_SOCKET=address, WATCHDOG_USEC="4000")
        machine = self.start("run", self.write("a.hal", SERVO))
        self.socket.setblocking(False)
        with self.assertRaises(BlockingIOError), socket.socket(
            socket.AF_UNIX, socket.SOCK_DGRAM
        ) as other:
            other.setblocking(False)
            while True:  # until it holds no more
                other.sendto(b"full", address)
        self.end(machine)

    def test_a_missing_service_manager_changes_nothing(self):
        self.environment["NOTIFY_SOCKET"] = str(self.folder / "nobody")
        out, err = self.end(self.start("run", self.write("a.hal", SERVO)))
        self.assertEqual("", err)


class Fix(Case):
    """The commands run in a PATH where each is a script that records its arguments."""

    def setUp(self):
        super().setUp()
        self.tools = self.folder / "tools"
        self.tools.mkdir()
        for name in ("setcap", "groupadd", "usermod", "chgrp", "chmod", "tee", "apt-get"):
            self.script(name, f'echo {name} "$@" >>{self.folder}/calls')
        self.environment["PATH"] = f"{self.tools}:/usr/bin:/bin"

    def script(self, name, text):
        path = self.tools / name
        path.write_text(f"#!/bin/sh\n{text}\n")
        path.chmod(0o755)

    def calls(self):
        path = self.folder / "calls"
        return path.read_text().splitlines() if path.exists() else []

    def commands(self, out):
        return [
            line.strip() for line in out.partition("\n\n")[2].splitlines() if line.startswith("  ")
        ]

    def test_asks_before_each_command_and_runs_only_what_was_agreed_to(self):
        out = self.good("doctor", "--fix", given="n\n" * 20)
        if "nothing to fix" in out:
            self.skipTest("nothing is missing on this machine")
        commands = self.commands(out)
        self.assertEqual([], self.calls())
        self.assertEqual(len(commands), out.count("run it? [y/N] "), out)
        self.assertEqual(len(commands), out.count("left as it is\n"))
        self.assertEqual(len(commands), len(set(commands)), "a command is offered once")
        out = self.good("doctor", "--fix", given="y\n" + "n\n" * 20)
        self.assertEqual(
            (1, len(commands) - 1), (out.count("done\n"), out.count("left as it is\n")), out
        )
        self.assertTrue(self.calls())
        if os.geteuid() == 0:
            self.assertFalse(any("sudo" in command for command in commands), commands)

    def test_a_failed_command_is_reported_and_the_others_still_run(self):
        for name in ("setcap", "apt-get", "groupadd", "tee"):
            self.script(name, f"echo {name} >>{self.folder}/calls; exit 3")
        done = self.run_program("doctor", "--fix", "--yes")
        if "nothing to fix" in done.stdout:
            self.skipTest("nothing is missing on this machine")
        commands = self.commands(done.stdout)
        self.assertEqual(1, done.returncode)
        self.assertEqual(
            [f"hal doctor: failed with status 3: {command}" for command in commands],
            done.stderr.splitlines(),
        )
        self.assertEqual(len(commands), len(self.calls()))

    @unittest.skipUnless(os.geteuid() == 0 and shutil.which("setpriv"), "needs root and setpriv")
    def test_where_the_capabilities_are_withheld_setcap_is_not_offered(self):
        os.chmod(self.folder, 0o755)
        withheld = "--bounding-set=-sys_nice,-ipc_lock,-net_raw"
        netlist = self.write("a.hal", SERVO)
        sockets = self.folder / "sockets"
        sockets.mkdir(0o700)
        os.chown(sockets, 65534, 65534)
        done = subprocess.run(
            [
                "setpriv",
                withheld,
                "--inh-caps=-all",
                "--reuid=65534",
                "--regid=65534",
                "--clear-groups",
                str(HAL),
                "run",
                netlist,
                "--for",
                "50ms",
            ],
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
            env=self.environment | {"XDG_RUNTIME_DIR": str(sockets)},
            timeout=TIMEOUT,
        )
        notices = [line for line in (done.stdout + done.stderr).splitlines() if " here: " in line]
        self.assertEqual(
            [
                "no real-time scheduling and memory locking here: threads are late under load, and a page fault can delay a cycle; grant it with: "
                "--cap-add=SYS_NICE --cap-add=IPC_LOCK --cap-add=NET_RAW in the command that starts this container, which withholds them "
                "(or by limits of a group: hal doctor)"
            ],
            notices,
            done.stdout + done.stderr,
        )
        done = subprocess.run(
            ["setpriv", withheld, "--inh-caps=-all", str(HAL), "doctor", "--seconds", "0"],
            capture_output=True,
            text=True,
            timeout=TIMEOUT,
        )
        self.assertNotIn("setcap", done.stdout)

    @unittest.skipUnless(os.geteuid() == 0, "needs root")
    def test_without_sudo_an_ordinary_user_reads_what_root_types(self):
        os.chmod(self.folder, 0o755)
        path = str(self.folder / "empty")
        done = subprocess.run(
            [
                "/usr/sbin/runuser",
                "-u",
                "nobody",
                "--",
                "env",
                f"PATH={path}",
                f"HOME={self.folder}",
                str(HAL),
                "doctor",
                "--fix",
            ],
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
        )
        if "nothing to fix" in done.stdout:
            self.skipTest("nothing is missing on this machine")
        self.assertEqual((1, "hal doctor: the fixes need root\n"), (done.returncode, done.stderr))
        self.assertIn("sudo is not installed; as root (su -), type:\n  ", done.stdout)
        typed = done.stdout.partition("as root (su -), type:")[2]
        self.assertNotIn("sudo", typed)
        self.assertNotIn("$USER", typed, "which is root in that shell")


if __name__ == "__main__":
    unittest.main()
