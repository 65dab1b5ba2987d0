# SPDX-License-Identifier: MIT
"""An emulated Mesa card in a process of its own, for tests."""

import signal

from harness import TIMEOUT, wait_until


class MesaNode:
    """For a Case with a `host` and a file card.mesa of a 7i92."""

    def node(self, *words):
        node = self.start_logged(
            "node", "mesa", "card.mesa", "--address", self.host, *words, mode="a"
        )
        self.addCleanup(self.end_node, node)
        wait_until(lambda: f"7i92 at {self.host}" in self.log(), "the card runs")
        return node

    def log(self):
        return (self.folder / "node.log").read_text()

    @staticmethod
    def end_node(node):
        node.send_signal(signal.SIGCONT)
        node.terminate()
        node.wait(timeout=TIMEOUT)
