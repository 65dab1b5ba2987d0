# SPDX-License-Identifier: MIT
"""Help, wrong words, explain, completion script, doctor."""

import json
import os
import re
import shutil
import subprocess
import unittest

from harness import HAL, ROOT, SERVO, Case, needs_package, packages_left_out


class Help(Case):
    def test_without_words_lists_the_commands(self):
        for words in ((), ("help",), ("--help",)):
            text = self.good(*words)
            for name in (
                "run",
                "sim",
                "shell",
                "check",
                "fmt",
                "graph",
                "doc",
                "explain",
                "record",
                "doctor",
            ):
                self.assertRegex(text, rf"(?m)^  {name} ")

    def test_of_a_command_names_its_options(self):
        for words in (("help", "run"), ("run", "--help"), ("run", "-h")):
            text = self.good(*words)
            for option in ("--for", "--name", "-I", "--no-picture", "--ini", "-k"):
                self.assertIn(option, text)

    def test_of_every_command_exists(self):
        for line in self.good("help").splitlines():
            if line.startswith("  ") and line.split()[0].isalpha():
                self.assertIn("usage: hal " + line.split()[0], self.good("help", line.split()[0]))

    def test_version(self):
        self.assertRegex(
            self.good("--version"),
            r"^hal \d+\.\d+\.\d+ \(commit ([0-9a-f]{10}|unknown)\)\npackages: ",
        )


class BusProgram(Case):
    def test_reports_a_missing_program(self):
        alone = self.folder / "hal"
        shutil.copy(HAL, alone)
        done = subprocess.run(
            [alone, "can", "dump", "can:can0"],
            capture_output=True,
            text=True,
            env=dict(os.environ, LD_LIBRARY_PATH=str(HAL.parent.parent / "lib")),
        )
        self.assertEqual(
            (
                1,
                f"hal: cannot start {self.folder}/hal-bus: No such file or directory; it must be in the folder of hal: type ./hal build bus in the source tree, or reinstall Halcyon\n",
            ),
            (done.returncode, done.stderr),
        )


class WrongWords(Case):
    def test_unknown_command_gets_a_suggestion(self):
        self.assertEqual("hal: unknown command 'shel'; did you mean 'shell'?\n", self.bad("shel"))

    def test_a_command_of_a_clone_is_explained(self):
        self.assertNotIn("In this clone also", self.good("help"))
        self.assertEqual(
            "hal: 'bench' is a command of a clone of the sources; type there: ./hal bench [OPTION]…\n",
            self.bad("bench"),
        )
        self.environment["HALCYON_BUILD"] = "/tree/hal"
        self.assertIn("\nIn this clone also:\n  build       build everything", self.good("help"))
        self.assertEqual(
            "hal test: run all tests, or those of the release build only\n\n"
            "usage: ./hal test [quick]\n",
            self.good("help", "test"),
        )

    def test_the_commands_of_a_clone_are_those_of_its_script(self):
        head = (ROOT / "hal").read_text().partition("\nset -eu\n")[0]
        described = set(re.findall(r"(?m)^#     \./hal (\w+)", head)) - {"run"}
        self.environment["HALCYON_BUILD"] = "/tree/hal"
        listed = self.good("help").partition("\nIn this clone also:\n")[2].partition("\n\n")[0]
        self.assertEqual(described, {line.split()[0] for line in listed.splitlines()})

    def test_commands_for_tests_are_not_listed(self):
        text = self.good("sim", self.write("m.hal", "newthread t 1ms\nhelp\n"), "--for", "1ms")
        self.assertIn("\n  unloadrt ", text)
        self.assertNotIn("for_test_suite_only", text)

    def test_messages_have_the_commands_as_the_program_was_started(self):
        self.environment["HALCYON_STARTED_AS"] = "./hal"
        self.assertEqual(
            "hal: 'x.hal' is not a command; to run it type: ./hal run x.hal\n", self.bad("x.hal")
        )
        self.write("m.hal", "loadrt nothing\n")
        self.assertIn("= help: ./hal doc lists all components", self.bad("check", "m.hal"))
        self.assertIn("For details: ./hal help COMMAND.", self.good("help"))

    @needs_package("canopen")
    def test_commands_with_a_common_beginning(self):
        self.assertEqual(
            "usage: hal can eds COMMAND …\n\n  can eds check    check a device description and summarise it\n\n"
            "For details: hal help can eds COMMAND.\n",
            self.good("help", "can", "eds"),
        )
        for words, last in (
            (("can", "sdo"), "can sdo write"),
            (("can", "pdo"), "can pdo watch"),
            (("can", "dcf"), "can dcf write"),
        ):
            self.assertIn(last, self.good("help", *words))

    @unittest.skipUnless("canopen" in packages_left_out(), "this build has canopen")
    def test_a_common_beginning_of_commands_that_are_left_out(self):
        for words, start in (
            (("can", "eds"), "can eds"),
            (("can", "sdo", "reed"), "can sdo"),
            (("help", "can", "pdo"), "can pdo"),
        ):
            with self.subTest(words=words):
                self.assertIn(f"hal {start}: the package canopen ", self.bad(*words))

    def test_unknown_command_without_likeness_points_to_help(self):
        self.assertEqual("hal: unknown command 'qqqqqqqq'; type: hal help\n", self.bad("qqqqqqqq"))
        self.assertEqual(
            "hal: 'getp' is a command of the shell; to run it in a running machine type: hal shell getp and2.0.out\n",
            self.bad("getp", "and2.0.out"),
        )

    def test_a_netlist_as_command_suggests_hal_run(self):
        self.assertEqual(
            "hal: 'x.hal' is not a command; to run it type: hal run x.hal\n", self.bad("x.hal")
        )

    def test_unknown_option_gets_a_suggestion(self):
        self.assertEqual(
            "hal sim: unknown option '--cycle'; did you mean '--cycles'?\n",
            self.bad("sim", "x.hal", "--cycle", "3"),
        )

    def test_an_option_for_the_output_names_what_takes_the_file(self):
        self.assertEqual(
            "hal record: unknown option '-o'; the file is the first word: hal record FILE NAME… "
            "[--last TIME] | [CHANNEL] [FILE]\n",
            self.bad("record", "x.mcap", "a", "-o", "y.mcap"),
        )
        self.assertEqual(
            "hal sim: unknown option '-o'; did you mean '--record'?\n",
            self.bad("sim", "x.hal", "-o", "y.mcap"),
        )
        # another option of one letter is not suggested
        self.assertEqual(
            "hal record: unknown option '-x'; see: hal help record\n",
            self.bad("record", "x.mcap", "a", "-x"),
        )

    def test_unknown_shell_option(self):
        self.assertIn(
            "unknown option '--jsn'; did you mean '--json'?", self.bad("shell", "--jsn", "show")
        )

    def test_bad_duration(self):
        for text in ("soon", "10x", "-3s"):
            self.assertIn(
                f"invalid duration '{text}'; use 10s, 250ms or 2min",
                self.bad("sim", "x.hal", "--for=" + text),
            )

    def test_bad_number(self):
        error = self.bad("sim", "x.hal", "--cycles", "many")
        self.assertIn("--cycles", error)
        self.assertIn("many", error)
        self.assertEqual(1, error.count("\n"))

    def test_number_beyond_64_bits(self):
        self.assertEqual(
            "hal sim: --cycles: 18446744073709551616 is too large; use at most 18446744073709551615; see: hal help sim\n",
            self.bad("sim", "x.hal", "--cycles", "18446744073709551616"),
        )

    def test_missing_file_word(self):
        for command in ("sim", "check", "fmt", "graph"):
            error = self.bad(command)
            self.assertIn("type: hal " + command, error)
            self.assertEqual(1, error.count("\n"))

    def test_too_many_words(self):
        self.assertIn("hal help doctor", self.bad("doctor", "now"))


class Explain(Case):
    def test_lists_all_codes(self):
        self.assertIn("two-writers", self.good("explain"))

    def test_page(self):
        for code in ("two-writers", "[two-writers]"):
            page = self.good("explain", code)
            self.assertTrue(page.startswith("two-writers\n\n"), page)
            self.assertIn("sum2", page)

    def test_unknown_code_gets_a_suggestion(self):
        self.assertEqual(
            "hal explain: unknown code 'two-writer'; did you mean 'two-writers'?\n",
            self.bad("explain", "two-writer"),
        )


class CompletionScript(Case):
    def complete(self, line):
        script = self.good("completion", "bash")
        words = line.split(" ")
        code = (
            script
            + f"\nCOMP_WORDS=({' '.join(repr(w) for w in words)}); COMP_CWORD={len(words) - 1}; _hal; printf '%s\\n' \"${{COMPREPLY[@]}}\""
        )
        path = f"{HAL.parent}:{self.environment['PATH']}"
        return subprocess.run(
            ["bash", "-c", code],
            env={**self.environment, "PATH": path},
            cwd=self.folder,
            stdout=subprocess.PIPE,
            text=True,
            check=True,
            timeout=30,
        ).stdout.split()

    def test_subcommands(self):
        self.assertEqual(["record"], self.complete("hal rec"))

    def test_options(self):
        self.assertEqual(["--no-picture"], self.complete("hal run --no-"))

    def test_codes(self):
        self.assertEqual(["two-writers"], self.complete("hal explain two-w"))

    def test_components(self):
        self.assertIn("and2", self.complete("hal doc an"))

    def test_rejects_other_shells(self):
        for words in (["tcsh"], ["bash", "zsh"], ["words", "bash"]):
            self.assertEqual(
                "hal completion: unsupported shell; type: hal completion SHELL with one of bash, zsh, fish\n",
                self.bad("completion", *words),
            )

    def test_values_of_a_running_machine(self):
        self.start("run", self.write("m.hal", SERVO))
        self.assertEqual(["adder.in0", "adder.in1"], sorted(self.complete("hal watch adder.in")))
        self.assertEqual(["total"], self.complete("hal scope tot"))
        self.assertEqual(["total"], self.complete("hal record new.mcap tot"))

    @unittest.skipUnless(shutil.which("fish"), "fish is not installed")
    def test_fish(self):
        self.write("hal.fish", self.good("completion", "fish"))
        for line, wanted in (
            ("hal rec", "record\trecord any values of a running instance to MCAP or CSV"),
            ("hal run --no-", "--no-picture\tno live picture in the terminal"),
            ("hal can sd", "sdo\t"),
            ("hal explain two-w", "two-writers"),
            ("hal completion z", "zsh"),
        ):
            done = self.run_shell("fish", "-c", f"source hal.fish; complete -C '{line}'")
            self.assertIn(wanted, done)
        self.start("run", self.write("m.hal", SERVO))
        done = self.run_shell("fish", "-c", "source hal.fish; complete -C 'hal watch adder.in'")
        self.assertEqual(["adder.in0", "adder.in1"], sorted(done.split()))

    @unittest.skipUnless(shutil.which("zsh"), "zsh is not installed")
    def test_zsh(self):
        """The functions of zsh's completion that offer words print them here."""
        self.write("_hal", self.good("completion", "zsh"))
        offers = (
            "compdef() { :; }; _files() { print files; }\n"
            "_describe() { print -rl -- ${(P)@[-1]}; }\n"
            "compadd() { if [[ $1 == -a ]]; then print -rl -- ${(P)2}; else print -rl -- $@; fi; }\n"
            "source ./_hal\n"
        )

        def offered(line):
            words = line.split(" ")
            code = f"{offers}service=hal; words=({line}); CURRENT={len(words)}; PREFIX='{words[-1]}'\n_hal"
            return self.run_shell("zsh", "-f", "-c", code).splitlines()

        self.assertIn("fmt:format netlists", offered("hal f"))
        self.assertIn("--no-picture:no live picture in the terminal", offered("hal run --no-"))
        self.assertIn("nmt:send an NMT command to CANopen nodes", offered("hal can n"))
        self.assertEqual(["bash", "zsh", "fish"], offered("hal completion z"))
        self.assertIn("two-writers", offered("hal explain t"))
        self.assertEqual(["files"], offered("hal record x"))
        self.start("run", self.write("m.hal", SERVO))
        self.assertEqual(
            ["adder.in0", "adder.in1"], sorted(filter(None, offered("hal watch adder.in")))
        )

    def run_shell(self, *words):
        done = subprocess.run(
            words,
            env={**self.environment, "PATH": f"{HAL.parent}:{self.environment['PATH']}"},
            cwd=self.folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            timeout=60,
        )
        self.assertEqual((0, ""), (done.returncode, done.stderr), done.stdout)
        return done.stdout


class ManualPages(Case):
    def test_of_all_commands(self):
        self.good("manual", "--output", "man1")
        pages = {path.name: path.read_text() for path in (self.folder / "man1").iterdir()}
        for name in ("hal.1", "halcmd.1", "hal-run.1", "hal-can.1", "hal-can-sdo-read.1"):
            self.assertIn(name, pages)
        self.assertIn("\\fB\\-\\-for TIME\\fR\n", pages["hal-run.1"])
        self.assertIn("loadrt", pages["halcmd.1"])
        for name, text in pages.items():
            self.assertRegex(text, r'^\.TH "[A-Z0-9\\-]+" 1 "" "Halcyon [\d.]+', name)
            self.assertRegex(text, r"\n\.SH NAME\n\S+ \\- \S", name)

    @unittest.skipUnless(shutil.which("man"), "man is not installed")
    def test_man_has_nothing_to_complain_of(self):
        self.good("manual", "--output", "man1")
        for path in sorted((self.folder / "man1").iterdir()):
            done = subprocess.run(
                ["man", "--warnings", "-E", "UTF-8", "-Tutf8", "-l", str(path)],
                env={**os.environ, "LC_ALL": "C.UTF-8", "MANWIDTH": "100"},
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
                timeout=60,
            )
            self.assertEqual((0, ""), (done.returncode, done.stderr), path)
            self.assertIn("Halcyon commands", done.stdout)

    def test_wrong_words(self):
        self.assertEqual(
            "hal manual: unknown page 'hal-rn'; did you mean 'hal-run'?\n",
            self.bad("manual", "hal-rn"),
        )
        self.assertEqual(
            "hal manual: unknown page 'xyzzy'; type the command with hyphens: hal-can-dump\n",
            self.bad("manual", "xyzzy"),
        )
        self.assertEqual(
            "hal manual: cannot create '/dev/null/man1': Not a directory\n",
            self.bad("manual", "--output", "/dev/null/man1"),
        )


class Doctor(Case):
    def test_gives_verdicts_and_measures(self):
        text = self.good("doctor", "--seconds", "0.05")
        for subject in (
            "kernel",
            "SCHED_FIFO",
            "memory locking",
            "capabilities",
            "raw Ethernet",
            "throttling",
            "frequency",
            "isolated cpus",
            "clock source",
            "idle states",
        ):
            self.assertRegex(text, rf"(?m)^(good|fair|poor)  {subject} ")
        self.assertRegex(text, r"(?m)^wake-up latency at 1 kHz, SCHED_\w+")
        self.assertRegex(text, r"(?m)^  sleeping, then spinning the last 200 us .*s$")

    def test_rejects_what_has_no_meaning(self):
        for seconds in ("nan", "inf", "-1", "1e9"):
            self.assertIn("--seconds", self.bad("doctor", "--seconds", seconds))
        self.assertIn("--yes applies to --fix", self.bad("doctor", "--yes"))

    def test_every_poor_verdict_has_a_remedy(self):
        report = json.loads(self.good("doctor", "--seconds", "0.05", "--json"))
        for finding in report["findings"]:
            self.assertIn(finding["verdict"], ("good", "fair", "poor"))
            if finding["verdict"] == "poor":
                self.assertTrue(finding["remedy"], finding)
        sleeping, hybrid = report["wakeup"]
        self.assertEqual((0, 200000), (sleeping["spin_ns"], hybrid["spin_ns"]))
        for measured in report["wakeup"]:
            self.assertGreater(measured["cycles"], 0)
            self.assertLessEqual(measured["p50_ns"], measured["p99_ns"])
            self.assertLessEqual(measured["p99_ns"], measured["max_ns"])


if __name__ == "__main__":
    unittest.main()
