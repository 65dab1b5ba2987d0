# SPDX-License-Identifier: MIT
"""HAL from Python, under LinuxCNC's names: components, pins, parameters, signals and streams of a running instance.

    import hal
    c = hal.component("blinker")
    c.newpin("lamp", hal.HAL_BIT, hal.HAL_OUT)
    c.ready()
    c["lamp"] = True

The instance is $HALCYON_INSTANCE (set for what loadusr starts), else the only one that runs, else `default`.
docs/tutorials/python.md tells the rest.
"""
import atexit
import enum
import errno
import json
import math
import os
import signal
import sys
import threading

from hal import _core

error = _core.error
error.__module__ = "hal"


# What LinuxCNC raises, and what Python's own habits expect, in one.
class InvalidArgument(error, ValueError):
    pass


class WrongKind(error, AttributeError):
    pass


class StreamError(error, OSError):
    pass


class Type(enum.IntEnum):
    BOOL = 1
    BIT = 1
    REAL = 2
    FLOAT = 2
    S32 = 3
    U32 = 4
    PORT = 5
    SINT = 6
    S64 = 6
    UINT = 7
    U64 = 7


class Dir(enum.IntEnum):
    IN = 16
    OUT = 32
    IO = 48
    RO = 64
    RW = 192


HAL_BIT, HAL_FLOAT, HAL_S32, HAL_U32, HAL_PORT, HAL_S64, HAL_U64 = (int(t) for t in (Type.BIT, Type.FLOAT, Type.S32, Type.U32, Type.PORT, Type.S64, Type.U64))
HAL_IN, HAL_OUT, HAL_IO, HAL_RO, HAL_RW = (int(d) for d in Dir)
MSG_NONE, MSG_ERR, MSG_WARN, MSG_INFO, MSG_DBG, MSG_ALL = range(6)
RTAPI_MSG_NONE, RTAPI_MSG_ERR, RTAPI_MSG_WARN, RTAPI_MSG_INFO, RTAPI_MSG_DBG, RTAPI_MSG_ALL = range(6)
is_kernelspace, is_userspace, is_rt, is_sim = 0, 1, 1, 0
streamer_base, sampler_base = 0x48530000, 0x48540000

# the protocol's names, and the order of the runtime's types
_TYPES = {Type.BIT: ("bit", 0), Type.FLOAT: ("float", 1), Type.S32: ("s32", 2), Type.U32: ("u32", 3), Type.S64: ("s64", 4), Type.U64: ("u64", 5),
          Type.PORT: ("port", 6)}
_BY_NAME = {name: kind for kind, (name, _) in _TYPES.items()}
_BY_NUMBER = {number: kind for kind, (_, number) in _TYPES.items()}
_DIRS = {Dir.IN: "in", Dir.OUT: "out", Dir.IO: "io", Dir.RO: "ro", Dir.RW: "rw"}
_BY_DIR = {word: dir for dir, word in _DIRS.items()} | {"IN": Dir.IN, "OUT": Dir.OUT, "I/O": Dir.IO, "RO": Dir.RO, "RW": Dir.RW}

_link = _core.Link()
_msg_level = MSG_ERR


def _good(text):
    reply = json.loads(text)
    if not reply.get("ok"):
        raise error(reply.get("error", "no answer"))
    return reply


def _ask(**body):
    _core.flush_all()
    return _good(_link.request(json.dumps(body)))


def _run(command, *words):
    """One line of the command language; raises what it complains of."""
    def quoted(word):
        return f'"{word}"' if any(c in word for c in " \t$[]{}#'") else word
    reply = _ask(run=" ".join([command, *(quoted(str(word)) for word in words)]), name="<python>")
    if reply["status"] != 0:
        raise error(reply["err"].strip() or f"{command} failed")
    return reply["out"]


def _value(value, kind):
    """A value of the protocol in Python."""
    return float(value) if kind == Type.FLOAT else value


def _word(value):
    return "TRUE" if value is True else "FALSE" if value is False else repr(value) if isinstance(value, float) else str(value)


def _plain(value):
    """A value of Python in the protocol."""
    if isinstance(value, float) and not math.isfinite(value):
        return "nan" if math.isnan(value) else "inf" if value > 0 else "-inf"
    return value


class Pin:
    """A pin or parameter of a component of this program."""

    __slots__ = ("_core", "_index", "_name", "_type", "_dir", "_full")

    def __init__(self, core, index):
        self._core, self._index = core, index
        self._name, self._full, number, word = core.describe(index)
        self._type, self._dir = _BY_NUMBER[number], _BY_DIR[word]

    def get(self):
        return self._core.get(self._index)

    def set(self, value):
        self._core.set(self._index, value)

    value = property(get, set)

    def get_name(self):
        return self._name

    def get_type(self):
        return int(self._type)

    def get_dir(self):
        return int(self._dir)

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
        """So many bytes, or an empty text while there are fewer."""
        return self._bytes(read=count)

    def peek(self, count):
        return self._bytes(peek=count)

    def write(self, data):
        """True when all of it had room; otherwise nothing was written."""
        return self._port(write=(data.encode() if isinstance(data, str) else bytes(data)).hex())["done"]

    def clear(self):
        self.read(self.readable())


class component:
    """A component of the running instance: component(name[, prefix]).

    Beyond LinuxCNC's: `timeout` is how many seconds after this program's death its pins take their declared values (default 1;
    None: never), `safe` what all output pins are declared to take then unless newpin says otherwise (default: they keep their value).
    `every` declares that the program accesses its pins, or calls alive(), at least every so many seconds: when it has not for `timeout`
    longer, it counts as not responding, and its outputs take their declared values until it does again.
    `lost` is what happens when the machine is gone: "end" ends the program as SIGTERM does, "stay" looks for the machine until it is
    back (default: $HALCYON_LOST, which loadusr sets to end, else stay).
    """

    def __init__(self, name, prefix=None, *, timeout=1.0, safe=None, every=None, lost=None):
        lost = lost or os.environ.get("HALCYON_LOST") or "stay"
        if lost not in ("end", "stay"):
            raise ValueError(f"lost is 'end' or 'stay', not {lost!r}")
        object.__setattr__(self, "_ready", False)
        object.__setattr__(self, "_core", _core.Component(name, prefix if prefix is not None else name, -1 if timeout is None else int(timeout * 1000),
                                                          max(1, int(every * 1000)) if every else 0, lost == "end"))
        object.__setattr__(self, "_safe", safe)
        object.__setattr__(self, "_name", name)
        _be_told_to_end()

    def _new(self, name, kind, dir, safe, doc, unit):
        if self._ready:
            raise error(f"Invalid argument: component {self._name!r} is ready; pins and parameters are made before ready(), or after unready()")
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
            raise InvalidArgument("Invalid argument: the direction of a pin is HAL_IN, HAL_OUT or HAL_IO")
        return self._new(name, type, dir, safe, doc, unit)

    def newparam(self, name, type, dir, *, safe=None, doc="", unit=""):
        if dir not in (HAL_RO, HAL_RW):
            raise InvalidArgument("Invalid argument: the direction of a parameter is HAL_RO or HAL_RW")
        return self._new(name, type, dir, safe, doc, unit)

    def ready(self):
        self._core.ready(True)
        object.__setattr__(self, "_ready", True)

    def unready(self):
        self._core.ready(False)
        object.__setattr__(self, "_ready", False)

    def alive(self):
        """A sign of life, for a component with `every` that accesses no pin for longer than that."""
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
        """All pins and parameters with their values."""
        return {self._core.describe(i)[0]: self._core.get(i) for i in range(self._core.size())}

    def connected(self):
        """Whether the instance is there; while it is not, values stay as they are, and it is looked for."""
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


class stream:
    """A FIFO of records: stream(component, key, depth, types) makes one, stream(component, key[, types]) uses one that is there.

    The keys streamer_base + N and sampler_base + N are those of the components streamer and sampler.
    """

    def __init__(self, comp, key, *rest):
        depth = rest[0] if rest and not isinstance(rest[0], str) else None
        types = rest[-1] if rest and isinstance(rest[-1], str) else None
        if depth is not None and types is None:
            raise TypeError("stream(component, key, depth, types)")
        for letter in types or "":
            if letter.lower() not in "bfsulk":
                raise ValueError(f"{letter!r} is no type of a column; they are: b f s u l k")
        types = types.lower() if types else None
        base = next((word for word, first in (("sampler", sampler_base), ("streamer", streamer_base)) if 0 <= key - first < 64), None)
        self._name = f"{base}.{key - (sampler_base if base == 'sampler' else streamer_base)}" if base else f"stream.{key}"
        self._comp, self._waiting, self._taken = comp._core, [], 0
        self.num_overruns = self.num_underruns = self.sampleno = 0
        if depth is not None:  # one record stays free, as LinuxCNC has it
            about = self._ask(create={"types": types, "depth": max(depth - 1, 1)}, owner=comp._name)
        else:
            about = self._ask()
            if types is not None and types != about["types"]:
                raise StreamError(f"stream {self._name} has the types {about['types']}, not {types}")
        self._types, self.maxdepth = about["types"], about["depth"]

    @property
    def element_types(self):
        return self._types.encode()

    def _ask(self, **what):
        try:
            return _good(self._comp.request(json.dumps({"stream": self._name, **what})))
        except error as refusal:
            raise StreamError(str(refusal)) from None

    @property
    def depth(self):
        return self._ask()["waiting"] + len(self._waiting)

    @property
    def readable(self):
        return bool(self._waiting) or self._ask()["waiting"] > 0

    @property
    def writable(self):
        about = self._ask()
        return about["waiting"] < about["depth"]

    def read(self):
        """The next record as a tuple, or None while there is none."""
        if not self._waiting:
            reply = self._ask(take=100)
            self._waiting = list(zip(reply["numbers"], reply["records"]))[::-1]
        if not self._waiting:
            self.num_underruns += 1
            return None
        number, record = self._waiting.pop()
        self.sampleno = number + 1
        return tuple(float(value) if letter == "f" else value for letter, value in zip(self._types, record))

    def write(self, record):
        row = [bool(value) if letter == "b" else _plain(float(value)) if letter == "f" else int(value) for letter, value in zip(self._types, record)]
        if len(row) != len(self._types) or len(record) != len(row):
            raise ValueError(f"a record has {len(self._types)} values")
        if self._ask(records=[row])["taken"] == 0:
            self.num_overruns += 1
            raise StreamError(errno.ENOSPC, f"stream {self._name} is full")


# --- functions of the module ------------------------------------------------------------------------------------------------

def _objects(kind, name):
    return next((one for one in _ask(describe=kind, patterns=[name])["objects"] if name in (one["name"], one.get("alias"))), None)


def component_exists(name):
    return name in _ask(list="comp", patterns=[name])["names"]


def component_is_ready(name):
    about = _objects("comp", name)
    return about is not None and about.get("ready", True)


def _failed(command, *words):
    """As LinuxCNC's functions for signals: prints what is wrong and returns True, or returns False when all is well."""
    try:
        _run(command, *words)
    except error as problem:
        if _msg_level >= MSG_ERR:
            print(problem, file=sys.stderr)
        return True
    return False


def new_sig(name, type):
    """Makes a signal. False when all went well, as LinuxCNC's; True after printing why not."""
    if type not in Type.__members__.values():
        raise InvalidArgument(f"{type!r} is not a HAL type")
    return _failed("newsig", name, _TYPES[Type(type)][0])


def connect(pin, signal):
    """Links a pin to a signal. False when all went well, as LinuxCNC's; True after printing why not."""
    return _failed("linkps", pin, signal)


def disconnect(pin):
    """Takes a pin off its signal. False when all went well, as LinuxCNC's; True after printing why not."""
    return _failed("unlinkp", pin)


def pin_has_writer(name):
    about = _objects("pin", name)
    if about is None:
        raise error(f"unknown pin '{name}'")
    return "signal" in about and "writer" in _objects("sig", about["signal"])


def get_value(name):
    """The value of a pin, parameter or signal."""
    reply = _ask(read=[name])
    if reply["types"][0] is None:
        raise error(f"there is no pin, parameter or signal '{name}'")
    return _value(reply["values"][0], _BY_NAME[reply["types"][0]])


get_p = get_s = get_value


def set_p(name, value):
    """Sets a pin or parameter. Returns False, as LinuxCNC's does when all went well; raises what is wrong."""
    _run("setp", name, _word(value))
    return False


def set_s(name, value):
    """Sets a signal. Returns False, as LinuxCNC's does when all went well; raises what is wrong."""
    _run("sets", name, _word(value))
    return False


sets = set_s


def _info(kind, rows):
    return [{"NAME": one["name"], "VALUE": _value(one["value"], _BY_NAME[one["type"]]), "TYPE": int(_BY_NAME[one["type"]]), **rows(one)}
            for one in _ask(describe=kind)["objects"]]


def get_info_pins():
    return _info("pin", lambda one: {"DIRECTION": int(_BY_DIR[one["dir"]])})


def get_info_params():
    return _info("param", lambda one: {"DIRECTION": int(_BY_DIR[one["dir"]])})


def get_info_signals():
    return _info("sig", lambda one: {"DRIVER": one.get("writer")})


def get_msg_level():
    return _msg_level


def set_msg_level(level):
    global _msg_level
    _msg_level = int(level)


# --- the end of the program -------------------------------------------------------------------------------------------------

_crashed = False


def _be_told_to_end():
    """SIGTERM comes as KeyboardInterrupt, so that a program that handles Ctrl-C ends in good order when it is unloaded."""
    if threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGTERM) == signal.SIG_DFL:
        signal.signal(signal.SIGTERM, signal.default_int_handler)


def _note_crash(kind, what, trace, say=sys.excepthook):
    global _crashed
    _crashed = _crashed or not issubclass(kind, KeyboardInterrupt)
    say(kind, what, trace)


sys.excepthook = _note_crash
atexit.register(lambda: _core.leave_all(not _crashed))
os.register_at_fork(after_in_child=_core.after_fork)

from hal import query  # noqa: E402  it uses the names above
