# SPDX-License-Identifier: MIT
# how long it has hung differs from run to run
halrun hung-thread.hal 2>&1 | sed -E 's/a cycle for [0-9.]+ (ms|s)/a cycle for N s/' >&2
