# SPDX-License-Identifier: MIT
"""LinuxCNC's second Python interface, on top of the module hal."""
import enum
import time

import hal


class halType(enum.IntEnum):
    BIT = hal.HAL_BIT
    FLOAT = hal.HAL_FLOAT
    SIGNED = hal.HAL_S32
    UNSIGNED = hal.HAL_U32
    S64 = hal.HAL_S64
    U64 = hal.HAL_U64
    PORT = hal.HAL_PORT


class pinDir(enum.IntEnum):
    IN = hal.HAL_IN
    OUT = hal.HAL_OUT
    IO = hal.HAL_IO


class _Pin(hal.Pin):
    def _wait(self, enough):
        while not enough():
            time.sleep(0.001)

    def waitWritable(self, count):
        self._wait(lambda: self.writable() >= count)

    def waitReadable(self, count):
        self._wait(lambda: self.readable() >= count)


class component:
    def __init__(self, name):
        self._component = hal.component(name)
        self.pins = {}

    def pinNew(self, name, type, dir):
        made = self._component.newpin(name, int(type), int(dir))
        self.pins[name] = _Pin(made._core, made._index)
        return self.pins[name]

    def sigNew(self, name, type):
        return hal.new_sig(name, int(type))

    def sigLink(self, pin, signal):
        return hal.connect(pin, signal)

    def ready(self):
        self._component.ready()

    def exit(self):
        self._component.exit()
