# SPDX-License-Identifier: MIT
"""Runs machines live under load and edits, executes their journals again, and prints what differs.

    replay_live.py [HAL] [--seconds 60] [--random 20] [--edits 200] [--setp 1000] [--jobs 1] [--seed 1] [MACHINE...]

MACHINE is a netlist of halfiles, as canopen-axis/axis.hal; without one all of them that start on this computer. --jobs of them run side by side, each for
the time, while two processes load the CPUs, the machine is suspended for moments, values are set, signals, instances and functions
are added and removed, a component is reloaded, each bus in memory loses its cable for a moment, and a process is killed: the drive
of a random netlist, which is started again, or one that the machine has started. A random netlist also has links that send in the slots of
SCoCAN nodes of another thread, a topic of DDS, and a streamer that `hal play` feeds, where the program has these packages. The exit status is 0 when no bit of any value
differs in any cycle.
"""

import argparse
import concurrent.futures
import contextlib
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from program import ROOT, environment, program

HALFILES = ROOT / "halfiles"
WRITABLE = re.compile(r"(?m)^\s*\S+\s+(bit|float|s32|u32)\s+IN\s+\S+\s+(\S+)$")
BUSY = "while True: pass"
STARVED = re.compile(r"\[(starved|silent)-thread\]")  # of an error that rejects the netlist
# Components with inputs and outputs of type float.
PARTS = {
    "sum2": (["in0", "in1"], ["out"]),
    "mult2": (["in0", "in1"], ["out"]),
    "lowpass": (["in"], ["out"]),
    "integ": (["in"], ["out"]),
    "ddt": (["in"], ["out"]),
    "abs": (["in"], ["out"]),
    "limit1": (["in"], ["out"]),
    "delay": (["in"], ["out"]),
    "siggen": ([], ["sine", "cosine", "square"]),
}
FUNCTIONS = {"siggen": ".update"}
# The axis of a random netlist: its drive is a process of its own.
AXIS = """loadrt canopen config=axis.canopen
addf canopen.0.receive servo
addf canopen.0.transmit servo
net axis-position canopen.0.x.position-actual-value
net axis-status canopen.0.x.statusword
"""
DRIVE = """loadrt threads name1=servo period1=1000000
loadrt canopen_drive link={bus} id=2
addf canopen-drive.0.update servo
start
"""
# Links of the fast thread send in the slots of nodes of another one.
TABLE = "bitrate 1M; cycle 10ms; node clock A sync; node a A; node b A; mode 0 run; 0 sync; 2 private a 0x10A"
SLOTS = f"""loadrt scocan_sync link=sim:slots node=clock table="{TABLE}"
loadrt scocan link=sim:slots,sim:slots node=a,b table="{TABLE}"
loadrt can_traffic names=much,little link=scocan:a,scocan:b one_node=1,1 id=0x200,0x300 messages=8,2
loadrt can_receive names=from-a,from-b link=scocan:b,scocan:a id=0x201,0x301 fields=n:u32,m:u32
addf scocan-sync.0.receive servo
addf scocan.0.receive servo
addf scocan.1.receive servo
addf much.update fast
addf little.update fast
addf from-a.update fast
addf from-b.update servo
addf scocan-sync.0.transmit servo
addf scocan.0.transmit servo
addf scocan.1.transmit servo
"""
TOPIC = """loadrt dds_publish names=sent topic=replay/{domain} fields=angle:float rate=0 domain={domain}
loadrt dds_subscribe names=heard topic=replay/{domain} fields=angle:float domain={domain}
addf sent fast
addf heard servo
net played sent.angle
"""
STREAM = """loadrt streamer depth=500
loadrt sampler depth=300
addf streamer.0 servo
addf sampler.0 servo
net played streamer.0.pin.0 => sampler.0.pin.0
"""
IN_MEMORY = re.compile(r"(?<![\w/])(cane:)?sim:([\w-]+)(/[\w-]+)?")
ETHERNET = re.compile(r"loadrt (ethercat_segment|tdma)\b|^\[(ethercat|tdma)")


def random_netlist(dice, more):
    """Three threads, up to sixty instances, and links between any two of them."""
    lines = [
        "loadrt threads name1=fast period1=500000 supervise1=60s name2=servo period2=1000000 supervise2=60s "
        "name3=slow period3=7000000 supervise3=60s"
    ]
    inputs, outputs, functions = [], [], []
    for kind, (ins, outs) in PARTS.items():
        count = dice.randrange(2, 8)
        names = [f"{kind}-{n}" for n in range(count)]
        lines.append(f"loadrt {kind} names={','.join(names)}")
        for name in names:
            inputs += [f"{name}.{pin}" for pin in ins]
            outputs += [f"{name}.{pin}" for pin in outs]
            functions.append(name + FUNCTIONS.get(kind, ""))
    dice.shuffle(inputs)
    for n, pin in enumerate(outputs):
        readers = [inputs.pop() for _ in range(dice.randrange(3)) if inputs]
        lines.append(f"net n{n} {pin} {' '.join(readers)}")
    dice.shuffle(functions)
    lines += [
        f"addf {name} {dice.choice(['fast', 'servo', 'servo', 'slow'])}" for name in functions
    ]
    return "\n".join([*lines, AXIS + more + "start", ""])


def buses_in_memory(folder):
    """The names of the buses of CAN frames, and of the stations or segments of Ethernet frames."""
    can, ethernet = set(), set()
    for path in sorted(folder.iterdir()):
        if path.suffix not in (".hal", ".ini", ".canopen", ".ethercat"):
            continue
        for line in path.read_text().splitlines():
            for cane, name, station in IN_MEMORY.findall(line.split("#")[0]):
                is_ethernet = cane or path.suffix == ".ethercat" or ETHERNET.search(line)
                (ethernet if is_ethernet else can).add(name + station)
    return sorted(can), sorted(ethernet)


def programs_of(pid):
    """The process IDs of what a process has started."""
    children = Path(f"/proc/{pid}/task/{pid}/children")
    return [int(word) for word in children.read_text().split()] if children.exists() else []


class Machine:
    def __init__(self, hal, folder, netlist, ini=None):
        self.hal, self.folder = hal, folder
        self.environment = environment(hal, str(folder))
        self.words = [hal, "run", netlist, *(["-i", ini] if ini else [])]
        self.process = None
        self.drive = None
        self.happened = []
        self.cycles = self.edits = self.values = 0  # executed again

    def start_drive(self):
        """Starts drive.hal, the node of a random netlist."""
        if not (self.folder / "drive.hal").exists():
            return
        self.drive = subprocess.Popen(
            [self.hal, "run", "--name", "drive", "drive.hal"],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    def kill_node(self):
        """Kills the drive and starts another one, or kills a process that the machine has started."""
        if self.drive:
            self.drive.kill()
            self.drive.wait()
            self.start_drive()
            self.happened.append("its drive killed")
            return
        programs = programs_of(self.process.pid)
        if programs:
            name = Path(f"/proc/{programs[0]}/comm").read_text().strip()
            os.kill(programs[0], signal.SIGKILL)
            self.happened.append(f"the process {name} killed")

    def pull_cables(self, threads):
        """Cuts each bus in memory for a moment. Unloading reconnects it."""
        can, ethernet = buses_in_memory(self.folder)
        pulled = []
        for name in can:
            pulled.append(("can_faults", "can-faults", f"link=sim:{name} victim=0", "cut TRUE"))
        for name in ethernet:
            fault = "" if "/" in name else "/pulled faults=loss"
            cut = "cut TRUE" if "/" in name else "babble FALSE"
            pulled.append(("segment_faults", "segment-faults", f"link=sim:{name}{fault}", cut))
        for component, prefix, arguments, setting in pulled:
            lines = [f"loadrt {component} {arguments}", f"addf {prefix}.0.update {threads[0]}"]
            self.shell("-k", given="\n".join([*lines, f"setp {prefix}.0.{setting}", ""]))
            time.sleep(0.2)
            if self.shell("getp", f"{prefix}.0.update.time").strip():
                self.happened.append(f"{arguments.split()[0][5:]} pulled")
            self.shell("-k", given=f"unloadrt {component}\n")

    def shell(self, *words, given=None):
        return self.run("shell", *words, given=given)

    def run(self, *words, given=None, timeout=None):
        done = subprocess.run(
            [self.hal, *words],
            cwd=self.folder,
            env=self.environment,
            input=given,
            capture_output=True,
            text=True,
            timeout=timeout,
        )
        return done.stdout

    def start(self, values):
        """Returns why it does not start, or ""."""
        if not self.drive:
            self.start_drive()
        self.process = subprocess.Popen(
            [*self.words, "--journal", "run.mcap", *(["--values", "*"] if values else [])],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        runs = False
        for _ in range(100):
            if self.process.poll() is not None:
                return self.process.communicate()[1].strip() or "it has ended"
            if runs:
                return ""
            runs = bool(self.shell("show", "thread").strip())
            time.sleep(1 if runs else 0.2)  # what cannot be recorded ends it
        self.stop()
        return "it has not started in 20 s"

    def stop(self):
        if self.drive:
            self.drive.kill()
            self.drive.wait()
            self.drive = None
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        return self.process.communicate(timeout=60)[1]

    def disturb(self, options, dice):
        """Sets values, edits and suspends the machine until the time is over."""
        pins = WRITABLE.findall(self.shell("show", "pin"))
        threads = re.findall(r"(?m)^\s*\d+\s+\S+\s+(\S+)\s+\(", self.shell("show", "thread")) or [
            "servo"
        ]
        end = time.monotonic() + options.seconds
        parts = 20
        for part in range(parts):
            lines = [self.setting(dice, pins) for _ in range(options.setp // parts) if pins]
            for n in range(
                part * options.edits // parts // 4, (part + 1) * options.edits // parts // 4
            ):
                name = f"live-{n}"
                lines += [f"loadrt sum2 names={name}", f"addf {name} {dice.choice(threads)}"]
                lines += [f"net {name} {name}.out", f"delf {name}"]
            if part == parts // 2:
                lines.append("reload sum2")
            self.shell("-k", given="\n".join(lines) + "\n")
            if part == parts // 4:
                self.pull_cables(threads)
            if part == parts * 3 // 4:
                self.kill_node()
            self.feed(dice)
            if self.process.poll() is not None:
                return
            os.kill(self.process.pid, signal.SIGSTOP)
            time.sleep(dice.uniform(0.001, 0.03))
            os.kill(self.process.pid, signal.SIGCONT)
            time.sleep(max(0.0, (end - time.monotonic()) / (parts - part)))

    def feed(self, dice):
        """Plays some records, and takes some, where the netlist has a streamer and a sampler. Both may be disabled: it waits for 2 s only."""
        if not (self.folder / "random.hal").exists():
            return
        records = "".join(f"{dice.uniform(-5, 5):.4f}\n" for _ in range(dice.randrange(400)))
        for words, given in (
            (["play"], records),
            (["record", "-n", str(dice.randrange(1, 200)), "taken.txt"], None),
        ):
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.run(*words, given=given, timeout=2)

    @staticmethod
    def setting(dice, pins):
        kind, name = dice.choice(pins)
        value = {"bit": dice.choice(["TRUE", "FALSE"]), "float": f"{dice.uniform(-5, 5):.4f}"}
        return f"setp {name} {value.get(kind, dice.randrange(5))}"

    def replay(self):
        done = subprocess.run(
            [self.hal, "replay", "--exact", "run.mcap"],
            cwd=self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
        )
        return done.returncode, done.stdout, done.stderr


def verdict(name, machine, error):
    """Prints a line, and returns whether something differs; None: nothing ran."""
    status, out, err = machine.replay()
    same = re.search(r"(?m)^no difference(, (\d+) values? compared)?$", out)
    executed = re.match(r"(\d+ cycles).*?, (\d+ edits?)", out)
    if status == 0 and executed and executed[1] == "0 cycles":
        lines = [line for line in error.splitlines() if "journal" not in line]
        print(f"{name}: does not run by itself: no cycle; {lines[:1]}", flush=True)
        return None
    count = f"{executed[1]}, {executed[2]}" if executed else "nothing"
    if executed:
        machine.cycles, machine.edits = (int(one.split()[0]) for one in executed.groups())
    if status == 0 and same:
        machine.values = int(same[2] or 0)
        has_values = same[2] not in (None, "0")  # a busy disk may have lost all rows
        what = f"{same[2]} values compared" if has_values else "compared by checksums"
        happened = "".join(f", {one}" for one in machine.happened)
        print(f"{name}: {count}{happened}, {what}, 0 bits differ", flush=True)
        return False
    lines = [line for line in (out + err).splitlines() if not re.match(r"\d+ cycles", line)]
    live = [line for line in error.splitlines() if "journal" in line]
    print(f"{name}: {count}, DIFFERS: {' | '.join([*lines[:3], *live])}", flush=True)
    return True


@contextlib.contextmanager
def busy_cpus():
    """Two processes compute meanwhile."""
    busy = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(2)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


def run_one(hal, name, prepare, options):
    """Returns the machine and whether something differs; None: it does not start here."""
    for _ in range(5):
        machine, differs, is_starved = attempt(hal, name, prepare, options)
        if not is_starved:
            break
    return machine, differs


def attempt(hal, name, prepare, options):
    """As run_one, and whether a thread got no CPU time while the netlist was loaded."""
    dice = random.Random(f"{options.seed} {name}")
    with tempfile.TemporaryDirectory(prefix="hal-live-") as folder:
        folder = Path(folder)
        netlist, ini = prepare(folder, dice)
        machine = Machine(hal, netlist.parent, netlist.name, ini)
        for values in (True, False):  # too many cannot be recorded
            why = machine.start(values)
            if "--values: " not in why:
                break
        error = why
        if not why:
            try:
                machine.disturb(options, dice)
            finally:
                error = machine.stop()
        if STARVED.search(error):
            print(f"{name}: a thread had no CPU time at the start", flush=True)
            return machine, None, True
        if why:
            lines = why.splitlines()
            first = next((line for line in lines if "error" in line), lines[-1])
            print(f"{name}: does not start here: {first}", flush=True)
            return machine, None, False
        if not (machine.folder / "run.mcap").exists():
            last = (error.strip().splitlines() or ["it wrote nothing"])[-1]
            print(f"{name}: ended without a journal: {last}", flush=True)
            return machine, True, False
        differs = verdict(name, machine, error)
        if differs and options.keep:
            shutil.copytree(
                netlist.parent, Path(options.keep) / name.replace("/", "-"), dirs_exist_ok=True
            )
        return machine, differs, False


def prepare_machine(path):
    def prepare(folder, dice):
        shutil.copytree(HALFILES, folder, dirs_exist_ok=True)  # machines use files of others
        copy = folder / path.parent.name
        beside = [*copy.glob(f"{path.stem}.ini"), *sorted(copy.glob("*.ini"))]
        return copy / path.name, beside[0].name if beside else None

    return prepare


def further_parts(hal, dice):
    """The parts of a random netlist whose packages the program has."""

    def has(component):
        return subprocess.run([hal, "doc", component], capture_output=True).returncode == 0

    parts = [STREAM]
    if has("scocan"):
        parts.append(SLOTS)
    if has("dds_subscribe"):
        parts.append(TOPIC.format(domain=dice.randrange(1, 200)))
    return "".join(parts)


def prepare_random(hal):
    def prepare(folder, dice):
        group = f"239.{dice.randrange(1, 255)}.{dice.randrange(256)}.{dice.randrange(1, 255)}"
        bus = f"udp:{group}%lo:{os.getpid() % 40000 + 20000}"
        (folder / "random.hal").write_text(random_netlist(dice, further_parts(hal, dice)))
        (folder / "drive.hal").write_text(DRIVE.format(bus=bus))
        settings = (HALFILES / "canopen-axis" / "axis.canopen").read_text()
        (folder / "axis.canopen").write_text(settings.replace("sim:axis", bus))
        return folder / "random.hal", None

    return prepare


def main():
    arguments = sys.argv[1:]
    hal = program(arguments)
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for name, value in [
        ("seconds", 60.0),
        ("random", 20),
        ("edits", 200),
        ("setp", 1000),
        ("seed", 1),
        ("jobs", 1),
    ]:
        options.add_argument(f"--{name}", type=type(value), default=value)
    options.add_argument("--keep", help="folder for the journals that differ")
    options.add_argument("machines", nargs="*")
    options = options.parse_args(arguments)
    chosen = [HALFILES / name for name in options.machines]
    machines = chosen or sorted(HALFILES.glob("*/*.hal"))
    todo = [(str(path.relative_to(HALFILES)), prepare_machine(path)) for path in machines]
    todo += [(f"random {n}", prepare_random(hal)) for n in range(options.random)]
    with busy_cpus(), concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        results = list(pool.map(lambda one: run_one(hal, *one, options), todo))
    run = [machine for machine, differs in results if differs is not None]
    differing = sum(differs for _, differs in results if differs is not None)
    print(
        f"{len(run)} machines executed again, {differing} differ, {len(results) - len(run)} do not start here"
    )
    cycles, edits, values = (
        sum(getattr(one, what) for one in run) for what in ("cycles", "edits", "values")
    )
    print(f"{cycles} cycles, {edits} edits and settings, {values} values compared")
    return 1 if differing or not run else 0


if __name__ == "__main__":
    sys.exit(main())
