#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""An installation: made from an incomplete build, moved, granted capabilities as the program advises, and used by an ordinary user who sees
neither the sources nor the build tree. Needs root."""
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from harness import HAL, ROOT, SANITIZED, TIMEOUT, lacks_a_package

BUILD = HAL.parent.parent
RUNUSER = shutil.which("runuser")
MACHINES = "share/doc/Halcyon/halfiles"
# Parts of machines, those that need the network namespaces which bring-up makes, and those with settings in an INI file.
NOT_ALONE = {
    "ethercat-cnc/control.hal",
    "ethernet-cnc/clock.hal",
    "ethernet-cnc/control.hal",
    "ethernet-cnc/wire.hal",
    "ethernet-furuta/control.hal",
    "ethernet-furuta/rig.hal",
    "ethernet-furuta/swing-up-wire.hal",
    "ethernet-furuta/upright.hal",
    "ethernet-furuta/wire.hal",
    # with an INI file, or part of another file
    "jitter/plain.hal",
    "jitter/random.hal",
    "jitter/scocan.hal",
    "jitter/tdma.hal",
    "jitter/wiring.hal",
    *(
        f"linuxcnc-ethernet/{name}.hal"
        for name in ("canopen", "ethercat", "machine", "memory", "slots", "wire")
    ),
    "mesa-mill/machine.hal",
    "yair/pc.hal",
    "yair/pc-alone.hal",
    "yair/robot.hal",
    "yair/robot-alone.hal",
    "yair/yair.hal",
}
HIDDEN = f'for folder in "$1" "$2"; do mount -t tmpfs none "$folder" || exit 99; done; user=$3; shift 3; exec {RUNUSER} -u "$user" -- env "HOME=$HOME" "$@"'
OVERLAY = 'mount -t overlay -o "lowerdir=$1,upperdir=$2/upper,workdir=$2/work" overlay "$1" || exit 99; cd "$1"; shift 2; eval "$@"'
OWN_ETC = 'mount --bind "$1/etc" /etc && mount --bind "$1/latency" /dev/cpu_dma_latency; shift; sudo() { "$@"; }; eval "$@"'
# Made by other rules than those of the program: what a first `./hal run` leaves out.
LATER = "python/hal/_core*.so reference completion components/fieldbus/tdma/libhalcyon_tdma.a"


def run(*words, **how):
    return subprocess.run(
        [str(word) for word in words],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=4 * TIMEOUT,
        **how,
    )


class Installed(unittest.TestCase):
    maxDiff = None

    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="hal-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, True)
        cls.folder.chmod(0o755)
        cls.home = cls.folder / "home"
        cls.home.mkdir()
        shutil.chown(cls.home, "nobody")
        for name in ("upper", "work"):
            (cls.folder / "overlay" / name).mkdir(parents=True)
        # What is missing in the build is built first; the prefix is another than that of the build, and its contents are moved.
        made = run(
            "unshare",
            "-m",
            "sh",
            "-c",
            OVERLAY,
            "sh",
            BUILD,
            cls.folder / "overlay",
            f"rm -rf {LATER} && DESTDIR='{cls.folder}/stage' cmake --install . --prefix /opt/halcyon",
        )
        if made.returncode == 99:
            sys.exit(77)
        assert made.returncode == 0, made.stdout + made.stderr
        cls.prefix = cls.folder / "moved"
        (cls.folder / "stage/opt/halcyon").rename(cls.prefix)
        cls.hal = cls.prefix / "bin/hal"
        cls.environment = {
            "PATH": f"{cls.prefix}/bin:/usr/local/bin:/usr/bin:/bin",
            "HOME": str(cls.home),
            "XDG_RUNTIME_DIR": str(cls.home),
            "LC_ALL": "C.UTF-8",
            "TERM": "xterm",
        }
        before = cls.findings()
        cls.without = {name: before[name]["verdict"] for name in before}
        cls.remedy = before["capabilities"]["remedy"]
        assert cls.remedy.startswith("sudo setcap "), before
        granted = run("sh", "-c", cls.remedy.removeprefix("sudo "))
        assert granted.returncode == 0, granted.stderr

    @classmethod
    def ordinary(cls, *words, user="nobody", **how):
        """Runs a command as an ordinary user who sees neither sources nor build."""
        return run(
            "unshare",
            "-m",
            "sh",
            "-c",
            HIDDEN,
            "sh",
            BUILD,
            ROOT,
            user,
            *words,
            cwd=how.pop("cwd", cls.home),
            env=cls.environment,
            **how,
        )

    @classmethod
    def findings(cls, **how):
        done = cls.ordinary(cls.hal, "doctor", "--json", "--seconds", "0", **how)
        assert done.returncode == 0, done.stdout + done.stderr
        return {finding["subject"]: finding for finding in json.loads(done.stdout)["findings"]}

    def copy(self, name):
        """The installation once more, without capabilities."""
        shutil.copytree(self.prefix, self.folder / name, symlinks=True)
        run("setcap", "-r", self.folder / name / "bin/hal")
        return self.folder / name

    def good(self, *words, **how):
        done = self.ordinary(*words, **how)
        self.assertEqual((0, ""), (done.returncode, done.stderr), done.stdout)
        return done.stdout

    def test_the_advised_capabilities_work_for_an_ordinary_user(self):
        self.assertEqual(
            self.remedy, f"sudo setcap cap_sys_nice,cap_ipc_lock,cap_net_raw=ep {self.hal}"
        )
        root = {
            f["subject"]: f["verdict"]
            for f in json.loads(run(self.hal, "doctor", "--json", "--seconds", "0").stdout)[
                "findings"
            ]
        }
        after = self.findings()
        for subject in ("SCHED_FIFO", "memory locking", "capabilities", "raw Ethernet"):
            self.assertEqual(root[subject], after[subject]["verdict"], after[subject])
        self.assertEqual("fair", self.without["capabilities"])
        # hal-bus, which hal becomes, has them too
        if root["raw Ethernet"] == "good":
            done = self.ordinary(self.hal, "can", "dump", "cane:lo", "--for", "20ms")
            self.assertEqual(0, done.returncode, done.stdout + done.stderr)

    def test_a_machine_prints_the_same_advice_and_nothing_once_granted(self):
        bare = self.copy("bare")
        netlist = self.home / "one.hal"
        netlist.write_text("loadrt threads name1=servo period1=1000000\n")
        advice = self.ordinary(bare / "bin/hal", "run", netlist, "--for", "10ms", "--no-picture")
        said = advice.stdout + advice.stderr
        self.assertIn(
            f"grant it with: sudo setcap cap_sys_nice,cap_ipc_lock,cap_net_raw=ep {bare}/bin/hal (or by limits of a group: hal doctor)",
            said,
        )
        granted = self.ordinary(self.hal, "run", netlist, "--for", "10ms", "--no-picture")
        self.assertNotIn("setcap", granted.stdout + granted.stderr)

    def test_the_advised_limits_work_for_a_member_of_the_group(self):
        self.follow_the_advice_on_limits(has_udev=True)

    def test_the_advised_limits_work_where_udev_is_not_installed(self):
        self.follow_the_advice_on_limits(has_udev=False)

    def follow_the_advice_on_limits(self, has_udev):
        etc = self.folder / "etc"
        shutil.rmtree(etc, ignore_errors=True)
        shutil.copytree("/etc", etc, symlinks=True, ignore_dangling_symlinks=True)
        shutil.rmtree(etc / "udev", ignore_errors=True)
        if has_udev:
            (etc / "udev/rules.d").mkdir(parents=True)
        node = self.folder / "latency"
        node.unlink(missing_ok=True)
        os.mknod(node, 0o20600, os.stat("/dev/cpu_dma_latency").st_rdev) if os.path.exists(
            "/dev/cpu_dma_latency"
        ) else node.touch()
        hal = self.copy(f"by-limits-{has_udev}") / "bin/hal"
        user = f"{RUNUSER} tester -c '{hal} doctor --json --seconds 0'"  # logs in, as -u does not
        before = run(
            "unshare",
            "-m",
            "sh",
            "-c",
            OWN_ETC,
            "sh",
            self.folder,
            f"useradd -M tester && {user}",
            env=self.environment | {"PATH": os.environ["PATH"]},
        )
        self.assertEqual(0, before.returncode, before.stderr)
        found = {f["subject"]: f for f in json.loads(before.stdout)["findings"]}
        commands = {
            found[name]["other"].removesuffix(", then log in again")
            for name in ("SCHED_FIFO", "memory locking")
        }
        if latency := found["idle states"]["remedy"]:
            command, after = latency.split(", then log in again")
            commands.add(command)
            repeats = "; udev is not installed, so repeat chgrp and chmod after each boot"
            self.assertEqual("" if has_udev else repeats, after)
        script = "USER=tester; " + "; ".join(
            f"{{ {command}; }} >/dev/null || exit 98" for command in commands
        )
        after = run(
            "unshare",
            "-m",
            "sh",
            "-c",
            OWN_ETC,
            "sh",
            self.folder,
            f"{script}; {user}",
            env=self.environment | {"PATH": os.environ["PATH"]},
        )
        self.assertEqual(0, after.returncode, after.stderr)
        found = {f["subject"]: f for f in json.loads(after.stdout)["findings"]}
        # In a container without CAP_SYS_RESOURCE nobody's limits can be raised, not by root either.
        raised = run("prlimit", "--rtprio=98", "true").returncode == 0
        for subject in ("idle states", *(("SCHED_FIFO", "memory locking") if raised else ())):
            self.assertEqual("good", found[subject]["verdict"], found[subject])

    def test_every_machine_that_needs_no_other_host_runs(self):
        folder = self.prefix / MACHINES
        machines = sorted(str(path.relative_to(folder)) for path in folder.glob("*/*.hal"))
        self.assertTrue(NOT_ALONE < set(machines), machines)
        for machine in set(machines) - NOT_ALONE:
            with self.subTest(machine):
                done = self.ordinary(
                    self.hal,
                    "sim",
                    folder / machine,
                    "--for",
                    "20ms",
                    cwd=(folder / machine).parent,
                )
                if lacks_a_package(done.stderr):
                    self.skipTest("a package of this machine is left out of this build")
                self.assertEqual(0, done.returncode, done.stdout + done.stderr)
                self.assertNotIn("error", done.stderr)

    def test_machines_run_in_real_time(self):
        folder = self.prefix / MACHINES
        for machine in (
            "furuta/hang.hal",
            "vision-furuta/vision-furuta.hal",
            "canopen-axis/axis.hal",
        ):
            with self.subTest(machine):
                done = self.ordinary(
                    self.hal,
                    "run",
                    folder / machine,
                    "--for",
                    "50ms",
                    "--no-picture",
                    cwd=(folder / machine).parent,
                )
                if lacks_a_package(done.stderr):
                    self.skipTest("a package of this machine is left out of this build")
                self.assertIn("in another terminal: hal shell", done.stdout, done.stderr)
                self.assertNotIn("error", done.stderr)

    def test_every_component_loads(self):
        here = {path.stem for path in (self.prefix / "lib/halcyon/components").glob("*.so")}
        self.assertEqual({path.stem for path in (BUILD / "components").glob("*.so")}, here)
        self.good(self.hal, "doc", "--all", "--output", self.home / "pages")
        self.assertEqual(
            set(),
            here - {path.stem.replace("-", "_") for path in (self.home / "pages").glob("*.html")},
        )

    def test_a_component_is_made_compiled_and_found_by_cmake(self):
        self.good(self.hal, "new", "component", "fresh", cwd=self.home)
        fresh = self.home / "fresh"
        self.assertIn(
            "installed as", self.good(self.hal, "compile", "--check-rt", "fresh.cpp", cwd=fresh)
        )
        done = self.ordinary(
            "sh", "-c", "cmake -B build && cmake --build build && ctest --test-dir build", cwd=fresh
        )
        self.assertEqual(0, done.returncode, done.stdout + done.stderr)
        # and one that links a library of Halcyon's
        (fresh / "CMakeLists.txt").write_text(
            "cmake_minimum_required(VERSION 3.25)\nproject(mine CXX)\nfind_package(Halcyon REQUIRED)\n"
            "add_hal_component(fresh fresh.cpp)\ntarget_link_libraries(component_fresh PRIVATE -Wl,--no-as-needed Halcyon::link)\n"
        )
        done = self.ordinary("sh", "-c", "cmake -B build && cmake --build build", cwd=fresh)
        self.assertEqual(0, done.returncode, done.stdout + done.stderr)
        self.good("env", f"HALCYON_PLUGIN_PATH={fresh}/build", "hal", "doc", "fresh")

    def test_python_finds_the_module(self):
        module = self.prefix / "lib/halcyon/python"
        if not list((BUILD / "python/hal").glob("_core*.so")):
            self.skipTest("Python's module hal was left out of this build")
        self.assertIn(
            str(self.prefix),
            self.good(
                "env",
                f"PYTHONPATH={module}",
                "/usr/bin/python3",
                "-c",
                "import hal; print(hal.__file__)",
            ),
        )
        (self.home / "module.py").write_text("import hal, sys\nprint('module', hal.__file__)\n")
        (self.home / "module.hal").write_text("loadusr -w /usr/bin/python3 module.py\n")
        self.assertIn(
            f"module {module}", self.good(self.hal, "sim", "-q", "module.hal", cwd=self.home)
        )

    def test_manual_pages_and_completion_are_found(self):
        if shutil.which("man"):
            self.assertEqual(
                f"{self.prefix}/share/man/man9/hal-pid.9\n", self.good("man", "-w", "hal-pid")
            )
        for name, word in (("hal", "docto"), ("halcmd", "docto")):
            script = f'source {self.prefix}/share/bash-completion/completions/{name}; COMP_WORDS=(hal {word}) COMP_CWORD=1; _hal; echo "${{COMPREPLY[@]}}"'
            self.assertEqual("doctor\n", self.good("bash", "-c", script))

    def test_pages_and_machines_are_there_and_their_links_lead_somewhere(self):
        pages = self.prefix / "share/doc/Halcyon"
        for name in (
            "LICENSE",
            "README.md",
            "docs/tutorials/write-a-netlist.md",
            "reference/index.html",
            f"../../../{MACHINES}/furuta/hang.hal",
        ):
            self.assertTrue((pages / name).is_file(), name)
        for page in [
            pages / "README.md",
            *(pages / "docs").rglob("*.md"),
            *(pages / "halfiles").rglob("*.md"),
        ]:
            text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.M | re.S)  # code has no links
            for link in re.findall(r"\]\((?!https?:|#)([^)#\s]+)", text):
                if page.relative_to(pages).parts[:2] != ("docs", "decisions"):
                    self.assertTrue(
                        (page.parent / link).exists(), f"{page.relative_to(pages)}: {link}"
                    )

    def test_a_plugin_without_its_library_is_rejected_with_the_library_s_name(self):
        broken = self.copy("broken")
        for library in broken.glob("lib/libhalcyon_link.so*"):
            library.unlink()
        (self.home / "bus.hal").write_text("loadrt can_send\n")
        said = self.ordinary(broken / "bin/hal", "check", "bus.hal", cwd=self.home).stderr
        self.assertIn(
            "is not a usable component: libhalcyon_link.so.0.2: cannot open shared object file: No such file or directory [bad-plugin]",
            said,
        )
        self.assertIn(
            "= help: that library belongs to Halcyon and was not installed with it; install again: cmake --install BUILD",
            said,
        )


if __name__ == "__main__":
    if os.geteuid() != 0 or SANITIZED or not shutil.which("setcap") or not RUNUSER:
        print("needs root, setcap and runuser, and a program without sanitizers")
        sys.exit(77)
    unittest.main()
