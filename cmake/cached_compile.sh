#!/bin/sh
# SPDX-License-Identifier: MIT
# cached_compile.sh CCACHE ROOT COMPILER ARGUMENT...: compiles through ccache.
#
# Another tree on this machine, such as the fresh clone that a test is run in, takes from the cache what this one compiled: the key leaves out ROOT, the
# folder of the sources. Except with a precompiled header: it holds the paths of its tree, and another tree that took it from the
# cache would read the headers of the first one beside its own. An old precompiled header is removed before it is made again: ccache would
# take it for an input, and return what was made the last time that this one was there.
ccache=$1 root=$2
shift 2
before=
for word; do
    case $word in
        *.gch)
            [ "$before" != -o ] || rm -f "$word"
            root=
            ;;
        */cmake_pch.hxx) root= ;;
    esac
    before=$word
done
export CCACHE_BASEDIR="$root" CCACHE_SLOPPINESS=pch_defines,time_macros CCACHE_ABSSTDERR=true
exec "$ccache" "$@"
