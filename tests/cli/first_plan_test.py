# SPDX-License-Identifier: MIT
"""A thread that gets no CPU time before it takes its first plan: an error, as on a busy host."""
import shutil
import subprocess
import unittest

from harness import SANITIZED, Case

DELAY = """#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <string.h>
#include <time.h>
typedef int (*sleeper)(clockid_t, int, const struct timespec*, struct timespec*);
int clock_nanosleep(clockid_t clock, int flags, const struct timespec* time, struct timespec* left) {
    static int delayed;
    const sleeper next = (sleeper)dlsym(RTLD_NEXT, "clock_nanosleep");
    char name[16] = "";
    pthread_getname_np(pthread_self(), name, sizeof name);
    if (!delayed && strcmp(name, "servo") == 0) {
        const struct timespec second = {1, 0};
        delayed = 1;
        next(CLOCK_MONOTONIC, 0, &second, 0);
    }
    return next(clock, flags, time, left);
}
"""


@unittest.skipIf(SANITIZED, "the sanitizer's library must be the first")
@unittest.skipUnless(shutil.which("cc"), "no compiler is installed")
class FirstPlan(Case):
    def test_a_thread_that_is_late_for_its_first_plan_is_an_error(self):
        source = self.write("delay.c", DELAY)
        library = str(self.folder / "delay.so")
        subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source], check=True)
        path = self.write(
            "a.hal",
            "newthread servo 1000000 policy=other\nloadrt sum2 names=adder\naddf adder servo\n",
        )
        done = self.run_program(
            "run", "--no-picture", "--for", "10ms", path, environment={"LD_PRELOAD": library}
        )
        self.assertEqual(1, done.returncode, done.stderr)
        self.assertIn("thread 'servo'", done.stderr)
        self.assertRegex(done.stderr, r"\[(hung|starved)-thread\]")


if __name__ == "__main__":
    unittest.main()
