# SPDX-License-Identifier: MIT
# packages: canopen
"""hal can sdo, pdo and lss: a simulated node on udp: is asked and set up by hand."""

import csv
import json
import os
import random
import re
import signal
import subprocess
import unittest

from harness import HAL, TIMEOUT, Case, Terminal, wait_until


class Node(Case):
    IDENTIFIER = "5"

    def setUp(self):
        super().setUp()
        place = random.Random(os.urandom(8))  # tests run side by side: each has its own bus
        self.bus = f"udp:239.{place.randrange(1, 255)}.{place.randrange(256)}.{place.randrange(1, 255)}%lo:{place.randrange(20000, 60000)}"
        self.write("io.eds", self.run_program("node", "io", "--eds", *self.SIZE).stdout)
        self.start_node()

    SIZE = ("--inputs", "16", "--outputs", "16", "--analog-inputs", "2", "--analog-outputs", "2")

    def start_node(self):
        node = self.start_logged(
            "node", "io", "--link", self.bus, "--id", self.IDENTIFIER, *self.SIZE
        )
        self.addCleanup(self.end, node)
        wait_until(lambda: self.ready(), "the node answers")

    def ready(self):
        return (
            self.run_program(
                "can", "sdo", "read", self.bus, "5", "1000", "--timeout", "100ms"
            ).returncode
            == 0
        )

    def can(self, *words):
        return self.good("can", *words)

    def bad_can(self, *words):
        return self.bad("can", *words)

    def end(self, process, number=signal.SIGTERM):
        if process.poll() is None:
            process.send_signal(number)
        process.wait(timeout=TIMEOUT)


class Sdo(Node):
    def read(self, *words):
        return self.can("sdo", "read", self.bus, "5", *words)

    def test_values_in_their_types(self):
        self.assertEqual(
            "1001:0 = 0x00 (0)\n1018:4 = 0x00000001 (1)\n", self.read("1001", "1018:4")
        )
        self.can("sdo", "write", self.bus, "5", "6411:1", "-300", "--type", "i16")
        self.assertEqual("6411:1 = 0xFED4 (65236, or -300)\n", self.read("6411:1"))
        self.assertEqual("6411:1 = -300 (0xFED4)\n", self.read("6411:1", "--type", "i16"))
        self.assertEqual(
            "6411:1 Write analogue output 16-bit, Analogue output 1 = -300 (0xFED4)\n",
            self.read("6411:1", "--eds", "io.eds"),
        )
        self.assertEqual(
            "6411:1 = D4 FE (2 bytes; u32 has 4)\n", self.read("6411:1", "--type", "u32")
        )
        self.can("sdo", "write", self.bus, "5", "6411:1", "-301")
        self.assertEqual("6411:1 = -301 (0xFED3)\n", self.read("6411:1", "--type", "i16"))
        self.can(
            "sdo", "write", self.bus, "5", "0x6200:2", "0x5A"
        )  # with the length that the node reports
        self.assertEqual("6200:2 = 0x5A (90)\n", self.read("6200sub2"))
        self.assertRegex(self.read("1008"), r'^1008:0 = "[^"]+" \(\d+ bytes\)\n$')

    def test_names_of_the_eds(self):
        self.assertEqual(
            "1018:4 Identity object, Serial number = 0x00000001 (1)\n",
            self.read("serial-number", "--eds", "io.eds"),
        )
        self.can(
            "sdo",
            "write",
            self.bus,
            "5",
            "Write output 8-bit/Output block 1",
            "17",
            "--eds",
            "io.eds",
        )
        self.assertEqual("6200:1 = 0x11 (17)\n", self.read("6200:1"))
        self.assertEqual(
            "hal can sdo read: unknown object 'serial-nomber' in io.eds; did you mean 'serial-number'?\n",
            self.bad_can("sdo", "read", self.bus, "5", "serial-nomber", "--eds", "io.eds"),
        )
        self.assertRegex(
            self.bad_can("sdo", "read", self.bus, "5", "event timer", "--eds", "io.eds"),
            r"^hal can sdo read: ambiguous name 'event timer' of \d+ objects \(1400:5, 1401:5, .*; write the index, such as 1400:5\n$",
        )
        self.assertEqual(
            "hal can sdo read: invalid object 'serial'; write INDEX or INDEX:SUB in hex, such as 6041 or 1018:1, or add --eds FILE for names\n",
            self.bad_can("sdo", "read", self.bus, "5", "serial"),
        )

    def test_for_programs(self):
        self.assertEqual(
            {
                "node": 5,
                "index": 0x1018,
                "sub": 4,
                "name": "Identity object, Serial number",
                "type": "u32",
                "value": 1,
                "bytes": 4,
                "data": "01000000",
            },
            json.loads(self.read("1018:4", "--eds", "io.eds", "--json")),
        )
        name = json.loads(self.read("1008", "--eds", "io.eds", "--json"))
        self.assertEqual(name["data"], name["value"].encode().hex().upper())
        self.read("1008", "-o", "name.bin")
        self.assertEqual(name["value"].encode(), (self.folder / "name.bin").read_bytes())
        for how in ("--block", "--segmented"):
            self.assertEqual(
                name["value"],
                json.loads(self.read("1008", how, "--json", "--eds", "io.eds"))["value"],
            )

    def test_options_without_effect_are_errors(self):
        for how in (["--json"], ["--type", "u8"]):
            self.assertEqual(
                f"hal can sdo read: {how[0]} has no effect with -o, which writes the bytes as they are; delete one of them\n",
                self.bad_can("sdo", "read", self.bus, "5", "1008", "-o", "name.bin", *how),
            )
        self.assertEqual(
            "hal can generate: --seed has no effect with --counting and --length: nothing is random; delete one of them\n",
            self.bad("can", "generate", self.bus, "--counting", "--length", 2, "--seed", 1),
        )
        self.assertEqual(
            "hal can gateway: --connect is for a client; --identity, --vendor-name, --product-name and --order-code are for the gateway\n",
            self.bad("can", "gateway", "--connect", "127.0.0.1:1", "--vendor-name", "X", "help"),
        )

    def test_aborts_say_what_to_do(self):
        sdo = ("sdo", "read", self.bus, "5")
        self.assertEqual(
            "hal can sdo read: node 5, 2FFF:0: object does not exist in the object dictionary (0x06020000); see the EDS of the device for its objects\n",
            self.bad_can(*sdo, "2fff"),
        )
        self.assertEqual(
            "hal can sdo read: node 5, 1018:9: sub-index does not exist (0x06090011); sub-index 0 is the highest sub-index of the object\n",
            self.bad_can(*sdo, "1018:9"),
        )
        self.assertEqual(
            "hal can sdo write: node 5, 1000:0: attempt to write a read-only object (0x06010002); the object is read-only\n",
            self.bad_can("sdo", "write", self.bus, "5", "1000", "1"),
        )
        self.assertIn(
            "(0x06070012); the object has another length: add --type, such as u16 or i32\n",
            self.bad_can("sdo", "write", self.bus, "5", "1017", "1", "--type", "u32"),
        )
        self.assertEqual(
            f"hal can sdo read: node 9 did not respond within 0.15 s (object 1000:0); the bus is active; to list the nodes: hal can scan {self.bus}\n",
            self.bad_can("sdo", "read", self.bus, "9", "1000", "--timeout", "50ms"),
        )

    def test_wrong_words(self):
        sdo = ("sdo", "write", self.bus, "5", "1017")
        self.assertEqual(
            "hal can sdo write: '70000' does not fit into UNSIGNED16 (0..65535)\n",
            self.bad_can(*sdo, "70000", "--eds", "io.eds"),
        )
        self.assertEqual(
            "hal can sdo write: '010' would be octal; write it without the 0 in front, or 0x…\n",
            self.bad_can(*sdo, "010", "--type", "u16"),
        )
        self.assertEqual(
            "hal can sdo write: '-1' does not fit into UNSIGNED16 (0..65535)\n",
            self.bad_can(*sdo, "-1", "--type", "u16"),
        )
        self.assertEqual(
            "hal can sdo write: '40000' does not fit into INTEGER16 (-32768..32767)\n",
            self.bad_can("sdo", "write", self.bus, "5", "6411:1", "40000", "--type", "i16"),
        )
        self.assertIn(
            "invalid --type 'u17'; write one of: bool, i8", self.bad_can(*sdo, "1", "--type", "u17")
        )
        self.assertEqual(
            "hal can sdo write: invalid node '200'; write 1..127\n",
            self.bad_can("sdo", "write", self.bus, "200", "1017", "1"),
        )
        self.assertEqual(
            "hal can sdo write: cannot read 'none.bin': No such file or directory\n",
            self.bad_can(*sdo, "--from", "none.bin"),
        )
        self.assertEqual(
            "hal can sdo write: expected one value; type: hal can sdo write ADDRESS NODE OBJECT VALUE, or --from FILE in place of VALUE\n",
            self.bad_can(*sdo),
        )
        self.assertEqual(
            "hal can sdo write: --block and --segmented exclude each other\n",
            self.bad_can(*sdo, "1", "--block", "--segmented"),
        )
        self.assertEqual(
            "hal can sdo read: 'node.log' is not a valid device description; for the problems type: hal can eds check node.log\n",
            self.bad_can("sdo", "read", self.bus, "5", "1000", "--eds", "node.log"),
        )


class ReadAll(Node):
    def test_every_object_also_read_only_ones_and_what_refuses(self):
        eds = (self.folder / "io.eds").read_text()
        self.write(
            "more.eds",
            eds.replace("ParameterName=Serial number", "ParameterName=Serial, number")
            + "\n[2FF0]\nParameterName=Absent\nObjectType=0x7\nDataType=0x0007\nAccessType=ro\nPDOMapping=0\n".replace(
                "Absent", "Not in the device"
            ),
        )
        listed = re.sub(
            r"(?s)(\[ManufacturerObjects\]\s*\nSupportedObjects=)(\d+)",
            lambda m: f"{m[1]}{int(m[2]) + 1}\n{int(m[2]) + 1}=0x2FF0",
            (self.folder / "more.eds").read_text(),
        )
        self.write("more.eds", listed)
        done = self.run_program("can", "read-all", self.bus, "5", "--eds", "more.eds")
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertIn("1018:4 Identity object, Serial, number = 0x00000001 (1)\n", done.stdout)
        self.assertIn("1000:0 Device type = ", done.stdout)
        self.assertIn(
            "2FF0:0 Not in the device: rejected: object does not exist in the object dictionary (0x06020000)\n",
            done.stdout,
        )
        self.assertRegex(done.stderr, r"^\d+ objects of node 5 read, 1 rejected, \d+ write-only\n$")
        self.assertRegex(
            self.can("read-all", self.bus, "5", "--eds", "more.eds", "-o", "all.csv"),
            r"^all\.csv: \d+ objects of node 5 read, 1 rejected",
        )
        with open(self.folder / "all.csv", newline="") as file:
            rows = {(row["index"], row["sub"]): row for row in csv.DictReader(file)}
        self.assertEqual(
            ("Identity object, Serial, number", "u32", "ro", "1", "01000000", ""),
            tuple(
                rows["0x1018", "4"][key]
                for key in ("name", "type", "access", "value", "data", "reason")
            ),
        )
        self.assertEqual(
            ("", "", "object does not exist in the object dictionary (0x06020000)"),
            tuple(rows["0x2FF0", "0"][key] for key in ("value", "data", "reason")),
        )
        lines = [
            json.loads(line)
            for line in self.run_program(
                "can", "read-all", self.bus, "5", "--eds", "more.eds", "--json"
            ).stdout.splitlines()
        ]
        self.assertEqual(len(rows), len(lines))

    def test_wrong_words(self):
        self.assertEqual(
            "hal can read-all: missing --eds FILE: the description lists the objects of the node\n",
            self.bad_can("read-all", self.bus, "5"),
        )
        self.assertIn(
            "hal can read-all: node 9 did not respond within ",
            self.bad_can("read-all", self.bus, "9", "--eds", "io.eds", "--timeout", "50ms"),
        )


class Dcf(Node):
    def dcf(self, *words):
        return self.run_program("can", "dcf", "write", self.bus, "5", "io.dcf", *words)

    def test_settings_are_kept_and_put_back(self):
        self.can("sdo", "write", self.bus, "5", "6207:1", "0x0f", "--type", "u8")
        self.can(
            "pdo",
            "map",
            self.bus,
            "5",
            "tpdo2",
            "6401:2",
            "--transmission",
            "3",
            "--inhibit",
            "5ms",
        )
        self.assertRegex(
            self.can("dcf", "read", self.bus, "5", "--eds", "io.eds", "-o", "io.dcf"),
            r"^io\.dcf: \d+ settings of node 5\n$",
        )
        self.assertRegex(
            self.run_program("can", "eds", "check", "io.dcf").stderr,
            r"^io\.dcf: configuration of node 5; .*; 0 warnings, 0 notes\n$",
        )
        text = (self.folder / "io.dcf").read_text()
        self.assertTrue(
            "ParameterValue=$NODEID+0x00000180\n" in text,
            "a default value of the EDS suits another node, too",
        )
        self.assertTrue("\nNodeID=5\n" in text)
        self.assertFalse(
            re.search(r"\[6411sub1\][^[]*ParameterValue", text),
            "an object that moves the device is not a setting",
        )
        done = self.dcf("--check")
        self.assertRegex(done.stdout, r"^node 5: 0 of \d+ settings differ\n$")
        self.assertEqual((0, ""), (done.returncode, done.stderr))
        self.write("moves.dcf", text.replace("[6411sub1]\n", "[6411sub1]\nParameterValue=5\n"))
        done = self.run_program("can", "dcf", "write", self.bus, "5", "moves.dcf", "--check")
        self.assertEqual(
            "hal can dcf write: skipped: 6411:1 Write analogue output 16-bit, Analogue output 1: it moves the device\n",
            done.stderr,
        )
        self.write("other.dcf", text.replace("\nNodeID=5\n", "\nNodeID=6\n"))
        other = ("can", "dcf", "write", self.bus, "5", "other.dcf", "--check")
        self.assertEqual(
            "hal can dcf write: 'other.dcf' does not fit: it is for node 6, not for node 5; to write it all the same, add --other-node\n",
            self.bad(*other),
        )
        self.assertRegex(self.good(*other, "--other-node"), r"^node 5: 0 of \d+ settings differ\n$")
        self.write("rate.dcf", re.sub(r"\nBaudrate=\d+", "\nBaudrate=250", text))
        rate = ("can", "dcf", "write", self.bus + "?bitrate=500k", "5", "rate.dcf", "--check")
        self.assertEqual(
            "hal can dcf write: 'rate.dcf' does not fit: it is for a bus of 250 kbit/s, not of 500 kbit/s; to write it all the same, "
            "add --other-node\n",
            self.bad(*rate),
        )
        self.assertRegex(self.good(*rate, "--other-node"), r"^node 5: 0 of \d+ settings differ\n$")
        # its replacement knows nothing of it
        self.can("sdo", "write", self.bus, "5", "6207:1", "0", "--type", "u8")
        self.can(
            "pdo",
            "map",
            self.bus,
            "5",
            "tpdo2",
            "6401:1",
            "6401:2",
            "--transmission",
            "255",
            "--inhibit",
            "0ms",
        )
        done = self.dcf("--check")
        self.assertEqual(1, done.returncode)
        self.assertIn(
            "6207:1 Error value output 8-bit, Output block 1 is 0x00 (0), the file has 0x0F (15)\n",
            done.stdout,
        )
        self.assertRegex(done.stdout, r"\nnode 5: 5 of \d+ settings differ\n$")
        done = self.dcf()
        self.assertEqual((0, ""), (done.returncode, done.stderr))
        self.assertRegex(
            done.stdout,
            r"\nnode 5: 5 of \d+ settings differed and were written\n"
            r"not stored: they are lost at power-off; to store them: hal can sdo write \S+ 5 1010:1 0x65766173 --type u32\n$",
        )
        self.assertRegex(self.dcf("--check").stdout, r"^node 5: 0 of \d+ settings differ\n$")
        shown = {
            p["pdo"]: p
            for p in map(json.loads, self.can("pdo", "show", self.bus, "5", "--json").splitlines())
        }
        self.assertEqual(
            (True, [(0x6401, 2, 16)]),
            (
                shown["TPDO2"]["on"],
                [(m["index"], m["sub"], m["bits"]) for m in shown["TPDO2"]["mapping"]],
            ),
        )

    def test_every_command_prints_what_makes_its_description_unreliable(self):
        eds = (self.folder / "io.eds").read_bytes().decode()
        self.assertIn("SubNumber=", eds)
        place = eds.index("SubNumber=")
        line = eds[:place].count("\n") + 1
        damaged = eds[:place] + "SubNumber=2O" + eds[eds.index("\n", place) :]
        (self.folder / "damaged.eds").write_bytes(damaged.encode())
        for words in (
            ["sdo", "read", self.bus, "5", "1000"],
            ["sdo", "write", self.bus, "5", "1017", "0", "--type", "u16"],
            ["pdo", "show", self.bus, "5"],
            ["read-all", self.bus, "5"],
        ):
            done = self.run_program("can", *words, "--eds", "damaged.eds")
            self.assertRegex(
                done.stderr,
                rf"(?m)^hal can [a-z -]+: damaged\.eds:{line}: 'SubNumber' of \[\w+\] is not a number: '2O'; ",
                words,
            )
            self.assertEqual(1, done.stderr.count("'2O'"), words)

    def test_an_unreliable_file_is_rejected(self):
        self.can("sdo", "write", self.bus, "5", "1017", "5000", "--type", "u16")
        self.can("dcf", "read", self.bus, "5", "--eds", "io.eds", "-o", "io.dcf")
        text = (self.folder / "io.dcf").read_bytes().decode()
        self.assertEqual(1, text.count("ParameterValue=0x1388"))
        line = text[: text.index("ParameterValue=0x1388")].count("\n") + 1

        def rejected(name, content, *words):
            (self.folder / name).write_bytes(content.encode())
            done = self.run_program("can", "dcf", "write", self.bus, "5", name, *words)
            self.assertEqual(1, done.returncode)
            return done

        cut = text[: text.index("0x1388") + 4]
        done = rejected("cut.dcf", cut)
        self.assertEqual("", done.stdout)
        self.assertRegex(
            done.stderr,
            r"^hal can dcf write: cut.dcf:\d+: object \w{4} is listed but not described; missing section \[\w{4}\]\n"
            r"(.*\n){2}"
            r"hal can dcf write: \d+ more; list them with: hal can eds check cut.dcf\n"
            r"hal can dcf write: 'cut.dcf' is not reliable: no setting was written; correct the file, or create it again: hal can dcf read\n$",
        )
        self.assertIn(
            f"cut.dcf:{line}:1: warning: the file ends within a line: the value of 'ParameterValue' may be cut [eds-syntax]\n",
            self.run_program("can", "eds", "check", "cut.dcf").stderr,
        )
        again = "\r\n[1017]\r\nParameterValue=0x20\r\n"
        done = rejected("twice.dcf", text + again, "--check")
        last = (text + again).count("\n")
        self.assertEqual(
            f"hal can dcf write: twice.dcf:{last}: duplicate key 'ParameterValue' in [1017]; line {line} has '0x1388'; '0x20' is used\n"
            "hal can dcf write: 'twice.dcf' is not reliable: no setting was compared; correct the file, or create it again: hal can dcf read\n",
            done.stderr,
        )
        for value in ("70000", "abc", "100.5"):
            bad = text.replace("ParameterValue=0x1388", "ParameterValue=" + value)
            done = rejected("bad.dcf", bad)
            self.assertRegex(
                done.stderr,
                r"^hal can dcf write: bad\.dcf:\d+: the value of 1017sub0 is not configured: "
                rf".*; correct ParameterValue={value}\n"
                r"hal can dcf write: 'bad.dcf' has invalid values: no setting was written; correct them in the file\n$",
            )
            self.assertEqual("", done.stdout)
            done = rejected("bad.dcf", bad, "--check")
            self.assertRegex(done.stdout, r"^node 5: 0 of \d+ settings differ\n$")
        self.assertRegex(self.dcf("--check").stdout, r"^node 5: 0 of \d+ settings differ\n$")

    def test_a_cut_description_has_nothing_to_read(self):
        eds = (self.folder / "io.eds").read_bytes()[:500]
        (self.folder / "cut.eds").write_bytes(eds)
        for words in (("dcf", "read"), ("read-all",)):
            self.assertRegex(
                self.bad_can(*words, self.bus, "5", "--eds", "cut.eds"),
                r"^(hal can .*\n)*hal can [a-z -]+: 'cut.eds' describes no object: nothing to read; give the whole EDS of the device\n$",
            )

    def test_wrong_words(self):
        self.assertEqual(
            "hal can dcf read: missing --eds FILE: the description lists the objects of the node\n",
            self.bad_can("dcf", "read", self.bus, "5"),
        )
        self.assertEqual(
            "hal can dcf read: expected ADDRESS NODE; type: hal can dcf read ADDRESS NODE --eds FILE -o NODE.dcf\n",
            self.bad_can("dcf", "read", self.bus, "--eds", "io.eds"),
        )
        self.assertEqual(
            "hal can dcf write: expected ADDRESS NODE FILE; type: hal can dcf write ADDRESS NODE FILE.dcf\n",
            self.bad_can("dcf", "write", self.bus, "5"),
        )
        self.assertEqual(
            "hal can dcf write: cannot read 'none.dcf': No such file or directory\n",
            self.bad_can("dcf", "write", self.bus, "5", "none.dcf"),
        )
        self.assertEqual(
            "hal can dcf write: 'io.eds' has no settings: no ParameterValue to write; to create such a file: hal can dcf read\n",
            self.bad_can("dcf", "write", self.bus, "5", "io.eds"),
        )
        self.assertEqual(
            f"hal can dcf read: node 9 did not respond within 0.15 s (object 1005:0 COB-ID SYNC); the bus is active; "
            f"to list the nodes: hal can scan {self.bus}\n",
            self.bad_can("dcf", "read", self.bus, "9", "--eds", "io.eds", "--timeout", "50ms"),
        )


class Pdo(Node):
    def shown(self):
        return {
            p["pdo"]: p
            for p in map(json.loads, self.can("pdo", "show", self.bus, "5", "--json").splitlines())
        }

    def test_show(self):
        text = self.can("pdo", "show", self.bus, "5", "--eds", "io.eds")
        self.assertIn(
            "RPDO1        205  at once\n                  6200:1/8   Write output 8-bit, Output block 1\n"
            "                  6200:2/8   Write output 8-bit, Output block 2\n",
            text,
        )
        pdos = self.shown()
        self.assertEqual(
            [(0x6000, 1, 8), (0x6000, 2, 8)],
            [(m["index"], m["sub"], m["bits"]) for m in pdos["TPDO1"]["mapping"]],
        )
        self.assertEqual((True, 0x185), (pdos["TPDO1"]["on"], pdos["TPDO1"]["id"]))

    def test_map_and_switch(self):
        text = self.can(
            "pdo",
            "map",
            self.bus,
            "5",
            "tpdo1",
            "6401:1",
            "6000:2/8",
            "--transmission",
            "3",
            "--inhibit",
            "5ms",
            "--event",
            "2s",
        )
        self.assertEqual(
            "TPDO1        185  every 3 SYNCs, inhibit time 5 ms or after 2000 ms\n                  6401:1/16\n                  6000:2/8\n",
            text,
        )
        self.can("pdo", "disable", self.bus, "5", "tpdo1")
        self.assertFalse(self.shown()["TPDO1"]["on"])
        self.can("pdo", "enable", self.bus, "5", "tpdo1")
        self.assertTrue(self.shown()["TPDO1"]["on"])
        self.can("pdo", "map", self.bus, "5", "tpdo1", "--id", "1A5")  # the mapping stays
        self.assertEqual(
            (0x1A5, 2), (self.shown()["TPDO1"]["id"], len(self.shown()["TPDO1"]["mapping"]))
        )

    def test_a_mapping_rejected_by_the_node_leaves_the_old_one(self):
        before = self.shown()["RPDO1"]
        self.assertEqual(
            "hal can pdo map: node 5, 1600:2 (to map 6000:1/8): object cannot be mapped to a PDO (0x06040041); mappable objects "
            "have PDOMapping=1 in the EDS of the device\nhal can pdo map: RPDO1 restored\n",
            self.bad_can("pdo", "map", self.bus, "5", "rpdo1", "6200:1", "6000:1"),
        )
        self.assertEqual(before, self.shown()["RPDO1"])

    def test_wrong_words(self):
        self.assertEqual(
            "hal can pdo map: mapping too long: 72 bits, a PDO holds 64; map 8 bits less, or use a second PDO\n",
            self.bad_can("pdo", "map", self.bus, "5", "tpdo1", "1000/32", "1018:1/32", "6000:1"),
        )
        self.assertEqual(
            "hal can pdo disable: invalid PDO 'pdo1'; write rpdo1 to rpdo512 or tpdo1 to tpdo512\n",
            self.bad_can("pdo", "disable", self.bus, "5", "pdo1"),
        )
        self.assertEqual(
            f"hal can pdo enable: node 5 has no TPDO77; to list its PDOs: hal can pdo show {self.bus} 5\n",
            self.bad_can("pdo", "enable", self.bus, "5", "tpdo77"),
        )
        self.assertEqual(
            "hal can pdo map: RPDO1 has no inhibit time\n",
            self.bad_can("pdo", "map", self.bus, "5", "rpdo1", "--inhibit", "5ms"),
        )

    def test_watch(self):
        watch = subprocess.Popen(
            ["hal", "can", "pdo", "watch", self.bus, "5", "--eds", "io.eds", "-n", "2"],
            executable=str(HAL),
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(Case.end, self, watch)
        self.assertIn("listening on", watch.stderr.readline())
        self.can("send", self.bus, "205#1122", "305#2CFE0100")
        out, _ = watch.communicate(timeout=2 * TIMEOUT)
        self.assertRegex(
            out,
            r"\A +\S+  RPDO1   Write output 8-bit, Output block 1 = 0x11 \(17\)  Write output 8-bit, Output block 2 = 0x22 \(34\)\n"
            r" +\S+  RPDO2   Write analogue output 16-bit, Analogue output 1 = -468 \(0xFE2C\)  Write analogue output 16-bit, Analogue output 2 = 1 \(0x0001\)\n\Z",
        )

    def test_watch_of_a_capture_goes_by_the_eds(self):
        self.write(
            "c.log", "(1.000000) can0 205#1122\n(1.500000) can0 185#0102\n(1.600000) can0 205#11\n"
        )
        seen = [
            json.loads(line)
            for line in self.run_program(
                "can", "pdo", "watch", "replay:c.log", "5", "--eds", "io.eds", "--json"
            ).stdout.splitlines()
        ]
        self.assertEqual(
            [
                {"time": 0.0, "pdo": "RPDO1", "values": {"6200:1": 17, "6200:2": 34}},
                {"time": 0.5, "pdo": "TPDO1", "values": {"6000:1": 1, "6000:2": 2}},
                {"time": 0.6, "pdo": "RPDO1", "values": {"6200:1": 17}},
            ],
            seen,
        )
        self.assertIn(
            "short: 1 of 2 bytes",
            self.run_program("can", "pdo", "watch", "replay:c.log", "5", "--eds", "io.eds").stdout,
        )
        self.assertEqual(
            "hal can pdo watch: cannot read the PDOs of a node from a capture; add --eds FILE, an EDS or DCF that describes them\n",
            self.bad_can("pdo", "watch", "replay:c.log", "5"),
        )


class Lss(Node):
    IDENTIFIER = "none"

    def ready(self):
        return self.run_program("can", "lss", self.bus, "identify").returncode == 0

    def test_a_node_without_id_is_found_and_gets_one(self):
        identity = r"vendor (0x\w+), product (0x\w+), revision (0x\w+), serial (0x00000001)"
        found = re.fullmatch(
            identity + ", now in the configuration state\n", self.can("lss", self.bus, "scan")
        )
        self.assertTrue(found)
        self.assertRegex(self.can("lss", self.bus, "inquire"), f"^{identity}, no node ID\n$")
        self.can("lss", self.bus, "node-id", "5")
        self.can("lss", self.bus, "store")
        self.can("lss", self.bus, "switch", "waiting")
        wait_until(lambda: Node.ready(self), "the node has its id")
        self.assertEqual(
            "hal can lss: no slave responded; no unconfigured slave that supports LSS\n",
            self.bad_can("lss", self.bus, "identify"),
        )
        self.assertEqual(
            "slave identified\n", self.can("lss", self.bus, "identify", *found.groups())
        )
        self.can("lss", self.bus, "select", *found.groups())
        self.assertIn(", node ID 5\n", self.can("lss", self.bus, "inquire"))

    def test_what_goes_wrong(self):
        self.assertEqual(
            "hal can lss: no slave responded; one slave must be in the configuration state: see switch and select in: hal help can lss\n",
            self.bad_can("lss", self.bus, "node-id", "5"),
        )
        self.can("lss", self.bus, "switch", "configuration")
        self.assertEqual(
            "hal can lss: invalid bit rate '300k'; write 1M, 800k, 500k, 250k, 125k, 50k, 20k or 10k\n",
            self.bad_can("lss", self.bus, "bit-rate", "300k"),
        )
        self.assertEqual(
            "hal can lss: invalid node ID '128'; write 1..127, or none\n",
            self.bad_can("lss", self.bus, "node-id", "128"),
        )
        self.assertEqual(
            "hal can lss: unknown command 'scna'; did you mean 'scan'?\n",
            self.bad_can("lss", self.bus, "scna"),
        )
        self.assertEqual(
            "hal can lss: wrong arguments of select; type: hal can lss ADDRESS select VENDOR PRODUCT REVISION SERIAL\n",
            self.bad_can("lss", self.bus, "select", "1"),
        )
        self.assertEqual(
            "hal can lss: invalid vendor ID 'x'; write a number up to 4294967295, or 0x…\n",
            self.bad_can("lss", self.bus, "select", "x", "1", "1", "1"),
        )


class Watch(Node):
    def test_nodes_with_their_state_age_and_emergencies(self):
        listener = self.begin("nodes", "--json", "--for", "3s")
        sent = self.run_program(
            "can",
            "send",
            self.bus,
            "707#00",
            "087#3081110000000000",
            "707#7F",
            "--every",
            "100ms",
            "--count",
            2,
        )
        self.assertEqual(0, sent.returncode, sent.stderr)
        found = json.loads(listener.communicate(timeout=2 * TIMEOUT)[0])
        seven = next(n for n in found if n["node"] == 7)
        self.assertEqual(
            ("pre-operational", 2, 2), (seven["state"], seven["boot_ups"], seven["emergencies"])
        )
        self.assertEqual(
            (0x8130, "life guard or heartbeat error", 0x11),
            tuple(seven["newest"][0][key] for key in ("code", "text", "error_register")),
        )
        self.assertGreater(seven["age"], 0)

    def test_nodes_of_a_capture_as_a_table(self):
        (self.folder / "seen.log").write_text(
            "".join(
                f"({t:.6f}) can0 {frame}\n"
                for t, frame in (
                    (10.0, "705#05"),
                    (10.1, "705#05"),
                    (10.2, "705#05"),
                    (10.3, "086#0000000000000000"),
                    (11.2, "080#"),
                )
            )
        )
        text = self.good_on("nodes", "replay:seen.log")
        self.assertEqual(
            "node  state                 heard  boot-ups  emergencies\n"
            "   5  operational          1.00 s         0  0; OFFLINE: heartbeats were 0.10 s apart\n"
            "   6  no heartbeat              -         0  1\n"
            "                                               error reset, 0.9 s ago\n",
            text,
        )

    def test_changed_bytes_are_marked(self):
        (self.folder / "seen.log").write_text(
            "(1.000000) can0 181#0102\n(1.010000) can0 181#0103\n(1.020000) can0 182#AA\n"
        )
        self.assertEqual(
            "      id    frames      period  data, changed bytes marked\n     181         2     10.0 ms  01 03*\n"
            "     182         1           -  AA\n",
            self.good_on("sniff", "replay:seen.log"),
        )

    def test_what_is_produced_and_generated(self):
        for words, lines in (
            (("produce", self.bus, "heartbeat", 9), ["709#05"] * 3),
            (("produce", self.bus, "guarding", 9), ["709#R1"] * 3),
            (("produce", self.bus, "sync", "--counter", 2), ["080#01", "080#02", "080#01"]),
            (
                ("generate", self.bus, "--id", "100-101", "--counting", "--length", 2),
                ["100#0000", "101#0100", "100#0200"],
            ),
        ):
            with self.subTest(words[0] + str(words[2])):
                (self.folder / "seen.log").unlink(missing_ok=True)
                listener = self.begin(
                    "record",
                    "seen.log",
                    "--count",
                    3,
                    "--filter",
                    lines[0].split("#")[0] + ("/7FE" if words[0] == "generate" else "/7FF"),
                )
                self.assertEqual(
                    0, self.run_program("can", *words, "--every", "10ms", "--count", 3).returncode
                )
                listener.communicate(timeout=2 * TIMEOUT)
                self.assertEqual(
                    lines,
                    [
                        line.split()[2]
                        for line in (self.folder / "seen.log").read_text().splitlines()
                    ],
                )
        self.assertEqual(
            "hal can produce: unknown kind 'synk'; did you mean 'sync'?\n",
            self.bad("can", "produce", self.bus, "synk"),
        )
        for words in (("produce", self.bus, "sync"), ("generate", self.bus)):
            self.assertIn(
                "--every: invalid duration '0s'",
                self.bad("can", *words, "--every", "0s", "--count", 1),
            )
        self.assertIn("invalid --id '800'", self.bad("can", "generate", self.bus, "--id", "800"))

    def begin(self, command, *words):
        """Starts a listener and waits until it listens."""
        process = subprocess.Popen(
            ["hal", "can", command, self.bus, *map(str, words)],
            executable=str(HAL),
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(Case.end, self, process)
        self.assertIn("listening on", process.stderr.readline())
        return process

    def good_on(self, *words):
        done = self.run_program("can", *words)
        self.assertEqual(0, done.returncode, done.stderr)
        return done.stdout


class Flash(Node):
    def test_another_program_for_a_node(self):
        (self.folder / "new.bin").write_bytes(
            subprocess.run(
                ["hal", "node", "bootloader", "--make-image", "2.1"],
                executable=str(HAL),
                env=self.environment,
                stdout=subprocess.PIPE,
                check=True,
            ).stdout
        )
        node = subprocess.Popen(
            ["hal", "node", "bootloader", "--link", self.bus, "--id", "6"],
            executable=str(HAL),
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(Case.end, self, node)
        node.stdout.readline()
        text = self.good("can", "flash", self.bus, 6, "new.bin")
        self.assertRegex(
            text,
            r"^node 6: stopping the program\nnode 6: erasing the flash\nnode 6: downloading \d+ bytes\nnode 6: starting the program\n"
            r"node 6: program running, software identification 0x[0-9A-F]{8}\n$",
        )
        (self.folder / "bad.bin").write_bytes(b"not a program at all, and long enough")
        self.assertEqual(
            "hal can flash: node 6, 1F50:1: data cannot be transferred or stored to the application (0x08000020); the device rejected "
            "the image and may have no valid program now; check that the image is for this device\n",
            self.bad("can", "flash", self.bus, 6, "bad.bin"),
        )
        self.assertIn(
            "program running, software identification",
            self.good("can", "flash", self.bus, 6, "new.bin"),
        )

    def test_a_long_transfer_shows_its_progress_on_a_terminal(self):
        """The node is stopped until the line has appeared: a transfer that takes long."""
        node = subprocess.Popen(
            ["hal", "node", "bootloader", "--link", self.bus, "--id", "6"],
            executable=str(HAL),
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(Case.end, self, node)
        node.stdout.readline()
        (self.folder / "image.bin").write_bytes(bytes(20_000))
        for control in ("0", "3"):
            self.good("can", "sdo", "write", self.bus, 6, "1f51:1", control, "--type", "u8")
        write = (
            "can",
            "sdo",
            "write",
            self.bus,
            6,
            "1f50:1",
            "--from",
            "image.bin",
            "--type",
            "domain",
            "--timeout",
            "60s",
        )
        node.send_signal(signal.SIGSTOP)
        self.addCleanup(node.send_signal, signal.SIGCONT)  # before its end
        shown = Terminal(self, *write)
        self.assertEqual("\r\x1b[Knode 6, 1F50:1: 0.0 of 20.0 kB, 0 %", shown.expect("0 %"))
        node.send_signal(signal.SIGCONT)
        shown.wait()
        self.assertTrue(
            shown.seen.endswith("\r\x1b[K") or "\r\x1b[Khal can sdo write: " in shown.seen,
            shown.seen,
        )  # the image is not a program
        node.send_signal(signal.SIGSTOP)
        silent = subprocess.Popen(
            ["hal", "can", "sdo", "read", self.bus, "6", "1008:0", "--timeout", "700ms"],
            executable=str(HAL),
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        out, error = silent.communicate(timeout=2 * TIMEOUT)
        self.assertNotIn("\x1b", out + error, "not where no terminal is")
        self.assertIn("node 6 did not respond within 2.1 s", error)

    def test_a_node_without_one_and_wrong_files(self):
        self.assertIn(
            "hal can flash: node 5 has no program control 1F51:1",
            self.bad("can", "flash", self.bus, 5, "/proc/version"),
        )
        self.assertEqual(
            "hal can flash: cannot read 'none.bin': No such file or directory\n",
            self.bad("can", "flash", self.bus, 5, "none.bin"),
        )


if __name__ == "__main__":
    unittest.main()
