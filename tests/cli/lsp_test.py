# SPDX-License-Identifier: MIT
"""hal lsp: the protocol, the texts of the editor, and to which netlist a file belongs."""

import json
import unittest

from harness import ROOT, Case, needs_package
from lsp_client import Client, uri

MACHINE = """newthread servo 1ms
loadrt sum2 names=adder
addf adder servo
net total adder.out
"""


def codes(diagnostics):
    return [(one["code"], one["range"]["start"]["line"]) for one in diagnostics]


class Lsp(Case):
    def client(self, *options, **how):
        client = Client(self.environment, self.folder, *options, **how)
        self.addCleanup(client.kill)
        return client


class Protocol(Lsp):
    def test_a_session_from_initialize_to_exit(self):
        client = self.client()
        self.assertEqual("utf-16", client.capabilities["positionEncoding"])
        self.assertEqual(2, client.capabilities["textDocumentSync"]["change"])
        self.assertEqual(0, client.quit())

    def test_exit_without_shutdown_is_an_error(self):
        client = self.client()
        client.notify("exit", None)
        self.assertEqual(1, client.process.wait())

    def test_the_end_of_the_input_ends_the_server(self):
        client = self.client()
        client.process.stdin.close()
        self.assertEqual(1, client.process.wait())

    def test_requests_out_of_order_are_errors(self):
        client = self.client(initialize=False)
        self.assertEqual(-32002, client.ask_whole("shutdown", None)["error"]["code"])
        client.ask("initialize", {"capabilities": {}})
        self.assertEqual(-32600, client.ask_whole("initialize", {})["error"]["code"])
        self.assertEqual(-32601, client.ask_whole("no/such", {})["error"]["code"])
        self.assertEqual(0, client.quit())

    def test_invalid_messages_are_answered_and_survived(self):
        client = self.client()
        for body, code in ((b"{", -32700), (b"[]", -32600), (b'{"id":7}', -32600)):
            client.send_bytes(b"Content-Length: %d\r\n\r\n" % len(body) + body)
            self.assertEqual(code, client.receive()["error"]["code"])
        client.notify("textDocument/didChange", {"contentChanges": 3})
        client.notify("textDocument/didChange", None)
        self.assertEqual(0, client.quit())

    def test_a_message_may_come_in_pieces_with_other_fields(self):
        client = self.client()
        body = json.dumps({"jsonrpc": "2.0", "id": 900, "method": "shutdown"}).encode()
        whole = (
            b"Content-Type: application/vscode-jsonrpc; charset=utf-8\r\ncontent-length: %d\r\n\r\n"
            % len(body)
            + body
        )
        for i in range(len(whole)):
            client.send_bytes(whole[i : i + 1])
        self.assertEqual({"jsonrpc": "2.0", "id": 900, "result": None}, client.receive())

    def test_an_invalid_header_ends_the_server(self):
        for header in (b"Content-Length: x\r\n\r\n", b"a\r\n\r\n", b"A: b\r\n\r\n", b"x" * 5000):
            client = self.client()
            client.send_bytes(header)
            self.assertEqual(1, client.process.wait())

    def test_what_a_component_prints_is_no_message(self):
        """The descriptor of standard output is another one while netlists are loaded."""
        client = self.client()
        name = client.open(self.write("m.hal", MACHINE + "print hello\nshow pin\n"))
        self.assertEqual([], codes(client.diagnostics(name)))
        self.assertEqual(0, client.quit())

    def test_an_argument_is_an_error(self):
        self.assertIn("unexpected argument", self.bad("lsp", "file.hal"))


class Texts(Lsp):
    def test_changes_are_counted_in_utf_16_code_units(self):
        client = self.client()
        name = client.open("untitled:1", MACHINE + "# 𝛼é\nsetp nothing 1 # 𝛼\n")
        self.assertEqual([("no-such-pin", 5)], codes(client.diagnostics(name)))
        # behind the comment: 2 + a surrogate pair + 1
        client.change(name, (4, 5, 4, 5, "\nnet 𝛼é𝛼 adder.in00 #"))
        found = client.diagnostics(name)
        self.assertEqual([("no-such-pin", 5), ("no-such-pin", 6)], codes(found))
        range_ = found[0]["range"]
        self.assertEqual((10, 20), (range_["start"]["character"], range_["end"]["character"]))
        # several changes, each in the text that the one before has made
        client.change(name, (5, 10, 5, 20, "adder.in0"), (0, 0, 0, 0, "\n"), (7, 0, 8, 0, ""))
        self.assertNotIn("no-such-pin", [code for code, _ in codes(client.diagnostics(name))])
        client.change(name, "setp nothing 1\r\nsetp nowhere 2\rsetp never 3")
        self.assertEqual(
            ["no-such-pin"],
            sorted(
                {c for c, _ in codes(client.diagnostics(name))}
                - {"dos-line-endings", "lone-carriage-return"}
            ),
        )

    def test_positions_behind_the_end_count_as_the_end(self):
        client = self.client()
        name = client.open("untitled:2", "newthread a 1ms\n")
        client.change(name, (0, 900, 0, 900, " #"), (77, 5, 99, 2**31, "newthread a 2ms"))
        self.assertEqual([1], [line for _, line in codes(client.diagnostics(name))])

    def test_the_editor_takes_precedence_over_the_disk(self):
        client = self.client()
        part = self.write("part.hal", "setp nothing 1\n")
        whole = client.open(self.write("whole.hal", "source part.hal\n"))
        self.assertEqual([], client.diagnostics(whole))
        self.assertEqual(
            ["no-such-pin"], [one["code"] for one in client.published[uri(part)]["diagnostics"]]
        )
        opened = client.open(part, MACHINE)
        self.assertEqual([], client.diagnostics(opened))
        client.close(opened)
        client.change(whole, (1, 0, 1, 0, "# changed\n"))
        client.diagnostics(whole)
        self.assertEqual(
            ["no-such-pin"], [one["code"] for one in client.published[uri(part)]["diagnostics"]]
        )
        client.close(whole)
        self.assertEqual(0, client.quit())
        self.assertEqual([], client.published[uri(part)]["diagnostics"])


class Roots(Lsp):
    def test_a_part_is_checked_in_the_netlist_that_reads_it(self):
        self.write("whole.hal", MACHINE + "source part.hal\n")
        part = self.write("part.hal", "net more adder.out => nothing.in\nnet total\n")
        client = self.client()
        name = client.open(part)
        found = client.diagnostics(name)
        self.assertEqual([0, 0], [line for _, line in codes(found)][:2])
        self.assertNotIn("no-such-component", [code for code, _ in codes(found)])

    def test_the_files_of_an_ini_file_are_checked_together(self):
        self.write("m.ini", "[HAL]\nHALFILE = a.hal\nHALFILE = b.hal\n[X]\nIN = adder.in0\n")
        self.write("a.hal", MACHINE)
        client = self.client()
        name = client.open(self.write("b.hal", "setp [X]IN 5\nsetp [X]INN 5\n"))
        self.assertEqual([1], [line for _, line in codes(client.diagnostics(name))])

    def test_an_ini_file_without_netlists_has_no_errors(self):
        client = self.client()
        name = client.open(self.write("other.ini", "[editor]\nnothing here\n"))
        self.assertEqual([], client.diagnostics(name))

    def test_settings_name_an_ini_file_and_assumed_components(self):
        ini = self.write("values.ini", "[X]\nIN = adder.in0\n")
        text = MACHINE + "loadrt hal_card\nnet a card.0.x => adder.in1\nsetp [X]IN 5\n"
        client = self.client(settings={"halcyon": {"ini": ini, "assume": ["hal_card"]}})
        name = client.open(self.write("m.hal", text))
        self.assertEqual({"unchecked-lines"}, {code for code, _ in codes(client.diagnostics(name))})

    def test_a_netlist_for_several_machines_is_checked_for_each(self):
        client = self.client()
        text = "node a b\nnewthread t 1ms\nnode b\nsetp nothing 1\nnode all\nsetp nowhere 1\n"
        name = client.open(self.write("cell.hal", text))
        self.assertEqual(
            {("no-such-pin", 3), ("no-such-pin", 5)},
            {one for one in codes(client.diagnostics(name)) if one[0] == "no-such-pin"},
        )

    @needs_package("panel")
    def test_a_panel_has_the_errors_of_hal_panel(self):
        client = self.client()
        file = ROOT / "tests" / "errors" / "panel-line.panel"
        name = client.open(file)
        found = client.diagnostics(name)
        self.assertEqual(17, len(found))
        self.assertEqual({"panel-line"}, {code for code, _ in codes(found)})
        first = found[0]["range"]
        self.assertEqual(
            (0, 10, 0, 15),
            (
                first["start"]["line"],
                first["start"]["character"],
                first["end"]["line"],
                first["end"]["character"],
            ),
        )


if __name__ == "__main__":
    unittest.main()
