#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""hal shell reload: a new version of a plugin in a running machine. The versions are compiled here."""

import os
import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

from harness import HAL, PLUGINS, ROOT, Case, wait_until

COMPILER = os.environ.get("CXX", "c++")

# `count` counts in the pin itself, which a reload keeps: a cycle that is lost or done twice shows.
COUNTER = """#include "hal/component.hpp"
struct Part : hal::Component {
    using Component::Component;
    hal::Argument offset{*this, "offset", 0, "added"};
    hal::In<double> in{*this, "in", "the input"};
    hal::Out<double> out{*this, "out", "the output", {.safe = -1.0}};
    hal::Io<std::int32_t> count{*this, "count", "cycles"};
    hal::Param<double> gain{*this, "gain", "the factor", {.initial = 1.0}};
    MEMBERS
    hal::Function run{*this, "FUNCTION", &Part::update, "one step"};
    void update(hal::Cycle) noexcept {
        out = FORMULA;
        count = count + 1;
    }
};
HAL_COMPONENT(Part, "part", "A part")
"""

# What it reads stands beside the netlist.
READER = """#include "hal/texts.hpp"
struct Part : hal::Component {
    using Component::Component;
    hal::TextArgument file{*this, "file", "", "a number"};
    hal::Texts texts{*this};
    hal::Out<std::int32_t> number{*this, "number", "in the file"};
    hal::Function run{*this, "", &Part::update, "one step"};
    std::int32_t read_ = std::stoi(texts.read("file", file.get()));
    void update(hal::Cycle) noexcept { number = read_; }
};
HAL_COMPONENT(Part, "part", "Reads a file")
"""

# Something only one instance can have: a file.
OWNER = """#include <fcntl.h>
#include <unistd.h>
#include "hal/component.hpp"
struct Part : hal::Component {
    using Component::Component;
    hal::TextArgument file{*this, "file", "", "what it owns"};
    hal::Out<std::int32_t> version{*this, "version", "which it is", {.safe = -1}};
    hal::Function run{*this, "", &Part::update, "one step"};
    void start() {
        const int made = ::open(file.get().c_str(), O_CREAT | O_EXCL | O_WRONLY, 0600);
        if (made < 0) throw std::runtime_error("the file belongs to another");
        ::close(made);
        if (FAILS) {
            ::unlink(file.get().c_str());
            throw std::runtime_error("it does not like it");
        }
    }
    void stop() noexcept { ::unlink(file.get().c_str()); }
    void update(hal::Cycle) noexcept { version = VERSION; }
};
HAL_COMPONENT(Part, "part", "Owns a file")
"""

# What it remembers: `sum` in both versions, `other` with another type.
STATE = """#include "hal/state.hpp"
struct Part : hal::Component {
    using Component::Component;
    hal::State<std::int64_t> sum{*this, "sum", "of all steps"};
    hal::State<OTHER> other{*this, "other", "changes its type", ZERO};
    hal::Out<std::int64_t> cycles{*this, "cycles", "so far"};
    hal::Function run{*this, "", &Part::update, "one step"};
    void update(hal::Cycle) noexcept {
        sum += STEP;
        other += 1;
        cycles = cycles + 1;
    }
};
HAL_COMPONENT(Part, "part", "Remembers")
"""

# Members that it names: counts of two functions, which may be in two threads, and what changes its type or is gone.
RETAINED = """#include <vector>
#include "hal/retained.hpp"
struct Point { POINT };
struct Place { double x = 0; std::int32_t n = 0; };
struct Part : hal::Component {
    using Component::Component;
    hal::Function quick{*this, "quick", &Part::count_quick, "one step"};
    hal::Function calm{*this, "calm", &Part::count_calm, "one step"};
    hal::Out<std::int64_t> quick_cycles{*this, quick, "quick-cycles", "so far"};
    hal::Out<std::int64_t> quick_sum{*this, quick, "quick-sum", "of all steps"};
    hal::Out<std::int64_t> calm_cycles{*this, calm, "calm-cycles", "so far"};
    hal::Out<std::int64_t> calm_sum{*this, calm, "calm-sum", "of all steps"};
    hal::Out<double> total{*this, quick, "total", "of what changes its type"};
    hal::Out<double> swapped{*this, quick, "swapped", "of a struct whose members change places"};
    hal::Out<double> kept{*this, quick, "kept", "of a struct that stays as it is"};
    void count_quick(hal::Cycle) noexcept {
        quick_cycles = quick_cycles + 1;
        rows_[1] += STEP;
        quick_sum = rows_[1];
        total = static_cast<double>(other_ += 1);
        swapped = point_.x += 1;
        kept = place_.x += 1;
    }
    void count_calm(hal::Cycle) noexcept {
        calm_cycles = calm_cycles + 1;
        calm_sum = calm_ += STEP;
    }
    OTHER other_ = 0;
    std::vector<std::int64_t> rows_ = std::vector<std::int64_t>(3);
    std::int64_t calm_ = 0;
    Point point_;
    Place place_;
    hal::Retained retained_{*this, {{"other", other_}, GONE {"rows", rows_}, {"calm", calm_}, {"point", point_}, {"place", place_}}};
};
HAL_COMPONENT(Part, "part", "Remembers")
"""

OTHER_INTERFACE = """#include "hal/abi.h"
HAL_EXPORT const hal_component hal_plugin = {.size = sizeof(hal_component), .abi_major = HAL_ABI_MAJOR + 1};
"""

NETLIST = """newthread servo 1000000
loadrt part names=p offset=5
loadrt sum2 names=adder
setp p.gain 3
setp p.in 2
net result p.out => adder.in0
addf p servo
addf adder servo
start
"""


def compiled(folder, name, text, language="c++"):
    source = folder / f"{name}.{'c' if language == 'c' else 'cpp'}"
    source.write_text(text)
    library = folder / f"{name}.so"
    standard = ["-x", "c", "-std=c11"] if language == "c" else ["-std=c++20"]
    subprocess.run(
        [
            COMPILER,
            *standard,
            "-O1",
            "-fPIC",
            "-shared",
            "-fvisibility=hidden",
            *([] if "clang" in COMPILER else ["-fno-gnu-unique"]),
            f"-I{ROOT}/runtime/abi",
            f"-I{ROOT}/runtime/sdk",
            f"-Wl,--version-script={ROOT}/cmake/plugin.map",
            str(source),
            "-o",
            str(library),
        ],
        check=True,
    )
    return library


def counter(formula="in * gain", members="", function="", **replace):
    text = (
        COUNTER.replace("FORMULA", formula)
        .replace("MEMBERS", members)
        .replace("FUNCTION", function)
    )
    for old, new in replace.values():
        text = text.replace(old, new)
    return text


class Reload(Case):
    versions = {}

    @classmethod
    def setUpClass(cls):
        cls.built = Path(tempfile.mkdtemp(prefix="hal-"))
        cls.addClassCleanup(shutil.rmtree, cls.built, True)
        texts = {
            "first": counter(members='hal::Param<double> old{*this, "old", "goes"};'),
            "second": counter(
                "in * gain * 10 + offset",
                'hal::In<double> extra{*this, "extra", "new", {.initial = 7.0}};',
            ),
            "retyped": counter(
                "in",
                t=("hal::Out<double> out", "hal::Out<std::int32_t> out"),
                f=("out = in", "out = 1"),
            ),
            "turned": counter(
                "in",
                t=(
                    'hal::Out<double> out{*this, "out", "the output", {.safe = -1.0}}',
                    'hal::In<double> out{*this, "out", "the output"}',
                ),
                f=("out = in;", ""),
            ),
            "renamed": counter(function="step"),
            "stubborn": counter(
                members='int no = [] { throw std::runtime_error("not today"); return 0; }();'
            ),
            "unasked": counter(t=('hal::Argument offset{*this, "offset", 0, "added"};', "")),
            "state1": STATE.replace("STEP", "1").replace("OTHER", "double").replace("ZERO", "0.5"),
            "state2": STATE.replace("STEP", "1000")
            .replace("OTHER", "std::int32_t")
            .replace("ZERO", "7"),
            "retained1": RETAINED.replace("STEP", "1")
            .replace("POINT", "double x = 0; std::int32_t n = 0;")
            .replace("OTHER", "double")
            .replace("GONE", '{"gone", rows_},'),
            "retained2": RETAINED.replace("STEP", "1000")
            .replace("POINT", "std::int32_t n = 0; double x = 0;")
            .replace("OTHER", "float")
            .replace("GONE", ""),
            "owner1": OWNER.replace("VERSION", "1").replace("FAILS", "false"),
            "owner2": OWNER.replace("VERSION", "2").replace("FAILS", "false"),
            "reader": READER,
            "failing": OWNER.replace("VERSION", "3").replace("FAILS", "true"),
        }
        cls.versions = {name: compiled(cls.built, name, text) for name, text in texts.items()}
        cls.versions["other"] = compiled(cls.built, "other", OTHER_INTERFACE, "c")

    def setUp(self):
        super().setUp()
        self.plugins = self.folder / "plugins"
        self.plugins.mkdir()
        self.environment["HALCYON_PLUGIN_PATH"] = f"{self.plugins}:{PLUGINS}"

    def install(self, version):
        # written over, not renamed: the machine must not mind
        shutil.copyfile(self.versions[version], self.plugins / "part.so")

    def machine(self, version="first", netlist=NETLIST):
        self.install(version)
        return self.start("run", self.write("m.hal", netlist))

    def say(self, *words):
        done = self.shell(*words)
        self.assertEqual((0, ""), (done.returncode, done.stderr), done.stdout)
        return done.stdout

    def refused(self, *words):
        before = self.saved("allu")
        done = self.shell(*words)
        self.assertEqual(1, done.returncode, done.stdout)
        self.assertEqual(before, self.saved("allu"))
        return done.stderr

    def saved(self, what):
        """The output of save, without what changes by itself."""
        return re.sub(r"setp \S+\.(tmax|count) .*\n", "", self.say("save", what))

    def mapped(self, machine):
        """Which copies of the plugin the process has mapped."""
        with open(f"/proc/{machine.pid}/maps") as maps:
            return {line.split()[4] for line in maps if "part.so" in line}

    def test_links_values_and_places_are_kept(self):
        machine = self.machine()
        wait_until(lambda: self.value("p.out") == "6", "it runs")
        saved = self.saved("all")
        first = self.mapped(machine)
        self.assertEqual(1, len(first))
        self.install("second")
        self.assertEqual(
            "6", self.value("p.out"), "a file that was written over changes nothing by itself"
        )
        self.say("reload", "part")
        wait_until(
            lambda: self.value("adder.out") == "65",
            "the new version runs, with its load argument, in its old place",
        )
        self.assertEqual(
            ["3", "2", "7"], [self.value(name) for name in ("p.gain", "p.in", "p.extra")]
        )
        self.assertEqual(re.sub("setp p.old .*\n", "", saved), self.saved("all"))
        second = self.mapped(machine)
        self.assertEqual(1, len(second), "the old version is unloaded")
        self.assertNotEqual(first, second)
        self.say("-e", "begin", "-e", "unlinkp p.out", "-e", "unlinkp adder.in0", "-e", "commit")
        self.say("unload", "part")
        self.assertEqual(set(), self.mapped(machine))
        self.say("loadrt", "part", "names=p")
        self.assertEqual("7", self.value("p.extra"))

    def test_no_cycle_is_lost_or_repeated(self):
        self.machine(
            "first",
            "newthread servo 1000000\nloadrt part names=p\nloadrt sampler cfg=s depth=100000\naddf p servo\naddf sampler.0 servo\n"
            "net c p.count => sampler.0.pin.0\nstart\n",
        )
        for i in range(20):
            self.install("second" if i % 2 == 0 else "first")
            self.say("reload", "part")
        count = int(self.value("p.count"))
        wait_until(lambda: int(self.value("p.count")) > count + 20, "it counts on")
        rows = [int(row) for row in self.good("record", "-n", count).split()]
        self.assertEqual(list(range(rows[0], rows[0] + count)), rows)
        self.assertGreater(count, 20)

    def test_what_is_linked_or_in_a_thread_must_stay(self):
        self.machine()
        for version, words in {
            "retyped": "pin 'p.out' has type s32 in the new version, but is linked to signal 'result'",
            "turned": "pin 'p.out' has direction IN in the new version, not OUT",
            "renamed": "function 'p' is missing in the new version, but is in thread 'servo'",
            "stubborn": "cannot make 'p': not today",
            "unasked": "component 'part' has no argument 'offset'",
            "other": "it was built for version 2 of the component interface, this runtime has 1",
        }.items():
            with self.subTest(version):
                self.install(version)
                self.assertIn(words, self.refused("reload", "part"))
        wait_until(lambda: self.value("p.out") == "6", "the first version runs on")
        self.install("retyped")
        done = self.shell("-e", "begin", "-e", "unlinkp p.out", "-e", "reload part", "-e", "commit")
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertIn("signal 'result' has no writer any more", done.stderr)
        wait_until(
            lambda: self.value("p.out") == "1", "with the pin off its signal it can be replaced"
        )

    def test_a_value_that_is_lost_is_named(self):
        self.machine()
        self.say("setp", "p.old", "4")
        self.install("second")
        done = self.shell("reload", "part")
        self.assertEqual(0, done.returncode)
        self.assertIn(
            "warning: parameter 'p.old' is missing in the new version: its value is lost [reload-dropped]",
            done.stderr,
        )

    def test_who_owns_something_gives_it_back_first(self):
        owned = self.folder / "owned"
        self.machine(
            "owner1",
            f"newthread servo 1000000\nloadrt part names=p file={owned}\naddf p servo\nloadrt sum2\naddf sum2.0 servo\nstart\n",
        )
        wait_until(lambda: self.value("p.version") == "1", "it runs")
        self.install("owner2")
        self.say("reload", "part")
        wait_until(lambda: self.value("p.version") == "2", "the second has it")
        self.install("failing")
        self.assertIn(
            "'p' (part) cannot start in its new version: it does not like it",
            self.refused("reload", "part"),
        )
        self.assertTrue(owned.exists())
        wait_until(lambda: self.value("p.version") == "2", "the second runs again")

    def test_a_file_beside_the_netlist_is_found_again_from_another_folder(self):
        (self.folder / "machine").mkdir()
        number = self.write("machine/number.txt", "5")
        self.install("reader")
        netlist = self.write(
            "machine/m.hal",
            "loadrt threads name1=servo period1=1000000\nloadrt part names=p file=number.txt\n"
            "addf p servo\nstart\n",
        )
        self.start("run", netlist)
        wait_until(lambda: self.value("p.number") == "5", "the first number")
        Path(number).write_text("6")
        self.say("reload", "part")
        wait_until(lambda: self.value("p.number") == "6", "the number of the reloaded component")

    def test_names_that_are_not_components(self):
        self.machine()
        self.assertIn(
            "an instance; a component is reloaded with all its instances",
            self.refused("reload", "p"),
        )
        self.assertIn(
            "component 'prat' is not loaded; did you mean 'part'?".split(";")[0],
            self.refused("reload", "prat"),
        )
        self.assertIn(
            "belongs to the runtime" if "threads" in self.say("list", "comp") else "is not loaded",
            self.refused("reload", "threads"),
        )

    def test_completion_knows_what_can_be_reloaded_and_which_arguments_there_are(self):
        self.machine()
        complete = lambda line: self.good(
            "-C", name="halcmd", environment={"COMP_LINE": "halcmd " + line, "COMP_POINT": ""}
        ).split()
        self.assertEqual(["part", "sum2"], complete("reload "))
        self.assertEqual(
            ["count=", "names=", "num_chan=", "offset=", "personality="], complete("loadrt part ")
        )

    def test_streams_and_statistics_survive(self):
        self.install("first")
        self.machine(
            "first",
            "newthread servo 1000000\nloadrt part names=p\nloadrt sampler cfg=s depth=4000\naddf p servo\naddf sampler.0 servo\nnet c p.count => sampler.0.pin.0\nstart\n",
        )
        wait_until(lambda: int(self.value("p.count")) > 10, "it counts")
        self.install("second")
        self.say("reload", "part")
        self.say("reload", "sampler")
        rows = self.good("record", "-n", "5").split()
        self.assertEqual([str(int(rows[0]) + i) for i in range(5)], rows)
        self.assertNotEqual("0", self.value("p.tmax"))

    def test_declared_state_is_carried_over_where_name_and_type_match(self):
        self.install("state1")
        path = self.write(
            "m.hal",
            "loadrt threads name1=servo period1=1000000\nloadrt part names=p\naddf p servo\nstart\nadvance 10 cycles\n"
            f"getp p.sum\ngetp p.other\nloadusr -w cp {self.versions['state2']} {self.plugins}/part.so\n"
            "reload part\nadvance 3 cycles\ngetp p.sum\ngetp p.other\ngetp p.cycles\n",
        )
        self.assertEqual("10\n10.5\n3010\n10\n13\n", self.good("sim", path))
        self.assertIn(
            "is read-only: only its component sets it",
            self.bad("sim", "-q", self.write("w.hal", "loadrt part names=p\nsetp p.sum 1\n")),
        )

    def test_no_cycle_of_declared_state_is_lost_in_a_running_machine(self):
        self.install("state1")
        self.start(
            "run",
            self.write(
                "m.hal",
                "newthread servo 1000000\nloadrt part names=p\naddf p servo\nnet c p.cycles\nstart\n",
            ),
        )
        for _ in range(20):
            before = int(self.value("p.cycles"))
            self.install("state1")
            self.say("reload", "part")
            wait_until(lambda: int(self.value("p.cycles")) > before + 2, "it runs on")
        self.say("stop")
        self.assertEqual(self.value("p.cycles"), self.value("p.sum"))

    def test_named_members_are_carried_over_where_name_and_type_match(self):
        self.install("retained1")
        path = self.write(
            "m.hal",
            "loadrt threads name1=servo period1=1000000\nloadrt part names=p\naddf p.quick servo\nstart\nadvance 10 cycles\n"
            f"getp p.quick-sum\ngetp p.total\nloadusr -w cp {self.versions['retained2']} {self.plugins}/part.so\n"
            "reload part\nadvance 3 cycles\ngetp p.quick-sum\ngetp p.total\ngetp p.quick-cycles\n"
            "getp p.swapped\ngetp p.kept\n",
        )
        done = self.run_program("sim", path)
        self.assertEqual("10\n10\n3010\n3\n13\n3\n13\n", done.stdout)
        for name in ("other", "gone", "point"):
            self.assertIn(
                f"warning: variable '{name}' of 'p' is missing or has another type in the new version: its value is lost",
                done.stderr,
            )

    def test_no_cycle_of_named_members_is_lost_in_two_threads(self):
        self.install("retained1")
        self.start(
            "run",
            self.write(
                "m.hal",
                "newthread base 500000\nnewthread servo 2000000\nloadrt part names=p\n"
                "addf p.quick base\naddf p.calm servo\nstart\n",
            ),
        )
        for _ in range(20):
            before = int(self.value("p.calm-cycles"))
            self.install("retained1")
            self.say("reload", "part")
            wait_until(lambda: int(self.value("p.calm-cycles")) > before + 2, "it runs on")
        self.say("stop")
        self.assertEqual(self.value("p.quick-cycles"), self.value("p.quick-sum"))
        self.assertEqual(self.value("p.calm-cycles"), self.value("p.calm-sum"))

    def test_a_machine_that_reloads_itself_under_the_virtual_clock(self):
        self.install("first")
        path = self.write(
            "m.hal",
            NETLIST
            + f"advance 10 cycles\ngetp p.out\nloadusr -w cp {self.versions['second']} {self.plugins}/part.so\n"
            "reload part\ngetp p.out\nadvance 1 cycles\ngetp p.out\ngetp p.count\n",
        )
        self.assertEqual("6\n6\n65\n11\n", self.good("sim", path))


if __name__ == "__main__":
    unittest.main()
