# SPDX-License-Identifier: MIT
# Toolchain of Debian's armhf: ARMv7-A with VFPv3-D16, Thumb-2 code. Cortex-A7 and later 32-bit boards, BeagleBone, Raspberry Pi 2 and newer.
set(board armhf)
set(CMAKE_SYSTEM_PROCESSOR armv7l)
set(board_triplet arm-linux-gnueabihf)
set(board_emulator qemu-arm-static)
include("${CMAKE_CURRENT_LIST_DIR}/board.cmake")
