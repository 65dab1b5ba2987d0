# SPDX-License-Identifier: MIT
"""hal examples: the machines to start from."""

import os
import re
import shutil
import subprocess
import unittest

from harness import HAL, ROOT, Case

MACHINES = ROOT / "halfiles"
# Machines that are not one netlist: several computers, a configuration of LinuxCNC.
NOT_LISTED = {"cell", "linuxcnc-ethernet"}


class Examples(Case):
    def names(self):
        return re.findall(r"(?m)^  (\S+/\S+)  ", self.good("examples"))

    def test_lists_every_machine_by_topic(self):
        text = self.good("examples")
        self.assertTrue(
            text.startswith("Machines to start from. None needs hardware.\n\nAxes and forces\n"),
            text,
        )
        self.assertTrue(
            text.endswith("\n\nTo run one: hal examples NAME [OPTION of hal run]\n"), text
        )
        self.assertIn("\nPendulums\n", text)
        self.assertRegex(
            text,
            r"(?m)^  furuta/hang +Furuta pendulum: hold the pendulum hanging while the arm keeps "
            r"its place, against pushes$",
        )
        folders = {netlist.parent.name for netlist in MACHINES.glob("*/*.hal")}
        self.assertEqual(folders - NOT_LISTED, {name.split("/")[0] for name in self.names()})

    def test_every_name_is_a_netlist(self):
        for name in self.names():
            self.assertTrue((MACHINES / f"{name}.hal").is_file(), name)

    def test_runs_one_with_the_options_of_run(self):
        text = self.good("examples", "axis/axis", "--for", "100ms")
        self.assertTrue(text.startswith(f"hal run {MACHINES}/axis/axis.hal --for 100ms\n"), text)
        self.assertIn("cycles", text)

    def test_runs_one_with_the_ini_file_beside_it(self):
        for name in ("jitter/plain", "jitter/random", "jitter/scocan", "jitter/tdma", "yair/yair"):
            done = self.run_program("examples", name, "--no-picture", "--for", "0.1s")
            self.assertIn(f" --ini {ROOT}/halfiles/{name}.ini --no-picture", done.stdout)
            self.assertEqual(0, done.returncode, done.stderr)

    def test_run_names_the_example_that_a_path_means(self):
        self.assertEqual(
            "hal run: 'halfiles/furuta/hang.hal' is not in this folder; to run the example from "
            "any folder type: hal examples furuta/hang\n",
            self.bad("run", "halfiles/furuta/hang.hal"),
        )
        self.assertIn("No such file", self.bad("run", "halfiles/furuta/hangs.hal"))

    def test_unknown_name(self):
        self.assertEqual(
            "hal examples: unknown example 'furuta/hnag'; did you mean 'furuta/hang'?\n",
            self.bad("examples", "furuta/hnag"),
        )
        self.assertEqual(
            "hal examples: unknown example 'teapot'; type: hal examples\n",
            self.bad("examples", "teapot"),
        )
        cnc = ROOT / "halfiles/linuxcnc-ethernet/cnc"
        self.assertEqual(
            "hal examples: 'linuxcnc-ethernet/cnc' is a configuration of LinuxCNC; type: "
            f"hal linuxcnc {cnc}.ini\n",
            self.bad("examples", "linuxcnc-ethernet/cnc"),
        )

    def test_run_without_a_netlist_lists_them(self):
        done = self.run_program("run")
        self.assertEqual(1, done.returncode)
        self.assertIn("\nPendulums\n", done.stdout)
        self.assertEqual(
            "hal run: missing netlist; type: hal run FILE.hal, hal run -I, or for one of these "
            "machines: hal examples NAME\n",
            done.stderr,
        )


class Installed(Case):
    def list_beside_the_program(self, **environment):
        (self.folder / "bin").mkdir()
        shutil.copy(HAL, self.folder / "bin/hal")
        done = subprocess.run(
            [self.folder / "bin/hal", "examples"],
            capture_output=True,
            text=True,
            env=dict(os.environ, LD_LIBRARY_PATH=str(HAL.parent.parent / "lib"), **environment),
        )
        self.assertEqual((0, ""), (done.returncode, done.stderr))
        return done.stdout

    def test_finds_the_machines_beside_the_program(self):
        shutil.copytree(MACHINES, self.folder / "share/halcyon/halfiles")
        text = self.list_beside_the_program()
        self.assertIn("  furuta/hang ", text)
        self.assertNotIn("(needs ", text)

    def write_machine_of_components_that_are_not_installed(self):
        """Two netlists, which source each other, and the list of their components without plugins."""
        machine = self.folder / "share/halcyon/halfiles/mill"
        machine.mkdir(parents=True)
        (machine / "mill.hal").write_text(
            "# Topic: Mills\n# A mill.\nloadrt sum2\nloadrt later_eye\nsource loop.hal\n"
        )
        (machine / "loop.hal").write_text("loadrt later_design\nsource mill.hal\n")
        (machine / "plain.hal").write_text("# Topic: Mills\n# A plain one.\nloadrt sum2\n")
        (self.folder / "groups").write_text(
            "later_eye vision Sees\nlater_design estimation Designs\n"
        )

    def test_names_the_packages_that_a_machine_needs_and_that_are_missing(self):
        self.write_machine_of_components_that_are_not_installed()
        text = self.list_beside_the_program(HALCYON_PLUGIN_PATH=str(self.folder))
        self.assertIn(
            "\nMills\n"
            "  mill/mill   A mill (needs halcyon-estimation, halcyon-vision)\n"
            "  mill/plain  A plain one\n"
            "\nPackages that are not installed: sudo apt install halcyon-estimation halcyon-vision\n",
            text,
        )

    def test_needs_no_package_where_the_source_tree_builds_on_demand(self):
        self.write_machine_of_components_that_are_not_installed()
        text = self.list_beside_the_program(
            HALCYON_PLUGIN_PATH=str(self.folder), HALCYON_BUILD="/nowhere/hal"
        )
        self.assertIn("  mill/mill   A mill\n", text)
        self.assertNotIn("sudo", text)


if __name__ == "__main__":
    unittest.main()
