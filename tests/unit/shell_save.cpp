// SPDX-License-Identifier: MIT
// save: LinuxCNC's text, and a machine restored from it.
#include "shell_machine.hpp"

namespace hal::test {
namespace {

constexpr const char* machine_text =
    "loadrt threads name1=fast period1=100000\n"
    "newthread slow 1000000 budget=500us supervise=off\n"
    "loadrt stepgen step_type=0\n"
    "loadrt and2 names=a,b\n"
    "loadrt and2 count=2\n"
    "loadrt not names=inverter\n"
    "newsig unlinked bit\n"
    "newsig level float\n"
    "sets level 0.1\n"
    "net s a.out => b.in0 inverter.in\n"
    "net dir stepgen.0.dir\n"
    "alias pin a.in0 start\n"
    "alias param stepgen.0.maxvel topspeed\n"
    "setp stepgen.0.dirhold 300\n"
    "setp stepgen.0.maxvel 0.15000000000000002\n"
    "setp a.in1 1\n"
    "addf stepgen.make-pulses fast\n"
    "addf b slow\n"
    "addf a slow 1\n";

struct Save : testing::Test {
    Save() { machine.must(machine_text); }
    ShellMachine machine;
};

TEST_F(Save, each_section_is_as_linuxcnc_writes_it) {
    EXPECT_EQ(machine.says("save comp"),
              "# components\n"
              "loadrt threads name1=fast period1=100000\n"
              "loadrt stepgen step_type=0\n"
              "loadrt and2 names=a,b\n"
              "loadrt and2 count=2\n"
              "loadrt not names=inverter\n"
              "newthread slow 1000000 budget=500000ns supervise=off\n");
    EXPECT_EQ(machine.says("save alias"),
              "# pin aliases\nalias pin a.in0 start\n# param aliases\nalias param stepgen.0.maxvel "
              "topspeed\n");
    EXPECT_EQ(
        machine.says("save sig"),
        "# signals\nnewsig dir bit  \nnewsig level float\nnewsig s bit  \nnewsig unlinked bit  \n");
    EXPECT_EQ(machine.says("save sigu"), "# signals\nnewsig level float\nnewsig unlinked bit  \n");
    EXPECT_EQ(machine.says("save link"),
              "# links\nlinkps a.out  s\nlinkps b.in0  s\nlinkps inverter.in  s\nlinkps "
              "stepgen.0.dir  dir\n");
    EXPECT_EQ(machine.says("save linka"),
              "# links\nlinkps a.out ==> s\nlinkps b.in0 <== s\nlinkps inverter.in <== s\nlinkps "
              "stepgen.0.dir ==> dir\n");
    EXPECT_EQ(
        machine.says("save net"),
        "# nets\nnewsig dir bit  \nlinksp dir  stepgen.0.dir\nnewsig level float\nnewsig s bit  "
        "\nlinksp s  a.out\nlinksp s  b.in0\nlinksp s  inverter.in\nnewsig unlinked bit  \n");
    EXPECT_EQ(machine.says("save neta"),
              "# nets\nnewsig dir bit  \nlinksp dir <== stepgen.0.dir\nnewsig level float\nnewsig "
              "s bit  \nlinksp s <== a.out\nlinksp s ==> b.in0\nlinksp s ==> inverter.in\nnewsig "
              "unlinked bit  \n");
    EXPECT_EQ(machine.says("save netl"),
              "# nets\nnet dir stepgen.0.dir\nnet s a.out b.in0 inverter.in\n");
    EXPECT_EQ(machine.says("save netla"),
              "# nets\nnet dir stepgen.0.dir\nnet s a.out => b.in0 inverter.in\n");
    EXPECT_EQ(machine.says("save netal"), machine.says("save netla"));
    EXPECT_EQ(machine.says("save thread"),
              "# realtime thread/function links\naddf a slow\naddf b slow\naddf "
              "stepgen.make-pulses fast\n");
    const std::string parameters = machine.says("save param");
    EXPECT_NE(parameters.find("setp stepgen.0.dirhold           0x0000012C\n"), std::string::npos)
        << parameters;
    EXPECT_NE(parameters.find("setp topspeed  0.15000000000000002\n"), std::string::npos)
        << parameters;
    EXPECT_EQ(parameters.find("tmax-increased"), std::string::npos) << parameters;
    EXPECT_EQ(
        machine.says("save signalvalues"),
        "# signal values\nsets level                  0.1\nsets unlinked                FALSE\n");
}

TEST_F(Save, all_is_made_of_its_sections_in_order) {
    std::string parts;
    for (const char* part : {"comp", "alias", "sigu", "netla", "param", "thread"}) {
        parts += machine.says(std::string("save ") + part);
    }
    EXPECT_EQ(machine.says("save"), parts);
    EXPECT_EQ(machine.says("save all"), parts);
}

TEST_F(Save, what_was_saved_makes_the_same_machine) {
    const Folder folder;
    machine.shell.options.directory = folder.path;
    ASSERT_EQ(machine.line("save allu saved.hal"), 0) << machine.err;
    const std::string first = folder.read("saved.hal");
    ShellMachine again;
    ASSERT_EQ(again.path(folder.path + "/saved.hal"), 0) << again.err;
    EXPECT_EQ(again.says("save allu"), first);
    EXPECT_EQ(again.says("getp topspeed"), "0.15\n");
    EXPECT_EQ(again.says("getp a.in1"), "TRUE\n");
    EXPECT_EQ(again.says("gets level"), "0.1\n");
    EXPECT_EQ(again.says("list pin"), machine.says("list pin"));
}

TEST_F(Save, io_pins_and_init_functions_come_back) {
    ShellMachine io;
    io.must(
        "loadrt encoder num_chan=2\nloadrt and2 names=g\nloadrt threads name1=t "
        "period1=1000000\nnet index encoder.0.index-enable <=> encoder.1.index-enable\n"
        "initf g t\naddf encoder.update-counters t\naddf encoder.capture-position t\n");
    const std::string saved = io.says("save all");
    EXPECT_NE(saved.find("net index encoder.0.index-enable <=> encoder.1.index-enable\n"),
              std::string::npos)
        << saved;
    EXPECT_NE(saved.find("initf g t\n"), std::string::npos) << saved;
    ShellMachine again;
    again.must(saved);
    EXPECT_EQ(again.says("save all"), saved);
}

TEST_F(Save, a_deleted_thread_stays_deleted) {
    machine.must("delthread fast\n");
    const std::string saved = machine.says("save comp");
    EXPECT_NE(saved.find("delthread fast\n"), std::string::npos) << saved;
    ShellMachine again;
    again.must(saved);
    EXPECT_EQ(again.says("list thread"), "slow \n");
}

TEST_F(Save, a_file_that_cannot_be_written_is_an_error) {
    EXPECT_EQ(machine.line("save all /no-such-folder/x.hal"), 1);
    EXPECT_NE(machine.err.find("[cannot-write]"), std::string::npos) << machine.err;
    EXPECT_EQ(machine.line("save evrything"), 1);
    EXPECT_NE(machine.err.find("[unknown-word]"), std::string::npos) << machine.err;
}

}  // namespace
}  // namespace hal::test
