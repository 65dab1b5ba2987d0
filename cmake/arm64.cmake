# SPDX-License-Identifier: MIT
# Toolchain of Debian's arm64: Raspberry Pi 3 and newer with a 64-bit system.
set(board arm64)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(board_triplet aarch64-linux-gnu)
set(board_emulator qemu-aarch64-static)
include("${CMAKE_CURRENT_LIST_DIR}/board.cmake")
