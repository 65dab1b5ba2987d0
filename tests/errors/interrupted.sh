# SPDX-License-Identifier: MIT
# SIGINT while a command waits
mkfifo "$HOME/started"
hal sim interrupted.hal >"$HOME/started" &
head -n 1 "$HOME/started" >/dev/null
kill -INT $!
wait
