# SPDX-License-Identifier: MIT
# Another process takes the thread's CPU: one of higher priority where the system grants that, else several beside an idle thread.
# How long the thread waits, and how the process is named, differs from run to run.
hal run starved-thread.hal 2>"$HOME/faults" >/dev/null &
machine=$!
loops=
trap 'kill $machine $loops 2>/dev/null' EXIT

thread=
for wait in $(seq 500); do
    for task in /proc/$machine/task/*; do
        if [ "$(cat "$task/comm")" = servo ]; then thread=${task##*/}; fi
    done
    if [ "$thread" ]; then break; fi
    sleep 0.01
done

# Ends by itself: nothing else on this CPU could end it.
occupy='
import os, time
os.sched_setaffinity(0, {0})
os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
end = time.monotonic() + 0.4
while time.monotonic() < end:
    pass
'
if ! python3 -c "$occupy" 2>/dev/null; then
    for loop in 1 2 3 4 5 6; do
        taskset -c 0 sh -c 'while :; do :; done' &
        loops="$loops $!"
    done
    chrt --idle --pid 0 "$thread"
fi
for wait in $(seq 500); do
    if grep -q '\[starved-thread\]' "$HOME/faults"; then break; fi
    sleep 0.01
done
grep '\[starved-thread\]' "$HOME/faults" | head -n 1 | sed -E '
    s/for [0-9.]+ m?s/for N ms/
    s/cycle [0-9 ]+/cycle N/
    s/(process [0-9]+ \(python3, SCHED_FIFO 1\)|another process of higher priority) uses/WHO uses/' >&2
