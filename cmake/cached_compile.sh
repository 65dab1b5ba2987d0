#!/bin/sh
# SPDX-License-Identifier: MIT
# cached_compile.sh CCACHE COMPILER ARGUMENT...: compiles through ccache.
#
# Without its base directory: a precompiled header holds the paths of its tree, and another tree that took it from the cache would read the
# headers of the first one beside its own. An old precompiled header is removed before it is made again: ccache would take it for an input,
# and return what was made the last time that this one was there.
before=
for word; do
    case $word in
        *.gch) [ "$before" != -o ] || rm -f "$word" ;;
    esac
    before=$word
done
export CCACHE_BASEDIR= CCACHE_SLOPPINESS=pch_defines,time_macros
exec "$@"
