# SPDX-License-Identifier: MIT
"""hal can gateway: lines of CiA 309-3 over a socket, a simulated node behind it."""
import socket
import stat
import subprocess
import unittest

from can_node_test import Node
from harness import HAL, PATIENCE, Case


class Client:
    """What a script of somebody else does: write a line, read until its answer."""

    def __init__(self, place):
        family = socket.AF_UNIX if isinstance(place, str) else socket.AF_INET
        self.socket = socket.socket(family, socket.SOCK_STREAM)
        self.socket.settimeout(2 * PATIENCE)
        self.socket.connect(place)
        self.lines, self.events = self.socket.makefile("r", newline="\r\n"), []

    def close(self):
        self.lines.close()
        self.socket.close()

    def ask(self, text, number=[0]):
        number[0] += 1
        self.socket.sendall(f"[{number[0]}] {text}\n".encode())
        return self.answer(number[0])

    def answer(self, number):
        while line := self.lines.readline():
            if line.startswith(f"[{number}] "):
                return line[len(f"[{number}] "):].rstrip("\r\n")
            self.events.append(line.rstrip("\r\n"))
        raise AssertionError("the gateway hung up")


class Gateway(Node):
    def gateway(self, *words):
        process = subprocess.Popen(["hal", "can", "gateway", self.bus, *words], executable=str(HAL), cwd=self.folder, env=self.environment,
                                   stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(Case.end, self, process)
        self.said = process.stderr.readline()
        self.assertIn("; listening on ", self.said)
        return process

    def client(self, place):
        client = Client(place)
        self.addCleanup(client.close)
        return client

    def test_a_session_over_a_local_socket(self):
        self.gateway("--socket", "gate")
        self.assertEqual(0o600, stat.S_IMODE((self.folder / "gate").stat().st_mode))
        client = self.client(str(self.folder / "gate"))
        self.assertEqual("OK", client.ask("set network 1"))
        self.assertEqual("OK", client.ask("set node 5"))
        self.assertEqual("1", client.ask("r 0x1018 4 u32"))
        self.assertEqual("OK", client.ask("w 0x6411 1 i16 -300"))
        self.assertEqual("-300", client.ask("1 5 read 0x6411 1 i16"))
        self.assertEqual("6411:1 = -300 (0xFED4)\n", self.can("sdo", "read", self.bus, "5", "6411:1", "--type", "i16"))
        self.assertEqual("ERROR:0x06020000 #object does not exist in the object dictionary", client.ask("r 0x2fff 0 u8"))
        self.assertEqual("OK", client.ask("start"))
        self.assertEqual("OK", client.ask("reset comm"))
        while "1 5 BOOT_UP" not in client.events:
            client.ask("info version")
        other = self.client(str(self.folder / "gate"))
        self.assertEqual("ERROR:105 #no default node set", other.ask("r 0x1018 4 u32"))

    def test_a_port_of_this_machine_and_kept_settings(self):
        first = self.gateway("--listen", "127.0.0.1:0", "--state", "gate.state")
        port = int(self.said.split("127.0.0.1:")[1].split(";")[0])
        client = self.client(("127.0.0.1", port))
        self.assertEqual("OK", client.ask("set sdo_timeout 70"))
        self.assertEqual("OK", client.ask("store"))
        self.assertIn("1 set sdo_timeout 70\n", (self.folder / "gate.state").read_text())
        Case.end(self, first)
        self.gateway("--socket", "gate", "--state", "gate.state")
        client = self.client(str(self.folder / "gate"))
        self.assertEqual("ERROR:0x05040000 #SDO protocol timed out", client.ask("9 r 0x1000 0"))
        self.assertEqual("OK", client.ask("restore"))
        self.assertFalse((self.folder / "gate.state").exists())

    def test_wrong_words(self):
        self.gateway("--socket", "gate")
        self.assertEqual("hal can gateway: another gateway listens on 'gate'; give this one its own: --socket PATH\n",
                         self.bad_can("gateway", self.bus, "--socket", "gate"))
        self.write("file", "")
        self.assertEqual("hal can gateway: 'file' is there and no socket; give another: --socket PATH\n", self.bad_can("gateway", self.bus, "--socket", "file"))
        self.assertEqual("hal can gateway: '0.0.0.0:6000' would let other machines command this bus; listen on 127.0.0.1 and forward it: ssh -L\n",
                         self.bad_can("gateway", self.bus, "--listen", "0.0.0.0:6000"))
        self.assertEqual("hal can gateway: '6000' is no place to listen; write 127.0.0.1:6000\n", self.bad_can("gateway", self.bus, "--listen", "6000"))


if __name__ == "__main__":
    unittest.main()
