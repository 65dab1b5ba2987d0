#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""includes.py ROOT: fails when a source includes what its folder may not reach; says file:line and the rule."""
import re
import sys
from pathlib import Path

# A folder may include the folders in its row and whatever those may include.
ROWS = {
    "runtime/abi": [],
    "runtime/sdk": ["runtime/abi"],
    "runtime/base": ["runtime/abi", "runtime/sdk"],  # the lock-free queue is the sdk's, for components and runtime alike
    "runtime/netlist": ["runtime/base"],
    "runtime/plan": ["runtime/abi"],
    "runtime/model": ["runtime/base", "runtime/plan"],
    "runtime/execute": ["runtime/plan", "runtime/base"],
    "runtime/session": ["runtime/execute", "runtime/model", "runtime/netlist"],
    "runtime/shell": ["runtime/session"],
    "tools": ["runtime/shell", "components/canopen", "components/fieldbus"],  # hal can: device descriptions; hal node: stations
    "drivers/link": [],
    "drivers": ["drivers/link"],
    "components": ["runtime/sdk"],
    "components/canopen": ["runtime/sdk", "drivers/link", "components/sim"],  # sim: the plants behind simulated devices
    "components/fieldbus": ["runtime/sdk", "drivers/link"],
    "components/ethercat": ["runtime/sdk", "drivers/link"],
}

# The bans that carry the design, in words.
BANS = {
    ("runtime/execute", "runtime/model"): "execute never includes model: real-time code cannot reach a name or a string",
    ("components", None): "components include only the sdk (bus components also drivers/link)",
    (None, "runtime/session"): "only shell, tools and tests include session",
}

# Libraries that only some folders may include.
LIBRARIES = {
    r"Eigen/|unsupported/Eigen": ["components/estimation", "components/kinematics", "components/forcetorque"],
    r"opencv2/": ["components/vision"],
    r"fastdds/|fastrtps/|fastcdr/": ["components/dds"],
    r"CLI/": ["tools"],
    r"editline/|histedit": ["tools"],
    r"fmt/": ["runtime", "tools"],
    r"pugixml": ["components/canopen"],
    r"nlohmann/": ["runtime/session", "runtime/shell", "tools"],
}

INCLUDE_ROOTS = ["runtime", "runtime/abi", "runtime/sdk", "drivers", "components", "tools", "."]  # as the compiler searches
SINGLE = {"paths.hpp": ["runtime/session", "runtime/shell", "tools"]}  # headers that belong to no folder
INCLUDE = re.compile(r'^\s*#\s*include\s*(["<])([^">]+)[">]')


def folder_of(path):
    """The longest row or component group that holds `path` (relative to the root), or None."""
    parts = path.parts
    if parts[0] == "components":
        return "/".join(parts[:2]) if len(parts) > 2 else "components"
    for length in (2, 1):
        if "/".join(parts[:length]) in ROWS:
            return "/".join(parts[:length])
    return None


def row(folder):
    """What `folder` itself names; a group of components without a row of its own has that of all components."""
    return ROWS[folder] if folder in ROWS else ROWS[folder.split("/")[0]]


def reach(folder):
    found = {folder}
    for other in row(folder):
        found |= reach(other)
    return found


def resolve(root, source, name):
    """The file in the tree that `#include "name"` of `source` means, or None."""
    for base in [source.parent, *(root / r for r in INCLUDE_ROOTS)]:
        candidate = (base / name).resolve()
        if candidate.is_file() and candidate.is_relative_to(root):
            return candidate.relative_to(root)
    return None


def rule(folder, target):
    for (source, banned), words in BANS.items():
        if (source is None or folder.split("/")[0] == source or folder == source) and banned in (None, target):
            return words
    allowed = ", ".join(sorted(row(folder))) or "nothing"
    return f"{folder} may include {allowed}"


def problem(root, source, kind, name):
    """What is wrong with one include, or None."""
    folder = folder_of(source.relative_to(root))
    for pattern, users in LIBRARIES.items():
        if re.match(pattern, name) and not any(folder == u or folder.startswith(u + "/") for u in users):
            return f"includes <{name}>: only {', '.join(users)} may"
    if kind == "<":
        return None
    if name in SINGLE:
        return None if folder in SINGLE[name] else f'includes "{name}": only {", ".join(SINGLE[name])} may'
    found = resolve(root, source, name)
    if found is None:
        return f'includes "{name}": there is no such file in the tree; a library is included with <>'
    target = folder_of(found)
    if target in reach(folder):
        return None
    return f'includes "{name}" of {target or found.parent}: {rule(folder, target)}'


def main(root):
    count, errors = 0, []
    for top in ("runtime", "components", "drivers", "tools"):
        for source in sorted((root / top).rglob("*")):
            if source.suffix not in (".c", ".h", ".cpp", ".hpp") or folder_of(source.relative_to(root)) is None:
                continue
            count += 1
            for number, line in enumerate(source.read_text(errors="replace").splitlines(), 1):
                match = INCLUDE.match(line)
                wrong = match and problem(root, source, match[1], match[2])
                if wrong:
                    errors.append(f"{source.relative_to(root)}:{number}: {wrong}")
    print("\n".join(errors) if errors else f"{count} files include only what they may")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
