# SPDX-License-Identifier: MIT
"""What the peer tests share: checks that are counted and printed, and waits that end."""
import sys
import time

SKIPPED = 77  # exit status: the peer is not here

_held = []


def check(name, holds, *seen):
    """Prints whether something holds, and what was seen when it does not."""
    _held.append(bool(holds))
    what = "" if holds else " " + " ".join(map(str, seen))
    print(f"{'ok  ' if holds else 'FAIL'} {name}{what}", flush=True)


def checked(if_none=1):
    """Prints how many checks hold. Returns the exit status: 0 when all hold, `if_none` without any."""
    print(f"{sum(_held)} of {len(_held)} checks hold")
    if not _held:
        return if_none
    return 0 if all(_held) else 1


def skip(reason):
    """Ends the test as skipped."""
    print(reason)
    sys.exit(SKIPPED)


def wait_for(condition, seconds=120.0):
    """Waits for an event, and returns whether it came: the time only ends a test that would wait
    for ever, on a busy host too."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.005)
    return False
