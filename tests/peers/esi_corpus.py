#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""esi_corpus.py [--revisions] [--sample N [--seed N]] [--reasons] FOLDER: generates a configuration
and a netlist for each type of device of the device descriptions (ESI) below a folder, or for each
of its revisions, runs them in memory, and counts the devices that reach OP. Prints each other
device with its reason. No file of vendors is in the tree: clone public repositories with ESI files
into a folder outside of it. HAL_BIN names the program, else build/release."""

import argparse
import collections
import os
import random
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
HAL = os.environ.get("HAL_BIN", str(ROOT / "build/release/bin/hal"))


def local(element):
    return element.tag.rsplit("}", 1)[-1]


def text_of(element, tag):
    child = next((child for child in element if local(child) == tag), None)
    return "" if child is None else (child.text or "").strip()


def number_text(text):
    """A number of an ESI as hexadecimal, in one spelling; an invalid number as it is."""
    try:
        return hex(int(text.strip().lower().replace("#x", "0x"), 0))
    except ValueError:
        return text


def devices_of(path):
    """What selects each type of device of a file: its order code, its name or its product code.
    Nothing for other XML files."""
    try:
        root = xml.etree.ElementTree.parse(path).getroot()
    except (xml.etree.ElementTree.ParseError, UnicodeDecodeError, ValueError):
        return []
    if not local(root).startswith("EtherCATInfo"):
        return []
    types = {}
    for device in (element for element in root.iter() if local(element) == "Device"):
        kind = next((child for child in device if local(child) == "Type"), None)
        if kind is None:
            continue
        code = number_text(kind.get("ProductCode") or "0")
        order = (kind.text or "").strip()
        types[order.lower(), code] = (order, text_of(device, "Name"), code)
    columns = [
        collections.Counter(word.lower() for word in column) for column in zip(*types.values())
    ]
    selectors = []
    for words in types.values():
        unique = [word for word, count in zip(words, columns) if word and count[word.lower()] == 1]
        selectors.append(unique[0] if unique else words[0])
    return selectors


DEVICE = re.compile(rb"<Device(?=[\s>])[^>]*>|</Device>")


def device_spans(data):
    """Where the devices of a file begin and end; a device within a device is a part of it."""
    spans, depth, start = [], 0, 0
    for tag in DEVICE.finditer(data):
        if tag.group().endswith(b"/>"):
            continue
        if not tag.group().startswith(b"</"):
            start = tag.start() if depth == 0 else start
            depth += 1
        elif depth > 0:
            depth -= 1
            if depth == 0:
                spans.append((start, tag.end()))
    return spans


def without_comments(path):
    return re.sub(rb"<!--.*?-->", b"", path.read_bytes(), flags=re.S)


def revisions_of(path):
    """The numbers of the devices of a file, each of which is one revision of a type."""
    return range(len(device_spans(without_comments(path))))


def run_revision(path, number):
    """Runs one revision from a file that describes no other device: its reason as of run()."""
    data = without_comments(path)
    spans = device_spans(data)
    rest = [
        data[end:start] for end, start in zip([0] + [s[1] for s in spans], [s[0] for s in spans])
    ]
    alone = b"".join(rest) + data[slice(*spans[number])] + data[spans[-1][1] :]
    with tempfile.TemporaryDirectory(prefix="hal-esi-") as folder:
        file = Path(folder) / "device.xml"
        file.write_bytes(alone)
        return run(file, None)


def hal(folder, *words):
    done = subprocess.run(
        [HAL, *words], cwd=folder, capture_output=True, text=True, errors="replace", timeout=120
    )
    return done.returncode, done.stdout + done.stderr


def last_cause(text):
    """The message of a run that names why the slave is not operational, without the names of the
    slave."""
    lines = [line for line in text.splitlines() if re.search(r"slave 0|error:|cannot|fault", line)]
    lines = [line for line in lines if "operational after" not in line]
    return (
        re.sub(r"slave 0 \([^)]*\)", "slave", lines[0]) if lines else "no message: " + text[-200:]
    )


def run(path, order):
    """The reason why a device does not reach OP; None: it does. Without an order code, the device
    is the only one of the file."""
    with tempfile.TemporaryDirectory(prefix="hal-esi-") as folder:
        selector = str(path) if order is None else f"{path}:{order}"
        quoted = "'" + selector.replace("'", "''") + "'"
        code, text = hal(folder, "ethercat", "config", "--esi", quoted, "one")
        if code != 0:
            return "config: " + text.strip().splitlines()[-1]
        netlist = (Path(folder) / "one.hal").read_text()
        if "ethercat_segment" not in netlist:
            return "not emulated: " + text.strip().splitlines()[0]
        code, text = hal(folder, "sim", "one.hal", "--for", "8s")
        if "is operational after" in text:
            return None
        return "run: " + last_cause(text)


def kind_of(reason):
    """A reason without the numbers and names of one device."""
    short = re.sub(r"'[^']*'|0x[0-9A-Fa-f]+|\b[0-9A-F]{4}\b|\d+", "…", reason)
    return short[:140]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--revisions", action="store_true", help="run each revision of a type")
    parser.add_argument("--sample", type=int, help="run so many devices, chosen by the seed")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--reasons", action="store_true", help="print the kinds of reasons only")
    options = parser.parse_args()
    paths = sorted(options.folder.resolve().rglob("*.[xX][mM][lL]"))
    files = {path: devices_of(path) for path in paths}
    files = {path: devices for path, devices in files.items() if devices}
    if options.revisions:
        files = {path: revisions_of(path) for path in files}
    every = [(path, order) for path, devices in files.items() for order in devices]
    if options.sample is not None and options.sample < len(every):
        every = sorted(random.Random(options.seed).sample(every, options.sample))
    good = 0
    kinds = collections.Counter()
    for path, order in every:
        reason = run_revision(path, order) if options.revisions else run(path, order)
        if reason is None:
            good += 1
            continue
        kinds[kind_of(reason)] += 1
        if not options.reasons:
            device = f"device {order + 1}" if options.revisions else order
            print(f"{path.name}: {device}: {reason}", flush=True)
    for kind, count in kinds.most_common():
        print(f"{count:5}  {kind}")
    if not every:
        print("no device description in the folder")
        return 1
    print(
        f"{good} of {len(every)} devices of {len(files)} files reach OP, {100 * good / len(every):.1f} %"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
