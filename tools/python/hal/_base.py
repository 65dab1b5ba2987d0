# SPDX-License-Identifier: MIT
"""Exceptions, constants, and requests to the running instance."""

import enum
import json
import math
import os

from hal import _core

error = _core.error
error.__module__ = "hal"


# Each exception is LinuxCNC's and the one that Python programs expect.
class InvalidArgument(error, ValueError):
    __module__ = "hal"


class UnknownPin(error, NameError):
    __module__ = "hal"


class WrongKind(error, AttributeError):
    __module__ = "hal"


class StreamError(error, OSError):
    __module__ = "hal"
    __init__, __str__ = OSError.__init__, OSError.__str__  # with the number of the error, if any


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


HAL_BIT, HAL_FLOAT, HAL_S32, HAL_U32, HAL_PORT, HAL_S64, HAL_U64 = (
    int(t) for t in (Type.BIT, Type.FLOAT, Type.S32, Type.U32, Type.PORT, Type.S64, Type.U64)
)
HAL_IN, HAL_OUT, HAL_IO, HAL_RO, HAL_RW = (int(d) for d in Dir)
MSG_NONE, MSG_ERR, MSG_WARN, MSG_INFO, MSG_DBG, MSG_ALL = range(6)
RTAPI_MSG_NONE, RTAPI_MSG_ERR, RTAPI_MSG_WARN, RTAPI_MSG_INFO, RTAPI_MSG_DBG, RTAPI_MSG_ALL = range(
    6
)
is_kernelspace, is_userspace, is_rt, is_sim = 0, 1, 1, 0
streamer_base, sampler_base = (
    0x48535430,
    0x48534130,
)  # as in LinuxCNC, whose modules have their streams under these keys

# the protocol's names and the numbers of the runtime's types
_TYPES = {
    Type.BIT: ("bit", 0),
    Type.FLOAT: ("float", 1),
    Type.S32: ("s32", 2),
    Type.U32: ("u32", 3),
    Type.S64: ("s64", 4),
    Type.U64: ("u64", 5),
    Type.PORT: ("port", 6),
}
_BY_NAME = {name: kind for kind, (name, _) in _TYPES.items()}
_BY_NUMBER = {number: kind for kind, (_, number) in _TYPES.items()}
_DIRS = {Dir.IN: "in", Dir.OUT: "out", Dir.IO: "io", Dir.RO: "ro", Dir.RW: "rw"}
_BY_DIR = {word: dir for dir, word in _DIRS.items()} | {
    "IN": Dir.IN,
    "OUT": Dir.OUT,
    "I/O": Dir.IO,
    "RO": Dir.RO,
    "RW": Dir.RW,
}

_link = _core.Link()
os.register_at_fork(after_in_child=_link.after_fork)


def _good(text):
    reply = json.loads(text)
    if not reply.get("ok"):
        raise error(reply.get("error", "the machine sent no reply"))
    return reply


def _ask(**body):
    _core.flush_all()
    return _good(_link.request(json.dumps(body)))


def _run(command, *words):
    """Runs one command of the shell and returns its output; raises its error. Each argument stays one word, whatever is in it."""
    words = [str(word) for word in words]
    for word in words:
        if "[" in word or "{" in word:
            raise InvalidArgument(
                f"'{word}' is not a name or a value: '[' and '{{' begin a range or a set of names, which only netlists have"
            )
    reply = _ask(run=[command, *words], name="<python>")
    if reply["status"] != 0:
        raise error(reply["err"].strip() or f"{command} failed")
    return reply["out"]


def _value(value, kind):
    """Returns a value of the protocol as a Python object."""
    return float(value) if kind == Type.FLOAT else value


def _word(value):
    return (
        "TRUE"
        if value is True
        else "FALSE" if value is False else repr(value) if isinstance(value, float) else str(value)
    )


def _plain(value):
    """Returns a Python object as a value of the protocol."""
    if isinstance(value, float) and not math.isfinite(value):
        return "nan" if math.isnan(value) else "inf" if value > 0 else "-inf"
    return value
