# SPDX-License-Identifier: MIT
"""hal lsp renames signals, instances and threads in all files of a machine: the netlist stays the same, and what cannot be renamed
is rejected with a reason."""

import random
import re
import shutil
import unittest
from pathlib import Path

from harness import ROOT, SANITIZED, Case
from lsp_client import Client, path_of
from lsp_features_test import apply

MAIN = """newthread servo 1ms
loadrt sum2 names=adder,other
loadrt pid count=2
loadrt and2 names=[NAMES]GATE
addf adder servo
net total adder.out => other.in0
net total pid.0.command
net j[0..1]-on pid.[0..1].enable
setp [NAMES]PIN 5
source part.hal
# the end
"""
PART = """net total pid.1.command
net [NAMES]SIGNAL other.out => \\
    pid.0.feedback
setp other.in1 3
linksp [NAMES]SIGNAL pid.1.feedback
addf [NAMES]GATE servo
"""
INI = """[HAL]
HALFILE = main.hal
[NAMES]
GATE = gate
PIN = adder.in1
SIGNAL = back
"""


class Lsp(Case):
    def client(self, *options):
        client = Client(self.environment, self.folder, *options)
        self.addCleanup(client.kill)
        return client

    def write_edits(self, answer):
        for name, edits in answer["changes"].items():
            path = path_of(name)
            path.write_text(apply(path.read_text(), edits))


class Rename(Lsp):
    def setUp(self):
        super().setUp()
        self.write("m.ini", INI)
        self.write("main.hal", MAIN)
        self.write("part.hal", PART)
        self.lsp = self.client()
        self.main = self.lsp.open(self.folder / "main.hal")

    def rename(self, line, column, new):
        return self.lsp.ask_whole(
            "textDocument/rename",
            {
                "textDocument": {"uri": self.main},
                "position": {"line": line, "character": column},
                "newName": new,
            },
        )

    def error(self, *where):
        return self.rename(*where)["error"]["message"]

    def test_a_signal_in_all_files(self):
        self.write_edits(self.rename(5, 5, "sum-of-all")["result"])
        self.assertEqual(
            MAIN.replace("total", "sum-of-all"), (self.folder / "main.hal").read_text()
        )
        self.assertEqual(
            PART.replace("total", "sum-of-all"), (self.folder / "part.hal").read_text()
        )

    def test_an_instance_with_its_pins_and_functions_and_values_of_the_ini_file(self):
        self.write_edits(self.rename(1, 20, "sum")["result"])
        self.assertEqual(MAIN.replace("adder", "sum"), (self.folder / "main.hal").read_text())
        self.assertEqual(INI.replace("adder", "sum"), (self.folder / "m.ini").read_text())
        self.assertEqual(PART, (self.folder / "part.hal").read_text())
        self.assertIn("no errors", self.run_program("check", "m.ini").stderr)

    def test_a_name_that_is_a_value_of_the_ini_file(self):
        self.write_edits(self.rename(3, 20, "both")["result"])
        self.assertEqual(MAIN, (self.folder / "main.hal").read_text())
        self.assertEqual(INI.replace("= gate", "= both"), (self.folder / "m.ini").read_text())

    def test_a_thread(self):
        self.write_edits(self.rename(0, 10, "fast")["result"])
        self.assertEqual(MAIN.replace("servo", "fast"), (self.folder / "main.hal").read_text())
        self.assertEqual(PART.replace("servo", "fast"), (self.folder / "part.hal").read_text())

    def test_what_cannot_be_renamed_has_a_reason(self):
        self.assertIn("numbered", self.error(6, 11, "x"))
        self.assertIn("made by a range", self.error(7, 6, "x"))
        self.assertIn("name of the instance", self.error(5, 17, "x"))
        self.assertIn("only signals, instances and threads", self.error(4, 1, "x"))
        self.assertIn("no name under the cursor", self.error(10, 5, "x"))

    def test_an_invalid_or_taken_name_is_rejected(self):
        self.assertIn("a blank ends the word", self.error(5, 5, "two words"))
        self.assertIn("is taken", self.error(5, 5, "back"))
        self.assertIn("is taken", self.error(1, 20, "other"))
        self.assertIn("it is empty", self.error(5, 5, ""))

    def test_the_name_is_offered_for_editing(self):
        self.assertEqual("adder", self.lsp.at(self.main, 5, 12, "prepareRename")["placeholder"])
        self.assertIsNone(self.lsp.at(self.main, 10, 5, "prepareRename"))


class RandomRenames(Lsp):
    """Renames at random places of machines of halfiles."""

    RENAMES = 20 if SANITIZED else 100  # under a sanitizer, 100 take two minutes
    MACHINES = ("furuta/hang.hal", "rt/axis.hal", "canopen-drive/drive.hal", "cell/cell.hal")

    def saved(self, path):
        """The netlist as the machine saves it, line by line: names as they are."""
        commands = self.write("saved.hal", f"source {path}\nsave all {self.folder}/plan\n")
        done = self.run_program("sim", commands)
        self.assertEqual(0, done.returncode, done.stderr)
        return (self.folder / "plan").read_text()

    def places(self, client, name):
        """All places with a name that may be renamed, as (line, column)."""
        data = client.ask("textDocument/semanticTokens/full", {"textDocument": {"uri": name}})[
            "data"
        ]
        legend = client.capabilities["semanticTokensProvider"]["legend"]["tokenTypes"]
        line = column = 0
        for i in range(0, len(data), 5):
            column = data[i + 1] + (column if data[i] == 0 else 0)
            line += data[i]
            if legend[data[i + 3]] in ("variable", "property", "namespace", "function", "event"):
                yield line, column

    def test_random_renames_leave_the_plan_unchanged(self):
        rng = random.Random(36)
        done = rejected = 0
        machines = sorted((ROOT / "halfiles").glob("*/*.hal"))
        rng.shuffle(machines)
        for machine in machines:
            if done >= self.RENAMES:
                break
            copy = self.folder / machine.parent.name
            if not copy.exists():
                ignored = shutil.ignore_patterns("__pycache__", "*.var*", "*.expanded")
                shutil.copytree(machine.parent, copy, ignore=ignored)
            path = copy / machine.name
            if self.run_program("check", path).returncode != 0:
                continue
            if self.run_program("sim", "--help").returncode != 0 or "node " in path.read_text():
                continue
            client = self.client()
            name = client.open(path)
            places = list(self.places(client, name))
            if not places:
                continue
            before = self.lines(self.saved(path))
            names = {}
            for line, column in rng.sample(places, min(16, len(places))):
                new = f"renamed{done}"
                prepared = client.ask_whole(
                    "textDocument/prepareRename",
                    {
                        "textDocument": {"uri": name},
                        "position": {"line": line, "character": column},
                    },
                )
                if not prepared.get("result"):
                    rejected += 1
                    continue
                old = prepared["result"]["placeholder"]
                answer = client.ask_whole(
                    "textDocument/rename",
                    {
                        "textDocument": {"uri": name},
                        "position": {"line": line, "character": column},
                        "newName": new,
                    },
                )
                if "error" in answer:
                    rejected += 1
                    continue
                self.write_edits(answer["result"])
                client.change(name, path.read_text())
                client.notify("workspace/didChangeWatchedFiles", {"changes": []})
                names[new] = names.pop(old, old)
                done += 1
            after = self.saved(path)
            for new, old in names.items():
                after = re.sub(rf"\b{new}\b", lambda _: old, after)
            self.assertEqual(before, self.lines(after), machine)
            self.assertEqual(0, client.quit())
        print(f"{done} renames, {rejected} rejected")
        self.assertGreaterEqual(done, self.RENAMES)

    def lines(self, text):
        """Order is a matter of names."""
        return sorted(" ".join(sorted(re.split(r"[ ,]+", line))) for line in text.splitlines())


if __name__ == "__main__":
    unittest.main()
