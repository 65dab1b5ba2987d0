# SPDX-License-Identifier: MIT
"""Shared by the DDS tests: machines on a domain of their own, and rogue, a program that misbehaves on a topic."""
import os
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "cli"))
from harness import HAL, SANITIZED, Case, wait_until  # noqa: E402, F401
from own_network import dds_domain, own_network  # noqa: E402, F401

ROGUE = Path(os.environ.get("DDS_ROGUE") or HAL.parent / "dds_rogue")
DOMAIN = dds_domain()  # in a network of its own

PUBLISH = """loadrt threads name1=servo period1=1000000
loadrt dds_publish names=pub topic=arm/state fields=angle:float,ready:bit,count:s32*2 rate=200 {more}
setp pub.angle {angle}
setp pub.ready 1
setp pub.count-1 -5
addf pub servo
"""
SUBSCRIBE = """loadrt threads name1=servo period1=1000000
loadrt dds_subscribe names=sub topic=arm/state fields={fields} {more}
addf sub servo
"""
FIELDS = "angle:float=-1,ready:bit=0,count:s32*2"


class DdsCase(Case):
    def setUp(self):
        super().setUp()
        # Fast DDS 2.9 never frees the keys of a handshake that is rejected or aborted.
        self.environment["LSAN_OPTIONS"] = "print_suppressions=0:suppressions=" + self.write(
            "known-leaks", "leak:libcrypto\n"
        )
        self.environment["ASAN_OPTIONS"] = ":".join(
            filter(None, [os.environ.get("ASAN_OPTIONS"), "new_delete_type_mismatch=0"])
        )
        if os.environ.get("HALCYON_PLUGIN_PATH"):
            self.environment["HALCYON_PLUGIN_PATH"] = os.environ["HALCYON_PLUGIN_PATH"]

    def machine(self, instance, netlist, *options):
        """Starts a machine; words(instance) returns its standard error."""
        self.write(instance + ".hal", netlist)
        log = open(self.folder / (instance + ".log"), "a")
        self.addCleanup(log.close)
        process = subprocess.Popen(
            ["hal", "run", "--name", instance, instance + ".hal", *options],
            executable=str(HAL),
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=log,
        )
        self.addCleanup(self.end_quietly, process)

        def runs():
            self.assertIsNone(process.poll(), "it ended: " + self.words(instance))
            return self.value("servo.threadbeat", instance) not in ("", "0")

        wait_until(runs, "the machine runs")
        return process

    def end_quietly(self, process):
        if process.poll() is None:
            process.terminate()
        process.wait(60)

    def words(self, instance):
        return (self.folder / (instance + ".log")).read_text()

    def publisher(self, angle=1.5, more=""):
        return self.machine(
            "publisher", PUBLISH.format(angle=angle, more=f"domain={DOMAIN} {more}")
        )

    def subscriber(self, fields=FIELDS, more="timeout_ms=1000"):
        return self.machine(
            "subscriber", SUBSCRIBE.format(fields=fields, more=f"domain={DOMAIN} {more}")
        )

    def becomes(self, pin, value, instance="subscriber"):
        wait_until(lambda: self.value(pin, instance) == value, f"{instance}: {pin} is {value}")

    def shows(self, *values):
        """Waits for the subscriber's pins to have these values: on a busy machine samples may be late and the pins invalid for a moment."""
        for pin, value in zip(("angle", "ready", "count-0", "count-1"), values):
            self.becomes("sub." + pin, value)

    def prints(self, text, instance="subscriber"):
        wait_until(lambda: text in self.words(instance), f"{instance} prints '{text}'")

    def rogue(
        self, *words, fields="angle:float,ready:bit,count:s32*2", topic="arm/state", domain=DOMAIN
    ):
        """Starts a program on the topic that runs until its input ends."""
        process = subprocess.Popen(
            [str(ROGUE), topic, fields, f"domain={domain}", *words],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(self.end_rogue, process)
        return process

    def reads_a_sample(self, rogue):
        """Returns the line of the first sample that a listening rogue receives."""
        while (line := rogue.stdout.readline()) and not line.startswith("sample"):
            pass
        self.assertTrue(line, "it ended without a sample")
        return line

    def end_rogue(self, process):
        """Ends it and returns its whole output."""
        if process.stdin.closed:
            return "", ""
        out = process.communicate(timeout=120)
        self.assertEqual(0, process.returncode, out)
        return out
