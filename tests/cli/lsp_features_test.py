# SPDX-License-Identifier: MIT
"""hal lsp: completion, hover, definitions, references, the outline, quick fixes, colours and the format of a text."""

import unittest
from pathlib import Path

from harness import Case, needs_package, packages_left_out
from lsp_client import Client, path_of

NETLIST = """# a machine
newthread servo 1ms
loadrt sum2 names=adder,other
loadrt pid count=2
addf adder servo
addf other servo
net total adder.out => other.in0 pid.0.command
setp adder.in0 2  # two
source part.hal
"""
PART = """setp other.in1 [LIMITS]HIGH
net total pid.1.command
"""


class Lsp(Case):
    def setUp(self):
        super().setUp()
        self.write("part.hal", PART)
        ini = self.write("values.ini", "[LIMITS]\nLOW = 1\nHIGH = 7.5\n")
        self.client = Client(self.environment, self.folder, "--ini", ini)
        self.addCleanup(self.client.kill)

    def open(self, text=NETLIST, name="m.hal"):
        return self.client.open(self.write(name, text))

    def position(self, name, text, of=None):
        """The line and column of the beginning of a text, or of a part of it."""
        whole = self.client.texts[name]
        at = whole.index(text) + (text.index(of) if of else 0)
        return whole[:at].count("\n"), at - (whole.rfind("\n", 0, at) + 1)


class Completion(Lsp):
    def offered(self, name, line):
        """The completions at the end of a line that is added to a text."""
        text = self.client.texts[name]
        self.client.change(name, text + line)
        answer = self.client.at(name, text.count("\n"), len(line), "completion")
        self.client.change(name, text)
        return {one["label"]: one for one in answer["items"]}

    def test_names_by_the_word_of_the_command(self):
        name = self.open()
        for line, wanted, unwanted in (
            ("ne", "net", "setp"),
            ("loadrt su", "sum2", "pid"),
            ("loadrt sum2 ", "names=", "sum2"),
            ("setp pid.0.Pg", "pid.0.Pgain", "pid.0.output"),
            ("net ", "total", "adder.out"),
            ("net total pid.1.o", None, "pid.1.output"),
            ("net new pid.1.o", "pid.1.output", None),
            ("addf pid.0.", "pid.0.do-pid-calcs", "adder"),
            ("addf pid.0.do-pid-calcs ", "servo", "total"),
            ("setp other.in1 [LIM", "[LIMITS]HIGH", None),
            ("source pa", "part.hal", "m.hal"),
        ):
            with self.subTest(line):
                found = self.offered(name, line)
                if wanted:
                    self.assertIn(wanted, found)
                self.assertNotIn(unwanted, found)

    def test_a_line_with_an_error_does_not_hide_the_names_of_the_others(self):
        name = self.open("setp nothing 1\n" + NETLIST + "net x nowhere\n")
        self.assertIn("adder.in1", self.offered(name, "setp adder.in"))

    def test_the_edit_replaces_the_word_before_the_cursor(self):
        name = self.open()
        item = self.offered(name, "net total  pid.1.fee")["pid.1.feedback"]
        range_ = item["textEdit"]["range"]
        self.assertEqual((11, 20), (range_["start"]["character"], range_["end"]["character"]), item)
        self.assertIn("float", item["detail"])

    def test_a_continued_line_is_one_command(self):
        name = self.open()
        text = self.client.texts[name]
        self.client.change(name, text + "setp \\\n  pid.1.Ig")
        answer = self.client.at(name, text.count("\n") + 1, 10, "completion")
        self.assertIn("pid.1.Igain", [one["label"] for one in answer["items"]])


class Keys(Lsp):
    """Keys of the configurations of buses."""

    def labels(self, name, line, column):
        return [one["label"] for one in self.client.at(name, line, column, "completion")["items"]]

    @needs_package("canopen")
    def test_keys_of_the_section(self):
        text = "[bus]\nbi\n[node 5 x]\nheart\nbi\n\n[\nlink = \n"
        name = self.client.open(self.write("x.canopen", text))
        self.assertEqual(["bitrate"], self.labels(name, 1, 2))
        self.assertIn("heartbeat", self.labels(name, 3, 5))
        self.assertEqual([], self.labels(name, 4, 2))
        self.assertIn("tpdoN", self.labels(name, 5, 0))
        self.assertEqual(["[bus]", "[node ID NAME]"], self.labels(name, 6, 1))
        self.assertEqual([], self.labels(name, 7, 7))
        hover = self.client.at(name, 1, 1, "hover")
        self.assertIsNone(hover)
        self.client.change(name, text.replace("bi\n[", "bitrate = 1M\n["))
        about = self.client.at(name, 1, 3, "hover")["contents"]["value"]
        self.assertIn("bit rate", about)
        self.assertIn("5k..1M", about)
        self.assertIsNone(self.client.at(name, 1, 12, "hover"))

    def test_keys_of_every_bus(self):
        for ending, text, wanted in (
            ("ethercat", "[bus]\ncy\n", "cycle"),
            ("modbus", "[bus]\nlin\n", "link"),
            ("tdma", "cyc\n", "cycle"),
            ("scocan", "bitr\n", "bitrate"),
        ):
            with self.subTest(ending):
                if ending in packages_left_out():
                    continue
                name = self.client.open(self.write(f"y.{ending}", text))
                line = text.count("\n") - 1
                self.assertIn(wanted, self.labels(name, line, len(text.splitlines()[line])))
                self.assertIn(f"`{wanted}`", self.good(ending, "keys"))


class Hover(Lsp):
    def text(self, name, text, of=None):
        answer = self.client.at(name, *self.position(name, text, of), "hover")
        return answer["contents"]["value"] if answer else None

    def test_what_is_known_of_each_name(self):
        name = self.open()
        for text, of, wanted in (
            ("newthread", None, "create a real-time thread"),
            ("sum2 names", None, "sum2"),
            ("adder,other", None, "6 pins"),
            ("net total", "total", "`pid.1.command`"),
            ("pid.0.command", "command", "setpoint"),
            ("addf adder", "adder", "thread: `servo`"),
            ("addf adder servo", "servo", "1. `adder`"),
        ):
            with self.subTest(text):
                self.assertIn(wanted, self.text(name, text, of))
        self.assertIsNone(self.text(name, "# a machine"))

    def test_a_pin_shows_its_unit_and_type(self):
        name = self.open("loadrt siggen\nsetp siggen.0.frequency 2\n")
        text = self.text(name, "siggen.0.frequency", "frequency")
        self.assertIn("siggen.0.frequency float", text)
        self.assertIn("unit: Hz", text)


class Places(Lsp):
    def targets(self, name, method, text, of=None, **more):
        answer = self.client.at(name, *self.position(name, text, of), method, **more)
        answer = answer if isinstance(answer, list) else [answer]
        return sorted(
            (
                path_of(one["uri"]).name,
                one["range"]["start"]["line"],
                one["range"]["start"]["character"],
            )
            for one in answer
            if one
        )

    def test_definitions(self):
        name = self.open()
        for text, of, wanted in (
            ("other.in0", "in0", ("m.hal", 2, 24)),
            ("other.in0", "other", ("m.hal", 2, 24)),
            ("adder servo", None, ("m.hal", 2, 18)),
            ("adder servo", "servo", ("m.hal", 1, 10)),
            ("pid.0.command", "command", ("m.hal", 3, 7)),
            ("part.hal", None, ("part.hal", 0, 0)),
        ):
            with self.subTest(text):
                self.assertEqual([wanted], self.targets(name, "definition", text, of))
        part = self.client.open(self.folder / "part.hal")
        self.assertEqual([("m.hal", 6, 4)], self.targets(part, "definition", "total"))
        self.assertEqual(
            [("values.ini", 2, 7)], self.targets(part, "definition", "[LIMITS]HIGH", "HIGH")
        )

    def test_references_go_across_the_files(self):
        name = self.open()
        context = {"context": {"includeDeclaration": True}}
        self.assertEqual(
            [("m.hal", 6, 4), ("part.hal", 1, 4)],
            self.targets(name, "references", "net total", "total", **context),
        )
        self.assertEqual(
            [("m.hal", 2, 24), ("m.hal", 5, 5), ("m.hal", 6, 23), ("part.hal", 0, 5)],
            self.targets(name, "references", "other.in0", "other", **context),
        )
        self.assertEqual(
            [6],
            [
                one["range"]["start"]["line"]
                for one in self.client.at(name, 6, 5, "documentHighlight")
            ],
        )

    def test_the_outline_has_the_instances_with_their_pins(self):
        name = self.open()
        symbols = self.client.ask("textDocument/documentSymbol", {"textDocument": {"uri": name}})
        by_name = {one["name"]: one for one in symbols}
        self.assertEqual({"adder", "other", "pid.0", "pid.1", "servo", "total"}, set(by_name))
        self.assertEqual("sum2", by_name["adder"]["detail"])
        self.assertEqual(
            ["adder", "adder.out", "adder.in0"],
            [one["name"] for one in by_name["adder"]["children"]],
        )


AND2 = "loadrt and2 names=a\n"


class Edits(Lsp):
    def fixed(self, text, title=None):
        """The text after the first quick fix of its first error, or the one of that title."""
        name = self.open(text, "wrong.hal")
        first = self.client.diagnostics(name)[0]
        actions = self.client.ask(
            "textDocument/codeAction",
            {
                "textDocument": {"uri": name},
                "range": first["range"],
                "context": {"diagnostics": [first]},
            },
        )
        action = next(one for one in actions if title in (None, one["title"]))
        self.assertEqual(first, action["diagnostics"][0])
        edit = action["edit"]["changes"][name][0]
        return apply(text, [edit])

    def test_quick_fixes_are_those_of_the_help_lines(self):
        for wrong, right in (
            ("loadrt sum2\nsetp sum2.0.ino 1\n", "loadrt sum2\nsetp sum2.0.in0 1\n"),
            ("newthread t 1ms\nloadrt sum\n", "newthread t 1ms\nloadrt sum2\n"),
            ("setpp a 1\n", "setp a 1\n"),
            (AND2 + "setp a.in0 = 1\n", AND2 + "setp a.in0 1\n"),
            (AND2 + "setp a.in0=1\n", AND2 + "setp a.in0 1\n"),
            (AND2 + "net x a.out -> a.in0\n", AND2 + "net x a.out => a.in0\n"),
            ("loadrt sum2\nsetp sum2.0.in0 1,5\n", "loadrt sum2\nsetp sum2.0.in0 1.5\n"),
            ("newthread t 2,5ms\n", "newthread t 2.5ms\n"),
        ):
            with self.subTest(wrong):
                self.assertEqual(right, self.fixed(wrong))

    def test_each_suggested_name_has_a_fix(self):
        text = "loadrt sum2 names=a\nsetp a.in 1\n"
        self.assertIn("a.in1", self.fixed(text, "Replace by 'a.in1'"))

    def test_a_word_of_a_configuration_is_fixed(self):
        file = self.write(
            "d.canopen",
            "[bus]\nbitrate = 1M\n[node 5 x]\ndevice = cia402\n\nmandatory = perhaps\n",
        )
        name = self.client.open(file)
        found = [one for one in self.client.diagnostics(name) if one["range"]["start"]["line"] == 5]
        self.assertEqual(["canopen-value"], [one["code"] for one in found], self.client.published)
        actions = self.client.ask(
            "textDocument/codeAction",
            {
                "textDocument": {"uri": name},
                "range": found[0]["range"],
                "context": {"diagnostics": []},
            },
        )
        self.assertEqual(["Replace by 'yes'", "Replace by 'no'"], [one["title"] for one in actions])

    def test_the_format_is_that_of_hal_fmt(self):
        text = (
            "newthread   servo 1ms\n# x\nloadrt sum2\nsetp sum2.0.in0    1\nsetp sum2.0.gain0 22\n"
        )
        name = self.open(text, "f.hal")
        edits = self.client.ask(
            "textDocument/formatting",
            {"textDocument": {"uri": name}, "options": {"tabSize": 4, "insertSpaces": True}},
        )
        self.good("fmt", "f.hal")
        formatted = (self.folder / "f.hal").read_text()
        self.assertNotEqual(text, formatted)
        self.assertEqual(formatted, apply(text, edits))
        self.client.change(name, formatted)
        self.assertEqual(
            [],
            self.client.ask(
                "textDocument/formatting", {"textDocument": {"uri": name}, "options": {}}
            ),
        )
        self.client.change(name, 'setp a "\n')
        answer = self.client.ask_whole(
            "textDocument/formatting", {"textDocument": {"uri": name}, "options": {}}
        )
        self.assertIn("not formatted", answer["error"]["message"])

    def test_colours_by_meaning(self):
        name = self.open()
        legend = self.client.capabilities["semanticTokensProvider"]["legend"]["tokenTypes"]

        def tokens(method, **more):
            data = self.client.ask(
                f"textDocument/semanticTokens/{method}", {"textDocument": {"uri": name}, **more}
            )["data"]
            line = column = 0
            for i in range(0, len(data), 5):
                column = data[i + 1] + (column if data[i] == 0 else 0)
                line += data[i]
                text = NETLIST.splitlines()[line][column : column + data[i + 2]]
                yield text, legend[data[i + 3]]

        found = list(tokens("full"))
        for pair in (
            ("# a machine", "comment"),
            ("newthread", "keyword"),
            ("servo", "event"),
            ("sum2", "class"),
            ("adder", "namespace"),
            ("total", "variable"),
            ("adder.out", "property"),
            ("2", "number"),
            ("# two", "comment"),
        ):
            self.assertIn(pair, found)
        part = {"start": {"line": 6, "character": 0}, "end": {"line": 6, "character": 10}}
        self.assertEqual(
            [("net", "keyword"), ("total", "variable")], list(tokens("range", range=part))
        )


def apply(text, edits):
    """A text of one-byte characters after edits of the protocol."""
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))

    def offset(at):
        return min(starts[min(at["line"], len(starts) - 1)] + at["character"], len(text))

    for edit in sorted(edits, key=lambda one: -offset(one["range"]["start"])):
        begin, end = offset(edit["range"]["start"]), offset(edit["range"]["end"])
        text = text[:begin] + edit["newText"] + text[end:]
    return text


if __name__ == "__main__":
    unittest.main()
