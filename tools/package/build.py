#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""build.py ROOT BUILD OUTPUT [ARCHITECTURE SYSROOT]: Debian packages from the build tree BUILD, in OUTPUT. Needs dpkg-dev and binutils.

SYSROOT: the unpacked system of another architecture, with its packages in /var/cache/apt/archives.
"""

import gzip
import hashlib
import os
import re
import shutil
import stat
import subprocess
import sys
import tempfile
from email.utils import formatdate
from pathlib import Path

from packages import EXTRA, GROUPS, PACKAGES, RULES

HERE = Path(__file__).resolve().parent
MAINTAINER = f"{os.environ.get('DEBFULLNAME', 'Halcyon maintainers')} <{os.environ.get('DEBEMAIL', 'halcyon@packages.debian.org')}>"


def run(*words, **how):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, **how)
    if done.returncode != 0:
        sys.exit(f"hal: {' '.join(map(str, words[:3]))} failed:\n{done.stdout}{done.stderr}")
    return done.stdout


def is_elf(path):
    if path.is_symlink() or not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(4) == b"\x7fELF"


class Packages:
    def __init__(self, root, build, output, architecture="", sysroot=""):
        self.root, self.build, self.output = (
            Path(path).resolve() for path in (root, build, output)
        )
        self.sysroot = Path(sysroot).resolve() if sysroot else None
        self.version = re.search(
            r"project\(Halcyon VERSION (\S+)", (self.root / "CMakeLists.txt").read_text()
        )[1]
        self.architecture = architecture or run("dpkg", "--print-architecture").strip()
        self.triplet = run(
            "dpkg-architecture", "-a", self.architecture, "-q", "DEB_HOST_MULTIARCH"
        ).strip()
        self.date = self.source_date()
        self.scratch = Path(tempfile.mkdtemp(prefix="halcyon-package-"))

    def source_date(self):
        """Seconds of the checked-out commit, so that the same sources give the same packages."""
        done = subprocess.run(
            ["git", "-c", "safe.directory=*", "-C", self.root, "log", "-1", "--format=%ct"],
            capture_output=True,
            text=True,
        )
        return int(
            os.environ.get("SOURCE_DATE_EPOCH")
            or done.stdout.strip()
            or (self.root / "CHANGELOG.md").stat().st_mtime
        )

    def tree(self, name):
        return self.scratch / name

    # --- files

    def install(self):
        stage = self.scratch / "stage"
        run(
            "cmake",
            "--install",
            self.build,
            "--prefix",
            "/usr",
            env={**os.environ, "DESTDIR": str(stage)},
        )
        group_of = {
            name: group
            for name, group, *_ in (
                line.split() for line in (self.build / "components/groups").read_text().splitlines()
            )
        }
        for path in sorted(p for p in stage.rglob("*") if p.is_symlink() or not p.is_dir()):
            name = path.relative_to(stage).as_posix()
            package, target = self.place(name, group_of)
            if package:
                to = self.tree(package) / target
                to.parent.mkdir(parents=True, exist_ok=True)
                path.rename(to)

    @staticmethod
    def place(name, group_of):
        """The package and the path of an installed file."""
        if found := re.fullmatch(r"usr/lib/halcyon/components/([^/]+)\.so", name):
            if (group := group_of.get(found[1])) in GROUPS:
                return f"halcyon-{group}", name
        for pattern, package, path in RULES:
            if found := re.fullmatch(pattern, name):
                return package, found.expand(path) if path else name
        sys.exit(f"hal: no package has {name}: add a rule to tools/package/packages.py")

    def extra_files(self):
        for source, package, path, mode in EXTRA:
            if not self.tree(package).exists():
                continue  # nothing of it is in this build
            to = self.tree(package) / path
            to.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(HERE / "files" / source, to)
            to.chmod(mode)
        (self.tree("halcyon") / "etc/halcyon/can").mkdir()
        site = self.build / "site"
        if site.exists():
            shutil.copytree(site, self.tree("halcyon-doc") / "usr/share/doc/halcyon/html")
        # Where pages link to the machines, as in the source tree.
        link = self.tree("halcyon-doc") / "usr/share/doc/halcyon/halfiles"
        link.symlink_to("../../halcyon/halfiles")
        for package, about in list(PACKAGES.items()):
            if self.sysroot and about.get("fields", {}).get("Architecture") == "all":
                print(f"left out: {package}: ./hal package makes it, for all architectures")
                del PACKAGES[package]
            elif not self.tree(package).exists():
                print(f"left out: {package}: not in this build (see cmake/optional)")
                del PACKAGES[package]

    def finish(self, package):
        """Strips programs, compresses manuals, adds changelog and copyright, and sets modes as Debian has them."""
        tree = self.tree(package)
        if elf := [path for path in sorted(tree.rglob("*")) if is_elf(path)]:
            run(self.strip, "--strip-unneeded", "--remove-section=.comment", *elf)
            # The system's libraries are in the system's folders.
            run(
                "cmake",
                "-P",
                self.script("\n".join(f'file(RPATH_REMOVE FILE "{path}")' for path in elf)),
            )
        if archives := list(tree.glob("usr/lib/*.a")):
            run(self.strip, "--strip-debug", *archives)
        for path in tree.glob("usr/share/man/*/*.[1-9]"):
            (path.parent / f"{path.name}.gz").write_bytes(
                gzip.compress(path.read_bytes(), 9, mtime=0)
            )
            path.unlink()
        doc = tree / f"usr/share/doc/{package}"
        doc.mkdir(parents=True, exist_ok=True)
        changes = f"halcyon ({self.version}) unstable; urgency=medium\n\n  * Built from its sources; see CHANGELOG.md there.\n\n -- {MAINTAINER}  {formatdate(self.date)}\n"
        (doc / "changelog.gz").write_bytes(gzip.compress(changes.encode(), 9, mtime=0))
        (doc / "copyright").write_text(
            "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/\nUpstream-Name: Halcyon\n\nFiles: *\n"
            + self.copyright()
        )
        for path in [tree, *tree.rglob("*")]:
            if path.is_symlink():
                continue
            executable = (
                path.is_dir()
                or path.stat().st_mode & stat.S_IXUSR
                and not path.suffix == ".so"
                and ".so." not in path.name
            )
            path.chmod(0o755 if executable else 0o644)

    @property
    def strip(self):
        return f"{self.triplet}-strip" if self.sysroot else "strip"

    def script(self, text):
        path = self.scratch / "script.cmake"
        path.write_text(text)
        return path

    def copyright(self):
        lines = (self.root / "LICENSE").read_text().strip().splitlines()
        owner = next(line for line in lines if line.startswith("Copyright"))
        body = lines[lines.index(owner) + 1 :]
        text = "\n".join(f" {line}" if line.strip() else " ." for line in body).removeprefix(" .\n")
        return f"Copyright: {owner.removeprefix('Copyright').removeprefix(' (c)').strip()}\nLicense: MIT\n{text}\n"

    # --- control

    def libraries(self, package):
        """What the programs and plugins of a package link, as dependencies."""
        elf = [p for p in self.tree(package).rglob("*") if is_elf(p)]
        if not elf:
            return ""
        folder = self.scratch / "shlibs"
        (folder / "debian").mkdir(parents=True, exist_ok=True)
        (folder / "debian/control").write_text(
            f"Source: halcyon\nMaintainer: {MAINTAINER}\n\nPackage: {package}\nArchitecture: any\n"
        )
        own = "\n".join(
            f"{re.match('(lib.*).so', p.name)[1]} {p.name.partition('.so.')[2]} {name} (= {self.version})"
            for name in PACKAGES
            for p in self.tree(name).glob("usr/lib/*.so.*")
            if not p.is_symlink()
        )
        (folder / "debian/shlibs.local").write_text(own + "\n")
        paths = [f"-l{self.tree(name)}/usr/lib" for name in PACKAGES]
        if self.sysroot:
            paths += [
                f"--admindir={self.database()}",
                f"-l{self.sysroot}/lib/{self.triplet}",
                f"-l{self.sysroot}/usr/lib/{self.triplet}",
            ]
        out = run(
            "dpkg-shlibdeps",
            "-O",
            "--warnings=0",
            *paths,
            *[f"-e{p}" for p in elf],
            cwd=folder,
            env={**os.environ, "DEB_HOST_ARCH": self.architecture},
        )
        found = out.strip().removeprefix("shlibs:Depends=").split(", ")
        return ", ".join(d for d in found if d and not d.startswith(f"{package} "))

    def database(self):
        """A database of dpkg with the packages of the sysroot and their files where they lie on this machine."""
        database = self.scratch / "dpkg"
        if database.exists():
            return database
        info = database / "info"
        info.mkdir(parents=True)
        (info / "format").write_text("1\n")
        (database / "arch").write_text(
            f"{run('dpkg', '--print-architecture').strip()}\n{self.architecture}\n"
        )
        status = []
        for archive in sorted((self.sysroot / "var/cache/apt/archives").glob("*.deb")):
            control = self.scratch / "control"
            run("dpkg-deb", "--control", archive, control)
            fields = (control / "control").read_text()
            name = re.search("^Package: (.*)$", fields, re.MULTILINE)[1]
            stem = f"{name}:{self.architecture}" if "\nMulti-Arch: same\n" in fields else name
            for kind in ("symbols", "shlibs"):
                if (control / kind).exists():
                    shutil.copyfile(control / kind, info / f"{stem}.{kind}")
            packed = (
                self.sysroot / line.split(None, 5)[5].split(" -> ")[0]
                for line in run("dpkg-deb", "--contents", archive).splitlines()
            )
            (info / f"{stem}.list").write_text(
                "".join(
                    f"{path}\n"
                    for file in packed
                    for path in sorted({os.path.normpath(file), os.path.realpath(file)})
                )
            )
            status.append(fields.strip() + "\nStatus: install ok installed\n")
            shutil.rmtree(control)
        (database / "status").write_text("\n".join(status))
        return database

    def control(self, package, about):
        tree = self.tree(package)
        size = sum(
            (p.lstat().st_size + 1023) // 1024 if not p.is_dir() else 1 for p in tree.rglob("*")
        )
        extra = dict(about.get("fields", {}))
        architecture = extra.pop("Architecture", self.architecture)
        depends = []
        for one in f"{about['depends']}, {self.libraries(package)}".format(
            version=self.version
        ).split(", "):
            if one.strip() and one not in depends:
                depends.append(one)
        fields = {
            "Package": package,
            "Source": "halcyon" if package != "halcyon" else None,
            "Version": self.version,
            "Architecture": architecture,
            "Maintainer": MAINTAINER,
            "Installed-Size": size,
            "Depends": ", ".join(depends),
            "Section": extra.pop("Section", "electronics"),
            "Priority": "optional",
            "Homepage": extra.pop("Homepage", None),
            **extra,
        }
        text = "".join(f"{key}: {value}\n" for key, value in fields.items() if value)
        return (
            text
            + f"Description: {about['summary']}\n"
            + "".join(f" {line}\n" for line in about["text"].splitlines())
        )

    def pack(self, package, about):
        tree = self.tree(package)
        if accepted := about.get("lintian"):
            overrides = tree / f"usr/share/lintian/overrides/{package}"
            overrides.parent.mkdir(parents=True)
            overrides.write_text("".join(f"{package}: {line}\n" for line in accepted))
        self.finish(package)
        control = tree / "DEBIAN"
        control.mkdir()
        (control / "control").write_text(self.control(package, about))
        sums = [
            f"{hashlib.md5(p.read_bytes()).hexdigest()}  {p.relative_to(tree)}"
            for p in sorted(tree.rglob("*"))
            if p.is_file() and not p.is_symlink() and "DEBIAN" not in p.relative_to(tree).parts
        ]
        (control / "md5sums").write_text("\n".join(sums) + "\n")
        if configured := [
            f"/{p.relative_to(tree)}" for p in sorted((tree / "etc").rglob("*")) if p.is_file()
        ]:
            (control / "conffiles").write_text("\n".join(configured) + "\n")
        if any(p for p in tree.glob("usr/lib/*.so.*")):
            shlibs = "".join(
                f"{re.match('(lib.*).so', p.name)[1]} {p.name.partition('.so.')[2]} {package} (= {self.version})\n"
                for p in sorted(tree.glob("usr/lib/*.so.*"))
                if not p.is_symlink()
            )
            (control / "shlibs").write_text(shlibs)
            (control / "triggers").write_text("activate-noawait ldconfig\n")
        for name in ("postinst", "prerm", "postrm"):
            source = HERE / f"files/{package}.{name}"
            if source.exists():
                shutil.copyfile(source, control / name)
                (control / name).chmod(0o755)
        architecture = re.search(
            r"^Architecture: (.*)$", (control / "control").read_text(), re.MULTILINE
        )[1]
        path = self.output / f"{package}_{self.version}_{architecture}.deb"
        run(
            "dpkg-deb",
            "--root-owner-group",
            "-Zxz",
            "--build",
            tree,
            path,
            env={**os.environ, "SOURCE_DATE_EPOCH": str(self.date)},
        )
        print(f"{path.name}  {path.stat().st_size / 1e6:.1f} MB")

    def make(self):
        try:
            self.install()
            self.extra_files()
            if self.output.exists():
                for old in self.output.glob("*.deb"):
                    old.unlink()
            self.output.mkdir(parents=True, exist_ok=True)
            for package, about in PACKAGES.items():
                self.pack(package, about)
        finally:
            shutil.rmtree(self.scratch, ignore_errors=True)


if __name__ == "__main__":
    os.umask(0o022)
    Packages(*sys.argv[1:6]).make()
