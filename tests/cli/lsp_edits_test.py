# SPDX-License-Identifier: MIT
"""hal lsp: after random edits the diagnostics are those of a server that has only seen the last text."""

import random
import unittest

from harness import Case
from lsp_client import Client

EDITS = 150
INSTANCES = 12
NAMES = ["sum2", "not", "mux2", "pid"]


def netlist():
    lines = ["newthread servo 1ms", "newthread slow 10ms"]
    lines += [f"loadrt {name} count={INSTANCES}" for name in NAMES]
    lines += [f"net s{i} sum2.{i}.out => sum2.{i + 1}.in0" for i in range(INSTANCES - 1)]
    lines += [f"net b{i} not.{i}.out => mux2.{i}.sel" for i in range(INSTANCES)]
    lines += [f"addf sum2.{i} servo" for i in range(INSTANCES)]
    return lines + ["setp pid.0.Pgain 2", "source part.hal", "addf --auto slow"]


def new_line(chance):
    """A line that is correct or not, alone or with the others."""
    number = chance.randrange(INSTANCES + 2)
    return chance.choice(
        [
            f"net s{number} sum2.{number}.in1",
            f"net b{number} <= not.{number}.out",
            f"net x{number} sum2.{number}.out mux2.{number}.in0",
            f"net s{number} pid.{number}.command",
            f"loadrt {chance.choice(NAMES)} names=more{number}",
            f"addf pid.{number}.do-pid-calcs servo",
            f"setp sum2.{number}.gain0 {chance.choice(['2', 'two', '1e3'])}",
            f"alias pin sum2.{number}.in1 a{number}",
            f"newthread t{number} {number}ms",
            f"delf sum2.{number} servo",
            "unlinkp sum2.0.in0",
            "source part.hal",
            "# nothing",
            "net \u00fc\U0001f600 sum2.0.in1",
            "",
        ]
    )


class Edits(Case):
    def client(self):
        client = Client(self.environment, self.folder)
        self.addCleanup(client.kill)
        return client

    def edit(self, chance, lines):
        """A random edit of the lines, and the change that has the same effect in the editor."""
        at = chance.randrange(len(lines))
        kind = chance.choice(["insert", "remove", "replace", "comment", "move"])
        if kind == "insert":
            lines.insert(at, new_line(chance))
            return (at, 0, at, 0, lines[at] + "\n")
        if kind == "comment":
            lines[at] = "#" + lines[at]
            return (at, 0, at, 0, "#")
        if kind == "remove" and len(lines) > 20:
            lines.pop(at)
            return (at, 0, at + 1, 0, "")
        before = len(lines[at].encode("utf-16-le")) // 2
        lines[at] = new_line(chance) if kind == "replace" else chance.choice(lines)
        return (at, 0, at, before, lines[at])

    def test_diagnostics_are_those_of_a_fresh_server(self):
        self.write("part.hal", "net part pid.1.output => sum2.3.in1\n")
        chance = random.Random(36)
        lines = netlist()
        edited = self.client()
        name = edited.open(self.write("edited.hal", "\n".join(lines) + "\n"))
        with_errors = 0
        for number in range(EDITS):
            if number % 25 == 0:  # errors do not pile up
                lines = netlist()
                edited.change(name, "\n".join(lines) + "\n")
            edited.change(name, self.edit(chance, lines))
            got = edited.diagnostics(name)
            if number % 10 == 0:  # what an editor asks, too, leaves the diagnostics as they are
                edited.at(name, 3, 5, "completion")
            fresh = self.client()
            opened = fresh.open(self.folder / "edited.hal", "\n".join(lines) + "\n")
            self.assertEqual(fresh.diagnostics(opened), got, lines)
            with_errors += any(one["severity"] == 1 for one in got)
            fresh.kill()
        self.assertEqual(0, edited.quit())
        self.assertGreater(with_errors, EDITS // 10)
        self.assertLess(with_errors, EDITS)


if __name__ == "__main__":
    unittest.main()
