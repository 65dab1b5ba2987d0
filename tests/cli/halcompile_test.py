# SPDX-License-Identifier: MIT
"""halcompile, with LinuxCNC's options."""
import unittest

from harness import Case

HALF = 'component half "Halves";\npin in float in;\npin out float out;\nfunction _;\nlicense "MIT";\n;;\nout = in / 2;\n'
TRAIL = """component trail_; pin out float early; pin out float late; variable double k = 3; variable double seen; option extra_setup;
function _; license "MIT";
;;
EXTRA_SETUP() { seen = k; k = 7; return 0; }
FUNCTION(_) { early = seen; late = k; }
"""
RUN = "loadrt threads name1=t period1=1000000\nloadrt half\naddf half.0 t\nsetp half.0.in 7\nstart\nadvance 1 cycles\ngetp half.0.out\n"


class Halcompile(Case):
    def setUp(self):
        super().setUp()
        self.environment["XDG_DATA_HOME"] = str(self.folder / "data")
        self.environment.pop("HALCYON_PLUGIN_PATH", None)
        self.write("half.comp", HALF)

    def halcompile(self, *words, **how):
        return self.run_program(*words, name="halcompile", **how)

    def quiet(self, *words):
        done = self.halcompile(*words)
        self.assertEqual((0, "", ""), (done.returncode, done.stdout, done.stderr))

    def test_install_is_found_by_loadrt(self):
        self.quiet("--install", "half.comp")
        self.assertEqual("3.5\n", self.good("sim", self.write("a.hal", RUN)))

    def test_compile_leaves_the_plugin_in_the_current_folder(self):
        self.quiet("--compile", "half.comp")
        self.assertTrue((self.folder / "half.so").is_file())
        self.assertFalse((self.folder / "data").exists())

    def test_preprocess_is_the_default(self):
        self.quiet("half.comp")
        self.assertIn("halcyon", (self.folder / "half.c").read_text().lower())
        self.quiet("--preprocess", "-o", "other.c", "half.comp")
        self.assertEqual(
            (self.folder / "half.c").read_text(), (self.folder / "other.c").read_text()
        )
        self.write("other.comp", HALF)
        self.assertIn("name the file half.comp", self.halcompile("other.comp").stderr)

    def test_document_is_a_manual_page(self):
        self.quiet("--document", "half.comp")
        self.assertIn("Halves", (self.folder / "half.9").read_text())

    def test_adoc_is_the_page_in_asciidoc(self):
        self.quiet("--adoc", "half.comp")
        text = (self.folder / "half.adoc").read_text()
        self.assertTrue(
            text.startswith("= half(9)\n:doctype: manpage\n\n== NAME\n\nhalf - Halves\n"), text
        )
        self.assertIn("\n== PINS\n\n`+half.N.in+` float in::\n", text)
        self.quiet("--adoc", "-o", "other.adoc", "half.comp")
        self.assertEqual(text, (self.folder / "other.adoc").read_text())

    def test_view_doc_shows_the_page_and_leaves_no_file(self):
        before = sorted(self.folder.iterdir())
        done = self.halcompile("--view-doc", "half.comp")
        self.assertEqual((0, ""), (done.returncode, done.stderr))
        self.assertIn("half: Halves", done.stdout)
        self.assertIn("half.N.in", done.stdout)
        self.assertEqual(before, sorted(self.folder.iterdir()))
        self.assertIn("hal doc NAME", self.halcompile("--install-doc", "half.comp").stderr)

    def test_programs_and_further_arguments(self):
        self.write("flags.c", "#include HEADER\nint main(void) { return (int)cos(0) - 1; }\n")
        self.assertEqual(1, self.halcompile("--userspace", "--compile", "flags.c").returncode)
        self.assertFalse((self.folder / "flags").exists())
        self.quiet(
            "--userspace",
            "--compile",
            "--extra-compile-args=-DHEADER=<math.h> -O1",
            "--extra-link-args=-lm",
            "flags.c",
        )
        self.assertTrue((self.folder / "flags").is_file())

    def test_wrong_words(self):
        self.assertEqual(1, self.halcompile().returncode)
        self.assertEqual(1, self.halcompile("--nothing", "half.comp").returncode)
        self.assertIn(
            "write a number from 1", self.halcompile("--personalities=0", "half.comp").stderr
        )
        self.assertEqual(0, self.halcompile("--personalities=4", "half.comp").returncode)
        self.assertIn("usage: halcompile", self.halcompile("--help").stdout)

    def test_name_that_ends_in_an_underscore_and_variables_after_EXTRA_SETUP(self):
        self.write("trail_.comp", TRAIL)
        self.quiet("--install", "trail_.comp")
        self.assertEqual(
            "0\n3\n",
            self.good(
                "sim",
                self.write(
                    "a.hal",
                    "loadrt threads name1=t period1=1000000\nloadrt trail_\naddf trail.0 t\nstart\n"
                    "advance 1 cycles\ngetp trail.0.early\ngetp trail.0.late\n",
                ),
            ),
        )


if __name__ == "__main__":
    unittest.main()
