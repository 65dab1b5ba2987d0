# SPDX-License-Identifier: MIT
"""What the tests of hanging threads share."""
import re

from harness import Case, wait_until

MACHINE = """newthread servo 1000000 {options}
newthread slow 10000000
loadrt stall names=s file=events.txt
loadrt sum2 names=adder,other
addf s servo
addf adder servo
addf other slow
setp adder.in0 2
net level s.out => other.in0
"""


class HungCase(Case):
    def machine(self, options="", *words):
        machine = self.start("run", self.write("a.hal", MACHINE.format(options=options)), *words)
        wait_until(lambda: self.value("s.out") == "5", "its functions run")
        return machine

    def events(self):
        path = self.folder / "events.txt"
        return [line.split()[0] for line in path.read_text().splitlines()] if path.exists() else []

    def faults(self):
        return self.shell("show", "fault").stdout

    def hang(self, mode, ms=0):
        if ms:
            self.good("shell", "setp", "s.ms", ms)
        self.good("shell", "setp", "s.mode", mode)
        return wait_until(
            lambda: "hung-thread" in self.shell("--json", "show", "fault").stdout and self.faults(),
            "the fault is known",
        )

    def rejected(self, *words):
        done = self.shell(*words)
        self.assertEqual(1, done.returncode, f"{words}: {done.stdout}")
        self.assertIn("[hung-thread]", done.stderr, words)
        self.assertIn("thread 'servo' has not finished a cycle for ", done.stderr)
        if words[0] != "unload":
            self.assertIn("function 's' (stall) does not return", done.stderr)

    def check_hung(self, machine, fault, why):
        self.assertRegex(
            fault,
            r"servo: function 's' \(stall\) has not returned, no cycle ended for [\d.]+ ms, it "
            + why
            + r".* \(limit 100 ms\) at cycle [\d ]+; the thread's functions are stopped and its outputs were set to their safe values",
        )
        self.assertIn("safe", self.events())
        self.assertEqual("-1", self.value("s.out"))
        wait_until(
            lambda: self.shell("gets", "level").stdout == "-1\n", "the signal has its safe value"
        )
        wait_until(lambda: self.value("other.out") == "-1", "another thread sees the safe value")
        beat = self.value("slow.threadbeat")
        wait_until(lambda: self.value("slow.threadbeat") != beat, "the other thread goes on")
        missed = int(self.value("servo.missed"))
        wait_until(lambda: int(self.value("servo.missed")) > missed + 10, "missed periods count on")
        timing = self.shell("show", "timing").stdout
        self.assertRegex(timing, r"(?m)^servo .* hangs in 's' for ")
        for words in (
            ["setp", "adder.in0", "7"],
            ["stop"],
            ["start"],
            ["delthread", "servo"],
            ["unload", "s"],
            ["net", "x", "adder.out"],
        ):
            self.rejected(*words)
        self.assertEqual("2", self.value("adder.in0"))
        self.assertEqual(0, self.shell("setp", "other.in1", "3").returncode)
        out, err = self.end(machine)
        self.assertEqual(1, machine.returncode, out + err)
        self.assertRegex(out, r"hangs in s for ")
        report = re.search(r"(?m)^servo +1 ms +(\d+) +(\d+) ", out)
        self.assertGreater(int(report[2]), 100, out)
        self.assertIn("servo: function 's' (stall) has not returned", out)
