# SPDX-License-Identifier: MIT
# packages: canopen dds tdma
"""Netlists for several machines: hal check, hal sim, and hal run --node with a process for each node on loopback; hal top."""

import json
import os
import re
import signal
import subprocess
import unittest

from harness import HAL, TIMEOUT, ROOT, Case, machines_elsewhere, wait_until
from own_network import dds_domain

# Fast DDS frees some of its memory by another size than it took; who is killed here leaks on purpose.
os.environ["ASAN_OPTIONS"] = (
    os.environ.get("ASAN_OPTIONS", "") + ":new_delete_type_mismatch=0:detect_leaks=0"
)
DOMAIN = dds_domain()  # in a network of its own
HAVE_DDS = any(
    "dds_publish.so" in names for _, _, names in os.walk(HAL.parent.parent / "lib")
) or any("dds_publish.so" in names for _, _, names in os.walk(HAL.parent.parent / "components"))
HAVE_VISION = any(
    "vision_blob.so" in names for _, _, names in os.walk(HAL.parent.parent / "lib")
) or any("vision_blob.so" in names for _, _, names in os.walk(HAL.parent.parent / "components"))

# `sender` counts up, `taker` sends back twice of it. The deadline is long: this machine may be busy.
CELL = """loadrt threads name1=servo period1=1000000

node sender rate=5ms deadline=1s
loadrt integ names=clock
loadrt sum2  names=back
addf clock servo
addf back  servo
setp clock.in 1
net count   clock.out
net doubled => back.in0
loadrt and2 names=alive
addf alive servo
net there   node.taker.online => alive.in0

node taker rate=5ms deadline=1s
loadrt scale names=twice
addf twice servo
setp twice.gain 2
net count   => twice.in
sets count -1
net doubled twice.out
"""

# `taker` sends nothing.
ONE_WAY = """loadrt threads name1=servo period1=1000000

node sender
loadrt integ names=clock
addf clock servo
net count clock.out

node taker deadline=100ms
loadrt scale names=twice
addf twice servo
net count => twice.in
"""

TWO_THREADS = """loadrt threads name1=servo period1=1000000 name2=slow period2=10000000

node desk deadline=1s
loadrt integ names=ta,tb
addf ta servo
addf tb slow
setp ta.in 1
setp tb.in 1
net fast ta.out
net lazy tb.out

node motor deadline=1s
loadrt sum2 names=a,b
addf a servo
addf b slow
net fast => a.in0
net lazy => b.in0
sets fast -1
sets lazy -1
"""


class Language(Case):
    def test_check_takes_all_nodes_at_once(self):
        path = self.write("cell.hal", CELL)
        done = self.run_program("check", path)
        self.assertEqual((0, ""), (done.returncode, done.stdout), done.stderr)
        self.assertEqual(
            f"{path}: no errors\nnodes: sender, taker\n  sender -> taker: count:float\n"
            "  taker -> sender: doubled:float\n",
            done.stderr,
        )

    def test_check_reports_errors_of_all_nodes_and_those_of_common_lines_once(self):
        path = self.write(
            "cell.hal",
            CELL.replace("period1=1000000\n", "period1=1000000\nsetp nowhere 1\n", 1)
            .replace("net doubled twice.out", "net doubled twice.outt")
            .replace("addf back  servo", "addf bakc  servo"),
        )
        said = self.bad("check", path)
        self.assertEqual(1, said.count("unknown pin 'nowhere'"), said)
        self.assertIn("did you mean 'twice.out'?", said)
        self.assertIn("unknown function 'bakc'", said)

    def test_sim_passes_the_signals_and_is_deterministic(self):
        path = self.write("cell.hal", CELL)
        words = (
            "sim",
            path,
            "--for",
            "1s",
            "-e",
            "taker: getp twice.in",
            "-e",
            "sender: getp back.in0",
            "-e",
            "sender: getp alive.in0",
        )
        first = self.good(*words)
        count, doubled, alive = first.split()
        self.assertTrue(0.98 <= float(count) <= 1.0, first)  # sent every 5 ms
        self.assertTrue(1.95 <= float(doubled) <= 2.0, first)  # there and back
        self.assertEqual("TRUE", alive)
        self.assertEqual(first, self.good(*words))

    def test_sim_of_one_node_has_safe_values_for_the_others(self):
        path = self.write("cell.hal", CELL)
        self.assertEqual(
            "-1\n",
            self.good("sim", path, "--node", "taker", "--for", "1s", "-e", "taker: getp twice.in"),
        )

    def test_a_signal_that_each_node_writes_itself_stays_there(self):
        path = self.write(
            "two.hal",
            "loadrt threads name1=servo period1=1000000\nloadrt sum2 names=a\naddf a servo\n"
            "node x y\nsetp a.in0 1\nnet own a.out\nnode y\nsetp a.in1 5\n",
        )
        self.assertEqual(
            "1\n6\n",
            self.good("sim", path, "--for", "5ms", "-e", "x: gets own", "-e", "y: gets own"),
        )
        self.assertNotIn("->", self.run_program("check", path).stderr)

    def test_node_name_in_names(self):
        path = self.write(
            "two.hal",
            "loadrt threads name1=servo period1=1000000\nloadrt sum2 names=a\naddf a servo\n"
            "node robot[1..2]\nnet $(NODE)-x a.out\nnode robot2\nsetp a.in0 7\nnode desk\nnet robot1-x a.in0\nnet robot2-x a.in1\n",
        )
        self.assertEqual("7\n", self.good("sim", path, "--for", "50ms", "-e", "desk: getp a.in1"))

    def test_fmt_sets_parts_apart(self):
        path = self.write(
            "cell.hal", "net  a b.c\nnode  x   rate=5ms\nnet a b.d\n# of all\nnode all\n"
        )
        self.good("fmt", path)
        with open(path, encoding="utf-8") as file:
            self.assertEqual(
                "net a b.c\n\nnode x rate=5ms\nnet a b.d\n# of all\nnode all\n", file.read()
            )

    def test_graph_draws_one_node(self):
        path = self.write("cell.hal", CELL)
        drawn = self.good("graph", path, "--node", "taker")
        self.assertIn("twice", drawn)
        self.assertNotIn("clock", drawn)
        self.assertIn("taker.online", self.good("graph", path, "--node", "sender"))
        self.assertIn("[several-nodes]", self.bad("graph", path))

    def test_execute_selects_the_node(self):
        path = self.write("cell.hal", CELL)
        command = ("sim", path, "--for", "1ms", "-q", "-e", "sender: print executed", "-e")
        node = "needs a node, or 'all'; use --execute"
        for text, problem in {
            "getp x": f"'getp x' {node} 'sender: getp x'",
            "getp a:b": f"'getp a:b' {node} 'sender: getp a:b'",
            "nobody: getp x": f"'nobody: getp x' {node} 'sender: getp x'",
            "sender: advance 1s": "'sender: advance 1s': time passes for all nodes together; use "
            "--execute 'all: advance 1s'",
            "all: advance 5": "'all: advance 5': invalid time '5'; use a number with its unit: "
            "--execute 'all: advance 5s'",
        }.items():
            with self.subTest(text):
                # nothing was executed
                self.assertEqual(f"hal sim: --execute {problem}\n", self.bad(*command, text))
        self.assertEqual("0\n0\n", self.good(*command[:5], "-e", "all: getp servo.missed"))

    def sim(self, netlist, *commands, time="1s"):
        path = self.write("cell.hal", netlist)
        words = [word for command in commands for word in ("-e", command)]
        return self.good("sim", path, "--for", time, "-q", *words)

    def state(self, reader, other):
        return [f"{reader}: getp node.{other}.{pin}" for pin in ("online", "age-ms")]

    def test_sim_finds_a_stopped_node_offline_after_its_deadline(self):
        fault = (
            "servo: node 'sender' sent no signals of thread 'servo' for 1.001 s (deadline 1 s) at "
            "cycle 2 001; they have their safe values; see: show pin node\n"
        )
        value = "taker: gets count"
        stopped = ("sender: stop", "all: advance 1s")
        online = self.state("taker", "sender")
        self.assertEqual(
            "TRUE\n1000\n1\nno faults\n",
            self.sim(CELL, *stopped, *online, value, "taker: show fault"),
        )
        lost = self.sim(CELL, *stopped, "all: advance 1s", *online, value, "taker: show fault")
        self.assertEqual(
            f"FALSE\n2000\n-1\n   1  999 ms ago (lasts)  {fault}1 not acknowledged; 1 lasts: "
            "type `fault clear` once the cause is over\n",
            lost,
        )
        # and the other way it is as lost, because a stopped node receives nothing
        self.assertEqual("FALSE\ninf\n", self.sim(CELL, *stopped, *self.state("sender", "taker")))
        again = self.sim(
            CELL,
            *stopped,
            "all: advance 1s",
            "sender: start",
            "all: advance 10ms",
            *online,
            "taker: show fault",
            "taker: fault clear",
            "taker: show fault",
        )
        self.assertEqual(
            f"TRUE\n0\n   1  1.01 s ago  {fault}1 not acknowledged; `fault clear` acknowledges "
            "them\nno faults\n",
            again.replace("(lasts) ", ""),
        )

    def test_sim_finds_a_node_offline_without_one_of_its_threads(self):
        commands = ["desk: delthread slow", "desk: addf tb servo", "all: advance 2s"]
        shown = [*self.state("motor", "desk"), "motor: gets lazy", "motor: gets fast"]
        path = self.write("cell.hal", TWO_THREADS)
        words = [word for command in (*commands, *shown) for word in ("-e", command)]
        done = self.run_program("sim", path, "--for", "1s", "-q", *words)
        self.assertEqual((0, "FALSE\n2000\n-1\n3\n"), (done.returncode, done.stdout), done.stderr)

    def test_sim_finds_a_node_offline_whose_machine_is_unloaded(self):
        commands = ["sender: unload all", "all: advance 2s"]
        self.assertEqual("FALSE\n2000\n", self.sim(CELL, *commands, *self.state("taker", "sender")))

    def test_sim_finds_others_offline_from_a_node_without_its_threads(self):
        for command in ("sender: unload all", "sender: delthread servo"):
            commands = [command, "all: advance 1ms", *self.state("sender", "taker")]
            words = [word for one in commands for word in ("-e", one)]
            path = self.write("cell.hal", CELL)
            done = self.run_program("sim", path, "--for", "1s", "-q", *words)
            self.assertEqual((0, "FALSE\ninf\n"), (done.returncode, done.stdout), command)

    def test_sim_finds_a_node_that_sends_nothing_offline_without_its_threads(self):
        shown = self.state("sender", "taker")
        for command in ("taker: unload all", "taker: delthread servo"):
            commands = [command, "all: advance 50ms", *shown, "all: advance 950ms", *shown]
            words = [word for one in commands for word in ("-e", one)]
            path = self.write("cell.hal", ONE_WAY)
            done = self.run_program("sim", path, "--for", "1s", "-q", *words)
            self.assertEqual(
                (0, "TRUE\n50\nFALSE\n1000\n"), (done.returncode, done.stdout), command
            )
        again = ("taker: newthread servo 1000000", "taker: start", "all: advance 1ms")
        self.assertEqual(
            "TRUE\n0\n", self.sim(ONE_WAY, "taker: unload all", "all: advance 1s", *again, *shown)
        )

    def test_sim_that_waits_for_a_program_can_be_interrupted(self):
        self.write("wait.sh", "touch started\nexec sleep 60\n")
        path = self.write("cell.hal", CELL + "loadusr -w sh wait.sh\n")
        machine = self.start("sim", path, loaded=False)
        wait_until((self.folder / "started").exists, "the program runs")
        self.end(machine, signal.SIGINT)
        self.assertEqual(1, machine.returncode)

    def test_advance_in_a_netlist_of_all_nodes(self):
        path = self.write("cell.hal", CELL + "advance 2s\n")
        self.assertEqual(
            f"{path}:22:1: error: 'advance' in a netlist for several machines, whose time passes "
            "for all together [shared-time]\n   22 | advance 2s\n      | ^^^^^^^^^^\n"
            "      = help: leave it out and use --for 2s, or -e 'all: advance 2s'; --node taker "
            "simulates this node only\n",
            self.bad("sim", path),
        )
        self.assertEqual(
            "2\n",
            self.good(
                "sim",
                path,
                "--node",
                "taker",
                "-q",
                "-e",
                "all: advance 1s",
                "-e",
                "taker: getp twice.gain",
            ),
        )

    def test_rejects_dds_without_a_node(self):
        self.assertEqual(
            "hal run: --dds applies to nodes of a netlist for several machines: add --node NAME; dds_publish and dds_subscribe take "
            "domain=3 themselves\n",
            self.bad("run", self.write("cell.hal", CELL), "--dds", "domain=3"),
        )

    @unittest.skipIf(HAVE_DDS, "DDS is there")
    def test_run_without_dds_names_the_package(self):
        said = self.bad("run", self.write("cell.hal", CELL), "--node", "taker", "--for", "1s")
        self.assertIn("sudo apt install libfastrtps-dev", said)


@unittest.skipUnless(HAVE_DDS, "built without Fast DDS")
class Running(Case):
    def setUp(self):
        super().setUp()
        self.environment["HALCYON_DDS"] = f"domain={DOMAIN}"
        self.environment["SKIP_DEFAULT_XML_FILE"] = "1"
        self.path = self.write("cell.hal", CELL)

    def node(self, name, path=None):
        return self.start("run", path or self.path, "--node", name, instance=name)

    def until_said(self, pattern, *words):
        """Runs hal until its standard error matches: the time two nodes need to discover each other depends on the machine."""
        log = open(self.folder / "log", "w+")
        self.addCleanup(log.close)
        process = subprocess.Popen(
            ["hal", "run", *map(str, words)],
            executable=str(HAL),
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=log,
        )
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)

        def said():
            ended = process.poll() is not None
            text = (self.folder / "log").read_text()
            return text if ended or re.search(pattern, text) else None

        text = wait_until(said, f"it prints '{pattern}'")
        self.assertRegex(text, pattern)

    def until(self, node, pin, good, what):
        return wait_until(
            lambda: good(self.value(pin, instance=node)),
            f"{what} ({pin} of {node} is {self.value(pin, instance=node)})",
        )

    def test_signals_pass_and_a_lost_node_is_detected_and_reconnects(self):
        taker = self.node("taker")
        self.assertEqual("-1", self.value("twice.in", instance="taker"))
        self.assertEqual("FALSE", self.value("node.sender.online", instance="taker"))
        sender = self.node("sender")
        self.until("taker", "node.sender.online", lambda v: v == "TRUE", "the sender is there")
        self.until("taker", "twice.in", lambda v: float(v or 0) > 0, "the count comes")
        self.until("sender", "back.in0", lambda v: float(v or 0) > 0, "twice the value returns")
        self.until("sender", "alive.in0", lambda v: v == "TRUE", "a linked online pin")
        self.assertLess(float(self.value("node.sender.age-ms", instance="taker")), 1000 * TIMEOUT)

        latency = self.shell("show", "latency", instance="taker").stdout
        self.assertIn(
            "count: node sender => twice.in  over DDS every 5 ms, deadline 1 s, then -1", latency
        )
        self.assertIn(
            "doubled: twice.out => node sender  over DDS every 5 ms, deadline 1 s (sent by servo)",
            latency,
        )

        sender.kill()
        sender.wait()
        self.until("taker", "node.sender.online", lambda v: v == "FALSE", "the loss is noticed")
        self.assertEqual("-1", self.value("twice.in", instance="taker"))
        self.assertIn(
            "no sample of topic 'halcyon/cell/sender/servo'",
            self.shell("show", "fault", instance="taker").stdout,
        )

        again = self.node("sender")
        self.until("taker", "node.sender.online", lambda v: v == "TRUE", "it is back")
        self.until("taker", "twice.in", lambda v: float(v or -1) > 0, "the count comes again")

        # hal top sees both, from outside and as a table
        def top():
            seen = {one["node"]: one for one in json.loads(self.good("top", "--json"))}
            return seen if {"sender", "taker"} <= set(seen) else None

        seen = wait_until(top, "hal top sees both")
        self.assertEqual(
            ("cell", "sender", again.pid),
            tuple(seen["sender"][key] for key in ("cell", "instance", "pid")),
        )
        self.assertEqual(["servo"], [thread["name"] for thread in seen["sender"]["threads"]])
        self.assertGreaterEqual(seen["taker"]["faults"], 1)
        wait_until(lambda: "cell/taker" in self.good("top"), "it is in the table")
        self.end(again)
        out, err = self.end(taker)
        self.assertNotIn("ERROR", err)

    def test_is_offline_when_the_signals_of_one_of_its_threads_are_lost(self):
        path = self.write("threads.hal", TWO_THREADS)
        self.node("motor", path)
        self.node("desk", path)
        self.until("motor", "node.desk.online", lambda v: v == "TRUE", "the desk is there")
        self.until("motor", "b.in0", lambda v: float(v or -1) > 0, "signals of both threads come")
        self.shell("delthread", "slow", instance="desk")
        self.until("motor", "node.desk.online", lambda v: v == "FALSE", "the loss is noticed")
        self.assertEqual("-1", self.value("b.in0", instance="motor"))
        age = float(self.value("node.desk.age-ms", instance="motor"))
        self.assertGreater(age, 1000, "the age of the oldest signal")
        count = float(self.value("a.in0", instance="motor"))
        self.until("motor", "a.in0", lambda v: float(v) > count, "the other thread goes on")
        self.assertEqual("FALSE", self.value("node.desk.online", instance="motor"))

    def test_rejects_another_version_by_name(self):
        self.node("taker")
        text = CELL
        for old, new in (
            ("loadrt integ names=clock", "loadrt conv_float_s32 names=clock\nloadrt integ names=t"),
            ("addf clock servo", "addf t servo\naddf clock servo\nnet t t.out => clock.in"),
            ("setp clock.in 1", "setp t.in 1"),
            (
                "loadrt scale names=twice",
                "loadrt conv_s32_float names=int\nloadrt scale names=twice\naddf int servo",
            ),
            ("net count   => twice.in", "net count   => int.in\nnet f int.out => twice.in"),
        ):
            text = text.replace(old, new)
        other = self.write("other.hal", text)
        os.mkdir(self.folder / "new")
        path = self.folder / "new" / "cell.hal"
        os.rename(other, path)
        # on a very busy machine discovery takes longer than the second that the start waits; then it is reported, and nothing is exchanged
        self.until_said(
            r"node 'taker' \(instance 'taker' on .*\) runs another version of netlist 'cell' than node 'sender': "
            "signal 'count' is s32 on node 'sender' and float on node 'taker'; run the same file on both",
            path,
            "--node",
            "sender",
        )
        self.assertEqual("FALSE", self.value("node.sender.online", instance="taker"))

    def test_names_invalid_settings(self):
        self.assertIn(
            "--dds: invalid setting 'foo'; use KEY=VALUE with one of the keys: domain",
            self.bad("run", self.path, "--node", "taker", "--dds", "domain=3 foo"),
        )
        self.assertIn(
            "--dds takes settings KEY=VALUE before --for; without any, leave out --dds",
            self.bad("run", self.path, "--node", "taker", "--dds", "--for"),
        )

    def test_rejects_a_second_instance_of_a_node(self):
        self.node("taker")
        self.until_said(
            "node 'taker' of 'cell' is already running: instance 'taker' on ",
            self.path,
            "--node",
            "taker",
            "--name",
            "twin",
        )


@unittest.skipUnless(HAVE_DDS and HAVE_VISION, "built without Fast DDS or OpenCV")
class Namespaces(Case):
    """halfiles/cell: a network namespace and a process for each node."""

    def bring_up(self, *words):
        machines, read_only = machines_elsewhere(self.folder)
        done = subprocess.run(
            [*read_only, machines / "cell/bring-up", *words],
            cwd=self.folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env={
                **self.environment,
                "HAL": str(HAL),
                "TMPDIR": str(self.folder),
                "SKIP_DEFAULT_XML_FILE": "1",
            },
            text=True,
            timeout=16 * TIMEOUT,
        )
        if done.returncode == 77 or "not to be had" in done.stdout:
            self.skipTest("no network namespaces here: " + done.stdout.strip())
        logs = "".join(
            f"--- {log.name}\n{log.read_text()}" for log in self.folder.glob("hal-cell.*/*.log")
        )
        self.assertEqual(0, done.returncode, done.stdout + logs)
        self.assertIn("all are there; the robots drive", done.stdout)
        self.assertNotIn(
            "hal-cell-",
            subprocess.run(["ip", "netns", "list"], stdout=subprocess.PIPE, text=True).stdout,
        )
        return done.stdout

    def test_each_kind_of_node_is_killed_and_a_cable_taken_out(self):
        said = self.bring_up(
            "2", "--kill", "cell", "--kill", "robot2", "--kill", "camera", "--cut", "robot1"
        )
        self.assertIn("the remaining robots have stopped; node robot2 is restarted", said)
        self.assertIn("both robots have stopped; the cable of node robot1 is reconnected", said)
        self.assertEqual(4, said.count("all nodes are online again"), said)
        self.assertIn("cell/robot2", said)

    def test_names_unexpected_words(self):
        done = subprocess.run(
            [ROOT / "halfiles/cell/bring-up", "--kill", "nobody"],
            env={**self.environment, "HAL": str(HAL)},
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        if done.returncode == 77:
            self.skipTest("no network namespaces here")
        self.assertEqual(1, done.returncode, done.stdout)
        self.assertIn(
            "there is no node 'nobody'; the nodes are: cell robot1 robot2 camera", done.stdout
        )


class Cell(Case):
    """halfiles/cell on the virtual clock."""

    def sim(self, netlist, *asked):
        return self.good(
            "sim", netlist, "--for", "15s", *(word for one in asked for word in ("-e", one))
        ).split()

    @unittest.skipUnless(HAVE_VISION, "built without OpenCV")
    def test_both_robots_follow_the_bottles_that_the_camera_sees(self):
        first, second, apart, *places = map(
            float,
            self.sim(
                ROOT / "halfiles/cell/cell.hal",
                "robot1: getp pilot.distance",
                "robot2: getp pilot.distance",
                "cell: getp apart.out",
                *(
                    f"camera: getp {pin}"
                    for pin in (
                        "eye.track-0-x",
                        "push1.sine",
                        "eye.track-0-y",
                        "push1.cosine",
                        "eye.track-1-x",
                        "push2.sine",
                        "eye.track-1-y",
                        "push2.cosine",
                    )
                ),
            ),
        )
        self.assertLess(max(first, second), 0.03)
        self.assertGreater(apart, 0.3)
        for seen, true in zip(places[::2], places[1::2]):
            self.assertAlmostEqual(true, seen, delta=0.02)

    @unittest.skipUnless(HAVE_VISION, "built without OpenCV")
    def test_without_a_bottle_no_robot_drives(self):
        for file in ("cell.hal", "field.ground"):
            self.write(
                file,
                (ROOT / "halfiles/cell" / file)
                .read_text()
                .replace("setp hall.object-1-kind 1\n", ""),
            )
        self.assertEqual(
            ["1", "FALSE", "FALSE", "0.2"],
            self.sim(
                "cell.hal",
                "camera: getp eye.count",
                "cell: getp go.out",
                "robot1: getp pilot.enable",
                "robot1: getp base.x",
            ),
        )

    @unittest.skipIf(HAVE_VISION, "OpenCV is there")
    def test_without_opencv_check_names_the_package(self):
        self.assertIn("libopencv-contrib-dev", self.bad("check", ROOT / "halfiles/cell/cell.hal"))


class Top(Case):
    def test_local_instances_without_a_network(self):
        path = self.write("a.hal", "loadrt threads name1=servo period1=1000000\n")
        machine = self.start("run", path, "--name", "alone", instance="alone")
        seen = [one for one in json.loads(self.good("top", "--json")) if one["pid"] == machine.pid]
        self.assertEqual(["alone"], [one["instance"] for one in seen])
        self.assertEqual(1_000_000, seen[0]["threads"][0]["period_ns"])
        self.assertIn("alone", self.good("top", "--once"))

    def test_nobody(self):
        self.environment["HALCYON_DDS"] = f"domain={DOMAIN}"
        self.assertEqual("[]\n", self.good("top", "--json"))

    @unittest.skipUnless(HAVE_DDS, "built without Fast DDS")
    def test_names_invalid_settings(self):
        for words, said in (
            ("domain=abc", "'domain=abc': write domain=NUMBER, 0..232"),
            ("domain", "'domain': write domain=NUMBER, 0..232"),
            ("domain=3x", "'domain=3x': write domain=NUMBER, 0..232"),
            ("domain=999", "domain=999 is outside 0..232"),
            (
                "interface=lo",
                "invalid setting 'interface=lo'; the settings are domain= interfaces= ",
            ),
            (
                "interfaces=nosuch0",
                "interfaces: unknown interface or address 'nosuch0'; this machine has lo ",
            ),
            ("security=nowhere", "security: no such folder: "),
        ):
            self.assertIn("hal top: " + said, self.bad("top", "--json", "--dds", words))


if __name__ == "__main__":
    unittest.main()
