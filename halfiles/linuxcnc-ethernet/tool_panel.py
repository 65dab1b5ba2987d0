#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The panel beside the machine that confirms a tool change: on a terminal when Enter is pressed, otherwise after half a second."""
import select
import sys
import time

import hal

panel = hal.component("tool-panel")
panel.newpin("change", hal.HAL_BIT, hal.HAL_IN)
panel.newpin("number", hal.HAL_S32, hal.HAL_IN)
panel.newpin("changed", hal.HAL_BIT, hal.HAL_OUT)
panel.ready()


def wait_for_changes():
    confirmed_at = None
    while True:
        if not panel["change"]:
            confirmed_at = None
            panel["changed"] = False
        elif confirmed_at is None:
            print(
                f"tool panel: insert tool {panel['number']}"
                + (" and press Enter" if sys.stdin.isatty() else ""),
                flush=True,
            )
            confirmed_at = time.monotonic() + 0.5
        elif (
            select.select([sys.stdin], [], [], 0)[0] and sys.stdin.readline()
            if sys.stdin.isatty()
            else time.monotonic() > confirmed_at
        ):
            panel["changed"] = True
        time.sleep(0.02)


try:
    wait_for_changes()
except KeyboardInterrupt:
    pass
