#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""files.py ROOT: every folder has a README that names only files that exist; every page links to existing files; every file and folder
that a page about the inside names exists, and so does every function, member and test; every source has its licence line.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

SOURCES = {".c", ".h", ".cpp", ".hpp", ".py", ".sh", ".cmake"}
CODE = SOURCES | {".js", ".awk"}
# Folders that the parent's README describes: data, one folder per case, and folders of folders.
NO_README = (
    "runtime/abi/hal",
    "runtime/sdk/hal",
    "runtime/linuxcnc/source/linuxcnc",
    "tests/netlists/",
    "tests/errors/",
    "tests/fuzz/",
    "tests/cli/",
    ".ci",
    "cmake",
    "docs/",
)

# References of a page: `file.ext` in backticks, and [links](to files).
MENTIONED = re.compile(
    r"`([\w./-]+\.(?:cpp|hpp|h|py|sh|md|hal|ini|expected))`|\]\((?!https?:|#)([^)#]+)[^)]*\)"
)

# Pages for maintainers name files and folders by their path from the root or by its end: `runner.hpp`, `master/cycle/`. A name with NAME in
# it is a pattern.
INSIDE = "docs/internals"
NAMED_INSIDE = re.compile(
    r"`((?:[\w.-]+/)*[\w.-]+\.(?:c|cpp|hpp|h|py|sh|md|hal|ini|expected|cmake|txt|js|lua)|(?:[\w.-]+/)+)`"
)
# Names in code, of which one with an underscore or a scope can be nothing else: `Core::take_over`, `make_plan()`.
CODE_INSIDE = re.compile(r"`((?:\w+::)*~?\w+)(?:\([^`]*\))?`")
WORD = re.compile(r"[A-Za-z_]\w*")


def unfenced(text):
    """(line number, line) of each line outside of blocks of code."""
    fenced = False
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("```"):
            fenced = not fenced
        elif not fenced:
            yield number, line


def names_inside(root, page):
    """(line number, name) of each name in code on a page about the inside."""
    for number, line in unfenced((root / page).read_text(errors="replace")):
        for name in CODE_INSIDE.findall(line):
            if ("_" in name or "::" in name) and "NAME" not in name:
                yield number, name


def unknown_words(root, files, words):
    """Those of `words` that no source has, nor the name of a file."""
    unknown = words - set(WORD.findall(" ".join(f.as_posix() for f in files)))
    for path in files:
        if path.suffix in CODE or path.name == "CMakeLists.txt":
            text = (root / path).read_text(errors="replace")
            near = [word for word in unknown if word in text]
            unknown -= {word for word in near if re.search(rf"\b{word}\b", text)}
    return unknown


def ends_of(files):
    """Every end of the path of every file, and of every folder with a slash behind it."""
    ends = set()
    folders = {parent for path in files for parent in path.parents}
    for name in [f.as_posix() for f in files] + [f"{f.as_posix()}/" for f in folders]:
        parts = name.split("/")
        ends |= {"/".join(parts[n:]) for n in range(len(parts))}
    return ends


def absent_inside(root, page, ends):
    """(line number, name) of each file or folder that a page about the inside names and that does not exist."""
    for number, line in unfenced((root / page).read_text(errors="replace")):
        for name in NAMED_INSIDE.findall(line):
            if "NAME" not in name and name not in ends:
                yield number, name


def absent(root, page, files):
    """(line number, name) of each file that `page` links to or, in a README, mentions and that exists neither near it (in the folder above or below
    that), nor at that path from the root or from an include path of the sdk."""
    near = [f.as_posix() for f in files if page.parent.parent in f.parents]
    for number, line in unfenced((root / page).read_text(errors="replace")):
        for quoted, link in MENTIONED.findall(line):
            if quoted and page.name != "README.md":
                continue  # a tutorial names files that its reader creates
            name = quoted or link
            exists = any(
                (root / base / name).exists()
                for base in (page.parent, ".", "runtime/abi", "runtime/sdk")
            )
            if not exists and not any(f.endswith("/" + name) for f in near if quoted):
                yield number, name


def tracked(root):
    """Returns the files of the repository, or of an unpacked archive all files outside build/."""
    command = [
        "git",
        "-c",
        "safe.directory=*",
        "-C",
        str(root),
        "ls-files",
        "-z",
        "--cached",
        "--others",
        "--exclude-standard",
    ]
    if (root / ".git").exists():
        names = subprocess.run(command, check=True, capture_output=True).stdout.decode().split("\0")
        return [Path(n) for n in names if n and (root / n).is_file()]
    walked = (Path(d, f).relative_to(root) for d, _, files in os.walk(root) for f in files)
    return sorted(path for path in walked if path.parts[0] != "build")


def main(root):
    errors = []
    files = tracked(root)
    for path in files:
        if path.suffix not in SOURCES and path.name != "CMakeLists.txt":
            continue
        lines = (root / path).read_text(errors="replace").splitlines()
        if not any("SPDX-License-Identifier: MIT" in line for line in lines[:2]):
            errors.append(
                f"{path}:1: missing licence in the first line: SPDX-License-Identifier: MIT"
            )
    for folder in sorted({parent for path in files for parent in path.parents}):
        name = folder.as_posix()
        if name != "." and name.startswith(NO_README) and name + "/" not in NO_README:
            continue
        readme = folder / "README.md"
        if readme not in files:
            errors.append(
                f"{name}: missing README.md: purpose, what the folder must not do, where to start reading"
            )
    ends = ends_of(files)
    inside = [f for f in files if f.suffix == ".md" and f.parent.as_posix() == INSIDE]
    names = {page: list(names_inside(root, page)) for page in inside}
    words = {word for found in names.values() for _, name in found for word in WORD.findall(name)}
    unknown = unknown_words(root, files, words)
    for page in files:
        if page.suffix != ".md":
            continue
        missing = list(absent(root, page, files))
        if page.parent.as_posix() == INSIDE:
            missing += absent_inside(root, page, ends)
            missing += [named for named in names[page] if unknown & set(WORD.findall(named[1]))]
        errors += [
            f"{page}:{number}: mentions {name}, which does not exist"
            for number, name in sorted(set(missing))
        ]
    print("\n".join(errors) if errors else f"{len(files)} files checked")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
