# SPDX-License-Identifier: MIT
"""hal lsp: each golden error of tests/errors that `hal check` prints arrives in an editor with the same code, severity
and span, and the errors of a configuration while its text is only in the editor."""

import re
import shlex
import shutil
import unittest
from pathlib import Path

from harness import HAL, ROOT, Case
from lsp_client import Client, path_of

ERRORS = ROOT / "tests" / "errors"
HEADER = re.compile(
    r"(?:(?P<file>\S+?):(?P<line>\d+):(?P<column>\d+): )?(?P<severity>error|warning|note): .* \[(?P<code>[a-z0-9-]+)\]$"
)
SEVERITIES = {1: "error", 2: "warning", 3: "note"}


def golden(text):
    """The diagnostics of an `.expected` file: (file, line, column, severity, code, width), file None without a place."""
    found = []
    lines = text.splitlines()
    for number, line in enumerate(lines):
        header = HEADER.match(line)
        if not header:
            continue
        place = (
            (header["file"], int(header["line"]), int(header["column"]))
            if header["file"]
            else (None,) * 3
        )
        carets = None
        # the row of the text, then the row of the carets
        if place[0] and number + 2 < len(lines):
            row = re.match(r" *\| ?(?: *|.*[ -])(\^+)", lines[number + 2])
            if (
                row
                and "\\x" not in lines[number + 1]
                and "…" not in lines[number + 1]
                and "\t" not in lines[number + 1]
            ):
                carets = len(row[1])
        found.append((*place, header["severity"], header["code"], carets))
    return found


def tests():
    """Pairs of a golden error that `hal check` prints, and the arguments of that command."""
    for expected in sorted(ERRORS.glob("*.expected")):
        command = expected.with_suffix(".cmd")
        if expected.with_suffix(".sh").exists():
            continue
        words = ["check", expected.with_suffix(".hal").name]
        if command.exists():
            words = shlex.split(command.read_text(), comments=True)[1:]
        if words[0] == "check" and not {"--linuxcnc", "--deterministic"} & set(words):
            yield expected, words[1:]


class Errors(Case):
    def setUp(self):
        super().setUp()
        self.environment["HALCYON_PLUGIN_PATH"] = (
            f"plugins:{HAL.parent.parent / 'tests' / 'plugins'}"
        )

    def column(self, name, line, character):
        """A column in characters, from a column in UTF-16 code units."""
        text = (ERRORS / name).read_bytes().split(b"\n")[line].decode(errors="replace")
        return len(text.encode("utf-16-le")[: 2 * character].decode("utf-16-le")) + 1

    def published(self, words):
        """What the server publishes for the files of a check, in the form of golden()."""
        client = Client(self.environment, ERRORS, *words[:-1])
        self.addCleanup(client.kill)
        name = client.open(ERRORS / words[-1])
        client.diagnostics(name)
        self.assertEqual(0, client.quit())
        found = []
        for file, params in client.published.items():
            for one in params["diagnostics"]:
                begin, end = one["range"]["start"], one["range"]["end"]
                base = path_of(file).name
                line, column = begin["line"], self.column(base, begin["line"], begin["character"])
                width = None
                if end["line"] == line:
                    width = max(1, self.column(base, line, end["character"]) - column)
                found.append(
                    (base, line + 1, column, SEVERITIES[one["severity"]], one["code"], width)
                )
        return found

    def test_each_golden_error_has_its_code_and_span(self):
        count = 0
        for expected, words in tests():
            with self.subTest(expected.stem):
                wanted = golden(expected.read_text())
                self.assertTrue(wanted)
                got = self.published(words)
                for file, line, column, severity, code, width in wanted:
                    if file is None:
                        match = [
                            one
                            for one in got
                            if one[3:5] == (severity, code) and one[1:3] == (1, 1)
                        ]
                    else:
                        match = [
                            one for one in got if one[:5] == (file, line, column, severity, code)
                        ]
                    if width is not None:
                        match = [one for one in match if one[5] in (None, width)]
                    self.assertTrue(
                        match, f"{(file, line, column, severity, code, width)} is not in {got}"
                    )
                self.assertEqual(len(set(wanted)), len(set(got)), (wanted, got))
                count += 1
        print(f"{count} golden errors")
        self.assertGreater(count, 110)

    def test_a_configuration_has_its_errors_while_the_editor_alone_has_them(self):
        """The file on the disk is correct; the text of the editor is not saved."""
        for name, ending in (
            ("canopen-value", "canopen"),
            ("ethercat-value", "ethercat"),
            ("tdma-value", "tdma"),
            ("scocan-line", "scocan"),
            ("modbus-value", "modbus"),
        ):
            with self.subTest(name):
                folder = self.folder / ending
                folder.mkdir()
                wrong = (ERRORS / f"{name}.{ending}").read_text()
                file = folder / f"{name}.{ending}"
                file.write_text("# nothing yet\n")
                for path in ERRORS.glob("*.e[sd][is]"):
                    shutil.copy(path, folder)
                client = Client(self.environment, folder)
                self.addCleanup(client.kill)
                opened = client.open(file, wrong)
                got = {
                    (one["range"]["start"]["line"] + 1, one["code"])
                    for one in client.diagnostics(opened)
                }
                wanted = golden((ERRORS / f"{name}.expected").read_text())
                wanted = {(one[1], one[4]) for one in wanted if one[0] == file.name}
                self.assertTrue(wanted)
                self.assertLessEqual(wanted, got)
                client.close(opened)
                self.assertEqual(0, client.quit())


if __name__ == "__main__":
    unittest.main()
