#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# packages: panel
"""The server of `hal panel` without a browser: HTTP and WebSockets by hand, what it must reject, what it serves."""

import json
import re
import socket
import struct
import sys
import time
import unittest
from pathlib import Path
from random import Random

from harness import SERVO, TIMEOUT, Case, wait_until
from web import PANEL, WebSocket, request, start_panel


class Panel(Case):
    def begin(self, *words, netlist=SERVO, machine=True):
        if machine:
            self.machine = self.start("run", self.write("m.hal", netlist))
        self.process, self.port, self.token = start_panel(self, *words)

    def page(self, token=None, **how):
        """A page of a browser that has sent its hello."""
        socket = WebSocket(
            self.port, origin=how.pop("origin", f"http://localhost:{self.port}"), **how
        )
        self.addCleanup(socket.close)
        self.assertTrue(socket.accepted, socket.head)
        socket.send({"hello": {"token": token} if token else {}})
        return socket

    def ask(self, socket, **body):
        self.number = getattr(self, "number", 0) + 1
        socket.send({"id": self.number, **body})
        return socket.expect(lambda m: isinstance(m, dict) and m.get("id") == self.number)

    def connected(self, token=None):
        socket = self.page(token)
        socket.expect(lambda m: m.get("event") == "machine" and m["up"])
        return socket

    def test_the_page_has_its_files_and_security_headers(self):
        self.begin(machine=False)
        status, headers, body = request(self.port)
        self.assertEqual("HTTP/1.1 200 OK", status)
        self.assertIn(b"<title>Halcyon</title>", body)
        self.assertIn("default-src 'none'", headers["content-security-policy"])
        self.assertEqual("nosniff", headers["x-content-type-options"])
        self.assertEqual("no-referrer", headers["referrer-policy"])
        self.assertEqual("no-store", headers["cache-control"])
        for path in re.findall(rb'(?:href|src)="(\w[^"]*)"', body):
            self.assertEqual("HTTP/1.1 200 OK", request(self.port, "/" + path.decode())[0], path)
        self.assertIn("javascript", request(self.port, "/app.js")[1]["content-type"])

    def test_unknown_paths_and_methods_are_rejected(self):
        self.begin(machine=False)
        for path in (
            "/nothing",
            "/../../etc/passwd",
            "/..%2f..%2fetc/passwd",
            "/app.js/",
            "/?a=%00",
        ):
            self.assertNotIn(b"root:", request(self.port, path)[2])
        self.assertEqual("HTTP/1.1 404", request(self.port, "/nothing")[0][:12])
        self.assertNotIn(
            "200",
            request(self.port, "/", method="POST", headers=["Content-Length: 2"], body=b"{}")[0],
        )

    def test_the_name_of_another_host_is_rejected(self):  # DNS rebinding
        self.begin(machine=False)
        for host in (
            "evil.example",
            "localhost.evil.example",
            f"evil.example:{self.port}",
            "127.0.0.1.evil.example",
            "192.168.1.1",
            "localhost:80x",
            "[::1",
        ):
            self.assertEqual("HTTP/1.1 421", request(self.port, host=host)[0][:12], host)
            self.assertFalse(
                WebSocket(self.port, host=host, origin=f"http://{host}").accepted, host
            )
        for host in ("localhost", "LOCALHOST", f"127.0.0.1:{self.port}"):
            self.assertEqual("HTTP/1.1 200 OK", request(self.port, host=host)[0], host)

    def test_a_page_of_another_origin_is_rejected(self):  # cross-site requests
        self.begin(machine=False)
        for origin in (
            "http://evil.example",
            "null",
            "http://localhost",
            f"https://localhost:{self.port}",
            f"http://localhost:{self.port + 1}",
            f"http://localhost:{self.port}.evil.example",
        ):
            self.assertFalse(WebSocket(self.port, origin=origin).accepted, origin)
        self.page()

    def test_other_subprotocols_are_rejected(self):
        self.begin(machine=False)
        for name in (None, "chat", "control", "http"):
            self.assertFalse(
                WebSocket(
                    self.port, origin=f"http://localhost:{self.port}", subprotocol=name
                ).accepted,
                name,
            )

    def test_values_arrive_and_are_not_writable_without_write(self):
        self.begin()
        page = self.connected()
        self.assertEqual([5.0, 2.0], self.ask(page, read=["total", "adder.in0"])["values"])
        number = self.ask(page, subscribe=["total"], every_ms=20)["subscription"]
        page.expect(
            lambda m: m.get("event") == "values"
            and m["subscription"] == number
            and m["values"] == [5.0]
        )
        self.assertEqual(
            "read-only: the panel was started without --write",
            self.ask(page, set={"adder.in0": 7})["error"],
        )
        self.assertEqual("2", self.value("adder.in0"))

    def test_setting_needs_the_token_and_control(self):
        self.begin("--write")
        viewer = self.connected()
        self.assertEqual(
            "read-only: open the address with the token that hal panel printed",
            self.ask(viewer, set={"adder.in0": 7})["error"],
        )
        viewer.send({"take": True})
        self.assertFalse(self.ask(viewer, set={"adder.in0": 7})["ok"])
        first = self.connected(self.token)
        self.assertTrue(self.ask(first, set={"adder.in0": 7})["ok"])
        self.assertEqual("7", self.value("adder.in0"))
        second = self.connected(self.token)
        self.assertEqual(
            "read-only: another page has control; take control first",
            self.ask(second, set={"adder.in0": 8})["error"],
        )
        second.send({"take": True})
        self.assertTrue(self.ask(second, set={"adder.in0": 8})["ok"])
        self.assertFalse(self.ask(first, set={"adder.in0": 9})["ok"])
        self.assertEqual("8", self.value("adder.in0"))
        viewer.expect(lambda m: m.get("event") == "log" and "adder.in0: 7 -> 8" in m["text"])
        self.assertIn("adder.in0: 2 -> 7\n", (self.folder / "panel.err").read_text())

    def test_a_wrong_token_closes_the_connection(self):
        self.begin("--write", machine=False)
        for token in ("0" * 32, "", self.token[:-1], self.token + "0"):
            page = WebSocket(self.port, origin=f"http://localhost:{self.port}")
            self.addCleanup(page.close)
            page.send({"hello": {"token": token}})
            self.assertIsNone(page.read())
            self.assertEqual((1008, "wrong token"), page.closed)

    def test_a_program_that_is_not_a_browser_needs_the_token(self):
        self.begin("--write", machine=False)
        program = self.page(origin=None)
        self.assertIsNone(program.read())
        self.assertEqual(1008, program.closed[0])
        self.assertEqual("welcome", self.page(self.token, origin=None).read()["event"])

    def test_several_machines_are_listed_to_choose_from(self):
        netlist = self.write("m.hal", SERVO)
        for name in ("left", "right"):
            self.start("run", "--name", name, netlist, loaded=False)
            wait_until(
                lambda: self.run_program("shell", "--name", name, "show", "thread").returncode == 0,
                "the machine runs",
            )
        self.begin(machine=False)
        self.assertEqual(
            "hal panel: no instance 'default' is running yet; the page shows it as soon as it runs\n"
            "hal panel: running: left, right; to show one of them, type: hal panel --name left\n",
            (self.folder / "panel.err").read_text(),
        )

    def test_the_page_learns_how_commands_are_typed(self):
        for started, typed in ((None, "hal"), ("./hal", "./hal")):
            self.environment.pop("HALCYON_STARTED_AS", None)
            if started:
                self.environment["HALCYON_STARTED_AS"] = started
            self.begin(machine=False)
            self.assertEqual(typed, self.page().read()["hal"])
        page = self.page()
        reply = self.ask(page, run="loadrt sum2")
        self.assertRegex(reply["error"], r"type: \./hal shell$")

    def test_listening_on_an_address_needs_the_token(self):
        self.begin("--listen", "127.0.0.2", machine=False)
        self.assertIsNotNone(self.token)
        page = WebSocket(
            self.port,
            origin=f"http://127.0.0.2:{self.port}",
            host=f"127.0.0.2:{self.port}",
            address="127.0.0.2",
        )
        self.addCleanup(page.close)
        page.send({"hello": {}})
        self.assertIsNone(page.read())
        self.assertEqual(1008, page.closed[0])

    def test_requests_beyond_reading_are_rejected(self):
        self.begin("--write")
        page = self.connected(self.token)
        for body in (
            {"run": ["unload", "all"]},
            {"run": "show pin"},
            {"script": "stop"},
            {"stop": True},
            {"component": "x"},
            {"exchange": "x"},
            {"options": {}},
            {"cancel": True},
            {"read": ["total"], "stop": True},
            {"read": ["total"], "set": {"adder.in0": 1}},
            {},
        ):
            reply = self.ask(page, **body)
            self.assertFalse(reply["ok"], body)
        self.assertEqual([5.0], self.ask(page, read=["total"])["values"])

    def test_invalid_and_huge_messages_close_only_their_connection(self):
        self.begin()
        good = self.connected()
        for message, code in (("[]", 1007), ("{", 1007), (b"\0\1", 1007), ("x" * 70000, 1009)):
            bad = self.connected()
            bad.send(message)
            while bad.read() is not None:
                pass
            self.assertEqual(code, bad.closed[0], message[:10])
        flood = self.connected()
        try:
            for _ in range(3000):
                flood.send({"id": 1, "read": ["total"]})
        except OSError:
            pass  # closed meanwhile
        self.assertEqual([5.0], self.ask(good, read=["total"])["values"])

    def test_a_hundred_connections_keep_nobody_out(self):
        self.begin("--write", machine=False)
        half = [
            socket.create_connection(("127.0.0.1", self.port), timeout=TIMEOUT) for _ in range(100)
        ]
        for one in half:  # headers that never end
            self.addCleanup(one.close)
            one.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\nX: ")
        self.assertEqual("HTTP/1.1 200 OK", request(self.port)[0])
        silent = [
            WebSocket(self.port, origin=f"http://localhost:{self.port}") for _ in range(100)
        ]  # without a hello
        for one in silent:
            self.addCleanup(one.close)
        self.assertEqual("HTTP/1.1 200 OK", request(self.port)[0])
        page = self.page(self.token)
        self.assertEqual("welcome", page.read()["event"])
        viewers = [self.page() for _ in range(60)]
        self.assertTrue(
            any(one.read() is None and one.closed[0] == 1013 for one in viewers)
        )  # more than are served
        page.send({"id": 5, "read": ["x"]})
        self.assertFalse(page.expect(lambda m: m.get("id") == 5)["ok"])
        descriptors = len(list(Path(f"/proc/{self.process.pid}/fd").iterdir()))
        self.assertLess(descriptors, 400)

    def test_a_frame_that_announces_gigabytes_ends_its_connection(self):
        self.begin(machine=False)
        page = self.page()
        page.expect(lambda m: m.get("event") == "welcome")
        page.socket.sendall(
            b"\x81\xff" + (1 << 40).to_bytes(8, "big") + b"\0\0\0\0" + b"x" * 100_000
        )
        while page.read() is not None:
            pass
        self.assertIn(page.closed[0], (1006, 1009))
        memory = int(
            re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{self.process.pid}/status").read_text())[1]
        )
        self.assertLess(memory, 100_000)
        self.assertEqual("HTTP/1.1 200 OK", request(self.port)[0])

    def test_random_messages_harm_only_their_connection(self):
        self.begin("--write")
        good = self.connected()
        random = Random(16)
        valid = [
            json.dumps(one)
            for one in (
                {"hello": {"token": self.token}},
                {"id": 1, "read": ["total"]},
                {"id": 2, "set": {"adder.in0": 3}},
                {"id": 3, "subscribe": ["total"], "every_ms": 20},
                {"take": True},
                {"id": 4, "probe": ["total"], "batch_ms": 20},
                {"id": 5, "run": ["show", "pin"]},
                {"panel": {"write": {"x": 1}}},
                {"release": True},
                {"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 1}]},
                {"op": "getParameters", "parameterNames": [], "id": "a"},
                {
                    "op": "setParameters",
                    "parameters": [{"name": "servo.tmax", "value": 1}],
                    "id": "b",
                },
                {"op": "subscribeConnectionGraph"},
            )
        ]
        for n in range(150):
            foxglove = n % 2
            client = WebSocket(
                self.port,
                origin=None if foxglove else f"http://localhost:{self.port}",
                **(
                    {"subprotocol": "foxglove.sdk.v1", "path": f"/?t={self.token}"}
                    if foxglove
                    else {}
                ),
            )
            self.addCleanup(client.close)
            try:
                client.send(valid[0])
                for _ in range(20):
                    text = bytearray(random.choice(valid).encode())
                    for _ in range(random.randrange(4)):
                        at = random.randrange(len(text))
                        text[at : at + random.randrange(3)] = random.choice(
                            (
                                b"",
                                b"[]",
                                b"-1",
                                b"null",
                                b'"',
                                b"{",
                                b"1e999",
                                bytes([random.randrange(256)]),
                            )
                        )
                    client.send(bytes(text), random.choice((0x81, 0x81, 0x81, 0x82)))
            except OSError:
                pass  # closed meanwhile
            client.close()
        for line in (
            b"GET  HTTP/1.1",
            b"GET / HTTP/9.9",
            b"\0" * 100,
            b"GET /" + b"a" * 20000,
            b"POST / HTTP/1.1\r\nContent-Length: -5",
            b"GET / HTTP/1.1\r\nHost: " + b"h" * 9000,
            b"OPTIONS * HTTP/1.1\r\nHost: localhost",
        ):
            with socket.create_connection(("127.0.0.1", self.port), timeout=TIMEOUT) as one:
                one.sendall(line + b"\r\n\r\n")
        self.assertIsNone(self.process.poll())
        self.assertIn("values", self.ask(good, read=["total"]))
        self.assertEqual("HTTP/1.1 200 OK", request(self.port)[0])

    def test_listen_states_what_it_exposes(self):
        self.begin(machine=False)
        done = self.run_program(
            "panel", "--listen", "127.0.0.2", "--port", "0", "--write", "--for", "50ms"
        )
        self.assertRegex(
            done.stdout,
            r"""(?s)^warning: listening on 127\.0\.0\.2, port \d+: every computer that reaches it and has the token can read all values of the machines of this user and set them\.
The connection is not encrypted: .*
http://127\.0\.0\.2:\d+/#t=[0-9a-f]{32}
programs and Foxglove: ws://127\.0\.0\.2:\d+/\?t=[0-9a-f]{32}
$""",
        )

    def test_a_client_that_does_not_read_delays_no_other(self):
        self.begin()
        lazy, good = self.connected(), self.connected()
        for _ in range(60):
            lazy.send({"id": 1, "subscribe": ["total"] * 2000, "every_ms": 10})
            time.sleep(0.005)  # below the limit of messages per second
        self.ask(good, subscribe=["servo.threadbeat"], every_ms=10)
        begun = time.monotonic()
        for _ in range(100):
            good.expect(lambda m: m.get("event") == "values")
        self.assertLess(time.monotonic() - begun, 30)
        memory = int(
            re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{self.process.pid}/status").read_text())[1]
        )
        self.assertLess(memory, 400_000)

    def test_a_killed_machine_is_reported_and_found_again(self):
        self.begin()
        page = self.connected()
        self.end(self.machine, 9)
        page.expect(lambda m: m.get("event") == "machine" and not m["up"])
        self.machine = self.start("run", self.write("m.hal", SERVO))
        page.expect(lambda m: m.get("event") == "machine" and m["up"])
        self.assertEqual([5.0], self.ask(page, read=["total"])["values"])

    def test_histograms_count_the_cycles(self):
        self.begin()
        page = self.connected()
        reply = wait_until(
            lambda: (r := self.ask(page, describe="thread", histograms=True))
            and r["histograms"]["servo"]["busy"]
            and r,
            "cycles",
        )
        pairs = reply["histograms"]["servo"]["busy"]
        self.assertGreater(sum(pairs[1::2]), 0)
        self.assertEqual(sorted(pairs[0::2]), pairs[0::2])

    def test_metrics_are_prometheus_text(self):
        self.begin()
        text = request(self.port, "/metrics")[2].decode()
        self.assertIn("halcyon_up 1\n", text)
        self.assertRegex(text, r'halcyon_thread_cycles_total\{thread="servo"\} [1-9]')
        buckets = [
            int(n)
            for n in re.findall(
                r'halcyon_thread_execution_seconds_bucket\{thread="servo",le="[^"]+"\} (\d+)', text
            )
        ]
        self.assertEqual(14, len(buckets))
        self.assertEqual(sorted(buckets), buckets)
        self.assertEqual(
            buckets[-1], int(re.search(r'execution_seconds_count\{thread="servo"\} (\d+)', text)[1])
        )
        for line in text.splitlines():
            self.assertRegex(
                line,
                r'^(# (HELP|TYPE) [a-z_]+ .+|[a-z_]+(\{[a-z]+="[^"]*"(,[a-z]+="[^"]*")*\})? [-+.e\d]+)$',
            )
        self.end(self.machine, 9)
        self.assertIn("halcyon_up 0\n", request(self.port, "/metrics")[2].decode())

    def test_a_user_panel_is_a_component_whose_outputs_need_control(self):
        self.write(
            "jog.panel",
            "component jog\ntimeout 300ms\nslider speed min=-1 max=1 safe=0 initial=0.25\nbutton go\nnumber load unit=%\ntoggle keep\n",
        )
        self.begin("jog.panel", "--write")
        wait_until(lambda: self.value("jog.speed") == "0", "the pins exist")
        self.assertIn("jog.go", self.good("shell", "list", "pin"))
        viewer, page = self.connected(), self.page(self.token)
        welcome = page.expect(lambda m: m.get("event") == "welcome")
        self.assertEqual(["go", "keep", "load", "speed"], sorted(welcome["panel"]["pins"]))
        page.expect(lambda m: m.get("event") == "control" and m["held"])
        viewer.send({"id": 1, "panel": {"write": {"speed": 1}}})
        self.assertFalse(viewer.expect(lambda m: m.get("id") == 1)["ok"])
        page.send({"panel": {"write": {"speed": 0.5, "go": True, "keep": True}}})
        page.expect(
            lambda m: m.get("event") == "log" and "safe values" in m["text"]
        )  # no further message within 300 ms
        for name, value in (("jog.speed", "0"), ("jog.go", "FALSE"), ("jog.keep", "TRUE")):
            wait_until(lambda name=name, value=value: self.value(name) == value, name)
        for name, value in (
            ("speed", "high"),
            ("speed", True),
            ("go", 1),
            ("load", 1.0),
            ("nothing", 1),
        ):
            page.send({"id": 2, "panel": {"write": {name: value}}})
            self.assertIn(f"'{name}'", page.expect(lambda m: m.get("id") == 2)["error"])
        self.good("shell", "setp", "jog.load", "42")
        viewer.expect(lambda m: m.get("event") == "panel" and m["values"].get("load") == 42)

    def test_the_loss_of_a_page_sets_safe_values(self):
        self.write("jog.panel", "component jog\ntimeout 60s\nslider speed min=-1 max=1 safe=0\n")
        self.begin("jog.panel", "--write")
        page = self.page(self.token)
        page.expect(lambda m: m.get("event") == "panel" and m["ready"])
        page.send({"panel": {"write": {"speed": 0.5}}})
        wait_until(lambda: self.value("jog.speed") == "0.5", "the value arrives")
        page.close()
        wait_until(lambda: self.value("jog.speed") == "0", "the safe value")

    def test_outputs_are_safe_until_a_page_has_control(self):
        self.write(
            "jog.panel",
            "component jog\ntimeout 60s\nslider speed min=-1 max=1 initial=0.5 safe=0.25\nslider from-five min=5 max=9\ntoggle pump safe=TRUE\ntoggle lamp initial=TRUE\n",
        )
        self.begin("jog.panel", "--write")
        wait_until(
            lambda: [self.value("jog." + pin) for pin in ("speed", "from-five", "pump", "lamp")]
            == ["0.25", "5", "TRUE", "TRUE"],
            "safe",
        )
        page = self.page(self.token)
        page.expect(lambda m: m.get("event") == "panel" and m["ready"])
        page.send({"panel": {}})
        wait_until(lambda: self.value("jog.speed") == "0.5", "the page has control")
        for pin, value in (("speed", 7), ("from-five", 6)):
            page.send({"panel": {"write": {pin: value}}})
        wait_until(lambda: self.value("jog.from-five") == "6", "the next value arrives")
        self.assertEqual("0.5", self.value("jog.speed"))

    def test_pyvcp_pins_have_their_names_types_and_directions(self):
        self.write(
            "p.xml",
            """<pyvcp><vbox><led/><rectled halpin="lamp" disable_pin="True"/><led/><number/><s32 halpin="count"/><u32/>
            <checkbutton/><checkbutton halpin="c"><initval>1</initval></checkbutton><radiobutton><choices>["one","two"]</choices></radiobutton>
            <scale><min_>100</min_><max_>0</max_><initval>50</initval></scale><spinbox halpin="s" param_pin="1"/><dial/><dial halpin="d" halparam="d-in"/>
            <jogwheel halpin="w"><clear_pin>1</clear_pin><scale_pin>1</scale_pin></jogwheel><jogwheel/><meter/><bar/><timer/><button/>
            <multilabel><legends>["A","B"]</legends></multilabel><label><text>"x"</text></label></vbox></pyvcp>""",
        )
        self.begin("p.xml")
        wait_until(lambda: self.value("pyvcp.scale.0-f") == "100", "the pins exist")
        found = self.ask(self.connected(), describe="pin", patterns=["pyvcp."])["objects"]
        pins = sorted(
            (pin["name"].removeprefix("pyvcp."), pin["type"], pin["dir"], pin["value"])
            for pin in found
        )
        self.assertEqual(
            sorted(
                [
                    ("bar.0", "float", "IN", 0.0),
                    ("button.0", "bit", "OUT", False),
                    ("c", "bit", "OUT", True),
                    ("c.changepin", "bit", "IN", False),
                    ("checkbutton.0", "bit", "OUT", False),
                    ("checkbutton.0.changepin", "bit", "IN", False),
                    ("count", "s32", "IN", 0),
                    ("d", "float", "OUT", 0.0),
                    ("d-in", "float", "IN", 0.0),
                    ("dial.0.out", "float", "OUT", 0.0),
                    ("dial.0.param_pin", "float", "IN", 0.0),
                    ("jogwheel.0.count", "float", "OUT", 0.0),
                    ("lamp", "bit", "IN", False),
                    ("lamp.disable", "bit", "IN", False),
                    ("led.0", "bit", "IN", False),
                    ("led.1", "bit", "IN", False),
                    ("meter.0.value", "float", "IN", 0.0),
                    ("multilabel.0.legend0", "bit", "IN", True),
                    ("multilabel.0.legend1", "bit", "IN", False),
                    ("number.0", "float", "IN", 0.0),
                    ("number.1", "u32", "IN", 0),
                    ("radiobutton.0.one", "bit", "OUT", True),
                    ("radiobutton.0.two", "bit", "OUT", False),
                    ("s", "float", "OUT", 0.0),
                    ("scale.0-f", "float", "OUT", 100.0),
                    ("scale.0-i", "s32", "OUT", 100),
                    ("spinbox.0.param_pin", "float", "IN", 0.0),
                    ("timer.0.reset", "bit", "IN", False),
                    ("timer.0.run", "bit", "IN", False),
                    ("w", "float", "OUT", 0.0),
                    ("w.reset", "bit", "IN", False),
                    ("w.scale", "float", "IN", 1.0),
                ]
            ),
            pins,
        )

    def test_errors_in_panels_have_their_place(
        self,
    ):  # all of them: tests/errors/panel-line, panel-element
        self.write("bad.panel", "row\n  slider speed min=5 max=1\n")
        self.assertEqual(
            """bad.panel:1:1: error: this container has no end [panel-line]
    1 | row
      | ^^^
      = help: add a line: end

bad.panel:2:16: error: min must be less than max [panel-line]
    2 |   slider speed min=5 max=1
      |                ^^^^^
hal panel: 'bad.panel' has errors
""",
            self.bad("panel", "bad.panel"),
        )
        self.write("outer.xml", '<pyvcp><include src="inner.xml"/></pyvcp>')
        self.write("inner.xml", "<pyvcp>\n<vbox><led></vbox></pyvcp>\n")
        self.assertIn(
            "inner.xml:2:14: error: invalid XML: Start-end tags mismatch [panel-element]",
            self.bad("panel", "outer.xml"),
        )

    def test_foxglove_clients_get_channels_values_and_parameters(self):
        self.begin("--write")
        for name in ("foxglove.sdk.v1", "foxglove.websocket.v1"):
            client = WebSocket(self.port, subprotocol=name, path=f"/?t={self.token}")
            self.addCleanup(client.close)
            self.assertIn(f"sec-websocket-protocol: {name}", client.head.decode().lower())
            info = client.read()
            self.assertEqual(("serverInfo", True), (info["op"], "time" in info["capabilities"]))
            channels = client.expect(
                lambda m: m.get("op") == "advertise"
                and any(c["topic"] == "/total" for c in m["channels"])
            )["channels"]
            channel = next(c for c in channels if c["topic"] == "/total")
            client.send(
                {"op": "subscribe", "subscriptions": [{"id": 7, "channelId": channel["id"]}]}
            )
            times = []
            while len(times) < 3:
                message = client.expect(lambda m: isinstance(m, bytes))
                if message[0] == 2:
                    times.append(int.from_bytes(message[1:9], "little"))
                else:
                    self.assertEqual(
                        (1, 7, times[-1], b'{"value":5}'),
                        (
                            message[0],
                            int.from_bytes(message[1:5], "little"),
                            int.from_bytes(message[5:13], "little"),
                            message[13:],
                        ),
                    )
            self.assertEqual(sorted(times), times)
            self.assertLess(abs(times[-1] / 1e9 - time.time()), 60)
        client.send({"op": "getParameters", "parameterNames": ["servo.time"], "id": "a"})
        answer = client.expect(lambda m: isinstance(m, dict) and m.get("op") == "parameterValues")
        self.assertEqual(("a", "servo.time"), (answer["id"], answer["parameters"][0]["name"]))
        bare = WebSocket(self.port, subprotocol="foxglove.sdk.v1")
        self.addCleanup(bare.close)
        self.assertIsNone(bare.read())
        self.assertEqual(1008, bare.closed[0])

    def test_a_recording_is_sent_without_a_machine_and_only_by_its_number(self):
        self.write("run.csv", "time_s,x,on\n0,1.5,1\n0.25,2.5,0\n0.5,-3,1\n")
        self.begin("--recording", "run.csv", machine=False)
        page = self.page()
        welcome = page.expect(lambda m: isinstance(m, dict) and m.get("event") == "welcome")
        (recording,) = welcome["recordings"]
        self.assertEqual(("run.csv", 0.5), (recording["name"], recording["seconds"]))
        self.assertEqual(["x", "on"], [column["name"] for column in recording["columns"]])
        reply = self.ask(page, recording=0, names=["on", "gone", "x"])
        self.assertEqual([0, 2], reply["groups"][0]["columns"])
        event = page.expect(lambda m: isinstance(m, dict) and m.get("event") == "samples")
        self.assertEqual((reply["probe"], 500_000_000), (event["probe"], event["until_ns"]))
        rows = page.expect(lambda m: isinstance(m, bytes))
        self.assertEqual(event["bytes"], len(rows))
        values = [struct.unpack_from("<Qqdd", rows, 32 * row) for row in range(3)]
        self.assertEqual(
            [(0, 0, 1.0, 1.5), (0, 250_000_000, 0.0, 2.5), (0, 500_000_000, 1.0, -3.0)], values
        )
        self.assertEqual([], recording["notes"])
        for index in (1, -1, "run.csv", None):
            self.assertEqual(
                'unknown recording; "recording" must be an index of "recordings" in "welcome"',
                self.ask(page, recording=index, names=["x"])["error"],
            )
        for names in ("x", [], [7], None, ["x"] * 101):
            self.assertEqual(
                '"names" must be an array of 1 to 100 names, as ["speed"]',
                self.ask(page, recording=0, names=names)["error"],
            )

    def recordings_of(self, *files):
        """The recordings that a page gets, and what `hal panel` prints on stderr of them."""
        words = [word for file in files for word in ("--recording", str(file))]
        self.begin(*words, machine=False)
        welcome = self.page().expect(lambda m: isinstance(m, dict) and m.get("event") == "welcome")
        errors = (self.folder / "panel.err").read_text().splitlines(True)
        return welcome["recordings"], "".join(
            line for line in errors if not re.search("default|client", line)
        )

    def test_the_missing_rows_of_a_cut_recording_are_reported(self):
        self.write("cut.csv", "time_s,x,y\n0,1,2\n1,2,3\n2,3")
        note = "'cut.csv', line 4: the line is cut off; rows after 1 s are missing, of x, y"
        (recording,), errors = self.recordings_of("cut.csv")
        self.assertEqual([note], recording["notes"])
        self.assertEqual(f"hal panel: {note}\n", errors)

    def test_recordings_with_the_same_file_name_have_different_names(self):
        text = "time_s,x\n0,1\n1,2\n"
        for folder in ("a", "b"):
            (self.folder / folder).mkdir()
            self.write(f"{folder}/run.csv", text)
        self.write("run.csv", text)
        recordings, errors = self.recordings_of("a/run.csv", "b/run.csv", "run.csv")
        self.assertEqual(
            ["run.csv", "b/run.csv", str(self.folder / "run.csv")],
            [recording["name"] for recording in recordings],
        )
        self.assertEqual("", errors)
        self.assertEqual(
            "hal panel: 'run.csv' and './run.csv' are the same file; name it once\n",
            self.bad("panel", "--recording", "run.csv", "--recording", "./run.csv"),
        )

    def test_the_address_of_each_recording_is_printed(self):
        self.write("run 1&.csv", "time_s,x\n0,1\n1,2\n")
        words = ("panel", "--port", "0", "--for", "10ms", "--recording", "run 1&.csv")
        out = self.run_program(*words).stdout
        port = re.match(r"http://localhost:(\d+)/\n", out)[1]
        self.assertIn(
            "\nrecording run 1&.csv: choose it as the source of the scope: "
            f"http://localhost:{port}/#/scope?recording=run%201%26.csv\n",
            out,
        )
        out = self.run_program(*words, "--write").stdout
        address, token = re.match(r"(http://localhost:\d+/)#t=(\w+)\n", out).groups()
        self.assertIn(f" {address}#/scope?recording=run%201%26.csv&t={token}\n", out)

    def test_a_recording_that_cannot_be_shown_is_rejected(self):
        self.assertEqual(
            "hal panel: cannot read 'none.mcap': No such file or directory\n",
            self.bad("panel", "--recording", "none.mcap"),
        )
        self.write("empty.csv", "time_s,x\n")
        self.assertEqual(
            "hal panel: 'empty.csv' has no rows: nothing was recorded; record values with: hal record FILE NAMES\n",
            self.bad("panel", "--recording", "empty.csv"),
        )

    def test_a_page_that_reads_slowly_gets_no_second_recording(self):
        rows = "".join(f"{row},{row}\n" for row in range(30000))
        self.write("long.csv", "time_s,x\n" + rows)
        self.begin("--recording", "long.csv", machine=False)
        page = self.page()
        for number in (1, 2):  # 24 MB each
            page.send({"id": number, "recording": 0, "names": ["x"] * 100})
        answer = page.expect(lambda m: isinstance(m, dict) and m.get("id") == 2)
        self.assertEqual(
            "the connection is slow: more than 1 MiB sent before has not arrived; choose the recording again in a few seconds",
            answer["error"],
        )

    def test_errors_of_the_command_line(self):
        self.assertEqual(
            "hal panel: --listen: 'here' is not an IPv4 address; use the address of a network interface, or 0.0.0.0 for all\n",
            self.bad("panel", "--listen", "here"),
        )
        self.begin(machine=False)
        self.assertIn(
            f"cannot listen on 127.0.0.1 port {self.port}: another program uses it;",
            self.bad("panel", "--port", str(self.port)),
        )
        self.assertIn(
            "this host does not have the address; to list them: ip address",
            self.bad("panel", "--port", "8123", "--listen", "192.0.2.1"),
        )
        self.assertIn("--port: '99999' is out of range", self.bad("panel", "--port", "99999"))

    def test_an_instance_that_does_not_run_is_said_to_be_awaited(self):
        self.begin(machine=False)
        self.assertEqual(
            "hal panel: no instance 'default' is running yet; the page shows it as soon as it runs\n",
            (self.folder / "panel.err").read_text(),
        )


if __name__ == "__main__":
    if not PANEL.exists():
        print("hal-panel is not built: install libwebsockets-dev and libpugixml-dev")
        sys.exit(77)
    unittest.main()
