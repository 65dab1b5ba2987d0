// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "model/model.hpp"
#include "model/namesakes.hpp"

namespace hal::test {
namespace {

/// An instance x of a component: Halcyon's, or LinuxCNC's.
struct Loaded {
    explicit Loaded(const char* name, bool is_linuxcncs) {
        component.name = name;
        component.shares_pins = is_linuxcncs;
        x.component = &component;
        model.instance.emplace("x", &x);
    }
    LoadedComponent component;
    Instance x;
    Model model;
};

TEST(Namesakes, name_the_other_component_for_a_pin_that_only_it_has) {
    const Loaded own("cia402", false);
    EXPECT_EQ(namesake_help(own.model, "x.csp-mode"),
              "'csp-mode' is a pin of the community's cia402.comp for LinuxCNC; this is Halcyon's "
              "cia402. Type: loadrt --linuxcnc cia402, where that one is installed");
    EXPECT_EQ(namesake_help(own.model, "x.position-cmdd"), "");
}

TEST(Namesakes, name_halcyons_component_for_an_unknown_pin_of_the_other) {
    const Loaded other("cia402", true);
    EXPECT_EQ(
        namesake_help(other.model, "x.position-cmd"),
        "this is the community's cia402.comp for LinuxCNC; for Halcyon's cia402, type: loadrt "
        "--native cia402");
}

TEST(Namesakes, have_no_help_for_other_components_and_instances) {
    const Loaded other("pid", true);
    EXPECT_EQ(namesake_help(other.model, "x.csp-mode"), "");
    EXPECT_EQ(namesake_help(other.model, "y.csp-mode"), "");
    EXPECT_EQ(namesake_help(other.model, "x"), "");
}

}  // namespace
}  // namespace hal::test
