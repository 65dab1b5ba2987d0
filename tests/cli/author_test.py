#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""`hal compile` rejects a component that cannot be loaded or whose declarations contradict each other, with the reason."""

import os
import re
import subprocess
import unittest

from harness import HAL, ROOT, Case

HEAD = '#include "hal/component.hpp"\n#include <cmath>\n#include <stdexcept>\nstruct Mine : hal::Component {\n    using Component::Component;\n'
TAIL = '};\nHAL_COMPONENT(Mine, "mine", "Something of mine")\n'
IN = '    hal::In<double> in{*this, "in", "the input"};\n'
OUT = '    hal::Out<double> out{*this, "out", "the output"};\n'
RUN = '    hal::Function run{*this, "", &Mine::step, "one step"};\n'
STEP = "    void step(hal::Cycle) noexcept { out = in; }\n"
GOOD = IN + OUT + RUN + STEP

# What is in the component, and all that is printed: line 6 is the first behind the head.
REJECTED = {
    "two pins of one name": (
        IN + OUT.replace('"out"', '"in"') + RUN + STEP,
        "mine.cpp:7: component 'mine' declares pin 'mine.0.in' twice",
    ),
    "a function below its pin": (
        IN + OUT.replace('*this, "out"', '*this, run, "out"') + RUN + STEP,
        "mine.cpp:7: component 'mine' cannot make 'mine.0': pin 'out' uses a function that is declared below it; move that member up",
    ),
    "a virtual function": (
        IN + OUT + RUN + STEP.replace("void", "virtual void"),
        "mine.cpp:9: component 'mine' cannot make 'mine.0': a component's function must not be virtual",
    ),
    "two functions of one name": (
        IN + OUT + RUN + RUN.replace("run", "again") + STEP,
        "component 'mine' cannot make 'mine.0': it declares function 'mine.0' twice; only one of them could be added to a thread",
    ),
    "a NaN": (
        IN
        + OUT.replace('"the output"', '"the output", {.finite = true}')
        + RUN
        + STEP.replace("= in", '= std::nan("")'),
        "mine.cpp:7: with the initial values of its pins pin 'mine.0.out' (mine) became nan at cycle 0",
    ),
    "a pin's name with a space": (
        IN + OUT.replace('"out"', '"the out"') + RUN + STEP,
        "mine.cpp:7: component 'mine' cannot make 'mine.0': it declares a pin with the invalid name 'the out': letters, digits and - _ . : are valid",
    ),
    "no documentation": (
        IN + OUT.replace('"the output"', '""') + RUN + STEP,
        "mine.cpp:7: pin 'out' has no documentation; describe it in a few words after its name",
    ),
    "a safe input": (
        IN.replace('"the input"', '"the input", {.safe = 1.0}') + OUT + RUN + STEP,
        "mine.cpp:6: pin 'in' is an input and has .safe, which applies to outputs only: the value they take when the machine stops",
    ),
    "a safe value NaN": (
        IN + OUT.replace('"the output"', '"the output", {.safe = std::nan("")}') + RUN + STEP,
        "mine.cpp:7: component 'mine' cannot make 'mine.0': pin 'out' declares the safe value nan; it must be a number",
    ),
    "an infinite safe value of a finite output": (
        IN
        + OUT.replace('"the output"', '"the output", {.safe = -HUGE_VAL, .finite = true}')
        + RUN
        + STEP,
        "mine.cpp:7: component 'mine' cannot make 'mine.0': pin 'out' declares the safe value -inf, although it is declared finite",
    ),
    "a finite bool": (
        IN + OUT + '    hal::Out<bool> on{*this, "on", "always", {.finite = true}};\n' + RUN + STEP,
        "mine.cpp:8: pin 'on' has .finite, which applies to pins of type double only",
    ),
    "a function that throws": (
        IN + OUT + RUN + STEP.replace("out = in;", 'out = in; throw std::runtime_error("never");'),
        "with the initial values of its pins function 'mine.0' (mine) threw an exception at cycle 0",
    ),
    "a constructor that throws": (
        GOOD + '    bool made = [] { throw std::runtime_error("not today"); return true; }();\n',
        "component 'mine' cannot make 'mine.0': not today",
    ),
    "a constructor that crashes": (
        GOOD + "    bool made = [] { std::abort(); return true; }();\n",
        "component 'mine': its constructor crashes (Aborted)",
    ),
    "a destructor that crashes": (
        GOOD + "    ~Mine() { std::abort(); }\n",
        "component 'mine': its destructor crashes (Aborted)",
    ),
    "a destructor that throws": (
        GOOD + "    ~Mine() { throw 1; }\n",
        "component 'mine': its destructor crashes (Aborted)",
    ),
    "a destructor that exits": (
        GOOD + "    ~Mine() { std::exit(0); }\n",
        "component 'mine': its destructor ends the process",
    ),
    "a function that crashes": (
        IN + OUT + RUN + STEP.replace("out = in;", "out = in; std::abort();"),
        "component 'mine': a function of it crashes (Aborted), with the initial values of its pins",
    ),
}


class Author(Case):
    def compile(self, body, *words):
        self.write("mine.cpp", HEAD + body + TAIL)
        return self.run_program("compile", "--output", "plugins", "mine.cpp", *words)

    def test_rejects_a_plugin_that_cannot_be_loaded(self):
        for name, (body, message) in REJECTED.items():
            with self.subTest(name):
                done = self.compile(body)
                self.assertEqual((1, ""), (done.returncode, done.stdout))
                own = [
                    line for line in done.stderr.splitlines() if line.startswith("hal compile")
                ]  # the compiler may warn
                self.assertEqual(
                    [f"hal compile: {message}; it was not installed"], own, done.stderr
                )
                self.assertFalse((self.folder / "plugins/mine.so").exists())

    def test_an_error_causes_no_misleading_second_error(self):
        for name, body in {
            "no noexcept": GOOD.replace(" noexcept", ""),
            "no documentation": GOOD.replace(', "the output"', ""),
            "another signature": GOOD.replace("hal::Cycle", "int"),
        }.items():
            with self.subTest(name):
                done = self.compile(body)
                self.assertEqual(1, done.returncode)
                self.assertNotIn("missing line in the component", done.stderr)
                self.assertRegex(done.stderr, r"mine\.cpp:\d+:\d+: error: ")
        self.write(
            "mine.cpp", (HEAD + GOOD + TAIL).replace("    using Component::Component;\n", "")
        )
        self.assertIn(
            "missing line in the component: using Component::Component;",
            self.run_program("compile", "mine.cpp").stderr,
        )

    def test_the_compiler_alone_reports_a_missing_constructor_only_where_it_is_missing(self):
        """As in a CMake build, where nothing filters the compiler's messages."""

        def messages(text):
            include = [f"-I{ROOT}/runtime/sdk", f"-I{ROOT}/runtime/abi"]
            return subprocess.run(
                [
                    os.environ.get("CXX", "c++"),
                    "-std=c++20",
                    "-fsyntax-only",
                    *include,
                    self.write("mine.cpp", text),
                ],
                capture_output=True,
                text=True,
                env={**os.environ, "LC_ALL": "C"},
            ).stderr

        private = "private:\n    int number_ = 0;\n"
        self.assertEqual("", messages(HEAD + GOOD + private + TAIL))
        for rest in ("", private):
            for body in (
                GOOD.replace(" noexcept", ""),
                GOOD.replace(', "the output"', ""),
                GOOD.replace("hal::Cycle", "int"),
                GOOD.replace('"the output"', "output"),
            ):
                error = messages(HEAD + body + rest + TAIL)
                self.assertIn("mine.cpp:", error)
                self.assertNotIn("missing line in the component", error, body)
            missing = messages(
                (HEAD + GOOD + rest + TAIL).replace("    using Component::Component;\n", "")
            )
            self.assertIn("missing line in the component: using Component::Component;", missing)

    def test_a_name_that_no_netlist_can_write_is_refused(self):
        for name in ("threads", "all", "x=y", "my own", "-w", "a{1,2}"):
            with self.subTest(name):
                self.write("mine.cpp", HEAD + GOOD + TAIL.replace('"mine"', f'"{name}"'))
                done = self.run_program("compile", "--output", "plugins", "mine.cpp")
                self.assertEqual(1, done.returncode)
                self.assertIn(f"hal compile: '{name}' cannot be a component's name: ", done.stderr)
                self.assertFalse(
                    (self.folder / "plugins").exists() and list((self.folder / "plugins").iterdir())
                )

    def test_a_failing_start_does_not_prevent_the_installation(self):
        failing = GOOD + '    void start() { throw std::runtime_error("no device here"); }\n'
        done = self.compile(failing, "--check-rt")
        self.assertEqual(
            "hal compile: mine: start() failed, so its functions were not checked: no device here\n"
            "hal compile: 'mine.cpp' was not installed\n",
            done.stderr,
        )
        self.assertEqual(0, self.compile(failing).returncode)
        self.write("mine.hal", "loadrt mine\n")
        said = self.run_program(
            "sim", "mine.hal", environment={"HALCYON_PLUGIN_PATH": str(self.folder / "plugins")}
        ).stderr
        self.assertRegex(said, r"'mine\.0' \(mine\) cannot start: no device here \[start-failed\]")

    def test_a_start_that_names_its_argument_keeps_the_help_of_its_author(self):
        thrown = 'hal::ArgumentError("device", "device=/dev/mine0: no such device", "connect it, or load it with device=/dev/mine1")'
        self.assertEqual(
            0, self.compile(GOOD + f"    void start() {{ throw {thrown}; }}\n").returncode
        )
        self.write("mine.hal", "loadrt mine\n")
        said = self.run_program(
            "sim", "mine.hal", environment={"HALCYON_PLUGIN_PATH": str(self.folder / "plugins")}
        ).stderr
        self.assertRegex(
            said,
            r"'mine\.0' \(mine\) cannot start: device=/dev/mine0: no such device \[start-failed\]",
        )
        self.assertIn("help: connect it, or load it with device=/dev/mine1\n", said)

    def test_pins_of_all_functions_are_mentioned_to_the_author(self):
        done = self.compile(
            GOOD + '    hal::Function slow{*this, "slow", &Mine::step, "the same"};\n'
        )
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertEqual(
            "hal compile: note: its 2 functions share pin 'mine.0.in' and others that name no function, so they have to run in one "
            'thread; for pins of one function name it: {*this, FUNCTION, "in", ...}\n',
            done.stderr,
        )

    def test_a_component_that_needs_arguments_is_installed(self):
        done = self.compile(
            '    hal::TextArgument file{*this, "file", "", "what to read"};\n'
            '    bool read = file.get().empty() ? throw std::invalid_argument("file= is missing") : true;\n'
            + GOOD
        )
        self.assertEqual(
            (0, ""),
            (done.returncode, re.sub(r"(?m)^.*warning.*$|^ .*\n", "", done.stderr)),
            done.stderr,
        )
        self.assertIn(
            "it needs load arguments: component 'mine' cannot make 'mine.0': file= is missing",
            done.stdout,
        )

    def test_a_plugin_that_was_built_with_another_driver_library_is_rejected(self):
        built = HAL.parent.parent / "components/segment_record.so"
        if not built.exists():
            self.skipTest("the plugins of the buses are not built")
        content, places = re.subn(
            rb"halcyon_link_interface_[0-9a-f]{12}",
            b"halcyon_link_interface_000000000000",
            built.read_bytes(),
        )
        self.assertGreater(places, 0)
        (self.folder / "segment_record.so").write_bytes(content)
        self.environment["HALCYON_PLUGIN_PATH"] = str(self.folder)
        said = self.bad(
            "check", self.write("a.hal", "loadrt segment_record link=sim:x file=x.pcapng\n")
        )
        self.assertIn(
            "is not a usable component: it was built with another version of libhalcyon_link.so [bad-plugin]",
            said,
        )
        self.assertIn("= help: build it again with this version of Halcyon\n", said)


if __name__ == "__main__":
    unittest.main()
