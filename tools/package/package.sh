# SPDX-License-Identifier: MIT
# shellcheck shell=sh
# `./hal package`; read by the script `hal`, whose functions it uses.

# packages_here: makes those of this computer, in build/packages.
packages_here() {
    names=all
    prepare
    need dpkg-shlibdeps=dpkg-dev strip=binutils python3=python3 cmark-gfm.h=libcmark-gfm-dev cmark-gfm-core-extensions.h=libcmark-gfm-extensions-dev
    compile_release installed site
    python3 "$root/tools/package/build.py" "$root" "$release" "$build/packages"
}

# packages_of_board ARCH: makes those of a board, in build/packages/ARCH.
packages_of_board() {
    names=
    prepare
    use_board "$1"
    need dpkg-shlibdeps=dpkg-dev
    compile "$board" "everything for $board" installed
    python3 "$root/tools/package/build.py" "$root" "$build/$board" "$build/packages/$board" "$board" "$sysroot"
}

# publish [--check]: makes the release of $version from build/packages, signed by $key; or only checks that nothing prevents it.
publish() {
    python3 "$root/tools/package/release.py" "$@" "$root" "$build/packages" "$build/releases/$version" "$key" "${HALCYON_RELEASE_URL-}"
}

# release KEY [ARCH...]: makes the packages of all architectures, or of these, and what a project publishes of them in build/releases/VERSION.
release() {
    key=$1
    shift
    here=$(dpkg --print-architecture)
    if [ $# -eq 0 ]; then
        case $here in armhf | arm64) set -- armhf arm64 ;; *) set -- "$here" armhf arm64 ;; esac
    fi
    for arch; do
        case $arch in "$here" | armhf | arm64) ;; *) die "cannot make packages for '$arch' here; write $here, armhf or arm64" ;; esac
    done
    names=
    prepare
    need gpg=gpg git=git python3=python3
    version=$(sed -n 's/^project(Halcyon VERSION \([^ ]*\).*/\1/p' "$root/CMakeLists.txt")
    rm -rf "$build/packages"
    publish --check # before hours of compiling
    for arch; do
        if [ "$arch" = "$here" ]; then packages_here; else packages_of_board "$arch"; fi
    done
    publish
}

package() {
    . "$root/cmake/board.sh"
    shift
    case $#:${1-} in
        0:) packages_here ;;
        1:armhf | 1:arm64) packages_of_board "$1" ;;
        1:--release) die "usage: ./hal package --release KEY [ARCHITECTURE...]; KEY signs: one of gpg --list-secret-keys" ;;
        *:--release)
            shift
            release "$@"
            ;;
        *) die "usage: ./hal package [armhf|arm64], or ./hal package --release KEY [ARCHITECTURE...]" ;;
    esac
}
