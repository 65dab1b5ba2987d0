# SPDX-License-Identifier: MIT
"""hal lsp beside a running machine: values in hover and beside the lines, faults, and changed lines as one transaction."""

import os
import signal
import time
import unittest

from harness import Case, suspend, wait_until
from lsp_client import Client

NETLIST = """loadrt threads name1=servo period1=1000000
loadrt sum2 names=adder,other
addf adder servo
addf other servo
setp adder.in0 2
setp adder.in1 [X]HIGH
net total adder.out => other.in0
"""


class Live(Case):
    def setUp(self):
        super().setUp()
        self.file = self.write("m.hal", NETLIST)
        self.setUpMachine()

    def setUpMachine(self):
        """Starts the machine of the file, and an editor that has it open."""
        ini = self.write("values.ini", "[X]\nHIGH = 3\nMORE = 40\n")
        self.machine = self.start("run", "--ini", ini, "--name", "cell", "m.hal", instance="cell")
        self.client = Client(self.environment, self.folder, "--ini", ini, initialize=False)
        self.addCleanup(self.client.kill)
        self.client.ask(
            "initialize",
            {
                "capabilities": {"workspace": {"inlayHint": {"refreshSupport": True}}},
                "initializationOptions": {"machine": "cell"},
            },
        )
        self.client.notify("initialized", {})
        self.name = self.client.open(self.file)
        self.client.diagnostics(self.name)

    def hints(self):
        whole = {"start": {"line": 0, "character": 0}, "end": {"line": 99, "character": 0}}
        found = self.client.ask(
            "textDocument/inlayHint", {"textDocument": {"uri": self.name}, "range": whole}
        )
        return {(one["position"]["line"], one["label"]) for one in found}

    def apply(self, text):
        self.client.change(self.name, text)
        return self.client.ask(
            "workspace/executeCommand", {"command": "halcyon.apply", "arguments": [self.name]}
        )

    def test_an_ini_file_is_not_sent_as_commands(self):
        values = self.folder / "values.ini"
        name = self.client.open(str(values))
        self.client.change(name, "[X]\nHIGH = 7\nMORE = 40\nunload adder\n")
        answer = self.client.ask(
            "workspace/executeCommand", {"command": "halcyon.apply", "arguments": [name]}
        )
        self.assertEqual(
            {
                "applied": False,
                "message": "an INI file has values for netlists and no commands: a machine has "
                "them from its start",
            },
            answer,
        )
        self.assertEqual("3", self.in_machine("adder.in1"))
        answer = self.apply(NETLIST.replace("in0 2", "in0 20"))
        self.assertTrue(answer["applied"])
        self.assertIn(
            "values.ini has changed since it was opened: a machine has its values from its start\n",
            answer["message"],
        )
        self.assertEqual("20", self.in_machine("adder.in0"))
        self.assertEqual("3", self.in_machine("adder.in1"))

    def in_machine(self, name):
        command = "getp" if "." in name else "gets"
        return self.shell(command, name, instance="cell").stdout.strip()

    def test_a_hover_has_the_present_value(self):
        wait_until(lambda: self.in_machine("total") == "5", "the sum")
        text = self.client.at(self.name, 6, 5, "hover")["contents"]["value"]
        self.assertIn("value in the machine `cell`: **5**", text)
        self.shell("setp", "adder.in0", "4", instance="cell")
        wait_until(lambda: self.in_machine("total") == "7", "the sum")
        text = self.client.at(self.name, 6, 5, "hover")["contents"]["value"]
        self.assertIn("**7**", text)

    def test_values_stand_beside_the_lines_and_are_refreshed(self):
        wait_until(lambda: self.in_machine("total") == "5", "the sum")
        self.assertEqual({(4, "= 2"), (5, "= 3"), (6, "= 5")}, self.hints())
        self.shell("setp", "adder.in0", "4", instance="cell")
        while not self.client.requests:
            self.client.dispatch(self.client.receive())
        self.assertEqual("workspace/inlayHint/refresh", self.client.requests[0]["method"])
        wait_until(lambda: (6, "= 7") in self.hints(), "the new sum")

    def test_a_fault_stands_beside_its_line(self):
        os.kill(self.machine.pid, signal.SIGSTOP)
        time.sleep(0.3)  # the machine stalls: that is the fault
        os.kill(self.machine.pid, signal.SIGCONT)
        wait_until(
            lambda: self.shell("show", "fault", instance="cell").stdout.strip() != "no faults",
            "a fault",
        )
        labels = [label for _, label in self.hints()]
        self.assertTrue(any(label.startswith("fault: ") for label in labels), labels)

    def test_a_machine_that_does_not_answer_does_not_stop_the_editor(self):
        self.hints()
        suspend(self.machine.pid)
        try:
            begun = time.monotonic()
            self.assertEqual(set(), self.hints())
            self.assertIsNotNone(self.client.at(self.name, 6, 5, "hover"))
            self.assertLess(time.monotonic() - begun, 5)
        finally:
            os.kill(self.machine.pid, signal.SIGCONT)

    def test_changed_lines_take_effect_together(self):
        text = NETLIST.replace("in0 2", "in0 20").replace("=> other.in0", "=> other.in1")
        text += "setp other.in0 [X]MORE\nnet sum-of-all other.out\n"
        answer = self.apply(text)
        self.assertTrue(answer["applied"], answer)
        self.assertIn("took effect", answer["message"])
        wait_until(lambda: self.in_machine("sum-of-all") == "63", "23 and 40")
        self.assertEqual("23", self.in_machine("total"))
        again = self.apply(text)
        self.assertEqual((False, "no line has changed"), (again["applied"], again["message"]))
        # removed lines are reverted
        answer = self.apply(text.replace("net sum-of-all other.out\n", ""))
        self.assertTrue(answer["applied"], answer)
        self.assertEqual(1, self.shell("gets", "sum-of-all", instance="cell").returncode)

    def test_an_error_changes_nothing(self):
        answer = self.apply(NETLIST.replace("in0 2", "in0 20") + "net x other.nothing\n")
        self.assertFalse(answer["applied"])
        self.assertIn("m.hal:8:7: error: unknown pin 'other.nothing'", answer["message"])
        self.assertEqual("2", self.in_machine("adder.in0"))
        self.assertTrue(self.apply(NETLIST.replace("in0 2", "in0 20"))["applied"])
        wait_until(lambda: self.in_machine("adder.in0") == "20", "the value")

    def test_a_line_that_acts_is_not_sent(self):
        answer = self.apply(NETLIST + "stop\n")
        self.assertFalse(answer["applied"])
        self.assertIn("line 8: 'stop' acts at once", answer["message"])

    def order(self):
        """The functions of the running machine in their order."""
        saved = self.shell("save", instance="cell").stdout
        return [line.split()[1] for line in saved.splitlines() if line.startswith("addf ")]

    def test_the_order_of_functions_is_applied(self):
        lines = NETLIST.splitlines(keepends=True)
        swapped = "".join(lines[:2] + [lines[3], lines[2]] + lines[4:])
        answer = self.apply(swapped)
        self.assertTrue(answer["applied"], answer)
        self.assertEqual(["other", "adder"], self.order())
        self.assertEqual("no line has changed", self.apply(swapped)["message"])
        # a new function in front, and one by its position
        inserted = swapped.replace(
            "addf other servo\n",
            "loadrt sum2 names=first,second\naddf first servo\naddf other servo\n"
            "addf second servo 2\n",
        )
        answer = self.apply(inserted)
        self.assertTrue(answer["applied"], answer)
        self.assertEqual(["first", "second", "other", "adder"], self.order())
        answer = self.apply(swapped)
        self.assertTrue(answer["applied"], answer)
        self.assertIn("'loadrt sum2 names=first,second' was removed", answer["message"])
        self.assertEqual(["other", "adder"], self.order())
        again = self.apply(swapped)["message"]
        self.assertIn("not sent before: 'loadrt sum2 names=first,second' was removed", again)

    def test_an_order_that_another_file_takes_part_in_is_named(self):
        self.write("more.hal", "loadrt sum2 names=more\naddf more servo\n")
        before = NETLIST + "source more.hal\n"
        self.end(self.machine)
        self.client.kill()
        self.write("m.hal", before)
        self.setUpMachine()
        moved = "source more.hal\n".join(NETLIST.split("addf adder servo\n", 1))
        moved = moved.replace("addf other servo\n", "addf adder servo\naddf other servo\n")
        answer = self.apply(moved)
        self.assertFalse(answer["applied"], answer)
        self.assertIn("the new order of functions in thread 'servo'", answer["message"])
        self.assertEqual(["adder", "other", "more"], self.order())

    def test_an_automatic_order_is_named(self):
        before = NETLIST.replace("addf other servo\n", "addf --auto servo other\n")
        self.end(self.machine)
        self.client.kill()
        self.write("m.hal", before)
        self.setUpMachine()
        answer = self.apply(before + "net more other.out\n")
        self.assertTrue(answer["applied"], answer)
        self.assertIn("line 4: 'addf --auto servo other' chooses an order", answer["message"])

    def test_a_text_that_does_not_load_is_named(self):
        """The machine accepts the changed line alone; a start would not."""
        answer = self.apply(NETLIST.replace("loadrt sum2 names=adder,other\n", "") + "loadrt or2\n")
        self.assertTrue(answer["applied"], answer)
        self.assertIn("m.hal has 6 errors and cannot be started again", answer["message"])

    def test_the_last_of_two_values_is_applied(self):
        twice = NETLIST + "setp adder.in0 7\n"
        self.assertTrue(self.apply(twice)["applied"])
        self.assertEqual("7", self.in_machine("adder.in0"))
        answer = self.apply(twice.replace("adder.in0 2", "adder.in0 20"))
        self.assertEqual("7", self.in_machine("adder.in0"), answer)
        answer = self.apply(NETLIST)
        self.assertTrue(answer["applied"], answer)
        self.assertEqual("2", self.in_machine("adder.in0"))

    def test_moved_components_are_named_and_comments_are_not_sent(self):
        loads = "loadrt and2\nloadrt or2\n"
        self.assertTrue(self.apply(NETLIST + loads)["applied"])
        answer = self.apply(NETLIST + "loadrt or2\nloadrt and2\n")
        self.assertFalse(answer["applied"])
        self.assertIn("has another position among the other commands", answer["message"])
        answer = self.apply(NETLIST.replace("addf other servo", "addf other  servo # 2") + loads)
        self.assertEqual((False, "no line has changed"), (answer["applied"], answer["message"]))

    def test_without_a_machine_nothing_is_sent(self):
        self.end(self.machine)
        answer = self.apply(NETLIST.replace("in0 2", "in0 20"))
        self.assertFalse(answer["applied"])
        self.assertIn("no machine 'cell' is running", answer["message"])


if __name__ == "__main__":
    unittest.main()
