# SPDX-License-Identifier: MIT
"""Random netlists for LinuxCNC's halrun and ours: what they print, which lines are errors, what `save` gives."""
import difflib
import os
import random
import re
import subprocess
import tempfile
from pathlib import Path

from .runners import RunError

# Components of a netlist: (line of loadrt, pins as (name, type, direction), parameters as (name, type, writable), functions).
PARTS = [
    (
        "loadrt and2 count=2",
        [
            (f"and2.{i}.{p}", "bit", d)
            for i in range(2)
            for p, d in (("in0", "IN"), ("in1", "IN"), ("out", "OUT"))
        ],
        [],
        ["and2.0", "and2.1"],
    ),
    (
        "loadrt or2 names=either",
        [("either.in0", "bit", "IN"), ("either.in1", "bit", "IN"), ("either.out", "bit", "OUT")],
        [],
        ["either"],
    ),
    (
        "loadrt sum2",
        [
            ("sum2.0.in0", "float", "IN"),
            ("sum2.0.in1", "float", "IN"),
            ("sum2.0.out", "float", "OUT"),
        ],
        [
            ("sum2.0.gain0", "float", True),
            ("sum2.0.gain1", "float", True),
            ("sum2.0.offset", "float", True),
        ],
        ["sum2.0"],
    ),
    (
        "loadrt mux2",
        [
            ("mux2.0.in0", "float", "IN"),
            ("mux2.0.in1", "float", "IN"),
            ("mux2.0.sel", "bit", "IN"),
            ("mux2.0.out", "float", "OUT"),
        ],
        [],
        ["mux2.0"],
    ),
    (
        "loadrt conv_float_s32",
        [
            ("conv-float-s32.0.in", "float", "IN"),
            ("conv-float-s32.0.out", "s32", "OUT"),
            ("conv-float-s32.0.out-of-range", "bit", "OUT"),
        ],
        [("conv-float-s32.0.clamp", "bit", True)],
        ["conv-float-s32.0"],
    ),
    (
        "loadrt conv_u32_s32",
        [("conv-u32-s32.0.in", "u32", "IN"), ("conv-u32-s32.0.out", "s32", "OUT")],
        [("conv-u32-s32.0.clamp", "bit", True)],
        ["conv-u32-s32.0"],
    ),
    (
        "loadrt tristate_bit",
        [
            ("tristate-bit.0.in", "bit", "IN"),
            ("tristate-bit.0.enable", "bit", "IN"),
            ("tristate-bit.0.out", "bit", "I/O"),
        ],
        [],
        ["tristate-bit.0"],
    ),
    (
        "loadrt tristate_float names=gate",
        [("gate.in", "float", "IN"), ("gate.enable", "bit", "IN"), ("gate.out", "float", "I/O")],
        [],
        ["gate"],
    ),
    (
        "loadrt updown",
        [
            ("updown.0.countup", "bit", "IN"),
            ("updown.0.countdown", "bit", "IN"),
            ("updown.0.reset", "bit", "IN"),
            ("updown.0.count", "s32", "OUT"),
        ],
        [
            ("updown.0.clamp", "bit", True),
            ("updown.0.wrap", "bit", True),
            ("updown.0.max", "s32", True),
            ("updown.0.min", "s32", True),
        ],
        ["updown.0"],
    ),
]
THREADS = [
    "loadrt threads name1=t period1=1000000",
    "loadrt threads name1=fast period1=100000 name2=slow period2=1000000",
]
VALUES = {
    "bit": ["TRUE", "FALSE", "1", "0", "true", "False", "yes", "2", "on", "-1", ""],
    "float": [
        "0",
        "1.5",
        "-2",
        "1e3",
        "0x10",
        "nan",
        "inf",
        "1e400",
        ".5",
        "5.",
        "1,5",
        "abc",
        "1e",
        "-0",
        "+3",
        "0.1234567890123",
        "1_000",
        "12abc",
    ],
    "s32": [
        "0",
        "5",
        "-7",
        "0x10",
        "010",
        "2147483647",
        "2147483648",
        "-2147483648",
        "-2147483649",
        "4294967295",
        "0xFFFFFFFF",
        "3000000000",
        "1.5",
        "1e3",
        "abc",
        "+3",
        "4294967296",
        "99999999999999999999",
    ],
    "u32": [
        "0",
        "5",
        "-1",
        "-7",
        "0x10",
        "010",
        "4294967295",
        "4294967296",
        "2147483648",
        "0xFFFFFFFF",
        "1.5",
        "abc",
        "+3",
        "-2147483648",
        "99999999999999999999",
    ],
}
TYPES = ["bit", "float", "s32", "u32"]
# Commands at the end of a netlist. What `show funct`, `list comp` and `status` print of addresses, threads and memory differs.
SHOWN = """list sig
list thread
list funct
show sig
show sig sig-a
show alias
show thread
status lock
save alias
save signal
save link
save linka
save net
save neta
save netl
save netla
save param
save thread""".splitlines()
ARROWS = ["", "", "", "=>", "<=", "<=>"]


class Generator:
    def __init__(self, seed):
        self.rng = random.Random(f"netlist:{seed}")
        parts = self.rng.sample(PARTS, self.rng.randrange(2, 6))
        self.lines = [part[0] for part in parts]
        self.lines.insert(self.rng.randrange(len(self.lines) + 1), self.rng.choice(THREADS))
        self.threads = re.findall(r"name\d=(\S+)", " ".join(self.lines))
        self.threads = [name for name in self.threads if name in ("t", "fast", "slow")]
        self.pins = [pin for part in parts for pin in part[1]]
        self.parameters = [parameter for part in parts for parameter in part[2]]
        self.functions = [name for part in parts for name in part[3]]
        self.signals = [f"sig-{c}" for c in "abcdef"]
        self.aliases = [f"alias-{c}" for c in "xyz"]

    def pin(self):
        return (
            self.rng.choice(self.aliases)
            if self.rng.random() < 0.05
            else self.rng.choice(self.pins)[0]
            if self.rng.random() < 0.97
            else "no.such.pin"
        )

    def signal(self):
        return self.rng.choice(self.signals)

    def value(self, type_=None):
        """Mostly of the type, sometimes of another."""
        return self.rng.choice(
            VALUES[type_ if type_ and self.rng.random() < 0.9 else self.rng.choice(TYPES)]
        )

    def command(self):
        rng = self.rng
        kind = rng.choices(
            [
                "newsig",
                "delsig",
                "net",
                "linkps",
                "linksp",
                "linkpp",
                "unlinkp",
                "setp",
                "sets",
                "gets",
                "getp",
                "addf",
                "delf",
                "alias",
                "unalias",
                "ptype",
                "stype",
                "lock",
                "initf",
            ],
            [6, 1, 12, 4, 3, 1, 4, 10, 8, 4, 4, 8, 3, 3, 2, 2, 2, 0, 0],
        )[0]
        if kind == "newsig":
            return f"newsig {self.signal()} {rng.choice(TYPES + ['FLOAT', 'Bit', 'int'] if rng.random() < 0.15 else TYPES)}"
        if kind in ("delsig", "gets", "stype"):
            return f"{kind} {self.signal()}"
        if kind == "net":
            wanted = rng.choice(TYPES)
            same = [pin[0] for pin in self.pins if pin[1] == wanted] or [self.pin()]
            words = []
            for _ in range(rng.randrange(1, 4)):
                words += [
                    rng.choice(ARROWS),
                    rng.choice(same) if rng.random() < 0.85 else self.pin(),
                ]
            return " ".join(["net", self.signal(), *[word for word in words if word]])
        if kind == "linkps":
            return f"linkps {self.pin()} {rng.choice(ARROWS)} {self.signal()}"
        if kind == "linksp":
            return f"linksp {self.signal()} {rng.choice(ARROWS)} {self.pin()}"
        if kind == "linkpp":
            return f"linkpp {self.pin()} {self.pin()}"
        if kind in ("unlinkp", "ptype"):
            return f"{kind} {self.pin()}"
        if kind == "getp":
            return f"getp {self.pin()}"
        if kind == "setp":
            name, type_, *_ = rng.choice(self.pins + self.parameters + self.parameters)
            return rng.choice(
                [f"setp {name} {self.value(type_)}", f"{name} = {self.value(type_)}"]
                if rng.random() < 0.1
                else [f"setp {name} {self.value(type_)}"]
            )
        if kind == "sets":
            return f"sets {self.signal()} {self.value()}"
        if kind == "addf":
            position = rng.choice(["", "", "", " 1", " -1", " 2", " -2", " 0", " 9", " x"])
            return f"addf {rng.choice(self.functions)} {rng.choice(self.threads)}{position}"
        if kind == "delf":
            return f"delf {rng.choice(self.functions)} {rng.choice(self.threads)}"
        if kind == "alias":
            if rng.random() < 0.7 or not self.parameters:
                return f"alias pin {self.pin()} {rng.choice(self.aliases)}"
            return f"alias param {rng.choice(self.parameters)[0]} {rng.choice(self.aliases)}"
        kinds = "param" if rng.random() < 0.3 else "pin"
        return f"unalias {kinds} {self.pin() if kinds == 'pin' or not self.parameters else rng.choice(self.parameters)[0]}"

    def text(self, commands=30):
        lines = self.lines + [self.command() for _ in range(commands)]
        lines += ["save", *SHOWN]
        for prefix in sorted({pin[0].split(".")[0] for pin in self.pins}):
            lines += [
                f"{command} {kind} {prefix}*"
                for command in ("list", "show")
                for kind in ("pin", "param")
            ]
        lines += [f"getp {pin[0]}" for pin in self.pins] + [
            f"getp {parameter[0]}" for parameter in self.parameters
        ]
        return "\n".join(lines) + "\n"


def normal(line):
    """A line of output without what depends on the program: widths, digits."""
    words = []
    for word in line.split():
        try:
            words.append(
                f"{float(int(word, 0)):.6g}" if not word.startswith("0x") else str(int(word, 16))
            )
        except ValueError:
            try:
                words.append(f"{float(word):.6g}")
            except ValueError:
                words.append(word)
    return " ".join(words)


LOCATED = re.compile(r"(?:\S*/)?run\.hal:(\d+):(?:\d+: error:)?\s*(.*)")
NO_SIGNAL = re.compile(r"^HAL: ERROR: signal '(\S+)' not found")


def failed_deletion(signal, netlist, first, end):
    """The number of the last `delsig` of that signal from line `first` to before `end`, or None."""
    numbers = [n for n in range(first, end) if netlist[n - 1].split() == ["delsig", signal]]
    return numbers[-1] if numbers else None


def failed_lines(errors, netlist):
    """The numbers of the lines with an error, and the message of each. Both programs print warnings as well. LinuxCNC's halcmd prints the error of
    `delsig` without a line: it is that of a `delsig` between the lines of the messages before and after it. Directly before `link failed` it is the reason
    of that one.
    """
    found, last, unlocated = {}, 0, []

    def locate(end):
        for signal, message in unlocated:
            number = failed_deletion(signal, netlist, last + 1, end)
            if number is not None:
                found.setdefault(number, message)
        unlocated.clear()

    previous = ""
    for line in errors.splitlines():
        missing = NO_SIGNAL.match(line)
        if missing:
            unlocated.append((missing.group(1), line))
        located = LOCATED.match(line)
        if located and located.group(2) == "link failed" and NO_SIGNAL.match(previous):
            unlocated.pop()
        previous = line
        if not located:
            continue
        number = int(located.group(1))
        locate(number)
        last = number
        is_warning = re.search(r"warning:|^Warning", line[located.start(1) :])
        if not is_warning and "deprecated" not in line:
            found.setdefault(number, located.group(2))
    locate(len(netlist) + 1)
    return found


def alias_of_the_other_kind(netlist, number):
    """True if an earlier line gives the alias of line `number` to a parameter instead of a pin, or the reverse."""
    _, kind, _, alias = netlist[number - 1].split()
    earlier = [line.split() for line in netlist[: number - 1]]
    return any(
        len(words) == 4 and words[0] == "alias" and words[1] != kind and words[3] == alias
        for words in earlier
    )


def names_a_pin_twice(netlist, number):
    """True if the `net` of line `number` has the same pin more than once."""
    pins = [word for word in netlist[number - 1].split()[2:] if word not in ARROWS]
    return len(set(pins)) < len(pins)


def any_netlist(_netlist, _number):
    return True


# Commands of which one side reports an error: (pattern, the side, why, and a condition on the netlist and the line's number).
# docs/linuxcnc-same-names.md has each.
ACCEPTED = [
    (
        r"net ",
        "LinuxCNC",
        "a pin that `net` names twice is linked once",
        names_a_pin_twice,
    ),
    (
        r"setp .* -?1e400$|sets .* 1e400$|.* = 1e400$",
        "ours",
        "a number beyond the range of float is an error here, infinite there",
        any_netlist,
    ),
    (
        r"(setp|sets) \S+ \d{20,}$|.* = \d{20,}$",
        "ours",
        "a number of more than 64 bits is an error here, the largest one there",
        any_netlist,
    ),
    (
        r"(setp|sets|.* =).* (yes|on|YES|ON|no|off)$",
        "LinuxCNC",
        "`yes` and `on` are bits here",
        any_netlist,
    ),
    (
        r"(un)?alias (pin|param) ",
        "LinuxCNC",
        "`alias` and `unalias` take `pin` and `param` for either",
        any_netlist,
    ),
    (
        r"alias (pin|param) ",
        "ours",
        "a pin and a parameter cannot have the same alias",
        alias_of_the_other_kind,
    ),
]


def comparable(text):
    """The lines of stdout, without times, numbers of components, and the order of what `save` sorts differently."""
    lines = [
        re.sub(r"(\.\S*)-sig(?= |$)", r"\1", normal(line))
        for line in text.splitlines()
        if line.strip()
    ]  # the signal of linkpp
    lines = [re.sub(r"^\d+ (bit|float|s32|u32) ", r"\1 ", line) for line in lines]
    return [
        line
        for line in lines
        if not re.search(r"\.(tmax|time|tmax-increased)\b", line) and "__" not in line
    ]


def run_ours(hal, text, folder):
    """(stdout, stderr, status) of our halrun."""
    folder.joinpath("run.hal").write_text(text)
    halrun = hal.parent / "halrun"
    done = subprocess.run(
        [str(halrun), "-k", "-f", "run.hal"],
        cwd=folder,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
        timeout=60,
        check=False,
        env=dict(os.environ, NO_COLOR="1", XDG_RUNTIME_DIR=str(folder)),
    )
    return done.stdout, done.stderr, done.returncode


def both(hal, linuxcnc, netlist):
    """((stdout, failed lines, status) of ours, the same of LinuxCNC's) for the lines of a netlist."""
    text = "\n".join(netlist) + "\n"
    for _ in range(3):
        output, errors, status, _ = linuxcnc.halrun(text, options=["-k"])
        if "# components" in output:  # of `save`; otherwise rtapi_app did not start
            break
    else:
        raise RunError(errors.strip() or f"status {status}")
    theirs = (output, failed_lines(errors, netlist), status)
    with tempfile.TemporaryDirectory() as folder:
        output, errors, status = run_ours(hal, text, Path(folder))
    return (output, failed_lines(errors, netlist), status), theirs


def judged(netlist, failed):
    """The failed lines up to the first one of which LinuxCNC may have done a part, or that failed on one side only: what follows may be its consequence."""
    result = set()
    for number in sorted(failed):
        result.add(number)
        if netlist[number - 1].split()[0] in ("net", "newsig", "alias", "linkpp"):
            break
    return result


def compare(hal, linuxcnc, seed, accepted):
    """Lines about one random netlist; none if both agree. A line with an error is left out of the next attempt, because LinuxCNC's halcmd may have
    done a part of the command; so the last attempt has no errors, and its output is compared as a whole.
    """
    netlist, lines = Generator(seed).text().splitlines(), []
    for _ in range(60):
        try:
            ours, theirs = both(hal, linuxcnc, netlist)
        except RunError as error:
            return [f"netlist {seed}: LinuxCNC's halrun does not run: {error}"]
        failed = judged(netlist, set(ours[1]) | set(theirs[1]))
        for number in sorted((set(ours[1]) ^ set(theirs[1])) & failed):
            side = "ours" if number in ours[1] else "LinuxCNC"
            reason = next(
                (
                    why
                    for pattern, who, why, condition in ACCEPTED
                    if who == side
                    and re.match(pattern, netlist[number - 1])
                    and condition(netlist, number)
                ),
                None,
            )
            if reason is None:
                lines.append(
                    f"netlist {seed}: {netlist[number - 1]} | error only in {side}: {ours[1].get(number) or theirs[1].get(number)}"
                )
            else:
                accepted.add(reason)
        if not failed:
            break
        netlist = [line for number, line in enumerate(netlist, 1) if number not in failed]
    if ours[2] != theirs[2]:
        lines.append(f"netlist {seed}: exit status ours {ours[2]}, LinuxCNC {theirs[2]}")
    a, b = comparable(theirs[0]), comparable(ours[0])
    if a != b:
        lines += [
            f"netlist {seed}: output {line}"
            for line in difflib.unified_diff(a, b, "LinuxCNC", "ours", lineterm="", n=0)
        ]
        lines += [f"    {line}" for line in netlist if not line.startswith("getp")]
    return lines
