#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The life of programs: names that are taken and released, waiting that reports and ends, machines that are killed, programs that hang."""

import contextlib
import os
import re
import signal
import socket
import subprocess
import sys
import unittest
from pathlib import Path

from harness import HAL, PLUGINS, SANITIZED, SERVO, Case, wait_until

MODULE = HAL.parent.parent / "python"
FOLLOW = Path(__file__).parent / "sources/follow.c"
HANG = Path(__file__).parent / "sources/hang.c"

# registers as the name it is given after a while, and takes its time to end
SLOW = """import hal, sys, time
time.sleep(float(sys.argv[2]))
c = hal.component(sys.argv[1])
c.newpin("out", hal.HAL_FLOAT, hal.HAL_OUT, safe=-1.0)
c.ready()
c["out"] = float(sys.argv[3])
try:
    while True: time.sleep(0.01)
except KeyboardInterrupt:
    time.sleep(float(sys.argv[4]))
"""

ECHO = """import hal, time
c = hal.component("echo", timeout=0.1, every=0.1)
c.newpin("in", hal.HAL_FLOAT, hal.HAL_IN)
c.newpin("out", hal.HAL_FLOAT, hal.HAL_OUT, safe=-1.0)
c.newpin("hang", hal.HAL_BIT, hal.HAL_IN)
c.ready()
while True:
    c["out"] = c["in"] * 2
    if c["hang"]:
        c["out"] = 77
        time.sleep(0.05)
        while True: pass
    time.sleep(0.005)
"""


def lives(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


class LifeCase(Case):
    def setUp(self):
        super().setUp()
        self.environment["PYTHONPATH"] = str(MODULE)
        self.environment["PATH"] = f"{HAL.parent}:{self.environment['PATH']}"
        self.write("slow.py", SLOW)
        self.write("echo.py", ECHO)

    def machine(self, netlist=SERVO + "start\n"):
        return self.start("run", "--no-picture", self.write("machine.hal", netlist))

    def say(self, *words):
        done = self.shell(*words)
        # on a busy host a program may take more than a second to register
        errors = re.sub(r"(?m)^loadusr: waiting for component .*\n", "", done.stderr)
        self.assertEqual((0, ""), (done.returncode, errors), done.stdout)
        return done.stdout

    def refused(self, *words):
        done = self.shell(*words)
        self.assertEqual(1, done.returncode, done.stdout)
        return done.stderr

    def row(self, name):
        return next(
            (
                line.split(None, 4)
                for line in self.shell("show", "comp", name).stdout.splitlines()
                if f" {name} " in line
            ),
            None,
        )

    def state(self, name):
        row = self.row(name)
        return row[-1] if row else ""

    def pid(self, name):
        return int(self.row(name)[3])

    def background(self, *words, **more):
        program = subprocess.Popen(
            words,
            cwd=self.folder,
            env={**self.environment, **more},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(self.end, program, signal.SIGKILL)
        return program


@unittest.skipUnless(list(MODULE.glob("hal/_core*.so")), "the module is not built")
class Names(LifeCase):
    def slow(self, name, before="0", value="1", after="0"):
        return [sys.executable, "slow.py", name, before, value, after]

    def test_a_program_is_restarted_under_its_name(self):
        self.machine()
        self.say("loadusr", "-Wn", "uc", *self.slow("uc", after="0.3"))
        for turn in range(2, 8):
            (
                self.say("net", "level", "uc.out", "adder.in1")
                if turn == 2
                else self.say("net", "level", "uc.out")
            )
            self.say("unload", "uc")
            self.say("loadusr", "-Wn", "uc", *self.slow("uc", "0.1", str(turn), "0.3"))
            self.assertEqual("ready", self.state("uc"))
            self.say("net", "level", "uc.out")
            wait_until(
                lambda: self.value("adder.in1") == str(turn), "the new program's value arrives"
            )
            self.assertEqual(["uc", "sum2", "threads"], self.say("list", "comp").split())

    @unittest.skipIf(os.geteuid() != 0, "starting programs of two users needs root")
    def test_a_program_of_another_user_is_neither_ended_nor_forgotten(self):
        os.chown(self.folder, 65534, 65534)
        self.start(
            "run",
            "--no-picture",
            self.write("machine.hal", SERVO + "start\n"),
            user=65534,
            group=65534,
            extra_groups=[],
        )
        program = self.background(*self.slow("uc"))
        wait_until(lambda: self.state("uc") == "ready", "the program is ready")
        for command in (("unloadusr", "uc"), ("unload", "uc"), ("unload", "all")):
            said = self.refused(*command)
            self.assertIn(
                f"'uc' (process {program.pid}) belongs to another user and cannot be ended from here [not-permitted]\n",
                said,
            )
            self.assertIn("help: end it as that user, or as root\n", said)
        self.assertEqual(("ready", "1"), (self.state("uc"), self.value("uc.out")))
        program.kill()
        wait_until(lambda: "ready" not in self.state("uc"), "the machine notices its end")

    def test_it_is_restarted_under_load(self):
        self.machine()
        self.say("loadusr", "-Wn", "uc", *self.slow("uc"))
        hammers = [
            self.background(
                "sh",
                "-c",
                f"while :; do {HAL} shell show comp >/dev/null; {HAL} shell getp adder.out >/dev/null; done",
            )
            for _ in range(2)
        ]
        for turn in range(5):
            self.say("unload", "uc")
            self.say("loadusr", "-Wn", "uc", *self.slow("uc", value=str(turn)))
            self.say("linkps", "uc.out", "level") if turn else self.say("net", "level", "uc.out")
            self.assertEqual("ready", self.state("uc"))
            self.assertIn("uc.out", self.say("show", "sig", "level"))
        for hammer in hammers:
            hammer.kill()

    def test_a_second_one_of_a_name_is_rejected_and_leaves_nothing(self):
        self.machine()
        self.say("loadusr", "-Wn", "uc", *self.slow("uc"))
        first = self.pid("uc")
        said = self.refused("loadusr", "-Wn", "uc", *self.slow("uc"))
        self.assertIn(f"the name 'uc' is in use (process {first}, ready) [name-taken]", said)
        self.assertIn("= help: end the program first: unload uc", said)
        said = self.refused("loadusr", "-Wn", "sum2", *self.slow("sum2"))
        self.assertIn("the name 'sum2' is in use (a component in the machine) [name-taken]", said)
        said = self.refused("loadusr", "-W", *self.slow("uc"))
        self.assertIn("[program-ended]", said)
        self.assertIn(
            f"it could not register: the name 'uc' is in use by process {first} (ready)", said
        )
        self.assertEqual(["uc", "sum2", "threads"], self.say("list", "comp").split())
        self.assertEqual(first, self.pid("uc"))

    def test_one_that_ends_while_it_initializes_leaves_nothing(self):
        self.machine()
        said = self.refused(
            "loadusr",
            "-Wn",
            "uc",
            sys.executable,
            self.write(
                "dies.py",
                """import os, socket
s = socket.socket(socket.AF_UNIX)
s.connect(os.environ["XDG_RUNTIME_DIR"] + "/halcyon/default.sock")
s.sendall(b'{"component":"uc","ready":false,"pins":[{"name":"out","type":"float","dir":"out"}]}\\n')
while b'"ok":true' not in s.recv(4096): pass
os._exit(3)
""",
            ),
        )
        self.assertIn("[program-ended]", said)
        self.assertIn(
            "= help: it registered the component and ended while it was initializing\n", said
        )
        self.assertEqual(["sum2", "threads"], self.say("list", "comp").split())
        self.assertEqual(0, self.shell("loadusr", "-Wn", "uc", *self.slow("uc")).returncode)
        self.assertEqual("ready", self.state("uc"))

    def test_one_that_ends_unregistered_names_its_messages_unless_all_was_well(self):
        self.machine()
        for script, help in (
            ("exit 3", "it ended with exit status 3; see its messages, which are in the output"),
            ("kill -9 $$", "it was terminated by signal 9; see its messages, which are in"),
            ("exit 0", "a program registers over the control socket; omit -W if it does not\n"),
        ):
            said = self.refused("loadusr", "-W", "sh", "-c", script)
            self.assertIn(f"= help: {help}", said)

    def test_waiting_for_a_wrong_name_reports_and_ends(self):
        self.machine()
        waiter = self.background(str(HAL), "shell", "loadusr", "-Wn", "wrong", *self.slow("right"))
        line = waiter.stderr.readline()
        while "has not registered a component" in line:  # a busy host
            line = waiter.stderr.readline()
        self.assertRegex(
            line,
            r"^loadusr: waiting for component 'wrong': '.*python3?[0-9.]*' \(process \d+\) has registered 'right' instead \(\d+ s\)\n$",
        )
        self.assertIn("name-taken", self.refused("loadusr", "-Wn", "wrong", "sleep", "1000"))
        os.kill(self.pid("right"), signal.SIGKILL)
        self.assertIn("[program-ended]", waiter.communicate(timeout=60)[1])
        self.assertEqual(1, waiter.returncode)
        said = self.refused("loadusr", "-t", "500ms", "-Wn", "other", "sleep", "1000")
        self.assertIn("component 'other' was not ready within 500 ms [program-timeout]", said)
        wait_until(
            lambda: "other" not in self.say("list", "comp")
            and "sleep" not in self.say("list", "comp"),
            "nothing is left",
        )

    def test_waitusr_has_a_time_out(self):
        self.machine()
        self.say("loadusr", "-Wn", "uc", *self.slow("uc"))
        said = self.refused("waitusr", "-t", "50ms", "uc")
        self.assertIn(
            f"'uc' (process {self.pid('uc')}, ready) did not end within 50 ms [program-timeout]",
            said,
        )
        self.say("unload", "uc")
        self.say("waitusr", "-t", "60s", "uc")
        self.assertIn(
            "-t requires a duration of 1ms..24h, such as -t 10s",
            self.refused("waitusr", "-t", "soon", "uc"),
        )
        self.assertIn(
            "-t requires -W, -Wn or -w, whose wait it limits",
            self.refused("loadusr", "-t", "1s", "true"),
        )
        self.assertIn(
            "'sleep' did not end within 50 ms [program-timeout]",
            self.refused("loadusr", "-t", "50ms", "-w", "sleep", "1000"),
        )

    def test_a_program_that_does_not_end_keeps_its_name_and_is_named(self):
        self.machine()
        self.write(
            "deaf.py",
            SLOW.replace(
                "c = hal", "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN)\nc = hal"
            ),
        )
        self.say("loadusr", "-Wn", "uc", sys.executable, "deaf.py", "uc", "0", "1", "0")
        deaf = self.pid("uc")
        self.say("unload", "uc")
        self.assertEqual("ready, stopping", self.state("uc"))
        self.assertIn(
            f"the previous 'uc' (process {deaf}) did not end within 100 ms [program-timeout]",
            self.refused("loadusr", "-t", "100ms", "-Wn", "uc", *self.slow("uc")),
        )
        waiter = self.background(
            str(HAL), "shell", "loadusr", "-Wn", "uc", *self.slow("uc", value="5")
        )
        self.assertIn(
            f"waiting for the previous 'uc' to end: process {deaf} received SIGTERM but is still running",
            waiter.stderr.readline(),
        )
        os.kill(deaf, signal.SIGKILL)
        waiter.communicate(timeout=60)
        self.assertEqual(0, waiter.returncode)
        self.assertEqual("ready", self.state("uc"))

    def test_a_dead_ones_place_is_taken_over_with_its_links(self):
        self.machine()
        self.say("loadusr", "-Wn", "uc", *self.slow("uc", value="3"))
        self.say("net", "level", "uc.out", "adder.in1")
        os.kill(self.pid("uc"), signal.SIGKILL)
        wait_until(lambda: self.state("uc").startswith("dead"), "it is dead")
        self.say("loadusr", "-Wn", "uc", *self.slow("uc", value="4"))
        self.assertEqual("ready", self.state("uc"))
        wait_until(lambda: self.value("adder.in1") == "4", "its link is kept")
        self.assertEqual(["uc", "sum2", "threads"], self.say("list", "comp").split())

    def test_the_death_of_a_program_with_outputs_is_printed_once(self):
        machine = self.machine()
        self.say("loadusr", "-Wn", "uc", *self.slow("uc", value="3"))
        os.kill(self.pid("uc"), signal.SIGKILL)
        wait_until(lambda: self.state("uc").startswith("dead"), "it is dead")
        self.say("loadusr", "-Wn", "other", *self.slow("other"))
        self.say("unload", "other")
        self.say("waitusr", "-t", "60s", "other")
        errors = self.end(machine)[1]
        self.assertEqual(
            [
                "hal: component 'uc' died (SIGKILL): its outputs keep their last values, or take those "
                "that it has declared; see: show comp uc"
            ],
            [line for line in errors.splitlines() if "died" in line],
        )

    def test_a_death_does_not_wait_for_who_reads_the_errors(self):
        errors, full = os.pipe()
        self.addCleanup(os.close, errors)
        self.addCleanup(os.close, full)
        machine = subprocess.Popen(
            ["hal", "run", "--no-picture", self.write("machine.hal", SERVO + "start\n")],
            executable=str(HAL),
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=full,
        )
        self.addCleanup(machine.wait)
        self.addCleanup(machine.kill)
        wait_until(lambda: self.shell("list", "thread").returncode == 0, "the machine runs")
        self.say("loadusr", "-Wn", "uc", *self.slow("uc", value="3"))
        os.set_blocking(full, False)
        with contextlib.suppress(BlockingIOError):
            while True:
                os.write(full, b"x")
        os.set_blocking(full, True)
        os.kill(self.pid("uc"), signal.SIGKILL)
        wait_until(
            lambda: self.state("uc").startswith("dead"), "it is dead, and the machine answers"
        )

    def test_waitusr_waits_for_a_program_that_registers_another_name(self):
        self.machine()
        self.say("loadusr", "-Wn", "other", *self.slow("other"))
        self.say("unload", "other")
        self.say("waitusr", "-t", "60s", "other")
        self.write("prog.py", SLOW)
        self.say("loadusr", sys.executable, "prog.py", "other", "0", "1", "0")
        wait_until(lambda: "ready" in self.state("other"), "it has registered")
        program = Path(sys.executable).name
        said = self.refused("waitusr", "-t", "50ms", program)
        self.assertIn(f"'{program}' (process {self.pid('other')}, ready) did not end", said)
        self.say("unload", "other")
        self.say("waitusr", "-t", "60s", program)
        self.say("waitusr", program)  # it has ended

    def test_waitusr_warns_of_a_name_that_was_never_there(self):
        self.machine()
        done = self.shell("waitusr", "nosuch")
        self.assertEqual(0, done.returncode)
        self.assertIn(
            "warning: no program 'nosuch' was started or has registered: waitusr does not wait "
            "[not-a-program]",
            done.stderr,
        )

    def test_one_that_ends_by_the_signal_it_was_sent_leaves_nothing(self):
        self.machine()
        self.write(
            "plain.py",
            SLOW.replace(
                "c.ready()",
                "import signal; signal.signal(signal.SIGTERM, signal.SIG_DFL)\nc.ready()",
            ),
        )
        self.say("loadusr", "-Wn", "uc", sys.executable, "plain.py", "uc", "0", "1", "0")
        os.kill(self.pid("uc"), signal.SIGSTOP)  # it is not deaf to unload even so
        self.say("unload", "uc")
        self.say("waitusr", "-t", "60s", "uc")
        wait_until(lambda: self.state("uc") == "", "nothing is left")


@unittest.skipUnless(list(MODULE.glob("hal/_core*.so")), "the module is not built")
class Forked(LifeCase):
    """A dead program is dead at once, even while a child of it holds a copy of its socket."""

    OUTPUT = "c.newpin('on', hal.HAL_BIT, hal.HAL_OUT, safe=False)\nc.ready()\nc['on'] = True\n"

    def kill_and_see(self, pid):
        wait_until(lambda: self.value("camera.on") == "TRUE", "its output is on")
        self.say("net", "lamp", "camera.on")
        os.kill(pid, signal.SIGKILL)
        wait_until(lambda: self.state("camera").startswith("dead since "), "it is dead")
        wait_until(lambda: self.shell("gets", "lamp").stdout == "FALSE\n", "its output is off")

    def child_of(self, program):
        child = int(program.stdout.readline())
        self.addCleanup(os.kill, child, signal.SIGKILL)
        return child

    def test_a_child_of_multiprocessing(self):
        self.machine()
        self.write(
            "camera.py",
            "import hal, multiprocessing, time\nc = hal.component('camera', timeout=0.1)\n"
            + self.OUTPUT
            + "child = multiprocessing.get_context('fork').Process(target=time.sleep, args=(600,))\n"
            "child.start()\nprint(child.pid, flush=True)\ntime.sleep(600)\n",
        )
        program = self.background(sys.executable, "camera.py")
        child = self.child_of(program)
        self.kill_and_see(program.pid)
        self.assertTrue(lives(child))
        second = self.background(sys.executable, "camera.py")
        self.child_of(second)
        wait_until(lambda: self.state("camera") == "ready", "a successor takes its place")
        self.assertEqual(second.pid, self.pid("camera"))

    @staticmethod
    def watched(files):
        """The descriptors of processes that the machine has open."""
        links = []
        for file in files.iterdir():
            try:
                links.append(os.readlink(file))
            except FileNotFoundError:
                pass  # closed in the meantime
        return [link for link in links if "pidfd" in link]

    def test_a_child_that_holds_the_socket(self):
        machine = self.machine()
        files = Path(f"/proc/{machine.pid}/fd")
        self.write(
            "camera.py",
            "import json, os, socket, sys, time\ns = socket.socket(socket.AF_UNIX)\n"
            "s.connect(os.environ['XDG_RUNTIME_DIR'] + '/halcyon/default.sock')\nlines = s.makefile('rw')\n"
            "def ask(body):\n lines.write(json.dumps(body) + '\\n')\n lines.flush()\n return lines.readline()\n"
            "lines.readline()\n"
            "ask({'component': 'camera', 'timeout_ms': 100, 'pins': [{'name': 'on', 'type': 'bit', 'dir': 'out', 'safe': False}]})\n"
            "ask({'exchange': 'camera', 'write': [0, True]})\n"
            "child = os.fork()\n"
            "if child:\n print(child, flush=True)\n time.sleep(600)\n"
            "lines.readline()\n"
            'try: s.sendall(b\'{"component":"camera"}\\n\')\n'
            "except OSError as error: print(error, flush=True)\n"
            "time.sleep(600)\n",
        )
        program = self.background(sys.executable, "camera.py")
        child = self.child_of(program)
        self.kill_and_see(program.pid)
        self.assertTrue(lives(child))
        self.assertEqual("[Errno 32] Broken pipe\n", program.stdout.readline())
        wait_until(lambda: not self.watched(files), "no descriptor of a process is left open")

    def test_requests_that_were_sent_before_the_end_are_executed(self):
        self.machine()
        last = 4000
        self.write(
            "burst.py",
            "import os, socket, time\ns = socket.socket(socket.AF_UNIX)\n"
            "s.connect(os.environ['XDG_RUNTIME_DIR'] + '/halcyon/default.sock')\ns.recv(1000)\n"
            f"text = ''.join('{{\"run\":\"setp adder.in0 %d\"}}\\n' % n for n in range({last + 1}))\n"
            "child = os.fork()\nif child == 0: time.sleep(600)\n"
            "s.sendall(text.encode())\nprint(child, flush=True)\n",
        )
        program = self.background(sys.executable, "burst.py")
        self.child_of(program)
        self.assertEqual(0, program.wait(60))
        wait_until(lambda: self.value("adder.in0") == str(last), "the last request was executed")

    def test_a_program_behind_a_shell(self):
        self.machine()
        self.write(
            "camera.py",
            "import hal, os, time\nc = hal.component('camera', timeout=0.1)\n"
            + self.OUTPUT
            + "if os.fork() == 0: open('child', 'w').write(str(os.getpid()))\ntime.sleep(600)\n",
        )
        self.say("loadusr", "-Wn", "camera", "sh", "-c", f"{sys.executable} camera.py; sleep 600")
        child = wait_until(
            lambda: (self.folder / "child").exists() and (self.folder / "child").read_text(),
            "it has a child",
        )
        self.addCleanup(os.kill, int(child), signal.SIGKILL)
        self.kill_and_see(self.pid("camera"))

    def test_the_functions_of_the_module_in_a_child(self):
        self.machine()
        self.write(
            "both.py",
            "import hal, os\nhal.new_sig('a', hal.HAL_S32)\nchild = os.fork()\n"
            "for i in range(300):\n hal.set_s('a', i)\n"
            " assert hal.component_exists('threads')\n"
            " assert isinstance(hal.get_value('a'), int)\n"
            "if child: assert os.waitpid(child, 0)[1] == 0\n",
        )
        program = self.background(sys.executable, "both.py")
        self.assertEqual("", program.communicate(timeout=120)[1])
        self.assertEqual(0, program.returncode)


@unittest.skipUnless(list(MODULE.glob("hal/_core*.so")), "the module is not built")
class KilledMachine(LifeCase):
    def kill(self, machine):
        machine.kill()
        machine.communicate()

    def gone(self, *pids):
        wait_until(lambda: not any(lives(pid) for pid in pids), "the programs have ended")

    def test_programs_of_loadusr_end(self):
        self.write(
            "idle.py",
            ECHO.replace("while True:\n", "while True: time.sleep(1000)\nwhile True:\n").replace(
                '"echo"', '"idle"'
            ),
        )
        machine = self.machine(
            SERVO
            + f"loadusr -Wn echo {sys.executable} echo.py\nloadusr -Wn idle {sys.executable} idle.py\n"
            "loadusr sleep 1000\nstart\n"
        )
        self.say("loadusr", "sleep", "1000")  # by a thread of the server that ends with the command
        waiter = self.background(str(HAL), "shell", "loadusr", "-w", "sleep", "1000")
        children = lambda: Path(f"/proc/{machine.pid}/task").glob("*/children")
        pids = wait_until(
            lambda: (lambda all: all if len(all) >= 5 else None)(
                [int(pid) for file in children() for pid in file.read_text().split()]
            ),
            "all run",
        )
        wait_until(lambda: self.state("echo") == "ready", "it is ready")
        for pid in pids:
            self.assertTrue(lives(pid))
        self.kill(machine)
        self.gone(*pids)
        self.assertIn(
            "the connection to instance 'default' is lost", waiter.communicate(timeout=60)[1]
        )

    def test_a_program_behind_a_shell_ends(self):
        self.write("wrapper.sh", f"{sys.executable} echo.py\ntrue\n")
        machine = self.machine(SERVO + "loadusr -Wn echo sh wrapper.sh\nstart\n")
        pid = int(self.python_pid())
        self.kill(machine)
        self.gone(pid)

    def test_programs_without_their_death_signal_end(self):
        """The kernel takes it from a program with file capabilities: the library notices the end of the connection, hal asks for it again."""
        self.write(
            "forget.py",
            "import ctypes, os, sys\nctypes.CDLL(None).prctl(1, 0)\nos.execvp(sys.argv[1], sys.argv[1:])\n",
        )
        self.write("other.hal", SERVO)
        machine = self.machine(
            SERVO + f"loadusr -Wn echo {sys.executable} forget.py {sys.executable} echo.py\n"
            f"loadusr {sys.executable} forget.py {HAL} run --no-picture --name other other.hal\nstart\n"
        )
        pids = [
            self.pid("echo"),
            wait_until(lambda: self.other_pid(machine), "the other machine runs"),
        ]
        self.kill(machine)
        self.gone(*pids)

    def other_pid(self, machine):
        for file in Path(f"/proc/{machine.pid}/task").glob("*/children"):
            for pid in file.read_text().split():
                if (
                    b"other.hal" in Path(f"/proc/{pid}/cmdline").read_bytes()
                    and self.shell("getp", "servo.threadbeat", instance="other").returncode == 0
                ):
                    return int(pid)
        return None

    def python_pid(self):
        def find():
            for folder in Path("/proc").glob("[0-9]*"):
                try:
                    if (folder / "cmdline").read_bytes().split(b"\0")[1:2] == [
                        b"echo.py"
                    ] and os.readlink(folder / "cwd") == str(self.folder.resolve()):
                        return folder.name
                except OSError:
                    pass
            return None

        return wait_until(find, "the program runs")

    def test_a_program_started_by_hand_takes_safe_values_and_reconnects(self):
        machine = self.machine()
        self.write(
            "watch.py",
            "import hal, time\nc = hal.component('watch')\nc.newpin('go', hal.HAL_BIT, hal.HAL_IN, safe=False)\n"
            "c.newpin('other', hal.HAL_BIT, hal.HAL_IN)\nc.ready()\nwhile True:\n print(c['go'], c['other'], flush=True)\n time.sleep(0.05)\n",
        )
        program = self.background(sys.executable, "watch.py")
        wait_until(lambda: self.state("watch") == "ready", "it is ready")
        self.say("setp", "watch.go", "1")
        self.say("setp", "watch.other", "1")
        wait_until(lambda: program.stdout.readline() == "True True\n", "it sees its inputs")
        self.kill(machine)
        wait_until(
            lambda: program.stdout.readline() == "False True\n",
            "what has a declared value takes it",
        )
        self.assertIn("watch: the machine 'default' (process ", program.stderr.readline())
        self.machine()
        wait_until(lambda: self.state("watch") == "ready", "it is there again")

    def test_a_program_started_by_hand_ends_with_its_machine(self):
        machine = self.machine()
        program = self.background(sys.executable, "echo.py", HALCYON_LOST="end")
        wait_until(lambda: self.state("echo") == "ready", "it is ready")
        self.kill(machine)
        self.assertRegex(
            program.communicate(timeout=60)[1],
            r"^echo: the machine 'default' \(process \d+\) has ended; ending\n",
        )

    def test_programs_in_c(self):
        if SANITIZED:
            self.skipTest("compiles a program")
        self.environment["HALCYON_PLUGIN_PATH"] = PLUGINS
        self.good("compile", FOLLOW)
        follow = self.folder / ".local/share/halcyon/bin/follow"
        machine = self.machine(SERVO + "loadusr -Wn follow follow\nstart\n")
        pid = self.pid("follow")
        self.kill(machine)
        self.gone(pid)
        machine = self.machine()
        program = self.background(str(follow), HALCYON_LOST="end")
        wait_until(lambda: self.state("follow") == "ready", "it is ready")
        self.kill(machine)
        self.assertIn(" has ended; ending\n", program.communicate(timeout=60)[1])
        self.assertEqual(0, program.returncode)


@unittest.skipUnless(list(MODULE.glob("hal/_core*.so")), "the module is not built")
class Hanging(LifeCase):
    def test_a_stopped_program_does_not_respond_and_recovers(self):
        self.machine()
        self.say("loadusr", "-Wn", "echo", sys.executable, "echo.py")
        self.say("net", "level", "echo.out", "adder.in1")
        self.say("setp", "echo.in", "4")
        wait_until(lambda: self.value("adder.in1") == "8", "it works")
        os.kill(self.pid("echo"), signal.SIGSTOP)
        wait_until(lambda: self.state("echo").startswith("not responding since "), "it is noticed")
        wait_until(lambda: self.value("adder.in1") == "-1", "its output takes the declared value")
        os.kill(self.pid("echo"), signal.SIGCONT)
        wait_until(lambda: self.state("echo") == "ready", "it responds")
        wait_until(lambda: self.value("adder.in1") == "8", "its output has its value again")

    def test_an_endless_loop(self):
        self.machine()
        self.say("loadusr", "-Wn", "echo", sys.executable, "echo.py")
        self.say("net", "level", "echo.out", "adder.in1")
        self.say("setp", "echo.hang", "1")
        wait_until(lambda: self.state("echo").startswith("not responding since "), "it is noticed")
        wait_until(lambda: self.value("adder.in1") == "-1", "its output takes the declared value")
        self.say("unload", "echo")

    def test_one_that_is_to_be_restarted_is(self):
        self.machine()
        self.say(
            "loadusr",
            "-Wn",
            "echo",
            "--restart=on-failure",
            "--restart-delay=10ms",
            sys.executable,
            "echo.py",
        )
        first = self.pid("echo")
        os.kill(first, signal.SIGSTOP)
        wait_until(
            lambda: self.row("echo")
            and self.pid("echo") != first
            and self.state("echo") == "ready",
            "it is started again",
        )

    def test_a_program_in_c(self):
        if SANITIZED:
            self.skipTest("compiles a program")
        self.environment["HALCYON_PLUGIN_PATH"] = PLUGINS
        self.good("compile", HANG)
        self.machine()
        self.say("loadusr", "-Wn", "hang", "hang")
        self.say("net", "level", "hang.out", "adder.in1")
        wait_until(lambda: self.value("adder.in1") == "5", "it works")
        os.kill(self.pid("hang"), signal.SIGSTOP)
        wait_until(
            lambda: self.state("hang").startswith("not responding since "), "SIGSTOP is noticed"
        )
        wait_until(lambda: self.value("adder.in1") == "-2", "its output takes the declared value")
        os.kill(self.pid("hang"), signal.SIGCONT)
        wait_until(
            lambda: self.state("hang") == "ready" and self.value("adder.in1") == "5", "it recovers"
        )
        self.say("setp", "hang.loop", "1")
        wait_until(
            lambda: self.state("hang").startswith("not responding since "),
            "an endless loop is noticed, though its values are exchanged",
        )
        wait_until(lambda: self.value("adder.in1") == "-2", "its output takes the declared value")
        self.say("unload", "hang")


class Operator(LifeCase):
    def test_idle_connections_do_not_lock_the_operator_out(self):
        machine = self.machine()
        waiting = []
        for _ in range(300):
            client = socket.socket(
                socket.AF_UNIX
            )  # without a timeout: then connect() waits for a place in the queue
            client.connect(str(self.folder / "halcyon/default.sock"))
            waiting.append(client)
            self.addCleanup(client.close)
        for _ in range(3):
            self.assertEqual("2", self.value("adder.in0"))
        first = waiting[0]
        first.settimeout(60)
        text = b""
        while part := first.recv(4096):
            text += part
        self.assertIn(
            "more than 256 clients are connected, and this one sent no request for", text.decode()
        )
        self.say("stop")
        self.say("unloadusr", "all")
        self.assertIsNone(machine.poll())


if __name__ == "__main__":
    unittest.main()
