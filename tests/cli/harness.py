# SPDX-License-Identifier: MIT
"""What the tests of the program share: a sandbox, running machines, a terminal."""

import codecs
import fcntl
import functools
import json
import os
import pty
import re
import select
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import termios
import time
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tests"))
from program import program  # noqa: E402

TIMEOUT = float(os.environ.get("HALCYON_TEST_TIMEOUT", "30"))  # for what should happen at once


HAL = program()
PLUGINS = os.environ.get("HALCYON_PLUGIN_PATH") or str(HAL.parent.parent / "tests" / "components")

SANITIZED = any(
    name in HAL.read_bytes() for name in (b"__asan_init", b"__tsan_init")
)  # then the sanitizer takes crash signals


@functools.cache
def packages_left_out():
    """The packages of the tree that the program was built without."""
    command = [HAL, "--version", "--json"]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return {one["name"] for one in json.loads(printed)["packages"] if not one["built"]}


def lacks_a_package(errors):
    """Whether the errors of a netlist name a component of a package that this build leaves out."""
    named = re.search("(left out of|switched off in) this build", errors)
    return named is not None and packages_left_out() != set()


def needs_package(name):
    """Skips a test in a build without the package. For a file of which every test needs it: `# packages: NAME`."""
    return unittest.skipIf(name in packages_left_out(), f"this build leaves out {name}")


def run_share(share):
    """Makes unittest.main() run the tests of one share only, such as 2/4, for ctests that run side by side."""
    number, count = map(int, share.split("/"))
    load = unittest.defaultTestLoader.loadTestsFromModule

    def flat(tests):
        for test in tests:
            if isinstance(test, unittest.TestSuite):
                yield from flat(test)
            else:
                yield test

    def load_share(*arguments, **how):
        return unittest.TestSuite(list(flat(load(*arguments, **how)))[number - 1 :: count])

    unittest.defaultTestLoader.loadTestsFromModule = load_share


if share := os.environ.get("HALCYON_TEST_SHARE"):
    run_share(share)

SERVO = """loadrt threads name1=servo period1=1000000
loadrt sum2 names=adder
addf adder servo
setp adder.in0 2
setp adder.in1 3
net total adder.out
"""


READ_ONLY = 'mount --bind "$1" "$1" && mount -o remount,bind,ro "$1" || exit 99; cd "$(pwd -P)"; shift; exec "$@"'


def machines_elsewhere(folder):
    """Copies halfiles, and returns the copy, and the words before a command that make the copy read-only for it: an installation
    belongs to another user. Without root the words are missing, because network namespaces then need a namespace of their own.
    """
    copy = folder / "copied tree" / "halfiles"
    ignored = shutil.ignore_patterns("__pycache__", "*.var*", "*.expanded")
    shutil.copytree(ROOT / "halfiles", copy, ignore=ignored)
    if os.geteuid() != 0:
        return copy, []
    return copy, ["unshare", "--mount", "sh", "-c", READ_ONLY, "sh", str(copy)]


def undisturbed(error):
    """Standard error without what a test does not cause: the overruns of a busy host, and the word
    of AddressSanitizer that it follows swapcontext() only in part."""
    if error is None:  # it went to standard output
        return None
    error = re.sub(r"(?m)^fault: .* \[overrun\].*\n", "", error)
    return re.sub(r"(?m)^==\d+==WARNING: ASan doesn't fully support makecontext.*\n", "", error)


def free_port(kind=socket.SOCK_DGRAM):
    """A port of this machine that nobody uses now."""
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def suspend(process):
    """Stops all threads of a process (SIGSTOP), and waits until none of them runs."""

    def state(task):
        return (task / "stat").read_text().rpartition(")")[2].split()[0]

    os.kill(process, signal.SIGSTOP)
    tasks = Path(f"/proc/{process}/task")
    wait_until(lambda: all(state(task) == "T" for task in tasks.iterdir()), "the stop")


def wait_until(predicate, what):
    """Asks again and again until `predicate` answers something true, which is returned."""
    deadline = time.monotonic() + TIMEOUT
    while True:
        if answer := predicate():
            return answer
        if time.monotonic() > deadline:
            raise AssertionError(f"{what}: not after {TIMEOUT:g} s")
        time.sleep(0.01)


class Case(unittest.TestCase):
    """A test with a folder, a socket folder and a home of its own; what it starts is ended with it."""

    maxDiff = None

    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="hal-"))
        self.addCleanup(shutil.rmtree, self.folder, True)
        keep = {
            key: value
            for key, value in os.environ.items()
            if key == "PATH" or key.endswith("SAN_OPTIONS")
        }
        self.environment = {
            **keep,
            "LC_ALL": "C.UTF-8",
            "TERM": "xterm",
            "HOME": str(self.folder),
            "XDG_RUNTIME_DIR": str(self.folder),
            "XDG_STATE_HOME": str(self.folder / "state"),
            "HALCYON_PLUGIN_PATH": PLUGINS,
            "HAL_RTMOD_DIR": "/nowhere",
        }  # LinuxCNC may be installed

    def write(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return str(path)

    def run_program(self, *words, name="hal", given=None, environment=None):
        """Runs hal (or an alias) to its end; standard output and error as text."""
        done = subprocess.run(
            [name, *map(str, words)],
            executable=str(HAL),
            cwd=self.folder,
            env={**self.environment, **(environment or {})},
            input=given,
            stdin=subprocess.DEVNULL if given is None else None,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            timeout=2 * TIMEOUT,
        )
        done.stderr = undisturbed(done.stderr)
        return done

    def good(self, *words, **how):
        """As run_program, but it must succeed; its standard output."""
        done = self.run_program(*words, **how)
        self.assertEqual((0, ""), (done.returncode, done.stderr), done.stdout)
        return done.stdout

    def bad(self, *words, status=1, **how):
        """As run_program, but it must fail with that status; its standard error."""
        done = self.run_program(*words, **how)
        self.assertEqual(status, done.returncode, done.stdout + done.stderr)
        return done.stderr

    def start(self, *words, name="hal", instance="default", loaded=True, **how):
        """Starts `hal run …` in the background and waits until its files are loaded and its threads run."""
        machine = subprocess.Popen(
            [name, *map(str, words)],
            executable=str(HAL),
            cwd=self.folder,
            env=self.environment,
            stdin=how.pop("stdin", subprocess.DEVNULL),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            **how,
        )
        self.addCleanup(self.end_quietly, machine)
        if loaded:

            def ready():
                if machine.poll() is not None:
                    raise AssertionError("it ended: " + "".join(machine.communicate()))
                return self.shell(
                    "getp", "servo.threadbeat", instance=instance
                ).stdout.strip() not in ("", "0")

            wait_until(ready, "the machine runs")
        return machine

    def start_logged(self, *words, log="node.log", mode="w", **how):
        """Starts `hal …` in the background with its output in a file; the test ends it."""
        output = open(self.folder / log, mode)
        self.addCleanup(output.close)
        return subprocess.Popen(
            ["hal", *map(str, words)],
            executable=str(HAL),
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            **how,
        )

    def end(self, machine, number=signal.SIGTERM):
        """Ends a process; its output."""
        if machine.poll() is None:
            machine.send_signal(number)
        try:
            out, err = machine.communicate(timeout=TIMEOUT)
            return out, undisturbed(err)
        except subprocess.TimeoutExpired:
            machine.kill()
            machine.communicate()
            raise AssertionError("the machine does not end") from None
        except ValueError:
            return "", ""  # asked for already

    def end_quietly(self, machine):
        """As end(); prints the errors of a machine that had ended before, when no test asked."""
        has_ended = machine.poll() is not None
        _, err = self.end(machine)
        if has_ended and err:
            print(f"{machine.args}: ended with {machine.returncode}: {err}", file=sys.stderr)

    def shell(self, *words, instance="default"):
        return self.run_program("shell", "--name", instance, *words)

    def say(self, *words):
        """As shell, but the command must succeed without a message; its standard output."""
        done = self.shell(*words)
        self.assertEqual((0, ""), (done.returncode, done.stderr), done.stdout)
        return done.stdout

    def comes(self, name, value):
        """Waits until a pin has the value."""
        wait_until(lambda: self.value(name) == value, f"{name} is {value}")

    def value(self, name, instance="default"):
        return self.shell("getp", name, instance=instance).stdout.strip()


class Terminal:
    """A process on a terminal, usually of 100 x 30 characters."""

    def __init__(self, case, *words, name="hal", environment=None, columns=100, rows=30):
        self.process, self.descriptor = pty.fork()
        if self.process == 0:
            os.chdir(case.folder)
            os.execve(
                str(HAL), [name, *map(str, words)], {**case.environment, **(environment or {})}
            )
        self.resize(columns, rows)
        self.decoder = codecs.getincrementaldecoder("utf-8")("replace")
        self.seen = ""
        self.status = None
        case.addCleanup(self.close)

    def resize(self, columns, rows):
        size = struct.pack("HHHH", rows, columns, 0, 0)
        fcntl.ioctl(self.descriptor, termios.TIOCSWINSZ, size)

    def send(self, text):
        os.write(self.descriptor, text.encode())

    def read(self, timeout):
        if not select.select([self.descriptor], [], [], timeout)[0]:
            return False
        try:
            data = os.read(self.descriptor, 65536)
        except OSError:  # the other side has gone
            return None
        self.seen += self.decoder.decode(data)
        return True if data else None

    def expect(self, text):
        """Waits for a text; returns, and forgets, everything up to its end."""
        deadline = time.monotonic() + TIMEOUT
        while text not in self.seen:
            if self.read(0.1) is None or time.monotonic() > deadline:
                raise AssertionError(f"{text!r} does not appear; there is: {self.seen!r}")
        at = self.seen.index(text) + len(text)
        before, self.seen = self.seen[:at], self.seen[at:]
        return before

    def wait(self):
        """Waits for the end of the process; its exit status."""
        deadline = time.monotonic() + TIMEOUT
        while self.status is None:
            self.read(0.05)
            done, status = os.waitpid(self.process, os.WNOHANG)
            if done:
                self.status = os.waitstatus_to_exitcode(status)
            elif time.monotonic() > deadline:
                raise AssertionError(f"it does not end; there is: {self.seen!r}")
        while self.read(0):
            pass
        return self.status

    def close(self):
        if self.status is None:
            os.kill(self.process, signal.SIGKILL)
            os.waitpid(self.process, 0)
            self.status = -signal.SIGKILL
        os.close(self.descriptor)
