// SPDX-License-Identifier: MIT
// What `hal doc` prints comes from the components themselves; this is about its being there.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "paths.hpp"
#include "unit/components/component_host.hpp"

namespace {

using hal::test::Instance;

/// Every plugin of the build tree.
std::vector<std::string> plugins() {
    std::vector<std::string> names;
    std::error_code none;
    for (const auto& file :
         std::filesystem::directory_iterator(hal::paths::build_components, none)) {
        if (file.path().extension() == ".so") {
            names.push_back(file.path().stem());
        }
    }
    std::sort(names.begin(), names.end());
    return names;
}

struct Manual : testing::TestWithParam<std::string> {
    // Nothing is started: `hal doc` works on a machine that has none of the hardware.
    const Instance instance{GetParam(), {}, {}, Instance::Life::created};
};

TEST_P(Manual, Is_complete) {
    EXPECT_EQ(instance.component().name, GetParam()) << "the file and the component share a name";
    EXPECT_FALSE(std::string(instance.component().summary).empty());
    EXPECT_GE(std::string(instance.component().doc).size(), 40u) << "a component without a manual";
    // LinuxCNC's driver of the firmware, whose functions are those of the drivers of the cards
    if (GetParam() != "hostmot2") {
        EXPECT_FALSE(instance.functions().empty()) << "nothing to add to a thread";
    }
    for (const auto& pin : instance.pins()) {
        EXPECT_FALSE(pin.doc.empty()) << pin.name;
        EXPECT_EQ(pin.name.find(' '), std::string::npos) << pin.name;
    }
    for (const auto& function : instance.functions()) {
        EXPECT_TRUE(!function.doc.empty() || (function.flags & HAL_FUNCTION_EMERGENCY))
            << function.name;
    }
}

// In the manuals an example loads one named instance, `loadrt pid names=pid.x`, and then uses its
// members.
TEST_P(Manual, Its_example_uses_members_that_exist) {
    const std::string doc = instance.component().doc;
    const std::string load = "loadrt " + GetParam() + " names=";
    const auto at = doc.find(load);
    // an example of another kind, which the netlist tests cover
    if (at == std::string::npos) return;
    const std::size_t begin = at + load.size();
    const std::string name = doc.substr(begin, doc.find_first_of(" ,\n", begin) - begin);
    int members = 0;
    for (std::size_t found = doc.find(" " + name + "."); found != std::string::npos;
         found = doc.find(" " + name + ".", found + 1)) {
        const std::size_t start = found + name.size() + 2;
        const std::string member = doc.substr(start, doc.find_first_of(" \n", start) - start);
        const bool function = std::any_of(instance.functions().begin(), instance.functions().end(),
                                          [&](const auto& f) { return f.name == member; });
        EXPECT_TRUE(instance.has_pin(member) || function) << name << "." << member;
        ++members;
    }
    EXPECT_GT(members, 0);
}

INSTANTIATE_TEST_SUITE_P(Every_component, Manual, testing::ValuesIn(plugins()),
                         [](const auto& plugin) { return plugin.param; });

}  // namespace
