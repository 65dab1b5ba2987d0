#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""tiers.py ROOT: every row of cmake/packages has a page and folders that exist, and a row in the
tables of README.md and of docs/internals/core-and-packages.md, which name no other package;
every packages line of a test names packages of the table; tools/part.hpp names the packages
that have commands, which are in their folders; the core includes no header of a package but the
listed ones."""
import re
import sys
from pathlib import Path

PAGES = {
    "README.md": re.compile(r"\[`([a-z]+)`\]\(([^)]*)\)"),
    "docs/internals/core-and-packages.md": re.compile(
        r"(?m)^\| `([a-z]+)` \| \[[^]]*\]\(([^)]*)\)"
    ),
}
PART = "tools/part.hpp"
WITHOUT_COMMANDS = {"python"}  # packages with a folder in tools/ that is not a part of the programs
SOURCES = ("runtime", "drivers", "components", "tools")
SUFFIXES = {".c", ".cpp", ".h", ".hpp"}
TABLE_OF_COMMANDS = "tools/commands.cpp"  # includes the options of each command
INCLUDED_BY_THE_CORE = {
    "runtime/linuxcnc/binary/elf_value.hpp",
    "runtime/linuxcnc/binary/module_host.hpp",
    "tools/panel/panel_layout.hpp",  # where the package is built
}


def packages(root):
    """(name, page, folders) of each row."""
    for line in (root / "cmake/packages").read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            continue
        name, page, folders, _ = line.split(" ", 3)
        yield name, page, folders.split(",")


def of_the_programs(root, rows):
    """Compares tools/part.hpp with the packages that have folders in tools/."""
    text = (root / PART).read_text(encoding="utf-8")
    named = dict(re.findall(r'inline constexpr char (\w+)\[\] = "(\w+)";', text))
    macros = set(re.findall(r"(?m)^#define OF_(\w+)\(", text))
    expected = {
        name
        for name, _, folders in rows
        if name not in WITHOUT_COMMANDS and any(folder.startswith("tools/") for folder in folders)
    }
    for name in sorted(expected - set(named.values())):
        yield f"{PART}: no row for the package {name}, which has a folder in tools/"
    for name in sorted(set(named.values()) - expected):
        yield f"{PART}: names the package {name}, which has no folder in tools/ in cmake/packages"
    for name in sorted({name.upper() for name in named.values()} ^ macros):
        yield f"{PART}: {name} has a name or a macro OF_{name}, not both"


def included(root, source):
    """The files of the tree that the source includes, from the root of the includes or from its
    own folder."""
    for path in re.findall(r'(?m)^#include "([^"]+)"', source.read_text(encoding="utf-8")):
        for start in (source.parent, *(root / folder for folder in SOURCES), root):
            if (start / path).is_file():
                yield (start / path).resolve().relative_to(root).as_posix()
                break


def owner(rows, path):
    """The package of a file; None for the core."""
    for name, _, folders in rows:
        if path.startswith(tuple(f"{folder}/" for folder in folders)):
            return name
    return None


def of_the_table(root, rows):
    """Reports commands whose functions are not in the package that their rows state: one of them
    would be missing without the package."""
    table = root / TABLE_OF_COMMANDS
    headers = [(path, (root / path).read_text(encoding="utf-8")) for path in included(root, table)]
    stated = re.findall(
        r"\b(?:IN_CORE|IN_TOOLS|ON_BUS|OF_(\w+))\((run_\w+)\)", table.read_text(encoding="utf-8")
    )
    for package, function in stated:
        for path, text in headers:
            actual = owner(rows, path)
            if f"int {function}(" in text and actual != (package.lower() or None):
                yield f"{TABLE_OF_COMMANDS}: {function} is in {path}, of {actual or 'the core'}"


def of_the_core(root, rows):
    """Reports includes from the core into a package."""
    for source in sorted(one for folder in SOURCES for one in (root / folder).rglob("*")):
        path = source.relative_to(root).as_posix()
        if source.suffix not in SUFFIXES or path == TABLE_OF_COMMANDS or owner(rows, path):
            continue
        for header in included(root, source):
            package = owner(rows, header)
            if package and header not in INCLUDED_BY_THE_CORE:
                yield f"{path}: is in the core and includes {header} of the package {package}"


def problems(root):
    rows = list(packages(root))
    names = {name for name, _, _ in rows}
    for name, page, folders in rows:
        for path in (page, *folders):
            if not (root / path).exists():
                yield f"cmake/packages: {name} names {path}, which does not exist"
    for page, row in PAGES.items():
        text = (root / page).read_text(encoding="utf-8")
        listed = {name: ((root / page).parent / link).resolve() for name, link in row.findall(text)}
        for name, own_page, _ in rows:
            if name not in listed:
                yield f"{page}: no row for the package {name} of cmake/packages"
            elif listed[name] != (root / own_page).resolve():
                yield f"{page}: the row of {name} does not link to {own_page}"
        for name in sorted(set(listed) - names):
            yield f"{page}: has a row for {name}, which is not in cmake/packages"
    scripts = (one for one in (root / "tests").rglob("*") if one.suffix in {".py", ".sh"})
    for script in sorted(scripts):
        stated = re.search(r"(?m)^# packages: (.*)$", script.read_text(encoding="utf-8"))
        for name in stated[1].split() if stated else ():
            if name not in names:
                yield f"{script.relative_to(root)}: states the package {name}, which is not in cmake/packages"
    yield from of_the_programs(root, rows)
    yield from of_the_table(root, rows)
    yield from of_the_core(root, rows)


def main(root):
    found = list(problems(root))
    print("\n".join(found) if found else f"{len(list(packages(root)))} packages agree")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
