# SPDX-License-Identifier: MIT
"""Where tests find the interface vcan0."""
from pathlib import Path


def on_vcan0(command, seconds):
    """`command` as it runs on this machine where it has vcan0, else in user-mode-linux, whose kernel has it, for so many seconds at most."""
    if Path("/sys/class/net/vcan0").exists():
        return command
    print("this machine has no vcan0: running in user-mode-linux", flush=True)
    return [str(Path(__file__).resolve().parent / "uml" / "run"), "-t", str(seconds), *command]
