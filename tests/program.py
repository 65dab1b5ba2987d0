# SPDX-License-Identifier: MIT
"""The program that the tests run, and an environment for it with nothing of the user's own."""
import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def program(arguments=()):
    """The first of `arguments` when it is one, which is taken off; else $HAL_BIN; else the newest build."""
    if arguments and Path(arguments[0]).name == "hal" and os.access(arguments[0], os.X_OK):
        return Path(arguments.pop(0)).resolve()
    if os.environ.get("HAL_BIN"):
        return Path(os.environ["HAL_BIN"]).resolve()
    built = sorted((ROOT / "build").glob("*/bin/hal"), key=lambda path: path.stat().st_mtime)
    if not built:
        sys.exit("no program to test; build it (./hal --version) or set HAL_BIN")
    return built[-1]


def environment(hal, folder):
    """No colours, no running instances, no home but `folder`."""
    keep = {
        key: value
        for key, value in os.environ.items()
        if key in ("PATH", "HALCYON_PLUGIN_PATH", "QEMU_LD_PREFIX") or key.endswith("SAN_OPTIONS")
    }
    return {
        **keep,
        "LC_ALL": "C.UTF-8",
        "NO_COLOR": "1",
        "TERM": "dumb",
        "HOME": folder,
        "XDG_RUNTIME_DIR": folder,
        "PATH": f"{hal.parent}:{os.environ['PATH']}",
    }
