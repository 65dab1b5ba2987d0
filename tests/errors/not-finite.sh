# SPDX-License-Identifier: MIT
# the first of them; how long cycles take, and what else a busy host delays, differs from run to run
hal run --for 1ms not-finite.hal 2>&1 >/dev/null | grep '\[not-finite\]' | head -n 1 | sed -E 's/took [0-9.]+ ms/took N ms/; s/[0-9]+ periods/N periods/; s/, last seen in [^)]*\)//; s/cycle [0-9 ]+/cycle N/' >&2
