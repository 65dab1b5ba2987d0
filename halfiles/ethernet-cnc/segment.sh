# SPDX-License-Identifier: MIT
# Sourced by bring-up: an Ethernet segment on one computer, a network namespace for each station and one for the switch between them.
# Before: `machine` a short name, `stations` a list of names, `here` the machine's folder, "$@" what bring-up was called with.

report() { echo "bring-up: $*"; }

# Without root everything happens in a user namespace of its own, which is gone when this ends.
if [ "$(id -u)" != 0 ]; then
    if [ -z "${HAL_BRING_UP:-}" ] && unshare --user --map-root-user --net --mount true 2>/dev/null; then
        report "not root: in a user namespace; without the right to real-time priorities the cycles are less exact"
        export HAL_BRING_UP=1
        exec unshare --user --map-root-user --net --mount bash "$(realpath "$0")" "$@"
    fi
    report "this makes network namespaces; run it as root (sudo $0), or where user namespaces are allowed" >&2
    exit 77
fi
if [ -n "${HAL_BRING_UP:-}" ]; then mount -t tmpfs tmpfs /run; fi

hal=${HAL_BIN:-${HAL:-hal}}
of_clone=$(dirname "$(realpath "${BASH_SOURCE[0]}")")/../../hal
if [ "$hal" = hal ] && ! command -v hal >/dev/null && [ -x "$of_clone" ]; then hal=$of_clone; fi
command -v "$hal" >/dev/null || { report "'$hal' is missing or not executable; set HAL_BIN=/path/to/hal" >&2; exit 1; }
case $hal in */*) hal=$(realpath -s "$hal") ;; esac  # a machine runs in another folder
switch=hal-$machine-switch
pids=()
carriers=()

# Frames cross a veth pair in the kernel's threads ksoftirqd as soon as there is much to do, and these wait behind every ordinary process.
raise_carriers() {
    local comm name pid
    for comm in /proc/[0-9]*/comm; do
        read -r name 2>/dev/null <"$comm" || continue
        pid=${comm//[!0-9]/}
        case $name in ksoftirqd/*) chrt -p "$pid" | grep -q SCHED_OTHER && chrt -f -p 70 "$pid" && carriers+=("$pid") ;; esac
    done 2>/dev/null
    if [ ${#carriers[@]} -gt 0 ]; then report "ksoftirqd, which carries the frames, has real-time priority until this ends"; fi
}

# How many CPUs other programs use, in tenths, over half a second.
busy_tenths() {
    local before after cpu user nice system idle iowait rest
    read -r cpu user nice system idle iowait rest </proc/stat
    before=$((user + nice + system + idle + iowait)) after=$((user + nice + system))
    sleep 0.5
    read -r cpu user nice system idle iowait rest </proc/stat
    local all=$((user + nice + system + idle + iowait - before)) used=$((user + nice + system - after))
    echo $((all > 0 ? used * cpus * 10 / all : 0))
}
cpus=$(nproc)

# A machine whose cycles are late because its computer has other work should not be looked for in its netlist.
warn_if_busy() {
    local busy
    busy=$(busy_tenths)
    if [ "$busy" -gt $((cpus * 3)) ]; then
        report "this computer is busy: other programs use $((busy / 10)).$((busy % 10)) of its $cpus CPUs. Cycles will be missed, and the machine" \
            "may stop; the figures below are those of a busy computer"
    fi
}

clean_up() {
    trap - EXIT INT TERM
    for pid in "${carriers[@]}"; do chrt -o -p 0 "$pid" 2>/dev/null; done
    for pid in "${pids[@]}"; do kill -INT "$pid" 2>/dev/null; done
    for pid in "${pids[@]}"; do wait "$pid" 2>/dev/null; done
    for name in "${stations[@]}"; do ip netns delete "hal-$machine-$name" 2>/dev/null; done
    ip netns delete "$switch" 2>/dev/null
    report "processes ended, namespaces deleted; their output is in $folder"
}

make_segment() {
    if ip netns list | grep -q "^hal-$machine-"; then
        report "namespaces hal-$machine-… already exist: another bring-up is running; otherwise remove them: ip -all netns delete" >&2
        exit 1
    fi
    folder=$(mktemp -d "${TMPDIR:-/tmp}/hal-$machine.XXXXXX" 2>/dev/null) ||
        { report "cannot create a folder for the output of the processes in '${TMPDIR:-/tmp}'; set TMPDIR=FOLDER" >&2; exit 1; }
    folder=$(realpath "$folder")
    if [ -n "${HAL_BRING_UP:-}" ]; then export XDG_RUNTIME_DIR=$folder; fi  # the folder of the control sockets may be the real root's
    trap clean_up EXIT
    trap 'exit 130' INT TERM
    warn_if_busy
    report "a switch, and ${#stations[@]} stations on it: ${stations[*]}"
    ip netns add "$switch" || { report "network namespaces are not to be had here" >&2; exit 77; }
    ip -n "$switch" link add bridge0 type bridge stp_state 0 forward_delay 0 mcast_snooping 0 || exit 77
    ip netns exec "$switch" sysctl -qw net.ipv6.conf.all.disable_ipv6=1 2>/dev/null
    ip -n "$switch" link set bridge0 up
    for name in "${stations[@]}"; do
        ip netns add "hal-$machine-$name"
        ip netns exec "hal-$machine-$name" sysctl -qw net.ipv6.conf.all.disable_ipv6=1 2>/dev/null
        ip -n "$switch" link add "to-$name" type veth peer name wire0 netns "hal-$machine-$name"
        ip -n "$switch" link set "to-$name" master bridge0 up
        ip -n "hal-$machine-$name" link set wire0 up
    done
    raise_carriers
}

# start [--cpu N] NAME COMMAND…: in the station's namespace; its output goes to a file. `hal run` puts its thread on the last CPU:
# a process that must not wait for it belongs on another one, N.
start() {
    local place=()
    if [ "$1" = --cpu ]; then
        [ "$2" -lt "$cpus" ] && taskset -c "$2" true 2>/dev/null && place=(taskset -c "$2")
        shift 2
    fi
    local name=$1
    shift
    WIRE=wire0 ip netns exec "hal-$machine-$name" "${place[@]}" "$@" >"$folder/$name.log" 2>&1 &
    pids+=($!)
    eval "pid_$name=$!"
}
