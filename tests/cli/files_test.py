# SPDX-License-Identifier: MIT
"""What works on files without running them: check, fmt, doc."""
import json
import os
import re
import stat
import unittest

from harness import SERVO, Case

BAD = """loadrt threads name1=servo period1=1000000
loadrt sum2 names=adder
net a adder.outt
setp adder.in0 much
addf adder sevo
"""


class Check(Case):
    def test_good_file(self):
        path = self.write("good.hal", SERVO)
        done = self.run_program("check", path)
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertEqual("", done.stdout)
        self.assertEqual(f"{path}: no errors\n", done.stderr)

    def test_all_errors_at_once_in_order(self):
        error = self.bad("check", self.write("bad.hal", BAD))
        places = [int(line) for line in re.findall(r"(?m)^\S*bad\.hal:(\d+):\d+: error:", error)]
        self.assertEqual([3, 4, 5], places, error)
        self.assertIn("did you mean 'adder.out'?", error)
        self.assertIn("did you mean 'servo'?", error)
        self.assertRegex(error.splitlines()[-1], r"^3 errors")
        self.assertEqual(1, error.count("3 errors"), error)

    def test_one_bad_file_of_two_fails(self):
        good, bad = self.write("good.hal", SERVO), self.write("bad.hal", "net\n")
        self.assertIn("bad.hal:1", self.bad("check", good, bad))

    def test_later_files_see_earlier_ones(self):
        first, second = self.write("first.hal", SERVO), self.write(
            "second.hal", "setp adder.in1 4\n"
        )
        done = self.run_program("check", first, second)
        self.assertEqual(0, done.returncode, done.stderr)

    def test_starts_no_program_and_no_thread(self):
        path = self.write("acts.hal", SERVO + f"loadusr -w touch {self.folder}/touched\nstart\n")
        done = self.run_program("check", path)
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertFalse((self.folder / "touched").exists())

    def test_missing_file(self):
        self.assertIn("nowhere.hal", self.bad("check", "nowhere.hal"))

    def test_folder_and_binary(self):
        self.bad("check", self.folder)
        path = self.folder / "binary.hal"
        path.write_bytes(bytes(range(256)) * 40)
        self.assertIn("binary.hal:1", self.bad("check", path))

    def test_ini_values(self):
        ini, path = self.write("a.ini", "[LIMITS]\nMAX = 7\n"), self.write(
            "a.hal", SERVO + "setp adder.in0 [LIMITS]MAX\n"
        )
        self.assertEqual(0, self.run_program("check", "--ini", ini, path).returncode)
        self.assertIn("[LIMITS]MAX", self.bad("check", path))


class Format(Case):
    UGLY = "loadrt   sum2 names=a # one\n\nnet x a.out=>b.in\nsetp  a.in0 1\nsetp a.gain0    2\n"

    def test_in_place_once(self):
        path = self.write("ugly.hal", self.UGLY)
        self.good("fmt", path)
        formatted = (self.folder / "ugly.hal").read_text()
        self.assertNotEqual(self.UGLY, formatted)
        self.assertIn("# one", formatted)
        self.good("fmt", path)
        self.assertEqual(formatted, (self.folder / "ugly.hal").read_text())

    def test_check_changes_nothing(self):
        path = self.write("ugly.hal", self.UGLY)
        self.assertEqual(
            f"hal fmt: '{path}' is not formatted; type: hal fmt {path}\n",
            self.bad("fmt", "--check", path),
        )
        self.assertEqual(self.UGLY, (self.folder / "ugly.hal").read_text())
        self.good("fmt", path)
        self.good("fmt", "--check", path)

    def test_standard_input(self):
        self.good("fmt", self.write("ugly.hal", self.UGLY))
        self.assertEqual(
            (self.folder / "ugly.hal").read_text(), self.good("fmt", "-", given=self.UGLY)
        )

    def test_keeps_mode_and_link(self):
        path = self.write("ugly.hal", self.UGLY)
        os.chmod(path, 0o640)
        link = self.folder / "link.hal"
        link.symlink_to("ugly.hal")
        self.good("fmt", link)
        self.assertTrue(link.is_symlink())
        self.assertEqual(0o640, stat.S_IMODE(os.stat(path).st_mode))
        self.good("fmt", "--check", path)

    def test_bad_netlist_is_left_alone(self):
        text = "setp a 'unterminated\n"
        path = self.write("bad.hal", text)
        self.assertIn("bad.hal:1", self.bad("fmt", path))
        self.assertEqual(text, (self.folder / "bad.hal").read_text())
        self.assertEqual([path], [str(p) for p in self.folder.glob("bad.hal*")])

    def test_missing_file(self):
        self.assertEqual(
            "hal fmt: cannot read 'nowhere.hal': No such file or directory\n",
            self.bad("fmt", "nowhere.hal"),
        )


class Doc(Case):
    def test_lists_all_components(self):
        names = [line.split()[0] for line in self.good("doc").splitlines()]
        self.assertEqual(sorted(names), names)
        self.assertLessEqual({"and2", "pid", "sum2", "threads"}, set(names))

    def test_page_is_made_from_the_declarations(self):
        page = self.good("doc", "and2")
        for line in (
            r"    and2: ",
            r"    loadrt and2 \[count=N \| names=NAME,…\]",
            r"    and2\.N\.in0 +bit +in ",
            r"    and2\.N\.out +bit +out ",
            r"FUNCTIONS\n    and2\.N ",
        ):
            self.assertRegex(page, line)

    def test_every_component_has_a_page_in_every_form(self):
        """All in one process for each form: a process per component takes minutes under a sanitizer."""
        names = sorted(
            entry["name"].replace("_", "-") for entry in json.loads(self.good("doc", "--json"))
        )
        for form in ("json", "markdown", "man"):
            self.good("doc", "--all", f"--{form}", "--output", form)
        pages = {
            path.stem: json.loads(path.read_text()) for path in (self.folder / "json").iterdir()
        }
        self.assertEqual(names, sorted(pages))
        for name, page in pages.items():
            self.assertEqual(name, page["name"])
            self.assertTrue(page["summary"], name)
            for pin in page["pins"]:
                self.assertTrue(pin["doc"], f"{name}.{pin['name']}")
        for name in names:
            self.assertTrue(
                (self.folder / "markdown" / f"{name}.md").read_text().startswith("# "), name
            )
            self.assertRegex(
                (self.folder / "man" / f"hal-{name}.9").read_text(), r"\A('\\\" t\n)?\.TH ", name
            )
        self.assertEqual(pages["and2"], json.loads(self.good("doc", "and2", "--json")))

    def test_unknown_component_gets_a_suggestion(self):
        error = self.bad("doc", "adn2")
        self.assertIn("unknown component 'adn2'; did you mean 'and2'", error)
        self.assertEqual(1, error.count("\n"))

    def test_broken_plugin_is_a_sentence(self):
        (self.folder / "plugins").mkdir()
        self.write("plugins/broken.so", "not a shared object")
        error = self.bad(
            "doc", "broken", environment={"HALCYON_PLUGIN_PATH": str(self.folder / "plugins")}
        )
        self.assertIn("is not a usable component", error)


if __name__ == "__main__":
    unittest.main()
