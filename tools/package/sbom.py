# SPDX-License-Identifier: MIT
"""The bill of materials of a release: SPDX 2.3 in JSON, https://spdx.github.io/spdx-spec/v2.3/."""

import hashlib
import re
import subprocess

NAMESPACE = "https://spdx.org/spdxdocs"

PROGRAMS = ("halcyon", "halcyon-panel")

# Debian package: its licence, where one holds for all of it, and the packages of ours that contain code of it, because it consists of headers or
# is linked as an archive (halcyon_in_programs in the CMake files; a test compares). Everything else that a package uses is in its Depends.
COMPILED_IN = {
    "libbsd-dev": ("NOASSERTION", PROGRAMS),
    "libcap-dev": ("BSD-3-Clause OR GPL-2.0-only", PROGRAMS),
    "libcli11-dev": ("BSD-3-Clause", PROGRAMS),
    "libcmark-gfm-dev": ("NOASSERTION", ("halcyon",)),
    "libcmark-gfm-extensions-dev": ("NOASSERTION", ("halcyon",)),
    "libedit-dev": ("BSD-3-Clause", PROGRAMS),
    "libeigen3-dev": ("MPL-2.0", ("halcyon-estimation",)),
    "liblz4-dev": ("BSD-2-Clause", PROGRAMS),
    "libmd-dev": ("NOASSERTION", PROGRAMS),
    "libzstd-dev": ("BSD-3-Clause OR GPL-2.0-only", PROGRAMS),
    "nlohmann-json3-dev": ("MIT", (*PROGRAMS, "python3-halcyon")),
    "pybind11-dev": ("BSD-3-Clause", ("python3-halcyon",)),
}


def identifier(*words):
    """An SPDXID: letters, digits, dots and hyphens."""
    return "SPDXRef-" + re.sub(r"[^A-Za-z0-9.]+", "-", "-".join(words))


def installed_version(package):
    """The version of a Debian package on this computer; None when it is not installed."""
    done = subprocess.run(
        ["dpkg-query", "-W", "-f", "${db:Status-Status} ${Version}", package],
        capture_output=True,
        text=True,
    )
    status, _, version = done.stdout.partition(" ")
    return version if status == "installed" else None


class Sbom:
    def __init__(self, version, date, source, packages):
        """packages: (control fields, file name, SHA-256) of each Debian package."""
        self.version, self.date, self.source, self.found = version, date, source, packages
        self.packages = {}
        self.relations = []

    def add(self, name, **fields):
        """The identifier of a package of the document, which is added once."""
        key = identifier(name, fields.get("versionInfo", ""), fields.pop("architecture", ""))
        self.packages.setdefault(
            key,
            {
                "SPDXID": key,
                "name": name,
                "downloadLocation": "NOASSERTION",
                "filesAnalyzed": False,
                "licenseConcluded": "NOASSERTION",
                "licenseDeclared": "NOASSERTION",
                "copyrightText": "NOASSERTION",
            }
            | fields,
        )
        return key

    def relate(self, one, kind, other):
        relation = {"spdxElementId": one, "relationshipType": kind, "relatedSpdxElement": other}
        if relation not in self.relations:
            self.relations.append(relation)

    def purl(self, name, version, architecture=""):
        of = f"?arch={architecture}" if architecture else ""
        return [
            {
                "referenceCategory": "PACKAGE-MANAGER",
                "referenceType": "purl",
                "referenceLocator": f"pkg:deb/debian/{name}@{version.replace('+', '%2B')}{of}",
            }
        ]

    def add_source(self):
        data = self.source.read_bytes()
        return self.add(
            "halcyon-source",
            versionInfo=self.version,
            packageFileName=self.source.name,
            licenseDeclared="MIT",
            checksums=[{"algorithm": "SHA256", "checksumValue": hashlib.sha256(data).hexdigest()}],
        )

    def add_compiled_in(self, package, name):
        """What the compiler took into a package. The version is that of this computer; the packages of boards are built with the same Debian."""
        for library, (licence, packages) in COMPILED_IN.items():
            version = installed_version(library)
            if name in packages and version:
                found = self.add(
                    library,
                    versionInfo=version,
                    licenseDeclared=licence,
                    externalRefs=self.purl(library, version),
                )
                self.relate(package, "STATIC_LINK", found)

    def add_dependencies(self, package, fields):
        """What a package needs beside Halcyon's own; the first of several that will do."""
        own = {other["Package"] for other, _, _ in self.found}
        for one in fields.get("Depends", "").split(", "):
            name = one.split(" | ")[0].partition(" ")[0]
            if not name or name in own:
                continue
            needed = self.add(name, comment="of the system on which it is installed")
            self.relate(package, "DEPENDS_ON", needed)

    def document(self):
        source = self.add_source()
        for fields, file, digest in self.found:
            package = self.add(
                fields["Package"],
                architecture=fields["Architecture"],
                versionInfo=fields["Version"],
                packageFileName=file,
                licenseDeclared="MIT",
                checksums=[{"algorithm": "SHA256", "checksumValue": digest}],
                externalRefs=self.purl(
                    fields["Package"], fields["Version"], fields["Architecture"]
                ),
            )
            self.relate("SPDXRef-DOCUMENT", "DESCRIBES", package)
            self.relate(package, "GENERATED_FROM", source)
            self.add_dependencies(package, fields)
            self.add_compiled_in(package, fields["Package"])
        names = "".join(sorted(digest for _, _, digest in self.found))
        unique = hashlib.sha256(names.encode()).hexdigest()[:16]
        return {
            "spdxVersion": "SPDX-2.3",
            "dataLicense": "CC0-1.0",
            "SPDXID": "SPDXRef-DOCUMENT",
            "name": f"halcyon-{self.version}",
            "documentNamespace": f"{NAMESPACE}/halcyon-{self.version}-{unique}",
            "creationInfo": {
                "created": self.date.strftime("%Y-%m-%dT%H:%M:%SZ"),
                "creators": ["Tool: halcyon-release"],
            },
            "packages": list(self.packages.values()),
            "relationships": self.relations,
        }
