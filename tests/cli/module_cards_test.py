#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: linuxcnc
"""What compiled modules of LinuxCNC access: PCI cards, here folders like the kernel's, and I/O ports."""
import struct
import unittest

import harness
from module_case import CC, THREAD, ModuleCase


@unittest.skipUnless(CC, "no C compiler")
class Cards(ModuleCase):
    def add_card(
        self, address, subdevice, registers, kind=0x118000, bars=((0xFE000000, 0xFE000FFF, 0x200),)
    ):
        """A folder as the kernel has one for each PCI card, with 4096 bytes of registers."""
        folder = self.folder / "pci" / address
        folder.mkdir(parents=True)
        for name, value in (
            ("vendor", 0x2718),
            ("device", 0x5125),
            ("subsystem_vendor", 0x2718),
            ("subsystem_device", subdevice),
            ("class", kind),
        ):
            (folder / name).write_text(f"0x{value:04x}\n")
        (folder / "enable").write_text("0\n")
        (folder / "resource").write_text(
            "".join(
                f"0x{a:016x} 0x{b:016x} 0x{c:016x}\n" for a, b, c in [*bars, *[(0, 0, 0)] * 6][:6]
            )
        )
        (folder / "resource0").write_bytes(struct.pack("<4I", *registers).ljust(4096, b"\0"))
        self.environment["HALCYON_PCI"] = str(self.folder / "pci")
        return folder

    def registers(self, folder):
        return struct.unpack("<4I", (folder / "resource0").read_bytes()[:16])

    def test_a_driver_uses_the_memory_of_its_card(self):
        self.build("card")
        other = self.add_card(
            "0000:01:00.0", 0x1, (0, 0, 0, 0), kind=0x20000
        )  # no row of the driver's table
        first = self.add_card("0000:02:00.0", 0x3427, (0xCA4D, 7, 42, 0))
        second = self.add_card("0000:03:00.0", 0x99, (0xCA4D, 7, 43, 0))
        out = self.sim(
            THREAD
            + "loadrt card\nloadusr -w true\naddf card t\nsetp card.out 99\nstart\nadvance 3 cycles\ngetp card.in\nloadusr -w cp "
            + str(first / "resource0")
            + " "
            + str(self.folder / "seen")
            + "\nunloadrt card\n"
        )
        self.assertEqual(
            (
                0,
                "42\n",
                "card: 0000:02:00.0 2718:5125 2718:3427 class 118000, row for 3427, 4096 bytes\n"
                "card: 0000:03:00.0 2718:5125 2718:0099 class 118000, row for ffffffff, 4096 bytes\n"
                "card: the card at 0000:03:00.0 is not used: its driver declines it (-16)\n",
            ),
            (out.returncode, out.stdout, out.stderr),
        )
        self.assertEqual(
            (0xCA4D, 3, 42, 99), struct.unpack("<4I", (self.folder / "seen").read_bytes()[:16])
        )
        self.assertEqual(
            (0xCA4D, 0, 42, 99), self.registers(first)
        )  # the remove function of its driver has run
        self.assertEqual(
            ((0, 0, 0, 0), (0xCA4D, 7, 43, 0)), (self.registers(other), self.registers(second))
        )
        self.assertEqual(
            ["1", "0\n"],
            [
                (folder / "enable").read_text()[:2].strip()
                if folder is first
                else (folder / "enable").read_text()
                for folder in (first, second)
            ],
        )

    def test_a_failed_load_gives_its_card_back(self):
        self.build("card")
        self.add_card("0000:02:00.0", 0x3427, (0xCA4D, 7, 42, 0))
        self.write("maps.sh", "grep -c resource0 /proc/$PPID/maps >> counts\ntrue\n")
        self.sim("loadrt card\nloadusr -w sh maps.sh\n")
        done = self.sim(
            "loadrt card fails=1\nloadusr -w sh maps.sh\nloadrt card\ngetp card.in\nloadusr -w sh maps.sh\n",
            "-k",
        )
        self.assertIn("rtapi_app_main: Input/output error (-5)", done.stderr)
        self.assertEqual(["1", "0", "1"], (self.folder / "counts").read_text().split(), done.stderr)

    def test_a_card_that_is_missing_or_cannot_be_used_is_an_error(self):
        self.build("card")
        self.add_card("0000:01:00.0", 0x1, (0, 0, 0, 0), kind=0x20000)
        self.assertIn(
            f"card: no such card in {self.folder}/pci (rtapi_app_main: No such device (-19))",
            self.error("loadrt card\n"),
        )
        folder = self.add_card("0000:02:00.0", 0x3427, (0, 0, 0, 0))
        self.assertIn(
            "card: the card at 0000:02:00.0 is not used: its driver declines it (-19)",
            self.error("loadrt card\n"),
        )  # another card with the same numbers
        self.assertIn(
            "0000:02:00.0: region 3 is not memory", self.error("loadrt card number_of_bar=3\n")
        )
        (folder / "resource0").unlink()
        self.assertIn(
            f"0000:02:00.0: cannot map {folder}/resource0: No such file or directory",
            self.error("loadrt card\n"),
        )
        (folder / "enable").unlink()
        self.assertIn(
            f"0000:02:00.0: cannot open {folder}/enable: No such file or directory",
            self.error("loadrt card\n"),
        )

    def test_ports_are_for_who_may_use_them(self):
        self.build("port")
        done = self.sim(
            THREAD
            + "loadrt port\naddf port.read t\nstart\nadvance 2 cycles\ngetp port.status\nunloadrt port\n"
        )
        if done.returncode == 0:  # as root, on a PC
            self.assertIn(int(done.stdout), range(256, 512))
            self.assertIn(
                'port: the kernel has no parallel port 9; give the address, as in cfg="0x378" (rtapi_app_main: No such file or directory (-2))',
                self.error("loadrt port base=9\n"),
            )
            machine = self.start(
                "run", self.write("real.hal", THREAD + "loadrt port\naddf port.read t\nstart\n")
            )  # in a thread that existed before
            harness.wait_until(
                lambda: machine.poll() is not None or self.value("port.status") not in ("", "0"),
                "a status",
            )
            self.assertIn(int(self.value("port.status")), range(256, 512))
            self.end(machine)
        else:
            self.assertRegex(
                done.stderr,
                r"port: parallel port at 0x378: (this processor has no I/O ports \(rtapi_app_main: No such device \(-19\)\)|this kernel permits no program "
                r"to access I/O ports \(it is built without CONFIG_X86_IOPL_IOPERM\) \(rtapi_app_main: Function not implemented \(-38\)\)|"
                r"access to I/O ports needs the capability CAP_SYS_RAWIO; (type: sudo setcap cap_sys_nice,cap_ipc_lock,cap_net_raw(,cap_net_admin)?,cap_sys_rawio=ep \S+|"
                r"--cap-add=SYS_NICE .*--cap-add=SYS_RAWIO in the command that starts this container, which withholds them) "
                r"\(rtapi_app_main: Operation not permitted \(-1\)\))",
            )

    # --- pins of type port -----------------------------------------------------------------------------------------------

    def test_bytes_go_through_a_port_in_their_order(self):
        self.build("bytes")
        show = "getp bytes.good\ngetp bytes.written\ngetp bytes.read\ngetp bytes.waiting\ngetp bytes.room\ngetp bytes.size\n"
        done = self.sim(
            THREAD
            + "loadrt bytes\naddf bytes.write t\naddf bytes.read t\nstart\nadvance 2 cycles\n"
            + show  # no signal
            + "net stream bytes.to => bytes.from\nadvance 1 cycles\n"
            + show
            + "sets stream 64\nadvance 40 cycles\n"
            + show
            + "setp bytes.clear TRUE\nadvance 1 cycles\n"
            + show
            + "delsig stream\nadvance 1 cycles\n"
            + show
            + "unloadrt bytes\nadvance 1 cycles\nloadrt bytes\ngetp bytes.written\n"
        )
        self.assertEqual(
            "hal_pin_port_new: 'bytes.both': invalid direction: a port has one writer and one reader\n"
            * 2,
            done.stderr,
        )
        words = done.stdout.split()
        self.assertEqual([["TRUE", "0", "0", "0", "0", "0"]] * 2, [words[0:6], words[6:12]])
        # 40 cycles: 200 bytes written, 160 read; from the 61st byte that wait on, the writer finds no space at times
        written, read, waiting, room, size = (int(word) for word in words[13:18])
        self.assertEqual(("TRUE", 160, written - read, 64), (words[12], read, waiting, size))
        self.assertIn(waiting, range(40, 65))
        self.assertEqual(64 - waiting - 4, room)  # the writer came before the reader
        self.assertEqual(["TRUE", "0"], [words[18], words[21]])
        self.assertEqual(["TRUE", "0", "0", "0", "0"], [words[24], *words[27:30], words[30]])


if __name__ == "__main__":
    unittest.main()
