#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: canopen panel
"""The control socket and the panel of a replayed machine: hal replay --exact FILE --panel, without a browser."""

import contextlib
import csv
import os
import pathlib
import random
import re
import struct
import sys
import unittest

from harness import SANITIZED, SERVO, Case, wait_until
from past_panel import Client, journal_edits, journal_incident, start_past, wait_for_cycles
from web import PANEL, WebSocket

SHOWN = ["show pin canopen", "show pin smooth", "show sig", "show thread", "show fault"]


@unittest.skipIf(SANITIZED, "a sanitizer has a thread, which cannot be copied")
class ReplayPanel(Case):
    def begin(self, *options, name="run.mcap"):
        self.process, self.port = start_past(self, *options, name=name)
        self.client = Client(self)
        followed = self.client.ask(moment=True)
        self.moment = followed["moment"]
        while not self.moment.get("ended"):
            self.moment = self.client.event(lambda one: one.get("event") == "moment")
        return self.client.ask(moment=True)

    def shell_in_the_past(self, lines):
        done = self.run_program(
            "replay", "--exact", "run.mcap", "--shell", given="\n".join(lines) + "\n"
        )
        return done.stdout

    def processes_of(self, leader):
        """What runs in the sessions of tests beside this program: processes with the folder of the test."""
        found = []
        for path in pathlib.Path("/proc").glob("[0-9]*"):
            with contextlib.suppress(OSError):
                is_here = os.readlink(path / "cwd") == str(self.folder.resolve())
                if is_here and int(path.name) not in (leader, os.getpid()):
                    found.append((path / "comm").read_text().strip())
        return found

    def marks(self, timeline, kind):
        return [mark for mark in timeline["timeline"]["marks"] if mark["kind"] == kind]

    def test_values_are_those_of_the_shell_at_the_same_cycle(self):
        journal_incident(self)
        self.begin()
        dice = random.Random(4)
        last = self.moment["fastest_cycle"]
        cycles = [dice.randrange(1, last) for _ in range(2)] + [1, last]
        for cycle in cycles:
            lines = [f"goto {cycle}", *SHOWN]
            texts = [self.client.run(*line.split()) for line in lines]
            self.assertEqual({0}, {status for status, _ in texts}, texts)
            self.assertEqual(self.shell_in_the_past(lines), "".join(text for _, text in texts))
        names = ["sine", "smoothed", "canopen.0.io.online", "nothing"]
        read = self.client.ask(read=names)
        number = self.client.ask(subscribe=names)["subscription"]
        event = self.client.event(lambda one: one.get("subscription") == number)
        self.assertEqual(read["values"], event["values"])
        self.client.run("step", "back", "40")
        event = self.client.event(lambda one: one.get("subscription") == number)
        self.assertEqual(self.client.ask(read=names)["values"], event["values"])
        self.assertNotEqual(read["values"], event["values"])

    def test_steps_conditions_and_faults_move_the_machine(self):
        journal_incident(self)
        timeline = self.begin()
        (fault,) = self.marks(timeline, "fault")
        self.assertIn("node 3 (io): no heartbeat", fault["text"])
        off, on = self.marks(timeline, "edit")
        self.assertEqual("setp canopen-io.0.power FALSE", off["text"])
        self.assertEqual("setp canopen-io.0.power TRUE", on["text"])
        self.assertLess(off["time_ns"], fault["time_ns"])
        self.assertLess(fault["time_ns"], on["time_ns"])
        begun, again = self.marks(timeline, "start")
        stopped = self.marks(timeline, "stop")[0]
        self.assertLess(begun["time_ns"], off["time_ns"])
        self.assertTrue(on["time_ns"] < stopped["time_ns"] < again["time_ns"])
        self.assertGreaterEqual(timeline["timeline"]["end_ns"], again["time_ns"])

        client = self.client
        self.assertEqual(0, client.run("fault", "previous")[0])
        self.assertEqual(fault["cycles"], client.ask(moment=True)["moment"]["cycles"])
        self.assertIn("no heartbeat", client.run("show", "fault")[1])
        self.assertEqual((1, "no earlier fault\n"), client.run("fault", "previous"))
        self.assertEqual((1, "no later fault\n"), client.run("fault", "next"))
        client.run("step", "back", "1")
        self.assertNotIn("no heartbeat", client.run("show", "fault")[1])
        self.assertEqual(0, client.run("fault", "next")[0])
        self.assertEqual(fault["cycles"], client.ask(moment=True)["moment"]["cycles"])

        client.run("goto", "0s")
        self.assertEqual((0, ""), client.run("break", "canopen-io.0.power", "<", "0.5"))
        status, text = client.run("continue")
        self.assertRegex(text, r"^cycle \d+ of '\w+' at \S+ s: canopen-io.0.power FALSE\n$")
        moment = client.ask(moment=True)["moment"]
        self.assertEqual(off["cycles"], moment["cycles"])
        self.assertEqual("canopen-io.0.power < 0.5", moment["condition"])
        self.assertTrue(moment["running"])
        client.run("goto", f"{stopped['time_ns']}ns")
        self.assertFalse(client.ask(moment=True)["moment"]["running"])
        self.assertEqual((0, text), client.run("reverse"))
        status, text = client.run("continue")
        self.assertIn("the journal has no further cycle", text)
        self.assertEqual(
            (
                1,
                "break: invalid condition 'sine =>'; write 'NAME > VALUE', with one "
                "of > < >= <= == !=\n",
            ),
            client.run("break", "sine", "=>"),
        )

    def test_a_step_back_passes_edits_that_execute_several_cycles(self):
        journal_edits(self)
        timeline = self.begin()
        edits = self.marks(timeline, "edit")
        self.assertEqual(6, len(edits))
        shell = ["step back"] * 12
        for edit in edits:
            self.client.run("goto", f"{edit['time_ns'] + 2_000_000}ns")
            cycles = [self.client.ask(moment=True)["moment"]["cycles"]]
            for _ in range(12):
                self.assertEqual(0, self.client.run("step", "back")[0])
                cycles.append(self.client.ask(moment=True)["moment"]["cycles"])
            self.assertTrue(all(b < a for a, b in zip(cycles, cycles[1:])), cycles)
            self.client.run("goto", f"{edit['time_ns']}ns")
            self.client.run("step", "back", "1", "servo")
            self.assertLess(self.client.ask(moment=True)["moment"]["cycles"], edit["cycles"])
            text = self.shell_in_the_past([f"goto {edit['time_ns'] + 2_000_000}ns", *shell])
            numbers = [int(number) for number in re.findall(r"(?m)^cycle (\d+) of 'servo'", text)]
            self.assertEqual(13, len(numbers), text)
            self.assertTrue(all(b < a for a, b in zip(numbers, numbers[1:])), numbers)
        count = self.client.ask(moment=True)["moment"]["edits"]
        self.client.run("goto", f"{edits[0]['time_ns'] - 20_000_000}ns")
        self.assertLess(self.client.ask(moment=True)["moment"]["edits"], count)
        self.client.run("step", str(2**64 - 1))
        self.assertTrue(self.client.ask(moment=True)["moment"]["ended"])

    def test_moves_to_faults_begin_where_the_move_before_has_ended(self):
        journal_incident(self)
        (fault,) = self.marks(self.begin(), "fault")
        moves = [["goto", "0s"], ["fault", "next"], ["goto", "1"], ["fault", "previous"]]
        replies = self.client.ask_at_once({"run": move} for move in moves)
        self.assertEqual([0, 0, 0, 1], [reply["status"] for reply in replies])
        self.assertIn(f"at {fault['time_ns'] / 1e9:.6f} s", replies[1]["out"])
        self.assertEqual("no earlier fault\n", replies[3]["err"])

    def test_a_client_that_asks_where_the_machine_is_interrupts_nothing(self):
        journal_incident(self)
        start_past(self, "--until", "400")
        client = Client(self)
        # the first execution of the journal has begun, or --until waits
        client.run("where")
        client.run("break", "sine", ">", "5")
        moment = lambda: client.ask(moment=True)["moment"]
        wait_until(lambda: moment().get("fastest_cycle") == 400, "--until is reached")
        self.assertGreater(moment()["frontier"], moment()["cycles"])

    def test_of_very_many_marks_no_fault_is_left_out(self):
        journal_incident(self, edits=10_100)
        timeline = self.begin()["timeline"]
        (fault,) = [mark for mark in timeline["marks"] if mark["kind"] == "fault"]
        self.assertEqual(10_001, len(timeline["marks"]))
        self.assertLess(100, self.moment["left_out"])
        self.client.run("goto", "0s")
        self.assertEqual(0, self.client.run("fault", "next")[0])
        self.assertEqual(fault["cycles"], self.client.ask(moment=True)["moment"]["cycles"])

    def test_of_many_gotos_the_newest_is_executed(self):
        journal_incident(self)
        self.begin()
        last = self.moment["fastest_cycle"]
        replies = self.client.ask_at_once({"run": ["goto", str(last - 5 * i)]} for i in range(60))
        replaced = [one for one in replies if one["err"] == "replaced by a newer goto\n"]
        self.assertEqual(59, len(replaced))
        self.assertEqual(0, replies[-1]["status"])
        self.assertEqual(last - 5 * 59, self.client.ask(moment=True)["moment"]["fastest_cycle"])

    def test_rows_around_a_moment_are_those_of_the_journal(self):
        journal_incident(self)
        self.run_program(
            "replay", "--exact", "run.mcap", "--record", "all.csv", "--names", "sine,smoothed"
        )
        recorded = {}
        with open(self.folder / "all.csv") as file:
            for row in csv.DictReader(line for line in file if not line.startswith("#")):
                if row.get("sine"):
                    recorded[float(row["sine"])] = row
        off = self.marks(self.begin(), "edit")[0]
        self.client.run("goto", f"{off['time_ns'] - 60_000_000}ns")
        before = self.client.ask(moment=True)["moment"]
        number = self.client.send(
            around=["sine", "smoothed", "canopen.0.io.online"], before_ms=100, after_ms=50
        )
        reply = self.client.reply(number)
        samples = self.client.event(lambda one: one.get("event") == "samples")
        self.assertEqual(reply["probe"], samples["probe"])
        self.assertEqual(["float", "float", "bit"], [one["type"] for one in reply["columns"]])
        threads = {group["thread"]: group["columns"] for group in reply["groups"]}
        self.assertEqual({"servo": [0, 2], "slow": [1]}, threads)
        words = [
            struct.unpack_from("<qqdq", samples["rows"], 32 * i)
            for i in range(samples["parts"][0]["rows"])
        ]
        # a cycle that an edit executes has no row
        steps = {after[0] - before[0] for before, after in zip(words, words[1:])}
        self.assertLessEqual(steps, {1, 2})
        self.assertGreater(len(words), 100)
        for _, time_ns, sine, online in words[1:-1]:
            self.assertIn(sine, recorded)
            self.assertTrue(-101e6 <= time_ns - before["time_ns"] <= 51e6, time_ns)
            self.assertEqual(1, online)
        after = self.client.ask(moment=True)["moment"]
        self.assertEqual(before["cycles"], after["cycles"])
        self.assertEqual(0, self.client.run("step")[0])
        self.assertEqual(before["cycles"] + 1, self.client.ask(moment=True)["moment"]["cycles"])
        unknown = self.client.ask(around=["sine", "nothing"])
        self.assertIn("nothing", unknown["error"])

    def test_rows_of_a_value_begin_when_it_is_loaded(self):
        journal_edits(self)
        loaded = self.marks(self.begin(), "edit")[0]
        self.client.run("goto", f"{loaded['time_ns'] + 30_000_000}ns")
        number = self.client.send(around=["late.out", "sine"], before_ms=80, after_ms=10)
        reply = self.client.reply(number)
        samples = self.client.event(lambda one: one.get("event") == "samples")
        self.assertEqual(["bit", "float"], [one["type"] for one in reply["columns"]])
        rows = {}
        at = 0
        for part in samples["parts"]:
            (column,) = reply["groups"][part["group"]]["columns"]
            form = "<qqq" if column == 0 else "<qqd"
            rows[column] = [
                struct.unpack_from(form, samples["rows"], at + 24 * i) for i in range(part["rows"])
            ]
            at += 24 * part["rows"]
        self.assertEqual(len(samples["rows"]), at)
        self.assertLessEqual({value for _, _, value in rows[0]}, {0, 1})
        self.assertNotEqual([], rows[0])
        self.assertTrue(all(-1 <= value <= 1 for _, _, value in rows[1]))
        begin_ns = loaded["time_ns"] - 50_000_000
        self.assertLess(abs(rows[1][0][1] - begin_ns), 5_000_000)
        self.assertGreater(rows[0][0][1], loaded["time_ns"] - 20_000_000)

    def test_the_past_cannot_be_changed(self):
        journal_incident(self)
        self.begin()
        self.client.run("goto", "500ms")
        before = self.client.ask(describe="all")
        for words in (
            ["setp", "smooth.gain", "3"],
            ["net", "new", "wave.cosine"],
            ["start"],
            ["stop"],
            ["loadrt", "sum2"],
            ["advance", "3"],
            ["unload", "smooth"],
            ["source", "other.hal"],
        ):
            status, text = self.client.run(*words)
            self.assertEqual(1, status, text)
            self.assertTrue(
                text.startswith(f"'{words[0]}' is not possible: this is a moment of the past"),
                text,
            )
        self.assertEqual((1, "unknown command '\"setp\"'\n"), self.client.run('"setp"', "x", "1"))
        self.assertEqual(1, self.client.ask(run="setp smooth.gain 3")["status"])
        for request in (
            {"set": {"smooth.gain": 3}},
            {"script": "setp smooth.gain 3\n"},
            {"component": "mine"},
            {"exchange": "mine", "write": {}},
            {"probe": ["sine"]},
        ):
            reply = self.client.ask(**request)
            self.assertFalse(reply["ok"])
            self.assertIn(f"'{next(iter(request))}' is not possible", reply["error"])
        self.assertIn("cannot be acknowledged", self.client.run("fault", "clear")[1])
        self.assertEqual({**before, "id": 0}, {**self.client.ask(describe="all"), "id": 0})
        self.assertFalse(self.client.ask(wish="sine")["ok"])
        for request, problem in (
            ({"options": {"json": "yes"}}, "json must be true or false"),
            ({"options": 1}, "options must be an object"),
            ({"subscribe": [1]}, "subscribe must be an array of names"),
            ({"unsubscribe": "a"}, "unknown subscription"),
            ({"around": {"sine": 1}}, "around must be an array of names"),
            ({"run": {"step": 1}}, "run requires a command: a line, or its words"),
        ):
            self.assertEqual(problem, self.client.ask(**request)["error"])
        self.client.socket.sendall(b"no json\n")
        self.assertFalse(self.client.reply(None)["ok"])

    def test_pages_get_the_moments_through_the_panel(self):
        journal_incident(self)
        self.begin()
        page = WebSocket(self.port, origin=f"http://localhost:{self.port}")
        page.send({"hello": {}})
        up = page.expect(lambda one: one.get("event") == "machine")
        self.assertEqual("run.mcap", up["hello"]["replay"])
        page.send({"id": 1, "moment": True})
        followed = page.expect(lambda one: one.get("id") == 1)
        self.assertEqual(self.moment["cycles"], followed["moment"]["cycles"])
        page.send({"id": 2, "run": ["goto", "400"]})
        moved = page.expect(lambda one: one.get("event") == "moment" and not one["moving"])
        self.assertEqual(400, moved["fastest_cycle"])
        self.assertEqual(400, self.client.ask(moment=True)["moment"]["fastest_cycle"])
        page.send({"id": 3, "around": ["sine"], "before_ms": 20, "after_ms": 20})
        page.expect(lambda one: one.get("id") == 3)
        samples = page.expect(lambda one: isinstance(one, dict) and one.get("event") == "samples")
        rows = page.expect(lambda one: isinstance(one, bytes))
        self.assertEqual(samples["bytes"], len(rows))
        page.send({"id": 4, "set": {"smooth.gain": 3}})
        self.assertIn("read-only", page.expect(lambda one: one.get("id") == 4)["error"])
        page.send({"id": 5, "run": ["setp", "smooth.gain", "3"]})
        self.assertFalse(page.expect(lambda one: one.get("id") == 5)["ok"])
        page.close()

    def test_a_journal_that_was_cut_off_is_shown_up_to_its_end(self):
        journal_incident(self, "--values", "sine")
        whole = (self.folder / "run.mcap").read_bytes()
        (self.folder / "cut.mcap").write_bytes(whole[: len(whole) * 6 // 10])
        timeline = self.begin(name="cut.mcap")
        self.assertFalse(timeline["timeline"]["complete"])
        self.assertIn("the file has no end", "; ".join(timeline["timeline"]["notes"]))
        end = timeline["moment"]
        self.assertTrue(end["ended"])
        self.assertNotEqual("", end["state"])
        self.client.run("step", "back", "10")
        self.assertEqual(end["cycles"] - 10, self.client.ask(moment=True)["moment"]["cycles"])
        self.client.run("step", "99")
        self.assertEqual(end["cycles"], self.client.ask(moment=True)["moment"]["cycles"])

    def test_without_keyframes_going_back_executes_the_journal_from_its_begin(self):
        netlist = SERVO + "loadrt witness file=seen.txt\naddf witness.0 servo\n"
        machine = self.start("run", self.write("a.hal", netlist), "--journal", "run.mcap")
        wait_for_cycles(self, 200)
        self.end(machine)
        self.begin("--anyway")
        self.assertIn("no keyframes", (self.folder / "past.err").read_text())
        self.assertFalse(self.moment["copied"])
        last = self.moment["fastest_cycle"]
        for cycle in (last - 20, last - 90, last - 50):
            self.assertEqual(0, self.client.run("goto", str(cycle))[0])
            moment = self.client.ask(moment=True)["moment"]
            self.assertEqual((cycle, False), (moment["fastest_cycle"], moment["copied"]))
            self.assertGreater(moment["took_ms"], 0)

    def test_no_process_remains_when_it_is_killed(self):
        journal_incident(self)
        self.begin()
        self.assertIn("hal-panel", self.processes_of(self.process.pid))
        self.process.kill()
        self.process.wait()
        wait_until(lambda: self.processes_of(self.process.pid) == [], "all its processes end")

    def test_a_moment_that_is_not_reached_again_is_left(self):
        self.write("number.txt", "5\n")
        netlist = SERVO + "loadrt gauge file=number.txt\naddf gauge.0 servo\n"
        machine = self.start("run", self.write("a.hal", netlist), "--journal", "run.mcap")
        wait_for_cycles(self, 200)
        self.end(machine)
        self.begin("--anyway")
        self.assertEqual("the journal has no further cycle\n", self.moment["state"])
        # the machine reads it again when it is executed from the begin
        self.write("number.txt", "7\n")
        self.client.ask(around=["gauge.0.out"])
        self.assertEqual([7], self.client.ask(read=["gauge.0.out"])["values"])
        moment = self.client.ask(moment=True)["moment"]
        self.assertIn("first difference: cycle", moment["state"])
        self.assertLess(moment["cycles"], self.moment["cycles"])

    def test_it_begins_at_the_given_moment_and_ends_with_its_panel(self):
        journal_incident(self)
        self.process, self.port = start_past(self, "--break", "canopen-io.0.power < 0.5")
        client = Client(self)
        client.ask(moment=True)
        power = ["canopen-io.0.power"]
        wait_until(
            lambda: client.ask(read=power)["values"] == [False]
            and not client.ask(moment=True)["moment"]["ended"],
            "the break condition holds",
        )
        client.run("step", "back")
        self.assertEqual([True], client.ask(read=power)["values"])
        self.assertIn(
            "an instance named 'replay' is already running",
            self.bad("replay", "--exact", "run.mcap", "--panel"),
        )
        self.assertIn(
            f"port {self.port}",
            self.bad(
                "replay", "--exact", "run.mcap", "--panel", "-N", "other", "-p", str(self.port)
            ),
        )
        self.assertTrue(client.ask(stop=True)["ok"])
        self.process.wait(10)
        self.assertEqual(0, self.process.returncode)
        self.assertEqual([], self.processes_of(self.process.pid))
        for words, problem in (
            (["--shell", "--panel"], "--panel excludes --shell"),
            (["--panel", "--record", "x.csv"], "--panel excludes --shell"),
            (["--name", "past"], "--name is for --panel"),
        ):
            self.assertIn(problem, self.bad("replay", "--exact", "run.mcap", *words))


if __name__ == "__main__":
    if not PANEL.exists():
        print("hal-panel is not built: install libwebsockets-dev and libpugixml-dev")
        sys.exit(77)
    unittest.main()
