# SPDX-License-Identifier: MIT
# a number that cannot be read makes the file unreliable: the exit status reports it
! hal can eds check eds-value-number.eds
