// SPDX-License-Identifier: MIT
// A reload of an unchanged component is invisible: two machines with the same inputs at random, one
// of which reloads, have the same values in every cycle.
#include <filesystem>
#include <set>
#include <string>

#include "rt/any_component.hpp"
#include "unit/machine.hpp"

namespace hal::test {
namespace {

// Components whose state is not in their own memory, with the place where it is.
const std::map<std::string, const char*> exceptions{
    {"can_bridge", "two segments"},
    {"can_faults", "the frames of a segment"},
    {"can_receive", "the frames of a segment"},
    {"can_send", "the frames of a segment"},
    {"can_traffic", "the frames of a segment"},
    {"canopen", "a network, which is started again"},
    {"canopen_axis_io", "a network, which is started again"},
    {"canopen_bootloader", "a network, which is started again"},
    {"canopen_drive", "a network, which is started again"},
    {"canopen_io", "a network, which is started again"},
    {"canopen_jr3", "a network, which is started again"},
    {"canopen_safe_io", "a network, which is started again"},
    {"canopen_sync", "a network, which is started again"},
    {"ethercat", "a network, which is started again"},
    {"ethercat_segment", "a network, which is started again"},
    {"hm2_eth", "a card, which is configured again"},
    {"lcec", "a network, which is started again"},
    {"mesa", "a card, which is configured again"},
    {"mesa_card", "a network, which is started again"},
    {"frame_guardian", "a network, which is started again"},
    {"modbus", "a network, which is started again"},
    {"modbus_node", "a network, which is started again"},
    {"cia402", "the drive, which a reload stops"},
    {"dds_publish", "a network, which is started again"},
    {"dds_subscribe", "a network, which is started again"},
    {"lqr", "a thread of its own, which designs the gains again"},
    {"sampler", "a stream, which is published again"},
    {"scocan", "a network, which is started again"},
    {"scocan_bridge", "a network, which is started again"},
    {"scocan_monitor", "a network, which is started again"},
    {"scocan_sync", "a network, which is started again"},
    {"vision_blob", "a camera, which is opened again"},
    {"vision_line", "a camera, which is opened again"},
    {"vision_marker", "a camera, which is opened again"},
    {"vision_pendulum", "a camera, which is opened again"},
    {"lcd", "the display, which is cleared and written again"},
};

struct Reload : testing::TestWithParam<std::string> {
    using Values = std::vector<std::vector<std::uint64_t>>;
    static constexpr int before = 150;
    static constexpr int after = 150;

    /// Adds the functions of the component: all to one thread, or to two threads in turn.
    static std::string functions(const Model& model, bool spread) {
        std::string text;
        int number = 0;
        for (const LoadedFunction* function : model.sorted_functions()) {
            text +=
                "addf " + function->name + (spread && number++ % 2 == 1 ? " slow\n" : " fast\n");
        }
        return text;
    }
    static std::vector<std::uint64_t> values(const Model& model) {
        std::vector<std::uint64_t> all;
        for (const Pin* const pin : model.sorted_pins()) {
            if (pin->instance && pin->type != HAL_TYPE_PORT) {
                all.push_back(pin->memory->slot->raw);
            }
        }
        return all;
    }
    static std::string name_of(std::size_t index, const Model& model) {
        for (const Pin* const pin : model.sorted_pins()) {
            if (pin->instance && pin->type != HAL_TYPE_PORT && index-- == 0) return pin->name;
        }
        return "?";
    }

    /// Runs a machine and returns the values after each cycle; empty when the component cannot be
    /// spread.
    Values run(std::uint32_t seed, bool spread, bool reload, std::vector<std::string>& names) {
        Values all;
        Machine machine;
        const auto lock = machine.session.lock();
        machine.must("newthread fast 1000000\nnewthread slow 3000000\n" + load(GetParam()));
        if (!machine.edit(functions(machine.session.model(), spread))) return all;
        RandomInputs inputs(machine.session.model(), seed);
        machine.start();
        for (int cycle = 0; cycle < before + after; ++cycle) {
            if (reload && cycle >= before && (cycle - before) % 40 == 0) {
                machine.must("reload " + GetParam());
            }
            inputs.change();
            machine.cycles(1);
            all.push_back(values(machine.session.model()));
        }
        for (std::size_t i = 0; i < all.back().size(); ++i) {
            names.push_back(name_of(i, machine.session.model()));
        }
        return all;
    }

    void compare(bool spread) {
        if (exceptions.contains(GetParam())) GTEST_SKIP() << exceptions.at(GetParam());
        for (const std::uint32_t seed : {1U, 2U, 3U}) {
            std::vector<std::string> names;
            const Values expected = run(seed, spread, false, names);
            const Values found = run(seed, spread, true, names);
            ASSERT_EQ(found.size(), expected.size());
            std::set<std::string> different;
            for (std::size_t cycle = 0; cycle < found.size(); ++cycle) {
                ASSERT_EQ(found[cycle].size(), expected[cycle].size());
                for (std::size_t i = 0; i < found[cycle].size(); ++i) {
                    if (found[cycle][i] == expected[cycle][i]) continue;
                    if (!different.insert(names[i]).second) continue;
                    ADD_FAILURE() << names[i] << " differs in cycle " << cycle << ", seed " << seed;
                }
            }
        }
    }
};

TEST_P(Reload, with_unchanged_source_is_invisible) { compare(false); }
TEST_P(Reload, with_unchanged_source_is_invisible_in_two_threads) { compare(true); }

INSTANTIATE_TEST_SUITE_P(Of, Reload, testing::ValuesIn(all_components()),
                         [](const auto& component) { return component.param; });

/// Returns the names of the source files of all components, also of those that this build leaves
/// out.
std::set<std::string> sources_of_components() {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::recursive_directory_iterator("components")) {
        if (entry.path().extension() == ".cpp") {
            names.insert(entry.path().stem().string());
        }
    }
    return names;
}

TEST(Reload_exceptions, are_components) {
    const std::set<std::string> sources = sources_of_components();
    for (const auto& [name, reason] : exceptions) {
        EXPECT_TRUE(sources.contains(name)) << name << ": " << reason;
    }
}

}  // namespace
}  // namespace hal::test
