# SPDX-License-Identifier: MIT
"""Builds ethercrab/, a master that uses the Rust crate ethercrab, in build/peers."""
import os
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
TARGET = HERE.parents[1] / "build" / "peers" / "ethercrab"
VARIABLE = "HALCYON_ETHERCRAB"


def skip(why):
    print(why)
    sys.exit(77)


def build():
    """Returns the path of the program. Call it before the script moves to a network of its own, which has no way to the registry. Ends the script
    with 77 without cargo or its registry."""
    if VARIABLE in os.environ:
        return os.environ[VARIABLE]
    cargo = shutil.which("cargo") or shutil.which("cargo", path=str(Path.home() / ".cargo" / "bin"))
    if not cargo:
        skip("cargo is missing; type: apt-get install cargo, or install Rust with rustup")
    words = ["build", "--release", "--locked", "--quiet", "--target-dir", TARGET]
    done = subprocess.run(
        [cargo, *words, "--manifest-path", HERE / "ethercrab" / "Cargo.toml"],
        capture_output=True,
        text=True,
    )
    if done.returncode != 0:
        reason = (done.stderr.strip().splitlines() or ["no reason given"])[-1]
        skip(f"ethercrab cannot be built here: {reason}")
    os.environ[VARIABLE] = str(TARGET / "release" / "ethercrab_master")
    return os.environ[VARIABLE]
