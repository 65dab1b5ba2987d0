# SPDX-License-Identifier: MIT
# packages: canopen tdma
"""The machines at the other end of a wire, as processes in network namespaces. Figures are printed, none is asserted: the machine may be
busy. What is asserted is that it comes up, that all stations find the master's clock by clocks that differ, that the backup master takes
over, what the way takes by the schedule, and that nothing is left behind."""

import os
import re
import shutil
import subprocess
import sys
import unittest

from harness import HAL, ROOT, SANITIZED, Case, machines_elsewhere

SECONDS = os.environ.get("HALCYON_ETHERNET_SECONDS", "12")


class Segment(Case):
    def bring_up(self, machine, *words):
        if SANITIZED:
            self.skipTest("eight processes under a sanitizer miss their cycles on any machine")
        machines, read_only = machines_elsewhere(self.folder)
        done = subprocess.run(
            [*read_only, machines / machine / "bring-up", *words],
            cwd=self.folder,
            env={**self.environment, "HAL": os.path.relpath(HAL, self.folder), "TMPDIR": "."},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=240,
        )
        if done.returncode == 77 or "not to be had" in done.stdout:
            self.skipTest("no network namespaces here: " + done.stdout.strip())
        print(done.stdout, file=sys.stderr)
        logs = next(self.folder.glob("hal-*"), None)
        self.assertIsNotNone(logs, done.stdout)
        return done, {log.stem: log.read_text() for log in logs.glob("*.log")}

    def status_is_true(self, done, on):
        """Fails when the machine is off at the end, with the reason in its last lines: possible on a busy machine."""
        self.assertEqual(0 if re.search(on, done.stdout) else 1, done.returncode, done.stdout)
        if done.returncode != 0:
            self.assertRegex(
                done.stdout, r"the (motor|machine) is off at the end: the control missed \d+ cycles"
            )

    def stations(self, logs, names):
        """Each station was synchronous, and measured its skew as exactly as a busy machine permits."""
        for name, ppm in names.items():
            line = re.search(r"^TDMA: (.*)$", logs[name], re.M)
            self.assertIsNotNone(line, f"{name}: {logs[name]}")
            print(f"{name}: {line[1]}", file=sys.stderr)
            self.assertGreater(int(re.search(r"syncs (\d+) received", line[1])[1]), 0, line[1])
            self.assertLess(
                abs(float(re.search(r"clock ([-+.\d]+) ppm", line[1])[1]) + ppm), 150, line[1]
            )

    def test_the_rig_hangs_at_the_other_end(self):
        done, logs = self.bring_up("ethernet-furuta", SECONDS)
        self.status_is_true(done, "motor on: TRUE")
        self.stations(logs, {"rig": 200})

    def test_five_axes_and_io_are_eight_processes(self):
        done, logs = self.bring_up("ethernet-cnc", "--lose-clock", SECONDS)
        self.status_is_true(done, "at the end: nodes operational: \\d of 6; machine on: TRUE")
        self.stations(logs, {"x": 200, "y": -150, "z": 80, "a": -200, "c": 35, "io": -60})
        self.assertRegex(
            done.stdout,
            r"at the end: .* the control sends the syncs: TRUE",
            "the backup master took over",
        )
        self.assertRegex(done.stdout, r"axis c: enabled (TRUE|FALSE), following error [-\d.]+ mm")
        self.assertIn(
            "x-pwm: canopen.0.x.pwm-set-point => node 1 (x)  0 cycles on the wire, 260 us at worst\n",
            done.stdout,
        )
        self.assertIn(
            "x-count: node 1 (x) => canopen.0.x.encoder-count  1 cycle on the wire, 1.74 ms at worst; there and back 2 cycles\n",
            done.stdout,
        )
        left = subprocess.run(["ip", "netns", "list"], stdout=subprocess.PIPE, text=True).stdout
        self.assertNotIn("hal-cnc-", left)

    def test_names_a_folder_that_cannot_be_created(self):
        done = subprocess.run(
            [ROOT / "halfiles/ethernet-furuta/bring-up"],
            env={**self.environment, "HAL": str(HAL), "TMPDIR": "/nowhere"},
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        if done.returncode == 77:
            self.skipTest("no network namespaces here")
        self.assertEqual(1, done.returncode)
        self.assertIn(
            "cannot create a folder for the output of the processes in '/nowhere'; set TMPDIR=FOLDER\n",
            done.stdout,
        )

    def test_names_unexpected_words(self):
        for machine, option in (("cnc", "--lose-clock"), ("furuta", "--swing-up")):
            done = subprocess.run(
                [ROOT / f"halfiles/ethernet-{machine}/bring-up", "fast"],
                env={**self.environment, "HAL": str(HAL)},
                text=True,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
            )
            if done.returncode == 77:
                self.skipTest("no network namespaces here")
            self.assertEqual(
                (1, True),
                (
                    done.returncode,
                    f"invalid argument 'fast'; write bring-up [{option}] [SECONDS]" in done.stdout,
                ),
                done.stdout,
            )

    def test_linuxcnc_s_machine_checks_its_folders_and_programs_first(self):
        machines, read_only = machines_elsewhere(self.folder)
        programs = self.folder / "programs"
        programs.mkdir()
        (self.folder / "file").touch()

        def refused(*words, cwd=self.folder):
            done = subprocess.run(
                [*read_only, machines / "linuxcnc-ethernet/bring-up", *words],
                cwd=cwd,
                env={
                    **self.environment,
                    "HAL": str(HAL),
                    "PATH": f"{programs}:/usr/sbin:/usr/bin:/sbin:/bin",
                },
                text=True,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
            )
            if done.returncode == 77:
                self.skipTest("no network namespaces here")
            self.assertEqual(1, done.returncode, done.stdout)
            return done.stdout

        if not shutil.which("linuxcncsvr"):
            self.assertIn("type: sudo apt-get install linuxcnc-uspace\n", refused())
        server = programs / "linuxcncsvr"
        server.write_text("#!/bin/sh\n")
        server.chmod(0o755)
        usage = "write bring-up [PROGRAM.ngc] [--output FOLDER]\n"
        self.assertIn(f"--output needs a folder; {usage}", refused("--output"))
        self.assertIn(f"cannot read 'absent.ngc'; {usage}", refused("absent.ngc"))
        self.assertIn(f"unknown option '--out'; {usage}", refused("--out", "x"))
        elsewhere = "'; choose another one with --output FOLDER\n"
        self.assertIn(f"cannot write to the folder 'file{elsewhere}", refused("--output", "file"))
        if read_only:
            here = machines / "linuxcnc-ethernet"
            self.assertIn(f"cannot write to the folder 'driven{elsewhere}", refused(cwd=here))

    def test_scripts_without_their_neighbours_name_what_is_missing(self):
        for machine in ("cell", "ethercat-servo", "ethernet-furuta", "linuxcnc-ethernet"):
            with self.subTest(machine):
                alone = shutil.copytree(ROOT / "halfiles" / machine, self.folder / machine)
                done = subprocess.run([alone / "bring-up"], capture_output=True, text=True)
                self.assertEqual(1, done.returncode)
                self.assertIn(
                    "bring-up: copy the whole folder halfiles; this needs its ethernet-cnc\n",
                    done.stderr,
                )

    def test_a_station_prints_what_to_type(self):
        tdma = self.folder / "one.tdma"
        tdma.write_text(
            "master:\nname control\ncycle 1000\nslot 0 250 1/1 300\n\nslave:\nname x\nphase 330\nslot 0 450 1/1 250\n"
        )
        node = lambda *words: subprocess.run(
            ["hal", "node", "axis-io", "--id", "1", *words],
            executable=str(HAL),
            env=self.environment,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        ).stderr
        self.assertIn(
            "--tdma needs an Ethernet link; write --link cane:eth0, or remove --tdma",
            node("--link", "udp:239.74.163.2:43113", "--tdma", str(tdma)),
        )
        self.assertIn(
            "--skew needs a TDMA schedule; add --tdma FILE\n",
            node("--link", "cane:lo", "--skew", "200ppm"),
        )
        self.assertIn(
            "unknown option 'slots'; options are bitrate, datarate, fd, listen, own, errors, stamps, restart, sendqueue, receivequeue, "
            "and for cane: format, order, slot, priority, learn, to, master, also, key, mac, speed, policy, spin, promiscuous, forward, noise, node5\n",
            node("--link", "cane:lo?slots=3"),
        )
        with_mac = self.folder / "mac.tdma"
        with_mac.write_text(tdma.read_text().replace("name x\n", "name x\nmac 02:00:00:00:00:07\n"))
        refusal = node("--link", "cane:lo", "--tdma", str(with_mac), "--station", "x")
        if "CAP_NET_RAW" not in refusal:
            self.assertEqual(
                f"hal node axis-io: eth:lo has the address 00:00:00:00:00:00, but {with_mac} gives x 02:00:00:00:00:07; correct the line 'mac' "
                "of its block\n",
                refusal,
            )
        self.assertIn(
            "write --skew 200ppm", node("--link", "cane:lo", "--tdma", str(tdma), "--skew", "fast")
        )
        self.assertIn("write one of: axis, furuta", node("--link", "cane:lo", "--plant", "robot"))
        self.assertIn("cannot read 'none.tdma'", node("--link", "cane:lo", "--tdma", "none.tdma"))

    def test_the_description_beside_the_machines_is_the_devices(self):
        eds = subprocess.run(
            ["hal", "node", "axis-io", "--eds"],
            executable=str(HAL),
            env=self.environment,
            text=True,
            stdout=subprocess.PIPE,
        ).stdout
        dates = re.compile(r"^(Creation|Modification)(Date|Time)=.*\n|^(Description)=.*\n", re.M)
        for machine in ("ethernet-furuta", "ethernet-cnc"):
            self.assertEqual(
                dates.sub("", eds),
                dates.sub("", (ROOT / "halfiles" / machine / "axis-io.eds").read_text()),
                machine,
            )


if __name__ == "__main__":
    unittest.main()
