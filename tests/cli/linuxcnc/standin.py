#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Stands in for LinuxCNC's programs; its name is whose part it plays. What happens is written to the file in STANDIN_LOG."""
import ctypes
import os
import signal
import sys
import time

NAME = os.path.basename(sys.argv[0])
COMPONENTS = {"io": "iocontrol", "halui": "halui", "milltask": "inihal", "hal_bridge": "bridge"}


def log(text):
    with open(os.environ["STANDIN_LOG"], "a") as file:
        file.write(f"{text}\n")


def ends(*_):
    if NAME in os.environ.get("STANDIN_LINGERS", "").split():
        time.sleep(1)
    log(f"{NAME} ends")
    sys.exit(0)


def serve():
    """A daemon, as linuxcncsvr is: the process that was started ends once it serves."""
    ready, serving = os.pipe()
    if os.fork() != 0:
        os.close(serving)
        sys.exit(0 if os.read(ready, 1) else 1)
    os.setsid()
    if os.fork() != 0:
        os._exit(0)
    signal.signal(signal.SIGTERM, ends)
    os.write(serving, b"1")
    while True:
        time.sleep(1)


def component():
    import hal

    signal.signal(signal.SIGTERM, ends)
    it = hal.component(COMPONENTS[NAME])
    it.newpin("speed", hal.HAL_FLOAT, hal.HAL_OUT)
    if os.environ.get("STANDIN_SLOW") == NAME:
        log(f"{NAME} waits")
        time.sleep(60)
    it.ready()
    it["speed"] = 1.5
    if NAME == "milltask" and "STANDIN_STATUS_KEY" in os.environ:
        beat(int(os.environ["STANDIN_STATUS_KEY"]))
    while True:
        time.sleep(1)


def beat(key):
    """Counts the writes of the status buffer as task does in each cycle, until a file `hang` appears: behind a name of 32 bytes, a byte for each of 16 processes, and a long."""
    libc = ctypes.CDLL(None)
    libc.shmat.restype = ctypes.c_void_p
    memory = libc.shmat(libc.shmget(key, 20480, 0o1600), None, 0)
    writes = ctypes.c_long.from_address(memory + 56)
    while True:
        if not os.path.exists(os.environ["CONFIG_DIR"] + "/hang"):
            writes.value += 1
        time.sleep(0.01)


with open("/proc/self/comm", "w") as file:  # a script is python3 to the kernel
    file.write(NAME)
words = " ".join(sys.argv[1:]).replace(os.environ.get("CONFIG_DIR", "/nowhere"), "CONFIG")
log(f"{NAME} {words}".strip())
if NAME in os.environ.get("STANDIN_FAILS", "").split():
    print(f"{NAME}: cannot do that", file=sys.stderr, flush=True)
    sys.exit(4)
if NAME == "io":
    for name in os.environ.get("STANDIN_SHOW", "").split():
        log(f"  {name}={os.environ.get(name)}")
if NAME == "linuxcncsvr":
    serve()
elif NAME in COMPONENTS:
    component()
