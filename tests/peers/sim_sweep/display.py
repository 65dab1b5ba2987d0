#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""The display of linuxcnc_sim_sweep.py: e-stop reset, on, homing, an MDI move, a short program; prints each step that has succeeded, and exits."""
import os
import sys
import time

import linuxcnc

LIMIT = 60.0


class Failed(Exception):
    pass


def errors(channel):
    """The messages of kind error since the last call."""
    texts = []
    while message := channel.poll():
        if message[0] in (linuxcnc.NML_ERROR, linuxcnc.OPERATOR_ERROR):
            texts.append(message[1].strip())
    return texts


class Machine:
    def __init__(self, ini):
        self.command, self.status, self.channel = (
            linuxcnc.command(),
            linuxcnc.stat(),
            linuxcnc.error_channel(),
        )
        self.ini = linuxcnc.ini(ini)
        self.status.poll()

    def wait(self, condition, what):
        end = time.monotonic() + LIMIT
        while True:
            self.status.poll()
            if condition(self.status):
                return
            if time.monotonic() > end:
                raise Failed(
                    f"{what}: not within {LIMIT:.0f} s"
                    + "".join(f"; {text}" for text in errors(self.channel))
                )
            time.sleep(0.02)

    def on(self):
        self.command.state(linuxcnc.STATE_ESTOP_RESET)
        self.wait(lambda s: s.task_state != linuxcnc.STATE_ESTOP, "e-stop reset")
        self.command.state(linuxcnc.STATE_ON)
        self.wait(lambda s: s.task_state == linuxcnc.STATE_ON, "on")

    def home(self):
        """By the sequences of the INI file; joints without one by themselves."""
        joints = range(self.status.joints)
        self.command.mode(linuxcnc.MODE_MANUAL)
        self.command.wait_complete()
        self.command.teleop_enable(0)
        self.command.wait_complete()
        if any(self.ini.find(f"JOINT_{joint}", "HOME_SEQUENCE") is not None for joint in joints):
            self.command.home(-1)
            single = [
                joint
                for joint in joints
                if self.ini.find(f"JOINT_{joint}", "HOME_SEQUENCE") is None
            ]
        else:
            single = list(joints)
        sequenced = [joint for joint in joints if joint not in single]
        self.wait(lambda s: all(s.homed[joint] for joint in sequenced), "homing by sequence")
        for joint in single:
            self.command.home(joint)
            self.wait(lambda s, at=joint: s.homed[at], f"homing of joint {joint}")
        self.wait(lambda s: all(s.homed[joint] for joint in joints), "homing")

    def mdi(self, line):
        """Where the machine has moved to, or an error."""
        errors(self.channel)
        before = self.status.actual_position
        self.command.mode(linuxcnc.MODE_MDI)
        self.command.wait_complete()
        self.command.mdi(line)
        if self.command.wait_complete(LIMIT) == -1:
            raise Failed(f"{line}: not within {LIMIT:.0f} s")
        self.wait(lambda s: s.interp_state == linuxcnc.INTERP_IDLE and s.inpos, line)
        texts = errors(self.channel)
        if texts:
            return texts[0]
        self.status.poll()
        moved = max(abs(a - b) for a, b in zip(before, self.status.actual_position))
        return "" if moved > 0.0005 else f"{line}: the position has not changed"

    def move(self):
        """A short move of the first axis that is not at a limit in both directions; which one, and its distance."""
        axes = [letter for at, letter in enumerate("XYZABCUVW") if self.status.axis_mask >> at & 1]
        problem = "no axis"
        for axis in ["Z"] * ("Z" in axes) + [axis for axis in axes if axis != "Z"]:
            for distance in (-0.1, 0.1):
                found = self.mdi(f"G91 G1 F60 {axis}{distance}")
                if not found:
                    return axis, distance
                problem = found if problem == "no axis" else problem
                self.wait(lambda s: s.interp_state == linuxcnc.INTERP_IDLE, "idle after an error")
        raise Failed(problem)

    def program(self, axis, distance):
        path = os.path.join(os.environ["CONFIG_DIR"], "sweep.ngc")
        with open(path, "w", encoding="ascii") as file:
            file.write(f"G91 G1 F60 {axis}{-distance}\n{axis}{distance}\nG90\nM2\n")
        errors(self.channel)
        self.command.mode(linuxcnc.MODE_AUTO)
        self.command.wait_complete()
        self.command.program_open(path)
        self.command.wait_complete()
        self.command.auto(linuxcnc.AUTO_RUN, 0)
        self.command.wait_complete()
        self.wait(lambda s: s.interp_state == linuxcnc.INTERP_IDLE and s.inpos, "the program")
        texts = errors(self.channel)
        if texts:
            raise Failed(texts[0])


def main():
    step = "started"
    try:
        machine = Machine(sys.argv[sys.argv.index("-ini") + 1])
        print("sweep: started", flush=True)
        step = "on"
        machine.on()
        step = "homed"
        machine.home()
        print("sweep: homed", flush=True)
        step = "moved"
        where = machine.move()
        print("sweep: moved", flush=True)
        step = "program"
        machine.program(*where)
        print("sweep: program", flush=True)
    except (Failed, linuxcnc.error) as problem:
        texts = errors(machine.channel) if step != "started" else []
        print(f"sweep: not {step}: {problem}" + "".join(f"; {text}" for text in texts), flush=True)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
