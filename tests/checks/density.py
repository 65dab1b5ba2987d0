#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Prints how densely the C++ sources are written, and the worst places. It measures; it never fails.

usage: density.py ROOT [BUILD] [--worst N] [--folders FOLDER...] [--layout BRACES]

  branches/100  branches (cyclomatic complexity - 1) per 100 lines of function bodies; needs lizard
  tokens/line   words, numbers and operators per line that is neither empty nor a comment
  two '?'       lines with two or more conditional operators
  nested '?'    statements with a conditional operator in the result of another one
  comma         statements that join assignments by a comma, and `return a = b, c;`
  wide          lines of more than 100 columns
  split         classes whose member functions are defined in more than one .cpp

A figure per line depends on where lines are broken. --layout measures the text as clang-format lays
it out with each statement on a line of its own and the braces of a style (Attach, Linux, Allman ...),
so that trees of different layouts can be compared.
"""

import argparse
import collections
import re
import subprocess
import sys
from pathlib import Path

SOURCES = {".c", ".cpp", ".h", ".hpp"}
FOLDERS = ("runtime", "components", "drivers", "tools")
TOKEN = re.compile(r"[A-Za-z_]\w*|\d[\w.']*|[^\s\w]")
ASSIGNMENT = r"[\w.\->\[\]()*]+ (?:=|\+=|-=|\|=) "
COMMA = re.compile(
    rf"^\s*{ASSIGNMENT}[^;{{]*, {ASSIGNMENT}[^;]*;|return [\w.\->\[\]]+ = [^;]*, [^;]+;"
)
MEMBER = re.compile(r"^(?=\S)[\w:<>&*,\s]*?\b([A-Z]\w+)::~?\w+\s*\(", re.MULTILINE)


def plain(text):
    """The text without comments and the contents of literals; line breaks stay."""
    text = re.sub(r"/\*.*?\*/", lambda found: "\n" * found.group().count("\n"), text, flags=re.S)
    text = re.sub(r"//[^\n]*", "", text)
    text = re.sub(r'"(?:\\.|[^"\\\n])*"', '""', text)
    return re.sub(r"'(?:\\.|[^'\\\n])'", "''", text)


def outside_parentheses(line):
    """The line without what its brackets hold: a comma between arguments joins no statements."""
    kept, depth = [], 0
    for character in line:
        opens, closes = character in "([{", character in ")]}"
        depth += opens
        if depth == 0 or (opens and depth == 1):
            kept.append(character)
        depth -= closes
    return "".join(kept)


def has_nested_conditional(statement):
    """Whether a `?` follows another one at the same depth of brackets, without a comma between."""
    depth, conditional_at = 0, set()
    for character in statement:
        if character in "([":
            depth += 1
        elif character in ")]":
            conditional_at.discard(depth)
            depth -= 1
        elif character == ",":
            conditional_at.discard(depth)
        elif character == "?":
            if depth in conditional_at:
                return True
            conditional_at.add(depth)
    return False


def laid_out(text, name, braces):
    """The text with each statement on a line of its own, and with braces placed as in a style."""
    style = (
        "{BasedOnStyle: Google, IndentWidth: 4, ColumnLimit: 100, SortIncludes: Never, "
        f"BreakBeforeBraces: {braces}, AllowShortIfStatementsOnASingleLine: Never, "
        "AllowShortLoopsOnASingleLine: false, AllowShortCaseLabelsOnASingleLine: false}"
    )
    command = ["clang-format-19", f"--style={style}", f"--assume-filename={name}"]
    return subprocess.run(command, input=text, capture_output=True, text=True, check=True).stdout


class Measures:
    """Totals of a tree, and its worst places."""

    def __init__(self, braces=None):
        self.braces = braces
        self.files = self.code = self.tokens = 0
        self.two = self.nested = self.comma = self.wide = 0
        self.branches = self.function_lines = 0
        self.functions = []
        self.owners = collections.defaultdict(set)

    def add(self, path, name, lizard):
        text = path.read_text(encoding="utf-8", errors="replace")
        if self.braces:
            text = laid_out(text, name, self.braces)
        stripped = plain(text)
        self.files += 1
        self.nested += sum(map(has_nested_conditional, re.split("[;{}]", stripped)))
        self.wide += sum(len(line) > 100 for line in text.splitlines())
        for line in filter(str.strip, stripped.splitlines()):
            self.code += 1
            self.tokens += len(TOKEN.findall(line))
            self.two += line.count("?") >= 2
            self.comma += bool(COMMA.search(outside_parentheses(line)))
        if path.suffix == ".cpp":
            for owner in MEMBER.findall(stripped):
                self.owners[(Path(name).parent.as_posix(), owner)].add(path.name)
        if lizard:
            self.add_functions(lizard.analyze_file.analyze_source_code(name, text).function_list)

    def add_functions(self, functions):
        for function in functions:
            branches = function.cyclomatic_complexity - 1
            self.branches += branches
            self.function_lines += function.nloc
            place = f"{function.filename}:{function.start_line} {function.name}"
            self.functions.append((branches, place))

    def print(self, worst):
        split = {owner: names for owner, names in self.owners.items() if len(names) > 1}
        print(f"{self.files} files, {self.code} lines of code, {self.tokens} tokens")
        if self.function_lines:
            print(f"branches/100  {100 * self.branches / self.function_lines:6.1f}")
        else:
            print("branches/100  not measured: lizard is missing; type: pip install lizard")
        print(f"tokens/line   {self.tokens / max(self.code, 1):6.1f}")
        for label, value in (
            ("two '?'", self.two),
            ("nested '?'", self.nested),
            ("comma", self.comma),
            ("wide", self.wide),
            ("split", len(split)),
        ):
            print(f"{label:14}{value:6}")
        for branches, place in sorted(self.functions, reverse=True)[:worst]:
            print(f"    {branches:4} branches  {place}")
        most_split = sorted(split.items(), key=lambda item: -len(item[1]))
        for (folder, owner), names in most_split[:worst]:
            print(f"    {len(names):4} files     {folder}/ {owner}")


def optional_lizard():
    try:
        import lizard
    except ImportError:
        return None
    return lizard


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("root", type=Path)
    parser.add_argument("build", nargs="?")
    parser.add_argument("--worst", type=int, default=10)
    parser.add_argument("--folders", nargs="+", default=FOLDERS)
    parser.add_argument("--layout", metavar="BRACES")
    options = parser.parse_args()
    lizard = optional_lizard()
    measures = Measures(options.layout)
    for folder in options.folders:
        for path in sorted((options.root / folder).rglob("*")):
            if path.suffix in SOURCES and path.is_file():
                measures.add(path, path.relative_to(options.root).as_posix(), lizard)
    measures.print(options.worst)


if __name__ == "__main__":
    sys.exit(main())
