# SPDX-License-Identifier: MIT
"""save: a machine whose instances were loaded and unloaded at random is the same after its saved file."""
import random
import unittest

from harness import Case

COMPONENTS = ("and2", "or2", "integ", "not", "logic")


def random_edits(seed):
    """Lines of loadrt and unload, in which each name is free when it is used."""
    dice = random.Random(seed)
    lines = []
    living = {}
    serial = {}
    for number in range(30):
        if living and dice.random() < 0.4:
            name = dice.choice(sorted(living))
            component = living.pop(name)
            lines.append(f"unload {name}")
            if component not in living.values():
                serial.pop(component, None)  # it numbers its instances from 0 again
            continue
        component = dice.choice(COMPONENTS)
        count = dice.randint(1, 3)
        personality = ""
        if component == "logic":
            personality = " personality=" + ",".join(
                dice.choice(("0x102", "0x203", "0x104")) for _ in range(count)
            )
        if dice.random() < 0.5:
            names = [f"n{number}-{i}" for i in range(count)]
            lines.append(f"loadrt {component} names={','.join(names)}{personality}")
        else:
            first = serial.get(component, 0)
            names = [f"{component}.{first + i}" for i in range(count)]
            serial[component] = first + count
            lines.append(f"loadrt {component} count={count}{personality}")
        living.update((name, component) for name in names)
    return lines


class Save(Case):
    def test_what_was_saved_makes_the_same_instances(self):
        for seed in range(20):
            with self.subTest(seed=seed):
                lines = random_edits(seed)
                saved = self.folder / "saved.hal"
                text = "\n".join([*lines, f"save all {saved}", "list pin"]) + "\n"
                before = self.good("sim", "-q", self.write("before.hal", text))
                after = self.write("after.hal", saved.read_text() + "list pin\n")
                self.assertEqual(before.split(), self.good("sim", "-q", after).split(), lines)


if __name__ == "__main__":
    unittest.main()
