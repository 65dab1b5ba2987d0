# SPDX-License-Identifier: MIT
"""hal shell without a terminal: one-shot, scripts, pipes, which instance."""
import json
import subprocess
import unittest

from harness import HAL, SERVO, Case, wait_until


class NoInstance(Case):
    def test_prints_what_to_type(self):
        error = self.bad("shell", "show", "pin")
        self.assertIn("hal run", error)
        self.assertEqual(1, error.count("\n"))

    def test_named_one_that_does_not_run(self):
        self.start("run", self.write("a.hal", SERVO), "--name", "left", instance="left")
        error = self.bad("shell", "--name", "rihgt", "show", "pin")
        self.assertIn("rihgt", error)
        self.assertIn("left", error)
        self.assertEqual(1, error.count("\n"))


class WhichInstance(Case):
    def test_the_only_one_needs_no_name(self):
        self.start("run", self.write("a.hal", SERVO), "--name", "left", instance="left")
        self.assertEqual("3\n", self.good("shell", "getp", "adder.in1"))

    def test_default_is_preferred(self):
        path = self.write("a.hal", SERVO)
        self.start("run", path, "--name", "left", instance="left")
        self.start("run", path)
        self.shell("setp", "adder.in1", "4")
        self.assertEqual("4\n", self.good("shell", "getp", "adder.in1"))

    def test_several_without_default_are_listed(self):
        path = self.write("a.hal", SERVO)
        for name in ("left", "right"):
            self.start("run", path, "--name", name, instance=name)
        error = self.bad("shell", "getp", "adder.in1")
        self.assertIn("left", error)
        self.assertIn("right", error)
        self.assertIn("--name", error)

    def test_variable(self):
        path = self.write("a.hal", SERVO)
        for name in ("left", "right"):
            self.start("run", path, "--name", name, instance=name)
        self.shell("setp", "adder.in1", "9", instance="right")
        self.assertEqual(
            "9\n",
            self.good("shell", "getp", "adder.in1", environment={"HALCYON_INSTANCE": "right"}),
        )


class OneShot(Case):
    def setUp(self):
        super().setUp()
        self.machine = self.start("run", self.write("a.hal", SERVO))

    def test_set_and_get(self):
        self.assertEqual("", self.good("shell", "setp", "adder.in0", "-7.25"))
        self.assertEqual("-7.25\n", self.good("shell", "getp", "adder.in0"))
        self.assertEqual("-7.25\n", self.good("shell", "getp adder.in0"))

    def test_errors_go_to_standard_error(self):
        done = self.run_program("shell", "getp", "adder.ot")
        self.assertEqual((1, ""), (done.returncode, done.stdout))
        self.assertIn("did you mean 'adder.out'?", done.stderr)

    def test_edits_the_running_machine(self):
        self.good("shell", "loadrt", "sum2", "names=next")
        self.good("shell", "addf", "next", "servo")
        self.good("shell", "net", "total", "next.in0")
        wait_until(lambda: self.value("next.out") == "5", "the new adder works")

    def test_blanks_within_a_word(self):
        self.assertEqual("", self.good("shell", "alias", "pin", "adder.in0", "first"))
        self.assertEqual("2\n", self.good("shell", "getp", "first"))

    def test_several_commands(self):
        self.assertEqual(
            "2\n3\n", self.good("shell", "-e", "getp adder.in0", "-e", "getp adder.in1")
        )
        done = self.run_program("shell", "-e", "getp nothing", "-e", "getp adder.in1")
        self.assertEqual((1, ""), (done.returncode, done.stdout))
        done = self.run_program("shell", "-k", "-e", "getp nothing", "-e", "getp adder.in1")
        self.assertEqual((1, "3\n"), (done.returncode, done.stdout))

    def test_silence(self):
        done = self.run_program("shell", "-Q", "getp", "nothing")
        self.assertEqual((1, "", ""), (done.returncode, done.stdout, done.stderr))
        silent = [
            ["shell", "-Q", "--name", "nobody", "getp", "adder.in0"],
            ["shell", "-Q", "--name", "not a name", "getp", "adder.in0"],
            ["shell", "-Q", "-i", "missing.ini", "-f", "missing.hal"],
            ["shell", "-Q", "-f", "missing.hal"],
            ["shell", "-Q", "-e", "begin"],
        ]
        for words in silent:
            done = self.run_program(*words)
            self.assertEqual((1, "", ""), (done.returncode, done.stdout, done.stderr), words)
        done = self.run_program("shell", "--name", "nobody", "getp", "adder.in0")
        self.assertEqual(
            (
                1,
                "hal shell: no instance 'nobody' is running; running: default (choose with --name)\n",
            ),
            (done.returncode, done.stderr),
        )

    def test_json(self):
        self.assertEqual(2, json.loads(self.good("shell", "--json", "getp", "adder.in0"))["value"])

    def test_script_output(self):
        self.assertRegex(
            self.good("shell", "-s", "show", "pin", "adder.in0"),
            r"^sum2 float IN +2 adder\.in0 *\n$",
        )

    def test_output_that_cannot_be_written(self):
        with open("/dev/full", "w") as full:
            done = subprocess.run(
                [str(HAL), "shell", "show"],
                env=self.environment,
                cwd=self.folder,
                stdout=full,
                stderr=subprocess.PIPE,
                text=True,
                timeout=60,
            )
        self.assertEqual(1, done.returncode)
        self.assertIn("No space left", done.stderr)

    def test_instance_that_ends_during_a_command(self):
        client = subprocess.Popen(
            [str(HAL), "shell", "-e", "setp adder.in0 77", "-e", "loadusr -w sleep 1000"],
            env=self.environment,
            cwd=self.folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(self.end, client)
        wait_until(lambda: self.value("adder.in0") == "77", "the first command has run")
        self.end(self.machine)
        out, err = client.communicate(timeout=60)
        self.assertEqual(1, client.returncode, out + err)


class Scripts(Case):
    def setUp(self):
        super().setUp()
        self.start("run", self.write("a.hal", SERVO))

    def test_file(self):
        path = self.write("s.hal", "setp adder.in0 10\nsetp adder.in1 20\ngetp adder.in1\n")
        self.assertEqual("20\n", self.good("shell", "-f", path))

    def test_file_is_a_row_of_transactions(self):
        path = self.write("s.hal", "setp adder.in0 10\nnet total nothing.in\n")
        self.assertIn(f"{path}:2", self.bad("shell", "-f", path))
        self.assertEqual("2", self.value("adder.in0"))

    def test_keep_going(self):
        path = self.write("s.hal", "setp adder.in0 10\nnet total nothing.in\nsetp adder.in1 11\n")
        self.bad("shell", "-k", "-f", path)
        self.assertEqual(("10", "11"), (self.value("adder.in0"), self.value("adder.in1")))

    def test_echo(self):
        done = self.run_program("shell", "--echo", "-f", self.write("s.hal", "getp adder.in0\n"))
        self.assertEqual("2\n", done.stdout)
        self.assertIn("(1)<echo>: getp adder.in0", done.stderr)

    def test_missing_file(self):
        self.assertEqual(
            "hal shell: cannot read 'nowhere.hal': No such file or directory\n",
            self.bad("shell", "-f", "nowhere.hal"),
        )

    def test_standard_input(self):
        text = "# a comment\nsetp adder.in0 10\ngetp adder.in0\nquit\ngetp adder.in1\n"
        for words in (("shell",), ("shell", "-f")):
            self.assertEqual("10\n", self.good(*words, given=text))

    def test_standard_input_stops_at_the_first_error(self):
        done = self.run_program("shell", "-f", given="getp nothing\ngetp adder.in1\n")
        self.assertEqual((1, ""), (done.returncode, done.stdout))
        self.assertIn("<stdin>", done.stderr)

    def test_a_pipes_lines_are_numbered(self):
        pipe = subprocess.run(
            [str(HAL), "shell"],
            env=self.environment,
            input="setp adder.in0 \\\n 10\n\ngetp nothing\n",
            text=True,
            capture_output=True,
        )
        self.assertTrue(pipe.stderr.startswith("<stdin>:4:6: error: "), pipe.stderr)
        self.assertTrue(
            pipe.stderr.endswith(
                "hal shell: a pipe is read line by line: lines 1 to 3 were carried out before the error in line 4\n"
            ),
            pipe.stderr,
        )
        self.assertEqual("10", self.value("adder.in0"))

    def test_a_pipe_reports_an_open_begin(self):
        before = self.value("adder.in0")
        for text, said in (
            (
                "begin\nsetp adder.in0 7\n",
                "hal shell: 'begin' in line 1 without 'commit': the collected edits had no effect\n",
            ),
            (
                "\nbegin\nsetp adder.in0 7\nquit\n",
                "hal shell: 'begin' in line 2 without 'commit': the collected edits had no effect\n",
            ),
            (
                "begin\nsetp adder.in0 7\nsetp nothing 1\ncommit\n",
                "hal shell: a pipe is read line by line: the edits collected from line 1 on had no effect\n",
            ),
            (
                "getp adder.in0\nbegin\nsetp adder.in0 7\nfrobnicate\ncommit\n",
                "hal shell: a pipe is read line by line: line 1 was carried out before the error in line 4; "
                "the edits collected from line 2 on had no effect\n",
            ),
        ):
            pipe = subprocess.run(
                [str(HAL), "shell"],
                env=self.environment,
                input=text,
                text=True,
                capture_output=True,
            )
            self.assertEqual(1, pipe.returncode, text)
            self.assertTrue(pipe.stderr.endswith(said), pipe.stderr)
            self.assertEqual(before, self.value("adder.in0"))
        self.assertEqual(
            "hal shell: 'begin' without 'commit' had no effect; write the transaction to a file, or type: hal shell\n",
            self.bad("shell", "begin"),
        )
        pipe = subprocess.run(
            [str(HAL), "shell"],
            env=self.environment,
            input="begin\nsetp adder.in0 7\ncommit\nsetp nothing 1\n",
            text=True,
            capture_output=True,
        )
        self.assertTrue(
            pipe.stderr.endswith("lines 1 to 3 were carried out before the error in line 4\n"),
            pipe.stderr,
        )
        self.assertEqual("7", self.value("adder.in0"))

    def test_pipe_answers_each_line_at_once(self):
        client = subprocess.Popen(
            [str(HAL), "shell"],
            env=self.environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            bufsize=1,
        )
        self.addCleanup(client.wait)
        for value in ("1", "2.5", "-3"):
            client.stdin.write(f"setp adder.in0 {value}\ngetp adder.in0\n")
            client.stdin.flush()
            self.assertEqual(value + "\n", client.stdout.readline())
        client.stdin.close()
        self.assertEqual(0, client.wait(timeout=60))
        client.stdout.close()

    def test_variables_are_the_users(self):
        path = self.write("s.hal", "setp adder.in0 $MINE\n")
        self.good("shell", "-f", path, environment={"MINE": "55"})
        self.assertEqual("55", self.value("adder.in0"))

    def test_ini_values(self):
        ini = self.write("s.ini", "[A]\nB = 66\n")
        self.good("shell", "--ini", ini, "-f", self.write("s.hal", "setp adder.in0 [A]B\n"))
        self.assertEqual("66", self.value("adder.in0"))


if __name__ == "__main__":
    unittest.main()
