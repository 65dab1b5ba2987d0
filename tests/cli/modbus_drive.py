# SPDX-License-Identifier: MIT
"""A frequency converter with Delta's registers on a pseudo terminal, for the tests of the guardian."""

import os
import pty
import select
import threading
import time
import tty

STOP = bytes.fromhex("010620000001 43CA")
BROADCAST_STOP = bytes.fromhex("000620000001 421B")
RUN = 0x12
SILENCE = 3.5  # characters between two frames


def crc16(frame):
    crc = 0xFFFF
    for byte in frame:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ 0xA001 if crc & 1 else crc >> 1
    return bytes([crc & 255, crc >> 8])


class Drive:
    """The converter, on the master end of a pseudo terminal, which has no speed of its own.

    With `baud` it is as slow as a line of 10 bits a character: a frame that is received ends when its last bit would have left, and an
    answer begins `thinking` seconds and a silence later and arrives as a whole when its last bit would have arrived.
    """

    def __init__(self, link, baud=None, thinking=0.0):
        self.character = 10 / baud if baud else 0.0
        self.thinking = thinking
        self.line_is_free = 0.0
        self.master, slave = pty.openpty()
        self.slave = slave  # held open: the master end reads EIO while nobody has it
        tty.setraw(slave)
        tty.setraw(self.master)
        self.link = link
        if os.path.islink(link):
            os.unlink(link)
        os.symlink(os.ttyname(slave), link)
        self.registers = {0x2000: 0, 0x2001: 0, 0x2002: 0, 0x2100: 0, 0x2103: 0}
        self.writes = []  # (time of the last bit, frame)
        self.answers = True
        self.ended = False
        self.thread = threading.Thread(target=self.serve, daemon=True)
        self.thread.start()

    def serve(self):
        received = b""
        while not self.ended:
            if not select.select([self.master], [], [], 0.02)[0]:
                received = b""  # a frame has no pause of 20 ms
                continue
            data = os.read(self.master, 512)
            self.line_is_free = max(time.monotonic(), self.line_is_free)
            self.line_is_free += len(data) * self.character
            received += data
            while len(received) >= 8:
                frame, received = received[:8], received[8:]
                if crc16(frame[:6]) == frame[6:]:
                    self.answer(frame)

    def answer(self, frame):
        address = frame[2] << 8 | frame[3]
        value = frame[4] << 8 | frame[5]
        if frame[1] == 6:
            self.writes.append((self.line_is_free or time.monotonic(), frame))
            self.registers[address] = value
            if address == 0x2001 or address == 0x2000:
                turning = self.registers[0x2000] & 3 == 2
                self.registers[0x2103] = self.registers[0x2001] if turning else 0
            reply = frame[:6]
        else:
            words = [self.registers.get(address + n, 0) for n in range(value)]
            reply = bytes([1, 3, 2 * value]) + b"".join(w.to_bytes(2, "big") for w in words)
        if self.answers and frame[0] != 0:  # nobody answers a broadcast
            self.send(reply + crc16(reply))

    def send(self, reply):
        if self.character:
            self.line_is_free += self.thinking + (SILENCE + len(reply)) * self.character
            time.sleep(max(0.0, self.line_is_free - time.monotonic()))
        os.write(self.master, reply)

    def close(self):
        if self.ended:
            return
        self.ended = True
        self.thread.join()
        if os.path.islink(self.link) and os.readlink(self.link) == os.ttyname(self.slave):
            os.unlink(self.link)  # the next terminal of another test may have this one's number
        os.close(self.master)
        os.close(self.slave)
