# SPDX-License-Identifier: MIT
# packages: linuxcnc
# Two modules in LinuxCNC's binary interface, of which one calls the other.
export HAL_RTMOD_DIR="$HOME"
for module in planner follow; do ${CC:-cc} -shared -fPIC -o "$HOME/$module.so" "../cli/modules/$module.c"; done
exec hal sim --quiet module-in-use.hal
