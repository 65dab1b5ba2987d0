# SPDX-License-Identifier: MIT
"""Probes: values of a running machine, sampled at the end of each cycle, as arrays."""
from hal import _core

_FORMATS = {
    "f": "d",
    "s": "q",
    "l": "q",
    "b": "Q",
    "u": "Q",
    "k": "Q",
}  # of memoryview, 8 bytes each


class Rows:
    """Rows of one thread. rows["x-pid.error"] is an array of that value: a memoryview, which numpy.asarray() takes without copying.

    thread: its name ("" for values that no thread uses). cycle and time_ns: numbers of the cycles, and when they were due, as arrays.
    lost: rows that did not fit into the machine's memory since the rows before. names: of the values.
    """

    def __init__(self, columns, thread, numbers, count, lost, data):
        self.thread, self.lost, self._count = thread, lost, count
        self._data, self._stride = memoryview(data), len(numbers) + 2
        self._at = {
            columns[number][0]: (2 + i, _FORMATS[columns[number][1]])
            for i, number in enumerate(numbers)
        }
        self.cycle, self.time_ns = self._array(0, "Q"), self._array(1, "q")

    def _array(self, word, letter):
        return (
            self._data.cast(letter)[word :: self._stride]
            if self._count
            else memoryview(b"").cast(letter)
        )

    @property
    def names(self):
        return list(self._at)

    def __len__(self):
        return self._count

    def __contains__(self, name):
        return name in self._at

    def __getitem__(self, name):
        return self._array(*self._at[name])


class probe:
    """Samples pins, parameters and signals at the end of every `every`-th cycle of their threads, without any change of the netlist.

        with hal.probe(["x-pid.error", "x-pid.output"]) as samples:
            for rows in samples:
                print(rows.time_ns[-1], max(rows["x-pid.error"]))

    Iterating waits for rows and never ends by itself; it raises hal.error when the instance has ended.
    """

    def __init__(self, names, every=1, batch_ms=20, buffer_ms=2000):
        self._core = _core.Probe(
            [names] if isinstance(names, str) else list(names), every, batch_ms, buffer_ms
        )
        self._columns = self._core.columns()
        self._waiting, self._lost = [], 0

    @property
    def units(self):
        return {name: unit for name, _, unit in self._columns}

    @property
    def lost(self):
        """Rows lost since the probe was attached; after close(), until then."""
        return self._lost if self._core is None else self._core.lost()

    def unix_ns(self, time_ns):
        """Returns the Unix time of a time of the machine's clock."""
        return self._core.unix_ns(time_ns)

    def read(self, timeout=0.0):
        """Returns the rows of the next batch as a list with an element per thread; empty when none comes within the time in seconds."""
        return [Rows(self._columns, *part) for part in self._core.next(int(timeout * 1000))]

    def close(self):
        self._lost, self._core = self.lost, None

    def __iter__(self):
        return self

    def __next__(self):
        while not self._waiting:
            if self._core is None:
                raise StopIteration
            self._waiting = self.read(0.2)  # so that Ctrl-C is seen
        return self._waiting.pop(0)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
