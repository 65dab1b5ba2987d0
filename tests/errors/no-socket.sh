# SPDX-License-Identifier: MIT
# a folder in which nobody can make another
XDG_RUNTIME_DIR=/proc hal run no-socket.hal
