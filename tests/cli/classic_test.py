# SPDX-License-Identifier: MIT
"""halcmd and halrun, with LinuxCNC's options, output and exit status."""

import shutil
import signal
import subprocess
import unittest

from harness import HAL, SERVO, Case, Terminal, needs_package, wait_until


class Halcmd(Case):
    def setUp(self):
        super().setUp()
        self.start("run", self.write("a.hal", SERVO))

    def halcmd(self, *words, **how):
        return self.run_program(*words, name="halcmd", **how)

    def test_one_shot(self):
        self.assertEqual("2\n", self.halcmd("getp", "adder.in0").stdout)
        self.assertEqual(0, self.halcmd("setp", "adder.in0", "-4").returncode)
        self.assertEqual("-4\n", self.halcmd("getp", "adder.in0").stdout)
        self.assertEqual(1, self.halcmd("getp", "nothing").returncode)

    def test_windows_are_views_of_ours(self):
        def run(*words):
            done = self.run_program(*words[1:], name=words[0])
            return done.returncode, done.stdout + done.stderr

        self.assertEqual(0, run("halmeter", "-s", "-g", "10", "20", "pin", "adder.in0")[0])
        self.assertIn("2", run("halmeter", "pin", "adder.in0")[1])
        self.assertEqual(
            (
                1,
                "halmeter: which value? Type: halmeter pin NAME; hal shell show pin lists the pins\n",
            ),
            run("halmeter"),
        )
        self.assertEqual(
            (1, "halmeter: unexpected argument 'b'; usage: halmeter [pin|sig|param] NAME\n"),
            run("halmeter", "pin", "a", "b"),
        )
        self.assertEqual(
            run("hal", "scope", "adder.in0"), run("halscope", "adder.in0")
        )  # which needs a terminal or a file
        self.assertEqual(
            (1, "halscope: option '-i' is not supported; type: hal scope NAME…, or hal panel\n"),
            run("halscope", "-i", "x"),
        )
        self.assertEqual(
            (1, "halshow: unexpected argument 'x.halshow'; type: hal panel, or hal watch NAME…\n"),
            run("halshow", "x.halshow"),
        )

    @needs_package("linuxcnc")
    def test_started_programs_find_ours_beside_those_of_linuxcnc(self):
        found = self.run_program(
            "loadusr", "-w", "sh", "-c", "command -v halmeter; command -v halcmd", name="halcmd"
        ).stdout
        self.assertRegex(
            found, r"\A.*/halcyon/linuxcnc/bin/halmeter\n.*/halcyon/linuxcnc/bin/halcmd\n\Z"
        )

    def test_arguments_keep_their_boundaries(self):
        failed = self.halcmd("loadusr", "-w", "sh", "-c", "exit 7")
        self.assertEqual(1, failed.returncode)
        self.assertIn("exit status 7", failed.stderr)
        given = [
            "a  b",
            '"q"',
            "it's",
            "[A]B",
            "$HOME",
            "#x",
            "{x,y}",
            "[0..2]",
            "",
            "a=b c",
            "tab\there",
            "two\nlines",
            "=>",
            "\\",
        ]
        script = "import sys; print(sys.argv[1:])"
        for name, first in (("halcmd", ()), ("hal", ("shell",))):
            done = self.run_program(
                *first, "loadusr", "-w", "python3", "-c", script, *given, name=name
            )
            self.assertEqual((f"{given!r}\n", "", 0), (done.stdout, done.stderr, done.returncode))
        for name in ("two words.hal", "[A]B.hal", '"quoted".hal', "#.hal", "$HOME.hal"):
            self.assertEqual("", self.halcmd("save", "comp", name).stderr)
            self.assertIn("loadrt sum2", (self.folder / name).read_text())
        for name in ("my file.hal", '"q".hal', "#x"):
            self.write(name, "print hello\n")
            self.assertIn("HALCMD MSG: hello", self.halcmd("source", name).stderr)
        self.assertEqual(
            "2\n", self.halcmd("getp adder.in0").stdout
        )  # one word with blanks: a line
        self.assertIn("'' is not a", self.halcmd("setp", "adder.in0", "").stderr)

    def test_names_of_files_have_quotes_in_a_netlist(self):
        self.write("my file.hal", "print hello\n")
        path = self.write(
            "a.hal", 'source "my file.hal"\nsource \'my file.hal\'\nsave comp "two words.hal"\n'
        )
        done = self.halcmd("-f", path)
        self.assertEqual((0, 2), (done.returncode, done.stderr.count("HALCMD MSG: hello")))
        self.assertIn("loadrt sum2", (self.folder / "two words.hal").read_text())

    def test_source_prefers_the_working_directory_to_the_folder_of_the_file(self):
        folders = ("library", "machine")
        for folder in folders:
            (self.folder / folder).mkdir()
        path = self.write("machine/main.hal", "source more.hal\n")
        self.write("machine/more.hal", "print machine\n")
        self.environment["HALLIB_PATH"] = "library"
        self.assertIn("HALCMD MSG: machine", self.good_text(path))
        self.write("library/more.hal", "print library\n")
        self.assertIn("HALCMD MSG: library", self.good_text(path))
        self.write("more.hal", "print working directory\n")
        self.assertIn("HALCMD MSG: working directory", self.good_text(path))

    def good_text(self, path):
        done = self.run_program("sim", path)
        self.assertEqual(0, done.returncode, done.stderr)
        return done.stderr

    def test_an_argument_with_blanks_is_saved_with_quotes(self):
        self.assertEqual(0, self.halcmd("loadrt", "message", "messages=door open").returncode)
        saved = self.halcmd("save", "comp").stdout
        self.assertIn('loadrt message messages="door open"\n', saved)
        self.assertEqual(
            "0\n", self.good("sim", self.write("again.hal", saved + "getp adder.in0\n"))
        )

    def test_continues_after_an_unset_ini_key(self):
        ini = self.write("x.ini", "[A]\nB = 1\nC = # not a comment\n")
        path = self.write("y.hal", "print one\nprint [A]NONE\nprint [A]B\nprint [A]C\n")
        done = self.halcmd("-i", ini, "-kf", path)
        self.assertEqual(1, done.returncode)
        said = done.stderr.splitlines()
        self.assertEqual(f"{path}:1: HALCMD MSG: one", said[0])
        self.assertIn(f"{path}:2:7: error: unknown key '[A]NONE': not in the INI file", said[1])
        self.assertIn(f"{path}:3: HALCMD MSG: 1", said)
        self.assertIn(f"{path}:4: HALCMD MSG: # not a comment", said)
        self.assertEqual(1, self.halcmd("-i", ini, "-f", path).returncode)
        self.assertIn("HALCMD MSG: 1", self.halcmd("-i", ini, "-f", given="print [A]B\n").stderr)

    def test_the_value_of_an_ini_key_is_shown_with_its_place(self):
        ini = self.write("x.ini", "[J]\nMAX = 2.5 # end of travel\n")
        done = self.halcmd("-i", ini, "-f", given="setp adder.in0 [J]MAX\n")
        self.assertEqual(
            f"""<stdin>:1:16: error: setp takes 2 arguments, not 6 [wrong-arguments]
    1 | setp adder.in0 [J]MAX
      |                ^^^^^^
      = note: [J]MAX is '2.5 # end of travel' in {ini}:2
      = help: setp PIN-OR-PARAMETER VALUE
      = help: in an INI file a comment has a line of its own: behind a value it is part of the value

1 error; nothing was changed
""",
            done.stderr,
        )

    def test_letters_may_be_joined(self):
        path = self.write("s.hal", "getp nothing\ngetp adder.in1\n")
        done = self.halcmd("-kf", path)
        self.assertEqual((1, "3\n"), (done.returncode, done.stdout))
        self.assertEqual("", self.halcmd("-kQf", path).stderr)

    def test_command_behind_a_file_is_ignored(self):
        path = self.write("s.hal", "getp adder.in1\n")
        self.assertEqual("3\n", self.halcmd("-f", path, "getp", "adder.in0").stdout)

    def test_script_output(self):
        self.assertRegex(
            self.halcmd("-s", "show", "pin", "adder.out").stdout,
            r"^sum2 float OUT +5 adder\.out ==> total\n$",
        )

    def test_echo(self):
        done = self.halcmd("-e", "-f", self.write("s.hal", "\ngetp adder.in1\n"))
        self.assertEqual(("3\n", True), (done.stdout, "(2)<echo>: getp adder.in1" in done.stderr))

    def test_exit_status_255(self):
        self.assertEqual(255, self.halcmd("-z").returncode)
        self.assertEqual(255, self.halcmd("-f", "nowhere.hal").returncode)
        self.assertEqual(255, self.halcmd("-i", "x.ini", "show").returncode)

    def test_release_has_no_effect(self):
        self.assertEqual(
            (0, "", ""), (lambda d: (d.returncode, d.stdout, d.stderr))(self.halcmd("-R"))
        )

    def test_help(self):
        self.assertIn("usage: halcmd", self.halcmd().stdout)
        self.assertIn("usage: halcmd", self.halcmd("-h").stdout)
        self.assertIn("setp", self.halcmd("-h", "setp").stdout)

    def test_standard_input(self):
        done = self.halcmd("-f", given="getp adder.in0\ngetp adder.in1\n")
        self.assertEqual((0, "2\n3\n"), (done.returncode, done.stdout))

    def test_completion_for_bash(self):
        line = "halcmd getp adder.i"
        done = self.halcmd("-C", environment={"COMP_LINE": line, "COMP_POINT": str(len(line))})
        self.assertEqual("adder.in0\nadder.in1\n", done.stdout)

    def test_completion_without_a_program_halcmd(self):
        only_hal = self.folder / "only-hal"
        only_hal.mkdir()
        (only_hal / "hal").symlink_to(HAL)
        script = (
            'source <(hal completion bash); COMP_WORDS=(hal scope adder.i) COMP_CWORD=2; _hal; echo "${COMPREPLY[@]}"; '
            'COMP_WORDS=(hal shell setp adder.i) COMP_CWORD=3; _hal; echo "${COMPREPLY[@]}"'
        )
        done = subprocess.run(
            ["bash", "-c", script],
            env={**self.environment, "PATH": f"{only_hal}:/usr/bin:/bin"},
            capture_output=True,
            text=True,
        )
        self.assertEqual("adder.in0 adder.in1\n" * 2, done.stdout, done.stderr)

    def test_prompt(self):
        terminal = Terminal(self, "-kf", name="halcmd")
        terminal.expect("halcmd: ")
        terminal.send("getp adder.in0\r")
        terminal.expect("\n2\r\n")
        terminal.send("exit\r")
        self.assertEqual(0, terminal.wait())


class Halrun(Case):
    def halrun(self, *words, **how):
        return self.run_program(*words, name="halrun", **how)

    def test_a_thread_has_no_times_before_start(self):
        look = "advance 50 cycles\ngetp servo.time\ngetp servo.tmax\n"
        done = self.halrun(
            "-f", self.write("a.hal", f"{SERVO}{look}show thread\nstart\n{look}stop\n{look}")
        )
        self.assertEqual(0, done.returncode, done.stderr)
        lines = done.stdout.splitlines()
        self.assertEqual(["0", "0"], lines[:2])
        self.assertRegex(done.stdout, r"servo \( +0, +0 \)")
        before, after = lines[-4:-2], lines[-2:]
        self.assertGreater(int(before[1]), 0)
        self.assertGreaterEqual(int(after[1]), int(before[1]))

    def test_runs_a_file_and_ends(self):
        path = self.write("a.hal", SERVO + "start\ngetp adder.in1\n")
        for words in (("-f", path), (path,)):
            done = self.halrun(*words)
            self.assertEqual((0, "3\n", ""), (done.returncode, done.stdout, done.stderr))

    def test_threads_wait_for_start(self):
        done = self.halrun("-f", self.write("a.hal", SERVO + "getp adder.out\n"))
        self.assertEqual("0\n", done.stdout)

    def test_error_is_its_status(self):
        self.assertEqual(1, self.halrun("missing.hal").returncode)
        done = self.halrun("-f", self.write("a.hal", "getp nothing\n"))
        self.assertEqual((1, ""), (done.returncode, done.stdout))
        self.assertIn("a.hal:1", done.stderr)

    def test_programs_started_by_it(self):
        self.write("inner.sh", "halcmd getp adder.in0\nhalcmd setp adder.in0 9\n")
        done = self.halrun(
            "-f", self.write("a.hal", SERVO + "loadusr -w sh inner.sh\ngetp adder.in0\n")
        )
        self.assertEqual((0, "2\n9\n", ""), (done.returncode, done.stdout, done.stderr))

    def test_sampler_in_the_background(self):
        self.write(
            "a.hal",
            "loadrt threads name1=servo period1=1000000\nloadrt sampler cfg=f depth=100\nloadrt sum2 names=adder\nsetp adder.in0 1\n"
            "addf adder servo\naddf sampler.0 servo\nnet x adder.out => sampler.0.pin.0\n"
            "loadusr -Wn log halsampler -N log -n 5\nstart\nwaitusr log\n",
        )
        self.assertEqual(
            (0, "1.000000 \n" * 5), (lambda d: (d.returncode, d.stdout))(self.halrun("-f", "a.hal"))
        )

    def test_ini_file(self):
        self.write("a.hal", SERVO + "setp adder.in0 [A]B\ngetp adder.in0\n")
        done = self.halrun(self.write("a.ini", "[HAL]\nHALFILE = a.hal\n[A]\nB = 6\n"))
        self.assertEqual((0, "6\n"), (done.returncode, done.stdout))

    def test_commands_from_standard_input(self):
        done = self.halrun(given="loadrt sum2 names=a\ngetp a.in0\nquit\n")
        self.assertEqual((0, "0\n"), (done.returncode, done.stdout))

    def test_rejects_a_second_instance_and_u_ends_the_first(self):
        first = self.start(
            "-I", self.write("a.hal", SERVO + "start\n"), name="halrun", stdin=subprocess.PIPE
        )
        error = self.halrun(self.write("b.hal", ""))
        self.assertEqual(1, error.returncode)
        self.assertIn("default", error.stderr)
        self.assertEqual(0, self.halrun("-U").returncode)
        self.assertEqual(0, first.wait(timeout=60))
        self.assertEqual(0, self.halrun("-U").returncode)

    def test_interactive(self):
        terminal = Terminal(self, "-I", self.write("a.hal", SERVO), name="halrun")
        terminal.expect("halcmd: ")
        terminal.send("getp adder.in1\r")
        terminal.expect("\n3\r\n")
        terminal.send("quit\r")
        self.assertEqual(0, terminal.wait())

    TCL = """loadrt sum2 names=$::A(NAME)
foreach pin {in0 in1} { setp $::A(NAME).$pin 2*3 }
puts "[getp a.in0] [hal getp a.in1] <$argv> [file tail $EMC_INIFILE]"
puts "[catch {hal setp a.in0 2*3} text] <[show sig]>"
set flag 1
setp a.in0 {$flag + 1}
puts [getp a.in0]
"""

    @unittest.skipUnless(shutil.which("tclsh"), "tclsh is not installed")
    def test_a_netlist_in_tcl(self):
        self.write("a.ini", "[A]\nNAME = a\n")
        path = self.write("a.tcl", self.TCL)
        expected = (
            "6 6 <> a.ini\n"
            + self.halrun("-f", self.write("show.hal", "show sig\n")).stdout
            + "1 <>\n2\n"
        )
        done = self.halrun("-i", "a.ini", path)
        self.assertEqual((0, expected, ""), (done.returncode, done.stdout, done.stderr))
        done = self.halrun("-i", "a.ini", "-f", path)
        self.assertEqual((0, expected, ""), (done.returncode, done.stdout, done.stderr))
        self.write("b.ini", "[HAL]\nHALFILE = a.tcl\n[A]\nNAME = a\n")
        self.assertEqual(
            (0, expected.replace("a.ini", "b.ini")),
            (lambda d: (d.returncode, d.stdout))(self.halrun("b.ini")),
        )
        self.assertEqual(
            expected.replace("<>", "<x y>", 1),
            self.good("sim", "--quiet", "-i", "a.ini", path, "--", "x", "y"),
        )

    @unittest.skipUnless(shutil.which("tclsh"), "tclsh is not installed")
    def test_an_error_in_tcl_is_its_status(self):
        done = self.halrun(self.write("a.tcl", "loadrt sum2 names=a\nsetp a.in7 1\n"))
        self.assertEqual((1, ""), (done.returncode, done.stdout))
        self.assertIn("<a.tcl>:1:6: error: unknown pin 'a.in7' [no-such-pin]", done.stderr)
        self.assertTrue(
            done.stderr.endswith(
                f"\n    (file \"{self.folder}/a.tcl\" line 2)\nhalrun: '{self.folder}/a.tcl' ended with exit status 1\n"
            ),
            done.stderr,
        )

    @unittest.skipUnless(shutil.which("tclsh"), "tclsh is not installed")
    def test_a_number_beyond_the_range_is_an_error_in_tcl_too(self):
        for value in ("1e400", "-1e400"):
            done = self.halrun(self.write("a.tcl", f"loadrt sum2 names=a\nsetp a.in0 {value}\n"))
            self.assertEqual((1, ""), (done.returncode, done.stdout))
            self.assertIn(
                f"<a.tcl>:1:12: error: {value} is out of range for float (up to 1.797693e+308) [bad-value]",
                done.stderr,
            )
        done = self.halrun(
            self.write(
                "b.tcl",
                "loadrt sum2 names=a\nsetp a.in0 -inf\nset x 4\nsetp a.in1 {$x*2}\n"
                "puts [getp a.in0]\nputs [getp a.in1]\n",
            )
        )
        self.assertEqual((0, "-inf\n8\n", ""), (done.returncode, done.stdout, done.stderr))

    @unittest.skipUnless(shutil.which("tclsh"), "tclsh is not installed")
    def test_lines_of_tcl_after_a_file(self):
        done = self.halrun(
            "-T",
            self.write("a.hal", SERVO),
            given="foreach n {0 1} {\n puts [getp adder.in$n]\n}\nsetp adder.in0 5+1\ngetp adder.in0\nnonsense\n",
        )
        self.assertEqual(
            (0, "2\n3\n6\n", 'invalid command name "nonsense"\n'),
            (done.returncode, done.stdout, done.stderr),
        )

    def test_wrong_files(self):
        self.assertIn("must end with .hal, .tcl or .ini", self.halrun("x.txt").stderr)
        self.assertIn("nowhere.hal", self.halrun("nowhere.hal").stderr)


if __name__ == "__main__":
    unittest.main()
