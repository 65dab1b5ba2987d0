# SPDX-License-Identifier: MIT
"""The comparison of our components with those of the same names in LinuxCNC: the parts of ../linuxcnc_components.py."""
