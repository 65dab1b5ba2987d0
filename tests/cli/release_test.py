#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A release, made of small packages in a repository of its own and signed by a key of its own: apt reads and checks it, the source archive has its
commit, the bill of materials is complete, checksums and signatures are right, and a release that would differ from its sources is rejected.
"""

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

from harness import ROOT, Case

MISSING = [name for name in ("gpg", "dpkg-deb", "git", "apt-get", "xz") if not shutil.which(name)]
VERSION = "0.7.1"
CHANGES = f"# Changes\n\n## {VERSION}, today\n\n* It swings.\n\n## 0.7.0\n\n* It hangs.\n"


class Release(Case):
    def setUp(self):
        super().setUp()
        self.environment = {
            **os.environ,
            "GNUPGHOME": str(self.folder / "keys"),
            "GIT_CONFIG_GLOBAL": "/dev/null",
            "GIT_AUTHOR_DATE": "2026-01-02T03:04:05Z",
            "GIT_COMMITTER_DATE": "2026-01-02T03:04:05Z",
        }
        (self.folder / "keys").mkdir(mode=0o700)
        self.addCleanup(self.run_or_fail, "gpgconf", "--kill", "all")
        self.run_or_fail(
            *("gpg", "--batch", "--pinentry-mode", "loopback", "--passphrase", ""),
            *("--quick-generate-key", "Tester <tester@example.org>", "default", "sign"),
        )
        self.root = self.folder / "root"
        (self.root / "cmake").mkdir(parents=True)
        (self.root / "CMakeLists.txt").write_text(f"project(Halcyon VERSION {VERSION} X)\n")
        (self.root / "CHANGELOG.md").write_text(CHANGES)
        for name in ("cmake/commit.txt", ".gitattributes"):
            shutil.copyfile(ROOT / name, self.root / name)
        self.git("init", "-q")
        self.git("add", ".")
        self.git("commit", "-q", "-m", "First")
        self.packages = self.folder / "packages"
        for name, architecture, depends in (
            ("halcyon", "amd64", "libc6 (>= 2.36), adduser"),
            ("halcyon", "arm64", "libc6 (>= 2.36), adduser"),
            ("halcyon", "armhf", "libc6 (>= 2.36), adduser"),
            ("halcyon-doc", "all", f"halcyon (= {VERSION})"),
        ):
            self.make_package(name, architecture, depends)

    def run_or_fail(self, *words, **how):
        done = subprocess.run(
            [str(word) for word in words],
            capture_output=True,
            text=True,
            env=self.environment,
            **how,
        )
        self.assertEqual(0, done.returncode, (words, done.stdout, done.stderr))
        return done.stdout

    def git(self, *words):
        author = ("-c", "user.name=Tester", "-c", "user.email=tester@example.org")
        return self.run_or_fail("git", *author, "-C", self.root, *words)

    def make_package(self, name, architecture, depends, version=VERSION):
        tree = self.folder / "tree"
        (tree / "DEBIAN").mkdir(parents=True)
        (tree / "DEBIAN/control").write_text(
            f"Package: {name}\nVersion: {version}\nArchitecture: {architecture}\nMaintainer: Tester <tester@example.org>\n"
            f"Depends: {depends}\nDescription: of a test\n Of two\n lines.\n"
        )
        folder = self.packages / architecture
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"{name}_{version}_{architecture}.deb"
        self.run_or_fail("dpkg-deb", "--root-owner-group", "--build", tree, path)
        shutil.rmtree(tree)

    def check(self):
        return self.release(options=("--check",))

    def release(self, key="tester@example.org", url="", options=()):
        """Makes the release; the exit status and what was printed."""
        script = ROOT / "tools/package/release.py"
        self.output = self.folder / "release"
        done = subprocess.run(
            [sys.executable, script, *options, self.root, self.packages, self.output, key, url],
            capture_output=True,
            text=True,
            env=self.environment,
        )
        return done.returncode, done.stdout + done.stderr

    def add_repository(self, folder):
        """What add-repository of a folder writes for apt: its exit status, what it prints, and the file."""
        target = self.folder / "halcyon.sources"
        script = (folder / "add-repository").read_text()
        script = script.replace("/etc/apt/sources.list.d/halcyon.sources", str(target))
        changed = folder / "add-repository-here"
        changed.write_text(script.replace('"$(id -u)" -eq 0', "0 -eq 0"))
        done = subprocess.run(["sh", changed], capture_output=True, text=True)
        changed.unlink()
        return done.returncode, done.stdout + done.stderr, target

    def apt(self, architecture, *words, folder=None):
        """apt-get with folders of its own, the repository of a folder and no other."""
        status, said, sources = self.add_repository(folder or self.output)
        self.assertEqual(0, status, said)
        state = self.folder / f"apt-{architecture}"
        for name in ("lists/partial", "archives/partial", "etc"):
            (state / name).mkdir(parents=True, exist_ok=True)
        (state / "status").touch()
        options = {
            "APT::Architecture": architecture,
            "APT::Architectures": architecture,
            "APT::Sandbox::User": "",
            "Dir::State": state,
            "Dir::State::lists": state / "lists",
            "Dir::State::status": state / "status",
            "Dir::Cache": state,
            "Dir::Etc::sourcelist": "/dev/null",
            "Dir::Etc::sourceparts": state / "etc",
            "Dir::Etc::main": "/dev/null",
            "Dir::Etc::parts": "/dev/null",
            "Dir::Etc::trusted": "/dev/null",
            "Dir::Etc::trustedparts": "/dev/null",
        }
        shutil.copyfile(sources, state / "etc/halcyon.sources")
        done = subprocess.run(
            ["apt-get", *(f"-o{name}={value}" for name, value in options.items()), *words],
            capture_output=True,
            text=True,
            cwd=state,
        )
        return done.returncode, done.stdout + done.stderr

    def test_apt_reads_it_for_each_architecture(self):
        status, said = self.release()
        self.assertEqual(
            (0, f"{self.output}: Halcyon {VERSION} for amd64, arm64, armhf\n"), (status, said)
        )
        for architecture in ("amd64", "arm64", "armhf"):
            status, said = self.apt(architecture, "update")
            self.assertEqual(0, status, said)
            self.assertNotIn("W:", said)
            for name, of in (("halcyon", architecture), ("halcyon-doc", "all")):
                status, said = self.apt(architecture, "download", name)
                self.assertEqual(0, status, said)
                loaded = self.folder / f"apt-{architecture}" / f"{name}_{VERSION}_{of}.deb"
                original = self.packages / of / loaded.name
                self.assertEqual(original.read_bytes(), loaded.read_bytes())

    def test_apt_rejects_what_was_changed(self):
        self.assertEqual(0, self.release()[0])
        path = self.output / "apt/dists/stable/main/binary-amd64/Packages"
        for name in ("Packages", "Packages.gz"):
            path.with_name(name).unlink()
        path.write_text("Package: halcyon\nVersion: 9\nArchitecture: amd64\nFilename: x\nSize: 1\n")
        self.assertNotEqual(0, self.apt("amd64", "update")[0])
        self.assertEqual(0, self.release()[0])
        release = self.output / "apt/dists/stable/InRelease"
        release.write_text(release.read_text().replace("Label: Halcyon", "Label: Another"))
        status, said = self.apt("arm64", "update")
        self.assertNotEqual(0, status, said)

    def test_a_copy_of_the_folder_installs_from_its_own_place(self):
        self.assertEqual(0, self.release()[0])
        copy = self.folder / "stick"
        shutil.copytree(self.output, copy)
        shutil.rmtree(self.output)
        self.assertEqual(0, self.apt("amd64", "update", folder=copy)[0])
        self.assertEqual(0, self.apt("amd64", "download", "halcyon", folder=copy)[0])
        self.assertNotIn(str(self.output), "".join(p.read_text() for p in copy.glob("*.md")))
        self.assertFalse(
            (copy / "halcyon.sources").exists(), "it would name the place where it was made"
        )
        shutil.rmtree(copy / "apt")
        self.assertEqual(
            (1, f"add-repository: {copy} is not the folder of a release\n"),
            self.add_repository(copy)[:2],
        )

    def test_the_address_is_where_it_is_published(self):
        self.assertEqual(0, self.release(url="https://example.org/halcyon/")[0])
        sources = (self.output / "halcyon.sources").read_text()
        self.assertIn("URIs: https://example.org/halcyon/apt\n", sources)
        self.assertIn("\n -----BEGIN PGP PUBLIC KEY BLOCK-----\n .\n", sources)

    def test_the_notes_list_what_is_in_the_folder(self):
        for url in ("", "https://example.org/halcyon"):
            self.assertEqual(0, self.release(url=url)[0])
            rows = re.findall(r"(?m)^\| (`.*?) \| ", (self.output / "NOTES.md").read_text())
            listed = {name.rstrip("/") for row in rows for name in re.findall(r"`(.*?)`", row)}
            self.assertEqual({p.name for p in self.output.iterdir()} - {"NOTES.md"}, listed)

    def test_checksums_and_signatures_are_of_all_files(self):
        self.assertEqual(0, self.release()[0])
        sums = (self.output / "SHA256SUMS").read_text()
        listed = {line.split("  ", 1)[1] for line in sums.splitlines()}
        present = {str(p.relative_to(self.output)) for p in self.output.rglob("*") if p.is_file()}
        self.assertEqual({"SHA256SUMS", "SHA256SUMS.gpg"}, present - listed)
        self.run_or_fail("sha256sum", "--quiet", "-c", "SHA256SUMS", cwd=self.output)
        for signature, signed in (
            ("SHA256SUMS.gpg", "SHA256SUMS"),
            ("apt/dists/stable/Release.gpg", "apt/dists/stable/Release"),
        ):
            self.run_or_fail("gpg", "--verify", self.output / signature, self.output / signed)

    def test_the_source_archive_has_its_commit(self):
        self.assertEqual(0, self.release()[0])
        (self.folder / "source").mkdir()
        archive = self.output / f"halcyon-{VERSION}.tar.xz"
        self.run_or_fail("tar", "-C", self.folder / "source", "-xf", archive)
        tree = self.folder / "source" / f"halcyon-{VERSION}"
        commit = self.git("rev-parse", "HEAD").strip()
        self.assertEqual(f"{commit}\n", (tree / "cmake/commit.txt").read_text())
        made = self.folder / "commit.cpp"
        script = ROOT / "cmake/commit.cmake"
        self.run_or_fail("cmake", f"-DROOT={tree}", f"-DOUTPUT={made}", "-DGIT=", "-P", script)
        self.assertIn(f'commit = "{commit[:10]}"', made.read_text())
        self.run_or_fail("cmake", f"-DROOT={self.root}", f"-DOUTPUT={made}", "-DGIT=", "-P", script)
        self.assertIn('commit = "unknown"', made.read_text())

    def test_the_bill_of_materials_names_packages_and_what_they_need(self):
        self.assertEqual(0, self.release()[0])
        bill = json.loads((self.output / f"halcyon-{VERSION}.spdx.json").read_text())
        packages = {one["SPDXID"]: one for one in bill["packages"]}
        self.assertEqual(len(packages), len(bill["packages"]))
        known = set(packages) | {"SPDXRef-DOCUMENT"}
        related = set()
        for relation in bill["relationships"]:
            ends = relation["spdxElementId"], relation["relatedSpdxElement"]
            self.assertLessEqual(set(ends), known)
            names = [packages[end]["name"] if end in packages else end for end in ends]
            related.add((names[0], relation["relationshipType"], names[1]))
        for relation in (
            ("halcyon", "DEPENDS_ON", "libc6"),
            ("halcyon", "GENERATED_FROM", "halcyon-source"),
            ("SPDXRef-DOCUMENT", "DESCRIBES", "halcyon-doc"),
            ("halcyon", "STATIC_LINK", "nlohmann-json3-dev"),
        ):
            self.assertIn(relation, related)
        self.assertNotIn(("halcyon-doc", "DEPENDS_ON", "halcyon"), related)
        for path in self.packages.rglob("*.deb"):
            digest = hashlib.sha256(path.read_bytes()).hexdigest()
            found = [
                p["checksums"][0]["checksumValue"]
                for p in packages.values()
                if p.get("packageFileName") == path.name
            ]
            self.assertEqual([digest], found)

    def test_the_bill_of_materials_has_what_programs_are_linked_with(self):
        sys.path.insert(0, str(ROOT / "tools/package"))
        from sbom import COMPILED_IN

        packages = {
            "${HALCYON_CAP}": "libcap-dev",
            "${HALCYON_CMARK_EXTENSIONS}": "libcmark-gfm-extensions-dev",
            "${HALCYON_CMARK}": "libcmark-gfm-dev",
            "${HALCYON_EDIT}": "libedit-dev",
            "${HALCYON_LZ4_LIBRARY}": "liblz4-dev",
            "${HALCYON_ZSTD_LIBRARY}": "libzstd-dev",
            "bsd": "libbsd-dev",
            "md": "libmd-dev",
        }
        linked = set()
        for path in ROOT.glob("*/**/CMakeLists.txt"):
            if "build" not in path.relative_to(ROOT).parts:
                for words in re.findall(r"halcyon_in_programs\(\w+ ([^)]*)\)", path.read_text()):
                    linked |= {packages[word.strip('"')] for word in words.split()}
        self.assertEqual(set(packages.values()), linked)
        self.assertLessEqual(linked, set(COMPILED_IN))

    def test_it_is_the_same_to_the_byte_when_it_is_made_again(self):
        def unsigned():
            signed = r"(InRelease|\.gpg|SHA256SUMS)$"
            return {
                p.relative_to(self.output): p.read_bytes()
                for p in self.output.rglob("*")
                if p.is_file() and not re.search(signed, p.name)
            }

        self.assertEqual(0, self.release()[0])
        first = unsigned()
        self.assertEqual(0, self.release()[0])
        self.assertEqual(first, unsigned())

    def test_the_notes_are_the_section_of_the_version(self):
        self.assertEqual(0, self.release()[0])
        text = (self.output / "NOTES.md").read_text()
        self.assertIn("It swings.", text)
        self.assertNotIn("It hangs.", text)
        self.assertNotIn("@", text.replace("<tester@example.org>", ""))

    def test_what_is_no_release_is_rejected(self):
        status, said = self.release(key="nobody@example.org")
        self.assertEqual(1, status)
        self.assertEqual(
            "hal: GnuPG has no secret key 'nobody@example.org' to sign with; to list those it has: gpg --list-secret-keys; "
            "to make one: gpg --quick-generate-key 'NAME <ADDRESS>' default sign\n",
            said,
        )
        (self.root / "new.txt").touch()
        status, said = self.release()
        self.assertEqual(1, status)
        self.assertEqual(
            "hal: a release is made of commits, and 1 files differ from the last one; type: git status\n",
            said,
        )
        (self.root / "new.txt").unlink()
        self.make_package("halcyon", "amd64", "libc6", version="0.7.0")
        old = self.packages / "amd64/halcyon_0.7.0_amd64.deb"
        self.assertEqual(
            (1, f"hal: {old} is not of version {VERSION}; remove it\n"), self.release()
        )
        old.unlink()
        self.assertEqual(0, self.check()[0])
        (self.root / "CHANGELOG.md").write_text("# Changes\n")
        self.git("commit", "-q", "-a", "-m", "No notes")
        self.assertEqual((1, f"hal: CHANGELOG.md has no section '## {VERSION}'\n"), self.release())
        self.assertEqual(self.release(), self.check(), "before anything is compiled")


if __name__ == "__main__":
    if MISSING:
        print(f"needs {', '.join(MISSING)}")
        sys.exit(77)
    unittest.main()
