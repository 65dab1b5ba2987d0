# SPDX-License-Identifier: MIT
"""The inventory of a component: its pins, parameters and functions with type, direction and default value."""
import json
import re
from dataclasses import dataclass

# Created by the host for each function; no part of the component.
MEASURED = re.compile(r"\.(time|tmax|tmax-increased)$")
TRUTH = {"TRUE": "TRUE", "FALSE": "FALSE"}


@dataclass(frozen=True)
class Item:
    """A pin or a parameter. `value` is its default as text."""

    name: str
    kind: str  # "pin" or "param"
    type: str
    direction: str
    value: str


@dataclass
class Inventory:
    items: dict
    functions: list

    def pins(self, *directions):
        return [
            item
            for item in self.items.values()
            if item.kind == "pin" and item.direction in directions
        ]

    def settings(self):
        """Items that `setp` accepts and that no stream can drive: I/O pins and writable parameters."""
        return [item for item in self.items.values() if item.direction in ("I/O", "RW")]

    def readable_parameters(self):
        return [item for item in self.items.values() if item.kind == "param"]


LINE = re.compile(
    r"^\s*(?:\d+|[-\w.]+)\s+(bit|float|s32|u32|s64|u64|port)\s+(IN|OUT|I/O|IO|RO|RW)\s+(\S*)\s+(\S+)(?:\s+(?:<=|=|==>).*)?$"
)


def parse(text):
    """Reads the output of `show pin`, `show param` and `show funct`, in that order, of one program or the other."""
    items, functions, kind = {}, [], ""
    for line in text.splitlines():
        if line.startswith("Component Pins"):
            kind = "pin"
        elif line.startswith("Parameters"):
            kind = "param"
        elif line.startswith(("Exported Functions", "Functions")):
            kind = "funct"
        elif kind in ("pin", "param"):
            found = LINE.match(line)
            if found:
                type_, direction, value, name = found.groups()
                if not MEASURED.search(name):
                    items[name] = Item(name, kind, type_, direction.replace("IO", "I/O"), value)
        elif kind == "funct" and line.strip() and not line.startswith("Owner"):
            functions.append(line.split()[-1])
    return Inventory(items, functions)


def number(text):
    """A default as a number, whatever its notation."""
    if text in TRUTH:
        return float(text == "TRUE")
    try:
        return float(int(text, 0))
    except ValueError:
        return float(text)


def same_value(ours, theirs):
    """LinuxCNC prints six or seven digits."""
    try:
        a, b = number(ours), number(theirs)
    except ValueError:
        return ours == theirs
    return a == b or abs(a - b) <= 2e-6 * max(abs(a), abs(b)) or (a != a and b != b)


def differences(ours, theirs):
    """Yields (name, what is ours, what is LinuxCNC's) for each difference of two inventories."""
    for name in sorted(ours.items.keys() | theirs.items.keys()):
        a, b = ours.items.get(name), theirs.items.get(name)
        if a is None:
            yield name, "missing", f"{b.kind} {b.type} {b.direction} {b.value}"
        elif b is None:
            yield name, f"{a.kind} {a.type} {a.direction} {a.value}", "missing"
        elif (a.kind, a.type, a.direction) != (b.kind, b.type, b.direction) or not same_value(
            a.value, b.value
        ):
            yield name, f"{a.kind} {a.type} {a.direction} {a.value}", f"{b.kind} {b.type} {b.direction} {b.value}"
    for name in sorted(set(ours.functions) ^ set(theirs.functions)):
        yield name, *(
            ("function", "missing") if name in ours.functions else ("missing", "function")
        )


def as_facts(inventory):
    """The form in which an inventory is kept in inventory.json."""
    return {
        "functions": sorted(inventory.functions),
        "items": [
            [item.name, item.kind, item.type, item.direction, item.value]
            for item in sorted(inventory.items.values(), key=lambda i: i.name)
        ],
    }


def from_facts(facts):
    return Inventory({row[0]: Item(*row) for row in facts["items"]}, facts["functions"])


def load_facts(path):
    return {name: from_facts(facts) for name, facts in json.loads(path.read_text()).items()}


def save_facts(path, inventories):
    rows = []
    for name in sorted(inventories):
        facts = as_facts(inventories[name])
        items = ",\n  ".join(json.dumps(item) for item in facts["items"])
        rows.append(
            f'{json.dumps(name)}: {{"functions": {json.dumps(facts["functions"])}, "items": [\n  {items}]}}'
        )
    path.write_text("{\n" + ",\n".join(rows) + "\n}\n")
