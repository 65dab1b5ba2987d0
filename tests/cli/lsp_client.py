# SPDX-License-Identifier: MIT
"""A client of `hal lsp` for tests: requests wait for their answer, notifications of the server are kept."""

import json
import os
import re
import select
import subprocess
import time
from pathlib import Path
from urllib.parse import quote, unquote

from harness import HAL, TIMEOUT


def uri(path):
    return "file://" + quote(str(Path(path).resolve()))


def path_of(text):
    return Path(unquote(text.removeprefix("file://")))


class Client:
    def __init__(self, environment, folder, *options, initialize=True, settings=None):
        self.process = subprocess.Popen(
            [str(HAL), "lsp", *options],
            cwd=folder,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        self.pending = b""
        self.number = 0
        self.versions = {}
        self.texts = {}
        self.published = {}  # by URI: the last parameters of publishDiagnostics
        self.requests = []  # of the server
        if initialize:
            self.capabilities = self.ask(
                "initialize",
                {"processId": None, "capabilities": {}, "initializationOptions": settings or {}},
            )["capabilities"]
            self.notify("initialized", {})

    # --- messages

    def send_bytes(self, data):
        self.process.stdin.write(data)
        self.process.stdin.flush()

    def send(self, message):
        body = json.dumps(message, ensure_ascii=False).encode()
        self.send_bytes(b"Content-Length: %d\r\n\r\n" % len(body) + body)

    def receive(self):
        """The next message of the server; None after its end."""
        deadline = time.monotonic() + TIMEOUT
        while True:
            header, found, rest = self.pending.partition(b"\r\n\r\n")
            if found:
                size = int(re.search(rb"Content-Length: (\d+)", header)[1])
                if len(rest) >= size:
                    self.pending = rest[size:]
                    return json.loads(rest[:size])
            left = deadline - time.monotonic()
            if left <= 0 or not select.select([self.process.stdout], [], [], left)[0]:
                raise TimeoutError("no message from hal lsp")
            data = os.read(self.process.stdout.fileno(), 1 << 20)
            if not data:
                return None
            self.pending += data

    def dispatch(self, message):
        if message.get("method") == "textDocument/publishDiagnostics":
            self.published[message["params"]["uri"]] = message["params"]
        elif "method" in message and "id" in message:
            self.requests.append(message)
            result = self.answer(message)
            self.send({"jsonrpc": "2.0", "id": message["id"], "result": result})

    def answer(self, request):
        if request["method"] == "workspace/applyEdit":
            return {"applied": True}
        return None

    def ask_whole(self, method, params):
        self.number += 1
        self.send({"jsonrpc": "2.0", "id": self.number, "method": method, "params": params})
        while (message := self.receive()) is not None:
            if "method" not in message and message.get("id") == self.number:
                return message
            self.dispatch(message)
        raise EOFError("hal lsp ended")

    def ask(self, method, params):
        """The result of a request."""
        answer = self.ask_whole(method, params)
        assert "error" not in answer, answer
        return answer["result"]

    def notify(self, method, params):
        self.send({"jsonrpc": "2.0", "method": method, "params": params})

    # --- documents

    def open(self, path, text=None):
        """Opens a file, or a text in its place. Returns its URI."""
        name = path if str(path).startswith("untitled:") else uri(path)
        if text is None:
            text = Path(path).read_bytes().decode(errors="replace")
        self.versions[name] = 1
        self.texts[name] = text
        self.published.pop(name, None)
        document = {"uri": name, "languageId": "halcyon", "version": 1, "text": text}
        self.notify("textDocument/didOpen", {"textDocument": document})
        return name

    def change(self, name, *changes):
        """Changes: (first line, column, last line, column, text), or a whole text."""
        self.versions[name] += 1
        content = []
        for change in changes:
            if isinstance(change, str):
                content.append({"text": change})
                continue
            line, column, last, end, text = change
            between = {
                "start": {"line": line, "character": column},
                "end": {"line": last, "character": end},
            }
            content.append({"range": between, "text": text})
        document = {"uri": name, "version": self.versions[name]}
        self.notify("textDocument/didChange", {"textDocument": document, "contentChanges": content})

    def close(self, name):
        self.notify("textDocument/didClose", {"textDocument": {"uri": name}})

    def diagnostics(self, name):
        """Waits for the diagnostics of the newest version of a document."""
        while self.published.get(name, {}).get("version") != self.versions[name]:
            message = self.receive()
            assert message is not None, "hal lsp ended"
            self.dispatch(message)
        return self.published[name]["diagnostics"]

    def at(self, name, line, column, method, **more):
        """Asks a request about a position."""
        where = {"line": line, "character": column}
        return self.ask(
            f"textDocument/{method}", {"textDocument": {"uri": name}, "position": where, **more}
        )

    # --- end

    def quit(self):
        """Ends the server. Returns its exit status."""
        self.ask("shutdown", None)
        self.notify("exit", None)
        return self.process.wait(TIMEOUT)

    def kill(self):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self.process.stdin.close()
        self.process.stdout.close()
