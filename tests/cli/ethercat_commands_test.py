# SPDX-License-Identifier: MIT
# packages: ethercat
"""hal ethercat on an emulated line."""

import json
import os
import subprocess
import sys
import unittest
from xml.etree import ElementTree

from harness import HAL, ROOT, Case
from own_network import VARIABLE, own_network

LINE = "coupler, servo axes=2, digital_in bits=8 alias=7, mailbox_device"


class Ethercat(Case):
    def on(self, command, *words, line=LINE):
        return self.good("ethercat", command, "--emulate", line, *map(str, words))

    def refused(self, command, *words, line=LINE):
        return self.bad("ethercat", command, "--emulate", line, *map(str, words))


class Slaves(Ethercat):
    def test_scan_shows_the_tree_and_leaves_the_states(self):
        lines = self.on("scan").splitlines()
        self.assertEqual("0  INIT  Halcyon coupler  no clock", lines[0])
        self.assertEqual("  1  INIT  Halcyon servo  at port 1 of slave 0  delay 0 ns", lines[1])
        self.assertRegex(
            lines[3],
            r"^      3  INIT  Halcyon mailbox_device  at port 1 of slave 2  delay [1-9]\d* ns$",
        )
        rows = json.loads(self.on("scan", "--json"))
        self.assertEqual([None, 0, 1, 2], [row["parent"] for row in rows])
        self.assertEqual([None, 0, None], [row["delay_ns"] for row in rows[:3]])

    def test_slaves_counts_from_the_newest_alias(self):
        self.assertEqual(
            ["0:0", "0:1", "7:0", "7:1"],
            [line.split()[1] for line in self.on("slaves").splitlines()],
        )
        rows = json.loads(self.on("slaves", "--json"))
        self.assertEqual([0, 0, 7, 0], [row["alias"] for row in rows])
        self.assertEqual("Halcyon servo", rows[1]["name"])

    def test_a_line_may_be_in_a_file(self):
        (self.folder / "line.txt").write_text("coupler\ndigital_out bits=4\n")
        self.assertEqual(2, len(self.on("slaves", line="line.txt").splitlines()))

    def test_all_errors_of_a_line_have_their_place_and_warnings_are_no_errors(self):
        (self.folder / "wrong.line").write_text("coupler\nservoo\n\nservo axes=9 alias=x\n")
        said = self.refused("slaves", line="wrong.line").splitlines()
        self.assertEqual(
            [
                "hal ethercat slaves: wrong.line:2:1",
                "hal ethercat slaves: wrong.line:4:7",
                "hal ethercat slaves: wrong.line:4:14",
            ],
            [line.split(": unknown")[0].split(": invalid")[0] for line in said],
        )
        self.assertEqual(
            [
                "hal ethercat slaves: --emulate, device 1",
                "hal ethercat slaves: --emulate, device 3",
            ],
            [
                line.split(": unknown")[0].split(": invalid")[0]
                for line in self.refused("slaves", line="servoo, servo, servo axes=9").splitlines()
            ],
        )
        run = self.run_program("ethercat", "slaves", "--emulate", "servo alias=3, servo alias=3")
        self.assertEqual((0, 2), (run.returncode, len(run.stdout.splitlines())))
        self.assertEqual(
            "hal ethercat slaves: --emulate, device 2: warning: duplicate alias 3; give each device its own alias, unless the fault is wanted\n",
            run.stderr,
        )

    def test_a_missing_comma_is_named(self):
        self.assertEqual(
            "hal ethercat slaves: --emulate, device 1: 'digital_in' is a device of its own; write it on the next line, or after a comma; options of servo: "
            "axes dc modes motor alias serial\n",
            self.refused("slaves", line="servo digital_in"),
        )

    def test_start_up_writes_by_AoE_and_a_missing_link_are_reported_with_their_place(self):
        (self.folder / "aoe.ethercat").write_text(
            "[bus]\n[slave 0 x]\nvendor = 1\noutputs = none\ninputs = none\naoe 2001 port = 05\naoe 2001 = x\n"
        )
        said = self.bad("ethercat", "check", "aoe.ethercat")
        self.assertIn("aoe.ethercat:6:1: error: invalid aoe '2001 port' [ethercat-value]\n", said)
        self.assertIn("= help: write aoe 8000:1 1001 = 01 00\n", said)
        self.assertIn("aoe.ethercat:7:", said)
        (self.folder / "ethercat-conf.xml").write_text('<masters><master idx="0"/></masters>')
        (self.folder / "no-link.hal").write_text("loadrt lcec\n")
        checked = self.run_program("check", "no-link.hal")
        self.assertEqual((0, "no-link.hal: no errors\n"), (checked.returncode, checked.stderr))
        (self.folder / "no-link.hal").write_text("loadrt lcec\nstart\n")
        said = self.bad("sim", "no-link.hal")
        self.assertIn(
            "no-link.hal:1:8: error: 'lcec.0' (lcec) cannot start: link= is missing: ethercat-conf.xml has no interface, and no file ethercat.conf has MASTER0_DEVICE; "
            "write loadrt lcec link=eth:enp3s0, or link=sim:NAME for an emulated line; or MASTER0_DEVICE=\"enp3s0\" in an ethercat.conf beside 'ethercat-conf.xml' [start-failed]\n",
            said,
        )

    def test_a_check_reads_the_file_of_lcec_conf(self):
        (self.folder / "machine.xml").write_text(
            '<masters><master idx="0" appTimePeriod="1000000">\n'
            '<slave idx="0" type="EL1008" name="y"/></master></masters>'
        )
        (self.folder / "named.hal").write_text(
            "loadusr -W lcec_conf machine.xml\nloadrt lcec\nnet a lcec.0.y.din-77\n"
        )
        said = self.bad("check", "named.hal")
        self.assertNotIn("ethercat-conf.xml", said)
        self.assertIn("error: unknown pin 'lcec.0.y.din-77' [no-such-pin]\n", said)
        (self.folder / "named.hal").write_text("loadusr -W lcec_conf other.xml\nloadrt lcec\n")
        self.assertIn(
            "lcec_conf: cannot read file 'other.xml': No such file or directory",
            self.bad("check", "named.hal"),
        )

    def test_a_type_of_lcec_that_is_not_supported_can_be_assumed(self):
        (self.folder / "ethercat-conf.xml").write_text(
            '<masters><master idx="0" appTimePeriod="1000000">\n<slave idx="0" type="Ph3LM2RM" name="x"/>'
            '<slave idx="1" type="EL1008" name="y"/></master></masters>'
        )
        (self.folder / "unknown.hal").write_text(
            "loadrt lcec\nnet a lcec.0.x.keyboard\nnet b lcec.0.y.din-0\nnet c lcec.0.y.din-77\n"
        )
        said = self.bad("check", "unknown.hal")
        self.assertIn("error: lcec's driver 'Ph3LM2RM' is not supported [ethercat-slave]\n", said)
        self.assertIn("`hal check --assume lcec.0.x` checks the rest\n", said)
        said = self.bad("check", "--assume", "lcec.0.x", "unknown.hal")
        self.assertIn(
            "warning: lcec's driver 'Ph3LM2RM' is not supported: slave 'x' has no pins", said
        )
        self.assertIn("1 line depends on 'lcec.0.x', which is assumed to exist", said)
        self.assertIn("error: unknown pin 'lcec.0.y.din-77' [no-such-pin]\n", said)

    def test_states_requests_one_and_says_why_it_is_refused(self):
        self.assertEqual("0    INIT\n1    INIT\n2    INIT\n3    INIT\n", self.on("states"))
        self.assertEqual(
            "0    SAFE-OP\n1    SAFE-OP\n2    SAFE-OP\n3    SAFE-OP\n", self.on("states", "safe-op")
        )
        self.assertEqual(
            "0    INIT\n1    PRE-OP\n2    INIT\n3    INIT\n", self.on("states", "-p", 1, "PREOP")
        )
        self.assertEqual("0    OP\n1    OP\n", self.on("states", "OP", line="coupler, digital_in"))
        self.assertRegex(
            self.refused("states", "OP", line="servo"),
            r"^hal ethercat states: slave 0: OP not reached, it is in SAFE-OP: AL status code 0x001B \(sync manager watchdog\): ",
        )
        self.assertEqual(
            "hal ethercat states: unknown state 'run'; write INIT, PREOP, BOOT, SAFEOP or OP\n",
            self.refused("states", "run"),
        )

    def test_crc_lists_the_ports_in_use(self):
        self.assertTrue(self.on("crc").endswith("no port has counted errors of its own\n"))
        report = json.loads(self.on("crc", "--json"))
        self.assertEqual([], report["cables"])
        self.assertEqual(
            [(0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1), (3, 0)],
            [(p["position"], p["port"]) for p in report["ports"]],
        )


class Values(Ethercat):
    def test_objects(self):
        self.assertEqual("0x00020192 131474\n", self.on("upload", "-p", 1, "0x1000", 0))
        self.assertEqual(
            131474, json.loads(self.on("upload", "-p", 1, "0x1000", 0, "--json"))["value"]
        )
        self.assertIn(
            "0x1000:0 has 4 bytes, type uint16 has 2; --type selects another one",
            self.refused("upload", "-p", 1, "0x1000", 0, "--type", "uint16"),
        )
        self.on("download", "-p", 1, "0x6060", 0, 9)
        self.assertRegex(
            self.refused("download", "-p", 1, "0x1000", 0, 9),
            r"0x1000:0: SDO transfer aborted with code 0x06010002: ",
        )
        self.assertIn("choose one with -p 0 … -p 3", self.refused("upload", "0x1000", 0))

    def test_registers(self):
        self.assertEqual("0x01 0x00\n", self.on("reg-read", "-p", 1, "0x130"))
        self.assertEqual("", self.on("reg-write", "-p", 1, "0x10", 1, 2))
        self.assertEqual(
            2, json.loads(self.on("reg-write", "-p", 1, "0x10", 1, 2, "--json"))["written"]
        )
        self.assertIn("registers are 0..0xffff", self.refused("reg-write", "-p", 1, "0x10"))
        self.assertIn(
            "no slave at position 4; the bus has 4, the last one at position 3",
            self.refused("reg-read", "-p", 4, "0x130"),
        )

    def test_eeprom(self):
        image = bytes(
            int(word, 16)
            for word in json.loads(self.on("sii-read", "-p", 1, "--json"))["bytes"].split()
        )
        (self.folder / "servo.sii").write_bytes(image)
        self.assertEqual(
            "slave 1: 0 words written; it uses them after it was switched off and on\n",
            self.on("sii-write", "-p", 1, "servo.sii"),
        )
        (self.folder / "damaged.sii").write_bytes(bytes([image[0] ^ 1]) + image[1:])
        self.assertIn(
            "its checksum is wrong; nothing was written",
            self.refused("sii-write", "-p", 1, "damaged.sii"),
        )
        changed = bytearray(image)
        changed[0x1C] ^= 0x55  # the serial number
        (self.folder / "changed.sii").write_bytes(changed)
        self.assertEqual(
            1, json.loads(self.on("sii-write", "-p", 1, "changed.sii", "--json"))["words"]
        )

    def test_alias(self):
        self.assertEqual(
            "slave 1: alias 5, before 0; it has it after it was switched off and on\n",
            self.on("alias", "-p", 1, 5),
        )
        self.assertEqual(
            "hal ethercat alias: slave 2 has alias 7 already; choose another one\n",
            self.refused("alias", "-p", 1, 7),
        )


class Objects(Ethercat):
    def test_dictionary(self):
        text = self.on("sdos", "-p", 1)
        self.assertIn("0x1000 Device type\n  00  r-r-r-  UDINT    32 bit  Device type\n", text)
        objects = {o["index"]: o for o in json.loads(self.on("sdos", "-p", 1, "--json"))}
        self.assertEqual([0, 1, 2, 3, 4], [e["sub"] for e in objects[0x1018]["entries"]])
        self.assertIn("it does not list its objects", self.refused("sdos", "-p", 0))

    def test_files(self):
        self.assertEqual("gain = 1\n", self.on("foe-read", "-p", 3, "parameters"))
        (self.folder / "new.txt").write_text("gain = 2\n")
        self.assertEqual(
            "slave 3: 'parameters' written, 9 bytes\n",
            self.on("foe-write", "-p", 3, "new.txt", "parameters"),
        )
        self.assertEqual(
            "hal ethercat foe-read: slave 3: file 'none': the slave ends the transfer with FoE error 0x8001 (file not found)\n",
            self.refused("foe-read", "-p", 3, "none"),
        )
        self.assertEqual(
            "hal ethercat foe-read: slave 1: file 'none': mailbox error 0x0002 (protocol not supported); "
            "the protocols of the slave are in: hal ethercat xml\n",
            self.refused("foe-read", "-p", 1, "none"),
        )


class Configuration(Ethercat):
    def test_pdos(self):
        self.assertIn(
            "  1600 outputs, sync manager 2  Outputs axis 1\n    6040:0 UINT, 16 bit  Controlword\n",
            self.on("pdos"),
        )
        pdos = json.loads(self.on("pdos", "--json"))
        self.assertEqual(
            [0x6000] * 8, [e["index"] for p in pdos if p["position"] == 2 for e in p["entries"]]
        )

    def test_config_writes_files_that_run(self):
        line = "coupler, servo axes=2, digital_in bits=8 alias=7, digital_out, analog_in channels=4, analog_out, mailbox_device"
        said = self.on("config", "machine", line=line)
        self.assertEqual(
            "machine.ethercat and machine.hal written, 7 slaves; next: hal run machine.hal\n", said
        )
        self.assertIn(
            "'machine.ethercat' exists already", self.refused("config", "machine", line=line)
        )
        run = self.run_program("sim", "machine.hal", "--for", "5s")
        self.assertEqual(0, run.returncode, run.stderr)
        for number in range(7):
            self.assertRegex(
                run.stdout + run.stderr,
                rf"slave {number} \([-a-z]+\) is operational",
                "all slaves are in OP",
            )
        self.assertIn("no faults", run.stdout + run.stderr)
        self.assertIn(
            "machine.ethercat: sim:machine, cycle 1000 us, 7 slaves\n  in  u32   servo.axis-1-controlword  6040:0\n",
            self.good("ethercat", "check", "machine.ethercat"),
        )
        checked = json.loads(self.good("ethercat", "check", "machine.ethercat", "--json"))[0]
        self.assertEqual(7, checked["slaves"])
        self.assertEqual(
            {
                "name": "servo.axis-1-controlword",
                "type": "u32",
                "direction": "in",
                "owner": "servo",
                "index": 0x6040,
                "sub": 0,
            },
            checked["pins"][0],
        )
        lines = self.good("ethercat", "check", "machine.ethercat").splitlines()[1:]
        self.assertEqual(
            lines,
            [
                f"  {pin['direction']:4}{pin['type']:6}{pin['name']}  {pin['index']:04X}:{pin['sub']:X}"
                for pin in checked["pins"]
            ],
        )

    def test_config_from_descriptions_runs_on_emulated_devices(self):
        (self.folder / "drive.xml").write_text(
            (ROOT / "tests/unit/ethercat/data/servo.xml").read_text()
        )
        said = self.good(
            "ethercat", "config", "--esi", "drive.xml:SERVO-1, drive.xml:SERVO-1", "two"
        )
        self.assertEqual(
            "two.ethercat and two.hal written, 2 slaves; next: hal run two.hal\n",
            said,
        )
        text = (self.folder / "two.ethercat").read_text()
        self.assertIn(
            "[slave 1 servo-1-1]  # Servo drive\nesi      = drive.xml\ndevice   = SERVO-1\nvendor   = 0xCAFE\n",
            text,
        )
        run = self.run_program("sim", "two.hal", "--for", "3s")
        self.assertIn("slave 1 (servo-1-1) is operational", run.stdout + run.stderr)
        self.assertIn("no faults", run.stdout + run.stderr)
        (self.folder / "machine").mkdir()
        self.good("ethercat", "config", "--esi", "drive.xml:SERVO-1", "machine/one")
        self.assertIn(
            "esi      = ../drive.xml\n", (self.folder / "machine/one.ethercat").read_text()
        )
        run = self.run_program("sim", "machine/one.hal", "--for", "3s")
        self.assertIn("slave 0 (servo-1) is operational", run.stdout + run.stderr)
        self.good("ethercat", "config", "--esi", "drive.xml:0x402", "eth:enp3s0", "real")
        self.assertIn("link  = eth:enp3s0\n", (self.folder / "real.ethercat").read_text())
        self.assertNotIn("loadrt ethercat_segment", (self.folder / "real.hal").read_text())
        bad = lambda *words: self.bad("ethercat", "config", *words)
        self.assertEqual(
            "hal ethercat config: 'drive.xml' describes several devices; write drive.xml:NAME with one of: SERVO-1, DIO-8\n",
            bad("--esi", "drive.xml", "x"),
        )
        self.assertEqual(
            "hal ethercat config: cannot read 'none.xml': No such file or directory\n",
            bad("--esi", "none.xml", "x"),
        )
        self.assertEqual(
            "hal ethercat config: --esi and --emulate exclude each other\n",
            bad("--esi", "drive.xml", "--emulate", "servo", "x"),
        )
        self.assertEqual(
            "hal ethercat config: type: hal ethercat config --esi FILE.xml:DEVICE NAME, or eth:INTERFACE before NAME\n",
            bad("--esi", "drive.xml"),
        )

    def test_config_of_a_bus_takes_descriptions_of_a_folder(self):
        text = (ROOT / "tests/unit/ethercat/data/servo.xml").read_text()
        folder = self.folder / "makers"
        folder.mkdir()
        (folder / "drive.xml").write_text(text)
        (folder / "broken.xml").write_text("<EtherCATInfo><Vendor")
        line = "coupler, esi file=makers/drive.xml device=SERVO-1"
        said = self.good("ethercat", "config", "--emulate", line, "--descriptions", "makers", "bus")
        self.assertRegex(
            said,
            r"^makers/broken\.xml:1: [^\n]+; the file is skipped\n"
            r"slave 0 \(coupler\): process data as its EEPROM has it, because no file describes it\n"
            r"bus\.ethercat and bus\.hal written, 2 slaves; next: hal run bus\.hal\n$",
        )
        written = (self.folder / "bus.ethercat").read_text()
        self.assertIn(
            "[slave 1 servo-1]  # Servo drive\nesi      = makers/drive.xml\ndevice   = SERVO-1\n",
            written,
        )
        self.assertNotIn("[slave 0 coupler]  # coupler\nesi", written)
        run = self.run_program("sim", "bus.hal", "--for", "3s")
        self.assertIn("slave 1 (servo-1) is operational", run.stdout + run.stderr)
        # the same slave, a folder that has other revisions only
        newer = text.replace('RevisionNo="#x00010001"', 'RevisionNo="#x00090000"')
        (folder / "drive.xml").write_text(newer)
        (self.folder / "old.xml").write_text(text)
        summary = json.loads(
            self.good(
                "ethercat",
                "config",
                "--json",
                "--emulate",
                "esi file=old.xml device=SERVO-1",
                "--descriptions",
                "makers/drive.xml",
                "other",
            )
        )
        self.assertEqual(
            {
                "configuration": "other.ethercat",
                "netlist": "other.hal",
                "slaves": 1,
                "notes": [
                    "slave 0 (SERVO-1): process data as its EEPROM has it, because 'makers/drive.xml' "
                    "describes revision 0x00090000, not 0x00010001"
                ],
            },
            summary,
        )
        self.assertNotIn("esi ", (self.folder / "other.ethercat").read_text())
        bad = lambda *words: self.bad("ethercat", "config", "--emulate", "coupler", *words)
        (self.folder / "empty").mkdir()
        self.assertEqual(
            "hal ethercat config: 'empty' contains no files *.xml; name the folder of the descriptions (ESI)\n",
            bad("--descriptions", "empty", "x"),
        )
        self.assertEqual(
            "hal ethercat config: cannot read 'none': No such file or directory\n",
            bad("--descriptions", "none", "x"),
        )
        self.assertEqual(
            "hal ethercat config: --esi and --descriptions exclude each other\n",
            self.bad("ethercat", "config", "--esi", "old.xml", "--descriptions", "makers", "x"),
        )

    def test_names_with_blanks_commas_and_colons_survive_in_the_generated_files(self):
        text = (ROOT / "tests/unit/ethercat/data/servo.xml").read_text()
        device = text[text.index("<Device ") : text.index("</Device>") + len("</Device>")]
        newer = device.replace("SERVO-1<", "It's 1: a, b<")
        self.assertNotEqual(newer, device)
        path = "my drives, all: it's new.xml"
        (self.folder / path).write_text(text.replace(device, device + newer))
        item = "'" + path.replace("'", "''") + ":It''s 1: a, b'"
        self.good(
            "ethercat",
            "config",
            "--esi",
            f"{item}, '{path.replace(chr(39), chr(39) * 2)}:SERVO-1'",
            "odd",
        )
        self.assertIn(
            f"esi      = {path}\ndevice   = It's 1: a, b\n",
            (self.folder / "odd.ethercat").read_text(),
        )
        self.assertIn(
            "esi file='my drives, all: it''s new.xml' device='It''s 1: a, b', esi file='my drives, all: it''s new.xml' device=SERVO-1",
            (self.folder / "odd.hal").read_text(),
        )
        self.good("ethercat", "check", "odd.ethercat")
        run = self.run_program("sim", "odd.hal", "--for", "3s")
        self.assertIn("slave 1 (servo-1) is operational", run.stdout + run.stderr)
        self.assertIn("slave 0 (it-s-1-a-b) is operational", run.stdout + run.stderr)
        for bad in ("a #1.xml", 'a "b".xml', "$a.xml"):
            (self.folder / bad).write_text(text)
            self.assertIn(
                "rename the file", self.bad("ethercat", "config", "--esi", bad + ":SERVO-1", "x")
            )

    def test_a_described_device_does_what_its_description_says(self):
        (self.folder / "drive.xml").write_text(
            (ROOT / "tests/unit/ethercat/data/servo.xml").read_text()
        )
        line = "coupler, esi file=drive.xml device=SERVO-1 alias=9, esi file=drive.xml device=DIO-8"
        self.assertEqual(
            [(0xFFFFFF, 0), (0xCAFE, 9), (0xCAFE, 0)],
            [
                (row["vendor"], row["alias"])
                for row in json.loads(self.on("slaves", "--json", line=line))
            ],
        )
        self.assertEqual("0x01 1\n", self.on("upload", "-p", 1, "0x60c2", 1, line=line))
        self.on("download", "-p", 1, "0x60c2", 1, 2, line=line)
        self.assertIn(
            "code 0x06010002: attempt to write a read-only object",
            self.refused("download", "-p", 1, "0x6041", 0, 2, line=line),
        )
        self.assertIn("607A:0 DINT, 32 bit  Target position\n", self.on("pdos", line=line))
        (self.folder / "line.txt").write_text("coupler\nesi file=drive.xml device=none\n")
        self.assertEqual(
            "hal ethercat slaves: line.txt:2:1: 'drive.xml' does not describe a device 'none'; write device=NAME with one of: SERVO-1, DIO-8\n",
            self.refused("slaves", line="line.txt"),
        )
        for wrong, printed in (
            (
                "esi",
                "an esi device needs the description of its maker; write esi file=FILE.xml device=NAME, with the order code or product code "
                "of the device",
            ),
            (
                "esi file=none.xml",
                "cannot read 'none.xml': No such file or directory; write esi file=FILE.xml device=NAME, with the order code "
                "or product code of the device",
            ),
        ):
            self.assertEqual(
                f"hal ethercat slaves: --emulate, device 1: {printed}\n",
                self.refused("slaves", line=wrong),
            )

    def test_config_links_an_axis_to_each_drive(self):
        self.on("config", "drives", line="servo axes=2, servo, digital_out bits=16")
        text = (self.folder / "drives.ethercat").read_text()
        self.assertIn(
            "device  = cia402\naxes    = 2\noutputs = 6040, 6060, 607A, 60FF, 6071, 6840, 6860, 687A, 68FF, 6871\n",
            text,
        )
        self.assertIn("outputs = 7000:1..0x10 bit\n", text)
        (self.folder / "turn.hal").write_text(
            "source drives.hal\nadvance 1s\nsetp servo-axis-2.velocity-cmd 5000\nsetp servo-axis-1.enable TRUE\n"
            "setp servo-axis-2.enable TRUE\nsetp servo-1.enable TRUE\nadvance 2s\ngetp servo-axis-1.active\n"
            "getp servo-axis-1.position-fb\ngetp servo-axis-2.velocity-fb\ngetp servo-1.active\nshow fault\n"
        )
        run = self.run_program("sim", "turn.hal")
        self.assertEqual(
            (0, ["TRUE", "0", "5000", "TRUE", "no", "faults"]),
            (run.returncode, run.stdout.split()[:6]),
            run.stderr,
        )

    def test_plan_shows_the_arithmetic(self):
        self.on("config", "small", line="coupler, digital_in bits=8")
        plan = self.good("ethercat", "plan", "small.ethercat")
        self.assertIn(
            "2 frames, 120 bytes: (120 + 2 x 24) x 80 ns = 13.44 us at 100 Mbit/s\n", plan
        )
        report = json.loads(self.good("ethercat", "plan", "small.ethercat", "--json"))[0]
        self.assertEqual(
            (2, 120, 13440, True),
            (report["frames"], report["frame_bytes"], report["wire_ns"], report["fits"]),
        )
        self.assertEqual(
            [["NOP", "LRD"]],
            [[d["command"] for d in frame["datagrams"]] for frame in report["cyclic"]],
        )
        self.assertEqual({"cycles": [0], "frames": [0], "wire_ns": 13440}, report["slots"][0])
        text = (self.folder / "small.ethercat").read_text().replace("cycle = 1ms", "cycle = 50us")
        (self.folder / "fast.ethercat").write_text(text)
        self.assertIn(
            "fast.ethercat: the cycle is too short; raise `cycle`",
            self.bad("ethercat", "plan", "fast.ethercat"),
        )

    def test_plan_draws_the_timing(self):
        """The drawings beside the machines are what comes of their configurations."""
        for machine in ("ethercat-cnc/cnc", "ethercat-servo/servo"):
            file = ROOT / "halfiles" / f"{machine}.ethercat"
            self.assertEqual(
                (file.parent / "timing.svg").read_text(),
                self.good("ethercat", "plan", file, "--svg", "-"),
                f"make it anew: hal ethercat plan halfiles/{machine}.ethercat --svg halfiles/{machine.split('/')[0]}/timing.svg",
            )
        self.assertEqual(
            "",
            self.good(
                "ethercat", "plan", ROOT / "halfiles/ethercat-cnc/cnc.ethercat", "--svg", "cnc.svg"
            ),
        )
        texts = [
            t.text
            for t in ElementTree.parse(self.folder / "cnc.svg").iter(
                "{http://www.w3.org/2000/svg}text"
            )
        ]
        self.assertIn("SYNC0", texts)
        self.assertIn(
            "Wire load 2.2 %; shortest cycle 129.24 us; worst case from an input to the output that answers it 3000 us.",
            texts,
        )
        self.assertEqual(
            "hal ethercat plan: --json and --svg exclude each other\n",
            self.bad(
                "ethercat",
                "plan",
                ROOT / "halfiles/ethercat-cnc/cnc.ethercat",
                "--svg",
                "x.svg",
                "--json",
            ),
        )

    def test_check_reports_the_place(self):
        (self.folder / "wrong.ethercat").write_text("[bus]\nspeed = 3\n")
        self.assertIn("wrong.ethercat:2:", self.bad("ethercat", "check", "wrong.ethercat"))
        self.assertIn("cannot read 'none.ethercat'", self.bad("ethercat", "plan", "none.ethercat"))

    def test_dump_reads_a_capture(self):
        datagram = lambda command, address, data, wkc, more=False: (
            bytes([command, 0])
            + address.to_bytes(4, "little")
            + (len(data) | more << 15).to_bytes(2, "little")
            + bytes(2)
            + data
            + wkc.to_bytes(2, "little")
        )

        def frame(*datagrams, returned=True):
            body = b"".join(datagrams)
            return (
                bytes([255] * 6 + [2 if returned else 0, 0, 0, 0, 0, 1, 0x88, 0xA4])
                + (len(body) | 0x1000).to_bytes(2, "little")
                + body
                + bytes(max(0, 44 - len(body)))
            )

        upload = bytes([10, 0, 0, 0, 0, 0x23, 0, 0x20, 0x40, 0x41, 0x60, 0]) + bytes(20)
        frames = [
            frame(datagram(1, 0xFFFF | 0x0130 << 16, bytes(6), 0), returned=False),
            frame(
                datagram(4, 0x1001 | 0x0130 << 16, bytes([0x14, 0, 0, 0, 0x1B, 0]), 1, more=True),
                datagram(12, 0x10000, bytes(range(20)), 3),
            ),
            frame(datagram(5, 0x1001 | 0x1000 << 16, upload, 1)),
            bytes([255] * 12 + [8, 0]) + bytes(46),
            frame(datagram(4, 0x1001, bytes(4), 1))[:30],
        ]
        pcap = (
            (0xA1B2C3D4).to_bytes(4, "little")
            + bytes([2, 0, 4, 0])
            + bytes(8)
            + (65535).to_bytes(4, "little")
            + (1).to_bytes(4, "little")
        )
        for n, f in enumerate(frames):
            pcap += b"".join(v.to_bytes(4, "little") for v in (1000, n * 250, len(f), len(f))) + f
        (self.folder / "bus.pcap").write_bytes(pcap)
        self.assertEqual(
            "    0.000000  ->  APRD slave 1 0130  [6] 00 00 00 00 00 00  WKC 0  AL status: none\n"
            "    0.000250  <-  FPRD station 0x1001 0130  [6] 14 00 00 00 1B 00  WKC 1  AL status: SAFE-OP, error 0x001B, sync manager watchdog\n"
            "    0.000250  <-  LRW  logical 0x00010000  [20] 00 01 02 03 04 05 06 07 08 09 0A 0B 0C 0D 0E 0F …  WKC 3\n"
            "    0.000500  <-  FPWR station 0x1001 1000  [32] 0A 00 00 00 00 23 00 20 40 41 60 00 00 00 00 00 …  WKC 1  CoE SDO upload 0x6041:0\n"
            "    0.001000  malformed frame of 30 bytes\n",
            self.good("ethercat", "dump", "bus.pcap"),
        )
        rows = [
            json.loads(line)
            for line in self.good(
                "ethercat", "dump", "bus.pcap", "--json", "--filter", "coe"
            ).splitlines()
            if line.startswith("{")
        ]
        self.assertEqual(
            [("FPWR", 0x1000, "CoE SDO upload 0x6041:0", True)],
            [(r["command"], r["register"], r["meaning"], r["returned"]) for r in rows],
        )
        self.assertEqual(1, self.good("ethercat", "dump", "bus.pcap", "-n", "1").count("\n"))
        (self.folder / "none.pcap").write_bytes(
            pcap[:24]
            + b"".join(v.to_bytes(4, "little") for v in (1, 0, len(frames[3]), len(frames[3])))
            + frames[3]
        )
        self.assertEqual(
            "hal ethercat dump: none.pcap: none of its 1 frames is an EtherCAT frame\n",
            self.bad("ethercat", "dump", "none.pcap"),
        )
        self.assertIn(
            "'sim:x' is a segment in memory, which belongs to another process",
            self.bad("ethercat", "dump", "sim:x"),
        )

    def test_xml_is_a_description_that_a_configuration_can_use(self):
        text = self.on("xml", "-p", 1)
        device = ElementTree.fromstring(text).find("Descriptions/Devices/Device")
        self.assertEqual(
            [f"#x{index:x}" for first in (0x1600, 0x1610) for index in range(first, first + 4)],
            [pdo.findtext("Index") for pdo in device.findall("RxPdo")],
        )
        self.assertEqual(text, json.loads(self.on("xml", "-p", 1, "--json"))["xml"])
        (self.folder / "servo.xml").write_text(text)
        (self.folder / "servo.ethercat").write_text(
            "[bus]\nlink = sim:line\n[slave 0 x]\nesi = servo.xml\n"
        )
        self.assertIn(
            "  in  u32   x.controlword  6040:0\n", self.good("ethercat", "check", "servo.ethercat")
        )

    def test_graph_is_a_picture_with_all_slaves(self):
        boxes = ElementTree.fromstring(self.on("graph")).findall("{http://www.w3.org/2000/svg}rect")
        self.assertEqual(4, len(boxes))
        self.assertEqual(4, json.loads(self.on("graph", "--json"))["svg"].count("<rect"))

    def test_dc(self):
        self.assertEqual(
            "1  deviation 0 ns  delay 0 ns  SYNC off  Halcyon servo", self.on("dc").splitlines()[1]
        )
        rows = json.loads(self.on("dc", "--json"))
        self.assertEqual([0, 1, 2, 3], [row["position"] for row in rows])
        self.assertEqual(
            [None, 0, None], [row["deviation_ns"] for row in rows[:3]], "null: without a clock"
        )


class Interface(Ethercat):
    def test_without_slaves_and_without_link(self):
        if os.environ.get(VARIABLE) != "1":
            self.skipTest("no network namespaces here")
        subprocess.run(
            "ip link add left type veth peer name right && ip link set left up;"
            # the kernel notices a missing carrier a little later
            " until ip -oneline link show left | grep -q LOWERLAYERDOWN; do sleep 0.01; done",
            shell=True,
            check=True,
            timeout=20,
        )
        self.assertEqual(
            "hal ethercat scan: eth:left has no link; check the cable and the supply of the first slave\n",
            self.bad("ethercat", "scan", "eth:left"),
        )
        subprocess.run("ip link set right up", shell=True, check=True)
        self.assertEqual(
            "hal ethercat scan: no slave responds on eth:left; check cable and supply, and that it is the right interface\n",
            self.bad("ethercat", "scan", "eth:left"),
        )


class Wrong(Ethercat):
    def test_no_bus(self):
        self.assertEqual(
            'hal ethercat scan: missing address: type eth:INTERFACE, or --emulate "coupler, servo" to try it without hardware\n',
            self.bad("ethercat", "scan"),
        )
        self.assertIn("is a segment in memory", self.bad("ethercat", "scan", "sim:line"))
        self.assertIn("--emulate, device 1: ", self.refused("scan", line="toaster"))


if __name__ == "__main__":
    if (
        "\n  ethercat "
        not in subprocess.run([HAL, "help"], stdout=subprocess.PIPE, text=True, check=True).stdout
    ):
        sys.exit(77)  # built without EtherCAT
    own_network()
    unittest.main()
