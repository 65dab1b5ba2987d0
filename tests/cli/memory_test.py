# SPDX-License-Identifier: MIT
"""A machine with all its memory locked fits on a small board, and stays as small: edits that are reverted and files that are read leave nothing."""
import json
import re
import socket
import unittest
from pathlib import Path

from harness import SANITIZED, SERVO, TIMEOUT, Case

HANG = Path(__file__).parents[2] / "halfiles/furuta/hang.hal"
MOST_KB = 24 * 1024
EDITS = 100_000
FILES = 1000
FLAT_KB = 1536  # what the allocator may keep: 15 bytes of an edit
MOST_TRIES = 100  # of an edit that a busy host withdraws

# Each pair of lines leaves the machine as it was.
PAIRS = [
    ("net x{i} adder.out", "delsig x{i}"),
    ("newsig y{i} float", "delsig y{i}"),
    ("alias pin adder.in1 a{i}", "unalias pin a{i}"),
    ("loadrt and2 names=g{i}", "unloadrt g{i}"),
    ("loadrt or2", "unloadrt or2"),
    ("delf adder servo", "addf adder servo"),
    ("net total => adder.in0", "unlinkp adder.in0"),
    ("net wrong{i} nothing{i}.out", "setp adder.in1 {i}"),
    ("net odd{i} <= adder.in0", "delsig odd{i}"),
    ("newthread t{i} 2000000", "delthread t{i}"),
]


def resident_kb(machine):
    return int(
        re.search(r"Rss:\s*(\d+) kB", Path(f"/proc/{machine.pid}/smaps_rollup").read_text())[1]
    )


def withdrawn(reply):
    """A thread that gets no CPU time does not take an edit, which then has no effect."""
    return re.search(r"\[(silent|starved|hung)-thread\]", reply["err"]) is not None


class Client:
    """A connection that sends many requests at once."""

    def __init__(self, case):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(4 * TIMEOUT)
        self.socket.connect(str(case.folder / "halcyon" / "default.sock"))
        self.lines = self.socket.makefile("rb")
        self.lines.readline()

    def ask(self, lines):
        """Returns the replies."""
        self.socket.sendall(b"".join(json.dumps({"run": line}).encode() + b"\n" for line in lines))
        return [json.loads(self.lines.readline()) for _ in lines]

    def run(self, lines):
        """Returns the statuses. A line that a busy host has withdrawn is run again."""
        return [self.settle(line)["status"] for line in lines]

    def settle(self, line):
        """Runs a line until it is not withdrawn; its last reply."""
        for _ in range(MOST_TRIES):
            reply = self.ask([line])[0]
            if not withdrawn(reply):
                return reply
        raise AssertionError(f"'{line}' was withdrawn {MOST_TRIES} times: {reply['err']}")


@unittest.skipIf(SANITIZED, "a sanitizer's own memory is what would be measured")
class Memory(Case):
    def test_the_furuta_machine_is_small(self):
        machine = self.start("run", "--no-picture", HANG, loaded=False)
        self.assertTrue(
            any("running" in line for line in iter(machine.stdout.readline, "")), "it does not run"
        )
        resident = int(
            re.search(r"VmRSS:\s*(\d+) kB", Path(f"/proc/{machine.pid}/status").read_text())[1]
        )
        print(f"{resident} kB resident")
        self.assertLess(resident, MOST_KB)

    def test_reverted_edits_leave_nothing(self):
        machine = self.start(
            "run",
            "--no-picture",
            self.write("m.hal", SERVO.replace("net total adder.out\n", "newsig total float\n")),
        )
        client = Client(self)
        number = 0

        def edit(count):
            nonlocal number
            while count > 0:
                pairs = []
                for _ in range(20):
                    number += 1
                    pairs += [[line.format(i=number) for line in pair] for pair in PAIRS]
                lines = [line for pair in pairs for line in pair]
                replies = client.ask(lines)
                if any(withdrawn(reply) for reply in replies):
                    for _, reverts in pairs:  # all of them anew; what was not edited is an error
                        client.settle(reverts)
                    continue
                failed = sum(reply["status"] for reply in replies)
                self.assertEqual(20, failed, lines)  # the line that is wrong
                count -= len(lines)

        edit(EDITS // 10)
        before = resident_kb(machine)
        edit(EDITS)
        grown = resident_kb(machine) - before
        print(f"{EDITS} edits: {grown} kB")
        self.assertLess(grown, FLAT_KB)

    def test_files_that_were_read_leave_nothing(self):
        machine = self.start("run", "--no-picture", self.write("m.hal", SERVO))
        client = Client(self)
        comment = "# " + "x" * 98 + "\n"
        large = self.write(
            "large.hal", 9000 * comment + "newsig large float\nsetp adder.in0 1\ndelsig large\n"
        )

        def read(count):
            for number in range(count):
                name = f"f{number}.hal"
                self.write(
                    name, 100 * comment + f"newsig s{number} float\nnet s{number} => adder.in1\n"
                )
                self.assertEqual(
                    [0, 0, 0],
                    client.run([f"source {name}", f"delsig s{number}", "setp adder.in1 3"]),
                )
            for _ in range(50):
                self.assertEqual([0], client.run([f"source {large}"]))

        read(100)
        before = resident_kb(machine)
        read(FILES)
        grown = resident_kb(machine) - before
        print(f"{FILES} files of 10 kB, 50 times one of 0.9 MB: {grown} kB")
        self.assertLess(grown, FLAT_KB)

    def test_clients_and_programs_that_end_leave_nothing(self):
        machine = self.start("run", "--no-picture", self.write("m.hal", SERVO))
        client = Client(self)

        def use(first, count):
            for number in range(first, first + count):
                other = Client(self)
                other.socket.sendall(
                    json.dumps(
                        {
                            "component": f"panel{number}",
                            "pins": [
                                {
                                    "name": "value",
                                    "type": "float",
                                    "dir": "out",
                                    "doc": f"a text that no other pin has, {number} " + "y" * 200,
                                }
                            ],
                            "ready": True,
                        }
                    ).encode()
                    + b"\n"
                )
                self.assertTrue(json.loads(other.lines.readline())["ok"])
                other.socket.sendall(
                    b'{"subscribe":["adder.out"]}\n{"probe":["adder.out"]}\n{"exit":"panel%d"}\n'
                    % number
                )
                other.lines.readline()
                other.lines.close()
                other.socket.close()
                self.assertIn(client.run([f"unload panel{number}"])[0], (0, 1))

        use(0, 300)
        before = resident_kb(machine)
        use(300, 2000)
        grown = resident_kb(machine) - before
        print(f"2000 programs and clients: {grown} kB")
        self.assertLess(grown, FLAT_KB)


if __name__ == "__main__":
    unittest.main()
