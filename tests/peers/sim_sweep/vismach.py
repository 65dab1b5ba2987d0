# SPDX-License-Identifier: MIT
"""In place of LinuxCNC's module vismach, for models without a window: each name of that module does nothing, but `main` has its pin and waits."""
import ast
import pathlib
import sys
import time
from math import *  # models have these names from it

import hal


class Nothing:
    def __init__(self, *_, **__):
        pass

    def __call__(self, *_, **__):
        return self

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return self


gluNewQuadric = Nothing  # of OpenGL, which the real module passes on


def main(*_, **__):
    component = hal.component("vismach")
    component.newpin("plotclear", hal.HAL_BIT, hal.HAL_IN)
    component.ready()
    try:
        while True:
            time.sleep(1)
    except KeyboardInterrupt:
        sys.exit(0)


for folder in sys.path:
    file = pathlib.Path(folder, "vismach.py")
    if file.is_file() and file.resolve() != pathlib.Path(__file__).resolve():
        for node in ast.parse(file.read_text(encoding="utf-8")).body:
            if isinstance(node, (ast.ClassDef, ast.FunctionDef)) and node.name != "main":
                globals()[node.name] = type(node.name, (Nothing,), {})
        break
