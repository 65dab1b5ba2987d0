# SPDX-License-Identifier: MIT
"""A repository of Debian packages, as apt reads it: https://wiki.debian.org/DebianRepository/Format."""

import gzip
import hashlib
import shutil
import subprocess
from email.utils import format_datetime


def control_of(package):
    """The control fields of a package, by name; a field of several lines keeps its line ends."""
    done = subprocess.run(
        ["dpkg-deb", "--field", package], capture_output=True, text=True, check=True
    )
    fields = {}
    for line in done.stdout.splitlines():
        if line.startswith(" "):
            fields[name] += f"\n{line}"
        else:
            name, _, value = line.partition(":")
            fields[name] = value.strip()
    return fields


class Repository:
    """One suite, stable, with one component, main. Its files depend on the packages and the date only."""

    def __init__(self, folder, date, version):
        self.folder, self.date, self.version = folder, date, version
        self.pool = folder / "pool/main/h/halcyon"
        self.suite = folder / "dists/stable"
        self.found = []  # (path in the repository, control fields, size, SHA-256)

    def add(self, package):
        """A package of the same name, version and architecture replaces the one before."""
        self.pool.mkdir(parents=True, exist_ok=True)
        target = self.pool / package.name
        shutil.copyfile(package, target)
        data = target.read_bytes()
        path = target.relative_to(self.folder).as_posix()
        self.found = [one for one in self.found if one[0] != path]
        self.found.append((path, control_of(target), len(data), hashlib.sha256(data).hexdigest()))

    @property
    def architectures(self):
        """Those with packages of their own, in the order of their names."""
        return sorted({fields["Architecture"] for _, fields, _, _ in self.found} - {"all"})

    def packages(self):
        """(control fields, file name, SHA-256) of each package."""
        return [(fields, path.split("/")[-1], digest) for path, fields, _, digest in self.found]

    def stanza(self, path, fields, size, digest):
        text = "".join(f"{name}: {value}\n" for name, value in fields.items())
        return f"{text}Filename: {path}\nSize: {size}\nSHA256: {digest}\n"

    def index(self):
        """Writes the lists of packages; returns the file Release, which a key signs."""
        sums = []
        for architecture in self.architectures:
            listed = "\n".join(
                self.stanza(*one)
                for one in sorted(self.found, key=lambda one: one[0])
                if one[1]["Architecture"] in (architecture, "all")
            ).encode()
            folder = self.suite / f"main/binary-{architecture}"
            folder.mkdir(parents=True)
            for name, data in (
                ("Packages", listed),
                ("Packages.gz", gzip.compress(listed, 9, mtime=0)),
            ):
                (folder / name).write_bytes(data)
                path = f"main/binary-{architecture}/{name}"
                sums.append(f" {hashlib.sha256(data).hexdigest()} {len(data)} {path}\n")
        release = self.suite / "Release"
        release.write_text(
            "Origin: Halcyon\nLabel: Halcyon\nSuite: stable\nCodename: stable\n"
            f"Version: {self.version}\nDate: {format_datetime(self.date).replace('+0000', 'UTC')}\n"
            f"Architectures: {' '.join(self.architectures)}\nComponents: main\n"
            f"Description: Halcyon {self.version}\nSHA256:\n{''.join(sums)}"
        )
        return release
