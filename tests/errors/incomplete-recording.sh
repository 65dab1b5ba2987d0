# SPDX-License-Identifier: MIT
# a table whose copy ended within a row
cd "$HOME"
printf 'time_s,a,b\n0.001,1,2\n0.002,3,4\n0.003,5' >run.csv
printf 'loadrt playback file=run.csv\nnewthread servo 1000000\naddf playback.0.update servo\n' >play.hal
hal check play.hal
