#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Plants one violation of each rule in a small tree and expects the checks to name exactly those."""
import contextlib
import io
import subprocess
import sys
import tempfile
from pathlib import Path

import abi
import files
import includes
import language
import symbols
import tiers

SPDX = "// SPDX-License-Identifier: MIT\n"
failures = []


def run(check, *arguments):
    output = io.StringIO()
    with contextlib.redirect_stdout(output):
        status = check.main(*arguments)
    return status, output.getvalue().splitlines()


def expect(what, got, status, *places):
    """`got` failed or passed as `status` says, with one line per place, each beginning with it."""
    lines = got[1] if got[0] else []
    if (
        got[0] != status
        or len(lines) != len(places)
        or not all(line.startswith(p) for line, p in zip(lines, places))
    ):
        failures.append(f"{what}: expected {status} {places}, got {got}")


def write(root, tree):
    for name, text in tree.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


GOOD = {
    "runtime/abi/hal/abi.h": SPDX,
    "runtime/sdk/hal/component.hpp": SPDX + '#include "hal/abi.h"\n#include <string>\n',
    "runtime/text/source.hpp": SPDX,
    "runtime/plan/plan.hpp": SPDX + '#include "hal/abi.h"\n',
    "runtime/model/model.hpp": SPDX + '#include "text/source.hpp"\n#include "plan/plan.hpp"\n',
    "runtime/execute/executor.hpp": SPDX + '#include "plan/plan.hpp"\n',
    "runtime/machine/session.hpp": SPDX
    + '#include "execute/executor.hpp"\n#include "machine/load/plugins.hpp"\n',
    "runtime/machine/load/plugins.hpp": SPDX
    + '#include "paths.hpp"\n#include <nlohmann/json.hpp>\n',
    "drivers/link/link.hpp": SPDX,
    "components/logic/not.cpp": SPDX + '#include "hal/component.hpp"\n#include "own.hpp"\n',
    "components/logic/own.hpp": SPDX,
    "components/canopen/protocol/master.cpp": SPDX + '#include "link/link.hpp"\n',
    "tools/main.cpp": SPDX + '#include "machine/session.hpp"\n#include "cli/option_set.hpp"\n',
    "tools/cli/option_set.hpp": SPDX + "#include <CLI/CLI.hpp>\n",
}
BAD_INCLUDES = {
    "components/logic/or2.cpp": SPDX + '#include "link/link.hpp"\n',
    "components/math/sum2.cpp": SPDX
    + '#include "../logic/own.hpp"\n#include "machine/session.hpp"\n#include <fmt/core.h>\n',
    "runtime/base/bad.hpp": SPDX + '#include "model/model.hpp"\n#include "nowhere.hpp"\n',
    "runtime/execute/bad.cpp": SPDX + '  #  include "../model/model.hpp"\n',
    "runtime/model/bad.cpp": SPDX + '\n#include "machine/session.hpp"\n',
    "components/canopen/master/boot/bad.cpp": SPDX + '#include "canopen/device/drive.hpp"\n',
    "components/canopen/device/drive.hpp": SPDX,
    "components/canopen/device/drive/bad.hpp": SPDX + '#include "canopen/device/circle.hpp"\n',
    "components/canopen/device/circle.hpp": SPDX + '#include "drive/bad.hpp"\n',
    "components/astrology/moon.cpp": SPDX,
    "components/ethercat/wire/frame.hpp": SPDX,
    "components/ethercat/master/bad.cpp": SPDX
    + '#include "ethercat/esc/line.hpp"\n#include "ethercat/devices/servo.hpp"\n',
    "components/ethercat/esc/line.hpp": SPDX,
    "components/ethercat/esc/bad.cpp": SPDX + '#include "ethercat/master/master.hpp"\n',
    "components/ethercat/devices/servo.hpp": SPDX,
    "components/ethercat/devices/bad.cpp": SPDX + '#include "ethercat/master/master.hpp"\n',
    "components/ethercat/master/master.hpp": SPDX,
    "components/mesa/card/card.hpp": SPDX,
    "components/mesa/driver/bad.cpp": SPDX + '#include "mesa/card/card.hpp"\n',
    "tools/bad.cpp": SPDX + 'bool b = a.starts_with("scocan:");\n',
    "drivers/README.md": "`can:can0`\n",
    "drivers/link/address_form.hpp": SPDX + '{"can:can0", ""},\n{"sim:NAME", ""},\n',
}


def check_includes(root):
    write(root, GOOD)
    expect("a tree that keeps the rules", run(includes, root), 0)
    write(root, BAD_INCLUDES)
    got = run(includes, root)
    expect(
        "forbidden includes",
        got,
        1,
        "runtime/base/bad.hpp:2:",
        "runtime/base/bad.hpp:3:",
        "runtime/execute/bad.cpp:2:",
        "runtime/model/bad.cpp:3:",
        "components/astrology/moon.cpp: components/astrology has no row",
        "components/canopen/master/boot/bad.cpp:2:",
        "components/ethercat/devices/bad.cpp:2:",
        "components/ethercat/esc/bad.cpp:2:",
        "components/ethercat/master/bad.cpp:2:",
        "components/ethercat/master/bad.cpp:3:",
        "components/logic/or2.cpp:2:",
        "components/math/sum2.cpp:2:",
        "components/math/sum2.cpp:3:",
        "components/math/sum2.cpp:4:",
        "components/mesa/driver/bad.cpp:2:",
        "tools/bad.cpp:2: tests the prefix",
        "drivers/README.md: the address `sim:NAME` is missing",
        "folders that include each other: components/canopen/device, components/canopen/device/drive",
        "    components/canopen/device/circle.hpp:2:",
        "    components/canopen/device/drive/bad.hpp:2:",
        "folders that include each other: components/ethercat/devices, components/ethercat/esc, components/ethercat/master",
        "    components/ethercat/devices/bad.cpp:2:",
        "    components/ethercat/esc/bad.cpp:2:",
        "    components/ethercat/master/bad.cpp:2:",
        "    components/ethercat/master/bad.cpp:3:",
        "folders that include each other: runtime/execute, runtime/machine, runtime/model",
        "    runtime/execute/bad.cpp:2:",
        "    runtime/machine/session.hpp:2:",
        "    runtime/model/bad.cpp:3:",
    )
    for words in includes.BANS.values():
        if not any(words in line for line in got[1]):
            failures.append(f"no line says: {words}")


def check_files(root):
    readmes = {f"{folder}/README.md": "x\n" for folder in ("runtime", "runtime/base")} | {
        "README.md": "x\n"
    }
    write(root, readmes | {"runtime/base/a.cpp": SPDX * 400})
    expect("a tree with readmes", run(files, root), 0)
    write(
        root,
        {
            "runtime/base/README.md": "read `a.cpp`, `runtime/base/a.cpp`, [up](../README.md), `gone.cpp`\n[lost](lost.md)\n"
        },
    )
    expect(
        "pages that name missing files",
        run(files, root),
        1,
        "runtime/base/README.md:1: mentions gone.cpp",
        "runtime/base/README.md:2: mentions lost.md",
    )
    write(
        root,
        readmes
        | {
            "runtime/page.md": "write `lag.cpp`, read [it](base/README.md) and [that](gone.md#there)\n"
        },
    )
    expect("a page with a dead link", run(files, root), 1, "runtime/page.md:1: mentions gone.md")
    (root / "runtime/page.md").unlink()
    inside = root / "docs/internals/bus.md"
    write(
        root,
        {
            "docs/README.md": "x\n",
            "docs/internals/bus.md": "`runtime/base/a.cpp`, `a.cpp`, `base/`, `runtime/base/`, `plugins/NAME.cpp`, `sim:x`\n",
        },
    )
    expect("a page about the inside", run(files, root), 0)
    inside.write_text("`a.cpp` and `gone.cpp`\n\n`base/`, `case/`, `runtime/a.cpp`\n")
    expect(
        "a page about the inside that names missing files",
        run(files, root),
        1,
        "docs/internals/bus.md:1: mentions gone.cpp",
        "docs/internals/bus.md:3: mentions case/",
        "docs/internals/bus.md:3: mentions runtime/a.cpp",
    )
    inside.unlink()
    write(root, readmes | {"runtime/base/z.py": "import sys\n", "tools/x.cpp": SPDX})
    expect(
        "unlicensed, undocumented",
        run(files, root),
        1,
        "runtime/base/z.py:1:",
        "tools: missing README.md",
    )


ABI = (
    SPDX.replace("//", "/*").replace("\n", " */\n")
    + """#include <stdint.h>
#define HAL_ABI_MAJOR 1
#define HAL_ABI_MINOR 0
typedef enum hal_dir { HAL_DIR_IN, HAL_DIR_OUT } hal_dir;
typedef struct hal_host {
    uint32_t size; /* bytes */
    uint32_t pad;
    void (*fail)(const struct hal_host *, const char *reason);
} hal_host;
"""
)


def check_abi(root):
    def changed(*replacements):
        text = ABI
        for old, new in replacements:
            assert old in text
            text = text.replace(old, new)
        write(root, {"runtime/abi/hal/abi.h": "#include <stddef.h>\n" + text})

    changed()
    expect("a first record", run(abi, root, "--record"), 0)
    expect("a layout as recorded", run(abi, root), 0)
    changed(("bytes", "in bytes"))
    expect("another comment", run(abi, root), 0)
    place, end = "runtime/abi/hal/abi.h: ", (
        "on purpose? Then follow docs/versioning.md",
        "HAL_ABI_MAJOR, or",
    )
    changed(("const char *reason", "int reason"))
    expect(
        "another parameter",
        run(abi, root),
        1,
        f"{place}INCOMPATIBLE: struct hal_host: no longer as recorded: 8, size 8: void (*fail)",
        f"{place}INCOMPATIBLE: struct hal_host: new: 8, size 8: void (*fail)",
        *end,
    )
    expect(
        "an incompatible change within a major version",
        run(abi, root, "--record"),
        1,
        "abi.h: an incompatible change: raise HAL_ABI_MAJOR",
    )
    changed(("HAL_DIR_IN, ", "HAL_DIR_NONE, HAL_DIR_IN, "))
    expect(
        "another value",
        run(abi, root),
        1,
        *[f"{place}INCOMPATIBLE: enum hal_dir: no longer as recorded: HAL_DIR_"] * 2,
        *[f"{place}added: enum hal_dir: new: HAL_DIR_"] * 3,
        *end,
    )
    changed(("uint32_t pad;", "uint32_t pad, more;"))
    expect(
        "a member in the middle",
        run(abi, root),
        1,
        f"{place}INCOMPATIBLE: struct hal_host: no longer as recorded: 8, size 8: void (*fail)",
        f"{place}INCOMPATIBLE: struct hal_host: new: 8, size 4: uint32_t more",
        f"{place}INCOMPATIBLE: struct hal_host: new: 16, size 8: void (*fail)",
        *end,
    )
    growth = ("reason);", "reason);\n    void (*warn)(const struct hal_host *);")
    changed(growth)
    expect(
        "a member at the end",
        run(abi, root),
        1,
        f"{place}added: struct hal_host: new: 16, size 8: void (*warn)",
        *end,
    )
    expect(
        "an addition within a minor version",
        run(abi, root, "--record"),
        1,
        "abi.h: an addition: raise HAL_ABI_MINOR",
    )
    changed(growth, ("MINOR 0", "MINOR 1"))
    expect("an addition in a new minor version", run(abi, root, "--record"), 0)
    expect("the record of an addition", run(abi, root), 0)
    changed(("uint32_t pad;", "uint32_t flags;"), ("MAJOR 1", "MAJOR 2"))
    expect("an incompatible change in a new major version", run(abi, root, "--record"), 0)


def check_language(root):
    write(
        root,
        {
            "runtime/a.cpp": SPDX
            + 'int refused = 1;\nconst char* good = "rejected; connection refused";\n',
            "a.md": "The node is offline.\n",
        },
    )
    expect("texts in the terms of the field", run(language, root), 0)
    write(
        root,
        {
            "runtime/a.cpp": SPDX + '// it says so\nconst char* bad = "the value is refused";\n',
            "a.md": "The node is silent.\nPatience.\n",
            "b.py": "refused = 1  # mend it\nprint('it refused')\n",
            "c.hal": "# a pin that is none\n",
            "e.expected": "error: x lacks y\n",
            "runtime/sdk/hal/f.hpp": SPDX + "int most_names;\nint max_names; // `most_names`\n",
        },
    )
    expect(
        "paraphrases",
        run(language, root),
        1,
        "a.md:1:",
        "a.md:2:",
        "b.py:1:",
        "b.py:2:",
        "c.hal:1:",
        "e.expected:1:",
        "runtime/a.cpp:2:",
        "runtime/a.cpp:3:",
        "runtime/sdk/hal/f.hpp:2:",
    )


def check_tiers(root):
    tree = {
        "cmake/packages": "# the table\nalpha docs/alpha.md components/alpha,tools/alpha the first\nbeta docs/beta.md components/beta the second\n",
        "README.md": "[`alpha`](docs/alpha.md) and [`beta`](docs/beta.md)\n",
        "docs/internals/core-and-packages.md": "| `alpha` | [a](../alpha.md) |\n| `beta` | [b](../beta.md) |\n",
        "docs/alpha.md": "",
        "docs/beta.md": "",
        "components/alpha/a.cpp": '#include "alpha/a.hpp"\n',
        "components/alpha/a.hpp": "",
        "components/beta/b.cpp": "",
        "tools/alpha/options.hpp": "int run_alpha(const Options&);\n",
        "tools/commands.cpp": '#include "alpha/options.hpp"\nOF_ALPHA(run_alpha)\n',
        "tools/part.hpp": 'inline constexpr char alpha[] = "alpha";\n#define OF_ALPHA(run) run\n',
        "tests/cli/a_test.py": "# packages: alpha beta\n",
    }
    write(root, tree)
    expect("packages that agree", run(tiers, root), 0)
    write(
        root,
        {
            "README.md": "[`alpha`](docs/beta.md) and [`gamma`](docs/beta.md)\n",
            "tests/cli/a_test.py": "# packages: alpha delta\n",
            "tools/commands.cpp": '#include "alpha/options.hpp"\nON_BUS(run_alpha)\n',
            "tools/main.cpp": '#include "alpha/options.hpp"\n',
            "tools/part.hpp": 'inline constexpr char beta[] = "beta";\n',
        },
    )
    (root / "components/beta/b.cpp").unlink()
    (root / "components/beta").rmdir()
    expect(
        "packages that differ",
        run(tiers, root),
        1,
        "cmake/packages: beta names components/beta,",
        "README.md: the row of alpha",
        "README.md: no row for the package beta",
        "README.md: has a row for gamma",
        "tests/cli/a_test.py: states the package delta",
        "tools/part.hpp: no row for the package alpha",
        "tools/part.hpp: names the package beta",
        "tools/part.hpp: BETA has a name or a macro OF_BETA",
        "tools/commands.cpp: run_alpha is in tools/alpha/options.hpp, of alpha",
        "tools/main.cpp: is in the core and includes tools/alpha/options.hpp",
    )


def check_symbols(root):
    write(
        root,
        {
            "components/logic/good.cpp": "int hal_plugin;\n",
            "components/logic/leaky.cpp": "int hal_plugin; int other;\n",
            "components/logic/absent.cpp": "",
            "build/components/placeholder": "",
        },
    )
    for name in ("good", "leaky"):
        subprocess.run(
            [
                "c++",
                "-shared",
                "-fPIC",
                "-o",
                root / f"build/components/{name}.so",
                root / f"components/logic/{name}.cpp",
            ],
            check=True,
        )
    expect(
        "plugins", run(symbols, root, root / "build"), 1, "absent.so: not built", "leaky.so exports"
    )


def check_clean_tree(root):
    script = Path(__file__).parent / "clean_tree.sh"
    git = ["git", "-c", "safe.directory=*", "-C", root]

    def clean(*arguments):
        return subprocess.run(
            ["sh", script, root, *arguments], capture_output=True, text=True, check=False
        )

    subprocess.run([*git, "init", "-q"], check=True)
    write(root, {"known.txt": "x"})
    before = root / ".git" / "before"
    before.write_text(clean().stdout)
    if clean(before).returncode != 0:
        failures.append("a file that was there before counts as left behind")
    write(root, {"left/behind.txt": "x"})
    result = clean(before)
    if result.returncode == 0 or "left/behind.txt" not in result.stdout or "known" in result.stdout:
        failures.append(f"a file left behind: {result}")


def main():
    for check in (
        check_includes,
        check_files,
        check_abi,
        check_language,
        check_tiers,
        check_symbols,
        check_clean_tree,
    ):
        with tempfile.TemporaryDirectory() as folder:
            check(Path(folder).resolve())
    print("\n".join(failures) or "every planted violation was found")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
