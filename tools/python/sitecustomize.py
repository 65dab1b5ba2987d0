# SPDX-License-Identifier: MIT
"""Lets `import hal` find Halcyon's module in programs of a LinuxCNC that was built in place: they put its folder of modules before all others,
and the module there needs LinuxCNC's own library. A file `hal` in any other folder that comes first is found as usual."""
import importlib.util
import os
import sys

_HERE = os.path.dirname(os.path.abspath(__file__))


class _Finder:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name not in ("hal", "_hal") or path is not None:
            return None
        theirs = [
            os.path.realpath(home + "/lib/python")
            for home in (os.environ.get("LINUXCNC_HOME"), os.environ.get("EMC2_HOME"))
            if home
        ]
        for folder in sys.path:
            if any(
                os.path.exists(os.path.join(folder, name + end))
                for end in (".py", ".so", "/__init__.py")
            ):
                if os.path.realpath(folder) not in theirs:
                    return None
                if name == "_hal":
                    return importlib.util.spec_from_file_location("_hal", _HERE + "/_hal.py")
                return importlib.util.spec_from_file_location(
                    "hal", _HERE + "/hal/__init__.py", submodule_search_locations=[_HERE + "/hal"]
                )
        return None


sys.meta_path.insert(0, _Finder)

# What this file hides: the computer's own.
for _folder in sys.path:
    _other = os.path.join(_folder, "sitecustomize.py")
    if os.path.abspath(_other) != os.path.abspath(__file__) and os.path.isfile(_other):
        with open(_other) as _file:
            exec(
                compile(_file.read(), _other, "exec"),
                {"__name__": "sitecustomize", "__file__": _other},
            )
        break
