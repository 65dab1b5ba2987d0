# SPDX-License-Identifier: MIT
"""hal ethercat on an emulated line."""
import json
import unittest

from harness import Case

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
        self.assertRegex(lines[3], r"^      3  INIT  Halcyon mailbox_device  at port 1 of slave 2  delay [1-9]\d* ns$")
        rows = json.loads(self.on("scan", "--json"))
        self.assertEqual([None, 0, 1, 2], [row["parent"] for row in rows])
        self.assertEqual([None, 0, None], [row["delay_ns"] for row in rows[:3]])

    def test_slaves_counts_from_the_newest_alias(self):
        self.assertEqual(["0:0", "0:1", "7:0", "7:1"], [line.split()[1] for line in self.on("slaves").splitlines()])
        rows = json.loads(self.on("slaves", "--json"))
        self.assertEqual([0, 0, 7, 0], [row["alias"] for row in rows])
        self.assertEqual("Halcyon servo", rows[1]["name"])

    def test_a_line_may_be_in_a_file(self):
        (self.folder / "line.txt").write_text("coupler\ndigital_out bits=4\n")
        self.assertEqual(2, len(self.on("slaves", line="line.txt").splitlines()))

    def test_states_requests_one_and_says_why_it_is_refused(self):
        self.assertEqual("0    INIT\n1    INIT\n2    INIT\n3    INIT\n", self.on("states"))
        self.assertEqual("0    SAFE-OP\n1    SAFE-OP\n2    SAFE-OP\n3    SAFE-OP\n", self.on("states", "safe-op"))
        self.assertEqual("0    INIT\n1    PRE-OP\n2    INIT\n3    INIT\n", self.on("states", "-p", 1, "PREOP"))
        self.assertEqual("0    OP\n1    OP\n", self.on("states", "OP", line="coupler, digital_in"))
        self.assertRegex(self.refused("states", "OP", line="servo"),
                         r"^hal ethercat states: slave 0: OP not reached, it is in SAFE-OP: AL status code 0x001B \(sync manager watchdog\): ")
        self.assertEqual("hal ethercat states: unknown state 'run'; write INIT, PREOP, BOOT, SAFEOP or OP\n", self.refused("states", "run"))

    def test_crc_lists_the_ports_in_use(self):
        self.assertTrue(self.on("crc").endswith("no cable is faulty\n"))
        report = json.loads(self.on("crc", "--json"))
        self.assertEqual([], report["cables"])
        self.assertEqual([(0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1), (3, 0)], [(p["position"], p["port"]) for p in report["ports"]])


class Values(Ethercat):
    def test_objects(self):
        self.assertEqual("0x00020192 131474\n", self.on("upload", "-p", 1, "0x1000", 0))
        self.assertEqual(131474, json.loads(self.on("upload", "-p", 1, "0x1000", 0, "--json"))["value"])
        self.on("download", "-p", 1, "0x6060", 0, 9)
        self.assertRegex(self.refused("download", "-p", 1, "0x1000", 0, 9), r"0x1000:0: SDO transfer aborted with code 0x06010002: ")
        self.assertIn("choose one with -p 0 … -p 3", self.refused("upload", "0x1000", 0))

    def test_registers(self):
        self.assertEqual("0x01 0x00\n", self.on("reg-read", "-p", 1, "0x130"))
        self.assertEqual("", self.on("reg-write", "-p", 1, "0x10", 1, 2))
        self.assertEqual(2, json.loads(self.on("reg-write", "-p", 1, "0x10", 1, 2, "--json"))["written"])
        self.assertIn("registers are 0..0xffff", self.refused("reg-write", "-p", 1, "0x10"))
        self.assertIn("no slave at position 4; the last one of 4 is at position 3", self.refused("reg-read", "-p", 4, "0x130"))

    def test_eeprom(self):
        image = bytes(int(word, 16) for word in json.loads(self.on("sii-read", "-p", 1, "--json"))["bytes"].split())
        (self.folder / "servo.sii").write_bytes(image)
        self.assertEqual("slave 1: 0 words written; it uses them after it was switched off and on\n", self.on("sii-write", "-p", 1, "servo.sii"))
        (self.folder / "damaged.sii").write_bytes(bytes([image[0] ^ 1]) + image[1:])
        self.assertIn("its checksum is wrong; nothing was written", self.refused("sii-write", "-p", 1, "damaged.sii"))
        changed = bytearray(image)
        changed[0x1c] ^= 0x55  # the serial number
        (self.folder / "changed.sii").write_bytes(changed)
        self.assertEqual(1, json.loads(self.on("sii-write", "-p", 1, "changed.sii", "--json"))["words"])

    def test_alias(self):
        self.assertEqual("slave 1: alias 5, before 0; it has it after it was switched off and on\n", self.on("alias", "-p", 1, 5))
        self.assertEqual("hal ethercat alias: slave 2 has alias 7 already; choose another one\n", self.refused("alias", "-p", 1, 7))


class Wrong(Ethercat):
    def test_no_bus(self):
        self.assertEqual("hal ethercat scan: missing address: type eth:INTERFACE, or --emulate \"coupler, servo\" to try it without hardware\n",
                         self.bad("ethercat", "scan"))
        self.assertIn("is a segment in memory", self.bad("ethercat", "scan", "sim:line"))
        self.assertIn("--emulate: ", self.refused("scan", line="toaster"))


if __name__ == "__main__":
    unittest.main()
