# SPDX-License-Identifier: MIT
"""What the tests of LinuxCNC's compiled modules share. The modules are in modules/, compiled here; LinuxCNC is not needed."""
import shutil
import subprocess
from pathlib import Path

import harness

SOURCES = Path(__file__).resolve().parent / "modules"
CC = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
THREAD = "loadrt threads name1=t period1=1000000\n"


class ModuleCase(harness.Case):
    def setUp(self):
        super().setUp()
        self.modules = self.folder / "rtlib"
        self.modules.mkdir()
        self.environment["HAL_RTMOD_DIR"] = str(self.modules)

    def build(self, *names, source=None):
        for name in names:
            subprocess.run(
                [
                    CC,
                    "-shared",
                    "-fPIC",
                    "-O1",
                    "-o",
                    str(self.modules / f"{name}.so"),
                    str(SOURCES / f"{source or name}.c"),
                ],
                check=True,
            )

    def sim(self, text, *words, **how):
        return self.run_program("sim", "--quiet", self.write("m.hal", text), *words, **how)

    def error(self, text):
        """The errors that `hal sim` prints for the netlist."""
        done = self.sim(text)
        self.assertEqual(1, done.returncode, done.stdout + done.stderr)
        return done.stderr.replace(f"{self.folder}/m.hal", "m.hal")
