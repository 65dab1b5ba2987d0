#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What the script ./hal decides to install, to configure, to build and to start: in a small tree, with a CMake, a ninja and an apt-get that
write down what they are asked."""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

from harness import HAL, PLUGINS, ROOT, Case

CMAKE = """#!/bin/sh
echo "cmake $*" >>"$TOOLS/log"
source=$(pwd)
case "$*" in *" -B "*) cd "$4/../.." ;; esac
mkdir -p build/release/components build/release/bin
echo "CMAKE_HOME_DIRECTORY:INTERNAL=$source" >build/release/CMakeCache.txt
touch build/release/build.ninja
for file in "$source"/components/*/*.cpp; do name=${file##*/}; echo "${name%.cpp} math A component"; done >build/release/components/groups
echo "seeing libseeing-dev" >build/release/components/absent
case "$*" in
    *-DHALCYON_PACKAGE_MOTION=ON)
        : >build/release/components/packages_left_out
        echo "moving motion A component" >>build/release/components/groups
        ;;
    *)
        printf '%s\n' "motion HALCYON_PACKAGE_MOTION" "sight libsight-dev" >build/release/components/packages_left_out
        echo "moving HALCYON_PACKAGE_MOTION" >>build/release/components/absent
        ;;
esac
printf '%s\n' "lqr libsolving-dev" "panel libplain-dev" >build/release/components/packages
"""
NINJA = """#!/bin/sh
case "$*" in *query*) exit 0 ;; build.ninja) exit 0 ;; esac
echo "ninja $*" >>"$TOOLS/log"
if [ -e "$TOOLS/broken" ]; then echo "[1/2 1.0] compile a"; echo "a.cpp:1: error: no"; exit 1; fi
if [ -e "$TOOLS/together" ]; then
    rm "$TOOLS/together"
    printf '%s\\n' "[1/2 1.0] compile unity_0_cxx.cxx" "FAILED: unity_0_cxx.cxx.o" "b.cpp:2: error: redefinition of 'f'"
    exit 1
fi
if [ -e "$TOOLS/steps" ]; then cat "$TOOLS/steps"; else echo "[1/1 0.5] link"; fi
cd "$2/../.."
printf '#!/bin/sh\\necho "started: $*"\\necho "builds with $HALCYON_BUILD"\\necho "started as $HALCYON_STARTED_AS"\\n' >build/release/bin/hal
chmod +x build/release/bin/hal
"""
APT = """#!/bin/sh
case "$*" in *--assume-no*)
    [ -e "$TOOLS/offline" ] && exit 100
    echo "Need to get 1,234 kB of archives."
    echo "After this operation, 56.7 MB of additional disk space will be used."
    exit 1 ;;
esac
echo "apt-get $*" >>"$TOOLS/log"
[ -e "$TOOLS/offline" ] && exit 100
case "$*" in *libsolving-dev*) touch "$TOOLS/solving.h" ;; esac
"""


def needs(*words, cwd=ROOT):
    """What cmake/needs.awk prints for a command of the program."""
    done = subprocess.run(
        [
            *("awk", "-v", f"command={words[0]}", "-v", f"machines={ROOT / 'halfiles'}"),
            *("-f", ROOT / "cmake/needs.awk", "--", *words),
        ],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    if done.stderr:
        raise AssertionError(done.stderr)
    return set(done.stdout.split())


class Script(unittest.TestCase):
    maxDiff = None

    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="hal-")).resolve()
        self.addCleanup(shutil.rmtree, self.folder, True)
        self.tree, self.tools = self.folder / "tree", self.folder / "tools"
        for name in ("cmake", "runtime", "drivers", "tools", "components/math", "components/solve"):
            (self.tree / name).mkdir(parents=True)
        self.tools.mkdir()
        shutil.copy(ROOT / "hal", self.tree)
        shutil.copy(ROOT / "cmake/needs.awk", self.tree / "cmake")
        (self.tree / "cmake/optional").write_text(
            f"libsolving-dev {self.tools}/solving.h\nlibplain-dev {self.tools}/plain.h\n"
        )
        for name in ("CMakeLists.txt", "CMakePresets.json"):
            (self.tree / name).write_text("")
        for name in ("math/sum2", "math/scale", "math/pid", "solve/lqr"):
            (self.tree / f"components/{name}.cpp").write_text("")
        for name, text in (
            ("cmake", CMAKE),
            ("ninja", NINJA),
            ("apt-get", APT),
            ("sudo", '#!/bin/sh\nexec "$@"\n'),
        ):
            (self.tools / name).write_text(text)
            (self.tools / name).chmod(0o755)
        self.environment = {
            "PATH": f"{self.tools}:{os.environ['PATH']}",
            "TOOLS": str(self.tools),
            "LC_ALL": "C.UTF-8",
            "HOME": str(self.folder),
        }
        self.write("a.hal", "loadrt sum2 names=a,b\nsource more.hal\nloadusr -W user-program\n")
        self.write("more.hal", "loadrt \\\n    pid\n# loadrt scale\n")
        self.write("b.hal", "loadrt scale\nloadrt of-the-user\n")

    def write(self, name, text):
        (self.folder / name).write_text(text)

    def hal(self, *words, status=0):
        """Runs the script; what it called and what it printed."""
        log = self.tools / "log"
        log.write_text("")
        done = subprocess.run(
            [self.tree / "hal", *words],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=60,
        )
        self.assertEqual(status, done.returncode, done.stderr)
        self.said, self.printed = done.stderr, done.stdout
        return [line.replace(str(self.tree), "TREE") for line in log.read_text().splitlines()]

    def touch(self, name):
        later = time.time() + 5
        os.utime(self.tree / name, (later, later))

    BUILD = "ninja -C TREE/build/release "

    def test_the_first_start_builds_the_program_and_what_the_netlist_needs(self):
        self.assertEqual(
            [
                "cmake --preset release -DHALCYON_TESTS=OFF -DHALCYON_QUICK=ON",
                self.BUILD + "hal component_sum2 component_pid",
            ],
            self.hal("run", "a.hal", "--for", "1s"),
        )
        self.assertEqual("hal: building the program and 2 components in build/release\n", self.said)
        self.assertIn("started: run a.hal --for 1s\n", self.printed)
        self.assertIn(f"started as {self.tree}/hal\n", self.printed)

    @unittest.skipUnless(os.geteuid() == 0, "needs root to mount the tree read-only")
    def test_a_read_only_tree_is_built_in_the_cache_of_the_user_also_with_unusual_names(self):
        tree = self.folder / "ein Projekt mit Ümläuten"
        self.tree.rename(tree)
        script = 'mount --bind "$0" "$0" && mount -o remount,ro,bind "$0" && cd "$1" && exec "$0/hal" run a.hal'

        def start():
            (self.tools / "log").write_text("")
            done = subprocess.run(
                ["unshare", "-m", "sh", "-c", script, tree, self.folder],
                env=self.environment,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                timeout=60,
            )
            self.assertEqual(0, done.returncode, done.stderr)
            return done, (self.tools / "log").read_text().splitlines()

        done, calls = start()
        builds = list((self.folder / ".cache/halcyon").glob("*/build"))
        self.assertEqual(1, len(builds))
        self.assertEqual(
            [
                f"cmake --preset release -B {builds[0]}/release -DHALCYON_TESTS=OFF -DHALCYON_QUICK=ON",
                f"ninja -C {builds[0]}/release hal component_sum2 component_pid",
            ],
            calls,
        )
        self.assertIn(f"hal: {tree} is read-only: building in {builds[0]}\n", done.stderr)
        self.assertIn("started: run a.hal\n", done.stdout)
        done, calls = start()
        self.assertEqual(([], ""), (calls, done.stderr))
        self.assertFalse((tree / "build").exists())

    def test_the_second_start_builds_nothing(self):
        self.hal("run", "a.hal")
        self.assertEqual([], self.hal("run", "a.hal"))
        self.assertEqual("", self.said)
        self.assertEqual([], self.hal("doc", "pid"))

    def test_the_program_knows_who_builds_what_is_missing(self):
        self.hal("run", "a.hal")
        self.assertIn(f"builds with {self.tree}/hal\n", self.printed)

    def test_another_netlist_builds_what_it_adds_and_a_name_that_is_not_of_the_tree_is_left_to_the_program(
        self,
    ):
        self.hal("run", "a.hal")
        self.assertEqual(
            [self.BUILD + "hal component_sum2 component_pid component_scale"],
            self.hal("run", "b.hal"),
        )
        self.assertEqual("hal: building a further component in build/release\n", self.said)
        self.assertEqual([], self.hal("run", "b.hal"))
        self.assertEqual([], self.hal("run", "a.hal"))

    def test_a_changed_source_builds_again_whatever_was_built(self):
        self.hal("run", "a.hal")
        self.touch("components/math/scale.cpp")
        self.assertEqual([self.BUILD + "hal component_sum2 component_pid"], self.hal("version"))
        self.assertEqual("hal: building what has changed in build/release\n", self.said)

    def test_changed_presets_configure_the_tree_again(self):
        self.hal("run", "a.hal")
        for name in ("build/release/CMakeCache.txt", "build/.built"):
            os.utime(self.tree / name, (1, 1))
        self.assertEqual(
            ["cmake --preset release", self.BUILD + "hal component_sum2 component_pid"],
            self.hal("version"),
        )
        self.assertEqual([], self.hal("version"))

    def test_a_command_that_loads_nothing_builds_the_program_alone(self):
        self.assertEqual(self.BUILD + "hal", self.hal("version")[-1])
        self.assertEqual("hal: building the program in build/release\n", self.said)

    def test_the_program_of_the_bus_tools_is_built_for_its_commands(self):
        self.assertEqual(self.BUILD + "hal hal-bus", self.hal("ethercat", "scan", "eth:eth0")[-1])
        for command in ("can", "canopen", "node", "ethercat", "scocan"):
            self.assertEqual([], self.hal(command, "anything"))
            self.assertEqual({"bus"}, needs("shell", "loadusr", "-W", "hal", command, "anything"))

    def test_an_edit_typed_as_a_command_is_read_too(self):
        self.assertEqual(
            self.BUILD + "hal component_scale", self.hal("shell", "loadrt", "scale")[-1]
        )

    def test_build_builds_everything(self):
        self.assertEqual(self.BUILD + "hal everything", self.hal("build")[-1])
        self.assertIn(
            "hal: left out: seeing (./hal build NAME installs the Debian packages that one needs)\nhal: switched off: HALCYON_PACKAGE_MOTION\n",
            self.said,
        )
        self.assertEqual([], self.hal("run", "b.hal"))

    def test_build_of_a_component_that_does_not_exist_fails(self):
        self.hal("build", "sum3", status=1)
        self.assertIn(
            "hal: component 'sum3' does not exist; ./hal doc lists all components\n", self.said
        )

    def test_build_of_a_component_in_a_package_that_is_switched_off_names_the_switch(self):
        self.hal("build", "moving", status=1)
        self.assertIn(
            "hal: 'moving' is in a package that is switched off in this build; type: cmake --preset release -DHALCYON_PACKAGE_MOTION=ON\n",
            self.said,
        )

    def test_a_package_that_is_switched_on_is_built_although_it_was_requested_before(self):
        self.hal("build", "moving", status=1)
        advised = self.said.split("type: ")[1].split()
        self.assertEqual(["cmake", "--preset", "release"], advised[:-1])
        subprocess.run(advised, cwd=self.tree, env=self.environment, check=True)
        self.assertEqual([self.BUILD + "hal component_moving"], self.hal("build", "moving"))
        self.assertEqual([], self.hal("build", "moving"))

    def test_only_the_packages_of_what_is_needed_are_installed(self):
        self.assertNotIn("apt-get", " ".join(self.hal("run", "a.hal")))
        self.write("c.hal", "loadrt lqr\n")
        calls = self.hal("run", "c.hal")
        self.assertEqual(
            [
                "apt-get -o DPkg::Lock::Timeout=300 -o Acquire::Retries=1 install --no-install-recommends -y libsolving-dev",
                self.BUILD + "hal component_sum2 component_pid component_lqr",
            ],
            calls,
        )
        self.assertRegex(
            self.said,
            "^hal: installing Debian packages( through sudo)?: libsolving-dev \\(1,234 kB to download, 56.7 MB on disk\\)\nhal: new since the last build: libsolving-dev\n",
        )

    def test_a_package_that_cannot_be_installed_is_named(self):
        (self.tools / "offline").write_text("")
        self.write("c.hal", "loadrt lqr\n")
        self.hal("run", "c.hal", status=1)
        self.assertIn("hal: cannot install these Debian packages: libsolving-dev (see ", self.said)

    def test_a_failed_build_shows_the_error_and_is_tried_again(self):
        (self.tools / "broken").write_text("")
        self.hal("run", "a.hal", status=1)
        self.assertEqual(
            "hal: building the program and 2 components in build/release\na.cpp:1: error: no\nhal: cannot build build/release\n",
            self.said,
        )
        (self.tools / "broken").unlink()
        self.assertEqual(
            [self.BUILD + "hal component_sum2 component_pid"], self.hal("run", "a.hal")
        )

    def test_a_board_is_one_of_two_and_its_libraries_are_unpacked_once(self):
        for name in ("cmake/board.sh", "tests/board.sh", "tools/package/package.sh"):
            (self.tree / name).parent.mkdir(exist_ok=True, parents=True)
            shutil.copy(ROOT / name, self.tree / name)
        self.assertEqual(
            [],
            [
                line
                for line in self.hal("board", "mips", status=1)
                if not line.startswith("apt-get")
            ],
        )
        self.assertTrue(self.said.endswith("hal: usage: ./hal board armhf|arm64\n"), self.said)
        self.hal("package", "armhf", "arm64", status=1)
        usage = "hal: usage: ./hal package [armhf|arm64], or ./hal package --release KEY [ARCHITECTURE...]\n"
        self.assertTrue(self.said.endswith(usage), self.said)
        self.hal("package", "--release", "somebody", "mips", status=1)
        self.assertRegex(
            self.said, r"hal: cannot make packages for 'mips' here; write \w+, armhf or arm64\n$"
        )
        self.hal("package", "--release", status=1)
        key = "hal: usage: ./hal package --release KEY [ARCHITECTURE...]; KEY signs: one of gpg --list-secret-keys\n"
        self.assertTrue(self.said.endswith(key), self.said)
        for name in ("qemu-arm-static", "arm-linux-gnueabihf-g++", "dpkg-shlibdeps"):
            (self.tools / name).touch(0o755)
        unpacker, folder = self.tools / "mmdebstrap", self.tree / "build/boards/armhf"
        unpacker.write_text('#!/bin/sh\necho "E: no mirror"; exit 1\n')
        unpacker.chmod(0o755)
        self.hal("package", "armhf", status=1)
        begun = "hal: unpacking Debian's libraries for armhf from http://deb.debian.org/debian in build/boards/armhf/sysroot\n"
        self.assertEqual(
            f"{begun}E: no mirror\nhal: cannot make build/boards/armhf/sysroot (see {folder}/sysroot.log); HALCYON_MIRROR=URL names another mirror of Debian\n",
            self.said,
        )
        unpacker.write_text("#!/bin/sh\n")
        (self.tools / "broken").write_text("")
        failed = "hal: building everything for armhf in build/armhf\na.cpp:1: error: no\nhal: cannot build build/armhf\n"
        for said in (begun + failed, failed):
            self.hal("package", "armhf", status=1)
            self.assertEqual(said, self.said)

    def test_sources_that_cannot_be_compiled_together_are_compiled_one_by_one(self):
        (self.tools / "together").write_text("")
        self.assertEqual(
            [
                "cmake --preset release -DHALCYON_TESTS=OFF -DHALCYON_QUICK=ON",
                self.BUILD + "hal",
                "cmake --preset release -DHALCYON_QUICK=OFF",
                self.BUILD + "hal",
            ],
            self.hal("version"),
        )
        self.assertIn(
            "hal: compiling source by source, because some sources cannot be compiled together (see ",
            self.said,
        )
        self.assertIn("started: version\n", self.printed)

    def test_a_long_build_prints_the_remaining_time_periodically(self):
        (self.tools / "steps").write_text(
            "".join(f"[{i}/100 {i * 2}.3] compile\n" for i in range(1, 101))
        )
        self.hal("version")
        self.assertEqual(
            ["building the program in build/release"]
            + [
                f"{done} of 100 steps, about {left} left"
                for done, left in (
                    (15, "3 min"),
                    (30, "2 min"),
                    (45, "2 min"),
                    (60, "80 s"),
                    (75, "50 s"),
                    (90, "20 s"),
                )
            ],
            re.findall("(?m)^hal: (.*)$", self.said),
        )

    def test_a_moved_tree_is_built_from_the_start(self):
        self.hal("run", "a.hal")
        moved = self.folder / "moved"
        self.tree.rename(moved)
        self.tree = moved
        self.assertEqual(
            ["cmake --preset release -DHALCYON_TESTS=OFF -DHALCYON_QUICK=ON", self.BUILD + "hal"],
            self.hal("version"),
        )
        self.assertIn(
            f"hal: this tree was built in {self.folder}/tree: what is needed is built again here\n",
            self.said,
        )


class Needs(unittest.TestCase):
    """The rough reader of cmake/needs.awk, against one that takes its time."""

    def loaded(self, path, seen):
        """The components that the loadrt lines of a netlist name, and of those it sources."""
        names = set()
        if path in seen:
            return names
        seen.add(path)
        for line in re.sub(r"\\\n", " ", path.read_text()).splitlines():
            words = line.split("#")[0].split()
            if words[:1] == ["loadrt"]:
                names.add(words[1].replace("-", "_"))
            if words[:1] == ["source"]:
                names |= self.loaded((path.parent / words[1]).resolve(), seen)
        return names

    def test_every_netlist_of_the_tree_gets_the_components_it_loads_and_no_other(self):
        files = [
            path
            for folder in ("halfiles", "tests/netlists")
            for path in sorted((ROOT / folder).rglob("*.hal"))
        ]
        self.assertGreater(len(files), 50)
        for path in files:
            text = path.read_text(errors="replace")
            if (
                re.search(r"^\s*loadrt\s+\S*[\[$\"']|^\s*source\s+\S*[\[$\"']", text, re.M)
                or "\\\n" in text
                and "loadrt" not in text
            ):
                continue
            with self.subTest(path.relative_to(ROOT)):
                self.assertEqual(
                    self.loaded(path, set()), needs("run", str(path)) - {"python", "bus"}
                )

    def test_an_example_is_the_netlist_of_its_machine(self):
        machine = ROOT / "halfiles/furuta/swing-up.hal"
        found = needs("examples", "furuta/swing-up", "--for", "10s")
        self.assertEqual(self.loaded(machine, set()), found)
        self.assertIn("lqr", found)
        self.assertEqual(set(), needs("examples"))

    def test_an_ini_file_names_its_netlists_and_the_values_of_variables(self):
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "m.ini").write_text(
                "[HAL]\nHALFILE = m.hal\nHALCMD = loadrt or2\n[KINS]\nKINEMATICS = trivial-kins coordinates=xyz\n"
            )
            Path(folder, "m.hal").write_text("loadrt [KINS]KINEMATICS\nloadrt 'pid' count=3\n")
            self.assertLessEqual({"or2", "pid", "trivial_kins"}, needs("run", f"{folder}/m.ini"))

    def test_programs_that_a_netlist_starts_are_read(self):
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "p.py").write_text("import time\nimport hal\n")
            Path(folder, "m.hal").write_text(
                "loadusr -W python3 p.py\nloadusr -W hal node io --link sim:a --id 3\n"
            )
            self.assertEqual({"python", "bus"}, needs("run", f"{folder}/m.hal"))

    def test_a_node_of_several_exchanges_signals_with_the_others(self):
        self.assertEqual(
            {"node", "dds_publish", "dds_subscribe"},
            needs("run", "nothing.hal", "--node", "cell"),
        )

    def test_a_netlist_that_sources_itself_is_read_once(self):
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "m.hal").write_text("source m.hal\nloadrt pid\nsource n.hal\n")
            Path(folder, "n.hal").write_text("source m.hal\nloadrt sum2\n")
            self.assertEqual({"pid", "sum2"}, needs("run", "m.hal", cwd=folder))
            self.assertEqual({"pid", "sum2"}, needs("run", f"{folder}/m.hal", cwd=folder))

    def test_a_folder_with_the_name_of_an_argument_is_not_a_netlist(self):
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "build").mkdir()
            self.assertEqual({"pid"}, needs("build", "pid", cwd=folder))

    def test_pages_of_components_need_them(self):
        self.assertEqual(
            {"pid", "conv_s32_float"}, needs("doc", "pid", "conv-s32-float", "--markdown")
        )
        self.assertEqual({"all"}, needs("doc", "--all", "--output", "pages"))
        self.assertEqual(set(), needs("doc"))


class Unbuilt(Case):
    """A component that the build lists but has not made yet."""

    def setUp(self):
        super().setUp()
        (self.folder / "groups").write_text("later math Comes later, from its source\n")
        (self.folder / "file.hal").write_text("loadrt later\n")
        (self.folder / "build").write_text(
            f'#!/bin/sh\necho "built: $*"\ncp {HAL.parent.parent}/components/sum2.so {self.folder}/later.so\n'
        )
        (self.folder / "build").chmod(0o755)
        self.environment["HALCYON_PLUGIN_PATH"] = f"{self.folder}:{PLUGINS}"

    def run_hal(self, *words, **more):
        return subprocess.run(
            [HAL, *words],
            cwd=self.folder,
            env={**self.environment, **more},
            capture_output=True,
            text=True,
            timeout=60,
        )

    def test_check_names_the_command_that_builds_it(self):
        done = self.run_hal("check", "file.hal")
        self.assertEqual(1, done.returncode)
        self.assertIn("error: component 'later' is not installed [no-such-component]", done.stderr)
        self.assertIn("= help: in the source tree, type: ./hal build later\n", done.stderr)

    def test_check_names_the_debian_package_that_has_it(self):
        sys.path.insert(0, str(ROOT / "tools/package"))
        from packages import GROUPS

        for group in GROUPS:
            (self.folder / "groups").write_text(f"later {group} Comes later\n")
            self.assertIn(
                f"= help: in the source tree, type: ./hal build later; with Halcyon's Debian packages: sudo apt install halcyon-{group}\n",
                self.run_hal("check", "file.hal").stderr,
            )

    def test_a_program_that_is_not_there_is_named_with_its_package(self):
        alone = self.folder / "hal"
        shutil.copy(HAL, alone)
        done = subprocess.run(
            [alone, "panel"], env=self.environment, capture_output=True, text=True
        )
        self.assertEqual(
            (
                1,
                f"hal: cannot start {self.folder}/hal-panel: No such file or directory; with Halcyon's Debian packages, type: "
                "sudo apt install halcyon-panel; in the source tree: sudo apt install libwebsockets-dev libpugixml-dev && ./hal build panel\n",
            ),
            (done.returncode, done.stderr),
        )

    def test_doc_lists_it(self):
        self.assertRegex(self.run_hal("doc").stdout, "(?m)^later +Comes later, from its source$")

    def test_a_program_started_by_the_script_builds_it(self):
        done = self.run_hal("check", "file.hal", HALCYON_BUILD=str(self.folder / "build"))
        self.assertEqual(
            (0, "built: build later\nfile.hal: no errors\n"), (done.returncode, done.stderr)
        )
        self.assertEqual("", done.stdout)

    def test_a_build_that_fails_leaves_the_error(self):
        done = self.run_hal("check", "file.hal", HALCYON_BUILD="/bin/false")
        self.assertIn("error: component 'later' is not installed", done.stderr)

    def test_a_running_machine_builds_nothing(self):
        (self.folder / "file.hal").write_text("loadrt threads name1=t period1=1000000\n")
        done = self.run_hal(
            "sim",
            "file.hal",
            "--for",
            "1ms",
            "--execute",
            "loadrt later",
            HALCYON_BUILD=str(self.folder / "build"),
        )
        self.assertIn("error: component 'later' is not installed", done.stderr)


if __name__ == "__main__":
    unittest.main()
