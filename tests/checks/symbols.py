#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""symbols.py ROOT BUILD: every plugin exports `hal_plugin` and nothing else, and there is one per component source."""
import subprocess
import sys
from pathlib import Path


def exported(plugin):
    lines = subprocess.run(
        ["nm", "-D", "--defined-only", "-j", str(plugin)],
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    return lines.split()


def main(root, build):
    plugins = {p.stem: p for p in (build / "components").glob("*.so")}
    left_out = build / "components/absent"
    lines = left_out.read_text().splitlines() if left_out.exists() else []
    absent = {line.split()[0] for line in lines}
    wanted = {
        p.stem
        for p in (root / "components").glob("*/*.cpp")
        if not (p.parent / "CMakeLists.txt").exists()
    }
    errors = [f"{name}.so: not built" for name in sorted(wanted - plugins.keys() - absent)]
    for name, plugin in sorted(plugins.items()):
        symbols = exported(plugin)
        if symbols != ["hal_plugin"]:
            errors.append(
                f"{name}.so exports {', '.join(symbols) or 'nothing'}; a plugin exports hal_plugin and nothing else"
            )
    if not plugins and wanted:
        errors.append("no plugin found")
    print("\n".join(errors) if errors else f"{len(plugins)} plugins export hal_plugin only")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()))
