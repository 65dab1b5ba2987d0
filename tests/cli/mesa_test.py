# SPDX-License-Identifier: MIT
# packages: mesa
"""hal node mesa on the loopback interface, and hal mesa on it: scan, info, pins, read, write, doctor, and the faults."""

import json
import socket
import struct
import unittest

from harness import TIMEOUT, Case, free_port, wait_until
from mesa_node import MesaNode

CARD = """[card]
type = 7i92
address = sim:card
[motor x]
stepgen = 0
scale = 200
[switch home]
motor = x
below = -1
terminal = gpio 33
[input button]
terminal = gpio 32
[output lamp]
terminal = gpio 18
"""


class Mesa(MesaNode, Case):
    def setUp(self):
        super().setUp()
        self.write("card.mesa", CARD)
        self.host = f"127.0.0.1:{free_port()}"

    def mesa(self, command, *words):
        return self.good("mesa", command, self.host, *words)

    def read(self, address):
        return int(self.mesa("read", address).split()[1], 16)

    def test_identity(self):
        self.node()
        self.assertEqual(
            f"{self.host}  7I92, MAC 00:00:00:00:00:00\n", self.good("mesa", "scan", self.host)
        )
        text = self.mesa("info")
        self.assertIn("MESA7I92, 2 ports of 17 pins, clocks 100 MHz and 200 MHz\n", text)
        self.assertIn("\nstepgen                    10        2         10  0x2000\n", text)
        card = json.loads(self.mesa("info", "--json"))
        self.assertEqual(("7I92", 3), (card["name"], card["lbp_version"]))
        self.assertEqual(
            {"watchdog": 1, "ioport": 2, "encoder": 2, "sserial": 1, "stepgen": 10, "led": 1},
            {module["name"]: module["count"] for module in card["modules"]},
        )
        pins = json.loads(self.mesa("pins", "--json"))
        self.assertEqual(34, len(pins))
        self.assertEqual("stepgen.00.direction", pins[0]["module"])
        self.assertEqual("encoder.01.phase-A", pins[33]["module"])
        self.assertIn("\n  18     1    1  output     stepgen.05.step\n", self.mesa("pins"))

    def test_registers_by_hand(self):
        self.node("--verbose")
        self.assertEqual("0x0100  0x55AACAFE  1437256446\n", self.mesa("read", "0x100"))
        self.assertEqual("0x0010  0x0003  3\n", self.mesa("read", "0x10", "--space", "7"))
        self.mesa("write", "0x10", "7", "0x8000", "--space", "4")
        self.assertEqual(
            "0x0010  0x0007  7\n0x0012  0x8000  32768\n",
            self.mesa("read", "0x10", "2", "--space", "4"),
        )
        for register in ("0x2500", "0x2600"):
            self.mesa("write", register, "1000")  # pulses of 10 us
        self.mesa("write", "0x1000", "0", "2")  # the lamp
        self.mesa("write", "0x1200", "3")
        self.mesa("write", "0x1100", "3", "2")
        self.mesa("write", "0x2000", str(2**32 - 42950))  # 1000 steps/s backwards
        wait_until(lambda: self.read("0x1004") & 0x10000, "the motor reaches its switch")
        wait_until(lambda: "lamp on" in self.log() and "x -1." in self.log(), "the report")
        self.mesa("write", "0xC00", "1")
        wait_until(lambda: self.read("0xD00") == 1, "the watchdog bites")
        wait_until(lambda: "watchdog has bitten" in self.log().splitlines()[-1], "the report")
        self.assertIn("lamp off", self.log().splitlines()[-1])
        self.assertEqual(0, self.read("0x1100"))
        stands = self.read("0x2100")
        wait_until(lambda: self.read("0x2100") != stands, "the accumulator runs on")

    def test_input_and_end(self):
        node = self.node("--set", "button=yes")
        self.assertEqual(0x8000, self.read("0x1004") & 0x8000)
        node.terminate()
        node.wait(timeout=TIMEOUT)
        self.assertRegex(self.log(), r"mesa: \d+ requests, 0 bites of the watchdog, 0 datagrams")

    def test_pure_writes_are_not_answered(self):
        self.node()
        host, port = self.host.split(":")
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
            client.connect((host, int(port)))
            client.settimeout(TIMEOUT)
            client.send(bytes.fromhex("82D11000 05000000"))
            client.send(bytes.fromhex("8251 1000"))
            self.assertEqual(5, struct.unpack("<I", client.recv(1500))[0])
            client.send(b"\x01")  # half a command
            client.send(bytes.fromhex("0159 0200"))
            self.assertEqual(1, struct.unpack("<H", client.recv(1500))[0])

    def test_doctor_finds_in_which_direction_packets_are_lost(self):
        self.node("--fault", "drop-reply:every=10")
        found = json.loads(
            self.mesa("doctor", "--json", "--count", "100", "--timeout", "20ms", "--every", "100us")
        )
        self.assertEqual(100, found["sent"])
        self.assertEqual(10, found["lost_replies"])
        self.assertEqual(0, found["lost_requests"])
        self.assertLessEqual(found["p50_ns"], found["max_ns"])
        text = self.mesa("doctor", "--count", "50", "--timeout", "20ms")
        self.assertRegex(text, r"lost: 0 requests, [45] replies \((8|10)\.00 %\)")
        self.assertRegex(text, r"<= \d+ us +\d+  #+\n")

    def test_lost_requests(self):
        self.node("--fault", "drop-request:every=10")
        found = json.loads(
            self.mesa("doctor", "--json", "--count", "95", "--timeout", "20ms", "--every", "100us")
        )
        self.assertEqual((9, 0), (found["lost_requests"], found["lost_replies"]))

    def test_late_replies_are_not_those_of_later_requests(self):
        self.node("--fault", "delay:delay=60ms")
        found = json.loads(
            self.mesa("doctor", "--json", "--count", "20", "--timeout", "20ms", "--every", "1ms")
        )
        lost = [found[name] for name in ("lost_requests", "lost_replies", "lost")]
        self.assertEqual([0, 0, 0], lost)
        self.assertGreaterEqual(found["p50_ns"], 60_000_000)
        self.assertEqual((20, 20), (found["answered"], found["late"]))
        text = self.mesa("doctor", "--count", "4", "--timeout", "20ms")
        self.assertIn("4 of 4 requests answered, 4 of them later than --timeout; lost: 0 ", text)

    def test_swapped_replies_are_late_and_not_lost(self):
        self.node("--fault", "swap")
        found = json.loads(self.mesa("doctor", "--json", "--count", "10", "--timeout", "20ms"))
        lost = [found[name] for name in ("lost_requests", "lost_replies", "lost")]
        self.assertEqual([0, 0, 0], lost)

    def test_the_last_reply_is_lost(self):
        self.node("--fault", "drop-reply:every=2")
        found = json.loads(self.mesa("doctor", "--json", "--count", "10", "--timeout", "20ms"))
        self.assertEqual((0, 5, 0), (found["lost_requests"], found["lost_replies"], found["lost"]))

    def test_faults_of_the_card(self):
        self.node("--fault", "wrong-cookie")
        self.assertIn("the cookie at 0x0100 is 0xAA553501", self.bad("mesa", "info", self.host))

    def test_late_answer_is_tried_again(self):
        self.node("--fault", "delay:delay=60ms:every=2")
        self.assertEqual("0x0100  0x55AACAFE  1437256446\n", self.mesa("read", "0x100"))

    def test_invalid_words(self):
        def node(*words):
            return self.bad("node", "mesa", "card.mesa", "--address", self.host, *words)

        self.assertIn("faults are drop-request", node("--fault", "drop"))
        self.assertIn("options are every", node("--fault", "delay:often=1s"))
        self.assertIn("there is no input lamp", node("--set", "lamp=yes"))
        self.assertIn("write INPUT=yes", node("--set", "button=2"))
        self.assertIn("as in 0.01 or 1%", node("--loss", "2"))
        self.assertIn(
            "write an IP address",
            self.bad("node", "mesa", "card.mesa", "--address", "0.0.0.0"),
        )
        self.assertIn(
            "192.0.2.1:27181 is not an address of this computer",
            self.bad("node", "mesa", "card.mesa", "--address", "192.0.2.1"),
        )
        self.assertIn("cannot read", self.bad("node", "mesa", "none.mesa"))
        self.write("bad.mesa", "[card]\ntype = 7i80\n")
        self.assertIn("[mesa-value]", self.bad("node", "mesa", "bad.mesa"))
        self.assertIn("write a multiple of 4", self.bad("mesa", "read", self.host, "0x102"))
        self.assertIn("invalid count", self.bad("mesa", "read", self.host, "0xFFFC", "2"))
        self.assertIn("invalid --space", self.bad("mesa", "read", self.host, "0", "--space", "8"))
        self.assertIn(
            "a number of 16 bits",
            self.bad("mesa", "write", self.host, "0", "65536", "--space", "4"),
        )
        self.assertIn("VALUE", self.bad("mesa", "write", self.host, "0"))
        self.assertIn("24..32 bits", self.bad("mesa", "scan", "10.0.0.0/8"))
        self.assertIn("invalid --count", self.bad("mesa", "doctor", self.host, "--count", "0"))

    def test_write_beyond_the_end_of_a_space(self):
        self.assertEqual(
            "hal mesa write: 2 values from 0xFFFC on go beyond the end of the space, 0xFFFF; write at "
            "most 1\n",
            self.bad("mesa", "write", self.host, "0xFFFC", "1", "7"),
        )

    def test_missing_card(self):
        self.assertIn(
            "does not answer; check power, cable",
            self.bad("mesa", "info", self.host, "--timeout", "5ms"),
        )
        self.assertIn(
            f"no card answers at {self.host}; an interface of this computer needs an address",
            self.bad("mesa", "scan", self.host, "--timeout", "5ms"),
        )
        self.assertIn(
            "no card answers at 127.0.0.8 or 127.0.0.9; ",
            self.bad("mesa", "scan", "127.0.0.8", "127.0.0.9", "--timeout", "5ms"),
        )


if __name__ == "__main__":
    unittest.main()
