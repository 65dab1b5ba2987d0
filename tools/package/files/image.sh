#!/bin/sh
# SPDX-License-Identifier: MIT
# image.sh [FOLDER]: makes a Debian 12 with a real-time kernel that boots into a running pendulum, for a virtual machine: halcyon.img, vmlinuz and
# initrd.img in FOLDER (./image). It takes the packages of the release that it lies in. Needs mmdebstrap and genext2fs. Then:
#     sh image.sh && sh image/boot
set -eu
release=$(cd "$(dirname "$0")" && pwd -P)
folder=${1:-image}
mirror=${HALCYON_MIRROR:-http://deb.debian.org/debian}

die() {
    echo "image.sh: $*" >&2
    exit 1
}
for program in mmdebstrap genext2fs; do
    command -v "$program" >/dev/null || die "$program is missing; type: sudo apt install mmdebstrap genext2fs"
done
[ -f "$release/halcyon.asc" ] || die "$release/halcyon.asc is missing: image.sh belongs into the folder of a release"
[ "$(dpkg --print-architecture)" = amd64 ] || die "makes images for amd64 only"
case $release in *[[:space:]]*) die "apt cannot read a folder with blanks in its name: $release" ;; esac
mkdir -p "$folder"
folder=$(cd "$folder" && pwd -P)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# The repository as a folder, wherever the release is published.
cat >"$work/packages.list" <<END
deb $mirror bookworm main
deb [signed-by="$release/halcyon.asc"] file:$release/apt stable main
END

# What is in the system beside its packages.
cat >"$work/setup" <<'END'
#!/bin/sh
set -eu
root=$1
echo pendulum >"$root/etc/hostname"
echo "/dev/vda / ext4 rw,relatime 0 1" >"$root/etc/fstab"
mkdir -p "$root/etc/halcyon/pendulum"
cp -r "$root/usr/share/halcyon/halfiles/furuta/." "$root/etc/halcyon/pendulum"
ln -sf swing-up.hal "$root/etc/halcyon/pendulum/machine.hal"
chroot "$root" systemctl enable halcyon@pendulum.service
mkdir -p "$root/etc/systemd/system/serial-getty@ttyS0.service.d"
printf '[Service]\nExecStart=\nExecStart=-/sbin/agetty --autologin root --noclear %%I 115200 vt220\n' >"$root/etc/systemd/system/serial-getty@ttyS0.service.d/login.conf"
cat >"$root/root/.profile" <<'PROFILE'
echo "The pendulum runs as halcyon@pendulum. Push it:  hal shell --name pendulum setp furuta.push 1"
echo "Look at it:  hal top --name pendulum    Switch off:  poweroff"
hal shell --name pendulum show timing
PROFILE
find "$root/etc/apt" -name '*.list' -exec sed -i '/ stable main$/d' {} + # the folder on the other computer
END
chmod +x "$work/setup"

mmdebstrap --variant=minbase --hook-dir=/usr/share/mmdebstrap/hooks/file-mirror-automount \
    --include=systemd-sysv,udev,dbus,kmod,iproute2,procps,linux-image-rt-amd64,halcyon,halcyon-estimation \
    --customize-hook="$work/setup \"\$1\"" \
    --customize-hook="copy-out /boot $work" \
    --format=tar bookworm "$work/root.tar" "$work/packages.list"
rm -f "$folder/halcyon.img" # 2 GB, of which most takes no space on the disk
genext2fs --block-size 4096 --size-in-blocks 524288 --number-of-inodes 131072 --tarball "$work/root.tar" "$folder/halcyon.img"
cp "$work"/boot/vmlinuz-* "$folder/vmlinuz"
cp "$work"/boot/initrd.img-* "$folder/initrd.img"

cat >"$folder/boot" <<'END'
#!/bin/sh
# Boots the image in a virtual machine of QEMU. Ctrl-A X ends it.
cd "$(dirname "$0")" || exit 1
exec qemu-system-x86_64 -accel kvm -accel tcg -smp 2 -m 1G -nographic -no-reboot -kernel vmlinuz -initrd initrd.img \
    -append "root=/dev/vda rw console=ttyS0 quiet" -drive file=halcyon.img,format=raw,if=virtio
END
echo "$folder: halcyon.img, vmlinuz, initrd.img; to boot it: sh $folder/boot"
