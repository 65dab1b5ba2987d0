#!/bin/sh
# SPDX-License-Identifier: MIT
# mold 1.10.1 (Debian 12): a program with a small thread-local variable cannot be started when its code happens to end in the last bytes of a page.
#
# mold puts .tbss behind the code, at the begin of the area that is read-only after relocation. When the code ends a few bytes before the end of a page,
# and what follows is aligned to more than that, the area begins in a page that no segment has. The linker reports nothing; the dynamic loader prints "cannot
# apply additional memory protection after relocation: Cannot allocate memory", with status 127. The script links one program with code of every length
# modulo a page, in steps of 4 bytes. GNU ld starts all of them, and so does mold with -z separate-code, which gives the code pages of its own.
# Consequence: a change of a few bytes anywhere makes a program unusable; link with -Wl,-z,separate-code where mold is that old.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
apt-get download -q mold=1.10.1+dfsg-1 libtbb12 >/dev/null 2>&1 || exit 2
for package in *.deb; do dpkg -x "$package" root; done
LD_LIBRARY_PATH=$(dirname "$(find "$folder/root" -name 'libtbb.so.12')")
export LD_LIBRARY_PATH
mkdir linkers
ln -s ../root/usr/bin/mold linkers/ld
linkers/ld --version
cat >main.c <<'C'
static _Thread_local volatile int counter;
int main(void) { return counter; }
C
cc -O1 -fPIE -c main.c

# count OPTION...: links and runs the program with code of 1024 lengths; prints how many cannot be started.
count() {
    failing=0
    bytes=4
    while [ "$bytes" -le 4096 ]; do
        printf '.text\n.skip %d\n.section .note.GNU-stack,"",@progbits\n' "$bytes" | as -o pad.o -
        cc -pie "$@" main.o pad.o -o program
        if ! ./program 2>message; then
            failing=$((failing + 1))
            cp message reason
        fi
        bytes=$((bytes + 4))
    done
    echo "$failing"
}
with_mold=$(count -B "$folder/linkers")
cat reason
separate=$(count -B "$folder/linkers" -Wl,-z,separate-code)
with_gnu_ld=$(count)
echo "cannot be started: mold $with_mold of 1024, mold with -z separate-code $separate, GNU ld $with_gnu_ld"
[ "$with_mold" -gt 0 ] && [ "$separate" -eq 0 ] && [ "$with_gnu_ld" -eq 0 ]
