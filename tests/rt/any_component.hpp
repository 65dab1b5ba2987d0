// SPDX-License-Identifier: MIT
// What the tests of every component share: which there are, what they are loaded with, and inputs at
// random.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "model/model.hpp"
#include "paths.hpp"

namespace hal::test {

#define SCOCAN_TABLE                                                                           \
    " table=\"cycle 10ms; slots 10; node clock A sync; node n A; node bridge A bridge; node "  \
    "watch B monitor; mode 0 run; 0 sync; "                                                    \
    "1 private n 0x100; 2 private clock 0x101; message a 0x100 fields x:f64; message b 0x101 " \
    "fields y:s16,z:u8; "                                                                      \
    "message c 0x300 node n event 10ms fields w:f32\""
// Load arguments of components that cannot be made without.
inline const std::map<std::string, std::string> component_arguments{
    {"canopen", "inputs=24831 outputs=24675 slavenodeid=2"},
    {"dds_publish", "topic=rt/pins fields=f:float,b:bit,i:s32,u:u32,l:s64,k:u64 rate=0 domain=230"},
    {"dds_subscribe", "topic=rt/pins fields=f:float,b:bit,i:s32,u:u32,l:s64,k:u64 domain=230"},
    {"ethercat", "config=tests/rt/drive.ethercat"},
    {"lcec", "config=tests/rt/ethercat-conf.xml link=sim:rt/lcec"},
    {"hm2_eth", "board_ip=sim:rt-hm2-eth"},
    {"mesa", "board=sim:rt-mesa config=\"enable_raw\""},
    {"mesa_card", "config=tests/rt/card.mesa"},
    {"modbus", "config=tests/rt/bus.modbus"},
    {"modbus_node", "config=tests/rt/bus.modbus link=sim:rt-modbus-node"},
    {"scocan", "link=sim:rt-scocan node=n" SCOCAN_TABLE},
    {"scocan_bridge", "link=sim:rt-scocan node=bridge pc=sim:rt-pc" SCOCAN_TABLE},
    {"scocan_monitor", "link=sim:rt-scocan node=watch" SCOCAN_TABLE},
    {"scocan_sync", "link=sim:rt-scocan node=clock" SCOCAN_TABLE},
    {"segment_record", "link=sim:rt/recorder file=/dev/null"},
    {"tdma", "link=sim:rt/master station=master schedule=\"master:; cycle 2000; slot 0 100\""},
};

// What has to be loaded before: drivers ask their device what it has.
inline const std::map<std::string, std::string> component_devices{
    {"hm2_eth", "loadrt mesa_card names=rt-hm2-eth config=tests/rt/card.mesa link=sim:rt-hm2-eth"},
    {"mesa", "loadrt mesa_card names=rt-mesa config=tests/rt/card.mesa link=sim:rt-mesa"},
};

inline std::vector<std::string> all_components() {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(paths::build_components)) {
        if (entry.path().extension() == ".so") {
            names.push_back(entry.path().stem().string());
        }
    }
    std::sort(names.begin(), names.end());
    return names;
}

/// Returns the line that loads a component: ours, also where LinuxCNC's of the same name precedes it.
inline std::string load(const std::string& name) {
    const auto given = component_arguments.find(name);
    const auto device = component_devices.find(name);
    const bool has_precedent = name == "hm2_eth" || name == "hostmot2";
    return (device == component_devices.end() ? "" : device->second + "\n") + "loadrt " +
           (has_precedent ? "--native " : "") + name +
           (given == component_arguments.end() ? "" : " " + given->second) + "\n";
}

// Ordinary values mostly, and now and then one from the edge of the type.
class RandomInputs {
public:
    explicit RandomInputs(const Model& model, std::uint32_t seed) : random_(seed) {
        for (const Pin* pin : model.sorted_pins()) {
            if (pin->instance && pin->type != HAL_TYPE_PORT && pin->dir != HAL_DIR_OUT) {
                pins_.push_back(pin);
            }
        }
    }
    void change() {
        for (const Pin* pin : pins_) {
            if (random_() % 4 == 0) {
                pin->memory->slot->raw = value(pin->type).raw;
            }
        }
    }

private:
    hal_value value(hal_type type) {
        hal_value value{.raw = 0};
        const bool edge = random_() % 32 == 0;
        const auto wide = (std::uint64_t{random_()} << 32) | random_();
        switch (type) {
        case HAL_TYPE_BIT: value.bit = random_() & 1; break;
        case HAL_TYPE_FLOAT: {
            constexpr double edges[] = {0.0,
                                        -0.0,
                                        1e300,
                                        -1e300,
                                        1e-310,
                                        std::numeric_limits<double>::infinity(),
                                        -std::numeric_limits<double>::infinity(),
                                        std::numeric_limits<double>::quiet_NaN()};
            value.real = edge ? edges[random_() % std::size(edges)]
                              : std::uniform_real_distribution(-10.0, 10.0)(random_);
            break;
        }
        case HAL_TYPE_S32:
            value.s32 = edge ? static_cast<std::int32_t>(random_())
                             : static_cast<std::int32_t>(random_() % 21) - 10;
            break;
        case HAL_TYPE_U32:
            value.u32 = edge ? static_cast<std::uint32_t>(random_())
                             : static_cast<std::uint32_t>(random_() % 20);
            break;
        case HAL_TYPE_S64:
            value.s64 = edge ? static_cast<std::int64_t>(wide)
                             : static_cast<std::int64_t>(random_() % 21) - 10;
            break;
        case HAL_TYPE_U64: value.u64 = edge ? wide : random_() % 20; break;
        case HAL_TYPE_PORT: break;
        }
        return value;
    }
    std::mt19937 random_;
    std::vector<const Pin*> pins_;
};

}  // namespace hal::test
