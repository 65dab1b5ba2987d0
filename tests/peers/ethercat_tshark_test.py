#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: ethercat
"""ethercat_tshark_test.py HAL: tshark decodes what our master and our line send each other over a veth pair, from the scan to OP and back. Each
field that configures the two drives of halfiles/ethercat-servo must be what servo.ethercat asks for, and no frame may be malformed. 77: tshark or
network namespaces are missing."""
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from checks import skip

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/cli"))
import ethercat_line  # noqa: E402

MACHINE = ROOT / "halfiles/ethercat-servo"
HAL = str(Path(sys.argv[1]).resolve())
FPWR, LRW, FRMW = 5, 12, 14
STATIONS = (0x1001, 0x1002)
# 1C12h and 1600h, then 1C13h and 1A00h: emptied, filled, assigned (ETG.1000.6, clause 5.6.7).
OUTPUTS = [
    (0x1C12, 0, 0),
    (0x1600, 0, 0),
    (0x1600, 1, 0x60400010),
    (0x1600, 2, 0x60600008),
    (0x1600, 3, 0x60FF0020),
    (0x1600, 0, 3),
    (0x1C12, 1, 0x1600),
    (0x1C12, 0, 1),
]
INPUTS = [
    (0x1C13, 0, 0),
    (0x1A00, 0, 0),
    (0x1A00, 1, 0x60410010),
    (0x1A00, 2, 0x60610008),
    (0x1A00, 3, 0x60640020),
    (0x1A00, 4, 0x606C0020),
    (0x1A00, 0, 4),
    (0x1C13, 1, 0x1A00),
    (0x1C13, 0, 1),
]
SYNC_MANAGERS = {  # register: start, length, operation mode (0 three buffers, 2 mailbox), direction (1 from the master), enabled
    0x0800: [(0x1000, 256, 2, 1, 1), (0x1100, 256, 2, 0, 1)],
    0x0810: [(0x1200, 7, 0, 1, 1)],
    0x0818: [(0x1280, 11, 0, 0, 1)],
}
FMMUS = [  # of each drive: register, logical start, length, physical start, read, write, active. The third maps the state of the mailbox.
    [
        (0x0600, 0, 7, 0x1200, 0, 1, 1),
        (0x0610, 14, 11, 0x1280, 1, 0, 1),
        (0x0620, 25, 1, 0x080D, 1, 0, 1),
    ],
    [
        (0x0600, 7, 7, 0x1200, 0, 1, 1),
        (0x0610, 26, 11, 0x1280, 1, 0, 1),
        (0x0620, 37, 1, 0x080D, 1, 0, 1),
    ],
]
wrong, compared = [], 0


def wait_for(condition, what, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            sys.exit(f"not within {seconds:g} s: {what}")
        time.sleep(0.005)


def same(what, wanted, got):
    global compared
    compared += 1
    if wanted != got:
        wrong.append(f"{what}: expected {wanted}, tshark reads {got}")


def flat(layers, found):
    for name, value in layers.items():
        for one in value if isinstance(value, list) else [value]:
            if isinstance(one, dict):
                flat(one, found)
            else:
                found.setdefault(name, []).append(one)
    return found


def numbers(fields, *names):
    """Rows of the fields as numbers, a row for each repetition."""
    return list(zip(*([int(text, 0) for text in fields.get(name, [])] for name in names)))


def capture(folder):
    """Starts line and master, waits until both drives are in OP, ends them. Returns tshark's packets."""
    line, packets, shown = folder / "line", folder / "capture.pcapng", folder / "tshark"
    (folder / "servo.ethercat").write_text(
        (MACHINE / "servo.ethercat").read_text().replace("sim:servo", "eth:m0")
    )
    (folder / "servo.hal").write_text(
        "".join(
            text
            for text in (MACHINE / "servo.hal").read_text().splitlines(True)
            if "ethercat_segment" not in text and "ethercat-segment" not in text
        )
    )
    environment = {
        "HOME": str(folder),
        "PATH": os.environ["PATH"],
        "LC_ALL": "C.UTF-8",
        "XDG_RUNTIME_DIR": str(folder),
    }

    def start(log, *words):
        with open(log, "w", encoding="utf-8") as out:
            return subprocess.Popen(
                words,
                cwd=folder,
                env={**os.environ, **environment},
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=out,
            )

    sniffer = start(shown, "tshark", "-q", "-i", "m0", "-f", "ether proto 0x88a4", "-w", packets)
    wait_for(
        lambda: "Capturing on" in shown.read_text()
        and packets.exists()
        or sniffer.poll() is not None,
        "tshark captures",
    )
    if sniffer.poll() is not None:
        skip("tshark cannot capture here: " + shown.read_text().strip())
    node = start(line, HAL, "node", "ethercat", MACHINE / "servo.line", "--link", "eth:s0")
    wait_for(lambda: "press Ctrl-C" in line.read_text(), "the line starts")
    machine = start(folder / "machine", HAL, "run", "--no-picture", "servo.hal")
    for slave in (0, 1):
        wait_for(
            lambda: f"slave {slave} (servo): OP\n" in line.read_text()
            or machine.poll() is not None,
            f"slave {slave} is in OP",
        )
    machine.send_signal(signal.SIGTERM)
    machine.wait(60)
    wait_for(lambda: line.read_text().count(": INIT\n") >= 2, "the drives are in INIT again")
    node.terminate()
    node.wait(60)
    time.sleep(0.5)  # dumpcap writes what it has
    sniffer.send_signal(signal.SIGINT)
    sniffer.wait(60)
    decoded = subprocess.run(
        ["tshark", "-n", "-r", packets, "-T", "json", "--no-duplicate-keys"],
        check=True,
        capture_output=True,
        env=environment,
    )
    return json.loads(decoded.stdout)


def main():
    with tempfile.TemporaryDirectory(prefix="hal-tshark-") as folder:
        packets = capture(Path(folder))
    returned = []  # datagrams with a working counter: they have passed the slaves
    for number, packet in enumerate(packets, 1):
        layers = packet["_source"]["layers"]
        if any(
            name.startswith(("_ws.malformed", "_ws.expert"))
            for name in [*layers, *flat(layers, {})]
        ):
            wrong.append(f"frame {number} is malformed")
        for name, tree in layers.get("ecat", {}).items():
            if name.startswith("EtherCAT datagram"):
                for one in tree if isinstance(tree, list) else [tree]:
                    fields = flat(one, {})
                    if int(fields["ecat.cnt"][0], 0) != 0:
                        returned.append(
                            (
                                {
                                    name: int(fields[name][0], 0)
                                    for name in ("ecat.cmd", "ecat.cnt")
                                },
                                fields,
                            )
                        )
    for n, station in enumerate(STATIONS):
        writes = [
            fields
            for head, fields in returned
            if head["ecat.cmd"] == FPWR and int(fields["ecat.adp"][0], 0) == station
        ]
        states = [row[0] for fields in writes for row in numbers(fields, "ecat.reg.alctrl.ctrl")]
        same(f"{station:#x}: states requested until OP", [2, 4, 8], list(dict.fromkeys(states))[:3])
        downloads = [
            row[1:]
            for fields in writes
            for row in numbers(
                fields,
                "ecat_mailbox.coe.sdoreq",
                "ecat_mailbox.coe.sdoidx",
                "ecat_mailbox.coe.sdosub",
                "ecat_mailbox.coe.sdodata",
            )
            if row[0] == 1
        ]
        downloads = [
            row for at, row in enumerate(downloads) if at == 0 or row != downloads[at - 1]
        ]  # without requests that were repeated
        for at, wanted in enumerate(OUTPUTS + INPUTS):
            same(
                f"{station:#x}: download {at}",
                tuple(map(hex, wanted)),
                tuple(map(hex, downloads[at])) if at < len(downloads) else None,
            )
        registers = {}
        for fields in writes:
            at = int(fields["ecat.ado"][0], 0)
            managers = numbers(
                fields,
                "ecat.syncman.start",
                "ecat.syncman.len",
                "ecat.syncman.opmode",
                "ecat.syncman.access",
                "ecat.syncman.enable",
            )
            fmmus = numbers(
                fields,
                "ecat.fmmu.lstart",
                "ecat.fmmu.llen",
                "ecat.fmmu.pstart",
                "ecat.fmmu.typeread",
                "ecat.fmmu.typewrite",
                "ecat.fmmu.activate0",
            )
            if any(map(any, managers + fmmus)):  # not those that clear them
                registers.setdefault(at, managers + fmmus)
            for name in ("ecat.reg.dc.cyctime0", "ecat.reg.dc.activation"):
                for row in numbers(fields, name):
                    registers[name] = row[0]
        for at, wanted in SYNC_MANAGERS.items():
            same(f"{station:#x}: sync managers at {at:#06x}", wanted, registers.get(at))
        for at, *wanted in FMMUS[n]:
            same(f"{station:#x}: FMMU at {at:#06x}", [tuple(wanted)], registers.get(at))
        same(
            f"{station:#x}: cycle of SYNC0 in ns", 1_000_000, registers.get("ecat.reg.dc.cyctime0")
        )
        same(
            f"{station:#x}: activation of the clock: cyclic, SYNC0",
            3,
            registers.get("ecat.reg.dc.activation"),
        )
    same(
        "a cycle with both drives counts 3 for each",
        6,
        max(head["ecat.cnt"] for head, _ in returned if head["ecat.cmd"] == LRW),
    )
    same(
        "the time of the clock passes both drives",
        2,
        max(head["ecat.cnt"] for head, _ in returned if head["ecat.cmd"] == FRMW),
    )
    print(
        "\n".join(wrong)
        or f"{compared} values, {len(returned)} datagrams of {len(packets)} frames: tshark reads what the configuration asks for"
    )
    return 1 if wrong or len(returned) < 100 else 0


if __name__ == "__main__":
    if shutil.which("tshark") is None:
        skip("no tshark; type: sudo apt install tshark")
    ethercat_line.network()
    sys.exit(main())
