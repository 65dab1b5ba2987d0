#!/bin/sh
# SPDX-License-Identifier: MIT
# PyPI pyetg1510 0.1.3: on Linux, this client of EtherCAT mailbox gateways (ETG.8200) sends requests whose CoE header has service 0
# instead of 2 (SDO request).
#
# Its headers are ctypes structures of bit fields of different types (16 bits, then 8 bits) with _pack_ = 1. A compiler of Microsoft
# starts a new unit where the type changes. Elsewhere ctypes numbers the last 4 bits 12 to 15 of the word and accesses them by the 8-bit
# type, so what is stored is lost. No exception is raised, and the length of the request is right.
# Consequence: a gateway answers with an error or not at all, and the client reports a timeout, as if the gateway were faulty.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv" && "$folder/venv/bin/pip" install -q --disable-pip-version-check pyetg1510==0.1.3 || exit 2
"$folder/venv/bin/python" - <<'PYTHON'
import importlib.metadata
import sys

from pyetg1510.mailbox.mailbox_gateway import CoEHeader, EtherCATHeader

coe = CoEHeader()
coe.Service = 2
frame = EtherCATHeader()
frame.Length = 18
frame.DataType = 5
print("pyetg1510", importlib.metadata.version("pyetg1510"), "on", sys.platform)
print("CoE header: service 2 is read back as", coe.Service, "and stored as", bytes(coe).hex())
print("EtherCAT header: type 5 is read back as", frame.DataType, "and stored as", bytes(frame).hex())
sys.exit(0 if coe.Service == 0 and frame.DataType != 5 else 1)
PYTHON
