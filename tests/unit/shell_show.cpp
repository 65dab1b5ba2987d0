// SPDX-License-Identifier: MIT
// show, list, status, getp: LinuxCNC's formats to the byte.
#include <algorithm>

#include <nlohmann/json.hpp>

#include "shell_machine.hpp"

namespace hal::test {
namespace {

constexpr const char* gates =
    "loadrt and2 names=a,b\n"
    "loadrt threads name1=fast period1=100000 name2=slow period2=1000000\n"
    "net s a.out => b.in0 b.in1\n"
    "newsig lonely float\n"
    "sets lonely 2.5\n"
    "newsig count u32\n"
    "sets count 300\n"
    "newsig big u64\n"
    "sets big 0xffffffffffffffff\n"
    "newsig low s64\n"
    "sets low -9223372036854775808\n"
    "alias pin a.in0 start\n"
    "addf a slow\n"
    "addf b fast\n";

struct Show : testing::Test {
    Show() { machine.must(gates); }
    ShellMachine machine;
};

TEST_F(Show, pins_are_listed_with_owner_type_direction_value_and_signal) {
    EXPECT_EQ(machine.says("show pin a.in1 a.out b.i*"),
              "Component Pins:\n"
              "Owner   Type  Dir                 Value  Name\n" +
                  [&] {
        const std::string id = std::to_string(machine.session.model().find_component("and2")->id);
        const std::string owner = std::string(6 - id.size(), ' ') + id;
        return owner + "  bit   IN                  FALSE  a.in1\n" + owner +
               "  bit   OUT                 FALSE  a.out ==> s\n" + owner +
               "  bit   IN                  FALSE  b.in0 <== s\n" + owner +
               "  bit   IN                  FALSE  b.in1 <== s\n\n";
    }());
}

TEST_F(Show, pins_for_scripts_have_the_owners_name_and_no_title) {
    machine.shell.options.script = true;
    EXPECT_EQ(machine.says("show pin a.out b.in0 start"),
              "and2 bit   OUT FALSE a.out ==> s\nand2 bit   IN FALSE b.in0 <== s\nand2 bit   IN "
              "FALSE start\n\n");
}

TEST_F(Show, signals_have_a_line_per_pin_for_people_and_one_line_for_scripts) {
    EXPECT_EQ(machine.says("show sig"),
              "Signals:\n"
              "Type                  Value  Name     (linked to)\n"
              "u64      0xFFFFFFFFFFFFFFFF  big\n"
              "u32              0x0000012C  count\n"
              "float                   2.5  lonely\n"
              "s64    -9223372036854775808  low\n"
              "bit                   FALSE  s\n"
              "                                 <== a.out\n"
              "                                 ==> b.in0\n"
              "                                 ==> b.in1\n"
              "\n");
    machine.shell.options.script = true;
    EXPECT_EQ(machine.says("show sig s count"),
              "u32    300  count\nbit    FALSE  s <== a.out ==> b.in0 ==> b.in1\n\n");
}

TEST_F(Show, a_type_selects) {
    machine.shell.options.script = true;
    EXPECT_EQ(machine.says("show sig -t float"), "float  2.5  lonely\n\n");
    EXPECT_EQ(machine.says("show sig -tu32"), "u32    300  count\n\n");
    EXPECT_EQ(machine.line("show sig -t flot"), 1);
    EXPECT_NE(machine.err.find("[no-such-type]"), std::string::npos) << machine.err;
}

TEST_F(Show, parameters_are_apart_from_pins) {
    machine.shell.options.script = true;
    EXPECT_EQ(machine.says("show param a"),
              "and2 s32   RW 0 a.tmax\nand2 bit   RO FALSE a.tmax-increased\n\n");
    EXPECT_EQ(machine.says("list pin a"), "a.in1 a.out a.time \n");
    EXPECT_EQ(machine.says("list param a."), "a.tmax a.tmax-increased \n");
}

TEST_F(Show, threads_are_listed_slowest_first_with_their_functions) {
    EXPECT_EQ(machine.says("show thread"),
              "Realtime Threads:\n"
              "     Period  FP     Name               (     Time, Max-Time )\n"
              "    1000000  YES                  slow (        0,        0 )\n"
              "                  1 a\n"
              "     100000  YES                  fast (        0,        0 )\n"
              "                  1 b\n"
              "\n");
    machine.shell.options.script = true;
    EXPECT_EQ(machine.says("show thread"),
              "1000000 YES slow        0 0 a\n100000 YES fast        0 0 b\n\n");
    EXPECT_EQ(machine.says("list thread"), "slow fast \n");
}

TEST_F(Show, functions_have_addresses_users_and_names) {
    machine.shell.options.script = true;
    EXPECT_EQ(machine.says("list funct"), "a b \n");
    const std::string table = machine.says("show funct a");
    EXPECT_TRUE(table.starts_with("and2 ")) << table;
    EXPECT_TRUE(table.ends_with(" YES   1 a\n\n")) << table;
}

TEST_F(Show, components_are_listed_newest_first) {
    EXPECT_EQ(machine.says("list comp"), "threads and2 \n");
    const std::string table = machine.says("show comp and2");
    const std::string id = std::to_string(machine.session.model().find_component("and2")->id);
    EXPECT_EQ(table,
              "Loaded HAL Components:\n"
              "ID      Type  Name                                            PID   State\n" +
                  std::string(6 - id.size(), ' ') + id +
                  "  RT    and2                                                  ready\n\n");
}

TEST_F(Show, aliases_have_both_names) {
    EXPECT_EQ(
        machine.says("show alias"),
        "Pin Aliases:\n Alias                                            Original Name\n start     "
        "                                       a.in0\n\n"
        "Parameter Aliases:\n Alias                                            Original Name\n\n");
    machine.shell.options.script = true;
    EXPECT_EQ(machine.says("show alias"), " start  a.in0\n\n\n");
}

TEST_F(Show, everything_comes_in_linuxcncs_order) {
    const std::string all = machine.says("show");
    std::size_t last = 0;
    for (const char* title :
         {"Loaded HAL Components:", "Component Pins:", "Pin Aliases:", "Signals:", "Parameters:",
          "Parameter Aliases:", "Exported Functions:", "Realtime Threads:"}) {
        const auto at = all.find(title, last);
        ASSERT_NE(at, std::string::npos) << title;
        last = at;
    }
    EXPECT_EQ(all, machine.says("show all"));
}

TEST_F(Show, an_unknown_kind_is_refused_with_the_kinds) {
    EXPECT_EQ(machine.line("show pins"), 1);
    EXPECT_NE(machine.err.find("did you mean 'pin'"), std::string::npos) << machine.err;
    EXPECT_EQ(machine.line("list alias"), 1);
}

TEST_F(Show, values_and_types_come_alone) {
    EXPECT_EQ(machine.says("getp a.in1"), "FALSE\n");
    EXPECT_EQ(machine.says("gets lonely"), "2.5\n");
    EXPECT_EQ(machine.says("gets count"), "300\n");
    EXPECT_EQ(machine.says("ptype a.tmax"), "s32\n");
    EXPECT_EQ(machine.says("stype low"), "s64\n");
    EXPECT_EQ(machine.says("getp start"), "FALSE\n");
}

TEST_F(Show, a_range_of_names_prints_a_value_per_name) {
    machine.must("setp a.in1 1\n");
    EXPECT_EQ(machine.says("getp {a,b}.in1"), "TRUE\nFALSE\n");
}

TEST_F(Show, a_misspelt_name_is_answered_with_the_right_one) {
    EXPECT_EQ(machine.line("getp a.ot"), 1);
    EXPECT_NE(machine.err.find("did you mean 'a.out'"), std::string::npos) << machine.err;
    EXPECT_EQ(machine.line("getp lonely"), 1);
    EXPECT_NE(machine.err.find("gets lonely"), std::string::npos) << machine.err;
    EXPECT_EQ(machine.line("gets a.out"), 1);
    EXPECT_NE(machine.err.find("getp a.out"), std::string::npos) << machine.err;
}

TEST_F(Show, the_lock_status_is_linuxcncs) {
    machine.line("lock");
    EXPECT_EQ(machine.says("status lock"),
              "HAL locking status:\n"
              "  current lock value 255 (ff)\n"
              "  HAL_LOCK_LOAD    - loading of new components is locked\n"
              "  HAL_LOCK_CONFIG  - link and addf is locked\n"
              "  HAL_LOCK_PARAMS  - setting params is locked\n"
              "  HAL_LOCK_RUN     - running/stopping HAL is locked\n");
    machine.line("unlock tune");
    EXPECT_EQ(machine.session.locked, 252U);
    machine.line("unlock");
    EXPECT_EQ(
        machine.says("status lock"),
        "HAL locking status:\n  current lock value 0 (00)\n  HAL_LOCK_NONE - nothing is locked\n");
    EXPECT_NE(machine.says("status").find("active signals:     5\n"), std::string::npos)
        << machine.out;
}

TEST_F(Show, json_holds_the_same) {
    machine.shell.options.json = true;
    const auto pins = nlohmann::json::parse(machine.says("show pin b.in0"));
    ASSERT_EQ(pins.size(), 1U);
    EXPECT_EQ(pins[0]["name"], "b.in0");
    EXPECT_EQ(pins[0]["type"], "bit");
    EXPECT_EQ(pins[0]["dir"], "IN");
    EXPECT_EQ(pins[0]["value"], false);
    EXPECT_EQ(pins[0]["signal"], "s");
    EXPECT_EQ(pins[0]["component"], "and2");
    EXPECT_EQ(pins[0]["thread"], "fast");
    const auto all = nlohmann::json::parse(machine.says("show"));
    EXPECT_EQ(all["signals"].size(), 5U);
    EXPECT_EQ(all["threads"][0]["functions"][0], "a");
    EXPECT_EQ(nlohmann::json::parse(machine.says("gets big"))["value"], 18446744073709551615ULL);
    EXPECT_EQ(nlohmann::json::parse(machine.says("list sig"))[0], "big");
    EXPECT_EQ(nlohmann::json::parse(machine.says("status"))["signals"], 5);
    EXPECT_TRUE(nlohmann::json::parse(machine.says("show fault")).empty());
}

TEST_F(Show, timing_and_latency_are_readable) {
    machine.must("start\nadvance 20 cycles\n");
    const std::string timing = machine.says("show timing");
    EXPECT_NE(timing.find("\nslow "), std::string::npos) << timing;
    EXPECT_NE(timing.find("virtual clock"), std::string::npos) << timing;
    EXPECT_EQ(timing.find(" 0 ns"), std::string::npos) << "nothing was measured:\n" << timing;
    EXPECT_NE(timing.find("         -         -         -  virtual"), std::string::npos) << timing;
    EXPECT_EQ(machine.says("show fault"), "no faults\n");
    EXPECT_NE(machine.says("show latency s").find("a.out => b.in0"), std::string::npos)
        << machine.out;
    // by the signal, its pins and patterns
    const std::string both = machine.says("show latency s");
    const std::string first = both.substr(0, both.find('\n') + 1);
    EXPECT_NE(first.find("=> b.in0"), std::string::npos);
    EXPECT_EQ(machine.says("show latency b.in0"), first);
    for (const char* const names : {"a.out", "b.in", "a.o*", "b.in0 b.in1", "s a.out"}) {
        EXPECT_EQ(machine.says(std::string("show latency ") + names), both) << names;
    }
    machine.shell.options.json = true;
    const auto lines = nlohmann::json::parse(machine.says("show latency b.in0"));
    ASSERT_EQ(lines.size(), 1U);
    EXPECT_EQ(lines[0].get<std::string>() + "\n", first);
}

TEST(ShowNothing, is_stated) {
    ShellMachine machine;
    EXPECT_EQ(machine.says("show latency"), "no signal links a writer to a reader\n");
}

TEST(ShowLarge, a_hundred_thousand_pins_are_printed_by_one_read) {
    ShellMachine machine;
    machine.must("loadrt and2 count=25000\n");
    machine.shell.options.script = true;
    const std::string table = machine.says("show pin");
    EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 100'001);
    const std::string names = machine.says("list pin");
    EXPECT_EQ(std::count(names.begin(), names.end(), ' '), 100'000);
}

}  // namespace
}  // namespace hal::test
