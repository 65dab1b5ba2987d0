# SPDX-License-Identifier: MIT
# only a file that a display loads: `hal check` and `hal run` agree
cd "$HOME"
printf '[HAL]\nPOSTGUI_HALFILE = after.hal\n' >machine.ini
echo 'loadrt sum2 names=adder' >after.hal
! hal check machine.ini
hal run --no-picture --for 1ms machine.ini
