#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""`hal compile`: one source file becomes a plugin; errors are reported at the user's line."""

import unittest
from pathlib import Path

import harness

LAG = """#include "hal/component.hpp"
#include <vector>

struct Lag : hal::Component {
    using Component::Component;
    hal::In<double>    in{*this, "in", "the input"};
    hal::Out<double>   out{*this, "out", "follows the input"};
    hal::Function      run{*this, "", &Lag::update, "one step"};
    void update(hal::Cycle) noexcept { BODY }
    std::vector<double> row;
};
HAL_COMPONENT(Lag, "lag", "First-order lag")
"""
EDGES = Path(__file__).parent / "sources/edges.c"
TWO = """loadrt threads name1=t period1=1000000
loadrt edges num_chan=2
net up edges.0.out
setp edges.0.in 1
setp edges.1.scale 3
addf edges.0 t
addf edges.1 t
start
advance 3 cycles
getp edges.0.out
getp edges.1.out
setp edges.0.scale 4
advance 1 cycles
gets up
"""


class Compile(harness.Case):
    def compile(self, *words, **environment):
        return self.run_program("compile", *words, environment=environment)

    def test_a_cpp_file_is_installed_for_the_user(self):
        self.write("lag.cpp", LAG.replace("BODY", "out = in;"))
        done = self.compile("lag.cpp")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(
            done.stdout,
            r"^lag: 2 pins, 1 function; installed as .*halcyon/components/lag\.so\nnext: hal doc lag, or in a netlist: loadrt lag, then addf lag\.0 THREAD\n$",
        )
        self.assertIn("First-order lag", self.run_program("doc", "lag").stdout)

    def test_a_pin_of_another_type_is_one_sentence(self):
        self.write(
            "lag.cpp", LAG.replace("BODY", "out = 1;").replace("Out<double>  ", "Out<float>   ")
        )
        done = self.compile("lag.cpp")
        self.assertEqual(done.returncode, 1)
        self.assertRegex(
            done.stderr,
            r"^lag\.cpp:\d+:\d+: error: a pin has one of the types bool, double, std::int32_t, std::uint32_t, std::int64_t, std::uint64_t and hal::Port; "
            r"write double in place of float\nhal compile: 'lag\.cpp' does not compile; it was not installed\n$",
        )

    def test_a_compiler_error_names_the_users_line_and_column(self):
        self.write(
            "lag.cpp",
            LAG.replace("BODY", "in = 1;")
            .replace(" noexcept", "")
            .replace("    using Component::Component;", ""),
        )
        done = self.compile("lag.cpp")
        self.assertEqual(done.returncode, 1)
        self.assertRegex(
            done.stderr,
            r"lag\.cpp:8:\d+: error: (?s:.*)// must be: void NAME\(hal::Cycle\) noexcept",
        )
        self.assertRegex(
            done.stderr,
            r"lag\.cpp:9:3\d: error: (?s:.*)// an input is only read; hal::Out and hal::Io can be written",
        )
        self.assertIn("missing line in the component: using Component::Component;", done.stderr)
        self.assertTrue(
            done.stderr.endswith("hal compile: 'lag.cpp' does not compile; it was not installed\n"),
            done.stderr,
        )

    def test_rejects_a_file_that_is_not_a_component(self):
        self.write("none.cpp", "int x;\n")
        done = self.compile("none.cpp")
        self.assertEqual(
            done.stderr,
            "hal compile: 'none.cpp' compiles, but is not a component: it exports no symbol hal_plugin, "
            'which HAL_COMPONENT(Type, "name", "summary") makes; it was not installed\n',
        )

    def test_reports_each_of_several_files_by_itself(self):
        self.write("lag.cpp", LAG.replace("BODY", "out = in;"))
        self.write("none.cpp", "int x;\n")
        self.write("wrong.comp", "component wrong;\npin inn bit a;\n;;\n")
        done = self.compile("lag.cpp", "none.cpp", "wrong.comp")
        self.assertEqual(1, done.returncode)
        self.assertIn("lag: 2 pins, 1 function; installed as ", done.stdout)
        self.assertEqual(
            [
                "hal compile: 'none.cpp' compiles, but is not a component: it exports no symbol "
                'hal_plugin, which HAL_COMPONENT(Type, "name", "summary") makes; it was not installed',
                "hal compile: 'wrong.comp' has 1 error; it was not installed",
            ],
            [line for line in done.stderr.splitlines() if line.startswith("hal compile: ")],
        )

    def test_reports_a_missing_compiler_in_one_sentence(self):
        self.write("lag.cpp", LAG)
        done = self.compile("lag.cpp", PATH="/nowhere")
        self.assertEqual(
            done.stderr, "hal compile: no C++ compiler found; install one: sudo apt install g++\n"
        )

    def test_a_violation_of_real_time_is_not_installed_without_a_word(self):
        for body, call in (
            ("row.push_back(in); out = row.back();", "malloc"),
            ('out = open("/dev/null", 0);', "open"),
            ("char c; out = getrandom(&c, 1, 0);", "getrandom"),
            ("out = munmap(mmap(nullptr, 1, 0, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0), 1);", "mmap"),
        ):
            with self.subTest(call):
                head = "#include <fcntl.h>\n#include <sys/mman.h>\n#include <sys/random.h>\n"
                self.write("lag.cpp", head + LAG.replace("BODY", body))
                done = self.compile("lag.cpp")
                self.assertEqual(
                    (
                        1,
                        f"hal compile: lag: function 'lag' calls {call} in a cycle (lag.cpp:12)\n"
                        "hal compile: note: to install it all the same, type: hal compile --no-check-rt lag.cpp\n"
                        "hal compile: 'lag.cpp' was not installed\n",
                        "",
                    ),
                    (done.returncode, done.stderr, done.stdout),
                )
                done = self.compile("--no-check-rt", "lag.cpp")
                self.assertEqual((0, ""), (done.returncode, done.stderr))

    def test_a_function_that_never_returns_for_nan_is_found(self):
        body = "volatile bool on = true; while (std::isnan(in) && on) {} out = in;"
        self.write("lag.cpp", "#include <cmath>\n" + LAG.replace("BODY", body))
        done = self.compile("lag.cpp")
        self.assertEqual(1, done.returncode, done.stdout)
        self.assertIn(
            "hal compile: lag: function 'lag' does not return: it ran for ten seconds\n",
            done.stderr,
        )

    def test_what_may_open_a_device_is_checked_on_request_only(self):
        start = LAG.replace("std::vector<double> row;", "void start() { out = 1; }")
        self.write("lag.cpp", start.replace("BODY", "out = in;"))
        done = self.compile("lag.cpp")
        self.assertEqual(
            (
                0,
                "hal compile: note: lag: real time was not checked, because it has start(), which may open a device; "
                "type: hal compile --check-rt lag.cpp\n",
            ),
            (done.returncode, done.stderr),
        )
        done = self.compile("--check-rt", "lag.cpp")
        self.assertEqual((0, ""), (done.returncode, done.stderr))

    def test_check_rt_and_its_opposite_exclude_each_other(self):
        self.write("lag.cpp", LAG.replace("BODY", "out = in;"))
        done = self.compile("--check-rt", "--no-check-rt", "lag.cpp")
        self.assertEqual(
            (1, "hal compile: --check-rt and --no-check-rt exclude each other\n"),
            (done.returncode, done.stderr),
        )

    def test_check_rt_names_the_call(self):
        self.write("lag.cpp", LAG.replace("BODY", "row.push_back(in); out = row.back();"))
        done = self.compile("lag.cpp", "--check-rt")
        self.assertEqual(done.returncode, 1)
        self.assertEqual(
            done.stderr,
            "hal compile: lag: function 'lag' calls malloc in a cycle (lag.cpp:9)\nhal compile: 'lag.cpp' was not installed\n",
        )
        self.assertEqual(done.stdout, "")

    def test_check_rt_calls_an_exception_an_exception(self):
        def said(constructor="", body="", start="", stop=""):
            self.write(
                "bad.cpp",
                f"""#include <stdexcept>
#include "hal/component.hpp"
struct Bad : hal::Component {{
    explicit Bad(const hal_host* host) : Component(host) {{ {constructor} }}
    hal::In<double> in{{*this, "in", "input"}};
    hal::Function run{{*this, "", &Bad::go, "runs"}};
    void start(const hal_host&) {{ {start} }}
    void stop() noexcept {{ {stop} }}
    void go(hal::Cycle) noexcept {{ {body} }}
}};
HAL_COMPONENT(Bad, "bad", "Throws")
""",
            )
            done = self.compile("bad.cpp", "--check-rt")
            self.assertEqual(1, done.returncode, done.stdout)
            return done.stderr

        throw = 'throw std::runtime_error("no board");'
        self.assertIn(
            "bad: function 'bad' throws std::runtime_error in a cycle (bad.cpp:9)\n",
            said(body=throw),
        )
        self.assertIn(
            "bad: function 'bad' throws int in a cycle (bad.cpp:9)\n",
            said(body="try { throw 3; } catch (int) {}"),
        )
        self.assertIn("bad: function 'bad' aborts in a cycle\n", said(body="__builtin_abort();"))
        self.assertIn(
            "bad: function 'bad' crashes in a cycle\n",
            said(body="*static_cast<volatile int*>(nullptr) = 1;"),
        )
        self.assertIn(
            "bad: start() failed, so its functions were not checked: no board\n", said(start=throw)
        )
        self.assertIn(
            "bad: its stop() throws std::runtime_error, which nothing catches\n", said(stop=throw)
        )

    def test_check_rt_of_a_good_one(self):
        done = self.compile(str(EDGES), "--check-rt", "--", "num_chan=2")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("real time: 2 functions ran 1000 cycles each", done.stdout)

    def test_a_linuxcnc_component_in_c_runs(self):
        done = self.compile("--output", "plugins", str(EDGES))
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.write("two.hal", TWO)
        done = self.run_program("sim", "two.hal", environment={"HALCYON_PLUGIN_PATH": "plugins"})
        self.assertEqual((done.stdout, done.stderr), ("10.5\n0.5\n4.5\n", ""))

    def test_its_rejection_is_a_diagnostic(self):
        self.compile("--output", "plugins", str(EDGES))
        self.write("many.hal", "loadrt edges num_chan=5\n")
        done = self.run_program("sim", "many.hal", environment={"HALCYON_PLUGIN_PATH": "plugins"})
        self.assertIn(
            "component 'edges' cannot make 'edges': edges: 5 channels are too many (rtapi_app_main: Invalid argument) [construct-failed]",
            done.stderr,
        )


if __name__ == "__main__":
    unittest.main()
