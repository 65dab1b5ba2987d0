# SPDX-License-Identifier: MIT
# packages: canopen tdma
"""tools/wireshark/halcyon.lua: what tshark makes of our own captures of 0x9023. Skipped where there is no tshark."""
import json
import shutil
import subprocess
import unittest

from harness import HAL, ROOT, Case

NETLIST = """loadrt threads name1=servo-thread period1=1000000
loadrt canopen config={root}/halfiles/canopen-axis/axis.canopen link=cane:sim:wire{options}
loadrt canopen_drive names=drive link=cane:sim:wire{options} id=2
loadrt segment_record link=sim:wire/recorder file=seen.pcapng
addf canopen.0.receive servo-thread
addf segment-record.0.update servo-thread
addf canopen.0.transmit servo-thread
addf drive.update servo-thread
start
advance 500ms
getp canopen.0.x.operational
getp segment-record.0.frames
"""


PINGS = """loadrt threads name1=servo-thread period1=1000000
loadrt tdma link=sim:cell/master,sim:cell/x station=master,x schedule="master:; cycle 1000; slot 0 100; slave:; name x; slot 0 300"
loadrt segment_record link=sim:cell/recorder file=seen.pcapng
addf tdma.0.receive servo-thread
addf tdma.1.receive servo-thread
addf segment-record.0.update servo-thread
addf tdma.0.transmit servo-thread
addf tdma.1.transmit servo-thread
start
advance 1s
setp tdma.0.x.ping 7
advance 10ms
setp tdma.1.master.ping 70000
advance 10ms
getp tdma.0.x.ping-held
"""


@unittest.skipUnless(shutil.which("tshark"), "no tshark; type: sudo apt install tshark")
class Dissector(Case):
    def dissect(self, options, *more):
        self.assertIn("TRUE", self.run_netlist(NETLIST.format(root=ROOT, options=options)))
        read = self.tshark(*more)
        frames = [packet["_source"]["layers"] for packet in json.loads(read)]
        self.assertGreater(len(frames), 100)
        self.assertNotIn("cane.malformed", read)
        return frames, read

    def run_netlist(self, text):
        self.write("wire.hal", text)
        done = subprocess.run(
            [HAL, "sim", "wire.hal"],
            cwd=self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=120,
        )
        self.assertEqual(0, done.returncode, done.stderr)
        return done.stdout.split()

    def tshark(self, *more):
        read = subprocess.run(
            [
                "tshark",
                "-n",
                "-X",
                f"lua_script:{ROOT}/tools/wireshark/halcyon.lua",
                *more,
                "-r",
                "seen.pcapng",
                "-T",
                "json",
                "--no-duplicate-keys",
            ],
            cwd=self.folder,
            capture_output=True,
            text=True,
            timeout=120,
            env={**self.environment, "HOME": str(self.folder)},
        )
        if "Lua: Error" in read.stderr or (read.returncode != 0 and "lua_script" in read.stderr):
            self.skipTest(read.stderr)
        self.assertEqual(0, read.returncode, read.stderr)
        return read.stdout

    @staticmethod
    def messages(frame):
        def walk(layer):
            for name, value in layer.items():
                for one in value if isinstance(value, list) else [value]:
                    if isinstance(one, dict):
                        if "cane.id" in one:
                            yield one
                        yield from walk(one)

        return list(walk(frame["cane"]))

    def functions(self, frames):
        return {m.get("cane.function") for frame in frames for m in self.messages(frame)}

    def test_pings_of_stations(self):
        held = float(self.run_netlist(PINGS)[-1])
        frames = [packet["_source"]["layers"] for packet in json.loads(self.tshark())]
        pings = [frame["tdma_ping"] for frame in frames if "tdma_ping" in frame]
        self.assertEqual(
            [("0x0020", "7"), ("0x0021", "7"), ("0x0020", "70000"), ("0x0021", "70000")],
            [(p["tdma_ping.id"], p["tdma_ping.number"]) for p in pings],
        )
        asked, answered = pings[:2]
        self.assertEqual(asked["tdma_ping.asked"], answered["tdma_ping.asked"])
        self.assertAlmostEqual(held, int(answered["tdma_ping.held"]) / 1000, places=1)
        self.assertTrue(
            any("tdma.msg" in json.dumps(frame) or "rtmac" in frame for frame in frames),
            "Wireshark's own dissector has the others",
        )

    def test_packed(self):
        frames, text = self.dissect("")
        self.assertEqual(
            {"good"},
            {frame["cane"]["cane.crc.status"] for frame in frames},
            "as the driver computes it",
        )
        self.assertGreaterEqual(
            self.functions(frames),
            {"NMT", "SYNC", "TPDO1", "RPDO1", "SDO request", "SDO answer", "heartbeat"},
        )
        for frame in frames:
            self.assertEqual(int(frame["cane"]["cane.messages"]), len(self.messages(frame)))
        nodes = {
            m.get("cane.node")
            for frame in frames
            for m in self.messages(frame)
            if m.get("cane.function") == "TPDO1"
        }
        self.assertEqual({"2"}, nodes)

    def test_signed(self):
        key = self.folder / "cell.key"
        key.write_text("000102030405060708090a0b0c0d0e0f\n")
        key.chmod(0o600)
        frames, text = self.dissect(f"?key={key}")
        self.assertEqual({"2"}, {frame["cane"]["cane.version"] for frame in frames})
        self.assertEqual({"good"}, {frame["cane"]["cane.crc.status"] for frame in frames})
        self.assertTrue(all("cane.tag" in frame["cane"] for frame in frames))

    def test_single(self):
        for order, words in (("big", ()), ("little", ("-o", "cane.order:little endian"))):
            with self.subTest(order):
                frames, text = self.dissect(f"?format=single&order={order}", *words)
                self.assertGreaterEqual(
                    self.functions(frames),
                    {"NMT", "SYNC", "TPDO1", "RPDO1", "SDO request", "SDO answer", "heartbeat"},
                )


if __name__ == "__main__":
    unittest.main()
