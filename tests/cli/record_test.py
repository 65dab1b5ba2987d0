# SPDX-License-Identifier: MIT
"""hal record and hal play, halsampler and halstreamer."""

import csv
import signal
import subprocess
import unittest

from harness import Case, HAL, wait_until

# A streamer feeds an adder, the sampler records input and output. Threads run no functions until `start`.
NETLIST = """loadrt threads name1=servo period1=1000000
loadrt streamer cfg=fb depth=1001
loadrt sampler cfg=fbsukl depth=1001
loadrt sum2 names=twice
addf streamer.0 servo
addf twice servo
addf sampler.0 servo
net x streamer.0.pin.0 => twice.in0 twice.in1
net y twice.out => sampler.0.pin.0
net flag streamer.0.pin.1 => sampler.0.pin.1
net cycles servo.threadbeat => sampler.0.pin.3
"""


class Sim(Case):
    """Deterministic: the programs run between two advances of the virtual clock."""

    def sim(self, *commands):
        return self.good(
            "sim", "--quiet", self.write("a.hal", NETLIST + "".join(c + "\n" for c in commands))
        )

    def test_what_is_played_is_recorded(self):
        self.write("in.txt", "1.5 0\n-2 1\n# a comment\n\n3e3 1\n")
        self.assertEqual(
            "3.000000 0 \n-4.000000 1 \n6000.000000 1 \n",
            "".join(
                line.split(" ", 2)[0] + " " + line.split(" ", 2)[1] + " \n"
                for line in self.sim(
                    "loadusr -w hal play in.txt",
                    "start",
                    "advance 3 cycles",
                    "loadusr -w hal record -n 3",
                ).splitlines()
            ),
        )

    def test_a_pattern_without_a_file_says_what_to_type(self):
        self.assertEqual(
            "hal record: 'x-*' names values, not a file; name the file first: hal record "
            "FILE.mcap 'x-*'\n",
            self.bad("record", "x-*"),
        )

    def test_lines_have_a_blank_after_each_value(self):
        self.write("in.txt", "1 1\n")
        self.assertRegex(
            self.sim(
                "loadusr -w halstreamer in.txt",
                "start",
                "advance 1 cycles",
                "loadusr -w halsampler -n 1",
            ),
            r"^2\.000000 1 0 \d+ 0 0 \n$",
        )

    def test_a_leading_0_of_an_integer_has_no_meaning(self):
        self.write("in.txt", "010 -08\n0x10 1\n")
        netlist = self.write(
            "b.hal",
            "loadrt threads name1=servo period1=1000000\nloadrt streamer cfg=us depth=10\naddf streamer.0 servo\nloadusr -w halstreamer in.txt\nstart\n"
            + "advance 1 cycles\ngetp streamer.0.pin.0\ngetp streamer.0.pin.1\n" * 2,
        )
        self.assertEqual("10\n-8\n16\n1\n", self.good("sim", "--quiet", netlist))

    def test_a_folder_is_not_played(self):
        netlist = self.write(
            "b.hal",
            "loadrt threads name1=servo period1=1000000\nloadrt streamer cfg=u depth=10\n"
            "addf streamer.0 servo\nstart\nloadusr -w halstreamer .\n",
        )
        done = self.run_program("sim", "--quiet", netlist)
        self.assertEqual(
            (1, "halstreamer: cannot read '.': Is a directory"),
            (done.returncode, done.stderr.split("\n")[0]),
        )

    def test_tag_is_the_sample_number(self):
        lines = self.sim("start", "advance 3 cycles", "loadusr -w halsampler -t -n 3").splitlines()
        self.assertEqual(["0", "1", "2"], [line.split()[0] for line in lines])

    def test_csv_names_the_linked_signals(self):
        self.write("in.txt", "0.1 0\n0.2 1\n")
        rows = list(
            csv.reader(
                self.sim(
                    "loadusr -w hal play in.txt",
                    "start",
                    "advance 2 cycles",
                    "loadusr -w hal record --csv -n 2",
                ).splitlines()
            )
        )
        self.assertEqual(
            [
                "time_s",
                "y",
                "flag",
                "sampler.0.pin.2",
                "cycles",
                "sampler.0.pin.4",
                "sampler.0.pin.5",
            ],
            rows[0],
        )
        self.assertEqual([0.2, 0.4], [float(row[1]) for row in rows[1:]])
        self.assertEqual(["0", "1"], [row[2] for row in rows[1:]])
        self.assertAlmostEqual(0.001, float(rows[2][0]) - float(rows[1][0]), 12)

    def test_csv_times_show_a_gap(self):
        rows = list(
            csv.reader(
                self.sim(
                    "start",
                    "advance 3 cycles",
                    "stop",
                    "advance 7 cycles",
                    "start",
                    "advance 2 cycles",
                    "loadusr -w hal record --csv -n 5",
                ).splitlines()
            )
        )
        times = [round(float(row[0]) * 1000) for row in rows[1:]]
        self.assertEqual([1, 1, 8, 1], [b - a for a, b in zip(times, times[1:])])

    def test_a_recorded_table_is_played(self):
        self.write("in.csv", "sample,time_s,a,b\n0,0.001,1.5,0\n1,0.002,-2,1\n")
        rows = list(
            csv.reader(
                self.sim(
                    "loadusr -w hal play in.csv",
                    "start",
                    "advance 2 cycles",
                    "loadusr -w hal record --csv -n 2",
                ).splitlines()
            )
        )
        self.assertEqual([3.0, -4.0], [float(row[1]) for row in rows[1:]])

    def test_csv_with_sample_numbers(self):
        rows = list(
            csv.reader(
                self.sim(
                    "start", "advance 2 cycles", "loadusr -w hal record --csv --tag -n 2"
                ).splitlines()
            )
        )
        self.assertEqual(["sample", "time_s"], rows[0][:2])
        self.assertEqual(["0", "1"], [row[0] for row in rows[1:]])

    def test_to_a_file(self):
        self.assertEqual(
            "", self.sim("start", "advance 2 cycles", "loadusr -w hal record -n 2 0 out.txt")
        )
        self.assertEqual(2, (self.folder / "out.txt").read_text().count("\n"))

    def test_a_lost_sample_prints_overrun(self):
        lines = self.sim(
            "start",
            "advance 1005 cycles",
            "loadusr -w halsampler -n 500",
            "advance 1 cycles",
            "loadusr -w halsampler -n 501",
        ).splitlines()
        self.assertEqual(1002, len(lines))
        self.assertEqual([1000], [i for i, line in enumerate(lines) if line == "overrun"])

    def test_lost_samples_are_counted_when_the_lines_are_csv(self):
        commands = [
            "start",
            "advance 1005 cycles",
            "loadusr -w hal record --csv -n 500",
            "advance 1 cycles",
            "loadusr -w hal record --csv -n 501",
        ]
        path = self.write("a.hal", NETLIST + "".join(c + "\n" for c in commands))
        lossy = self.run_program("sim", "--quiet", path)
        self.assertRegex(
            lossy.stderr,
            r"^hal: \d+ samples? between the lines (was|were) lost, because the sampler was full: "
            r"raise its depth\n$",
        )

    def test_no_samples_are_none(self):
        self.assertEqual("", self.sim("start", "advance 2 cycles", "loadusr -w halsampler -n 0"))

    def test_a_negative_count_is_rejected(self):
        done = self.run_program("record", "-n", "-3", "0", "out.txt")
        self.assertEqual(1, done.returncode)
        self.assertIn("-3 is negative; use 0 or more", done.stderr)

    def test_by_instance_name(self):
        self.assertEqual(
            1,
            self.sim(
                "loadrt sampler names=log cfg=f",
                "addf log servo",
                "start",
                "advance 1 cycles",
                "loadusr -w hal record -n 1 --channel log",
            ).count("\n"),
        )


class Live(Case):
    def setUp(self):
        super().setUp()
        self.start("run", self.write("a.hal", NETLIST))

    def test_wrong_words(self):
        for command, word in (("record", "sampler"), ("play", "streamer")):
            self.assertIn(f"{word}.7", self.bad(command, "7"))
        self.write("in.txt", "1 0\n1 maybe\n")
        error = self.bad("play", "0", "in.txt")
        self.assertIn("in.txt:2", error)
        self.assertIn("maybe", error)
        self.write("in.txt", "1\n")
        self.assertIn("in.txt:1", self.bad("play", "0", "in.txt"))
        self.assertIn("nowhere.txt", self.bad("play", "0", "nowhere.txt"))
        self.assertIn("not a number", self.bad("-n", "x", name="halsampler"))

    def test_a_second_one_on_a_stream_is_rejected(self):
        first = subprocess.Popen(
            [str(HAL), "play", "0"],
            env=self.environment,
            cwd=self.folder,
            stdin=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(self.end, first, signal.SIGKILL)
        first.stdin.write("1 0\n")
        first.stdin.flush()
        self.write("in.txt", "2 0\n")
        rejected = f"stream 'streamer.0' is fed by process {first.pid} already"
        # not by trying: a second one that is earlier would feed it itself
        self.comes("streamer.0.pin.0", "1")
        self.assertIn(rejected, self.bad("play", "0", "in.txt"))
        first.communicate(timeout=60)
        self.assertEqual(0, first.returncode)
        self.good("play", "0", "in.txt")

    def test_follows_until_interrupted(self):
        recorder = subprocess.Popen(
            [str(HAL), "record", "0", "out.txt"],
            env=self.environment,
            cwd=self.folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(self.end, recorder)
        lines = lambda: (
            (self.folder / "out.txt").read_text().splitlines()
            if (self.folder / "out.txt").exists()
            else []
        )
        wait_until(lambda: len(lines()) > 50, "50 lines are recorded")
        self.assertEqual(("", ""), self.end(recorder, signal.SIGINT))
        self.assertEqual(0, recorder.returncode)
        for line in lines():
            if line != "overrun":  # the machine was faster than this process
                self.assertEqual(6, len(line.split()))

    def test_instance_ends(self):
        machine = self.start("run", self.write("b.hal", NETLIST), "--name", "b", instance="b")
        recorder = subprocess.Popen(
            [str(HAL), "record", "--name", "b"],
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(self.end, recorder)
        recorder.stdout.readline()
        self.end(machine)
        _, err = recorder.communicate(timeout=60)
        self.assertEqual(1, recorder.returncode)
        self.assertRegex(err, "has ended")

    def test_play_waits_for_room(self):
        self.shell("setp", "streamer.0.enable", "0")
        player = subprocess.Popen(
            [str(HAL), "play"],
            env=self.environment,
            stdin=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(self.end, player)
        player.stdin.write("".join(f"{i} 0\n" for i in range(1500)))
        player.stdin.flush()
        wait_until(lambda: self.value("streamer.0.curr-depth") == "1000", "the FIFO is full")
        self.assertIsNone(player.poll())
        self.shell("setp", "streamer.0.enable", "1")
        player.stdin.close()
        self.assertEqual(0, player.wait(timeout=60))
        player.stderr.close()
        player.stdin = player.stderr = None
        wait_until(lambda: self.value("streamer.0.pin.0") == "1499", "all of it was played")


if __name__ == "__main__":
    unittest.main()
