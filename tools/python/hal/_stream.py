# SPDX-License-Identifier: MIT
"""Streams: FIFOs of records between programs and the machine."""
import errno
import json

from hal._base import StreamError, _good, _plain, error, sampler_base, streamer_base
from hal._shared import Shared


class stream:
    """A FIFO of records: stream(component, key, depth, types) creates one, stream(component, key[, types]) opens an existing one.

    The keys streamer_base + N and sampler_base + N are those of the components streamer and sampler.
    """

    def __init__(self, comp, key, *rest):
        depth = rest[0] if rest and not isinstance(rest[0], str) else None
        types = rest[-1] if rest and isinstance(rest[-1], str) else None
        if depth is not None and types is None:
            raise TypeError("stream(component, key, depth, types)")
        for letter in types or "":
            if letter.lower() not in "bfsulk":
                raise ValueError(f"invalid column type {letter!r}; use b, f, s, u, l or k")
        if types == "":
            raise ValueError(
                "a stream needs at least one column; its types are letters of b, f, s, u, l, k"
            )
        types = types.lower() if types else None
        base = next(
            (
                word
                for word, first in (("sampler", sampler_base), ("streamer", streamer_base))
                if 0 <= key - first < 64
            ),
            None,
        )
        self._name = (
            f"{base}.{key - (sampler_base if base == 'sampler' else streamer_base)}"
            if base
            else f"stream.{key}"
        )
        self._comp, self._waiting, self._taken = comp._core, [], 0
        self.num_overruns = self.num_underruns = self.sampleno = 0
        self._shared = None
        if depth is not None and depth < 1:
            raise StreamError(
                errno.EINVAL, f"invalid depth {depth} of stream {self._name}; use 1 or more"
            )
        if depth is not None:  # one record stays free, as in LinuxCNC
            about = self._ask(create={"types": types, "depth": max(depth - 1, 1)}, owner=comp._name)
        else:
            about = self._find(key, types)
            if types is not None and types != about["types"]:
                raise StreamError(
                    f"stream {self._name} has column types {about['types']}, not {types}"
                )
        self._types, self.maxdepth = about["types"], about["depth"]

    def _find(self, key, types):
        try:
            return self._ask()
        except StreamError:
            self._shared = Shared.open(key, types)
            if not self._shared:
                raise
            return {"types": self._shared.types, "depth": self._shared.maxdepth}

    @property
    def element_types(self):
        return self._types.encode()

    def _ask(self, **what):
        try:
            return _good(self._comp.request(json.dumps({"stream": self._name, **what})))
        except error as problem:
            raise StreamError(str(problem)) from None

    @property
    def depth(self):
        return self._shared.depth if self._shared else self._ask()["waiting"] + len(self._waiting)

    @property
    def readable(self):
        return (
            self._shared.readable
            if self._shared
            else bool(self._waiting) or self._ask()["waiting"] > 0
        )

    @property
    def writable(self):
        if self._shared:
            return self._shared.writable
        about = self._ask()
        return about["waiting"] < about["depth"]

    def read(self):
        """Returns the next record as a tuple, or None when the stream is empty."""
        if self._shared:
            found = self._shared.read()
            self._waiting = [found] if found else []
        elif not self._waiting:
            reply = self._ask(take=100)
            self._waiting = list(zip(reply["numbers"], reply["records"]))[::-1]
        if not self._waiting:
            self.num_underruns += 1
            return None
        number, record = self._waiting.pop()
        self.sampleno = number if self._shared else number + 1
        return tuple(
            float(value) if letter == "f" else value for letter, value in zip(self._types, record)
        )

    def write(self, record):
        row = [
            bool(value) if letter == "b" else _plain(float(value)) if letter == "f" else int(value)
            for letter, value in zip(self._types, record)
        ]
        if len(row) != len(self._types) or len(record) != len(row):
            raise ValueError(
                f"the record has {len(record)} values, but stream {self._name} has {len(self._types)} columns"
            )
        if not self._shared.write(row) if self._shared else self._ask(records=[row])["taken"] == 0:
            self.num_overruns += 1
            raise StreamError(errno.ENOSPC, f"stream {self._name} is full")
