#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: tdma
"""tdma_tshark_test.py TDMA_FRAMES: tshark decodes the frames of TDMA (0x9021) and RTcfg (0x9022) as we make them; every field that the
program TDMA_FRAMES prints must equal what tshark reads. Skipped (77) without tshark."""
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path


def fields_of(layers, found):
    """All `name: value` of tshark's tree, flat."""
    for name, value in layers.items():
        for one in value if isinstance(value, list) else [value]:
            if isinstance(one, dict):
                fields_of(one, found)
            else:
                found.setdefault(name, []).append(str(one))
    return found


def number(text):
    """Returns an integer in any notation, None for other text."""
    try:
        return int(text, 0)
    except ValueError:
        return {"True": 1, "False": 0}.get(text)


def same(wanted, got):
    if number(wanted) is not None and number(got) is not None:
        return number(wanted) == number(got)
    return wanted.lower().replace(":", "") == got.lower().replace(":", "")


def main():
    if shutil.which("tshark") is None:
        print("no tshark; type: sudo apt install tshark")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        capture, fields = Path(folder) / "tdma.pcapng", Path(folder) / "fields"
        subprocess.run([sys.argv[1], capture, fields], check=True)
        decoded = subprocess.run(
            ["tshark", "-n", "-r", capture, "-T", "json", "--no-duplicate-keys"],
            check=True,
            capture_output=True,
            env={"HOME": folder, "PATH": "/usr/bin:/bin:/usr/local/bin", "LC_ALL": "C.UTF-8"},
        )
        wanted = [
            dict(pair.split("=", 1) for pair in line.split())
            for line in fields.read_text().splitlines()
        ]
        frames = [
            fields_of(packet["_source"]["layers"], {}) for packet in json.loads(decoded.stdout)
        ]
    wrong, compared = [], 0
    if len(frames) != len(wanted):
        wrong.append(f"{len(wanted)} frames were written, tshark reads {len(frames)}")
    for index, (want, got) in enumerate(zip(wanted, frames), 1):
        for name, value in want.items():
            compared += 1
            if not any(same(value, one) for one in got.get(name, [])):
                wrong.append(
                    f"frame {index}: {name} is {value}, tshark reads {got.get(name, 'no such field')}"
                )
        if any(name.startswith(("_ws.malformed", "_ws.expert")) for name in got):
            wrong.append(f"frame {index}: tshark finds it malformed")
    print(
        "\n".join(wrong)
        or f"{compared} fields of {len(frames)} frames: tshark reads what was written"
    )
    return 1 if wrong or compared < 100 else 0


if __name__ == "__main__":
    sys.exit(main())
