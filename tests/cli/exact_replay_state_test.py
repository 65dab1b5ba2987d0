# SPDX-License-Identifier: MIT
"""Every component of the build executes from a state in the middle of its journal, or is in a list with the reason."""

import random
import re
import unittest

from harness import HAL, ROOT, SANITIZED, Case, wait_until

# Components of which a journal cannot be executed from a state, and what `hal replay` prints. A new component
# belongs here only when what it computes is not a function of its inputs and of its links.
OPENS = r"'{instance}' \({name}\) opens again: "
WITHOUT_STATE = {
    "segment_record": OPENS,
}
THREAD = "loadrt threads name1=servo period1=2000000\n"
WRITABLE = re.compile(r"(?m)^\s*\S+\s+(bit|float|s32|u32)\s+(?:IN|I/O)\s+\S+\s+(\S+)$")


def load_lines():
    """The lines that load each component, as the tests of real time load them."""
    arguments, before, texts = {}, {}, {}
    for line in (ROOT / "tests/rt/component_arguments.txt").read_text().splitlines():
        first, _, rest = line.partition(" ")
        name, _, text = rest.partition(" ")
        if first == "before":
            before[name] = text + "\n"
        elif first == "text":
            texts[name] = text
        elif first != "#":
            arguments[first] = rest
    lines = {}
    for name in sorted(path.stem for path in (HAL.parent.parent / "components").glob("*.so")):
        given = arguments.get(name, "")
        for short, text in texts.items():
            given = given.replace(short, text)
        native = "--native " if name in ("hm2_eth", "hostmot2") else ""
        line = f"{before.get(name, '')}loadrt {native}{name} {given}\n"
        lines[name] = line.replace("tests/rt", str(ROOT / "tests/rt"))
    return lines


@unittest.skipIf(SANITIZED, "a sanitizer has its own operator new")
class ExactReplayState(Case):
    def run_journaled(self, loads, pins=True):
        path = self.write("a.hal", THREAD + "".join(loads) + "addf --auto servo\nstart\n")
        machine = self.start("run", path, "--journal", "run.mcap", "--values", "*")
        dice = random.Random(1)
        for _ in range(4 if pins else 1):
            self.wait_for_cycles(100)
            if pins:
                self.set_inputs(dice)
        self.wait_for_cycles(100)
        self.end(machine)

    def set_inputs(self, dice):
        lines = []
        for kind, name in WRITABLE.findall(self.shell("show", "pin").stdout):
            if dice.randrange(4) == 0:
                value = {
                    "bit": dice.choice(["TRUE", "FALSE"]),
                    "float": f"{dice.uniform(-9, 9):.3f}",
                }
                lines.append(f"setp {name} {value.get(kind, dice.randrange(9))}")
        self.assertGreater(len(lines), 30)
        self.run_program("shell", "-k", given="\n".join(lines) + "\n")  # some are out of range

    def wait_for_cycles(self, count):
        start = self.cycles()
        wait_until(lambda: self.cycles() >= start + count, f"{count} cycles")

    def cycles(self):
        return int(self.shell("getp", "servo.threadbeat").stdout)

    def replay(self, name, *options):
        done = self.run_program("replay", "--exact", name, *options)
        return done.returncode, done.stdout + done.stderr

    def test_all_components_execute_from_a_state(self):
        loads = load_lines()
        self.assertGreater(len(loads), 100)
        left_out = {*WITHOUT_STATE, "hm2_eth"}  # hm2_eth: mesa under another name
        known = [line for name, line in loads.items() if name not in left_out]
        parts = 4  # of which all values can be recorded
        for part in range(parts):
            with self.subTest(part):
                self.run_journaled(known[part::parts])
                self.compare("run.mcap")
                so_far = r"stopped; no difference so far, [1-9]\d* values compared"
                self.compare("run.mcap", "--until", "250", "--cut", "rest.mcap", verdict=so_far)
                # it has no recorded values, but checksums
                self.compare("rest.mcap", verdict="no difference")

    def compare(self, name, *options, verdict=r"no difference, [1-9]\d* values compared"):
        status, text = self.replay(name, *options)
        self.assertEqual(0, status, text)
        self.assertRegex(text, rf"(?m)^{verdict}$")

    def test_those_without_a_state_are_named(self):
        loads = load_lines()
        for name, reason in WITHOUT_STATE.items():
            if name not in loads:
                continue  # its package is left out
            with self.subTest(name):
                self.run_journaled([loads[name]], pins=False)
                text = self.replay("run.mcap")[1]
                self.assertRegex(
                    text, reason.format(name=name, instance=name.replace("_", "-") + r"(\.0)?")
                )


if __name__ == "__main__":
    unittest.main()
