#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""includes.py ROOT: fails when a source includes what its folder may not reach (file:line and the rule), when a folder has no row, and when
folders include each other in a circle, and when code outside drivers/ tests the prefix of an address.
"""

import re
import sys
from pathlib import Path

# A folder may include the folders in its row and whatever those may include. A folder below a row belongs to that row.
ROWS = {
    "runtime/abi": [],
    "runtime/sdk": ["runtime/abi"],
    "runtime/text": ["runtime/abi"],
    "runtime/base": ["runtime/text", "runtime/sdk"],
    "runtime/netlist": ["runtime/base"],
    "runtime/plan": ["runtime/abi"],
    "runtime/model": ["runtime/base", "runtime/plan"],
    "runtime/execute": ["runtime/plan", "runtime/base"],
    "runtime/linuxcnc/find": [],
    "runtime/linuxcnc/source": ["runtime/abi"],
    "runtime/linuxcnc/binary": ["runtime/sdk", "runtime/linuxcnc/source"],
    "runtime/linuxcnc/binary/guard": [],
    "runtime/linuxcnc/programs": ["runtime/linuxcnc/binary", "runtime/linuxcnc/source"],
    "runtime/machine/load": [
        "runtime/execute",
        "runtime/model",
        "runtime/netlist",
        "runtime/linuxcnc/binary",
        "runtime/linuxcnc/find",
    ],
    "runtime/machine/report": ["runtime/machine/load"],
    "runtime/machine/run": ["runtime/machine/report"],
    "runtime/machine/processes": ["runtime/machine/run"],
    "runtime/machine": ["runtime/machine/processes"],
    "runtime/commands": ["runtime/machine"],
    "runtime/control": ["runtime/commands"],
    "runtime/cells": ["runtime/control", "components/dds/links"],
    "runtime/journal": ["runtime/machine", "components/recording/mcap"],
    "tools": [
        "tools/inspect",
        "tools/linuxcnc",
        "tools/trace",
        "tools/comp",
        "tools/bus",
        "tools/panel",
        "tools/lsp",
    ],  # the table of subcommands
    "tools/cli": ["runtime/control"],
    "tools/run": ["tools/record", "tools/scope", "tools/tcl", "runtime/cells", "runtime/journal"],
    "tools/record": ["tools/cli", "drivers/link", "components/recording/mcap"],
    "tools/inspect": ["tools/run", "tools/scope"],
    "tools/tcl": ["tools/comp"],
    "tools/linuxcnc": ["tools/run", "tools/comp"],
    "tools/scope": ["tools/cli"],
    "tools/trace": ["tools/cli"],
    "tools/doc": ["tools/cli"],
    "tools/comp": ["tools/doc"],
    "tools/bus": [
        "tools/cli",
        "components/canopen/master",
        "components/canopen/device",
        "components/fieldbus/tdma/rtcfg",
        "components/fieldbus/tdma/tunnel",
        "components/fieldbus/scocan/plan",
        "components/ethercat/master",
        "components/ethercat/recorded",
        "components/ethercat/devices",
        "components/ethercat/config",
        "components/modbus/device",
        "components/modbus/master",
        "components/mesa/card",
    ],  # hal can, ethercat, node, tdma
    "tools/panel": ["tools/cli", "components/recording/mcap"],
    "tools/lsp": ["tools/run", "tools/doc", "tools/panel"],
    "tools/python": ["runtime/control"],
    "drivers/link": ["runtime/sdk"],
    "drivers/discipline": ["drivers/link", "runtime/sdk"],
    "drivers/capture": ["drivers/link"],
    "drivers/netlink": ["drivers/link"],
    "drivers/tap": ["drivers/link", "runtime/sdk"],
    "drivers/can": [
        "drivers/discipline",
        "drivers/capture",
        "drivers/netlink",
        "runtime/sdk",
        "runtime/text",
    ],
    "drivers/line": ["drivers/link", "runtime/text"],
    "drivers/datagram": ["drivers/link", "runtime/text"],
    "drivers/ethernet": ["drivers/capture", "drivers/netlink", "runtime/sdk", "runtime/text"],
    "components/logic": ["components"],
    "components/math": ["components"],
    "components/control": ["components"],
    "components/motion": ["components"],
    "components/io": ["components"],
    "components/safety": ["components"],
    "components/sim": ["components"],
    "components/estimation": ["components"],
    "components/recording": ["components", "components/recording/mcap"],
    "components/recording/mcap": ["runtime/sdk", "runtime/text"],
    "components/mobile": ["components"],
    "components/vision": ["components"],
    "components/dds": ["components", "components/dds/links"],
    "components/dds/links": [],  # what cells gives the components, as data
    "components": ["runtime/sdk", "runtime/text"],
    "components/bus/component": ["runtime/sdk", "runtime/text", "drivers/link"],
    "components/bus/config": ["runtime/text"],
    "components/bus/events": [],
    "components/bus/guardian": ["runtime/sdk", "drivers/link"],
    "components/cia301": [],
    "components/cia402": ["runtime/sdk", "components/cia301"],
    "components/canopen/protocol": [
        "runtime/sdk",
        "runtime/text",
        "drivers/link",
        "components/cia402",
    ],  # cia402: the error codes
    "components/canopen/eds": ["components/canopen/protocol"],
    "components/canopen/master": [
        "components/canopen/eds",
        "components/fieldbus/can_timing",
        "components/bus/config",
        "components/bus/events",
    ],
    "components/canopen/device": [
        "components/canopen/eds",
        "components/sim",
    ],  # sim: the plants behind simulated devices
    "components/ethercat/wire": ["runtime/text", "components/cia301"],
    "components/ethercat/esi": ["components/ethercat/wire"],
    "components/ethercat/esc": ["components/ethercat/wire", "drivers/link"],
    "components/ethercat/devices": [
        "components/ethercat/esc",
        "components/ethercat/esi",
        "components/sim",
        "components/cia402",
    ],
    "components/ethercat/master": ["components/ethercat/wire", "runtime/sdk", "drivers/link"],
    "components/ethercat/config": [
        "components/ethercat/master",
        "components/ethercat/esi",
        "components/cia402",
        "components/bus/config",
        "components/bus/events",
    ],
    "components/ethercat/recorded": ["components/ethercat/wire", "drivers/link"],
    "components/ethercat/plugins": [
        "components/ethercat/config",
        "components/ethercat/recorded",
        "components/ethercat/devices",
        "components/bus/component",
        "drivers/tap",
    ],
    "components/canopen/plugins": [
        "components/canopen/master",
        "components/canopen/device",
        "components/bus/component",
    ],
    "components/modbus/wire": [],
    "components/modbus/config": [
        "components/modbus/wire",
        "components/bus/config",
        "runtime/text",
        "drivers/link",
    ],
    "components/modbus/master": [
        "components/modbus/config",
        "components/bus/events",
        "components/bus/guardian",
        "runtime/sdk",
    ],
    "components/modbus/device": ["components/modbus/config"],
    "components/modbus/guardian": [
        "components/modbus/master",
        "components/bus/guardian",
        "runtime/sdk",
    ],
    "components/modbus/plugins": [
        "components/modbus/guardian",
        "components/modbus/device",
        "components/bus/component",
        "components/bus/events",
    ],
    "components/mesa/lbp16": [],
    "components/mesa/hostmot2": ["components/mesa/lbp16"],
    "components/mesa/driver": ["components/mesa/hostmot2", "runtime/text", "drivers/link"],
    "components/mesa/card": [
        "components/mesa/hostmot2",
        "components/bus/config",
        "runtime/text",
        "drivers/link",
    ],
    "components/mesa/plugins": [
        "components/mesa/driver",
        "components/mesa/card",
        "components/bus/component",
        "components/bus/events",
        "runtime/sdk",
    ],
    "components/fieldbus/can_timing": ["drivers/link"],
    "components/fieldbus/segment": ["runtime/sdk", "runtime/text", "drivers/link"],
    "components/fieldbus/guardian": [
        "components/bus/events",
        "components/bus/guardian",
        "drivers/link",
    ],
    "components/fieldbus/guardian/plugins": ["components/fieldbus/guardian", "runtime/sdk"],
    "components/fieldbus/scocan/config": [
        "runtime/text",
        "drivers/link",
        "components/bus/config",
    ],
    "components/fieldbus/scocan/wire": ["components/fieldbus/scocan/config"],
    "components/fieldbus/scocan/station": ["components/fieldbus/scocan/wire"],
    "components/fieldbus/scocan/plan": [
        "components/fieldbus/scocan/config",
        "components/fieldbus/can_timing",
    ],
    "components/fieldbus/scocan/plugins": [
        "components/fieldbus/scocan/station",
        "components/fieldbus/messages",
        "components/bus/component",
        "components/bus/events",
        "runtime/sdk",
        "drivers/discipline",
    ],
    "components/fieldbus/messages": ["runtime/sdk", "drivers/link"],
    "components/fieldbus/tdma/wire": ["runtime/sdk", "runtime/text", "drivers/link"],
    "components/fieldbus/tdma/station": ["components/fieldbus/tdma/wire", "drivers/discipline"],
    "components/fieldbus/tdma/config": [
        "components/fieldbus/tdma/station",
        "components/bus/config",
        "components/bus/events",
    ],
    "components/fieldbus/tdma/rtcfg": ["components/fieldbus/tdma/config"],
    "components/fieldbus/tdma/tunnel": ["components/fieldbus/tdma/config", "drivers/tap"],
    "components/fieldbus/tdma/plugins": [
        "components/fieldbus/tdma/rtcfg",
        "components/fieldbus/tdma/tunnel",
        "components/bus/component",
    ],
}

# The bans that carry the design, in words.
BANS = {
    (
        "runtime/execute",
        "runtime/model",
    ): "execute never includes model: real-time code cannot reach a name or a string",
    (
        "components/ethercat/master",
        "components/ethercat/esc",
    ): "master and emulated slaves share only wire/",
    (
        "components/ethercat/master",
        "components/ethercat/devices",
    ): "master and emulated slaves share only wire/",
    (
        "components/ethercat/esc",
        "components/ethercat/master",
    ): "master and emulated slaves share only wire/",
    (
        "components/ethercat/devices",
        "components/ethercat/master",
    ): "master and emulated slaves share only wire/",
    (
        "components/modbus/master",
        "components/modbus/device",
    ): "master and device never include each other",
    (
        "components/modbus/device",
        "components/modbus/master",
    ): "master and device never include each other",
    (
        "components/mesa/driver",
        "components/mesa/card",
    ): "driver and emulated card share only lbp16/ and hostmot2/",
    (
        "components/mesa/card",
        "components/mesa/driver",
    ): "driver and emulated card share only lbp16/ and hostmot2/",
    (
        "components/canopen/master",
        "components/canopen/device",
    ): "master and device never include each other",
    (
        "components/canopen/device",
        "components/canopen/master",
    ): "master and device never include each other",
    (
        "components",
        None,
    ): "components include only the sdk and text (bus components also drivers/link)",
    (
        None,
        "runtime/machine",
    ): "only commands, control, cells, journal, tools and tests include machine",
}

# Libraries that only some folders may include.
LIBRARIES = {
    r"Eigen/|unsupported/Eigen": ["components/estimation"],
    r"opencv2/|yaml-cpp/": ["components/vision"],
    r"fastdds/|fastrtps/|fastcdr/": ["components/dds"],
    r"CLI/": ["tools/cli"],
    r"editline/|histedit": ["tools/cli"],
    r"fmt/": ["runtime", "tools"],
    r"pugixml": ["components/canopen", "components/ethercat", "tools/panel"],
    r"libwebsockets": ["tools/panel"],
    r"nlohmann/": [
        "runtime/machine",
        "runtime/commands",
        "runtime/control",
        "runtime/journal",
        "tools",
    ],
}

INCLUDE_ROOTS = [
    "runtime",
    "runtime/abi",
    "runtime/sdk",
    "runtime/linuxcnc/source",
    "drivers",
    "components",
    "tools",
    ".",
]  # as the compiler searches
SINGLE = {
    "paths.hpp": [
        "runtime/linuxcnc/find",
        "runtime/machine/load",
        "runtime/machine/processes",
        "runtime/commands",
        "runtime/control",
        "tools",
        "tools/run",
        "tools/inspect",
        "tools/comp",
        "tools/panel",
        "tools/lsp",
    ]
}  # headers that belong to no folder
# The table of addresses: the first text of each row is one.
ADDRESS_TABLE = "drivers/link/address_form.hpp"
ADDRESS_ROW = re.compile(r'^\s*\{"([a-z]+:[^"]*)",', re.MULTILINE)
INCLUDE = re.compile(r'^\s*#\s*include\s*(["<])([^">]+)[">]')


def address_forms(root):
    """An address of each driver."""
    return ADDRESS_ROW.findall((root / ADDRESS_TABLE).read_text(encoding="utf-8"))


def prefix_test():
    """What a test of an address's prefix looks like. Which transport an address names is the drivers'
    matter: others ask describe()."""
    forms = address_forms(Path(__file__).resolve().parents[2])
    names = "|".join(sorted({form.split(":")[0] for form in forms}))
    return re.compile(rf'(?:\b(?:starts_with|r?find|compare)\(\s*|[=!]=\s*|\b\w+ = )"(?:{names}):"')


def missing_forms(root):
    """Errors for drivers whose address is missing in the page of the drivers."""
    page = root / "drivers/README.md"
    if not page.exists():
        return []
    text = page.read_text(encoding="utf-8")
    return [
        f"drivers/README.md: the address `{form}` is missing; add it"
        for form in address_forms(root)
        if f"`{form}`" not in text
    ]


ADDRESS_PREFIX = prefix_test()


def folder_of(path):
    """The longest row that holds `path` (relative to the root), or None. Only a file directly in components/ belongs to its row."""
    for parent in path.parents:
        if parent.as_posix() in ROWS and (
            parent.as_posix() != "components" or path.parent == parent
        ):
            return parent.as_posix()
    return None


def reach(folder):
    found = {folder}
    for other in ROWS[folder]:
        found |= reach(other)
    return found


def resolve(root, source, name):
    """The file in the tree that `#include "name"` of `source` means, or None."""
    for base in [source.parent, *(root / r for r in INCLUDE_ROOTS)]:
        candidate = (base / name).resolve()
        if candidate.is_file() and candidate.is_relative_to(root):
            return candidate.relative_to(root)
    return None


def is_in(folder, outer):
    return f"{folder}/".startswith(f"{outer}/")


def rule(folder, target):
    plain = "components" if ROWS[folder] == ["components"] else None
    for (source, banned), words in BANS.items():
        if source not in (None, folder, plain):
            continue
        if banned is None:
            return words
        if is_in(target or "", banned) and not is_in(folder, banned):
            return words
    allowed = ", ".join(sorted(ROWS[folder])) or "nothing"
    return f"{folder} may include {allowed}"


def problem(root, source, kind, name):
    """What is wrong with one include, or None."""
    folder = folder_of(source.relative_to(root))
    for pattern, users in LIBRARIES.items():
        if re.match(pattern, name) and not any(
            folder == u or folder.startswith(u + "/") for u in users
        ):
            return f"includes <{name}>: only {', '.join(users)} may"
    if kind == "<":
        return None
    if name in SINGLE:
        return (
            None
            if folder in SINGLE[name]
            else f'includes "{name}": only {", ".join(SINGLE[name])} may'
        )
    found = resolve(root, source, name)
    if found is None:
        return (
            f'includes "{name}": there is no such file in the tree; a library is included with <>'
        )
    target = folder_of(found)
    if target in reach(folder):
        return None
    return f'includes "{name}" of {target or found.parent}: {rule(folder, target)}'


def circles(graph):
    """The sets of folders that reach each other, each as a sorted list."""

    def reached(start):
        found, new = set(), [start]
        while new:
            for other in graph.get(new.pop(), {}):
                if other not in found:
                    found.add(other)
                    new.append(other)
        return found

    reaches = {folder: reached(folder) for folder in graph}
    return sorted(
        {
            tuple(sorted(o for o in seen if folder in reaches.get(o, ())))
            for folder, seen in reaches.items()
            if folder in seen
        }
    )


def main(root):
    count, errors, graph = 0, [], {}
    for top in ("runtime", "components", "drivers", "tools"):
        for source in sorted((root / top).rglob("*")):
            if source.suffix not in (".c", ".h", ".cpp", ".hpp"):
                continue
            path = source.relative_to(root)
            if folder_of(path) is None:
                if path.parent.as_posix() not in ("runtime", "components"):
                    errors.append(
                        f"{path}: {path.parent} has no row in includes.py: what may it include?"
                    )
                continue
            count += 1
            for number, line in enumerate(source.read_text(errors="replace").splitlines(), 1):
                if not path.as_posix().startswith("drivers/") and ADDRESS_PREFIX.search(line):
                    errors.append(
                        f"{path}:{number}: tests the prefix of an address; ask can::describe() or ethernet::describe() instead"
                    )
                match = INCLUDE.match(line)
                wrong = match and problem(root, source, match[1], match[2])
                if wrong:
                    errors.append(f"{path}:{number}: {wrong}")
                target = match and match[1] == '"' and resolve(root, source, match[2])
                if target and target.parent != path.parent:
                    graph.setdefault(path.parent, {}).setdefault(
                        target.parent, f'{path}:{number}: includes "{match[2]}"'
                    )
    errors += missing_forms(root)
    for circle in circles(graph):
        errors.append(f"folders that include each other: {', '.join(f.as_posix() for f in circle)}")
        errors += [
            f"    {where}"
            for folder in circle
            for other, where in graph[folder].items()
            if other in circle
        ]
    print("\n".join(errors) if errors else f"{count} files include only what they may")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
