# SPDX-License-Identifier: MIT
"""Headless Firefox with one page, driven over WebDriver BiDi, which it serves itself: the interface of web.Browser."""
import base64
import json
import os
import re
import shutil
import signal
import subprocess
import threading

from harness import wait_until
from web import WebSocket


class Firefox:
    def __init__(self, case, width=1280, height=800):
        folder = case.folder / "firefox"
        folder.mkdir()
        (folder / "user.js").write_text(
            'user_pref("ui.prefersReducedMotion", 1);\nuser_pref("browser.shell.checkDefaultBrowser", false);\n'
        )
        self.process = subprocess.Popen(
            [
                "firefox-esr",
                "--headless",
                "--no-remote",
                "--profile",
                folder,
                "--remote-debugging-port=0",
            ],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            env={**os.environ, "HOME": str(case.folder)},
        )
        case.addCleanup(self.end)
        found = next(
            filter(
                None,
                (
                    re.search(r"BiDi listening on ws://127\.0\.0\.1:(\d+)", line)
                    for line in self.process.stderr
                ),
            ),
            None,
        )
        if not found:
            raise AssertionError("Firefox does not start")
        threading.Thread(target=self.process.stderr.read, daemon=True).start()
        port = int(found[1])
        self.socket = WebSocket(port, host=f"127.0.0.1:{port}", subprotocol=None, path="/session")
        self.number, self.errors = 0, []
        self.call("session.new", capabilities={})
        self.page = wait_until(
            lambda: self.call("browsingContext.getTree")["contexts"], "the browser has a page"
        )[0]["context"]
        self.call("session.subscribe", events=["log.entryAdded"])
        self.size(width, height)

    def call(self, method, **parameters):
        self.number += 1
        self.socket.send({"id": self.number, "method": method, "params": parameters})
        while (message := self.socket.read()) is not None:
            if message.get("method") == "log.entryAdded" and message["params"]["level"] == "error":
                self.errors.append(message["params"]["text"])
            if message.get("id") == self.number:
                if message["type"] == "error":
                    raise AssertionError(f"{method}: {message['message']}")
                return message["result"]
        raise AssertionError("the browser has ended")

    def open(self, url):
        self.call(
            "browsingContext.navigate",
            context=self.page,
            url=url,
            wait="none" if "#" in url else "complete",
        )

    def evaluate(self, expression):
        """The value of an expression; objects and arrays come as JSON would have them."""
        reply = self.call(
            "script.evaluate",
            expression=f"Promise.resolve({expression}).then(value => JSON.stringify(value))",
            target={"context": self.page},
            awaitPromise=True,
        )
        if reply["type"] == "exception":
            raise AssertionError(reply["exceptionDetails"]["text"])
        return json.loads(reply["result"]["value"]) if reply["result"]["type"] == "string" else None

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
            base64.b64decode(
                self.call("browsingContext.captureScreenshot", context=self.page)["data"]
            )
        )

    def size(self, width, height):
        self.call(
            "browsingContext.setViewport",
            context=self.page,
            viewport={"width": width, "height": height},
        )

    def end(self):
        """Ends Firefox with the processes it has started."""
        try:
            os.killpg(self.process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        self.process.wait()


def have_firefox():
    return shutil.which("firefox-esr") is not None
