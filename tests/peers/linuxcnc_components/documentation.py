# SPDX-License-Identifier: MIT
"""The tables of the intended differences in docs/linuxcnc-same-names.md."""
from . import expected

BEGIN = "<!-- begin: written by tests/peers/linuxcnc_components.py --write-docs -->"
END = "<!-- end -->"


def names(pattern):
    """A regular expression of names as a list in words."""
    return pattern.replace("|", ", ").replace("\\.", ".").replace(".*", "*")


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    return lines + ["| " + " | ".join(row) + " |" for row in rows]


def text():
    lines = table(
        ("component", "pins", "when", "Halcyon", "LinuxCNC", "why"),
        sorted(
            {
                (
                    e.component,
                    names(e.pins),
                    e.condition,
                    e.ours,
                    e.linuxcnc + ("" if len(e.versions) == 2 else f" ({e.versions[0]} only)"),
                    e.why,
                )
                for e in expected.BEHAVIOURS
            }
        ),
    )
    lines += ["", "Pins and parameters:", ""]
    lines += table(
        ("component", "name", "Halcyon", "LinuxCNC", "why"),
        sorted(
            {
                (
                    e.component,
                    names(e.names),
                    e.ours,
                    e.linuxcnc + ("" if len(e.versions) == 2 else f" ({e.versions[0]} only)"),
                    e.why,
                )
                for e in expected.INVENTORY
            }
        ),
    )
    lines += ["", "Compared by their pins only:", ""]
    lines += table(("component", "why"), sorted(expected.INVENTORY_ONLY.items()))
    lines += ["", "Compared by their pins only, because they follow another law on purpose:", ""]
    lines += table(("component", "what differs"), sorted(expected.UNLIKE.items()))
    lines += ["", "2.10 differs from 2.9, and ours is 2.10's:", ""]
    lines += table(("component", "what is newer"), sorted(expected.NEWER.items()))
    return "\n".join(lines)


def check(page):
    """Lines if the page has other tables."""
    content = page.read_text()
    if f"{BEGIN}\n\n{text()}\n\n{END}" in content:
        return []
    return [
        f"{page.name}: its tables of differences are out of date; type: tests/peers/linuxcnc_components.py HAL --write-docs"
    ]


def write(page):
    content = page.read_text()
    first, last = content.index(BEGIN), content.index(END)
    page.write_text(content[:first] + f"{BEGIN}\n\n{text()}\n\n" + content[last:])
