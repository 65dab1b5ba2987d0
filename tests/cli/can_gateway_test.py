# SPDX-License-Identifier: MIT
# packages: canopen
"""hal can gateway: lines of CiA 309-3 over a socket, a simulated node behind it."""
import json
import socket
import stat
import subprocess
import unittest

from can_node_test import Node
from harness import HAL, TIMEOUT, Case


class Client:
    """A client script: writes a line and reads until its response."""

    def __init__(self, place):
        family = socket.AF_UNIX if isinstance(place, str) else socket.AF_INET
        self.socket = socket.socket(family, socket.SOCK_STREAM)
        self.socket.settimeout(2 * TIMEOUT)
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
                return line[len(f"[{number}] ") :].rstrip("\r\n")
            self.events.append(line.rstrip("\r\n"))
        raise AssertionError("the gateway hung up")


class Gateway(Node):
    def gateway(self, *words):
        process = subprocess.Popen(
            ["hal", "can", "gateway", self.bus, *words],
            executable=str(HAL),
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
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
        self.assertEqual(
            "6411:1 = -300 (0xFED4)\n",
            self.can("sdo", "read", self.bus, "5", "6411:1", "--type", "i16"),
        )
        self.assertEqual(
            "ERROR:0x06020000 #object does not exist in the object dictionary",
            client.ask("r 0x2fff 0 u8"),
        )
        self.assertEqual("OK", client.ask("start"))
        self.assertEqual("OK", client.ask("reset comm"))
        while "1 5 BOOT_UP" not in client.events:
            client.ask("info version")
        other = self.client(str(self.folder / "gate"))
        self.assertEqual("ERROR:105 #no default node set", other.ask("r 0x1018 4 u32"))

    def test_a_client_that_has_ended_its_commands_gets_all_responses(self):
        self.gateway("--listen", "127.0.0.1:0", "--state", "gate.state")
        port = int(self.said.split("127.0.0.1:")[1].split(";")[0])
        client = self.client(("127.0.0.1", port))
        commands = "[1] 1 5 r 0x1018 4 u32\n[2] 1 9 r 0x1000 0\n[3] 1 5 r 0x1018 0 u8\n[4] 1 5 r"
        client.socket.sendall(commands.encode())
        client.socket.shutdown(socket.SHUT_WR)
        responses = sorted(line for line in client.lines if line.startswith("["))
        self.assertEqual(
            ["[1] 1\n", "[2] ERROR:0x05040000 #SDO protocol timed out\n", "[3] 4\n"],
            [line.replace("\r", "") for line in responses],
        )

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

    def test_the_gateways_own_node(self):
        self.gateway("--socket", "gate")
        client = self.client(str(self.folder / "gate"))
        self.assertEqual("OK", client.ask("set id 126"))
        self.assertEqual('"Halcyon CiA 309-3 gateway"', client.ask("126 r 0x1008 0 vs"))
        self.assertEqual("4", client.ask("126 r 0x1018 0 u8"))
        self.assertEqual("OK", client.ask("126 w 0x1017 0 u16 200"))
        heard = json.loads(
            self.run_program(
                "can", "dump", self.bus, "--filter", "77E", "-n", "1", "--json"
            ).stdout.splitlines()[0]
        )
        self.assertEqual("05", heard["data"])
        self.assertEqual(
            "ERROR:0x06020000 #object does not exist in the object dictionary",
            client.ask("126 r 0x2fff 0 u8"),
        )

    def test_identity_of_a_product(self):
        self.gateway(
            "--socket",
            "gate",
            "--identity",
            "0x1234,7,0x00010002,42",
            "--vendor-name",
            "Example Ltd",
            "--product-name",
            "Cell gateway",
            "--order-code",
            "CG-7/b",
        )
        client = self.client(str(self.folder / "gate"))
        self.assertEqual("4660 7 1.2 42 3 3.0 1.0", client.ask("info version"))
        self.assertEqual("OK", client.ask("set id 126"))
        self.assertEqual(
            ["4660", "7", "65538", "42"],
            [client.ask(f"126 r 0x1018 {sub} u32") for sub in (1, 2, 3, 4)],
        )
        self.assertEqual(
            ['"Example Ltd"', '"Cell gateway"', '"CG-7/b"'],
            [client.ask(f"126 r 0x2000 {sub} vs") for sub in (1, 2, 3)],
        )
        self.assertEqual('"Cell gateway"', client.ask("126 r 0x1008 0 vs"))
        for wrong in ("x", "1,2,3,4,5", "-1", "0x100000000", "1 2"):
            self.assertIn(
                f"invalid --identity '{wrong}'; write VENDOR,PRODUCT,REVISION,SERIAL",
                self.bad("can", "gateway", self.bus, f"--identity={wrong}"),
            )
        self.assertIn(
            "--order-code has 300 bytes; at most 200 are allowed",
            self.bad("can", "gateway", self.bus, "--order-code", "x" * 300),
        )

    def one_shot(self, place, *words):
        return self.good("can", "gateway", "--connect", place, *words)

    def test_a_client_with_one_command_or_several(self):
        self.gateway("--socket", "gate")
        self.assertEqual("1\n", self.one_shot("gate", "5", "r", "0x1018", "4", "u32"))
        self.assertEqual(
            "OK\nOK\n-300\n",
            self.one_shot("gate", "set node 5", "w 0x6411 1 i16 -300", "r 0x6411 1 i16"),
        )
        self.assertEqual("OK\n", self.one_shot("gate", "5", "w", "0x6411", "1", "i16", "-7"))
        self.assertIn("info version", self.one_shot("gate", "help"))
        wrong = ("gateway", "--connect", "gate")
        self.assertEqual(
            "hal can gateway: 5 r 0x2fff 0 u8: object does not exist in the object dictionary (0x06020000)\n",
            self.bad_can(*wrong, "5", "r", "0x2fff", "0", "u8"),
        )
        self.assertEqual(
            "hal can gateway: r 0x1000 0 u32: no default node set (error 105); write the node before the command, or type: set node NODE\n",
            self.bad_can(*wrong, "r 0x1000 0 u32"),
        )
        self.assertEqual(
            "hal can gateway: [1] 5 start: sequence numbers are added here; type the command without one\n".replace(
                "[1] 5 start:", "'[1] 5 start':"
            ),
            self.bad_can(*wrong, "[1] 5 start"),
        )

    def test_a_client_on_a_port_with_lines_on_its_input(self):
        self.gateway("--listen", "127.0.0.1:0")
        place = self.said.split("listening on ")[1].split(";")[0]
        done = self.run_program(
            "can",
            "gateway",
            "--connect",
            place,
            given="# a comment\nset node 5\nr 0x2fff 0\nr 0x1018 4 u32\nquit\nr 0x1000 0\n",
        )
        self.assertEqual("OK\n1\n", done.stdout)
        self.assertEqual(
            "hal can gateway: r 0x2fff 0: object does not exist in the object dictionary (0x06020000)\n",
            done.stderr,
        )
        self.assertEqual(1, done.returncode)

    def test_a_client_sees_events_in_words_and_the_end_of_the_gateway(self):
        gateway = self.gateway("--socket", "gate")
        client = subprocess.Popen(
            ["hal", "can", "gateway", "--connect", "gate"],
            executable=str(HAL),
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(Case.end, self, client)
        client.stdin.write("5 reset comm\n")
        client.stdin.flush()
        self.assertEqual(
            {"OK\n", "net 1, node 5: BOOT_UP\n"},
            {client.stdout.readline(), client.stdout.readline()},
        )
        Case.end(self, gateway)
        self.assertEqual(
            "hal can gateway: the gateway at 'gate' closed the connection\n",
            client.stderr.readline(),
        )

    def test_a_client_without_a_gateway(self):
        self.assertEqual(
            "hal can gateway: cannot connect to the gateway at 'gate': No such file or directory; start one with: hal can gateway ADDRESS --socket gate\n",
            self.bad_can("gateway", "--connect", "gate", "help"),
        )
        self.assertEqual(
            "hal can gateway: invalid --connect ':6000': Name or service not known; write HOST:PORT, such as 127.0.0.1:6000\n",
            self.bad_can("gateway", "--connect", ":6000", "help"),
        )
        self.assertEqual(
            "hal can gateway: missing ADDRESS; type: hal can gateway can:can0, or as a client: hal can gateway --connect HOST:PORT\n",
            self.bad_can("gateway"),
        )

    def test_wrong_words(self):
        self.gateway("--socket", "gate")
        self.assertEqual(
            "hal can gateway: another gateway listens on 'gate'; choose another socket: --socket PATH\n",
            self.bad_can("gateway", self.bus, "--socket", "gate"),
        )
        self.write("file", "")
        self.assertEqual(
            "hal can gateway: 'file' exists and is not a socket; choose another: --socket PATH\n",
            self.bad_can("gateway", self.bus, "--socket", "file"),
        )
        self.assertEqual(
            "hal can gateway: --listen '0.0.0.0:6000' would let other machines command this bus; listen on 127.0.0.1 and forward the port: ssh -L\n",
            self.bad_can("gateway", self.bus, "--listen", "0.0.0.0:6000"),
        )
        self.assertEqual(
            "hal can gateway: invalid --listen '6000'; write 127.0.0.1:6000\n",
            self.bad_can("gateway", self.bus, "--listen", "6000"),
        )


if __name__ == "__main__":
    unittest.main()
