// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <string>

#include "tools/comp/comp.hpp"
#include "tools/comp/syntax.hpp"
#include "tools/comp/toolchain.hpp"

namespace {

using namespace hal::comp;

class Comp : public testing::Test {
protected:
    Tree read(const std::string& text) {
        return parse(sources_, sources_.add("x.comp", text), found_);
    }
    std::string mistakes(const std::string& text) {
        found_.clear();
        made_ = translate(sources_, sources_.add("x.comp", text), found_);
        std::string all;
        for (const hal::Diagnostic& one : found_.all()) {
            all += sources_.location(one.labels.at(0).span).substr(7) + " " + one.message +
                   (one.help.empty() ? "" : " | " + one.help[0]) + "\n";
        }
        return all;
    }
    std::string c() const { return made_ ? made_->c : ""; }

    hal::Sources sources_;
    hal::Diagnostics found_;
    std::optional<Translation> made_;
};

const std::string head = "component x;\nlicense \"MIT\";\n";
const std::string code = ";;\nFUNCTION(_) {}\n";

TEST_F(Comp, spells_names_for_netlists_and_for_C) {
    struct Row {
        const char *written, *hal, *c;
    };
    for (const Row& row : {Row{"x_y_z", "x-y-z", "x_y_z"}, Row{"x-y.z", "x-y.z", "x_y_z"},
                           Row{"x_y_z_", "x-y-z", "x_y_z_"}, Row{"x.##.y", "x.##.y", "x_y"},
                           Row{"x.##", "x.##", "x"}, Row{"in-#", "in-#", "in"}, Row{"_", "", "_"},
                           Row{"a--b", "a--b", "a_b"}, Row{"min.", "min", "min_"}}) {
        const Name name = spelled({row.written, {1, 0, 1}});
        EXPECT_EQ(name.hal, row.hal) << row.written;
        EXPECT_EQ(name.c, row.c) << row.written;
    }
    EXPECT_EQ(numbered("x.##.y", 7), "x.07.y");
    EXPECT_EQ(numbered("in-#", 12), "in-12");
}

TEST_F(Comp, reads_every_declaration) {
    const Tree tree = read(R"(component x "a summary" " in two parts";
pin in float angle;                        // a comment
pin out bool out-##[16 : personality & 0xff] if personality & 0x100 "each";
pin io s64 count = -3 if personality == 2;
param rw unsigned gain = 0x10 "how much"; /* another
comment */ param r bit ready;
function _ nofp "acts"; function slow-one;
variable double *old; variable int table[4] = 1; variable hal_s32_t n = MAX(1, 2);
option singleton; option default_count 3; option extra_setup no; option extra_link_args "-la -lb";
include <math.h>; include "mine.h";
modparam int limit = 4 "of it"; modparam dummy names;
description """
two
lines"""; notes "n"; examples r"\fB"; see_also "s"; author "a"; author "b"; license "MIT";
;;
the code
)");
    EXPECT_FALSE(found_.failed());
    EXPECT_EQ(tree.name.text, "x");
    EXPECT_EQ(tree.summary.text, "a summary in two parts");
    ASSERT_EQ(tree.items.size(), 5u);
    EXPECT_EQ(tree.items[1].size, 16u);
    EXPECT_EQ(tree.items[1].count.text, "personality & 0xff");
    EXPECT_EQ(tree.items[1].condition.text, "personality & 0x100");
    EXPECT_EQ(tree.items[1].doc.text, "each");
    EXPECT_TRUE(tree.items[1].settable);
    EXPECT_FALSE(tree.items[2].settable);
    EXPECT_EQ(tree.items[2].type, HAL_TYPE_S64);
    EXPECT_EQ(tree.items[2].start.text, "-3");
    EXPECT_EQ(tree.items[2].condition.text, "personality == 2");
    EXPECT_EQ(tree.items[3].dir, HAL_DIR_PARAM);
    EXPECT_EQ(tree.items[3].type, HAL_TYPE_U32);
    EXPECT_EQ(tree.items[4].dir, HAL_DIR_PARAM);
    EXPECT_TRUE(tree.items[4].read_only);
    ASSERT_EQ(tree.functions.size(), 2u);
    EXPECT_EQ(tree.functions[1].name.c, "slow_one");
    ASSERT_EQ(tree.variables.size(), 3u);
    EXPECT_EQ(tree.variables[0].stars, "*");
    EXPECT_EQ(tree.variables[1].size.text, "4");
    EXPECT_EQ(tree.variables[2].start.text, "MAX(1, 2)");
    EXPECT_TRUE(tree.has("singleton"));
    EXPECT_FALSE(tree.has("extra_setup"));
    EXPECT_EQ(tree.includes.at(1).text, "\"mine.h\"");
    EXPECT_EQ(tree.parameters.at(0).start.text, "4");
    EXPECT_TRUE(tree.parameters.at(1).dummy);
    EXPECT_EQ(tree.description.at(0).text, "\ntwo\nlines");
    EXPECT_EQ(tree.examples.at(0).text, "\\fB");
    EXPECT_EQ(sources_.text(tree.code), "the code\n");
}

TEST_F(Comp, reports_every_mistake_at_its_place) {
    EXPECT_EQ(mistakes("component x;\npin inn float a;\npin in flot b;\nparam w bit c;\npni in bit "
                       "d;\npin in bit e\npin in bit f;\nlicense \"MIT\";\n" +
                       code),
              "2:5 invalid direction: a pin is in, out or io | pin in float angle \"what it is\";\n"
              "3:8 unknown type 'flot' | did you mean 'float'?\n"
              "4:7 invalid direction: a parameter is r (set by the component) or rw | param rw "
              "float gain = 1.0 \"what it is\";\n"
              "5:1 unknown declaration 'pni' | did you mean 'pin'?\n"
              "6:13 unexpected text in the declaration\n");
    EXPECT_EQ(mistakes("component x;\npin in bit a \"never\nended;\nlicense \"MIT\";\n" + code),
              "2:14 unterminated string | end it with \"; text of several lines goes between "
              "\"\"\" and \"\"\"\n");
    EXPECT_FALSE(made_);
}

TEST_F(Comp, rejects_contradicting_declarations) {
    EXPECT_EQ(mistakes("component y;\nfunction _;\n" + code),
              "1:11 component 'y' is declared in file 'x.comp' | name the file y.comp, or the "
              "component x\n"
              "1:11 missing license declaration | add: license \"GPL\";\n");
    EXPECT_EQ(
        mistakes(head +
                 "pin in bit x_y; pin in bit x_y_; pin in bit if; pin out bit a-#; pin out bit "
                 "b[2]; pin out s32 tmax; function _;\n" +
                 code),
        "3:61 'a-#' has a placeholder for a number but is not an array | give its size: a-#[4]\n"
        "3:78 the element names of array 'b' have no placeholder for the number | write b-#\n"
        "3:45 invalid C name 'if' | append '_', which keeps the name in netlists: if_\n"
        "3:28 duplicate name 'x-y' | in netlists _ becomes -, and a - or . at the end is dropped\n"
        "3:111 duplicate name 'tmax' | in netlists _ becomes -, and a - or . at the end is "
        "dropped\n");
    EXPECT_EQ(mistakes(head + "pin in bit a if limit > 2; function one; function two; option "
                              "extra_setup;\n;;\nFUNCTION(one) {} // FUNCTION(two)\n"),
              "3:17 a condition consists of numbers and 'personality'; unknown name 'limit' | for "
              "instance: if personality & 0x100\n"
              "3:51 the C code does not define function 'two' | write: FUNCTION(two) { … }\n"
              "3:63 the C code has no EXTRA_SETUP for this option | write: EXTRA_SETUP() { … "
              "return 0; }\n");
    EXPECT_EQ(mistakes(head + "function _;\noption tpmod;\n" + code),
              "4:8 a trajectory planner includes sources of LinuxCNC's motion controller, and "
              "cannot be compiled here | a compiled module works: build this file with "
              "LinuxCNC's own halcompile --install (package linuxcnc-uspace-dev), then write "
              "[TRAJ]TPMOD = x in the INI file, or type: hal linuxcnc -t x FILE.ini\n");
    EXPECT_EQ(mistakes(head + "function _;\noption homemod;\n" + code),
              "4:8 a homing module includes sources of LinuxCNC's motion controller, and cannot be "
              "compiled here | a compiled module works: build this file with "
              "LinuxCNC's own halcompile --install (package linuxcnc-uspace-dev), then write "
              "[EMCMOT]HOMEMOD = x in the INI file, or type: hal linuxcnc -m x FILE.ini\n");
}

TEST_F(Comp, warns_of_options_without_effect) {
    EXPECT_EQ(mistakes(head + "option singelton; function _;\n" + code),
              "3:8 option 'singelton' has no effect here | did you mean 'singleton'?\n");
    EXPECT_TRUE(made_);
}

TEST_F(Comp, takes_the_whole_code_as_the_body_of_an_only_function) {
    EXPECT_EQ(mistakes(head + "pin in bit in; pin out bit out; function _;\n;;\nout = !in;\n"), "");
    EXPECT_NE(c().find("FUNCTION(_) {\n#line 5 \"x.comp\"\nout = !in;\n}\n"), std::string::npos)
        << c();
    EXPECT_EQ(mistakes(head + "function _;\n" + code), "");
    EXPECT_NE(c().find("\n#line 5 \"x.comp\"\nFUNCTION(_) {}\n"), std::string::npos) << c();
}

TEST_F(Comp, lets_old_types_be_assigned_and_new_ones_be_set) {
    EXPECT_EQ(
        mistakes(head +
                 "pin in bit a; pin out bit b; pin in bool c; pin out bool d-#[2]; function _;\n" +
                 code),
        "");
    EXPECT_NE(c().find("#define a (*(hal_bit_t const *)"), std::string::npos);
    EXPECT_NE(c().find("#define b (*__comp_inst"), std::string::npos);
    EXPECT_EQ(c().find("#define b_set"), std::string::npos);
    EXPECT_NE(c().find("#define d(i) (*(rtapi_bool volatile const *)"), std::string::npos);
    EXPECT_NE(c().find("#define d_set(i, v)"), std::string::npos);
    EXPECT_EQ(c().find("#define c_set"), std::string::npos);
}

TEST_F(Comp, turns_manual_page_macros_into_Markdown) {
    EXPECT_EQ(markdown_of("plain text"), "plain text");
    EXPECT_EQ(markdown_of("a \\fBbold\\fR and \\fIslanted\\fP \\-1 \\(bu"),
              "a **bold** and *slanted* -1 •");
    EXPECT_EQ(markdown_of("one\n.P\ntwo\n.IP \\(bu 4\nthree\n.br\nfour"),
              "one\n\ntwo\n\n- three\\\nfour");
    EXPECT_EQ(markdown_of(".TP\n.B loadrt\nloads\n.nf\na  b\n.fi\n"),
              "**loadrt**\nloads\n\n```\na  b\n```");
    EXPECT_EQ(markdown_of(".BR pid (9)\n.5 is a half"), "**pid**(9)\n.5 is a half");
    EXPECT_EQ(line_of("two\nlines  here"), "two lines here");
}

TEST(RunProgram, gives_the_program_nothing_to_read) {
    std::string printed;
    EXPECT_EQ(hal::tools::run_program({"readlink", "/proc/self/fd/0"}, printed), 0);
    EXPECT_EQ(printed, "/dev/null\n");
}

}  // namespace
