# SPDX-License-Identifier: MIT
"""Components of this program, and their pins and parameters."""
import json
import os
import signal
import threading

from hal import _core
from hal._base import (
    _BY_DIR,
    _BY_NUMBER,
    _DIRS,
    _TYPES,
    _good,
    _plain,
    HAL_BIT,
    HAL_IN,
    HAL_IO,
    HAL_OUT,
    HAL_PORT,
    HAL_RO,
    HAL_RW,
    Dir,
    InvalidArgument,
    Type,
    WrongKind,
    error,
)


def _interrupt_on_sigterm():
    """Raises KeyboardInterrupt on SIGTERM, so that a program that handles Ctrl-C also cleans up when it is unloaded."""
    if (
        threading.current_thread() is threading.main_thread()
        and signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
    ):
        signal.signal(signal.SIGTERM, signal.default_int_handler)


class Pin:
    """A pin or parameter of a component of this program. LinuxCNC's displays derive a class from it, whose objects are made from a pin."""

    def __init__(self, core, index=None):
        if index is None:
            core, index = core._core, core._index
        self._core, self._index = core, index
        self._name, self._full, number, word = core.describe(index)
        self._type, self._dir = _BY_NUMBER[number], _BY_DIR[word]

    def get(self):
        return self._core.get(self._index)

    def set(self, value):
        self._core.set(self._index, value)

    value = property(get, set)
    _item = property(lambda self: self)

    def _item_wrap(self, item):
        return self

    def get_name(self):
        return self._name

    def get_type(self):
        return int(self._type)

    def get_dir(self):
        return int(self._dir)

    name, type, dir = property(get_name), property(get_type), property(get_dir)

    def is_pin(self):
        return self._dir not in (Dir.RO, Dir.RW)

    def __repr__(self):
        return f"<hal {'pin' if self.is_pin() else 'parameter'} {self._full!r} {self._type.name}-{self._dir.name}>"

    # ports
    def _port(self, **what):
        return _good(self._core.request(json.dumps({"port": self._full, **what})))

    def size(self):
        return self._port()["size"]

    def readable(self):
        return self._port()["readable"]

    def writable(self):
        return self._port()["writable"]

    def _bytes(self, **what):
        reply = self._port(**what)
        return bytes.fromhex(reply["bytes"]) if reply["done"] else ""

    def read(self, count):
        """Returns `count` bytes, or an empty text while fewer are available."""
        return self._bytes(read=count)

    def peek(self, count):
        return self._bytes(peek=count)

    def write(self, data):
        """Writes all bytes and returns True, or writes nothing and returns False when the port has too little space."""
        return self._port(write=(data.encode() if isinstance(data, str) else bytes(data)).hex())[
            "done"
        ]

    def clear(self):
        self.read(self.readable())


class component:
    """A component of the running instance: component(name[, prefix]).

    Additions to LinuxCNC's: `timeout` is the time in seconds after this program's death at which its pins take their safe values
    (default 1; None: never), `safe` the safe value of every output pin for which newpin gives none (default: keep the last value).
    `every` declares the maximum interval in seconds between accesses to the pins or calls of alive(): after that interval plus `timeout`
    without an access, the program counts as not responding, and its outputs take their safe values until the next access.
    `lost` is the reaction to the end of the machine: "end" ends the program as SIGTERM does, "stay" reconnects when the machine runs
    again (default: $HALCYON_LOST, which loadusr sets to end, else stay).
    """

    def __init__(self, name, prefix=None, *, timeout=1.0, safe=None, every=None, lost=None):
        lost = lost or os.environ.get("HALCYON_LOST") or "stay"
        if lost not in ("end", "stay"):
            raise ValueError(f"invalid lost={lost!r}; use 'end' or 'stay'")
        object.__setattr__(self, "_ready", False)
        object.__setattr__(
            self,
            "_core",
            _core.Component(
                name,
                prefix if prefix is not None else name,
                -1 if timeout is None else int(timeout * 1000),
                max(1, int(every * 1000)) if every else 0,
                lost == "end",
            ),
        )
        object.__setattr__(self, "_safe", safe)
        object.__setattr__(self, "_name", name)
        _interrupt_on_sigterm()

    def _new(self, name, kind, dir, safe, doc, unit):
        if self._ready:
            raise error(
                f"Invalid argument: component {self._name!r} is ready; create pins and parameters before ready() or after unready()"
            )
        if kind not in Type.__members__.values():
            raise InvalidArgument(f"Invalid argument: {kind!r} is not a HAL type")
        word, number = _TYPES[Type(kind)]
        more = {key: value for key, value in (("doc", doc), ("unit", unit)) if value}
        if safe is None and dir in (Dir.OUT, Dir.IO) and kind != HAL_PORT:
            safe = self._safe
        if safe is not None and safe != "keep":
            more["safe"] = bool(safe) if kind == HAL_BIT else _plain(safe)
        return Pin(self._core, self._core.add(name, number, _DIRS[Dir(dir)], json.dumps(more)))

    def newpin(self, name, type, dir, *, safe=None, doc="", unit=""):
        if dir not in (HAL_IN, HAL_OUT, HAL_IO):
            raise InvalidArgument(
                f"Invalid argument: invalid direction of pin {name!r}; use HAL_IN, HAL_OUT or HAL_IO"
            )
        return self._new(name, type, dir, safe, doc, unit)

    def newparam(self, name, type, dir, *, safe=None, doc="", unit=""):
        if dir not in (HAL_RO, HAL_RW):
            raise InvalidArgument(
                f"Invalid argument: invalid direction of parameter {name!r}; use HAL_RO or HAL_RW"
            )
        return self._new(name, type, dir, safe, doc, unit)

    def ready(self):
        self._core.ready(True)
        object.__setattr__(self, "_ready", True)

    def unready(self):
        self._core.ready(False)
        object.__setattr__(self, "_ready", False)

    def alive(self):
        """Reports activity, for a component with `every` that accesses no pin for longer than that."""
        self._core.alive()

    def exit(self):
        self._core.leave(True)

    def getprefix(self):
        return self._core.prefix()

    def setprefix(self, prefix):
        self._core.set_prefix(prefix)

    def getitem(self, name):
        index = self._core.find(name)
        if index < 0:
            raise AttributeError(f"component {self._name!r} has no pin or parameter {name!r}")
        return Pin(self._core, index)

    def getpin(self, name):
        item = self.getitem(name)
        if not item.is_pin():
            raise WrongKind(f"{name!r} is a parameter")
        return item

    def getparam(self, name):
        item = self.getitem(name)
        if item.is_pin():
            raise WrongKind(f"{name!r} is a pin")
        return item

    def getpins(self):
        """Returns the values of all pins and parameters by name."""
        return {self._core.describe(i)[0]: self._core.get(i) for i in range(self._core.size())}

    def connected(self):
        """Returns whether the instance is running. While it is not, values stay as they are, and the component tries to reconnect."""
        return self._core.connected()

    def __getitem__(self, name):
        return self._core.get_named(name)

    def __setitem__(self, name, value):
        self._core.set_named(name, value)

    def __contains__(self, name):
        return self._core.find(name) >= 0

    def __len__(self):
        return self._core.size()

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        return self._core.get_named(name)

    def __setattr__(self, name, value):
        if self._core.find(name) >= 0:
            self._core.set_named(name, value)
        else:
            object.__setattr__(self, name, value)

    def __repr__(self):
        return f"<hal component {self._name!r} with {len(self)} pins and parameters>"
