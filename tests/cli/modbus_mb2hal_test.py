# SPDX-License-Identifier: MIT
# packages: modbus
"""The configuration files of LinuxCNC's mb2hal: loadusr mb2hal config=FILE, and hal modbus mb2hal --check."""

import os
import signal
import unittest

from harness import TIMEOUT, Case, wait_until

SLAVES = """[bus]
link = sim:unused
[slave 1 drive]
read status = holding 0x100
read more = holding 0x101
read ready = discrete 4
read alarm = discrete 5
write command = holding 0x200
write speed = holding 0x201
write lamp = coil 16
write pump = coil 17
[slave 2 meter]
read power = input 0
"""

INI = """# a machine of LinuxCNC
[MB2HAL_INIT]
INIT_DEBUG=3
VERSION=1.1
HAL_MODULE_NAME=shop
SLOWDOWN=0.0
TOTAL_TRANSACTIONS=8

[TRANSACTION_00]
{link}
MB_SLAVE_ID=1
FIRST_ELEMENT=256
NELEMENTS=2
MB_TX_CODE=fnct_03_read_holding_registers
MB_RESPONSE_TIMEOUT_MS=200
MB_BYTE_TIMEOUT_MS=200
HAL_TX_NAME=state
MAX_UPDATE_RATE=50.0
DEBUG=1

[TRANSACTION_01]
MB_TX_CODE=fnct_02_read_discrete_inputs
FIRST_ELEMENT=4
PIN_NAMES=ready,alarm

[TRANSACTION_02]
MB_TX_CODE=fnct_06_write_single_register
FIRST_ELEMENT=512
NELEMENTS=1
HAL_TX_NAME=command

[TRANSACTION_03]
MB_TX_CODE=fnct_16_write_multiple_registers
FIRST_ELEMENT=513
NELEMENTS=1

[TRANSACTION_04]
MB_TX_CODE=fnct_15_write_multiple_coils
FIRST_ELEMENT=16
PIN_NAMES=lamp,pump

[TRANSACTION_05]
MB_SLAVE_ID=2
MB_TX_CODE=fnct_04_read_input_registers
FIRST_ELEMENT=0
NELEMENTS=1
HAL_TX_NAME=meter

[TRANSACTION_06]
MB_SLAVE_ID=1
MB_TX_CODE=fnct_03_read_holding_registers
FIRST_ELEMENT=512
NELEMENTS=1
HAL_TX_NAME=back

[TRANSACTION_07]
MB_TX_CODE=fnct_01_read_coils
FIRST_ELEMENT=16
NELEMENTS=2
HAL_TX_NAME=coils
"""

MACHINE = """loadrt threads name1=servo period1=1000000
loadusr -Wn shop mb2hal config=shop.ini
setp shop.command.00.float 3.9
start
"""


class Mb2hal(Case):
    def setUp(self):
        super().setUp()
        self.write("slaves.modbus", SLAVES)

    def node(self, link):
        settings = ["drive.status=1234", "drive.more=65535", "drive.alarm=1", "meter.power=42"]
        node = self.start_logged(
            "node",
            "modbus",
            "slaves.modbus",
            "--link",
            link,
            *[word for setting in settings for word in ("--set", setting)],
        )
        self.addCleanup(node.wait)
        self.addCleanup(node.kill)
        wait_until(
            lambda: "2 slaves on" in (self.folder / "node.log").read_text(), "the slaves run"
        )
        return node

    def pin(self, name):
        return self.shell("getp", name).stdout.strip()

    def run_machine(self, link, line):
        """The machine of MACHINE; `line`: the keys of the link."""
        node = self.node(link)
        self.write("shop.ini", INI.format(link=line))
        machine = self.start("run", self.write("a.hal", MACHINE))
        wait_until(lambda: self.pin("shop.meter.00.int") == "42", "the meter")
        return node, machine

    def test_on_tcp(self):
        port = 20000 + os.getpid() % 20000
        node, machine = self.run_machine(
            f"listen:{port}", f"LINK_TYPE=tcp\nTCP_IP=127.0.0.1\nTCP_PORT={port}"
        )
        wait_until(lambda: self.pin("shop.state.00.int") == "1234", "the status")
        self.assertEqual("1234", self.pin("shop.state.00.float"))
        self.assertEqual("65535", self.pin("shop.state.01.int"))
        wait_until(lambda: self.pin("shop.01.alarm.bit") == "TRUE", "the alarm")
        self.assertEqual("FALSE", self.pin("shop.01.alarm.bit-inv"))
        self.assertEqual("TRUE", self.pin("shop.01.ready.bit-inv"))
        back = "shop.back.00.int"
        wait_until(lambda: self.pin(back) == "3", "the command without its fraction")
        self.shell("setp", "shop.command.00.int", "4")
        wait_until(lambda: self.pin(back) == "7", "the sum of both pins")
        self.shell("setp", "shop.command.00.int", "70000")
        wait_until(lambda: self.pin(back) == "65535", "the limit")
        self.shell("setp", "shop.command.00.int", "-5")
        wait_until(lambda: self.pin(back) == "65534", "a negative number wraps")
        self.shell("setp", "shop.command.00.float", "1e300")
        wait_until(lambda: self.pin(back) == "65535", "the limit again")
        self.shell("setp", "shop.command.00.float", "nan")
        self.shell("setp", "shop.command.00.int", "5")  # nothing is written while one is invalid
        self.shell("setp", "shop.04.pump.bit", "TRUE")
        wait_until(lambda: self.pin("shop.coils.01.bit") == "TRUE", "the pump")
        self.assertEqual("65535", self.pin(back))
        self.shell("setp", "shop.command.00.float", "-1")
        wait_until(lambda: self.pin(back) == "4", "a number again")
        self.assertEqual("FALSE", self.pin("shop.coils.00.bit"))
        self.assertEqual("0", self.pin("shop.state.num_errors"))
        out, error = self.end(machine)
        self.assertIn(
            "mb2hal: slave 1 keeps what transaction 'command' has written (holding 512) when "
            "this program ends; the component modbus has stop telegrams\n",
            error,
        )

    def test_on_a_terminal_whose_slaves_end(self):
        node, machine = self.run_machine(
            "pty:line",
            "LINK_TYPE=serial\nSERIAL_PORT=line\nSERIAL_BAUD=38400\nSERIAL_BITS=8\n"
            "SERIAL_PARITY=none\nSERIAL_STOP=2",
        )
        node.send_signal(signal.SIGSTOP)
        for name in ("state", "01", "command", "03", "04", "meter", "back"):
            wait_until(
                lambda: int(self.pin(f"shop.{name}.num_errors")) > 3, f"the errors of {name}"
            )
        self.assertEqual("1234", self.pin("shop.state.00.int"))
        node.send_signal(signal.SIGCONT)
        for name in ("state", "01", "command", "03", "04", "meter", "back"):
            wait_until(lambda: self.pin(f"shop.{name}.num_errors") == "0", f"{name} again")
        self.shell("unloadusr", "shop")
        wait_until(lambda: "shop" not in self.shell("list", "comp").stdout.split(), "the end")

    def test_old_files_have_the_old_names(self):
        self.node("pty:line")
        text = INI.format(
            link="LINK_TYPE=serial\nSERIAL_PORT=line\nSERIAL_BAUD=38400\nSERIAL_BITS=8\n"
            "SERIAL_PARITY=none\nSERIAL_STOP=2"
        )
        self.write("shop.ini", text.replace("VERSION=1.1\n", ""))
        self.start("run", self.write("a.hal", MACHINE.replace(".float", "")))
        wait_until(lambda: self.pin("shop.01.alarm") == "TRUE", "the alarm")
        wait_until(lambda: self.pin("shop.state.01.float") == "65535", "the register")
        pins = self.shell("list", "pin", "shop").stdout.split()
        self.assertIn("shop.command.00", pins)
        self.assertIn("shop.04.pump", pins)
        self.assertNotIn("shop.command.00.int", pins)

    def check(self, text):
        self.write("x.ini", text)
        return self.run_program("modbus", "mb2hal", "--check", "x.ini")

    def test_invalid_files_are_rejected_with_their_place(self):
        tcp = "LINK_TYPE=tcp\nTCP_IP=127.0.0.1"
        good = INI.format(link=tcp)
        self.assertEqual("x.ini: 8 transactions on 1 line\n", self.check(good).stdout)
        for old, new, problem, remedy in [
            (tcp, "", "[TRANSACTION_00]LINK_TYPE is missing", "add LINK_TYPE = serial or"),
            (tcp, "LINK_TYPE=udp", "x.ini:10:11: error: [TRANSACTION_00]LINK_TYPE: 'udp'", "tcp"),
            (tcp, "LINK_TYPE=tcp", "[TRANSACTION_00]TCP_IP is missing", "TCP_IP = 192.168.1.20"),
            (
                tcp,
                "LINK_TYPE=serial\nSERIAL_PORT=/dev/x\nSERIAL_BAUD=9600\nSERIAL_BITS=7",
                "[TRANSACTION_00]SERIAL_BITS: '7' is invalid",
                "write 8: RTU frames are bytes",
            ),
            ("NELEMENTS=2", "", "[TRANSACTION_00]NELEMENTS is missing", "NELEMENTS = 4"),
            ("NELEMENTS=2", "NELEMENTS=101", "NELEMENTS: '101' is invalid", "1 to 100"),
            ("NELEMENTS=2", "NELEMENTS=2\nPIN_NAMES=a,b", "NELEMENTS: '2'", "either NELEMENTS"),
            ("ready,alarm", "ready, alarm", "PIN_NAMES: 'ready, alarm'", "names without blanks"),
            ("fnct_06_", "fnct_07_", "'fnct_07_write_single_register' is invalid", "fnct_16_"),
            ("HAL_TX_NAME=meter", "HAL_TX_NAME=state", "HAL_TX_NAME: 'state'", "no other"),
            ("TIONS=8", "TIONS=x", "[MB2HAL_INIT]TOTAL_TRANSACTIONS: 'x'", "1 to 1000"),
            ("TOTAL_TRANSACTIONS=8", "", "TOTAL_TRANSACTIONS is missing", "number of transac"),
            ("MB_SLAVE_ID=2", "MB_SLAVE_ID=300", "MB_SLAVE_ID: '300'", "0 to 255"),
        ]:
            done = self.check(good.replace(old, new, 1))
            self.assertEqual(1, done.returncode, new)
            self.assertIn(problem, done.stderr)
            self.assertIn(remedy, done.stderr)
        done = self.check(good.replace("TIONS=8", "TIONS=9"))
        self.assertEqual(1, done.returncode)
        self.assertIn("[TRANSACTION_08] is missing: TOTAL_TRANSACTIONS is 9", done.stderr)
        self.assertIn("= help: add the section, or lower TOTAL_TRANSACTIONS", done.stderr)
        warned = self.check(good.replace("TIONS=8", "TIONS=7"))
        self.assertEqual(0, warned.returncode)
        self.assertIn("[TRANSACTION_07] is not used: TOTAL_TRANSACTIONS is 7", warned.stderr)
        done = self.run_program("modbus", "mb2hal", "--check", "none.ini")
        self.assertEqual(1, done.returncode)
        self.assertIn("none.ini", done.stderr)


if __name__ == "__main__":
    unittest.main()
