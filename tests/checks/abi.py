#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""abi.py ROOT [BUILD | --record]: the interface of plugins changes only on purpose.

runtime/abi/layout.txt records every struct of runtime/abi/hal with its size, and every member with offset, size and declaration, every
enumerator with its value, every macro and function type. This compares it with what the C compiler lays out from the headers of now. A
difference is compatible when members, enumerators, macros or types were only added, members at the end of a struct that begins with its
size. docs/versioning.md states what each kind requires; `--record` writes the file anew once the headers meet that."""
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HEADERS = "runtime/abi/hal"
RECORD = "runtime/abi/layout.txt"
PURPOSE = """on purpose? Then follow docs/versioning.md (a compatible change raises HAL_ABI_MINOR, or is a new extension; an incompatible one raises
HAL_ABI_MAJOR, or the number in the id of its extension), and record it: python3 tests/checks/abi.py . --record"""
NAMED = re.compile(r"typedef (struct|union|enum) (\w+) \{(.*?)\} (\w+);", re.DOTALL)
UNNAMED = re.compile(r"(?<!\w )\benum \{(.*?)\};", re.DOTALL)


def plain(text):
    """The header without comments, continued lines and the guards of C++."""
    text = re.sub(r"/\*.*?\*/", " ", text, flags=re.DOTALL)
    text = re.sub(r"#ifdef __cplusplus\n.*?#endif\n", "", text, flags=re.DOTALL)
    return text.replace("\\\n", " ")


def one_line(text):
    return " ".join(text.split())


def members(body):
    """(name, declaration) of each member, one at a time where several share a type."""
    for statement in filter(None, (one_line(part) for part in body.split(";"))):
        if pointer := re.search(r"\(\*(\w+)\)", statement):
            yield pointer.group(1), statement
            continue
        first, *rest = (part.strip() for part in statement.split(","))
        base, name = re.fullmatch(r"(.*?[ *])(\**\w+(?:\[\w+\])?)", first).groups()
        for declarator in (name, *rest):
            yield re.sub(r"\W|\[.*", "", declarator), (base + declarator).strip()


def enumerators(body):
    return [part.split("=")[0].strip() for part in body.split(",") if part.strip()]


def describe(header, text):
    """C statements that print the lines of one header."""
    text = plain(text)
    yield f'puts("{header}");'
    for name, value in re.findall(r"^#define (\w+)[ \t]+(.+)$", text, re.MULTILINE):
        if name != "HAL_EXPORT":
            yield f'puts("    define {name} {quoted(one_line(value))}");'
    for kind, name, body, _ in NAMED.findall(text):
        if kind == "enum":
            yield f'printf("    enum {name}, size %zu\\n", sizeof({name}));'
            for one in enumerators(body):
                yield f'printf("        {one} = %lld\\n", (long long){one});'
            continue
        yield f'printf("    {kind} {name}, size %zu, alignment %zu\\n", sizeof({name}), _Alignof({name}));'
        for member, declaration in members(body):
            yield (
                f'printf("        %zu, size %zu: {quoted(declaration)}\\n", offsetof({name}, {member}), '
                f"sizeof((({name} *)0)->{member}));"
            )
    for body in UNNAMED.findall(text):
        for one in enumerators(body):
            yield f'printf("    constant {one} = %lld\\n", (long long){one});'
    for declaration in re.findall(
        r"^(?:typedef [^{};]*\(\*\w+\)[^{};]*|extern [^{};\"]*);", text, re.MULTILINE
    ):
        yield f'puts("    {quoted(one_line(declaration))}");'


def quoted(text):
    return text.replace("\\", "\\\\").replace('"', '\\"')


def layout(root):
    """The lines of the layout as the compiler has it; None on a machine of another data model, or without a C compiler."""
    compiler = os.environ.get("CC") or shutil.which("cc") or shutil.which("gcc")
    if not compiler:
        return None
    headers = sorted((root / HEADERS).glob("*.h"))
    includes = "".join(f'#include "hal/{h.name}"\n' for h in headers)
    statements = "\n".join(line for h in headers for line in describe(h.name, h.read_text()))
    with tempfile.TemporaryDirectory() as folder:
        source, program = Path(folder, "layout.c"), Path(folder, "layout")
        source.write_text(
            f"{includes}#include <stdio.h>\nint main(void) {{\nif (sizeof(void *) != 8 || sizeof(long) != 8) return 77;\n{statements}\n}}\n"
        )
        made = subprocess.run(
            [compiler, "-std=c11", f"-I{root}/runtime/abi", "-o", program, source],
            capture_output=True,
            text=True,
        )
        if made.returncode != 0:
            sys.exit(made.stderr)
        ran = subprocess.run([program], capture_output=True, text=True)
    return None if ran.returncode == 77 else ran.stdout.splitlines()


def entries(lines):
    """Header -> {owner: [line...]}; the owner of a member is the line of its struct without sizes, of anything else its header."""
    found, header, owner = {}, "", ""
    for line in lines:
        if not line.startswith(" "):
            header = owner = line
        elif not line.startswith("        "):
            owner = (
                line.strip().split(",")[0] if re.match(r" *(struct|union|enum) ", line) else header
            )
            if owner == header:
                found.setdefault(header, {}).setdefault("", []).append(line.strip())
            else:
                found.setdefault(header, {}).setdefault(owner, [])
        else:
            found.setdefault(header, {}).setdefault(owner, []).append(line.strip())
    return found


def differences(old, new):
    """(header, compatible, sentence) of each difference between two layouts, in lines."""
    old, new = entries(old), entries(new)
    for header in sorted({*old, *new}):
        before, after = old.get(header, {}), new.get(header, {})
        for owner in [*before, *(o for o in after if o not in before)]:
            had, has = before.get(owner, []), after.get(owner, [])
            grows = not owner.startswith(("struct", "union")) or bool(
                had and re.search(r": (uint32_t|size_t) size$", had[0])
            )
            place = owner or "declarations"
            if owner and owner not in before:
                yield header, True, f"{place}: new"
                continue
            if owner and owner not in after:
                yield header, False, f"{place}: removed"
                continue
            versions = {
                line for line in had + has if re.match(r"define HAL_ABI_(MAJOR|MINOR) ", line)
            }
            for line in had:
                if line not in has and line not in versions:
                    yield header, False, f"{place}: no longer as recorded: {line}"
            at_end = has[: len(had)] == had
            for line in has:
                if line not in had and line not in versions:
                    yield header, not owner.startswith(("struct", "union")) or (
                        grows and at_end
                    ), f"{place}: new: {line}"


def number(lines, name):
    return next(
        (int(line.split()[2]) for line in lines if line.strip().startswith(f"define {name} ")), 0
    )


def demands(old, new):
    """What the difference still requires before it may be recorded: sentences."""
    found = list(differences(old, new))
    major, minor = (
        number(new, name) - number(old, name) for name in ("HAL_ABI_MAJOR", "HAL_ABI_MINOR")
    )
    if major > 0:
        return []
    needed = []
    for header in sorted({header for header, compatible, _ in found if not compatible}):
        ids = [
            {
                line.strip()
                for line in lines_of(lines, header)
                if re.search(r'define \w+ "hal\.\w+/\d+"', line)
            }
            for lines in (old, new)
        ]
        if not ids[0] or ids[0] == ids[1]:  # the extensions within abi.h belong to it
            needed.append(
                f"{header}: an incompatible change: raise HAL_ABI_MAJOR"
                + (", or the number in the id of the extension" if ids[0] else "")
            )
    if found and not needed and minor <= 0 and any(header == "abi.h" for header, _, _ in found):
        needed.append("abi.h: an addition: raise HAL_ABI_MINOR")
    return needed


def lines_of(lines, header):
    inside = False
    for line in lines:
        if not line.startswith(" "):
            inside = line == header
        elif inside:
            yield line


def main(root, option=""):
    root = Path(root)
    new = layout(root)
    if new is None:
        print("skipped: the layout is recorded for 64-bit machines, and needs a C compiler")
        return 0
    record = root / RECORD
    old = record.read_text().splitlines() if record.exists() else []
    if option == "--record":
        needed = demands(old, new) if old else []
        if needed:
            print("\n".join(needed))
            return 1
        record.write_text("\n".join(new) + "\n")
        return 0
    found = [
        f"{HEADERS}/{header}: {'added' if compatible else 'INCOMPATIBLE'}: {sentence}"
        for header, compatible, sentence in differences(old, new)
    ]
    if not found and old != new:
        found = [f"{RECORD}: versions or order of declarations differ from the headers"]
    if found:
        print("\n".join([*found, PURPOSE]))
        return 1
    print(f"{sum(1 for line in new if line.startswith('        '))} members as recorded")
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:3]))
