# SPDX-License-Identifier: MIT
# packages: canopen
"""Frames that the kernel drops while a program has no CPU are counted, also when no frame follows."""

import signal
import unittest

from can_test import Can
from harness import TIMEOUT, wait_until

SENT = 4000


class Lost(Can):
    def waiting(self):
        """Whether a receive queue of the bus has frames."""
        port = f"{int(self.bus.rsplit(':', 1)[1]):04X}"
        with open("/proc/net/udp", encoding="ascii") as table:
            for line in table:
                fields = line.split()
                if fields[1].endswith(":" + port) and int(fields[4].split(":")[1], 16) > 0:
                    return True
        return False

    def overload(self, *words):
        """Standard error and status of a listener that is suspended while frames arrive."""
        process = self.listener(words[0], self.bus + "?receivequeue=64", *words[1:])
        process.send_signal(signal.SIGSTOP)
        sent = self.run_program(
            "can", "generate", self.bus, "--count", str(SENT), "--every", "10us"
        )
        process.send_signal(signal.SIGCONT)
        self.assertEqual(0, sent.returncode, sent.stderr)
        wait_until(lambda: not self.waiting(), "the queue is empty")
        process.send_signal(signal.SIGINT)
        _, error = process.communicate(timeout=2 * TIMEOUT)
        return error, process.returncode

    def test_a_recording_that_lacks_frames_ends_with_an_error(self):
        error, status = self.overload("record", "seen.log")
        received, lost = (int(word) for word in (error.split()[0], error.split()[-2]))
        self.assertGreater(lost, 0)
        self.assertEqual(SENT, received + lost)
        self.assertEqual(1, status)

    def test_a_dump_counts_them(self):
        error, _ = self.overload("dump")
        words = error.replace(",", "").split()
        lost = int(words[words.index("lost") - 1])
        self.assertGreater(lost, 0)
        self.assertEqual(SENT, int(words[0]) + lost)

    def test_the_load_counts_them(self):
        error, _ = self.overload("load")
        words = error.split()
        self.assertGreater(int(words[words.index("lost") - 1]), 0)


if __name__ == "__main__":
    unittest.main()
