# SPDX-License-Identifier: MIT
# shellcheck shell=sh
# `./hal board armhf|arm64`; read by the script `hal`, whose functions it uses. Compiles everything for such a board, and
# runs the unit tests and the netlist tests under qemu-user.
case ${1-}:$# in
    armhf:1 | arm64:1) ;;
    *) die "usage: ./hal board armhf|arm64" ;;
esac
begun_at=$(date +%s)
use_board "$1"
tree=$board-test

tests=ON
compile "$tree" "everything for $board" hal hal-bus components unit_programs
exec 9>&-

# The tests start programs, which start others: the kernel must run each with qemu-user. Where it is not registered for that, a user namespace
# has a register of its own (Linux 6.7 and newer); nothing outside of it changes.
log=$build/$tree-tests.log
in_board=$build/boards/run.sh
cat >"$in_board" <<'RUN'
set -eu
register=/proc/sys/fs/binfmt_misc
if ! grep -qs '^enabled' "$register/$1"; then
    mount -t binfmt_misc none "$register"
    cat "/usr/lib/binfmt.d/$1.conf" >"$register/register"
fi
shift
exec "$@"
RUN
if grep -qs '^enabled' "/proc/sys/fs/binfmt_misc/$qemu"; then namespace=; else namespace="unshare --user --map-root-user --mount"; fi
export QEMU_LD_PREFIX="$sysroot"
# shellcheck disable=SC2086 # a list
$namespace sh "$in_board" "$qemu" "$build/$tree/bin/hal" --version >"$log" 2>&1 ||
    die "cannot run programs of $board: Linux 6.7 or newer, or a registered $qemu (apt-get install qemu-user-static binfmt-support); see $log"
say "testing build/$tree under $qemu"
failed=
# shellcheck disable=SC2086
$namespace sh "$in_board" "$qemu" ctest --test-dir "$build/$tree" --output-on-failure \
    --no-tests=error --test-output-size-passed 1000000 -j "$((3 * $(nproc)))" -L '^(unit|netlists)$' --output-junit "$log.xml" >"$log" 2>&1 </dev/null || failed=1
grep -vE '^ *(Start +[0-9]+:|[0-9]+/[0-9]+ .* (Passed|Skipped) )|\(Skipped\)$|\*\*\*Skipped ' "$log" || :
reasons=$(python3 "$root/tests/skipped.py" "$log.xml" "$build/$tree/components/packages_left_out")
[ -z "$reasons" ] || say "skipped, and why (which: $log):
$reasons"
say "left out: components/vision, components/dds and tools/python (their libraries are not in the sysroot); tests of real time, of buses between processes, of the command line and of packages, whose times or privileges mean nothing under an emulator"
say "after $(duration $(($(date +%s) - begun_at)))"
if [ "$failed" ]; then die "tests of $board failed"; fi
say "all tests of $board passed"
