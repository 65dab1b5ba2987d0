# SPDX-License-Identifier: MIT
"""The lower half of LinuxCNC's module, which its displays use beside the upper one: here both are one."""
import sys

import hal

sys.modules[__name__] = hal
