# SPDX-License-Identifier: MIT
"""hal lsp beside a running machine: values in hover and beside the lines, faults, and changed lines as one transaction."""

import os
import signal
import time
import unittest

from harness import Case, wait_until
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
        ini = self.write("values.ini", "[X]\nHIGH = 3\nMORE = 40\n")
        self.file = self.write("m.hal", NETLIST)
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
        os.kill(self.machine.pid, signal.SIGSTOP)
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

    def test_without_a_machine_nothing_is_sent(self):
        self.end(self.machine)
        answer = self.apply(NETLIST.replace("in0 2", "in0 20"))
        self.assertFalse(answer["applied"])
        self.assertIn("no machine 'cell' is running", answer["message"])


if __name__ == "__main__":
    unittest.main()
