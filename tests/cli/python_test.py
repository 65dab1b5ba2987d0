#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: python
"""Python's module hal: components, their death and their return, functions of the module, streams."""

import os
import re
import signal
import subprocess
import sys
import unittest

from harness import HAL, SERVO, Case, wait_until

MODULE = HAL.parent.parent / "python"

ECHO = """import hal, time
c = hal.component("echo")
c.newpin("in", hal.HAL_FLOAT, hal.HAL_IN)
c.newpin("out", hal.HAL_FLOAT, hal.HAL_OUT, safe=-1.0)
c.newpin("kept", hal.HAL_S32, hal.HAL_OUT)
c.newparam("gain", hal.HAL_FLOAT, hal.HAL_RW)
c.ready()
c["kept"] = 7
try:
    while True:
        c["out"] = c["in"] * c["gain"]
        time.sleep(0.002)
except KeyboardInterrupt:
    pass
"""


@unittest.skipUnless(list(MODULE.glob("hal/_core*.so")), "the module is not built")
class PythonTest(Case):
    def setUp(self):
        super().setUp()
        self.environment["PYTHONPATH"] = str(MODULE)
        self.environment["PATH"] = f"{HAL.parent}:{self.environment['PATH']}"

    def machine(self, netlist=SERVO + "start\n", *words):
        return self.start("run", "--no-picture", *words, self.write("machine.hal", netlist))

    def python(self, text, status=0):
        """Runs a program to its end; what it prints, or its errors when it must fail."""
        done = subprocess.run(
            [sys.executable, "-c", text],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            timeout=60,
        )
        self.assertEqual(status, done.returncode, done.stderr)
        return done.stdout if status == 0 else done.stderr

    def background(self, text):
        program = subprocess.Popen(
            [sys.executable, "-c", text],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(self.end, program)
        return program

    def state(self, name="echo"):
        line = next(
            (
                line
                for line in self.shell("show", "comp", name).stdout.splitlines()
                if f" {name} " in line
            ),
            "",
        )
        return line.split(None, 4)[-1] if line else ""

    def pid(self, name="echo"):
        return int(
            next(
                line
                for line in self.shell("show", "comp", name).stdout.splitlines()
                if f" {name} " in line
            ).split()[3]
        )

    def test_a_probe_gives_arrays_of_every_cycle(self):
        self.machine("loadrt siggen names=wave\n" + SERVO + "addf wave.update servo\nstart\n")
        out = self.python("""import hal
with hal.probe(["wave.sine", "adder.out", "wave.frequency", "servo.threadbeat"]) as samples:
    cycles, counts = [], []
    for rows in samples:
        assert rows.thread == "servo" and len(rows) == len(rows["wave.sine"]) == len(rows.time_ns), rows.thread
        assert set(rows["adder.out"]) == {5.0} and set(rows["wave.frequency"]) == {1.0} and "nothing" not in rows
        cycles += rows.cycle
        counts += rows["servo.threadbeat"]
        if len(cycles) >= 200:
            break
print(all(b == a + 1 for a, b in zip(counts, counts[1:])), samples.lost, samples.units["wave.frequency"])
try:
    hal.probe("adder.uot")
except hal.error as problem:
    print(problem)
""")
        self.assertEqual(
            "True 0 Hz\nunknown pin, parameter or signal 'adder.uot'; did you mean 'adder.out'?\n",
            out,
        )

    def test_a_component_from_loadusr_is_linked_like_any_other(self):
        self.write("echo.py", ECHO)
        self.machine(
            f"loadusr -W {sys.executable} echo.py\n{SERVO}setp echo.gain 2\nnet doubled echo.out => adder.in1\n".replace(
                "setp adder.in1 3\n", ""
            ).replace(
                "net total adder.out", "net total adder.out => echo.in"
            )
            + "setp adder.gain1 0.25\nstart\n"
        )
        # total = 2 + 0.25 * 2 * total has its rest at 4
        wait_until(lambda: self.value("adder.out") == "4", "the loop settles")
        self.assertEqual("ready", self.state())
        self.assertIn("echo.in", self.shell("list", "pin", "echo").stdout)
        self.assertIn("linkps echo.out  doubled", self.shell("save", "link").stdout)
        self.shell("unlinkp", "echo.out")
        self.assertIn("two-writers", self.shell("net", "total", "echo.out").stderr)
        self.assertEqual(0, self.shell("unloadusr", "echo").returncode)
        wait_until(lambda: self.state() == "", "it leaves")
        self.assertIn("no-such-pin", self.shell("getp", "echo.out").stderr)

    def test_a_dead_one_goes_to_declared_values_and_is_taken_over(self):
        self.machine()
        program = self.background(ECHO)
        wait_until(lambda: self.state() == "ready", "it is ready")
        self.assertEqual(0, self.shell("setp", "echo.gain", "3").returncode)
        self.assertEqual(0, self.shell("setp", "echo.in", "2").returncode)
        self.assertEqual(0, self.shell("net", "result", "echo.out", "adder.in1").returncode)
        wait_until(lambda: self.value("adder.in1") == "6", "it works")
        program.kill()
        wait_until(lambda: self.state().startswith("dead since "), "its death is seen")
        wait_until(lambda: self.value("adder.in1") == "-1", "the declared value")
        self.assertEqual("7", self.value("echo.kept"))
        second = self.background(ECHO)
        wait_until(
            lambda: self.state() == "ready" and self.value("adder.in1") == "6",
            "another takes its pins over, links and parameters",
        )
        second.send_signal(signal.SIGTERM)
        wait_until(lambda: self.state() == "", "SIGTERM is an end in good order")

    def test_an_exception_is_a_death_and_exit_is_not(self):
        self.machine()
        text = "import hal\nc = hal.component('echo')\nc.newpin('out', hal.HAL_BIT, hal.HAL_OUT)\nc.ready()\n"
        crashed = subprocess.run(
            [sys.executable, "-c", text + "c['nothing']"],
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.assertIn(
            "AttributeError: component 'echo' has no pin or parameter 'nothing'", crashed.stderr
        )
        wait_until(lambda: self.state().startswith("dead since "), "its death is seen")
        self.python(text)
        wait_until(lambda: self.state() == "", "it leaves at its end")

    def test_each_component_of_a_killed_program_reports_the_signal(self):
        self.write(
            "two.py",
            "import hal, time\ncomponents = [hal.component(name) for name in ('one', 'two')]\n"
            "for c in reversed(components): c.newpin('out', hal.HAL_BIT, hal.HAL_OUT), c.ready()\n"
            "while True: time.sleep(1)\n",
        )
        self.machine(SERVO + f"start\nloadusr -Wn one {sys.executable} two.py\n")
        wait_until(lambda: self.state("one") == "ready", "both are ready")
        os.kill(self.pid("two"), signal.SIGKILL)
        for name in "one", "two":
            wait_until(
                lambda: re.fullmatch(r"dead since [\d:]+ \(SIGKILL\)", self.state(name)),
                f"{name} reports the signal",
            )

    def test_restart_on_failure(self):
        self.write("echo.py", ECHO)
        self.machine(
            SERVO
            + f"start\nloadusr -W --restart=on-failure --restart-delay=50ms {sys.executable} echo.py\n"
        )
        wait_until(lambda: self.state() == "ready", "it is ready")
        first = self.pid()
        os.kill(first, signal.SIGKILL)
        wait_until(lambda: self.state() == "ready" and self.pid() != first, "it is started again")
        self.assertEqual(0, self.shell("unloadusr", "echo").returncode)
        wait_until(lambda: self.state() == "", "unloadusr ends it for good")
        self.assertIn(
            "--restart must be no, on-failure or always",
            self.shell("loadusr", "--restart=sometimes", "true").stderr,
        )

    def test_a_program_that_always_fails_is_given_up(self):
        self.machine(SERVO + "start\nloadusr --restart=on-failure --restart-delay=10ms false\n")
        wait_until(lambda: "given up" in self.state("false"), "it is given up")
        self.assertEqual(0, self.shell("unloadusr", "false").returncode)
        self.assertEqual("", self.state("false"))

    def test_the_end_of_the_instance_is_survived(self):
        machine = self.machine()
        self.background(ECHO)
        wait_until(lambda: self.state() == "ready", "it is ready")
        wait_until(lambda: self.value("echo.kept") == "7", "it has written")
        self.end(machine)
        self.machine()
        wait_until(lambda: self.state() == "ready", "it finds the new instance")
        wait_until(lambda: self.value("echo.kept") == "7", "with its values")

    def test_values_keep_their_range(self):
        self.machine()
        self.assertEqual(
            "-1 4294967295 inf True OverflowError\n",
            self.python(
                "import hal\nc = hal.component('x')\n"
                "for name, kind in (('s', hal.HAL_S32), ('u', hal.HAL_U32), ('f', hal.HAL_FLOAT), ('b', hal.HAL_BIT)): c.newpin(name, kind, hal.HAL_OUT)\n"
                "c.ready()\nc['s'] = -1; c['u'] = 0xffffffff; c['f'] = float('inf'); c.b = 1\n"
                "try: c['u'] = -1\nexcept OverflowError as e: print(c['s'], c['u'], c['f'], c.b, type(e).__name__)\n"
            ),
        )

    def test_functions_of_the_module(self):
        self.machine()
        self.assertEqual(
            "True False True\n2.0 2.0\nTrue False\nerror 9.0\n",
            self.python(
                "import hal\nprint(hal.component_exists('sum2'), hal.component_exists('nobody'), hal.component_is_ready('sum2'))\n"
                "hal.new_sig('level', hal.HAL_FLOAT); hal.set_s('level', 5.5);\n"
                "hal.connect('adder.in0', 'level')\nprint(hal.get_value('level'), hal.get_value('adder.in0'))\n"
                "print(hal.pin_has_writer('adder.out'), hal.pin_has_writer('adder.in0'))\n"
                "try: hal.set_p('adder.nothing', 1)\nexcept hal.error: hal.set_p('adder.in1', 9); print('error', hal.get_value('adder.in1'))\n"
            ),
        )

    def test_what_the_functions_return_and_raise_is_linuxcncs(self):
        self.machine()
        self.assertEqual(
            "False True False True False False False\nerror\nerror True\nerror True\nAttributeError True\nNameError True\nFalse\nmade\nb'bf' True\n",
            self.python(
                "import hal, os, sys\nsys.stderr = open(os.devnull, 'w')\nc = hal.component('x')\n"
                "print(hal.new_sig('level', hal.HAL_FLOAT), hal.new_sig('level', hal.HAL_FLOAT), hal.connect('adder.in0', 'level'), hal.connect('nothing', 'level'),\n"
                "      hal.set_s('level', 1), hal.disconnect('adder.in0'), hal.set_p('adder.in0', '2'))\n"
                "def fails(call, *kinds):\n try: call()\n except kinds[0] as e: return all(isinstance(e, kind) for kind in kinds)\n"
                "try: hal.set_p('adder.out', 1)\nexcept RuntimeError as e: print(type(e).__name__)\n"
                "print('error', fails(lambda: c.newpin('a', hal.HAL_BIT, hal.HAL_RO), hal.error, ValueError))\n"
                "print('error', fails(lambda: c.newpin('a', 99, hal.HAL_IN), hal.error, ValueError))\n"
                "c.newpin('a', hal.HAL_BIT, hal.HAL_IN)\nprint('AttributeError', fails(lambda: c.getparam('a'), AttributeError, hal.error))\n"
                "print('NameError', fails(lambda: hal.pin_has_writer('nothing'), NameError, hal.error))\n"
                "c.ready()\n"
                "try: c.newpin('b', hal.HAL_BIT, hal.HAL_IN); print('made too late')\nexcept hal.error as e: print(not str(e).startswith('Invalid argument: '))\n"
                "c.unready(); c.newpin('b', hal.HAL_BIT, hal.HAL_IN); c.ready(); print('made')\n"
                "s = hal.stream(c, hal.streamer_base + 6, 3, 'bf')\nprint(s.element_types, fails(lambda: hal.stream(c, hal.streamer_base + 7), OSError, hal.error))\n"
            ),
        )

    def test_every_access_to_a_pin_is_a_sign_of_life(self):
        self.machine()
        access = "7.0 7.0\n"  # never the safe value
        self.assertEqual(
            access * 2,
            self.python(
                "import hal, time\nc = hal.component('echo', every=0.2, timeout=0.2)\n"
                "c.newpin('out', hal.HAL_FLOAT, hal.HAL_OUT, safe=-1.0)\nport = c.newpin('port', hal.HAL_PORT, hal.HAL_OUT)\nc.ready()\n"
                "c['out'] = 7\n"
                "for access in (lambda: c['out']), port.size:\n"
                "    seen, end = [], time.monotonic() + 1.5\n"
                "    while time.monotonic() < end: access(); seen.append(hal.get_value('echo.out')); time.sleep(0.005)\n"
                "    print(min(seen), max(seen))\n"
            ),
        )

    def test_an_argument_stays_one_word(self):
        self.machine()
        attacks = [
            "1\\nsetp adder.in1 9",
            "1\\tadder.in1",
            "1 # x",
            '1"',
            "1'",
            "1\\\\",
            "$HOME",
            "[0..2]",
        ]
        self.assertEqual(
            "9.0\n" + "error\n" * len(attacks) + "3.0\n" + "True\n" * 10,
            self.python(
                "import hal, sys, os\n"
                "sys.stderr = open(os.devnull, 'w')\n"
                "hal.set_p('adder.in0', 9); print(hal.get_value('adder.in0'))\n"
                "def attack(value):\n"
                "    try: hal.set_p('adder.in0', value)\n"
                "    except hal.error: print('error')\n"
                "for value in ["
                + ", ".join(f"'{one}'" if "'" not in one else f'"{one}"' for one in attacks)
                + "]: attack(value)\n"
                "print(hal.get_value('adder.in1'))\n"
                "for name in 'a b', 'a\\nb', 'a\\tb', 'a#b', 'a$b', 'a[0]', 'a{b}', 'a\\\\', '': print(hal.new_sig(name, hal.HAL_BIT))\n"
                "print(hal.connect('adder.in1\\nunload all', 'total'))\n"
            ),
        )
        self.assertEqual(" total\n".split(), self.shell("list", "sig").stdout.split())

    def test_a_name_that_no_netlist_can_contain_is_rejected(self):
        self.machine()
        self.assertEqual(
            "'a#b' is not a valid pin name: '#' begins a comment; use letters, digits and - _ . :\n"
            "'a b' is not a valid pin name: a blank ends the word; use letters, digits and - _ . :\n"
            "'a b' is not a valid pin name: it contains a line end or another control character; use letters, digits and - _ . :\n"
            "'a[1]' is not a valid pin name: '[' begins a range or a reference to an INI file; use letters, digits and - _ . :\n"
            "'it's' is not a valid pin name: the quote ' is not closed; use letters, digits and - _ . :\n"
            "'a b' is not a valid prefix: it contains a line end or another control character; use letters, digits and - _ . :\n"
            "'a#' is not a valid name for a component; use 1 to 64 letters, digits and - _ . with no . at the beginning\n"
            "'a$' is not a valid prefix: '$' begins a variable; use letters, digits and - _ . :\n",
            self.python(
                "import hal\nc = hal.component('c')\n"
                "def fails(action):\n"
                "    try: action()\n"
                "    except hal.error as problem: print(problem)\n"
                "for name in 'a#b', 'a b', 'a\\nb', 'a[1]', \"it's\": fails(lambda: c.newpin(name, hal.HAL_BIT, hal.HAL_IN))\n"
                "fails(lambda: hal.component('a\\nb'))\n"
                "fails(lambda: hal.component('a#', 'a'))\n"
                "fails(lambda: hal.component('d', 'a$'))\n"
            ),
        )

    def test_the_writes_of_two_components_arrive_in_their_order(self):
        machine = self.machine(
            SERVO
            + "loadrt sum2\nloadrt minmax\naddf sum2.0 servo\naddf minmax.0 servo\nsetp sum2.0.gain1 -1\n"
            "net difference sum2.0.out => minmax.0.in\nstart\n"
        )
        self.python(
            "import hal, subprocess\n"
            "a, b = hal.component('a'), hal.component('b')\n"
            "b.newpin('in', hal.HAL_BIT, hal.HAL_IN)\n"
            "for c in a, b: c.newpin('x', hal.HAL_FLOAT, hal.HAL_OUT), c.ready()\n"
            "for words in (['late', 'b.x', 'sum2.0.in0'], ['early', 'a.x', 'sum2.0.in1']): subprocess.run(['halcmd', 'net'] + words, check=True)\n"
            "for i in range(1, 1001): a['x'] = i; b['x'] = i; b['in']\n"
        )  # what is read is fetched, after what was written
        self.assertEqual("0", self.value("minmax.0.max"))  # the second is never ahead of the first
        self.end(machine)

    def test_several_processes_talk_through_signals(self):
        self.machine()
        self.background(
            "import hal, time\nc = hal.component('there')\nc.newpin('in', hal.HAL_S32, hal.HAL_IN)\nc.newpin('out', hal.HAL_S32, hal.HAL_OUT)\nc.ready()\n"
            "while True:\n c['out'] = c['in'] + 1\n time.sleep(0.001)\n"
        )
        self.assertEqual(
            "done\n",
            self.python(
                "import hal, time\nc = hal.component('here')\nc.newpin('in', hal.HAL_S32, hal.HAL_IN)\nc.newpin('out', hal.HAL_S32, hal.HAL_OUT)\nc.ready()\n"
                "while not hal.component_exists('there') or not hal.component_is_ready('there'): time.sleep(0.01)\n"
                "for name, pins in (('go', ('here.out', 'there.in')), ('come', ('there.out', 'here.in'))):\n"
                " hal.new_sig(name, hal.HAL_S32)\n for pin in pins: hal.connect(pin, name)\n"
                "while c['in'] < 100:\n c['out'] = c['in']\n time.sleep(0.001)\nprint('done')\n"
            ),
        )

    def test_a_stream_between_programs(self):
        self.machine()
        self.assertEqual(
            "(True, 1.5, -3, 7) 1 None 1\nerror\n",
            self.python(
                "import hal\nc = hal.component('s')\nw = hal.stream(c, hal.streamer_base + 5, 3, 'bfsu')\nr = hal.stream(c, hal.streamer_base + 5, 'bfsu')\nc.ready()\n"
                "w.write((1, 1.5, -3, 7))\nprint(r.read(), r.sampleno, r.read(), r.num_underruns)\nw.write((0,0,0,0)); w.write((0,0,0,0)); assert not w.writable\n"
                "try: w.write((0,0,0,0))\nexcept hal.error: print('error')\n"
            ),
        )

    def test_a_stream_without_depth_or_columns_is_rejected(self):
        self.machine()
        self.assertEqual(
            "[Errno 22] invalid depth 0 of stream streamer.5; use 1 or more\n"
            "[Errno 22] invalid depth -5 of stream streamer.5; use 1 or more\n"
            "a stream needs at least one column; its types are letters of b, f, s, u, l, k\n",
            self.python(
                "import hal\nc = hal.component('s')\n"
                "for words in (0, 'f'), (-5, 'f'), (3, ''):\n"
                "    try: hal.stream(c, hal.streamer_base + 5, *words)\n"
                "    except (OSError, ValueError) as problem: print(problem)\n"
            ),
        )

    def test_a_child_process_does_not_use_its_parents_component(self):
        self.machine()
        self.assertEqual(
            "rejected\n",
            self.python(
                "import hal, os\nc = hal.component('x')\nc.newpin('a', hal.HAL_BIT, hal.HAL_OUT)\nc.ready()\n"
                "if os.fork() == 0:\n try: c['a'] = 1\n except hal.error: print('rejected', flush=True)\n os._exit(0)\nos.wait()\nassert c['a'] is False\n"
            ),
        )

    def test_a_child_process_ends_with_its_component_and_its_own_connection(self):
        self.machine()
        child = """import hal, os, sys, threading
c = hal.component('x')
c.newpin('a', hal.HAL_BIT, hal.HAL_OUT)
c.ready()
def busy():
    while True: hal.get_value('x.a'); hal.get_info_signals()
for _ in range(2): threading.Thread(target=busy, daemon=True).start()
for n in range(30):
    if os.fork() == 0:
        hal.get_value('x.a')
        sys.exit(0) if n % 2 == 0 else 1 / 0
    assert os.WEXITSTATUS(os.wait()[1]) == n % 2
c['a'] = True
print(hal.get_value('x.a'), flush=True)
os._exit(0)
"""
        self.assertEqual("True\n", self.python(child))

    def test_a_child_process_leaves_its_parents_probe_alone(self):
        self.machine()
        self.assertEqual(
            "the probe belongs to the parent process; create one of its own in the child\nrows\n",
            self.python(
                "import hal, os, sys\np = hal.probe('adder.out')\nnext(iter(p))\n"
                "if os.fork() == 0:\n try: next(iter(p))\n except hal.error as e: print(e, flush=True)\n sys.exit(0)\n"
                "os.wait()\nfor _ in range(3): rows = next(iter(p))\nprint('rows', flush=True)\n"
            ),
        )

    def test_a_successor_that_would_lose_a_link_is_rejected(self):
        self.machine()
        version = "import hal\nc = hal.component('p', timeout=60)\n{}c.ready()\nc['out'] = 7\n"
        right = version.format("c.newpin('out', hal.HAL_FLOAT, hal.HAL_OUT)\n")
        self.python(right + "import os, time\ntime.sleep(0.1)\nos._exit(1)\n", status=1)
        self.say("net", "speed", "p.out", "=>", "adder.in0")
        linked = "hal.error: pin 'p.out' is linked to signal 'speed' since the program before, and this one "
        for pin, difference in (
            (
                "c.newpin('out', hal.HAL_S32, hal.HAL_OUT)\n",
                "declares it as s32 out and not as float out",
            ),
            (
                "c.newpin('out', hal.HAL_FLOAT, hal.HAL_IN)\n",
                "declares it as float in and not as float out",
            ),
            ("", "does not declare it"),
        ):
            errors = self.python(version.format(pin), status=1)
            self.assertIn(
                f"{linked}{difference}; declare the pin as before, or type: unlinkp p.out", errors
            )
            orderly = version.replace("c.ready()", "    c.ready()\nexcept hal.error: sys.exit(0)")
            orderly = orderly.replace("{}", "import sys\ntry:\n    {}")
            self.assertEqual("", self.python(orderly.format(pin)))
            self.assertIn("<== p.out", self.say("show", "sig", "speed"))
            self.assertRegex(
                self.say("show", "comp"),
                r"(?m)^ +\d+  User  p +\d+ dead since [\d:]{8} \(it has ended before it was ready\)$",
            )
        self.assertIn("<== p.out", self.say("show", "sig", "speed"))
        self.python(right + "assert hal.get_value('speed') == 7\n")

    def test_a_program_with_busy_threads_ends_in_order(self):
        self.machine()
        program = """import hal, threading, time
c = hal.component('x')
c.newpin('a', hal.HAL_FLOAT, hal.HAL_IN)
c.ready()
def watch():
    for rows in hal.probe('adder.out', batch_ms=1): pass
def ask():
    while True: hal.get_value('adder.out'); hal.get_info_signals()
def read():
    while True:
        try: c['a']
        except hal.error: pass
for work in (watch, ask, read) * 2: threading.Thread(target=work, daemon=True).start()
time.sleep(0.3)
print('done', flush=True)
"""
        for _ in range(10):
            self.assertEqual("done\n", self.python(program))

    def test_a_program_ends_whichever_thread_imports_the_module(self):
        self.machine()
        program = """import atexit, threading
def last():  # it runs after the end of the module
    import hal
    print(hal.component_exists('sum2'), hal.get_value('adder.in1'), flush=True)
atexit.register(last)
def load():
    global hal, c
    import hal
    c = hal.component('x')
    c.newpin('a', hal.HAL_FLOAT, hal.HAL_IN)
    c.ready()
{}
print(c['a'], flush=True)
"""
        in_worker = "worker = threading.Thread(target=load)\nworker.start()\nworker.join()"
        for loads in ("load()", in_worker):
            with self.subTest(loads):
                self.assertEqual("0.0\nTrue 3.0\n", self.python(program.format(loads)))


if __name__ == "__main__":
    unittest.main()
