# SPDX-License-Identifier: MIT
"""What the tests of `hal replay --exact --panel` share: a journal with an incident, and its panel."""

import json
import re
import socket
import subprocess

from harness import HAL, TIMEOUT, wait_until

# The station of a CANopen bus is switched off and on again: a fault between two edits.
BUS = "[bus]\nlink = sim:panel\nbitrate = 1M\n[node 3 io]\ndevice = cia401\nheartbeat = 50ms\n"
INCIDENT = """loadrt threads name1=servo period1=1000000 name2=slow period2=5000000
loadrt canopen config=bus.canopen
loadrt canopen_io link=sim:panel id=3 inputs=8 outputs=8
loadrt siggen names=wave
loadrt lowpass names=smooth
setp wave.frequency 3
setp smooth.gain 0.2
addf canopen.0.receive servo
addf wave.update servo
addf canopen.0.transmit servo
addf canopen-io.0.update servo
addf smooth slow
net sine wave.sine => smooth.in
net smoothed smooth.out
start
"""


def wait_for_cycles(case, count):
    start = int(case.shell("getp", "servo.threadbeat").stdout)
    wait_until(
        lambda: int(case.shell("getp", "servo.threadbeat").stdout) >= start + count,
        f"{count} cycles",
    )


def journal_incident(case, *options, edits=0):
    """Writes run.mcap: a machine that is edited so often, whose station is lost, and that is stopped and started."""
    case.write("bus.canopen", BUS)
    machine = case.start("run", case.write("m.hal", INCIDENT), "--journal", "run.mcap", *options)
    wait_until(
        lambda: case.shell("getp", "canopen.0.io.operational").stdout.strip() == "TRUE",
        "the station is operational",
    )
    wait_for_cycles(case, 300)
    if edits > 0:
        case.good("shell", given="".join(f"setp smooth.gain {i}e-5\n" for i in range(edits)))
    case.good("shell", "setp", "canopen-io.0.power", "FALSE")
    wait_until(
        lambda: case.shell("getp", "canopen.0.io.online").stdout.strip() == "FALSE",
        "the station is lost",
    )
    wait_for_cycles(case, 200)
    case.good("shell", "setp", "canopen-io.0.power", "TRUE")
    wait_for_cycles(case, 200)
    case.good("shell", "stop")
    wait_for_cycles(case, 100)
    case.good("shell", "start")
    wait_for_cycles(case, 100)
    case.end(machine)
    case.assertEqual(0, machine.returncode)


# A machine whose instances change while it runs.
EDITED = """loadrt threads name1=servo period1=1000000
loadrt siggen names=wave
addf wave.update servo
net sine wave.sine
start
"""


def journal_edits(case):
    """Writes run.mcap: an instance is loaded, a second one is loaded and unloaded."""
    machine = case.start("run", case.write("m.hal", EDITED), "--journal", "run.mcap")
    wait_for_cycles(case, 200)
    for lines in (
        ["loadrt not names=late", "addf late servo", "net later late.out"],
        ["loadrt sum2 names=short", "addf short servo"],
        ["unloadrt short"],
    ):
        case.good("shell", given="\n".join(lines) + "\n")
        wait_for_cycles(case, 100)
    case.end(machine)
    case.assertEqual(0, machine.returncode)


def start_past(case, *options, name="run.mcap"):
    """Starts the panel on a journal; (process, port)."""
    with open(case.folder / "past.err", "w") as errors:
        process = subprocess.Popen(
            ["hal", "replay", "--exact", name, "--panel", "--port", "0", *map(str, options)],
            executable=str(HAL),
            cwd=case.folder,
            env=case.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
        )
    case.addCleanup(case.end, process)
    for line in process.stdout:
        if found := re.match(r"http://[^/]*?:(\d+)/", line):
            return process, int(found[1])
    raise AssertionError((case.folder / "past.err").read_text())


class Client:
    """A client of the control socket of the replayed machine."""

    def __init__(self, case, instance="replay"):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(2 * TIMEOUT)
        self.socket.connect(str(case.folder / "halcyon" / f"{instance}.sock"))
        case.addCleanup(self.socket.close)
        self.stream = self.socket.makefile("rb")
        self.number, self.events, self.replies = 0, [], {}
        self.hello = self.read()

    def read(self):
        line = self.stream.readline()
        if not line:
            raise AssertionError("the connection has ended")
        message = json.loads(line)
        if message.get("event") == "samples":
            message["rows"] = self.stream.read(message["bytes"])
        return message

    def send(self, **request):
        self.number += 1
        self.socket.sendall((json.dumps({"id": self.number, **request}) + "\n").encode())
        return self.number

    def reply(self, number):
        """The reply to a request; others, which may come before it, are kept."""
        while number not in self.replies:
            message = self.read()
            if "event" in message:
                self.events.append(message)
            else:
                self.replies[message["id"]] = message
        return self.replies.pop(number)

    def ask(self, **request):
        return self.reply(self.send(**request))

    def ask_at_once(self, requests):
        """Sends all requests in one piece; their replies."""
        first = self.number + 1
        lines = [json.dumps({"id": first + i, **request}) for i, request in enumerate(requests)]
        self.number += len(lines)
        self.socket.sendall("".join(line + "\n" for line in lines).encode())
        return [self.reply(number) for number in range(first, self.number + 1)]

    def run(self, *words):
        reply = self.ask(run=list(words))
        return reply["status"], reply["out"] + reply["err"]

    def event(self, wanted):
        """Reads until an event satisfies wanted(event), which is returned."""
        while not wanted(event := self.events.pop(0) if self.events else self.read()):
            pass
        return event
