# SPDX-License-Identifier: MIT
"""Streams of LinuxCNC's compiled modules: they are in shared memory, where liblinuxcnchal.so.0 of Halcyon reads and writes them."""
import ctypes
import os
import pathlib

from hal import _core


class _Handle(ctypes.Structure):
    _fields_ = [("comp", ctypes.c_int), ("segment", ctypes.c_int), ("fifo", ctypes.c_void_p)]


class _Value(ctypes.Union):
    _fields_ = [
        ("f", ctypes.c_double),
        ("b", ctypes.c_bool),
        ("s", ctypes.c_int32),
        ("u", ctypes.c_uint32),
        ("l", ctypes.c_int64),
        ("k", ctypes.c_uint64),
    ]


_LETTERS = {1: "b", 2: "f", 3: "s", 4: "u", 6: "l", 7: "k"}


def _library():
    """Beside the module in a build tree and in an installation, or where a started program searches."""
    folder = pathlib.Path(_core.__file__).resolve().parent
    places = [folder.parents[1] / "lib/halcyon/linuxcnc", folder.parents[1] / "linuxcnc"]
    places += [pathlib.Path(one) for one in os.environ.get("LD_LIBRARY_PATH", "").split(":") if one]
    for place in places:
        if (place / "liblinuxcnchal.so.0").exists() and "halcyon" in str(place):
            return ctypes.CDLL(str(place / "liblinuxcnchal.so.0"))
    return None


class Shared:
    """One open stream; `open` returns None if no stream has that key and these types."""

    @classmethod
    def open(cls, key, types):
        library = _library()
        it, handle = cls(), _Handle()
        if (
            library is None
            or library.hal_stream_attach(
                ctypes.byref(handle), 0, key, types.encode() if types else None
            )
            != 0
        ):
            return None
        library.hal_stream_readable.restype = library.hal_stream_writable.restype = ctypes.c_bool
        it._library, it._handle = library, handle
        count = it._call("element_count")
        it.types = "".join(_LETTERS[it._call("element_type", i)] for i in range(count))
        it.maxdepth = it._call("maxdepth")
        it._row = (_Value * count)()
        return it

    def __del__(self):
        if hasattr(self, "_handle"):
            self._call("detach")

    def _call(self, name, *words):
        return getattr(self._library, f"hal_stream_{name}")(ctypes.byref(self._handle), *words)

    @property
    def depth(self):
        return self._call("depth")

    @property
    def readable(self):
        return self._call("readable")

    @property
    def writable(self):
        return self._call("writable")

    def read(self):
        """The number of the next record and its values, or None."""
        number = ctypes.c_uint()
        if self._call("read", self._row, ctypes.byref(number)) != 0:
            return None
        return number.value, tuple(
            getattr(value, letter) for value, letter in zip(self._row, self.types)
        )

    def write(self, record):
        """Returns False when the stream is full."""
        for value, letter, given in zip(self._row, self.types, record):
            setattr(value, letter, given)
        return self._call("write", self._row) == 0
