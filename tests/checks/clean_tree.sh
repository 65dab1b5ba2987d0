#!/bin/sh
# SPDX-License-Identifier: MIT
# clean_tree.sh ROOT             prints what git sees as changed or untracked
# clean_tree.sh ROOT BEFORE-FILE fails when something else is changed now than is listed in BEFORE-FILE
set -eu
changed() { git -c safe.directory='*' -C "$1" status --porcelain --untracked-files=all; }

if ! [ -e "$1/.git" ]; then exit 0; fi # an unpacked archive: nothing to compare with
if [ $# -eq 1 ]; then
    command -v git >/dev/null || exit 0 # not installed yet: then nothing was changed here
    changed "$1"
    exit
fi
new=$(changed "$1" | grep -vxFf "$2" || true)
if [ "$new" ]; then
    echo "the build or the tests changed the tree:"
    echo "$new"
    exit 1
fi
