# SPDX-License-Identifier: MIT
"""`stop`, `shutdown` and SIGTERM take effect at once, whatever other clients do: 1000 errors, `describe all`, `save`, all descriptors taken.

Every time is printed, with its median and maximum. The bound is 50 ms. A busy host delays everything: the bound holds for the best of several
answers to `stop` and `shutdown`, and after SIGTERM for the CPU time until the process has ended, which other processes do not change."""
import json
import multiprocessing
import os
import resource
import select
import signal
import socket
import threading
import time
import unittest

from harness import SANITIZED, TIMEOUT, Case

INSTANCES = 200 if SANITIZED else 2500
BOUND = 0.05  # s
TRIES = 8
NOTICED = 2.0  # s: far below what waiting for the others takes
NET = "loadrt threads name1=servo period1=1000000\nloadrt sum2 names=adder\naddf adder servo\n"


class Wire:
    """A connection to the control socket."""

    def __init__(self, case):
        self.socket = socket.socket(socket.AF_UNIX)
        case.addCleanup(self.close)
        self.socket.settimeout(2 * TIMEOUT)
        self.socket.connect(str(case.folder / "halcyon" / "default.sock"))
        self.lines = self.socket.makefile("rb")
        self.lines.readline()

    def send(self, **request):
        self.socket.sendall(json.dumps(request).encode() + b"\n")

    def ask(self, **request):
        self.send(**request)
        return json.loads(self.lines.readline())

    def timed(self, **request):
        begin = time.monotonic()
        reply = self.ask(**request)
        return time.monotonic() - begin, reply

    def close(self):
        self.lines.close()
        self.socket.close()


def cpu_clock(machine):
    """The clock of the CPU time of another process."""
    return (~machine.pid << 3) | 2


def keep_busy(path, count, request, sent):
    """Clients that send the same request again and again, in a process of their own."""

    def go():
        try:
            with socket.socket(socket.AF_UNIX) as wire:
                wire.connect(path)
                lines = wire.makefile("rb")
                lines.readline()
                while True:
                    wire.sendall(json.dumps(request).encode() + b"\n")
                    sent.release()
                    if not lines.readline():
                        return
        except OSError:
            pass  # the machine has ended

    threads = [threading.Thread(target=go, daemon=True) for _ in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


class StopUnderLoad(Case):
    def machine(self, more="", **how):
        self.write("m.hal", NET + more)
        return self.start("run", "--no-picture", "m.hal", **how)

    def wrong(self):
        return self.write("wrong.hal", "".join(f"net s{i} pid.{i}.outputt\n" for i in range(1000)))

    def stops(self, what, wire):
        """`stop` on a connection, while others are busy: its time."""
        took, reply = wire.timed(run=["stop"])
        self.assertEqual((True, 0), (reply["ok"], reply["status"]), reply)
        print(f"{what}: stop after {1000 * took:.1f} ms")
        return took

    def ended(self, machine, reap=True):
        """Waits for the end of the process; not by wait(), which looks every 50 ms only."""
        process = os.pidfd_open(machine.pid)
        self.assertTrue(select.select([process], [], [], 2 * TIMEOUT)[0], "the machine ends")
        os.close(process)
        if reap:
            machine.wait()

    def ends(self, what, machine):
        """The CPU time of the machine from SIGTERM to its end; the time that passes is printed."""
        clock = cpu_clock(machine)
        before = time.clock_gettime(clock)
        begin = time.monotonic()
        machine.send_signal(signal.SIGTERM)
        self.ended(machine, reap=False)
        took = time.monotonic() - begin
        _, status, usage = os.wait4(machine.pid, 0)
        machine.returncode = os.waitstatus_to_exitcode(status)
        used = usage.ru_utime + usage.ru_stime - before
        print(f"{what}: ended {1000 * took:.1f} ms after SIGTERM, {1000 * used:.1f} ms of CPU time")
        self.assertLess(took, NOTICED, what)
        self.assertLess(used, NOTICED if SANITIZED else BOUND, what)
        return used

    def works_for(self, seconds, machine, wire):
        """Waits until the machine has used this CPU time, or answers."""
        clock = cpu_clock(machine)
        begin = time.clock_gettime(clock)
        while time.clock_gettime(clock) - begin < seconds:
            if select.select([wire.socket], [], [], 0.001)[0]:
                return

    def shuts_down(self, what, wire, machine):
        """The request to end the machine: the time until it is answered."""
        took, reply = wire.timed(stop=True)
        self.assertTrue(reply["ok"], reply)
        print(f"{what}: shutdown answered after {1000 * took:.1f} ms")
        self.ended(machine)
        return took

    def best(self, what, measured):
        """Repeats a measurement until it is below the bound; asserts that one is."""
        times = []
        while len(times) < TRIES and (not times or min(times) >= BOUND):
            times.append(measured())
        times.sort()
        print(
            f"{what}: {len(times)} tries, p50 {1000 * times[len(times) // 2]:.1f} ms, "
            f"max {1000 * times[-1]:.1f} ms"
        )
        self.assertLess(times[0], NOTICED if SANITIZED else BOUND, what)
        self.assertLess(times[-1], NOTICED, what)

    def busy(self, count, **request):
        """Starts clients that send the same request again and again; each has sent one."""
        path = str(self.folder / "halcyon" / "default.sock")
        sent = multiprocessing.Semaphore(0)
        process = multiprocessing.Process(target=keep_busy, args=(path, count, request, sent))
        process.start()
        for _ in range(count):
            self.assertTrue(sent.acquire(timeout=2 * TIMEOUT), "a client sends its request")
        self.addCleanup(process.join)
        self.addCleanup(process.kill)
        return process

    def measure(self, what, start):
        """`stop`, `shutdown` and SIGTERM; `start()` starts a machine with its load."""
        machine, load = start()
        calm = Wire(self)
        self.best(f"{what}: stop", lambda: self.stops(what, calm))
        self.best(f"{what}: stop of a new client", lambda: self.stops(what, Wire(self)))
        self.ends(what, machine)
        load.kill()

        def ends():
            machine, load = start()
            self.ends(what, machine)
            load.kill()

        def shuts_down():
            machine, load = start()
            took = self.shuts_down(what, Wire(self), machine)
            load.kill()
            return took

        for _ in range(3):
            ends()
        self.best(f"{what}: shutdown", shuts_down)

    def loaded(self, more, count, **request):
        """Starts a machine that is busy with these requests."""
        machine = self.machine(more)
        return machine, self.busy(count, **request)

    def test_a_file_with_a_thousand_wrong_names(self):
        machine = self.machine(f"loadrt pid num_chan={INSTANCES}\n")
        calm, other = Wire(self), Wire(self)
        calm.ask(run=["getp", "adder.out"])
        other.send(run=["source", self.wrong()])
        begin = time.monotonic()
        self.assertEqual("0\n", calm.ask(run=["getp", "adder.out"])["out"])
        print(f"1000 errors: getp after {1000 * (time.monotonic() - begin):.1f} ms")
        reply = json.loads(other.lines.readline())
        self.assertIn("did you mean 'pid.0.output'", reply["err"])
        self.assertIn("900 more not shown", reply["err"])
        other.send(run=["source", self.wrong()])
        self.works_for(0.03, machine, other)  # then it looks for similar names
        self.ends("1000 errors, halfway", machine)
        self.measure(
            "1000 errors",
            lambda: self.loaded(
                f"loadrt pid num_chan={INSTANCES}\n", 4, run=["source", self.wrong()]
            ),
        )

    def test_checking_such_a_file_takes_no_longer_than_loading_it(self):
        self.wrong()
        self.write("right.hal", NET + f"loadrt pid num_chan={INSTANCES}\n")
        self.write(
            "check.hal",
            (self.folder / "right.hal").read_text() + (self.folder / "wrong.hal").read_text(),
        )

        def check(name):
            begin = time.monotonic()
            done = self.run_program("check", name)
            return time.monotonic() - begin, done

        right, _ = check("right.hal")
        wrong, done = check("check.hal")
        print(f"check: {right:.2f} s without, {wrong:.2f} s with 1000 wrong names")
        self.assertEqual(1, done.returncode)
        self.assertIn("1000 errors", done.stderr)
        self.assertLess(wrong, 5 * right + NOTICED)

    def test_sixty_clients_that_describe_everything(self):
        self.measure(
            "60 x describe all",
            lambda: self.loaded("loadrt pid num_chan=333\n", 60, describe="all"),
        )

    def test_clients_that_save_a_large_machine(self):
        signals = "".join(f"newsig s{i} float\n" for i in range(5000 if SANITIZED else 100_000))
        self.measure("save of 100 000", lambda: self.loaded(signals, 4, run=["save"]))

    def test_a_query_that_the_end_interrupts_is_an_error(self):
        machine = self.machine("loadrt pid num_chan=333\n")
        described, saved = Wire(self), Wire(self)
        for _ in range(50):
            described.send(describe="all")
            saved.send(run=["save"])
        machine.send_signal(signal.SIGTERM)
        whole = len(described.lines.readline())
        for line in described.lines:
            reply = json.loads(line)
            if reply["ok"]:
                self.assertEqual(whole, len(line))
            else:
                self.assertEqual("the machine ends", reply["error"])
        for line in saved.lines:
            reply = json.loads(line)
            if not reply["ok"]:
                self.assertEqual("the machine ends", reply["error"])
            elif reply["status"] != 0:
                self.assertIn("'save' was interrupted: the machine ends", reply["err"])
            else:
                self.assertTrue(reply["out"].endswith("addf adder servo\n"), reply["out"][-200:])
        self.ended(machine)

    def all_descriptors_taken(self):
        machine = self.machine(
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (40, 40))
        )
        taken = []
        for _ in range(60):
            one = socket.socket(socket.AF_UNIX)
            one.settimeout(1)
            try:
                one.connect(str(self.folder / "halcyon" / "default.sock"))
            except OSError:
                break
            taken.append(one)
            self.addCleanup(one.close)
        for turn in range(3):
            begin = time.monotonic()
            done = self.shell("stop")
            print(
                f"40 descriptors: hal shell stop after {1000 * (time.monotonic() - begin):.1f} ms"
            )
            self.assertEqual((0, ""), (done.returncode, done.stderr))
        self.best("40 descriptors: stop", lambda: self.stops("40 descriptors", Wire(self)))
        return machine

    def test_all_descriptors_are_taken(self):
        self.ends("40 descriptors", self.all_descriptors_taken())
        machine = self.all_descriptors_taken()
        self.shuts_down("40 descriptors", Wire(self), machine)


if __name__ == "__main__":
    unittest.main()
