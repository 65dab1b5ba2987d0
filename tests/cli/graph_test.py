# SPDX-License-Identifier: MIT
"""hal graph: what is drawn of a netlist."""
import re
import shutil
import subprocess
import unittest

from harness import HAL, ROOT, Case

BAD = """loadrt threads name1=servo period1=1000000
loadrt sum2 names=adder
net a adder.outt
setp adder.in0 much
addf adder sevo
"""


def axes(count):
    """A netlist of `count` axes of ten instances each, enabled by one signal."""
    names = [f"a{i}" for i in range(count)]
    text = "loadrt threads name1=servo period1=1000000\n"
    parts = {
        "pid": "pid",
        "limit3": "limit",
        "sum2": "bias",
        "scale": "scale",
        "lowpass": "filter",
        "and2": "ready",
        "or2": "fault",
        "not": "inverse",
        "ddt": "speed",
        "wcomp": "window",
    }
    for component, part in parts.items():
        text += f"loadrt {component} names={','.join(f'{n}-{part}' for n in names)}\n"
    functions = {"pid": ".do-pid-calcs"}
    for n in names:
        for component, part in parts.items():
            text += f"addf {n}-{part}{functions.get(component, '')} servo\n"
        text += f"""net {n}-command {n}-limit.out => {n}-pid.command
net {n}-feedback {n}-filter.out => {n}-pid.feedback {n}-speed.in
net {n}-output {n}-pid.output => {n}-bias.in0
net {n}-biased {n}-bias.out => {n}-scale.in
net {n}-scaled {n}-scale.out => {n}-filter.in
net {n}-velocity {n}-speed.out => {n}-window.in
net {n}-moving {n}-window.out => {n}-ready.in0
net {n}-is-ready {n}-ready.out => {n}-fault.in0
net {n}-faulted {n}-fault.out => {n}-inverse.in
"""
    return (
        text
        + "net enable-all a0-inverse.out => "
        + " ".join(f"{n}-pid.enable" for n in names)
        + "\n"
    )


class Graph(Case):
    LOOP = """loadrt threads name1=base period1=100000 fp1=0 name2=servo period2=1000000
loadrt sum2 names=first,second,other
addf first servo
addf second servo
addf other base
net forward first.out => second.in0 other.in0
net back second.out => first.in0
net loose second.in1
"""

    def test_dot_has_a_port_per_pin_and_styles(self):
        text = self.good("graph", self.write("loop.hal", self.LOOP))
        self.assertTrue(text.startswith("digraph "))
        ports = {
            label: port
            for port, label in re.findall(r'<td port="(p\d+)"[^>]*><font[^>]*>([^<]+)</font>', text)
        }
        self.assertLessEqual({"in0", "in1", "out", "offset"}, set(ports) | {"offset"})
        edges = re.findall(r'-> .*style=(\w+), tooltip="([^"]+)"', text)
        self.assertIn(("solid", "forward"), edges)
        self.assertIn(("dotted", "forward"), edges)
        self.assertIn(("dashed", "back"), edges)
        self.assertIn("1. in servo", text)
        self.assertIn("2. in servo", text)
        self.assertIn('label="loose"', text)

    @unittest.skipUnless(shutil.which("dot"), "Graphviz is not installed")
    def test_svg(self):
        self.good("graph", self.write("loop.hal", self.LOOP), "-o", "loop.svg")
        drawing = (self.folder / "loop.svg").read_text()
        self.assertIn("<svg", drawing)
        self.assertIn("forward", drawing)

    def test_svg_without_graphviz_names_the_package(self):
        error = self.bad(
            "graph",
            self.write("loop.hal", self.LOOP),
            "-o",
            "loop.svg",
            environment={"PATH": str(self.folder)},
        )
        self.assertIn("apt install graphviz", error)

    def test_dot_file(self):
        path = self.write("loop.hal", self.LOOP)
        self.good("graph", path, "-o", "loop.dot")
        self.assertEqual(self.good("graph", path), (self.folder / "loop.dot").read_text())

    CHAIN = """loadrt threads name1=servo period1=1000000
loadrt sum2 names=a,b,c,d
loadrt and2 names=gate
addf a servo
addf b servo
addf c servo
addf d servo
net ab a.out => b.in0
net bc b.out => c.in0
net cd c.out => d.in0
net back d.out => a.in0
"""

    def instances(self, *words):
        """The instances that a drawing of CHAIN shows."""
        text = self.good("graph", self.write("chain.hal", self.CHAIN), *words)
        return text, sorted(re.findall(r"<b>([^<]+)</b>", text))

    def test_one_cycle_old_reads_are_marked_and_do_not_rank(self):
        text, _ = self.instances()
        back = next(line for line in text.splitlines() if 'tooltip="back"' in line)
        self.assertIn("style=dashed", back)
        self.assertIn('headlabel="z⁻¹", constraint=false', back)
        self.assertNotIn("z⁻¹", next(line for line in text.splitlines() if 'tooltip="ab"' in line))

    def test_around_an_instance_draws_its_neighbours(self):
        text, seen = self.instances("--around", "b")
        self.assertEqual(["a", "b", "c"], seen)
        self.assertIn('bgcolor="#fff2a8"><b>b</b>', text)
        self.assertIn("← d.out z⁻¹", text)  # the writer of a.in0 is outside
        self.assertIn("→ cd +1", text)
        self.assertIn("unlinked pin<", text)
        self.assertEqual(["b"], self.instances("--around", "b", "--depth", "0")[1])
        self.assertEqual(["a", "b", "c", "d"], self.instances("--around", "b", "--depth", "2")[1])

    def test_around_a_pin_or_signal_follows_its_signal_first(self):
        self.assertEqual(["b", "c"], self.instances("--around", "b.out")[1])
        self.assertEqual(["b", "c"], self.instances("--around", "bc", "--depth", "0")[1])
        self.assertEqual(
            ["a", "b", "c", "d"], self.instances("--around", "b.out", "--depth", "2")[1]
        )
        text, seen = self.instances("--around", "gate.in0")
        self.assertEqual(["gate"], seen)
        self.assertIn("in0", text)  # unlinked, but asked for
        self.assertNotIn(">in1<", text)

    def test_clusters(self):
        text, _ = self.instances("--cluster", "component")
        self.assertIn('subgraph "cluster sum2" {', text)
        self.assertIn('subgraph "cluster and2" {', text)
        self.write("axis.hal", "loadrt sum2 names=x\n")
        text = self.good(
            "graph",
            self.write("main.hal", "loadrt and2 names=gate\nsource axis.hal\n"),
            "--cluster",
            "file",
        )
        self.assertRegex(text, r'subgraph "cluster [^"]*axis.hal" \{')
        self.assertRegex(text, r'subgraph "cluster [^"]*main.hal" \{')
        text, _ = self.instances("--cluster", "thread")
        self.assertIn('subgraph "cluster servo" {', text)
        outside = text[text.rindex("    }\n") :]  # gate is in no thread: not in a frame
        self.assertIn("<b>gate</b>", outside + text[: text.index("subgraph")])

    def test_wrong_options_name_the_right_ones(self):
        path = self.write("chain.hal", self.CHAIN)
        self.assertEqual(
            "hal graph: no pin, signal or instance 'a.outt'; did you mean 'a.out'?\n",
            self.bad("graph", path, "--around", "a.outt"),
        )
        self.assertEqual(
            "hal graph: invalid --cluster 'files'; type: --cluster component, file, thread or none\n",
            self.bad("graph", path, "--cluster", "files"),
        )
        self.assertEqual(
            "hal graph: --depth needs a name to start from; type: --around NAME --depth 2\n",
            self.bad("graph", path, "--depth", "2"),
        )
        self.assertEqual(
            "hal graph: invalid --pins 'some'; type: --pins all or --pins linked\n",
            self.bad("graph", path, "--pins", "some"),
        )

    def test_a_signal_with_many_readers_is_a_label_at_both_ends(self):
        names = [f"g{i}" for i in range(10)]
        text = self.good(
            "graph",
            self.write(
                "hub.hal",
                f"loadrt threads name1=servo period1=1000000\nloadrt and2 names={','.join(names)}\n"
                "addf g0 servo\naddf g1 servo\nnet estop g1.out => "
                + " ".join(f"{n}.in0" for n in names)
                + "\n",
            ),
        )
        self.assertIn("→ estop (10 readers)", text)
        self.assertEqual(10, text.count("← estop"))
        self.assertIn("← estop z⁻¹", text)  # g0 runs before g1
        self.assertNotIn("->", text)
        around = self.good("graph", str(self.folder / "hub.hal"), "--around", "g3")
        self.assertEqual(["g3"], re.findall(r"<b>([^<]+)</b>", around))

    @unittest.skipUnless(shutil.which("dot"), "Graphviz is not installed")
    def test_three_hundred_instances_are_drawn_without_their_unlinked_pins(self):
        path = self.write("axes.hal", axes(30))
        text = self.good("graph", path, "--cluster", "component")
        self.assertEqual(300, text.count("<b>"))
        self.assertNotIn(">FF0<", text)
        self.assertIn(">FF0<", self.good("graph", path, "--pins", "all"))
        self.good("graph", path, "-o", "axes.svg")
        drawing = (self.folder / "axes.svg").read_text().replace("&#45;", "-")
        self.assertIn("enable-all", drawing)
        self.assertLess(len(drawing), 3_000_000)

    @unittest.skipUnless(shutil.which("dot"), "Graphviz is not installed")
    def test_the_drawing_in_the_documentation_is_that_of_its_netlist(self):
        netlist = "halfiles/furuta/hang.hal"
        drawn = subprocess.run(
            [
                *(str(HAL), "graph", netlist, "--pins", "linked"),
                *("-o", str(self.folder / "furuta.svg")),
            ],
            cwd=ROOT,
            env=self.environment,
            stderr=subprocess.PIPE,
        )
        self.assertEqual((0, b""), (drawn.returncode, drawn.stderr))
        texts = [
            re.findall(r"<text[^>]*>([^<]*)</text>", path.read_text())
            for path in (self.folder / "furuta.svg", ROOT / "docs/furuta.svg")
        ]
        self.assertEqual(
            sorted(texts[0]),
            sorted(texts[1]),
            f"draw it again: hal graph {netlist} --pins linked -o docs/furuta.svg",
        )

    def test_names_are_escaped(self):
        text = self.good(
            "graph",
            self.write(
                "odd.hal", "loadrt sum2 names=a<b&c\nnewsig s<&>x float\nnet s<&>x a<b&c.out\n"
            ),
        )
        self.assertIn("<b>a&lt;b&amp;c</b>", text)
        self.assertIn('label="s<&>x"', text)

    def test_rejects_other_endings_and_bad_netlists(self):
        path = self.write("loop.hal", self.LOOP)
        self.assertIn("neither .svg nor .dot", self.bad("graph", path, "-o", "loop.png"))
        self.assertIn("bad.hal:3", self.bad("graph", self.write("bad.hal", BAD)))


if __name__ == "__main__":
    unittest.main()
