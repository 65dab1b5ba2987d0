#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: mesa
"""mesa_mesaflash_test.py HAL: mesaflash reads the firmware, the pins and the smart-serial port of our emulated cards, and finds what `hal mesa` prints.
77: mesaflash is missing."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from checks import check, checked, skip, wait_for

HAL = str(Path(sys.argv[1]).resolve())
MESAFLASH = shutil.which(os.environ.get("MESAFLASH", "mesaflash"))
FOLDER = Path(tempfile.mkdtemp(prefix="hal-mesaflash-"))
ENVIRONMENT = {**os.environ, "HOME": str(FOLDER), "XDG_STATE_HOME": str(FOLDER)}
# its port is fixed: an address of the loopback network for each process
ADDRESS = f"127.27.{os.getpid() // 250 % 250}.{os.getpid() % 250 + 1}"
MODULES = {
    "WatchDog": "watchdog",
    "IOPort": "ioport",
    "QCount": "encoder",
    "SSerial": "sserial",
    "StepGen": "stepgen",
    "LED": "led",
    "PWM": "pwmgen",
    "DPLL": "dpll",
    "SSR": "ssr",
    "InM": "inm",
    "InMux": "inmux",
    "MuxedQCount": "muxed encoder",
    "MuxedQCountSel": "encoder multiplexer",
    "OutM": "outm",
}
CHANNELS = {"7i92": 4, "7i76e": 2, "7i95": 2, "7i96s": 1}


def mesaflash(card, *words):
    """It waits for an answer for some ms, once: a busy host needs several attempts."""
    command = [MESAFLASH, "--device", card.upper(), "--addr", ADDRESS, *words]
    for _ in range(20):
        text = subprocess.run(command, capture_output=True, text=True, timeout=60).stdout
        if "board found" not in text:
            break
    return text


def ours(command):
    printed = subprocess.run(
        [HAL, "mesa", command, ADDRESS, "--json"],
        capture_output=True,
        text=True,
        env=ENVIRONMENT,
        timeout=60,
    ).stdout
    return json.loads(printed)


def compare(card):
    text = mesaflash(card, "--readhmid")
    info = ours("info")
    modules = re.findall(
        r"Module: (\w+)\n +There are (\d+) of .*\n +Version: (\d+)\n +Registers: (\d+)\n +"
        r"BaseAddress: (\w+)\n",
        text,
    )
    theirs = {
        MODULES.get(name): (int(count), int(version), int(registers), int(base, 16))
        for name, count, version, registers, base in modules
    }
    wanted = {
        one["name"]: (one["count"], one["version"], one["registers"], one["base"])
        for one in info["modules"]
    }
    check(f"{card}: modules", theirs == wanted, theirs, wanted)
    check(f"{card}: name of the board", f"BoardName : {info['board']}" in text, text)
    pins = re.findall(r"pin (\d+):\n.*\n +Secondary Tag:", mesaflash(card, "--print-pd"))
    wanted = [one["gpio"] for one in ours("pins") if one["module"]]
    check(f"{card}: pins of modules", list(map(int, pins)) == wanted, pins, wanted)
    serial = mesaflash(card, "--sserial")
    check(f"{card}: channels", f"Channels: {CHANNELS[card]}\n" in serial, serial)
    check(f"{card}: baud rate", "Baud Rate: 2500000" in serial, serial)
    check(f"{card}: a register", mesaflash(card, "--rpo", "0x100").strip() == "55AACAFE")


if MESAFLASH is None:
    skip("mesaflash is missing; type: apt-get install mesaflash")
try:
    for name in CHANNELS:
        (FOLDER / "card.mesa").write_text(f"[card]\ntype = {name}\n")
        log = FOLDER / f"{name}.log"
        node = subprocess.Popen(
            [HAL, "node", "mesa", str(FOLDER / "card.mesa"), "--address", ADDRESS],
            stdout=log.open("w"),
            stderr=subprocess.STDOUT,
            env=ENVIRONMENT,
        )
        try:
            if wait_for(lambda: f"{name} at" in log.read_text()):
                compare(name)
            else:
                check(f"{name}: the card runs", False, log.read_text())
        finally:
            node.send_signal(signal.SIGTERM)
            node.wait()
finally:
    shutil.rmtree(FOLDER, ignore_errors=True)
sys.exit(checked())
