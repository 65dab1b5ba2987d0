# SPDX-License-Identifier: MIT
"""What a terminal shows: the part of ECMA-48 that `hal run`, `hal top` and `hal scope` use."""

import os
import re
import signal

from harness import Terminal, wait_until

SEQUENCE = re.compile(r"\033\[([?0-9;]*)([A-Za-z])|\033[()][A-Z0-9]|\033[=>]")


class VirtualTerminal:
    """Rows of characters, with those that have left the screen at the top. `reflow`: a resize wraps long lines anew, as
    VTE and tmux do; without it they are cut, as xterm does."""

    def __init__(self, columns, rows, reflow=False):
        self.columns, self.rows, self.reflow = columns, rows, reflow
        self.lines = [""]  # all of them; the last `rows` are visible
        self.wrapped = [False]  # whether the line continues the one before
        self.row = self.column = 0  # `row` counts from the first of all lines
        self.pending = ""
        self.unknown = set()

    def top(self):
        return max(len(self.lines) - self.rows, 0)

    def feed(self, text):
        self.pending += text
        while self.pending:
            if self.pending[0] == "\033":
                found = SEQUENCE.match(self.pending)
                if not found:
                    if len(self.pending) > 30:
                        raise AssertionError(f"unknown sequence {self.pending[:30]!r}")
                    return  # the rest comes later
                self.pending = self.pending[found.end() :]
                if found[2]:
                    self.act(found[1], found[2])
            else:
                character, self.pending = self.pending[0], self.pending[1:]
                self.put(character)

    def put(self, character):
        if character == "\r":
            self.column = 0
        elif character == "\n":
            self.down(False)
        elif character >= " ":
            if self.column == self.columns:
                self.down(True)
                self.column = 0
            line = self.lines[self.row].ljust(self.column)
            self.lines[self.row] = line[: self.column] + character + line[self.column + 1 :]
            self.column += 1

    def down(self, wraps):
        self.row += 1
        if self.row == len(self.lines):
            self.lines.append("")
            self.wrapped.append(wraps)
        else:
            self.wrapped[self.row] = wraps

    def act(self, arguments, letter):
        numbers = [int(one) for one in arguments.split(";") if one.isdigit()]
        number = numbers[0] if numbers else 0
        if letter == "A":
            self.row = max(self.row - max(number, 1), self.top())
        elif letter == "K":
            self.lines[self.row] = self.lines[self.row][: self.column]
        elif letter == "J":
            if number == 2:
                for row in range(self.top(), len(self.lines)):
                    self.lines[row] = ""
            else:
                self.lines[self.row] = self.lines[self.row][: self.column]
                for row in range(self.row + 1, len(self.lines)):
                    self.lines[row] = ""
        elif letter == "H":
            row, column = (numbers + [1, 1])[:2] if len(numbers) != 1 else (numbers[0], 1)
            self.row, self.column = self.top() + row - 1, column - 1
            while self.row >= len(self.lines):
                self.lines.append("")
                self.wrapped.append(False)
        elif letter not in "mhl":
            self.unknown.add(letter)

    def resize(self, columns, rows):
        if self.reflow:
            self.wrap_anew(columns)
        else:
            self.lines = [line[:columns] for line in self.lines]
            self.column = min(self.column, columns)
        self.columns, self.rows = columns, rows
        while len(self.lines) - 1 > self.row and len(self.lines) > rows and not self.lines[-1]:
            self.lines.pop()
            self.wrapped.pop()

    def wrap_anew(self, columns):
        whole, cursor = [], 0
        for number, line in enumerate(self.lines):
            if self.wrapped[number] and whole:
                whole[-1] += line
            else:
                whole.append(line)
            if number == self.row:
                cursor = len(whole) - 1
        self.lines, self.wrapped = [], []
        for number, line in enumerate(whole):
            if number == cursor:
                self.row = len(self.lines)
            parts = [line[at : at + columns] for at in range(0, len(line), columns)] or [""]
            self.lines += parts
            self.wrapped += [False] + [True] * (len(parts) - 1)

    def screen(self):
        """The visible rows."""
        return [line.rstrip() for line in self.lines[self.top() :]]

    def everything(self):
        """Also the rows that have left the screen."""
        return [line.rstrip() for line in self.lines]


class ShownTerminal(VirtualTerminal):
    """A process on a terminal, and what that shows."""

    def __init__(self, case, *words, columns=80, rows=24, reflow=False):
        super().__init__(columns, rows, reflow)
        self.terminal = Terminal(case, *words, columns=columns, rows=rows)

    def update(self):
        while self.terminal.read(0.02):
            if len(self.terminal.seen) > 65536:
                break
        self.feed(self.terminal.seen)
        self.terminal.seen = ""

    def wait_for(self, condition, what):
        """Until `condition` is true of the visible rows."""

        def is_shown():
            self.update()
            return condition(self.screen())

        wait_until(is_shown, what)

    def resize_both(self, columns, rows):
        """No output is on its way meanwhile: the process is stopped."""
        os.kill(self.terminal.process, signal.SIGSTOP)
        self.update()
        self.terminal.resize(columns, rows)
        self.resize(columns, rows)
        os.kill(self.terminal.process, signal.SIGCONT)
