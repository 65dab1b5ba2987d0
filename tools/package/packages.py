# SPDX-License-Identifier: MIT
"""The Debian packages: which files each has, and its control fields."""

OWN = "halcyon (= {version})"

# What lintian reports and is meant so: a component takes what it needs from the program that loads it.
PLUGINS = "library-not-linked-against-libc [usr/lib/halcyon/components/*]"

# name: depends besides the libraries, further fields, summary, description, accepted reports of lintian
PACKAGES = {
    "halcyon": {
        "depends": "adduser, libcap2-bin, iproute2",
        "lintian": [
            PLUGINS,
            "python3-script-but-no-python3-dep * [usr/share/halcyon/halfiles/*]",
        ],  # pictures of examples
        "fields": {
            "Recommends": "libpam-modules, python3",
            "Suggests": "halcyon-dev, halcyon-doc, can-utils, graphviz",
        },
        "summary": "real-time dataflow runtime in the manner of LinuxCNC's HAL",
        "text": "Control components are wired together by netlist files and run in real-time\nthreads; a shell inspects and rewires the running machine. CANopen, EtherCAT\n"
        "and TDMA on Ethernet are components like any other.\n.\nContains the program hal, the core components, the buses and the machines to\nstart from.",
    },
    "halcyon-linuxcnc": {
        "depends": OWN,
        "fields": {
            "Conflicts": "linuxcnc-uspace, linuxcnc",
            "Breaks": "halcyon-doc (<< 0.2.0)",  # had the manual page halcmd
            "Replaces": "halcyon-doc (<< 0.2.0)",
            "Architecture": "all",
        },
        "summary": "LinuxCNC's command names for Halcyon",
        "text": "halrun, halcmd, halcompile, halmeter, halsampler, halscope, halshow, halstreamer,\nhaltcl, lcec_conf and mb2hal as names of the program hal. Programs that a machine starts\nfind them without this package.",
    },
    "halcyon-vision": {
        "depends": OWN,
        "lintian": [PLUGINS],
        "summary": "cameras and markers for Halcyon",
        "text": "The components that use OpenCV.",
    },
    "halcyon-dds": {
        "depends": OWN,
        "lintian": [PLUGINS],
        "summary": "distribution over DDS for Halcyon",
        "text": "The components that use Fast DDS: signals as topics, also for ROS 2, and\nmachines of several computers.",
    },
    "halcyon-estimation": {
        "depends": OWN,
        "lintian": [PLUGINS],
        "summary": "estimation and state control for Halcyon",
        "text": "Kalman filters, state feedback, observers, force and torque.",
    },
    "halcyon-panel": {
        "depends": OWN,
        "summary": "web panel of running Halcyon machines",
        "text": "The command hal panel: values, graph, scope and user panels in a browser.",
    },
    "python3-halcyon": {
        "depends": OWN + ", python3 (>= 3.11), python3 (<< 3.12)",
        "fields": {"Section": "python"},
        "summary": "components and clients of Halcyon in Python",
        "text": "The modules hal and halcyon. Where LinuxCNC is installed, its module hal takes\nprecedence outside of Halcyon's own machines.",
    },
    "halcyon-dev": {
        "depends": OWN + ", g++",
        "fields": {
            "Recommends": "cmake, ninja-build, libpugixml-dev",
            "Section": "libdevel",
            "Conflicts": "linuxcnc-uspace-dev, linuxcnc-dev",
        },
        "summary": "headers and CMake package of Halcyon",
        "text": "What hal compile, hal new component and find_package(Halcyon) need.",
    },
    "halcyon-doc": {
        "depends": "",
        "lintian": ["extra-license-file [usr/share/doc/halcyon/LICENSE]"],  # README.md links it
        "fields": {"Section": "doc", "Architecture": "all"},
        "summary": "pages and component reference of Halcyon",
        "text": "Tutorials, guides and manual pages; as one searchable site in\n/usr/share/doc/halcyon/html.",
    },
}

DOC = "usr/share/doc/Halcyon/"
ALIASES = "(halrun|halcmd|halcompile|halmeter|halsampler|halscope|halshow|halstreamer|haltcl|lcec_conf|mb2hal)"
GROUPS = ("vision", "dds", "estimation")  # components that are packages of their own

# (pattern of a path in the installation, package, new path or None for the same); the first match counts. Package None: left out.
RULES = (
    (rf"{DOC}reference/.*", None, None),  # is in the site
    (rf"{DOC}halfiles/(.*)", "halcyon", r"usr/share/halcyon/halfiles/\1"),
    (rf"{DOC}tests/netlists/(.*)", "halcyon-doc", r"usr/share/doc/halcyon/tests/netlists/\1"),
    (rf"{DOC}(.*)", "halcyon-doc", r"usr/share/doc/halcyon/\1"),
    (
        r"usr/share/man/man1/halcmd\.1",
        "halcyon-linuxcnc",
        None,
    ),  # LinuxCNC's package has this page too
    (r"usr/share/man/.*", "halcyon-doc", None),
    (rf"usr/bin/{ALIASES}", "halcyon-linuxcnc", None),
    (r"usr/share/bash-completion/completions/halcmd", "halcyon-linuxcnc", None),
    (r"usr/bin/hal-panel", "halcyon-panel", None),
    (r"usr/include/.*|usr/lib/cmake/.*|usr/lib/[^/]*\.a|usr/lib/lib[^/]*\.so", "halcyon-dev", None),
    (r"usr/lib/halcyon/python/.*", "python3-halcyon", None),
    (r"usr/lib/libhalcyon_dds\..*", "halcyon-dds", None),
    (r"usr/lib/libhalcyon_vision\..*", "halcyon-vision", None),
    (r"usr/.*|etc/.*|lib/.*", "halcyon", None),
)

# What only packages have: file in files/, package, path, mode
EXTRA = (
    ("halcyon@.service", "halcyon", "lib/systemd/system/halcyon@.service", 0o644),
    ("halcyon-can@.service", "halcyon", "lib/systemd/system/halcyon-can@.service", 0o644),
    ("limits.conf", "halcyon", "etc/security/limits.d/halcyon-realtime.conf", 0o644),
    ("60-halcyon.rules", "halcyon", "lib/udev/rules.d/60-halcyon.rules", 0o644),
    ("README.etc", "halcyon", "etc/halcyon/README", 0o644),
    ("halcyon.pth", "python3-halcyon", "usr/lib/python3/dist-packages/halcyon.pth", 0o644),
)
