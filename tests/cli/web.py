# SPDX-License-Identifier: MIT
"""HTTP and WebSockets by hand, and a browser over its DevTools protocol."""
import base64
import json
import os
import re
import shutil
import signal
import socket
import struct
import subprocess
import time
from urllib.parse import urlparse

from harness import HAL, TIMEOUT, wait_until

PANEL = HAL.with_name("hal-panel")
SUBPROTOCOL = "halcyon.panel.v1"


def complete(data):
    """True when an HTTP answer has all bytes that its header announces."""
    head, end, body = data.partition(b"\r\n\r\n")
    length = re.search(rb"\r\ncontent-length: *(\d+)", head, re.I)
    return bool(end and length and len(body) >= int(length[1]))


def request(port, path="/", host=None, method="GET", headers=(), body=b""):
    """One HTTP request; status line, headers as a dict, body. An empty status: closed without an answer."""
    with socket.create_connection(("127.0.0.1", port), timeout=TIMEOUT) as connection:
        lines = [
            f"{method} {path} HTTP/1.1",
            f"Host: {host or f'localhost:{port}'}",
            "Connection: close",
            *headers,
        ]
        connection.sendall("\r\n".join(lines).encode() + b"\r\n\r\n" + body)
        data = b""
        try:
            while not complete(data) and (part := connection.recv(65536)):
                data += part
        except ConnectionError:
            pass
    head, _, rest = data.partition(b"\r\n\r\n")
    status, _, fields = head.decode(errors="replace").partition("\r\n")
    return (
        status,
        dict(line.lower().split(": ", 1) for line in fields.split("\r\n") if ": " in line),
        rest,
    )


class WebSocket:
    """A client of RFC 6455: text and binary messages in one piece."""

    def __init__(
        self, port, origin=None, host=None, subprotocol=SUBPROTOCOL, path="/", address="127.0.0.1"
    ):
        self.socket = socket.create_connection((address, port), timeout=TIMEOUT)
        self.data, self.closed = b"", None
        lines = [
            f"GET {path} HTTP/1.1",
            f"Host: {host or f'localhost:{port}'}",
            "Upgrade: websocket",
            "Connection: Upgrade",
            "Sec-WebSocket-Version: 13",
            "Sec-WebSocket-Key: " + base64.b64encode(os.urandom(16)).decode(),
        ]
        lines += [f"Sec-WebSocket-Protocol: {subprotocol}"] if subprotocol else []
        lines += [f"Origin: {origin}"] if origin else []
        self.socket.sendall("\r\n".join(lines).encode() + b"\r\n\r\n")
        while b"\r\n\r\n" not in self.data:
            try:
                part = self.socket.recv(65536)
            except ConnectionError:
                part = b""
            if not part:
                break
            self.data += part
        self.head, _, self.data = self.data.partition(b"\r\n\r\n")
        self.accepted = self.head.startswith(b"HTTP/1.1 101")
        if not self.accepted:
            self.socket.close()

    def send(self, message, kind=None):
        text = (
            message
            if isinstance(message, bytes)
            else (message if isinstance(message, str) else json.dumps(message)).encode()
        )
        mask = os.urandom(4)
        size = (
            struct.pack("!B", 0x80 | len(text))
            if len(text) < 126
            else struct.pack("!BH", 0xFE, len(text))
            if len(text) < 65536
            else struct.pack("!BQ", 0xFF, len(text))
        )
        self.socket.sendall(
            bytes([kind or (0x82 if isinstance(message, bytes) else 0x81)])
            + size
            + mask
            + bytes(b ^ mask[i % 4] for i, b in enumerate(text))
        )

    def more(self):
        try:
            part = self.socket.recv(65536)
        except ConnectionError:
            part = b""
        if not part:
            self.closed = self.closed or (1006, "")
        self.data += part
        return bool(part)

    def frame(self):
        while True:
            if len(self.data) >= 2:
                length, head = self.data[1] & 127, 2
                if length >= 126:
                    head = 4 if length == 126 else 10
                    length = (
                        int.from_bytes(self.data[2:head], "big")
                        if len(self.data) >= head
                        else 1 << 60
                    )
                if len(self.data) >= head + length:
                    kind, body, self.data = (
                        self.data[0],
                        self.data[head : head + length],
                        self.data[head + length :],
                    )
                    return kind, body
            if not self.more():
                return 0x88, b""

    def read(self):
        """The next message: an object of a JSON text, bytes, or None after the connection was closed."""
        whole = b""
        while True:
            kind, body = self.frame()
            if kind & 15 == 8:
                self.closed = (
                    (int.from_bytes(body[:2], "big"), body[2:].decode())
                    if body
                    else self.closed or (1006, "")
                )
                return None
            if kind & 15 == 9:  # answered as any client does
                self.send(body, 0x8A)
                continue
            first = (
                kind & 15 if kind & 15 else first
            )  # noqa: F821 a continuation follows its first frame
            whole += body
            if kind & 0x80:
                return json.loads(whole) if first == 1 else whole

    def expect(self, wanted):
        """Reads until a message satisfies wanted(message), which is returned."""
        deadline = time.monotonic() + TIMEOUT
        while (message := self.read()) is not None:
            if wanted(message):
                return message
            if time.monotonic() > deadline:
                break
        raise AssertionError(f"the message does not come; closed: {self.closed}")

    def close(self):
        self.socket.close()


class Browser:
    """Headless Chromium with one page."""

    def __init__(self, case, width=1280, height=800, folder="browser"):
        folder = case.folder / folder
        self.process = subprocess.Popen(
            [
                "chromium",
                "--headless=new",
                "--no-sandbox",
                "--disable-gpu",
                "--disable-dev-shm-usage",
                "--remote-debugging-port=0",
                f"--window-size={width},{height}",
                "--hide-scrollbars",
                "--force-prefers-reduced-motion",
                f"--user-data-dir={folder}",
                "about:blank",
            ],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
            env={**os.environ, "HOME": str(case.folder)},
        )
        case.addCleanup(self.end)
        port_file = folder / "DevToolsActivePort"
        port = int(
            wait_until(
                lambda: port_file.exists() and port_file.read_text().split("\n")[0],
                "the browser starts",
            )
        )
        pages = wait_until(
            lambda: [
                p
                for p in json.loads(request(port, "/json", host=f"127.0.0.1:{port}")[2] or b"[]")
                if p["type"] == "page"
            ],
            "the browser has a page",
        )
        self.socket = WebSocket(
            port,
            host=f"127.0.0.1:{port}",
            subprotocol=None,
            path=urlparse(pages[0]["webSocketDebuggerUrl"]).path,
        )
        self.number, self.errors = 0, []
        self.call("Page.enable")
        self.call("Runtime.enable")
        self.call("Log.enable")

    def call(self, method, **parameters):
        self.number += 1
        self.socket.send({"id": self.number, "method": method, "params": parameters})
        while (message := self.socket.read()) is not None:
            if message.get("id") == self.number:
                return message.get("result", {})
            if message.get("method") == "Runtime.exceptionThrown":
                self.errors.append(
                    message["params"]["exceptionDetails"]
                    .get("exception", {})
                    .get("description", str(message["params"]))
                )
            if (
                message.get("method") == "Log.entryAdded"
                and message["params"]["entry"]["level"] == "error"
            ):
                entry = message["params"]["entry"]
                self.errors.append(f"{entry['text']} {entry.get('url', '')}")
        raise AssertionError("the browser has ended")

    def open(self, url):
        self.call("Page.navigate", url=url)

    def evaluate(self, expression):
        result = self.call(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        if "exceptionDetails" in result:
            raise AssertionError(
                result["exceptionDetails"].get("exception", {}).get("description", str(result))
            )
        return result.get("result", {}).get("value")

    def wait(self, expression):
        # What the expression reads may not exist yet.
        return wait_until(
            lambda: self.evaluate(
                f"(() => {{ try {{ return {expression}; }} catch {{ return false; }} }})()"
            ),
            expression,
        )

    def screenshot(self, path):
        path.write_bytes(
            base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])
        )

    def size(self, width, height, dark=False):
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=width < 600,
        )
        self.call(
            "Emulation.setEmulatedMedia",
            features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}],
        )

    def end(self):
        """Ends the browser with the processes it has started."""
        try:
            os.killpg(self.process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        self.process.wait()


def have_browser():
    return shutil.which("chromium") is not None


def start_panel(case, *words):
    """Starts `hal panel`, on a free port unless one is given; (process, port, token or None)."""
    port = () if "--port" in words else ("--port", "0")
    with open(case.folder / "panel.err", "w") as errors:
        process = subprocess.Popen(
            [str(HAL), "panel", *port, *map(str, words)],
            cwd=case.folder,
            env=case.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
        )
    case.addCleanup(lambda: (process.poll() is None and process.kill(), process.communicate()))
    for line in process.stdout:
        if found := re.match(r"http://[^/]*?:(\d+)/(?:#t=(\w+))?", line):
            return process, int(found[1]), found[2]
    raise AssertionError((case.folder / "panel.err").read_text())
