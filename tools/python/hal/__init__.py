# SPDX-License-Identifier: MIT
"""HAL from Python, under LinuxCNC's names: components, pins, parameters, signals and streams of a running instance.

    import hal
    c = hal.component("blinker")
    c.newpin("lamp", hal.HAL_BIT, hal.HAL_OUT)
    c.ready()
    c["lamp"] = True

The instance is $HALCYON_INSTANCE (set for what loadusr starts), else the only one running, else `default`.
See docs/tutorials/python.md.
"""

import atexit
import os
import sys

from hal import _core
from hal._base import *  # noqa: F403
from hal._base import (
    _BY_DIR,
    _BY_NAME,
    _TYPES,
    _ask,
    _run,
    _value,
    _word,
    MSG_ERR,
    InvalidArgument,
    Type,
    UnknownPin,
    error,
)
from hal._component import Pin, component  # noqa: F401
from hal._probe import probe  # noqa: F401
from hal._stream import stream  # noqa: F401

_msg_level = MSG_ERR

# --- functions of the module ------------------------------------------------------------------------------------------------


def _objects(kind, name):
    return next(
        (
            one
            for one in _ask(describe=kind, patterns=[name])["objects"]
            if name in (one["name"], one.get("alias"))
        ),
        None,
    )


def component_exists(name):
    return name in _ask(list="comp", patterns=[name])["names"]


def component_is_ready(name):
    about = _objects("comp", name)
    return about is not None and about.get("ready", True)


def _failed(command, *words):
    """Runs a command as LinuxCNC's functions for signals do: prints its error and returns True, or returns False after success."""
    try:
        _run(command, *words)
    except error as problem:
        if _msg_level >= MSG_ERR:
            print(problem, file=sys.stderr)
        return True
    return False


def new_sig(name, type):
    """Creates a signal. Returns False after success, as LinuxCNC's does; prints the error and returns True otherwise."""
    if type not in Type.__members__.values():
        raise InvalidArgument(f"{type!r} is not a HAL type")
    return _failed("newsig", name, _TYPES[Type(type)][0])


def connect(pin, signal):
    """Links a pin to a signal. Returns False after success, as LinuxCNC's does; prints the error and returns True otherwise."""
    return _failed("linkps", pin, signal)


def disconnect(pin):
    """Unlinks a pin. Returns False after success, as LinuxCNC's does; prints the error and returns True otherwise."""
    return _failed("unlinkp", pin)


def pin_has_writer(name):
    about = _objects("pin", name)
    if about is None:
        raise UnknownPin(f"unknown pin '{name}'")
    return "signal" in about and "writer" in _objects("sig", about["signal"])


def get_value(name):
    """Returns the value of a pin, parameter or signal."""
    reply = _ask(read=[name])
    if reply["types"][0] is None:
        raise error(f"unknown pin, parameter or signal '{name}'")
    return _value(reply["values"][0], _BY_NAME[reply["types"][0]])


get_p = get_s = get_value


def set_p(name, value):
    """Sets a pin or parameter. Returns False after success, as LinuxCNC's does; raises the error otherwise."""
    _run("setp", name, _word(value))
    return False


def set_s(name, value):
    """Sets a signal. Returns False after success, as LinuxCNC's does; raises the error otherwise."""
    _run("sets", name, _word(value))
    return False


sets = set_s


def _info(kind, rows):
    return [
        {
            "NAME": one["name"],
            "VALUE": _value(one["value"], _BY_NAME[one["type"]]),
            "TYPE": int(_BY_NAME[one["type"]]),
            **rows(one),
        }
        for one in _ask(describe=kind)["objects"]
    ]


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


# --- end of the program -------------------------------------------------------------------------------------------------

_crashed = False


def _note_crash(kind, what, trace, report=sys.excepthook):
    global _crashed
    _crashed = _crashed or not issubclass(kind, KeyboardInterrupt)
    report(kind, what, trace)


sys.excepthook = _note_crash


@atexit.register
def _end():
    _core.leave_all(not _crashed)
    _core.end()


os.register_at_fork(after_in_child=_core.after_fork)

from hal import query  # noqa: E402  uses the names above
