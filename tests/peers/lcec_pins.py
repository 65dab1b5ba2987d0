#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Compares our lcec devices with the drivers of lcec: lcec_pins.py HAL SOURCE [--list]

HAL is our program, SOURCE the folder `src` of a copy of lcec (linuxcnc-ethercat). Its drivers are
read, never built: the table of their types with vendor and product, and each pin that a descriptor
names, with type and direction. Compared are

* vendor and product of each type that we have,
* each of our pins: its driver must have a descriptor with this name, type and direction,
* each descriptor of a driver: each of its types must have a pin for it, unless the reason is in OPTIONAL.

Prints counts, each difference, and the types that we do not have. The exit status is 0 without a
difference."""

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

TYPES = {"HAL_BIT": "bit", "HAL_FLOAT": "float", "HAL_S32": "s32", "HAL_U32": "u32"}
DIRECTIONS = {"HAL_IN": "in", "HAL_OUT": "out", "HAL_IO": "io", "HAL_RW": "param", "HAL_RO": "out"}
# descriptors that a type has only with some modParams, or with some settings in the slave
OPTIONAL = {
    "lcec_deasda.c": {"srv-pos-cmd": "with opmode=CSP"},
    "lcec_el7342.c": {
        "srv-%d-velo-fb": "with a setting in the slave",
        "srv-%d-current-fb": "with a setting in the slave",
    },
    "lcec_el6900.c": {
        form: "with fsoeSlaveIdx"
        for form in (
            "fsoe-%d-slave-cmd",
            "fsoe-%d-slave-connid",
            "fsoe-%d-slave-crc%d",
            "fsoe-%d-master-cmd",
            "fsoe-%d-master-connid",
            "fsoe-%d-master-crc%d",
        )
    },
    "lcec_el7211.c": {
        form: "of the EL7201-9014"
        for form in ("input-0", "input-0-not", "input-1", "input-1-not", "input-sto")
    },
    "lcec_ax5805.c": {
        form: "with one axis" for form in ("fsoe-master-crc", "fsoe-slave-crc", "fsoe-in-sto")
    },
    "lcec_rtec.c": {form: "not with two axes" for form in ("status-code", "alarm-code", "voltage")},
}
# pins that lcec declares as inputs, and writes: they are outputs here
WRITTEN_INPUTS = re.compile(r"srv-(status|torque-fb-pct|diag)")
# classes whose pins depend on the device
CLASSES = {
    "lcec_class_ain.c",
    "lcec_class_aout.c",
    "lcec_class_din.c",
    "lcec_class_dout.c",
    "lcec_class_enc.c",
}
DESCRIPTOR = re.compile(r"\{\s*(HAL_\w+),\s*(HAL_\w+),\s*offsetof\([^)]*\),\s*\"([^\"]*)\"\s*\}")
VENDORS = re.compile(r"#define\s+(LCEC_\w+_VID)\s+(0x[0-9a-fA-F]+)")
OWN_VENDORS = re.compile(r"#define\s+(\w*VID\w*)\s+(0x[0-9a-fA-F]+|LCEC_\w+)")
NAMED = re.compile(
    r"\{\s*\"([\w.-]+)\",\s*(\w+),\s*(0x[0-9a-fA-F]+)|\w+\(\s*\"([\w.-]+)\",\s*(0x[0-9a-fA-F]+)"
)


def without_comments(text):
    return re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.S)


def descriptors(text):
    """The pins and parameters that a source names: (format, type, direction)."""
    found = set()
    for kind, direction, name in DESCRIPTOR.findall(text):
        if kind in TYPES and direction in DIRECTIONS:
            # "%s.%s.%s.": the names of the module, the master and the slave
            found.add((re.sub(r"^(%s\.){3}", "", name), TYPES[kind], DIRECTIONS[direction]))
    return found


def included_classes(folder, text):
    """The classes that a source includes, and those that they include."""
    found, left = set(), [text]
    while left:
        for name in re.findall(r'#include "(lcec_class_\w+)\.h"', left.pop()):
            file = folder / (name + ".c")
            if name not in found and file.exists():
                found.add(name)
                left.append(file.read_text(errors="replace"))
    return sorted(found)


def drive_pins(source):
    """The pins of the class for drives of CiA 402, which lcec names by macros."""
    text = (source / "devices" / "lcec_class_cia402_opt.h").read_text()
    names = dict(re.findall(r"#define PDO_PIN_NAME_(\w+)\s+\"([^\"]*)\"", text))
    kinds = dict(re.findall(r"#define PDO_PIN_TYPE_(\w+)\s+(HAL_\w+)", text))
    found = set()
    for group, direction in (("READ_PDOS", "out"), ("WRITE_PDOS", "in"), ("WRITE_SDOS", "in")):
        body = re.search(r"#define FOR_ALL_" + group + r"_DO\(action\)((?:.*\\\n)*.*)", text).group(
            1
        )
        for pin in re.findall(r"action\((\w+)\)", body):
            if pin in names and pin in kinds:
                found.add(("%s-" + names[pin], TYPES[kinds[pin]], direction))
    return found


def pattern(name):
    return re.compile(
        "^"
        + re.sub(r"%d", r"[0-9]+", re.sub(r"%s", r"[\\w.-]*?", re.escape(name).replace(r"\%", "%")))
        + "$"
    )


class Upstream:
    """What the sources of lcec contain."""

    def __init__(self, source):
        common = (source / "lcec.h").read_text()
        vendors = {name: int(value, 16) for name, value in VENDORS.findall(common)}
        self.types = {}  # by name: vendor, product, driver
        self.drivers = {}  # by file: (of the driver, of its classes)
        for path in sorted((source / "devices").glob("lcec_*.c")):
            text = without_comments(path.read_text(errors="replace"))
            if path.name in CLASSES or path.name.startswith("lcec_class"):
                continue
            header = path.with_suffix(".h")
            both = text + (
                without_comments(header.read_text(errors="replace")) if header.exists() else ""
            )
            own_vendors = dict(vendors)
            for name, value in OWN_VENDORS.findall(both):
                own_vendors[name] = (
                    own_vendors.get(value) or int(value, 16)
                    if value.startswith("0x")
                    else own_vendors.get(value, 0)
                )
            classes = set()
            for name in included_classes(source / "devices", both):
                file = source / "devices" / (name + ".c")
                classes |= descriptors(without_comments(file.read_text(errors="replace")))
                if name == "lcec_class_cia402":
                    classes |= drive_pins(source)
                    for part in ("lcec_class_din.c", "lcec_class_dout.c"):
                        classes |= descriptors(
                            without_comments((source / "devices" / part).read_text())
                        )
            for name in re.findall(r'#include "(lcec_el\w+)\.h"', both):
                if name != path.stem and (source / "devices" / (name + ".c")).exists():
                    other = (source / "devices" / (name + ".c")).read_text(errors="replace")
                    classes |= descriptors(without_comments(other))
                    for part in re.findall(r'#include "(lcec_class_\w+)\.h"', other):
                        file = source / "devices" / (part + ".c")
                        classes |= descriptors(without_comments(file.read_text(errors="replace")))
            self.drivers[path.name] = (descriptors(both), classes)
            plain = re.sub(r"\.(name|vid|pid)\s*=\s*", "", text)
            for macro, number in re.findall(r"#define\s+(\w+_PID)\s+(0x[0-9a-fA-F]+)", both):
                plain = re.sub(r"\b" + macro + r"\b", number, plain)
            for name, vendor, product, other, other_product in NAMED.findall(plain):
                name = name or other
                if name in self.types or not (product or other_product):
                    continue
                number = int(product or other_product, 16)
                self.types[name] = (own_vendors.get(vendor) if vendor else 2, number, path.name)


def our_devices(hal):
    """Our types with vendor and product, from the table in the sources."""
    table = (
        Path(__file__).resolve().parents[2] / "components/ethercat/config/lcec_device_table.cpp"
    ).read_text()
    found, vendor = {}, None
    for line in table.splitlines():
        words = line.split()
        if not words:
            vendor = None
        elif words[0] == "devices":
            vendor = int(words[2], 16)
        elif vendor is not None and line.startswith("  "):
            for name in words[0].split(","):
                found[name] = (vendor, int(words[1], 16))
        else:
            vendor = None
    return found


def our_pins(hal, types):
    """The pins of each of our types: name -> (type, direction)."""
    names = list(types)
    pins = {name: {} for name in names}
    with tempfile.TemporaryDirectory() as folder:
        slaves = "".join(
            f'<slave idx="{i}" type="{name}" name="s{i}"/>' for i, name in enumerate(names)
        )
        Path(folder, "ethercat-conf.xml").write_text(
            f'<masters><master idx="0" appTimePeriod="1000000">{slaves}</master></masters>'
        )
        Path(folder, "pins.hal").write_text(
            "loadrt lcec link=sim:none\nshow pin lcec.0.\nshow param lcec.0.\n"
        )
        done = subprocess.run(
            [hal, "sim", "pins.hal"], cwd=folder, capture_output=True, text=True, timeout=120
        )
        if done.returncode != 0:
            sys.exit(f"cannot load our types:\n{done.stderr}")
        for line in done.stdout.splitlines():
            words = line.split()
            full = next((w for w in words if re.match(r"lcec\.0\.s\d+\.", w)), None)
            if full is None:
                continue
            kind = next((w.lower() for w in words if w.lower() in TYPES.values()), None)
            direction = next(
                (
                    w.lower()
                    for w in words
                    if w.lower() in ("in", "out", "i/o", "io", "rw", "ro", "param")
                ),
                None,
            )
            number, name = re.match(r"lcec\.0\.s(\d+)\.(.*)", full).groups()
            if name.startswith("slave-"):
                continue
            pins[names[int(number)]][name] = (
                kind,
                {"i/o": "io", "rw": "param", "ro": "out"}.get(direction, direction),
            )
    return pins


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("hal")
    parser.add_argument("source", type=Path)
    parser.add_argument("--list", action="store_true", help="list the types that we do not have")
    options = parser.parse_args()
    upstream = Upstream(options.source)
    ours = our_devices(options.hal)
    pins = our_pins(Path(options.hal).resolve(), ours)
    differences, compared, matched, written = [], 0, 0, 0
    for name, identity in ours.items():
        if name not in upstream.types:
            differences.append(f"{name}: lcec has no such type")
            continue
        vendor, product, driver = upstream.types[name]
        if identity != (vendor or identity[0], product):
            differences.append(f"{name}: product {identity[1]:08x}, lcec {product:08x}")
        own, classes = upstream.drivers[driver]
        known = [(pattern(form), kind, direction) for form, kind, direction in own | classes]
        for pin, (kind, direction) in pins[name].items():
            compared += 1
            if driver.startswith("lcec_ax5") and WRITTEN_INPUTS.search(pin):
                written += 1
                direction = {"out": "in"}.get(direction, direction)
            if any(form.match(pin) and (kind, direction) == (k, d) for form, k, d in known):
                matched += 1
            else:
                differences.append(f"{name}: lcec's {driver} has no {direction} {kind} {pin}")
        optional = OPTIONAL.get(driver, {})
        for form, kind, direction in sorted(own):
            if form in optional:
                continue
            if not any(
                pattern(form).match(pin) and value == (kind, direction)
                for pin, value in pins[name].items()
            ):
                differences.append(f"{name}: has no {direction} {kind} {form}")
    missing = sorted(set(upstream.types) - set(ours))
    print(f"lcec: {len(upstream.types)} types in {len(upstream.drivers)} drivers; here {len(ours)}")
    print(f"pins: {compared} compared, {matched} equal in name, type and direction")
    print(f"pins that lcec declares as inputs but writes, here outputs: {written}")
    print(f"differences: {len(differences)}")
    for difference in differences:
        print("  " + difference)
    if options.list:
        print("types that are not here: " + " ".join(missing))
    return 1 if differences else 0


if __name__ == "__main__":
    sys.exit(main())
