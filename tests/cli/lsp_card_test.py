# SPDX-License-Identifier: MIT
# packages: mesa
"""hal lsp with loadrt mesa and mesa_card: the driver looks for its card while it is constructed, and finds that of the
present text, as `hal check` does, although the models before and beside it have cards, too."""

import re
import shutil
import socket
import unittest

from harness import ROOT, Case
from lsp_client import Client

MILL = ROOT / "halfiles" / "mesa-mill"


def swapped(text):
    """The netlist with the driver in front of its emulated card."""
    lines = text.splitlines(keepends=True)
    card = next(i for i, line in enumerate(lines) if line.startswith("loadrt mesa_card"))
    assert lines[card + 1].startswith("loadrt mesa "), lines[card + 1]
    lines[card], lines[card + 1] = lines[card + 1], lines[card]
    return "".join(lines)


class Card(Case):
    def setUp(self):
        super().setUp()
        self.mill = self.copy("mill")
        self.card = self.mill.with_suffix(".mesa")
        self.good = self.mill.read_text()
        self.good_card = self.card.read_text()
        self.client = Client(self.environment, self.folder)
        self.addCleanup(self.client.kill)

    def copy(self, name):
        """A copy of the mill in a folder of its own."""
        shutil.copytree(MILL, self.folder / name)
        return self.folder / name / "mill.hal"

    def checked(self, path):
        """The codes of the errors that `hal check` prints."""
        printed = self.run_program("check", path).stderr
        return sorted(re.findall(r"error: .* \[([a-z0-9-]+)\]$", printed, re.MULTILINE))

    def shown(self, name):
        """The codes of all errors in the editor, after those of the document have arrived."""
        self.client.diagnostics(name)
        # all that was published with them is in front of an answer
        self.client.ask("textDocument/documentSymbol", {"textDocument": {"uri": name}})
        every = [one for file in self.client.published.values() for one in file["diagnostics"]]
        return sorted(one["code"] for one in every if one["severity"] == 1)

    def test_a_driver_in_front_of_its_card_has_no_card(self):
        name = self.client.open(self.mill)
        self.assertEqual([], self.shown(name))
        bad = swapped(self.good)
        self.client.change(name, bad)
        got = self.shown(name)
        self.mill.write_text(bad)
        wanted = self.checked(self.mill)
        self.assertEqual(["bad-argument"], wanted)
        self.assertEqual(wanted, got)
        self.client.change(name, self.good)
        self.assertEqual([], self.shown(name))

    def test_another_card_has_the_errors_of_the_other_card(self):
        self.assertEqual([], self.shown(self.client.open(self.mill)))
        card = self.client.open(self.card)
        self.assertEqual([], self.shown(card))
        smaller = self.good_card.replace("type = 7i76e", "type = 7i92")
        self.client.change(card, smaller)
        got = self.shown(card)
        self.card.write_text(smaller)
        wanted = self.checked(self.mill)
        self.assertGreater(len(wanted), 10)
        self.assertEqual(wanted, got)
        self.client.change(card, self.good_card)
        self.assertEqual([], self.shown(card))

    def test_the_card_of_another_open_machine_is_not_found(self):
        self.assertEqual([], self.shown(self.client.open(self.mill)))
        other = self.copy("other")
        other.write_text(swapped(self.good))
        got = self.shown(self.client.open(other))
        self.assertEqual(self.checked(other), got)


class RealCard(Case):
    def test_a_card_of_hardware_is_not_contacted(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as card:
            card.bind(("127.0.0.1", 27181))
            card.setblocking(False)
            client = Client(self.environment, self.folder)
            self.addCleanup(client.kill)
            text = (
                "loadrt threads name1=t period1=1000000\nloadrt mesa board=eth:127.0.0.1\n"
                "addf hm2_7i76e.0.read t\nloadrt and2 names=a\naddf a t\n"
            )
            name = client.open("untitled:1", text)
            found = client.diagnostics(name)
            self.assertEqual(["unchecked-lines"], [one["code"] for one in found])
            self.assertIn(
                "1 line depends on 'mesa', whose hardware is not contacted here",
                found[0]["message"],
            )
            client.change(name, text + "setp a.in7 1\n")
            self.assertIn("no-such-pin", [one["code"] for one in client.diagnostics(name)])
            with self.assertRaises(BlockingIOError):
                card.recv(2000)


if __name__ == "__main__":
    unittest.main()
