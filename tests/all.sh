# SPDX-License-Identifier: MIT
# shellcheck shell=sh
# `./hal test [sanitizers]`; read by the script `hal`, whose functions it uses. Runs everything, then says what failed.
case ${1-} in
    "" | sanitizers) ;;
    *) die "usage: ./hal test [sanitizers]" ;;
esac
tests=ON
failed=
changed_before=$build/.changed-before
sh "$root/tests/checks/clean_tree.sh" "$root" >"$changed_before"

need gtest/gtest.h=libgtest-dev python3=python3 git=git

# run_tests TREE CTEST-ARGUMENT...: prints the closing lines of ctest, and the whole of what failed.
run_tests() {
    tree=$1 log=$build/$1-tests.log
    shift
    say "testing build/$tree"
    if ctest --test-dir "$build/$tree" --output-on-failure --no-tests=error -j "$(nproc)" "$@" >"$log" 2>&1 </dev/null; then
        sed -n '/tests passed/,$p' "$log"
    else
        grep -vE '^ *(Start +[0-9]+:|[0-9]+/[0-9]+ .* Passed )' "$log"
        failed="$failed build/$tree"
    fi
}

compile_release "the program, its components, tests and benchmarks" all bench
run_tests release

need "/usr/lib/llvm-19/lib/clang/19/lib/linux/libclang_rt.rtsan-$(uname -m).a=libclang-rt-19-dev"
compile rt-guard "everything under the real-time guard" all
# Left out: an exception allocates, which is what this guard stops at; and the tests of the other guard, whose bad components it stops first.
run_tests rt-guard -L 'unit|rt|netlists' -E 'A_function_that_throws|The_faults_of_a_deleted_thread|Guard.catches'

if [ "${1-}" = sanitizers ]; then
    compile asan "everything under the address and undefined-behaviour sanitizers" all
    run_tests asan -LE 'check|docs'

    compile tsan "everything under the thread sanitizer" all
    # g++ 12's thread sanitizer cannot start where the kernel randomises addresses by more than 28 bits.
    if setarch -R true 2>/dev/null; then plain_addresses="setarch -R"; else plain_addresses=; fi
    ctest() { command $plain_addresses ctest "$@"; }
    run_tests tsan -L 'unit|rt|netlists'
fi

# A build and a test leave no file behind that git would see.
sh "$root/tests/checks/clean_tree.sh" "$root" "$changed_before" || failed="$failed clean-tree"

if [ "$failed" ]; then die "failed:$failed"; fi
say "all tests passed"
