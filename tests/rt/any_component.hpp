// SPDX-License-Identifier: MIT
// What the tests of every component share: which there are, what they are loaded with, and inputs at
// random.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "model/model.hpp"
#include "paths.hpp"

namespace hal::test {

/// component_arguments.txt, which tests in Python read, too.
struct LoadLines {
    std::map<std::string, std::string> arguments;  // by component
    std::map<std::string, std::string> before;
};

inline LoadLines read_load_lines() {
    LoadLines lines;
    std::map<std::string, std::string> texts;
    std::ifstream file("tests/rt/component_arguments.txt");
    for (std::string line; std::getline(file, line);) {
        std::istringstream words(line);
        std::string first;
        std::string name;
        std::string rest;
        words >> first;
        if (first.empty() || first.starts_with('#')) continue;
        if (first == "before" || first == "text") {
            words >> name;
        }
        std::getline(words >> std::ws, rest);
        if (first == "before") {
            lines.before[name] = rest;
        } else if (first == "text") {
            texts[name] = rest;
        } else {
            lines.arguments[first] = rest;
        }
    }
    for (auto& [component, arguments] : lines.arguments) {
        for (const auto& [name, text] : texts) {
            if (const std::size_t at = arguments.find(name); at != std::string::npos) {
                arguments.replace(at, name.size(), text);
            }
        }
    }
    return lines;
}

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
    static const LoadLines lines = read_load_lines();
    const auto given = lines.arguments.find(name);
    const auto device = lines.before.find(name);
    const bool has_precedent = name == "hm2_eth" || name == "hostmot2";
    return (device == lines.before.end() ? "" : device->second + "\n") + "loadrt " +
           (has_precedent ? "--native " : "") + name +
           (given == lines.arguments.end() ? "" : " " + given->second) + "\n";
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
