# SPDX-License-Identifier: MIT
"""LinuxCNC's own side: its halrun, its rtapi_app and its modules, with nothing of ours.

There is one HAL per computer, so one run at a time. LinuxCNC rejects root: then `nobody` runs it. Inputs come from LinuxCNC's streamer, filled before the
threads start, and outputs go to its sampler, so a cycle that comes late changes nothing: each cycle has its record.
"""
import os
import pwd
import shutil
import signal
import subprocess
import tempfile
from pathlib import Path

from .inventory import parse
from .runners import LETTER, PERIOD_NS, Recording, RunError, setp_text

MAX_COLUMNS = 16  # of a channel; LinuxCNC's limit is 21


def available():
    return (
        shutil.which("halrun", path="/usr/bin") is not None and Path("/usr/bin/rtapi_app").exists()
    )


class HalrunRunner:
    def __init__(self, order=()):
        self.order = order
        self.user = pwd.getpwnam("nobody") if os.getuid() == 0 else None

    def halrun(self, text, files=(), options=(), timeout=60):
        """(stdout, stderr, status, {file name: its content}) of a netlist."""
        with tempfile.TemporaryDirectory(dir="/tmp") as name:
            folder = Path(name)
            folder.joinpath("run.hal").write_text(text)
            for file, content in files:
                folder.joinpath(file).write_text(content)
            if self.user:
                for path in (folder, *folder.iterdir()):
                    os.chown(path, self.user.pw_uid, self.user.pw_gid)
            who = (
                {"user": self.user.pw_uid, "group": self.user.pw_gid, "extra_groups": []}
                if self.user
                else {}
            )
            settings = {
                "cwd": folder,
                "env": {"HOME": name, "PATH": "/usr/bin:/bin", "LANG": "C", "TMPDIR": name},
                "stdin": subprocess.DEVNULL,
                "stdout": subprocess.PIPE,
                "stderr": subprocess.PIPE,
                "text": True,
                "errors": "replace",
                **who,
            }
            halrun = ["/usr/bin/halrun", *options, "-f", "run.hal"]
            done = subprocess.Popen(halrun, start_new_session=True, **settings)
            try:
                output, errors = done.communicate(timeout=timeout)
            except subprocess.TimeoutExpired as error:
                os.killpg(done.pid, signal.SIGKILL)
                done.communicate()
                subprocess.run(["/usr/bin/halrun", "-U"], timeout=timeout, check=False, **settings)
                self.remove_shared_memory()
                raise RunError(f"LinuxCNC's halrun hangs: {error}") from error
            if done.returncode != 0:
                self.remove_shared_memory()
            left = {
                path.name: path.read_text(errors="replace")
                for path in folder.iterdir()
                if path.is_file()
            }
            return output, errors, done.returncode, left

    def remove_shared_memory(self):
        """Removes what an rtapi_app that crashed left: a segment of another size makes the next run fail."""
        if not self.user:
            return
        rows = Path("/proc/sysvipc/shm").read_text().splitlines()
        columns = rows[0].split()
        for row in rows[1:]:
            segment = dict(zip(columns, row.split()))
            if int(segment["uid"]) == self.user.pw_uid and segment["nattch"] == "0":
                subprocess.run(["ipcrm", "-m", segment["shmid"]], check=False)

    def inventory(self, variant):
        text, errors, status, _ = self.halrun(
            f"loadrt {variant}\nshow pin\nshow param\nshow funct\n"
        )
        if status != 0:
            raise RunError(errors.strip())
        return parse(text)

    def run(self, variant, inventory, stimulus, cycles):
        """Settings of the first segment only, and no parameters: they could not be read at a known cycle. Values have six decimals."""
        outputs = [
            item
            for item in inventory.pins("OUT", "I/O")
            if item.type in "bit float s32 u32".split()
        ]
        inputs = list(stimulus.streams)
        feeds = [inputs[i : i + MAX_COLUMNS] for i in range(0, len(inputs), MAX_COLUMNS)]
        tapes = [outputs[i : i + MAX_COLUMNS] for i in range(0, len(outputs), MAX_COLUMNS)]
        lines = [f"loadrt threads name1=t period1={PERIOD_NS}", f"loadrt {variant}"]
        if feeds:
            cfg = ",".join(
                "".join(LETTER[inventory.items[name].type] for name in feed) for feed in feeds
            )
            depth = ",".join([str(cycles + 10)] * len(feeds))
            lines += [f"loadrt streamer depth={depth} cfg={cfg}"] + [
                f"addf streamer.{i} t" for i in range(len(feeds))
            ]
        cfg = ",".join("".join(LETTER[item.type] for item in tape) for tape in tapes)
        depth = ",".join([str(cycles + 10)] * len(tapes))
        lines += [
            f"addf {name} t"
            for name in sorted(inventory.functions, key=lambda name: (self.rank(name), name))
        ]
        lines += [f"loadrt sampler depth={depth} cfg={cfg}"] + [
            f"addf sampler.{i} t" for i in range(len(tapes))
        ]
        lines += [
            f"net in-{k}-{i} streamer.{k}.pin.{i} => {name}"
            for k, feed in enumerate(feeds)
            for i, name in enumerate(feed)
        ]
        lines += [
            f"net out-{k}-{i} {item.name} => sampler.{k}.pin.{i}"
            for k, tape in enumerate(tapes)
            for i, item in enumerate(tape)
        ]
        signal = {
            item.name: f"out-{k}-{i}" for k, tape in enumerate(tapes) for i, item in enumerate(tape)
        }
        for name, value in stimulus.settings[0].items() if stimulus.settings else ():
            lines.append(
                f"sets {signal[name]} {setp_text(value)}"
                if name in signal
                else f"setp {name} {setp_text(value)}"
            )
        files = [
            (
                f"in{k}.txt",
                "".join(
                    " ".join(
                        repr(float(v)) if isinstance(v, float) else str(int(v))
                        for v in (stimulus.streams[name][i] for name in feed)
                    )
                    + "\n"
                    for i in range(cycles)
                ),
            )
            for k, feed in enumerate(feeds)
        ]
        lines += [f"loadusr -w halstreamer -c {k} in{k}.txt" for k in range(len(feeds))] + ["start"]
        lines += [f"loadusr -w halsampler -c {k} -n {cycles} out{k}.txt" for k in range(len(tapes))]
        _, errors, status, left = self.halrun("\n".join(lines) + "\n", files)
        if status != 0:
            raise RunError(errors.strip())
        rows = [[] for _ in range(cycles)]
        for k, tape in enumerate(tapes):
            records = [line.split() for line in left.get(f"out{k}.txt", "").splitlines()]
            if len(records) != cycles:
                raise RunError(f"{len(records)} records of sampler.{k}; {errors.strip()}")
            for row, record in zip(rows, records):
                row += [float(cell) for cell in record]
        return Recording([item.name for item in outputs], rows, {})

    def rank(self, name):
        for number, ending in enumerate(self.order):
            if name.endswith(ending):
                return number
        return len(self.order)
