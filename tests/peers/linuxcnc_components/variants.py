# SPDX-License-Identifier: MIT
"""Which components are compared, and with which load arguments: each variant of a component is compared on its own."""
from dataclasses import dataclass


@dataclass(frozen=True)
class Variant:
    """A component with the arguments of its `loadrt`."""

    component: str
    arguments: str = ""

    def __str__(self):
        return f"{self.component} {self.arguments}".strip()

    @property
    def key(self):
        """A name for files."""
        return "".join(c if c.isalnum() else "_" for c in str(self))


# Components that do nothing, or do not load in LinuxCNC, without arguments; and those whose arguments select a behaviour.
ARGUMENTS = {
    "bldc": ["cfg=h", "cfg=q", "cfg=ai", "cfg=n"],
    "bitslice": ["personality=8", "personality=16"],
    "debounce": ["cfg=1", "cfg=2,3"],
    "demux_generic": ["config=bb2", "config=ff3", "config=ss4,uu2"],
    "encoder": ["num_chan=1"],
    "encoder_ratio": ["num_chan=1"],
    "enum": ['enums="E;one;two;;four"'],
    "gantry": ["personality=2", "personality=3"],
    "gearchange": [""],
    "lcd": ["fmt_strings=%d"],
    "lincurve": ["personality=2", "personality=4"],
    "logic": [
        "personality=0x102",
        "personality=0x204",
        "personality=0x403",
        "personality=0x703",
        "personality=0x804",
        "personality=0x1002",
        "personality=0x1805",
    ],
    "matrix_kb": ["config=2x3", "config=4x4s"],
    "message": ['names=message.0 messages="hello"'],
    "multiswitch": ["personality=3"],
    "mux_generic": [
        "config=bb2",
        "config=ff3",
        "config=su4",
        "config=uf2",
        "config=fs2",
        "config=bs3",
        "config=fb2",
    ],
    "pid": ["num_chan=1", "num_chan=1 debug=1"],
    "pwmgen": ["output_type=0", "output_type=1", "output_type=2"],
    "sampler": ["depth=5 cfg=bfsu"],
    "streamer": ["depth=5 cfg=bfsu"],
    "siggen": ["num_chan=1"],
    "sim_encoder": ["num_chan=1"],
    "spindle": [""],
    "stepgen": [f"step_type={kind}" for kind in range(0, 15)] + ["step_type=0 ctrl_type=v"],
    "supply": ["num_chan=1"],
    "watchdog": ["num_inputs=2"],
    "weighted_sum": ["wsum_sizes=3"],
    "counter": ["num_chan=1"],
    "modmath": ["mod_dir=1"],
}


def variants(component):
    return [Variant(component, arguments) for arguments in ARGUMENTS.get(component, [""])]
