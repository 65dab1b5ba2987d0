# SPDX-License-Identifier: MIT
# packages: ethercat
"""The mailbox gateway of a running machine: our commands, and bytes of ETG.8200 by hand over UDP and TCP."""

import json
import select
import socket
import struct
import threading
import unittest

from harness import ROOT, TIMEOUT, Case, free_port, wait_until

MACHINE = ROOT / "halfiles/ethercat-servo"


def upload(station, index, sub):
    """An expedited SDO upload: Ethernet header of type 5, mailbox header, CoE header, SDO."""
    message = struct.pack("<HHBBHBHBI", 10, station, 0, 0x23, 2 << 12, 0x40, index, sub, 0)
    return struct.pack("<H", len(message) | 5 << 12) + message


class Gateway(Case):
    def begin(self, gateway):
        text = (
            (MACHINE / "servo.ethercat")
            .read_text()
            .replace("cycle = 1ms", f"cycle = 1ms\ngateway = {gateway}")
        )
        self.write("servo.ethercat", text)
        self.write("servo.hal", (MACHINE / "servo.hal").read_text())
        self.start("run", "servo.hal", loaded=False)
        wait_until(lambda: self.value("ethercat.0.all-op") == "TRUE", "the drives are operational")

    def setUp(self):
        super().setUp()
        self.port = free_port(socket.SOCK_STREAM)
        self.address = f"gateway:127.0.0.1:{self.port}"

    def test_objects_of_a_running_machine(self):
        self.begin(f"127.0.0.1:{self.port}")
        self.assertEqual(
            "Halcyon servo\n",
            self.good("ethercat", "upload", self.address, "-p", "1", "0x1008", "0"),
        )
        self.assertEqual(
            "", self.good("ethercat", "download", self.address, "-p", "0", "0x6083", "0", "12345")
        )
        self.assertEqual(
            12345,
            json.loads(
                self.good("ethercat", "upload", self.address, "-p", "0", "0x6083", "0", "--json")
            )["value"],
        )
        self.assertIn("0x6041 ", self.good("ethercat", "sdos", self.address, "-p", "0"))
        self.assertEqual(
            "hal ethercat upload: slave 0: 0x6999:0: SDO transfer aborted with code 0x06020000: object does not exist in the object dictionary\n",
            self.bad("ethercat", "upload", self.address, "-p", "0", "0x6999", "0"),
        )
        self.assertEqual(
            "hal ethercat upload: no slave at position 7; the bus has 2, the last one at position 1\n",
            self.bad("ethercat", "upload", self.address, "-p", "7", "0x6083", "0"),
        )
        for command, words in (("scan", ()), ("foe-read", ("-p", "0", "x"))):
            self.assertEqual(
                f"hal ethercat {command}: this command needs the bus itself; through a gateway there are upload, download and sdos\n",
                self.bad("ethercat", command, self.address, *words),
            )
        self.assertEqual("TRUE", self.value("ethercat.0.all-op"))

    def test_frames_by_hand(self):
        self.begin(f"127.0.0.1:{self.port}")
        udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(udp.close)
        udp.settimeout(20)
        udp.connect(("127.0.0.1", self.port))
        udp.send(
            upload(0, 0xF020, 1)
        )  # the station of the first slave, from the dictionary of the master
        answer = udp.recv(1500)
        self.assertEqual((0x4B, 0xF020, 1), struct.unpack_from("<BHB", answer, 10))
        (station,) = struct.unpack_from("<H", answer, 14)
        tcp = socket.create_connection(("127.0.0.1", self.port), timeout=20)
        self.addCleanup(tcp.close)
        request = upload(station, 0x1000, 0)
        tcp.send(request[:5])
        tcp.send(request[5:] + upload(station, 0x6041, 0))
        answer = b""
        while len(answer) < 36:
            answer += tcp.recv(1500)
        self.assertEqual((0x1000, 0, 0x20192), struct.unpack_from("<HBI", answer, 11))
        self.assertEqual((0x6041, 0), struct.unpack_from("<HB", answer, 29))
        udp.send(b"not a frame")  # nothing answers, nothing breaks
        udp.send(upload(station, 0x1000, 0))
        self.assertEqual((0x1000, 0, 0x20192), struct.unpack_from("<HBI", udp.recv(1500), 11))

    def test_a_gateway_that_closes_is_named_and_not_the_slave(self):
        """Between command and gateway: what closes the connection at the question for the type of an object."""
        self.begin(f"127.0.0.1:{self.port}")
        between = socket.create_server(("127.0.0.1", 0))
        self.addCleanup(between.close)
        thread = threading.Thread(
            target=self.close_at_question_for_type, args=(between,), daemon=True
        )
        thread.start()
        address = f"gateway:127.0.0.1:{between.getsockname()[1]}"
        self.assertEqual(
            f"hal ethercat download: {address} closed the connection; does the machine still run?\n",
            self.bad("ethercat", "download", address, "-p", "0", "0x6083", "0", "12345"),
        )
        thread.join(TIMEOUT)

    def close_at_question_for_type(self, between):
        client = between.accept()[0]
        gateway = socket.create_connection(("127.0.0.1", self.port))
        with client, gateway:
            while True:
                ready = select.select([client, gateway], [], [], TIMEOUT)[0]
                for one in ready:
                    data = one.recv(65536)
                    is_information = data[8:10] == struct.pack("<H", 8 << 12)
                    if not data or one is client and is_information:
                        return
                    (gateway if one is client else client).sendall(data)

    def test_without_gateway(self):
        said = self.bad("ethercat", "upload", self.address, "-p", "0", "0x1000", "0")
        self.assertEqual(
            f"hal ethercat upload: no mailbox gateway at 127.0.0.1:{self.port}: Connection refused; write gateway = 127.0.0.1 in [bus] "
            "of the configuration, and start the machine\n",
            said,
        )
        self.assertEqual(
            "hal ethercat upload: invalid address 'gateway:here'; write gateway:127.0.0.1 or gateway:127.0.0.1:34980\n",
            self.bad("ethercat", "upload", "gateway:here", "-p", "0", "0x1000", "0"),
        )

    def test_wrong_settings(self):
        self.write(
            "bus.ethercat",
            "[bus]\ngateway = localhost\n[slave 0 x]\nvendor = 1\noutputs = none\ninputs = none\n",
        )
        self.assertIn("bus.ethercat:2:11: error: ", self.bad("ethercat", "check", "bus.ethercat"))
        self.write(
            "bus.ethercat",
            "[bus]\ngateway = 0.0.0.0\n[slave 0 x]\nvendor = 1\noutputs = none\ninputs = none\n",
        )
        said = self.run_program("ethercat", "check", "bus.ethercat").stderr
        self.assertIn(
            "warning: programs on other computers can read and write the objects of the slaves through the gateway",
            said,
        )


if __name__ == "__main__":
    unittest.main()
