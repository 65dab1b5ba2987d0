# SPDX-License-Identifier: MIT
"""What there is in the instance, as dictionaries: hal.query.pins(), hal.query.pin(NAME) and so on."""
import enum

import hal


class CompType(enum.IntEnum):
    REALTIME = 1
    USER = 2


def _ask(kind, name=None):
    return hal._ask(describe=kind, **({} if name is None else {"patterns": [name]}))["objects"]


def _named(rows, name):
    return rows.get(name)


def _ids():
    return {one["name"]: number for number, one in enumerate(reversed(_ask("comp")), 1)}


def _pin_rows(kind, word, name, ids):
    rows = {}
    for one in _ask(kind, name):
        kind_of = hal._BY_NAME[one["type"]]
        row = {
            "haltype": word,
            "name": one["name"],
            "type": kind_of,
            "dir": hal._BY_DIR[one["dir"]],
            "value": hal._value(one["value"], kind_of),
            "alias": one.get("alias"),
        }
        if word == "pin":
            row["signal"] = one.get("signal")
        comp = one.get("component", "threads")
        rows[one["name"]] = {**row, "comp": comp, "comp_id": ids.get(comp, 0)}
    return rows


def pins():
    return _pin_rows("pin", "pin", None, _ids())


def params():
    return _pin_rows("param", "parameter", None, _ids())


def pin(name):
    return _named(_pin_rows("pin", "pin", name, _ids()), name)


def param(name):
    return _named(_pin_rows("param", "parameter", name, _ids()), name)


def _signal_rows(name=None):
    dirs = {one["name"]: one["dir"] for one in _ask("pin")}
    rows = {}
    for one in _ask("sig", name):
        kind = hal._BY_NAME[one["type"]]
        words = [dirs.get(pin_name) for pin_name in one["pins"]]
        rows[one["name"]] = {
            "haltype": "signal",
            "name": one["name"],
            "type": kind,
            "value": hal._value(one["value"], kind),
            "writers": words.count("OUT"),
            "readers": words.count("IN"),
            "bidirs": words.count("I/O"),
            "driver": one.get("writer"),
        }
    return rows


def signals():
    return _signal_rows()


def signal(name):
    return _named(_signal_rows(name), name)


def signalpins(name):
    about = next((one for one in _ask("sig", name) if one["name"] == name), None)
    return (
        None if about is None else {one: row for one, row in pins().items() if one in about["pins"]}
    )


def comps():
    ids = _ids()
    return {
        one["name"]: {
            "haltype": "component",
            "name": one["name"],
            "type": CompType.USER if "pid" in one else CompType.REALTIME,
            "id": ids[one["name"]],
            "pid": one.get("pid", 0),
            "ready": one.get("ready", True),
            "insmod": " ".join(one.get("loaded", [])) or None,
        }
        for one in _ask("comp")
    }


def comp(which):
    return next((row for row in comps().values() if which in (row["name"], row["id"])), None)


def functs():
    ids = _ids()
    return {
        one["name"]: {
            "haltype": "function",
            "name": one["name"],
            "comp": one["component"],
            "comp_id": ids.get(one["component"], 0),
            "users": int("thread" in one),
            "reentrant": False,
        }
        for one in _ask("funct")
    }


def funct(name):
    return _named(functs(), name)


def threads():
    ids = _ids()
    rows = {}
    for one in _ask("thread"):
        functions = [
            {"haltype": "threadfunction", "name": function, "index": index, "is_init": is_init}
            for is_init in (True, False)
            for index, function in enumerate(one["init" if is_init else "functions"])
        ]
        rows[one["name"]] = {
            "haltype": "thread",
            "name": one["name"],
            "comp": "threads",
            "comp_id": ids.get("threads", 0),
            "priority": 0,
            "period": one["period_ns"],
            "functions": functions,
        }
    return rows


def thread(name):
    return _named(threads(), name)
