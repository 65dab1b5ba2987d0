# SPDX-License-Identifier: MIT
# Read by the toolchain files of the boards, cmake/armhf.cmake and cmake/arm64.cmake, which set board_triplet and board_emulator. Libraries and
# headers of the board are in board_sysroot, which `./hal board` makes; programs that the build starts run under qemu-user.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_C_COMPILER "${board_triplet}-gcc")
set(CMAKE_CXX_COMPILER "${board_triplet}-g++")
cmake_path(SET board_sysroot NORMALIZE "${CMAKE_CURRENT_LIST_DIR}/../build/boards/${board}/sysroot")
set(CMAKE_SYSROOT "${board_sysroot}")
set(CMAKE_LIBRARY_ARCHITECTURE "${board_triplet}")
set(CMAKE_CROSSCOMPILING_EMULATOR "${board_emulator};-L;${board_sysroot}")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
