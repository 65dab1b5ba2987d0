#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""tiers.py ROOT: every row of cmake/packages has a page and folders that exist, and a row in the tables of README.md and of
docs/internals/core-and-packages.md, which name no other package; every packages line of a test names packages of the table."""
import re
import sys
from pathlib import Path

PAGES = {
    "README.md": re.compile(r"\[`([a-z]+)`\]\(([^)]*)\)"),
    "docs/internals/core-and-packages.md": re.compile(r"(?m)^\| `([a-z]+)` \| \[[^]]*\]\(([^)]*)\)"),
}


def packages(root):
    """(name, page, folders) of each row."""
    for line in (root / "cmake/packages").read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            continue
        name, page, folders, _ = line.split(" ", 3)
        yield name, page, folders.split(",")


def problems(root):
    rows = list(packages(root))
    names = {name for name, _, _ in rows}
    for name, page, folders in rows:
        for path in (page, *folders):
            if not (root / path).exists():
                yield f"cmake/packages: {name} names {path}, which does not exist"
    for page, row in PAGES.items():
        text = (root / page).read_text(encoding="utf-8")
        listed = {
            name: ((root / page).parent / link).resolve() for name, link in row.findall(text)
        }
        for name, own_page, _ in rows:
            if name not in listed:
                yield f"{page}: no row for the package {name} of cmake/packages"
            elif listed[name] != (root / own_page).resolve():
                yield f"{page}: the row of {name} does not link to {own_page}"
        for name in sorted(set(listed) - names):
            yield f"{page}: has a row for {name}, which is not in cmake/packages"
    for script in sorted((root / "tests").rglob("*.py")):
        stated = re.search(r"(?m)^# packages: (.*)$", script.read_text(encoding="utf-8"))
        for name in stated[1].split() if stated else ():
            if name not in names:
                yield f"{script.relative_to(root)}: states the package {name}, which is not in cmake/packages"


def main(root):
    found = list(problems(root))
    print("\n".join(found) if found else f"{len(list(packages(root)))} packages agree")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
