#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""release.py [--check] ROOT PACKAGES OUTPUT KEY [URL]: what a project publishes of one version, in the folder OUTPUT; or only whether something
prevents it.

PACKAGES: a folder with the Debian packages of this version, also in folders in it. KEY: the key of GnuPG that signs. URL: where OUTPUT will be
found; without it users reach OUTPUT as a folder. Needs git, gpg and dpkg."""

import hashlib
import json
import lzma
import re
import shutil
import subprocess
import sys
from datetime import datetime, timezone
from pathlib import Path

from repository import Repository
from sbom import Sbom

HERE = Path(__file__).resolve().parent


def run(*words, **how):
    """The output of a program, as bytes; ends this one with its messages when it fails."""
    done = subprocess.run([str(word) for word in words], capture_output=True, **how)
    if done.returncode != 0:
        message = done.stderr.decode(errors="replace").strip()
        sys.exit(f"hal: {' '.join(map(str, words[:2]))} failed: {message}")
    return done.stdout


def notes(changelog, version):
    """The section of a version in CHANGELOG.md, without its heading."""
    sections = re.split(r"^## ", changelog, flags=re.MULTILINE)[1:]
    for section in sections:
        heading, text = section.split("\n", 1)
        if heading.split(",")[0].strip() == version:
            return text.strip() + "\n"
    sys.exit(f"hal: CHANGELOG.md has no section '## {version}'")


class Release:
    def __init__(self, root, packages, output, key, url=""):
        self.root, self.packages, self.output = (
            Path(path).resolve() for path in (root, packages, output)
        )
        self.key = key
        self.url = url.rstrip("/")
        project = (self.root / "CMakeLists.txt").read_text()
        self.version = re.search(r"project\(Halcyon VERSION (\S+)", project)[1]

    def git(self, *words):
        return run("git", "-c", "safe.directory=*", "-C", self.root, *words)

    def check(self):
        """Ends the program when the release would differ from its sources, or has no notes or no key."""
        notes((self.root / "CHANGELOG.md").read_text(), self.version)
        if changed := self.git("status", "--porcelain").decode().splitlines():
            sys.exit(
                f"hal: a release is made of commits, and {len(changed)} files differ from the last one; type: git status"
            )
        for one in self.packages.rglob("*.deb"):
            if one.name.split("_")[1] != self.version:
                sys.exit(f"hal: {one} is not of version {self.version}; remove it")
        known = subprocess.run(
            ["gpg", "--batch", "--list-secret-keys", self.key], capture_output=True
        )
        if known.returncode != 0:
            sys.exit(
                f"hal: GnuPG has no secret key '{self.key}' to sign with; to list those it has: gpg --list-secret-keys; "
                "to make one: gpg --quick-generate-key 'NAME <ADDRESS>' default sign"
            )

    def source(self):
        """The source archive, which builds without git: cmake/commit.txt has the commit."""
        name = f"halcyon-{self.version}"
        tar = self.git("archive", "--format=tar", f"--prefix={name}/", "HEAD")
        path = self.output / f"{name}.tar.xz"
        path.write_bytes(lzma.compress(tar, preset=6))
        return path

    def sign(self, path, how, target):
        run("gpg", "--batch", "--yes", "--local-user", self.key, how, "--output", target, path)

    def public_key(self):
        return run("gpg", "--batch", "--armor", "--export", self.key).decode()

    def date(self):
        seconds = int(self.git("log", "-1", "--format=%ct"))
        return datetime.fromtimestamp(seconds, timezone.utc)

    def checksums(self):
        """SHA256SUMS of every file of the release, and its signature."""
        files = sorted(path for path in self.output.rglob("*") if path.is_file())
        sums = self.output / "SHA256SUMS"
        sums.write_text(
            "".join(
                f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.relative_to(self.output)}\n"
                for path in files
            )
        )
        self.sign(sums, "--detach-sign", self.output / "SHA256SUMS.gpg")

    def texts(self, architectures):
        """The notes, the file for apt, and the recipe of the image."""
        changes = notes((self.root / "CHANGELOG.md").read_text(), self.version)
        template = (HERE / "files/release.md").read_text()
        for name, value in (
            ("VERSION", self.version),
            ("ARCHITECTURES", ", ".join(architectures)),
            ("CHANGES", changes),
        ):
            template = template.replace(f"@{name}@", value)
        if not self.url:
            rows = template.splitlines(keepends=True)
            template = "".join(row for row in rows if not row.startswith("| `halcyon.sources` |"))
        (self.output / "NOTES.md").write_text(template)
        for name in ("image.sh", "add-repository"):
            shutil.copyfile(HERE / "files" / name, self.output / name)

    def sources(self):
        """The key, and the file for apt where the address of the repository is known."""
        key = self.public_key()
        (self.output / "halcyon.asc").write_text(key)
        if self.url:
            lines = "".join(f" {line or '.'}\n" for line in key.splitlines())
            (self.output / "halcyon.sources").write_text(
                f"Types: deb\nURIs: {self.url}/apt\nSuites: stable\nComponents: main\nSigned-By:\n{lines}"
            )

    def make(self):
        self.check()
        shutil.rmtree(self.output, ignore_errors=True)
        self.output.mkdir(parents=True)
        date = self.date()
        repository = Repository(self.output / "apt", date, self.version)
        for package in sorted(self.packages.rglob("*.deb")):
            repository.add(package)
        if not repository.architectures:
            sys.exit(f"hal: no packages in {self.packages}")
        release = repository.index()
        self.sign(release, "--detach-sign", release.with_name("Release.gpg"))
        self.sign(release, "--clear-sign", release.with_name("InRelease"))
        source = self.source()
        sbom = Sbom(self.version, date, source, repository.packages())
        path = self.output / f"halcyon-{self.version}.spdx.json"
        path.write_text(json.dumps(sbom.document(), indent=1) + "\n")
        self.texts(repository.architectures)
        self.sources()
        self.checksums()
        print(f"{self.output}: Halcyon {self.version} for {', '.join(repository.architectures)}")


if __name__ == "__main__":
    if sys.argv[1] == "--check":
        Release(*sys.argv[2:7]).check()
    else:
        Release(*sys.argv[1:6]).make()
