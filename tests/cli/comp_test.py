#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""hal compile of .comp files: the language's features in components of our own, and where the compiler's errors point."""
import unittest

from harness import Case

EVERYTHING = '''component everything "All that the language has"; // a comment
/* another */
pin in bit in-##[8 : personality & 0xf] "the inputs";
pin out bit all if personality & 0x10 "every input is set";
pin io s32 edges = 3 "how often it ran";
pin out float level_ = 1.5;
pin in u64 big; pin in s64 small_one = -5; pin in unsigned word = 0x10;
pin out bool fresh; pin out real time-sum; pin out sint doubled-#[2]; pin out ui32 copied;
param rw float gain = 2.0;
param r s32 number;
variable double seconds = 0.25;
variable int *where; variable int table[3] = 4;
modparam int step = 1 "added to edges";
modparam dummy words;
option extra_setup; option extra_cleanup; option post_export; option data memory;
option default_count 2;
function _ "runs"; function other-one nofp;
include <rtapi_math.h>;
description """
Two \\\\fBparagraphs\\\\fR.
.P
The second.""";
notes "a note"; see_also "and2"; author "An Author"; license "MIT";
;;
typedef struct { int calls; } memory;
char *words[2] = {0, 0};
RTAPI_MP_ARRAY_STRING(words, 2, "two words");

EXTRA_SETUP() {
    where = table;
    number = (rtapi_s32)extra_arg;
    if (personality == 99) {
        rtapi_print_msg(RTAPI_MSG_ERR, "%s: not 99\\n", prefix);
        return -EINVAL;
    }
    return 0;
}
POST_EXPORT() { (void)prefix, (void)extra_arg; fresh_set(words[0] != 0); return 0; }
EXTRA_CLEANUP() {}
FUNCTION(_) {
    int i, a = 1;
    for (i = 0; i < (personality & 0xf); i++) a = a && in(i);
    if (personality & 0x10) all = a;
    data.calls++;
    edges += step;
    seconds += fperiod;
    time_sum_set(seconds);
    level_ = fabs(gain * small_one);
    doubled_set(0, 2 * small_one);
    doubled_set(1, doubled_set(0, 2 * small_one) + where[2] + (rtapi_sint)big);
    copied_set(word + period / 1000000);
}
FUNCTION(other_one) { hal_set_bool(fresh_ptr, data.calls > 2); (void)period; }
'''

NETLIST = """loadrt everything names=a,b personality=0x12,0x01 step=2 words=x
loadrt threads name1=t period1=1000000
addf a t
addf a.other-one t
addf b t
setp a.in-00 1
setp a.in-01 1
setp a.big 100
start
advance 3 cycles
"""


class Comp(Case):
    def setUp(self):
        super().setUp()
        self.home = self.folder / "data"
        self.environment["XDG_DATA_HOME"] = str(self.home)
        self.plugins = self.environment.pop("HALCYON_PLUGIN_PATH", None)

    def compiled(self, name, text):
        (self.folder / f"{name}.comp").write_text(text)
        return self.good("compile", f"{name}.comp")

    def refused(self, name, text):
        (self.folder / f"{name}.comp").write_text(text)
        said = self.bad("compile", f"{name}.comp")
        self.assertFalse((self.home / "halcyon" / "components" / f"{name}.so").exists())
        return said

    def values(self, netlist, *names):
        (self.folder / "test.hal").write_text(netlist + "".join(f"getp {name}\n" for name in names))
        return self.good("sim", "test.hal").split()

    def test_every_feature_works(self):
        said = self.compiled("everything", EVERYTHING)
        self.assertIn("everything: ", said)
        self.assertIn("addf everything.0 THREAD", said)
        names = (
            "a.all",
            "a.edges",
            "a.level",
            "a.time-sum",
            "a.doubled-0",
            "a.doubled-1",
            "a.copied",
            "a.fresh",
            "a.number",
            "b.number",
            "b.fresh",
        )
        self.assertEqual(
            ["TRUE", "9", "10", "0.253", "-10", "94", "17", "TRUE", "0", "1", "TRUE"],
            self.values(NETLIST, *names),
        )

    def test_instances_are_counted_and_pins_are_the_personality_s(self):
        self.compiled("everything", EVERYTHING)
        (self.folder / "test.hal").write_text(
            "loadrt everything personality=3\nlist pin everything.0.in everything.1.in\n"
        )
        self.assertEqual(
            "everything.0.in-00 everything.0.in-01 everything.0.in-02 everything.1.in-00 everything.1.in-01 everything.1.in-02".split(),
            self.good("sim", "test.hal").split(),
        )

    def test_the_manual_page_is_in_the_plugin(self):
        self.compiled("everything", EVERYTHING)
        page = self.good("doc", "everything")
        for line in (
            "everything: All that the language has",
            "step=",
            "added to edges",
            "everything.N.other-one",
            "how often it ran (initial 3)",
            "Two **paragraphs**.",
            "in-## (bit in), as many as personality & 0xf and at most 8: the inputs",
            "An Author",
        ):
            self.assertIn(line, page)

    def test_an_instance_rejected_by_EXTRA_SETUP_is_not_created(self):
        self.compiled("everything", EVERYTHING)
        (self.folder / "test.hal").write_text("loadrt everything names=x personality=99\n")
        self.assertIn(
            "cannot make 'x': x: not 99 (EXTRA_SETUP: Invalid argument)",
            self.bad("check", "test.hal"),
        )

    def test_rejects_more_pins_than_the_array_holds(self):
        self.compiled("everything", EVERYTHING)
        (self.folder / "test.hal").write_text("loadrt everything names=x personality=9\n")
        self.assertIn(
            "personality asks for 9 pins in-##, there are at most 8", self.bad("check", "test.hal")
        )

    def test_the_code_alone_is_the_body_of_the_only_function(self):
        self.compiled(
            "half",
            'component half;\npin in float in;\npin out float out;\nfunction _;\nlicense "MIT";\n;;\nout = in / 2;\n',
        )
        self.assertEqual(
            ["3.5"],
            self.values(
                "loadrt half\nloadrt threads name1=t period1=1000000\naddf half.0 t\nsetp half.0.in 7\nstart\nadvance 1 cycles\n",
                "half.0.out",
            ),
        )

    def test_parameters_by_pointer_of_EXTRA_SETUP_are_kept_in_step(self):
        self.compiled(
            "own",
            'component own;\npin out float out;\nvariable hal_float_t gain;\nvariable hal_u32_t runs;\noption extra_setup;\nfunction _;\nlicense "MIT";\n;;\n'
            "EXTRA_SETUP() {\n    gain = 2;\n    (void)extra_arg;\n"
            '    return hal_param_float_newf(HAL_RW, &gain, comp_id, "%s.gain", prefix) || hal_param_u32_newf(HAL_RO, &runs, comp_id, "%s.runs", prefix);\n}\n'
            "FUNCTION(_) { out = gain; runs++; }\n",
        )
        netlist = (
            "loadrt own names=a,b\nloadrt threads name1=t period1=1000000\naddf a t\naddf b t\nsetp b.gain 5\nstart\nadvance 3 cycles\n"
            "getp a.out\ngetp b.out\nsetp a.gain 7\nadvance 1 cycles\n"
        )
        self.assertEqual(["2", "5", "7", "4"], self.values(netlist, "a.out", "a.runs"))

    def test_headers_of_helpers(self):
        self.compiled(
            "helpers",
            """component helpers; pin in float angle; pin out float forward; pin out float sideways; pin out s32 sum; function _; license "MIT";
include <rtapi_list.h>; include <rtapi_io.h>; include <posemath.h>;
;;
struct number { struct rtapi_list_head link; int value; };
FUNCTION(_) {
    struct number numbers[] = {{{0, 0}, 1}, {{0, 0}, 20}, {{0, 0}, 300}};
    struct rtapi_list_head *at, *after;
    PmEulerZyz zyz;
    RTAPI_LIST_HEAD(list);
    for (int i = 0; i < 3; ++i) rtapi_list_add_tail(&numbers[i].link, &list);
    rtapi_list_for_each_safe(at, after, &list) if (rtapi_list_entry(at, struct number, link)->value == 20) rtapi_list_del(at);
    sum = 0;
    rtapi_list_for_each(at, &list) sum += rtapi_list_entry(at, struct number, link)->value;
    const PmRpy turn = {0, 0, angle};
    PmPose pose = {{1, 2, 3}, {1, 0, 0, 0}}, back, both;
    PmCartesian point = {2, 0, 0};
    pmRpyZyzConvert(&turn, &zyz);
    pmZyzQuatConvert(&zyz, &pose.rot);
    pmPoseInv(&pose, &back);
    pmPosePoseMult(&pose, &back, &both);
    pmPoseCartMult(&both, &point, &point);
    pmPoseCartMult(&pose, &point, &point);
    forward = point.x;
    sideways = point.y;
}
""",
        )
        netlist = "loadrt helpers\nloadrt threads name1=t period1=1000000\naddf helpers.0 t\nsetp helpers.0.angle 1.5707963267948966\nstart\nadvance 1 cycles\n"
        x, y, total = map(
            float, self.values(netlist, "helpers.0.forward", "helpers.0.sideways", "helpers.0.sum")
        )
        self.assertEqual((301, 1, 4), (total, round(x, 9), round(y, 9)))

    def test_header_of_the_go_functions(self):
        self.compiled(
            "arm",
            """component arm; pin in float shoulder; pin in float elbow; pin out float ahead; pin out float left; pin out float turned; pin out float back;
pin out float inverse; pin out float on_plane; function _; license "MIT"; include "gomath.h";
;;
FUNCTION(_) {
    const go_link links[] = {{{.dh = {0, 0, 0, 0}}, GO_LINK_DH, GO_QUANTITY_ANGLE}, {{.dh = {2, 0, 0, 0}}, GO_LINK_DH, GO_QUANTITY_ANGLE},
                             {{.pp = {{{1, 0, 0}, {1, 0, 0, 0}}}}, GO_LINK_PP, GO_QUANTITY_LENGTH}};
    go_link set[3];
    go_pose hand, away;
    go_rpy angles;
    if (go_link_joint_set(&links[0], shoulder, &set[0]) || go_link_joint_set(&links[1], elbow, &set[1]) || go_link_joint_set(&links[2], 0.5, &set[2])) return;
    if (go_link_pose_build(set, 3, &hand) || go_quat_rpy_convert(&hand.rot, &angles) || go_pose_inv(&hand, &away) || go_pose_pose_mult(&hand, &away, &away)) return;
    ahead = hand.tran.x;
    left = hand.tran.y;
    turned = angles.y;
    back = go_pose_pose_compare(&away, &(go_pose){{0, 0, 0}, {1, 0, 0, 0}});
    GO_MATRIX_DECLARE(m, m_space, 2, 2);
    go_matrix_init(m, m_space, 2, 2);
    m.el[0][0] = 1, m.el[0][1] = 2, m.el[1][0] = 3, m.el[1][1] = 4;
    if (go_matrix_inv(&m, &m) == GO_RESULT_OK) inverse = m.el[1][0];
    go_plane plane;
    go_cart foot;
    if (go_plane_from_abcd(0, 0, 2, -6, &plane) == GO_RESULT_OK && go_point_plane_proj(&hand.tran, &plane, &foot) == GO_RESULT_OK) on_plane = foot.z;
}
""",
        )
        netlist = (
            "loadrt arm\nloadrt threads name1=t period1=1000000\naddf arm.0 t\nsetp arm.0.shoulder 1.5707963267948966\n"
            "setp arm.0.elbow -0.7853981633974483\nstart\nadvance 1 cycles\n"
        )
        got = [
            round(float(v), 6)
            for v in self.values(
                netlist,
                *(f"arm.0.{n}" for n in ("ahead", "left", "turned", "back", "inverse", "on-plane")),
            )
        ]
        self.assertEqual([0.707107, 2.707107, 0.785398, 1, 1.5, 3], got)

    def test_a_port_is_given_by_handle_or_by_pointer(self):
        self.compiled(
            "mouth",
            'component mouth;\npin in port bytes;\npin out u32 waiting;\npin out bit same;\nfunction _;\nlicense "MIT";\n;;\n'
            "static unsigned held(const hal_port_t *port) { return hal_port_readable(port); }\n"
            "FUNCTION(_) { char byte; waiting = held(bytes_ptr); same = waiting == hal_port_readable(bytes); if (hal_port_peek(bytes_ptr, &byte, 1)) hal_port_clear(bytes); }\n",
        )
        self.assertEqual(
            ["TRUE"],
            self.values(
                "loadrt mouth\nloadrt threads name1=t period1=1000000\naddf mouth.0 t\nstart\nadvance 1 cycles\n",
                "mouth.0.same",
            ),
        )

    def test_names_as_LinuxCNC_makes_them(self):
        self.compiled(
            "hal_loop",
            'component hal_loop;\npin out bit x_y_;\nparam r s32 two_words.##.z[2];\noption singleton no;\nfunction _ nofp;\nlicense "MIT";\n;;\nx_y_ = 1;\n',
        )
        (self.folder / "test.hal").write_text(
            "loadrt hal_loop\nlist pin loop.0\nlist param loop.0.two\n"
        )
        self.assertEqual(
            "loop.0.time loop.0.x-y loop.0.two-words.00.z loop.0.two-words.01.z".split(),
            self.good("sim", "test.hal").split(),
        )

    def test_errors_of_the_compiler_point_into_the_file(self):
        text = 'component wrong;\npin in bit in;\npin out bool out;\nvariable no_type v;\nfunction _;\nlicense "MIT";\n;;\nFUNCTION(_) {\n    in = 1;\n    out = in;\n    nothing();\n}\n'
        said = self.refused("wrong", text)
        for place in ("wrong.comp:4:", "wrong.comp:9:", "wrong.comp:10:"):
            self.assertIn(place, said)
        self.assertIn("assignment of read-only location", said)
        self.assertIn("'wrong.comp' does not compile; it was not installed", said)

    def test_mistakes_in_declarations_are_all_reported(self):
        said = self.refused(
            "wrong",
            'component wrong;\npin inn bit a;\npin in bti b;\nfunction _;\nlicense "MIT";\n;;\n',
        )
        self.assertIn(
            "wrong.comp:2:5: error: invalid direction: a pin is in, out or io [bad-component-source]",
            said,
        )
        self.assertIn("did you mean 'bit'?", said)
        self.assertIn("'wrong.comp' has 2 errors; it was not installed", said)


if __name__ == "__main__":
    unittest.main()
