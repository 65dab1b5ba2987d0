// SPDX-License-Identifier: MIT
#include "commands/foreign_file.hpp"

#include <gtest/gtest.h>

namespace {

struct Case {
    const char* path;
    const char* text;
    const char* sentence;  ///< nullptr: a netlist
    const char* help;
};

class ForeignFiles : public testing::TestWithParam<Case> {};

TEST_P(ForeignFiles, Are_named_with_the_command_for_them) {
    const Case& c = GetParam();
    const auto foreign = hal::foreign_file(c.path, c.text);
    if (c.sentence == nullptr) {
        EXPECT_FALSE(foreign) << foreign->sentence;
        return;
    }
    ASSERT_TRUE(foreign);
    EXPECT_EQ(foreign->sentence, c.sentence);
    EXPECT_EQ(foreign->help, c.help);
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, ForeignFiles,
    testing::Values(
        Case{"m.hal", "net 123 a.out [2]\n", nullptr, ""},
        Case{"c.log", "  can0  123   [2]  01 02\n",
             "'c.log' is not a netlist but the output of candump without times",
             "record the bus with times, for `hal can dump replay:FILE`: candump -L"},
        Case{"m.hal", "loadrt not\n", nullptr, ""}, Case{"m", "# <xml>\n", nullptr, ""},
        Case{"/dev/stdin", "", nullptr, ""}, Case{"m.hal", "(none)\n", nullptr, ""},
        Case{"a/M.EDS", "[FileInfo]\n",
             "'a/M.EDS' is not a netlist but a CANopen device description",
             "check it with: hal can eds check a/M.EDS"},
        Case{"m.txt", "\xef\xbb\xbf\r\n[FileInfo]\n",
             "'m.txt' is not a netlist but a CANopen device description",
             "check it with: hal can eds check m.txt"},
        Case{"t.xml", "<?xml version='1.0'?>\n<EtherCATInfo>",
             "'t.xml' is not a netlist but an EtherCAT device description (ESI)",
             "write a configuration and a netlist for its devices with: hal ethercat config --esi "
             "t.xml NAME"},
        Case{"e.xml", "<masters><master/></masters>",
             "'e.xml' is not a netlist but a configuration of LinuxCNC's EtherCAT driver lcec",
             "check it with: hal ethercat check e.xml; a netlist loads it with: loadusr -W "
             "lcec_conf "
             "e.xml"},
        Case{"p.xml", "<pyvcp>", "'p.xml' is not a netlist but a panel of LinuxCNC's PyVCP",
             "show it with: hal panel p.xml"},
        Case{"x.xml", "<html>", "'x.xml' is not a netlist but an XML file",
             "name a netlist (.hal) or an INI file"},
        Case{
            "arm.canopen", "",
            "'arm.canopen' is not a netlist but the configuration of a CANopen network",
            "check it with: hal canopen check arm.canopen; a netlist loads it with: loadrt canopen "
            "config=arm.canopen"},
        Case{"tool", "#!/usr/bin/env python3\n", "'tool' is not a netlist but a Python program",
             "a netlist starts it with: loadusr -W python3 tool"},
        Case{"bus.log", "(1436509052.249713) can0 123#11\n",
             "'bus.log' is not a netlist but a log of a CAN bus",
             "print it with: hal can dump replay:bus.log"}));

}  // namespace
