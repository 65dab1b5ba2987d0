# SPDX-License-Identifier: MIT
"""What the tests of DDS share: machines on a domain of their own, strangers, certificates."""
import os
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "cli"))
from harness import HAL, Case, wait_until  # noqa: E402, F401
from own_network import dds_domain, own_network  # noqa: E402, F401

STRANGER = Path(os.environ.get("DDS_STRANGER") or HAL.parent / "dds_stranger")
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
        # Fast DDS 2.9 never frees the keys of a handshake that is refused or ends half-way.
        self.environment["LSAN_OPTIONS"] = "print_suppressions=0:suppressions=" + self.write("known-leaks", "leak:libcrypto\n")
        self.environment["ASAN_OPTIONS"] = ":".join(filter(None, [os.environ.get("ASAN_OPTIONS"), "new_delete_type_mismatch=0"]))
        if os.environ.get("HALCYON_PLUGIN_PATH"):
            self.environment["HALCYON_PLUGIN_PATH"] = os.environ["HALCYON_PLUGIN_PATH"]
        self.said = {}

    def machine(self, instance, netlist):
        """A machine that runs; what it says on standard error is in said(instance)."""
        self.write(instance + ".hal", netlist)
        log = open(self.folder / (instance + ".log"), "a")
        self.addCleanup(log.close)
        process = subprocess.Popen(["hal", "run", "--name", instance, instance + ".hal"], executable=str(HAL), cwd=self.folder, env=self.environment,
                                   stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=log)
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
        return self.machine("publisher", PUBLISH.format(angle=angle, more=f"domain={DOMAIN} {more}"))

    def subscriber(self, fields=FIELDS, more="timeout_ms=1000"):
        return self.machine("subscriber", SUBSCRIBE.format(fields=fields, more=f"domain={DOMAIN} {more}"))

    def becomes(self, pin, value, instance="subscriber"):
        wait_until(lambda: self.value(pin, instance) == value, f"{instance}: {pin} is {value}")

    def shows(self, *values):
        """The subscriber's pins become valid with these values: on a busy machine samples may be late, and what was valid is not for a while."""
        for pin, value in zip(("angle", "ready", "count-0", "count-1"), values):
            self.becomes("sub." + pin, value)

    def says(self, text, instance="subscriber"):
        wait_until(lambda: text in self.words(instance), f"{instance} says '{text}'")

    def stranger(self, *words, fields="angle:float,ready:bit,count:s32*2", topic="arm/state", domain=DOMAIN):
        """A program on the topic until its input ends."""
        process = subprocess.Popen([str(STRANGER), topic, fields, f"domain={domain}", *words], cwd=self.folder, env=self.environment,
                                   stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.end_stranger, process)
        return process

    def reads_a_sample(self, stranger):
        """The line of the first sample that one reads who listens."""
        while (line := stranger.stdout.readline()) and not line.startswith("sample"):
            pass
        self.assertTrue(line, "it ended without a sample")
        return line

    def end_stranger(self, process):
        """Its whole output."""
        if process.stdin.closed:
            return "", ""
        out = process.communicate(timeout=120)
        self.assertEqual(0, process.returncode, out)
        return out
