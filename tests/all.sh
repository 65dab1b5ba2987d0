# SPDX-License-Identifier: MIT
# shellcheck shell=sh
# `./hal test [quick]`; read by the script `hal`, whose functions it uses. Runs everything, then lists the failures.
# quick: the release build only.
case ${1-} in
    "" | quick) ;;
    *) die "usage: ./hal test [quick]" ;;
esac
tests=ON
failed=
laps=
begun_at=$(date +%s)
lap_at=$begun_at

# lap WHAT: notes for the last lines how long that took.
lap() {
    now=$(date +%s)
    laps="$laps
    $(duration $((now - lap_at)))  $1"
    lap_at=$now
}

changed_before=$build/.changed-before
sh "$root/tests/checks/clean_tree.sh" "$root" >"$changed_before"

need gtest/gtest.h=libgtest-dev python3=python3 git=git python3-config=python3-dev pybind11/pybind11.h=pybind11-dev pugixml.hpp=libpugixml-dev zstd.h=libzstd-dev lz4frame.h=liblz4-dev \
    libwebsockets.h=libwebsockets-dev gpg=gpg xz=xz-utils chromium=chromium node=nodejs tsc=node-typescript \
    cmark-gfm.h=libcmark-gfm-dev cmark-gfm-core-extensions.h=libcmark-gfm-extensions-dev \
    /usr/lib/python3/dist-packages/can=python3-can /usr/lib/python3/dist-packages/msgpack=python3-msgpack \
    /usr/lib/python3/dist-packages/serial=python3-serial "$(python3 -c 'import os; print(os.__file__[:-6])' 2>/dev/null)/ensurepip=python3-venv" \
    "/usr/lib/llvm-19/lib/clang/19/lib/linux/libclang_rt.rtsan-$(uname -m).a=libclang-rt-19-dev" \
    /usr/include/opencv4/opencv2/aruco.hpp=libopencv-contrib-dev yaml-cpp/yaml.h=libyaml-cpp-dev \
    linux.uml=user-mode-linux busybox=busybox-static ip=iproute2 candump=can-utils socat=socat \
    fastdds/dds/domain/DomainParticipant.hpp=libfastrtps-dev fast-discovery-server=fastdds-tools openssl=openssl tshark=tshark dot=graphviz rsvg-convert=librsvg2-bin \
    zsh=zsh fish=fish man=man-db nvim=neovim

# The independent CANopen implementation that tests/peers talks to, pinned there, in a Python environment of its own.
peers() {
    stamp_of_peers=$build/peers/installed
    wanted="$root $(cat "$root/tests/peers/requirements.txt")"
    if [ -f "$stamp_of_peers" ] && [ "$(cat "$stamp_of_peers")" = "$wanted" ]; then return; fi
    say "installing the Python packages that tests/peers talks to (canopen, python-can, pysoem, kickcat, cyclonedds, rosbags, mcap, perfetto) into build/peers"
    rm -rf "${build:?}/peers"
    if { python3 -m venv "$build/peers" && "$build/peers/bin/python" -m pip install --disable-pip-version-check --retries 1 --timeout 30 \
        -r "$root/tests/peers/requirements.txt"; } >"$build/peers.log" 2>&1 </dev/null; then
        echo "$wanted" >"$stamp_of_peers"
    else
        rm -rf "${build:?}/peers"
        say "not installed, no network? (why: build/peers.log): the tests against these packages are skipped"
    fi
}
peers
lap preparing

# test_progress TREE: reads ctest's output, which goes to the log. Prints one updated line in a terminal, elsewhere one line every half minute, with
# the tests that have run and that failed so far. Fails when ctest failed.
test_progress() {
    result=1 ran=0 all= bad=0 began=$(date +%s) next=30
    while IFS= read -r line; do
        case $line in
            "hal: ctest ended with "*)
                if [ "${line##* }" -eq 0 ]; then result=0; fi
                continue
                ;;
        esac
        printf '%s\n' "$line" >&4
        case $line in
            *[0-9]/[0-9]*" Test "*"#"*)
                ran=$((ran + 1)) all=${line%% Test *} all=${all#*/}
                case $line in *"***Failed"* | *"***Timeout"* | *"***Exception"* | *"***Not Run"*) bad=$((bad + 1)) ;; esac
                now="testing build/$1: $ran of $all tests$([ $bad -eq 0 ] || echo ", $bad failed")"
                if [ -t 2 ]; then
                    printf '\r%s\033[K' "hal: $now" >&2
                elif [ $(($(date +%s) - began)) -ge $next ]; then
                    say "$now"
                    next=$((next + 30))
                fi
                ;;
        esac
    done
    if [ -t 2 ]; then printf '\r\033[K' >&2; fi
    return $result
}

# run_tests TREE CTEST-ARGUMENT...: prints the closing lines of ctest and the whole output of what failed. What failed beside other tests
# runs once more alone: on a shared machine, a test with real processes and real threads may get no CPU for seconds. It is listed when that
# passes. A report of a sanitizer counts at the first time.
run_tests() {
    tree=$1 log=$build/$1-tests.log
    shift
    say "testing build/$tree"
    if {
        ctest --test-dir "$build/$tree" --output-on-failure --no-tests=error -j "$((3 * $(nproc)))" --output-junit "$log.xml" "$@" 2>&1 </dev/null
        echo "hal: ctest ended with $?"
    } | test_progress "$tree" 4>"$log"; then
        sed -n '/tests passed/,/^Total Test time/p' "$log"
    else
        grep -vE '^ *(Start +[0-9]+:|[0-9]+/[0-9]+ .* (Passed|Skipped) )|\(Skipped\)$|\*\*\*Skipped ' "$log"
        if grep -qE 'Sanitizer: |runtime error: ' "$log" || [ "$(grep -cE '\*\*\*(Failed|Timeout|Exception|Not Run)' "$log")" -gt 20 ]; then
            failed="$failed build/$tree"
        else
            say "running the failed tests of build/$tree again, one at a time"
            if ctest --test-dir "$build/$tree" --output-on-failure --rerun-failed --no-tests=error -j 1 >"$log.again" 2>&1 </dev/null; then
                sed -n '/tests passed/,/^Total Test time/p' "$log.again"
                say "passed when run alone (the first output is above):
$(sed -n 's/^ *[0-9]*\/[0-9]* Test *#[0-9]*: \([^ ]*\) .*/    \1/p' "$log.again")"
            else
                grep -vE '^ *(Start +[0-9]+:|[0-9]+/[0-9]+ .* Passed )' "$log.again"
                failed="$failed build/$tree"
            fi
        fi
    fi
    lap "testing build/$tree"
    reasons=$(python3 "$root/tests/skipped.py" "$log.xml" "$build/$tree/components/packages_left_out")
    [ -z "$reasons" ] || say "left out, and why (which: build/$tree-tests.log):
$reasons"
    say "$(python3 "$root/tests/slowest.py" "$log.xml")"
}

compile_release all bench
lap "building build/release"
run_tests release

if [ "${1-}" != quick ]; then
    compile asan "everything under the address and undefined-behaviour sanitizers" all
    lap "building build/asan"
    # Left out: what runs in user-mode-linux, whose addresses are where this sanitizer has its shadow.
    run_tests asan -LE 'check|docs|uml'

    compile tsan "what has threads under the thread sanitizer" unit_tests
    lap "building build/tsan"
    # g++ 12's thread sanitizer cannot start where the kernel randomises addresses by more than 28 bits.
    if setarch -R true 2>/dev/null; then plain_addresses="setarch -R"; else plain_addresses=; fi
    ctest() { command $plain_addresses ctest "$@"; }
    run_tests tsan -R '^unit_tests'
fi

# Measures of the sources, which fail nothing.
measurer=$build/peers/bin/python  # has lizard, which counts branches
[ -x "$measurer" ] || measurer=python3
"$measurer" "$root/tests/checks/density.py" "$root" || :

# A build and a test leave no file behind that git would see.
sh "$root/tests/checks/clean_tree.sh" "$root" "$changed_before" || failed="$failed clean-tree"

say "after $(duration $(($(date +%s) - begun_at))):$laps"
if [ "$failed" ]; then die "failed:$failed"; fi
say "all tests passed"
