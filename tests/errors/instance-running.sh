# SPDX-License-Identifier: MIT
# two instances of one name; the first runs until the second has been rejected
mkfifo "$HOME/ready"
hal run --name twice instance-running.hal >"$HOME/ready" 2>/dev/null &
grep -q running "$HOME/ready"
hal run --name twice instance-running.hal 2>&1 >/dev/null | sed 's/process [0-9]*/process N/; s/kill [0-9]*/kill N/' >&2
kill -INT $!
wait
