# SPDX-License-Identifier: MIT
# the thread gets the remaining time of a CPU that another process uses; how long it waits differs from run to run
taskset -c 0 sh -c 'while :; do :; done' &
busy=$!
hal run starved-thread.hal 2>"$HOME/faults" >/dev/null &
machine=$!
trap 'kill $busy $machine 2>/dev/null' EXIT
for wait in $(seq 500); do
    for task in /proc/$machine/task/*; do
        if [ "$(cat "$task/comm")" = servo ]; then chrt --idle --pid 0 "${task##*/}" && break 2; fi
    done
    sleep 0.01
done
for wait in $(seq 500); do
    if grep -q '\[starved-thread\]' "$HOME/faults"; then break; fi
    sleep 0.01
done
grep '\[starved-thread\]' "$HOME/faults" | head -n 1 | sed -E 's/for [0-9.]+ m?s/for N ms/; s/cycle [0-9 ]+/cycle N/' >&2
