#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The Debian packages: lintian, installation in a clean Debian 12, a machine there as an ordinary user, removal. Needs root and a mirror.

HALCYON_PACKAGES: a folder with packages to test, instead of making them. HALCYON_CHROOT: a tar archive of Debian 12 to start from.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ.get("HAL_BIN", ROOT / "build/release/bin/hal")).resolve().parents[1]
PARTS = (
    "halcyon",
    "halcyon-linuxcnc",
    "halcyon-estimation",
    "halcyon-doc",
)  # without the large libraries
SERVICE_KEYS = (
    "Type=notify",
    "User=halcyon",
    "WatchdogSec=5",
    "Restart=on-failure",
    "NoNewPrivileges=yes",
    "ProtectSystem=strict",
)


def run(*words, **how):
    return subprocess.run(
        [str(word) for word in words],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        **how,
    )


def skip(reason):
    print(reason)
    sys.exit(77)


class Chroot(unittest.TestCase):
    maxDiff = None

    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="halcyon-chroot-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, True)
        if given := os.environ.get("HALCYON_PACKAGES"):
            cls.packages = Path(given)
        else:
            cls.packages = cls.folder / "packages"
            made = run(sys.executable, ROOT / "tools/package/build.py", ROOT, BUILD, cls.packages)
            assert made.returncode == 0, made.stdout + made.stderr
        cls.root = cls.folder / "root"
        if archive := os.environ.get("HALCYON_CHROOT"):
            cls.root.mkdir()
            made = run("tar", "-C", cls.root, "-xf", archive)
        else:
            made = run("mmdebstrap", "--variant=minbase", "bookworm", cls.root)
        if made.returncode != 0:
            print(made.stderr)
            skip("mmdebstrap cannot make a Debian 12 here: no mirror?")
        (cls.root / "packages").mkdir()
        for path in cls.packages.glob("*.deb"):
            shutil.copy(path, cls.root / "packages")

    @classmethod
    def inside(cls, script):
        """A shell command as root in the chroot, with /proc, /dev and this system's name servers."""
        mounts = 'mount -t proc proc "$0/proc"; mount --rbind /dev "$0/dev"; mount --bind /etc/resolv.conf "$0/etc/resolv.conf" 2>/dev/null; exec chroot "$0" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive sh -c "$1"'
        return run("unshare", "-m", "sh", "-c", mounts, cls.root, script)

    def good(self, script, tries=1):
        done = self.inside(script)
        if done.returncode != 0 and tries > 1 and "[starved-thread]" in done.stdout:
            return self.good(script, tries - 1)
        self.assertEqual(
            0, done.returncode, f"{script}\n{done.stdout[-3000:]}{done.stderr[-3000:]}"
        )
        return done.stdout

    def of_user(self, script, tries=1):
        return self.good(f"su tester -c '{script}'", tries)

    def files(self):
        """What is in the chroot, except what apt and the accounts leave."""
        listed = self.good(
            "find / -xdev \\( -path /proc -o -path /dev -o -path /packages -o -path /var/lib/apt -o -path /var/lib/dpkg -o -path /var/cache "
            "-o -path /var/log -o -path /tmp -o -path /run -o -path /home \\) -prune -o -print"
        ).splitlines()
        return set(listed)

    def test_lintian_has_no_errors(self):
        if not shutil.which("lintian"):
            self.skipTest("needs lintian")
        done = run(
            "lintian",
            "--fail-on",
            "error",
            "--tag-display-limit",
            "0",
            "--suppress-tags",
            "bad-distribution-in-changes-file",
            *self.packages.glob("*.deb"),
        )
        self.assertEqual([], [line for line in done.stdout.splitlines() if line.startswith("E:")])

    def test_every_package_is_complete_and_no_file_is_in_two(self):
        seen = {}
        for path in self.packages.glob("*.deb"):
            for line in run("dpkg-deb", "-c", path).stdout.splitlines():
                name = line.split()[5]
                if not name.endswith("/"):
                    self.assertNotIn(name, seen, f"in {path.name} and {seen.get(name)}")
                    seen[name] = path.name
        for name, package in (
            ("./usr/bin/hal", "halcyon_"),
            ("./usr/bin/halcmd", "halcyon-linuxcnc_"),
            ("./usr/lib/halcyon/components/pid.so", "halcyon_"),
            ("./usr/lib/halcyon/components/lqr.so", "halcyon-estimation_"),
            ("./usr/include/hal/component.hpp", "halcyon-dev_"),
            ("./usr/share/halcyon/halfiles/furuta/hang.hal", "halcyon_"),
            ("./usr/share/doc/halcyon/README.md", "halcyon-doc_"),
            ("./usr/share/doc/halcyon/LICENSE", "halcyon-doc_"),
        ):
            self.assertTrue(seen.get(name, "").startswith(package), (name, seen.get(name)))

    def test_installs_runs_as_an_ordinary_user_and_is_removed(self):
        updated = self.inside("apt-get -o APT::Update::Error-Mode=any update")
        if updated.returncode != 0:
            self.skipTest(f"needs a mirror of Debian: {updated.stderr.strip()[-300:]}")
        self.good("apt-get install -y --no-install-recommends adduser libcap2-bin iproute2 procps")
        # What the packages depend on, so that what remains after their removal is compared with that.
        self.good(
            "apt-get install -y --no-install-recommends $(apt-get -s install --no-install-recommends /packages/halcyon_*.deb /packages/halcyon-estimation_*.deb "
            "| sed -n 's/^Inst \\([^ ]*\\) .*/\\1/p' | grep -v halcyon)"
        )
        before = self.files()
        install, run_it = self.page_commands("./hal package").splitlines()[1:]
        self.good(
            install.replace(
                "sudo apt install", "apt-get install -y --no-install-recommends"
            ).replace("./build/packages/", "/packages/")
        )
        self.assertIn("servo-thread", self.good(run_it.replace("10s", "1s") + " 2>&1"))
        self.good(
            "apt-get install -y --no-install-recommends "
            + " ".join(f"/packages/{name}_*.deb" for name in PARTS)
        )
        self.good("useradd -m tester")
        # Removed again, everything but the accounts, their folders and /etc is as before.
        self.check_permissions()
        self.check_machine()
        self.check_service()
        self.good("apt-get purge -y " + " ".join(PARTS))
        left = {
            path
            for path in self.files() - before
            if not path.startswith(
                (
                    "/etc/passwd",
                    "/etc/group",
                    "/etc/shadow",
                    "/etc/gshadow",
                    "/etc/sub",
                    "/etc/ld.so.cache",
                    "/etc/apt",
                )
            )
        }
        self.assertEqual(set(), {path for path in left if "halcyon" in path or "/hal" in path})

    def check_permissions(self):
        self.assertIn("realtime", self.good("getent group realtime"))
        self.assertIn("realtime", self.good("id -nG halcyon"))
        self.assertIn(
            "@realtime - rtprio 98", self.good("cat /etc/security/limits.d/halcyon-realtime.conf")
        )
        capabilities = self.good("getcap /usr/bin/hal")
        if capabilities:
            self.assertEqual(
                "/usr/bin/hal cap_ipc_lock,cap_net_raw,cap_sys_nice=ep\n",
                capabilities.replace("cap_net_raw,cap_ipc_lock", "cap_ipc_lock,cap_net_raw"),
            )
            report = self.of_user("hal doctor --seconds 0")
            for subject in ("SCHED_FIFO", "memory locking", "capabilities", "raw Ethernet"):
                self.assertRegex(report, rf"good +{subject}")

            restricted = (
                self.page_commands("dpkg-statoverride")
                .replace("sudo ", "")
                .replace("USER", "tester")
            )
            self.good(restricted)
            self.assertEqual(
                capabilities,
                self.good("getcap /usr/bin/hal"),
                "restricted to a group, as docs/packages.md describes",
            )
            self.of_user("hal --version")
            self.assertNotEqual(
                0, self.inside("su -s /bin/sh nobody -c 'hal --version'").returncode
            )
            self.good(
                "dpkg-statoverride --remove /usr/bin/hal; chown root:root /usr/bin/hal; chmod 0755 /usr/bin/hal; dpkg-reconfigure halcyon; gpasswd -d tester realtime"
            )
            self.check_withheld()

    def page_commands(self, word):
        """The block of docs/packages.md that has this word."""
        blocks = re.findall(r"(?s)```sh\n(.*?)```", (ROOT / "docs/packages.md").read_text())
        return next(block for block in blocks if word in block)

    def check_withheld(self):
        """Installed where the capabilities are withheld: one notice, and a remedy that does not make the program unusable."""
        without = "capsh --drop=cap_sys_nice,cap_ipc_lock,cap_net_raw -- -c "
        self.good(without + "'dpkg-reconfigure halcyon'")
        report = self.good(
            without
            + "'su tester -c \"hal run /usr/share/halcyon/halfiles/furuta/hang.hal --for 1s 2>&1\"'"
        )
        self.assertEqual(1, len(re.findall(r"(?m)^no .* here: ", report)), report)
        self.assertIn("no real-time scheduling and memory locking here: ", report)
        self.assertIn(
            "--cap-add=SYS_NICE --cap-add=IPC_LOCK --cap-add=NET_RAW in the command that starts this container",
            report,
        )
        self.assertNotIn("setcap", self.good(without + "'su tester -c \"hal doctor --seconds 0\"'"))
        self.good("dpkg-reconfigure halcyon")

    def check_machine(self):
        self.assertRegex(self.of_user("hal --version"), r"^hal \d+\.\d+\.\d+ ")
        # again when other programs take the CPU until the machine stops
        report = self.of_user(
            "cd; hal run /usr/share/halcyon/halfiles/furuta/hang.hal --for 2s 2>&1", tries=3
        )
        self.assertRegex(report, r"servo-thread +1 ms +\d{4}")
        if self.good("getcap /usr/bin/hal"):
            self.assertIn("SCHED_FIFO", report)
        shown = self.of_user(
            "cd; hal sim /usr/share/halcyon/halfiles/furuta/swing-up.hal --for 1s --show pendulum-angle 2>&1"
        )
        self.assertNotIn("error", shown)
        self.assertGreater(
            abs(float(re.search(r"pendulum-angle +(\S+)", shown)[1])),
            0.1,
            "the pendulum of docs/packages.md moves",
        )
        self.assertIn("first-order", self.of_user("hal doc lowpass").lower())
        self.assertIn("NAME", self.of_user("hal doc lqr"))
        self.assertEqual(
            "hal-pid.9.gz", Path(self.good("ls /usr/share/man/man9/hal-pid.9.gz").strip()).name
        )
        # A machine from boot as docs/packages.md describes; the command of the service, as its user, stands for systemd.
        copy, link, enable, ask = self.page_commands("/etc/halcyon/pendulum").splitlines()
        self.assertEqual("sudo systemctl enable --now halcyon@pendulum", enable)
        for command in (copy, link, self.page_commands("/etc/halcyon/can/can0").splitlines()[0]):
            self.good(command.replace("sudo ", ""))
        self.assertEqual(
            "BITRATE=500000\n", self.good("cat /etc/halcyon/can/can0; rm /etc/halcyon/can/can0")
        )
        self.good("install -d -o halcyon -g halcyon -m 0700 /run/halcyon/pendulum")
        report = self.good(
            "cd /etc/halcyon/pendulum && su -s /bin/sh halcyon -c 'XDG_RUNTIME_DIR=/run/halcyon/pendulum; export XDG_RUNTIME_DIR; "
            "hal run --no-picture --name pendulum machine.hal --for 10s 2>&1 & "
            f"for i in $(seq 40); do sleep 0.2; {ask.removeprefix('sudo -u halcyon ')} && break; done; wait'"
        )
        self.assertIn("Threads:", report)
        self.assertIn("servo-thread", report)
        self.good("rm -r /etc/halcyon/pendulum /run/halcyon")

    def check_service(self):
        unit = self.good("cat /lib/systemd/system/halcyon@.service")
        for key in SERVICE_KEYS:
            self.assertIn(f"\n{key}\n", unit)
        command = re.search(r"ExecStart=(.*)", unit)[1]
        self.assertEqual(
            "/usr/bin/hal run --no-picture --name %i --group realtime $HAL_OPTIONS machine.hal",
            command,
        )
        if shutil.which("systemd-analyze"):
            units = self.root / "lib/systemd/system"
            checked = run(
                "systemd-analyze",
                "security",
                "--offline=true",
                "--threshold=60",
                units / "halcyon@.service",
            )
            if "Unknown" not in checked.stderr:
                self.assertEqual(0, checked.returncode, checked.stdout[-500:] + checked.stderr)


if __name__ == "__main__":
    if os.geteuid() != 0:
        skip("needs root")
    if not os.environ.get("HALCYON_CHROOT") and not shutil.which("mmdebstrap"):
        skip("needs mmdebstrap (or HALCYON_CHROOT)")
    if run("unshare", "-m", "true").returncode != 0:
        skip("needs namespaces")
    unittest.main()
