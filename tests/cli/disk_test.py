# SPDX-License-Identifier: MIT
"""Writers of files on a full disk: a replaced file keeps its old content, a growing one ends with a whole line. In a mount namespace."""
import os
import shutil
import signal
import stat
import subprocess
import sys
import unittest
from pathlib import Path

from harness import Case, HAL, wait_until

VARIABLE = "HALCYON_OWN_MOUNTS"


def own_mounts():
    """Starts the script once more where it may mount. False where that cannot be."""
    if os.environ.get(VARIABLE) == "1":
        return True
    words = ["unshare", "--mount", *([] if os.geteuid() == 0 else ["--map-root-user"])]
    if (
        not shutil.which("unshare")
        or subprocess.run([*words, "true"], capture_output=True).returncode != 0
    ):
        return False
    os.environ[VARIABLE] = "1"
    os.execvp("unshare", [*words, sys.executable, *sys.argv])


NETLIST = "loadrt threads name1=t period1=1000000\nloadrt and2 count=40\naddf and2.0 t\n"
NODE = "[node]\n"


class Full(Case):
    def setUp(self):
        super().setUp()
        self.disk = self.folder / "disk"
        self.disk.mkdir()
        subprocess.run(
            ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(self.disk)], check=True
        )
        self.addCleanup(subprocess.run, ["umount", "-l", str(self.disk)])

    def old(self, name, text="the old content\n", mode=0o640):
        path = self.disk / name
        path.write_text(text)
        path.chmod(mode)
        return path

    def fill(self):
        with open(self.disk / "ballast", "wb", buffering=0) as ballast:
            try:
                while True:
                    ballast.write(b"x" * 4096)
            except OSError:
                pass

    def hal(self, *words):
        return subprocess.run(
            [str(HAL), *map(str, words)],
            cwd=self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=120,
        )

    def keeps(self, path, *words, content="the old content\n"):
        """The command fails with the reason, and the file is unchanged; no temporary file remains."""
        before = sorted(p.name for p in self.disk.iterdir())
        done = self.hal(*words)
        self.assertNotEqual(0, done.returncode, words)
        self.assertIn("No space left on device", done.stderr, words)
        self.assertEqual(content, path.read_text(), words)
        self.assertEqual(0o640, stat.S_IMODE(path.stat().st_mode), words)
        self.assertEqual(before, sorted(p.name for p in self.disk.iterdir()), words)

    def test_a_failed_write_leaves_the_file_unchanged(self):
        a = self.write("a.hal", NETLIST)
        saved, drawn = self.old("saved.hal"), self.old("drawn.dot")
        page = self.old("and2.md")
        ugly = "loadrt   and2 count=1\n" + "".join(
            f"setp   and2.0.in0    {i % 2}\n" for i in range(500)
        )
        formatted = self.old("ugly.hal", ugly)
        self.fill()
        self.keeps(saved, "sim", a, self.write("save.hal", f"save all {saved}\n"))
        self.keeps(drawn, "graph", a, "-o", drawn)
        self.keeps(page, "doc", "and2", "--markdown", "--output", self.disk)
        self.keeps(formatted, "fmt", formatted, content=ugly)
        if shutil.which("dot"):
            self.keeps(self.old_when_full("drawn.svg"), "graph", a, "-o", self.disk / "drawn.svg")

    def old_when_full(self, name):
        (self.disk / "ballast").unlink()
        path = self.old(name)
        self.fill()
        return path

    def test_a_replaced_file_keeps_mode_and_link_and_a_new_one_has_the_umask(self):
        saved = self.old("saved.hal", mode=0o604)
        (self.disk / "link.hal").symlink_to("saved.hal")
        script = self.write(
            "save.hal", f"{NETLIST}save all {self.disk}/link.hal\nsave all {self.disk}/new.hal\n"
        )
        done = self.hal("sim", script)
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertTrue((self.disk / "link.hal").is_symlink())
        self.assertIn("loadrt and2 count=40", saved.read_text())
        self.assertEqual(0o604, stat.S_IMODE(saved.stat().st_mode))
        mask = os.umask(0o22)
        os.umask(mask)
        self.assertEqual(0o666 & ~mask, stat.S_IMODE((self.disk / "new.hal").stat().st_mode))
        self.assertEqual(
            ["link.hal", "new.hal", "saved.hal"], sorted(p.name for p in self.disk.iterdir())
        )
        self.assertEqual(
            0,
            self.hal("sim", self.write("device.hal", NETLIST + "save all /dev/null\n")).returncode,
        )

    def test_lost_output_is_an_error(self):
        a = self.write(
            "a.hal",
            "loadrt threads name1=t period1=1000000\nloadrt and2 count=1\naddf and2.0 t\ngetp and2.0.in0\n",
        )
        for words in (
            ["sim", a],
            ["run", a, "--for", "10ms"],
            ["run", "--for", "10ms", a, "--name", "other"],
        ):
            with open("/dev/full", "w") as full:
                done = subprocess.run(
                    [str(HAL), *words],
                    cwd=self.folder,
                    env=self.environment,
                    stdout=full,
                    stderr=subprocess.PIPE,
                    text=True,
                    timeout=120,
                )
            self.assertEqual(1, done.returncode, done.stderr)
            self.assertEqual(
                1,
                done.stderr.count(
                    "hal: cannot write to standard output: No space left on device\n"
                ),
                done.stderr,
            )

    def test_a_recording_ends_with_a_whole_line(self):
        for form in ([], ["--csv"]):
            record = f"loadusr -w hal record {' '.join(form)} -n 20000 {self.disk}/seen.txt\n"
            netlist = self.write(
                "rec.hal",
                "loadrt threads name1=t period1=1000000\nloadrt sampler cfg=uf depth=30000\nloadrt sum2 names=s\naddf s t\naddf sampler.0 t\n"
                "net cycles t.threadbeat => sampler.0.pin.0\nnet sum s.out => sampler.0.pin.1\nsetp s.in0 0.5\nstart\nadvance 20000 cycles\n"
                + record,
            )
            done = self.hal("sim", netlist)
            self.assertNotEqual(0, done.returncode)
            self.assertIn(
                "No space left on device; what was written ends with a whole line, after",
                done.stderr,
            )
            lines = (self.disk / "seen.txt").read_text()
            self.assertTrue(lines.endswith("\n"))
            rows = lines.splitlines()[len(form) :]
            self.assertGreater(len(rows), 1000)
            self.assertIn(f"after {len(rows)} records", done.stderr)
            width = {len(row.replace(",", " ").split()) for row in rows}
            self.assertEqual({3 if form else 2}, width)  # CSV has a column of times
            (self.disk / "seen.txt").unlink()

    def test_a_recorder_on_a_full_disk_says_what_remains(self):
        self.start(
            "run",
            self.write(
                "a.hal",
                "loadrt threads name1=servo period1=1000000\nloadrt siggen names=wave\naddf wave.update servo\n"
                "net sine wave.sine\nstart\n",
            ),
        )
        self.fill()
        path = self.disk / "none.mcap"
        done = self.hal("record", path, "sine", "--for", "50ms")
        self.assertEqual(1, done.returncode, done.stdout)
        self.assertEqual(
            f"hal record: cannot write '{path}': No space left on device; no row was written, and the file was removed\n",
            done.stderr,
        )
        self.assertEqual(["ballast"], sorted(p.name for p in self.disk.iterdir()))
        path = self.disk / "none.csv"
        done = self.hal("record", path, "sine", "--for", "50ms")
        self.assertEqual(1, done.returncode, done.stdout)
        self.assertRegex(
            done.stderr, r"No space left on device; no row was written: '\S+/none\.csv' has none\n$"
        )
        path.unlink()
        # it fills up while the recorder writes: what was written can be read
        os.truncate(self.disk / "ballast", 4096)
        path = self.disk / "some.mcap"
        done = self.hal("record", path, "wave.clock")
        self.assertEqual(1, done.returncode, done.stdout)
        self.assertRegex(
            done.stderr, r"No space left on device; the file is complete up to there\n$"
        )
        self.assertEqual(["ballast", "some.mcap"], sorted(p.name for p in self.disk.iterdir()))
        done = self.hal("plot", path, "wave.clock", "-o", self.folder / "some.svg")
        self.assertEqual((0, ""), (done.returncode, done.stderr), done.stdout)

    def test_a_flight_recorder_goes_on_and_writes_late_when_there_is_space(self):
        self.start(
            "run",
            self.write(
                "a.hal",
                "loadrt threads name1=servo period1=1000000\nloadrt siggen names=wave\naddf wave.update servo\n"
                "net sine wave.sine\nnewsig crash bit\nstart\n",
            ),
        )
        out, err = self.folder / "out", self.folder / "err"
        recorder = subprocess.Popen(
            [
                str(HAL),
                "record",
                self.disk / "box.csv",
                "sine",
                "--last",
                "300ms",
                "--after",
                "50ms",
                "--trigger",
                "crash",
            ],
            cwd=self.folder,
            env=self.environment,
            stdout=out.open("w"),
            stderr=err.open("w"),
        )
        self.addCleanup(self.end, recorder)

        def cycles(count):
            self.good("record", "wait.csv", "sine", "--for", f"{count}ms")

        cycles(400)
        self.fill()
        self.say("sets", "crash", "TRUE")
        wait_until(lambda: "the recorder goes on" in err.read_text(), "the failure is reported")
        self.say("sets", "crash", "FALSE")
        cycles(100)
        self.say("sets", "crash", "TRUE")
        cycles(400)
        self.assertIsNone(recorder.poll())
        self.assertRegex(
            err.read_text(),
            r"^hal record: cannot write '\S+/box-\w+-crash-001\.csv': No space left on device[^\n]*; the recorder goes on, "
            r"and writes events from memory when there is space\n$",
        )
        (self.disk / "ballast").unlink()
        wait_until(lambda: "writing again" in out.read_text(), "the events are written")
        self.assertRegex(
            out.read_text(),
            r"(?s)box-\w+-crash-001\.csv: \d+ rows.*box-\w+-crash-002\.csv: \d+ rows.*"
            r"writing again: 2 events written late, 0 lost\n$",
        )
        for number in ("001", "002"):
            rows = next(self.disk.glob(f"box-*-crash-{number}.csv")).read_text().splitlines()
            self.assertGreater(len(rows), 200)
        # At the end, what could not be written is an error.
        self.fill()
        self.say("sets", "crash", "FALSE")
        cycles(100)
        self.say("sets", "crash", "TRUE")
        wait_until(
            lambda: err.read_text().count("the recorder goes on") == 2,
            "the failure is reported again",
        )
        recorder.send_signal(signal.SIGINT)
        self.assertEqual(1, recorder.wait(60))
        self.assertRegex(
            err.read_text(),
            r"\nhal record: 1 event not written: cannot write '\S+-crash-003\.csv': No space left on device",
        )


if __name__ == "__main__":
    if not own_mounts():
        print("no mount namespace can be made here")
        sys.exit(77)
    unittest.main()
