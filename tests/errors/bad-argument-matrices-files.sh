# SPDX-License-Identifier: MIT
# files of matrices and models: missing, a folder, or not text at all
cp bad-argument-matrices-files.inc "$HOME/files.hal"
cd "$HOME"
mkdir folder
head -c 65537 /dev/zero >long
hal check files.hal
