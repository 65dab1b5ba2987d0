# SPDX-License-Identifier: MIT
# shellcheck shell=sh
# Read by the script `hal`, whose functions it uses: what builds for a board have in common.

# use_board ARCH: sets $board, $triplet and $qemu; makes the sysroot, the libraries and headers of the board's system, where it is missing or
# has other packages. These are packages of Debian 12, unpacked; nothing is installed on this machine. cmake/board.cmake finds them.
use_board() {
    board=$1
    case $board in
        armhf) triplet=arm-linux-gnueabihf qemu=qemu-arm ;;
        arm64) triplet=aarch64-linux-gnu qemu=qemu-aarch64 ;;
    esac
    if [ "$in_cache" ]; then die "builds for a board need a source tree that can be written to"; fi
    need "$qemu-static=qemu-user-static" "$triplet-g++=g++-$triplet" mmdebstrap=mmdebstrap python3=python3
    content="libc6-dev libstdc++-12-dev libfmt-dev nlohmann-json3-dev libcli11-dev libedit-dev libcap-dev libgtest-dev libpugixml-dev libzstd-dev liblz4-dev libeigen3-dev libwebsockets-dev"
    folder=$build/boards/$board sysroot=$build/boards/$board/sysroot
    if [ -f "$folder/content" ] && [ "$(cat "$folder/content")" = "$content" ]; then return; fi
    mirror=${HALCYON_MIRROR:-http://deb.debian.org/debian}
    say "unpacking Debian's libraries for $board from $mirror in build/boards/$board/sysroot"
    mkdir -p "$folder"
    rm -rf "${sysroot:?}" "$folder/content"
    # The packages stay in its cache: `./hal package` reads there which versions of a library have a symbol.
    mmdebstrap --variant=extract --architectures="$board" --include="$(echo "$content" | tr ' ' ,)" --skip=essential/unlink,cleanup/apt/cache \
        bookworm "$sysroot" "deb $mirror bookworm main" >"$sysroot.log" 2>&1 </dev/null || {
        tail -n 5 "$sysroot.log" >&2
        die "cannot make build/boards/$board/sysroot (see $sysroot.log); HALCYON_MIRROR=URL names another mirror of Debian"
    }
    echo "$content" >"$folder/content"
}
