#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""`hal run --group`: who may see and control the machine of another user, as that of a service."""
import grp
import os
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

from harness import HAL, SERVO, TIMEOUT, Case, wait_until

SERVICES = Path("/run/halcyon")  # systemd makes a folder for each service here
OWNER, MEMBER, STRANGER = 65534, 65533, 65532  # users of this test
GROUP = "games"


@unittest.skipUnless(os.geteuid() == 0 and shutil.which("setpriv"), "needs root and setpriv")
class Shared(Case):
    def setUp(self):
        super().setUp()
        os.chmod(self.folder, 0o755)
        self.group = grp.getgrnam(GROUP).gr_gid
        self.name = f"test-{os.getpid()}"
        self.service = SERVICES / self.name
        SERVICES.mkdir(0o755, exist_ok=True)
        self.service.mkdir()
        self.service.chmod(0o711)
        self.addCleanup(shutil.rmtree, self.service)
        os.chown(self.service, OWNER, OWNER)

    def words(self, user, *words, groups=()):
        groups = f"--groups={','.join(map(str, groups))}" if groups else "--clear-groups"
        return ["setpriv", f"--reuid={user}", f"--regid={user}", groups, str(HAL), *words]

    def as_user(self, user, *words, groups=()):
        """Runs hal as another user, who has folders of his own."""
        own = self.folder / str(user)
        own.mkdir(exist_ok=True)
        os.chown(own, user, user)
        return subprocess.run(
            self.words(user, *words, groups=groups),
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
            env=self.environment | {"XDG_RUNTIME_DIR": str(own), "HOME": str(own), "USER": "me"},
            timeout=TIMEOUT,
            check=False,
        )

    def run_service(self, *options, groups):
        """Starts the machine as the unit halcyon@NAME does."""
        netlist = self.write("a.hal", SERVO + "start\n")
        machine = subprocess.Popen(
            self.words(
                OWNER, "run", "--no-picture", "--name", self.name, *options, netlist, groups=groups
            ),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            env=self.environment | {"XDG_RUNTIME_DIR": str(self.service)},
            cwd=self.folder,
        )

        def end():
            machine.terminate()
            machine.communicate(timeout=TIMEOUT)

        self.addCleanup(end)
        wait_until(lambda: (self.service / "halcyon" / f"{self.name}.sock").exists(), "it listens")
        return machine

    def test_members_of_the_group_find_and_control_a_service(self):
        self.run_service("--group", GROUP, groups=[self.group])
        for path, mode in (("", 0o750), (f"{self.name}.sock", 0o660), (f"{self.name}.lock", 0o640)):
            about = (self.service / "halcyon" / path).stat()
            self.assertEqual((mode, self.group), (about.st_mode & 0o777, about.st_gid), path)
        member = {"groups": [self.group]}
        # the only machine that runs needs no name
        done = self.as_user(MEMBER, "shell", "newsig", "mine", "float", **member)
        self.assertEqual((0, ""), (done.returncode, done.stderr))
        done = self.as_user(MEMBER, "shell", "--name", self.name, "gets", "mine", **member)
        self.assertEqual((0, "0\n"), (done.returncode, done.stdout))
        self.assertIn(self.name, self.as_user(MEMBER, "top", "--once", **member).stdout)
        primary = ["setpriv", f"--reuid={MEMBER}", f"--regid={self.group}", "--clear-groups"]
        done = subprocess.run(
            [*primary, str(HAL), "shell", "--name", self.name, "gets", "mine"],
            capture_output=True,
            text=True,
            env=self.environment | {"XDG_RUNTIME_DIR": str(self.folder)},
            timeout=TIMEOUT,
            check=False,
        )
        self.assertEqual("0\n", done.stdout, done.stderr)

    def test_anyone_else_is_told_how_to_join(self):
        self.run_service("--group", GROUP, groups=[self.group])
        done = self.as_user(STRANGER, "shell", "--name", self.name, "show", "thread")
        self.assertEqual(1, done.returncode)
        self.assertEqual(
            f"hal shell: instance '{self.name}' is shared with the group '{GROUP}', which you are not in; "
            f"type: sudo adduser $USER {GROUP}, then log in again\n",
            done.stderr,
        )
        self.assertNotIn(self.name, self.as_user(STRANGER, "top", "--once").stdout)

    def test_without_the_option_only_the_user_controls_it(self):
        self.run_service(groups=[self.group])
        done = self.as_user(MEMBER, "shell", "--name", self.name, "show", "thread", groups=[self.group])
        self.assertEqual(1, done.returncode)
        self.assertIn(f"no instance '{self.name}' is running", done.stderr)

    def test_a_group_that_cannot_be_used_is_an_error(self):
        netlist = self.write("a.hal", SERVO)
        for group, said in (
            ("no-such-group", "unknown group 'no-such-group'"),
            ("root", "cannot be given to the group: Operation not permitted"),
        ):
            done = self.as_user(OWNER, "run", "--group", group, str(self.folder / netlist), "--for", "10ms")
            self.assertEqual(1, done.returncode, group)
            self.assertIn(said, done.stderr)


def own_run():
    """Continues with a /run of its own: other tests would see the machines of this one. Skips where that is not possible."""
    if os.geteuid() != 0 or os.environ.get("HALCYON_OWN_RUN"):
        return
    mounted = ["unshare", "--mount", "sh", "-c", 'mount -t tmpfs none /run && exec "$@"', "sh"]
    if not shutil.which("unshare") or subprocess.run([*mounted, "true"], check=False).returncode:
        print("needs a mount namespace of its own")
        sys.exit(77)
    os.environ["HALCYON_OWN_RUN"] = "1"
    os.execvp(mounted[0], [*mounted, sys.executable, *sys.argv])


if __name__ == "__main__":
    own_run()
    unittest.main()
