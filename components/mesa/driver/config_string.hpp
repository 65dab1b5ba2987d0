// SPDX-License-Identifier: MIT
// The `config` string of LinuxCNC's hostmot2: which modules of a card are used.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "mesa/hostmot2/module.hpp"

namespace hal::mesa {

/// Counts of instances; all of them where the string has no item.
class ConfigString {
public:
    static constexpr int all = -1;
    static constexpr std::size_t max_ports = 4;
    static constexpr std::size_t max_channels = 8;

    /// What is wrong in a config string: bytes `begin` to `end` of it.
    struct Problem {
        std::size_t begin = 0;
        std::size_t end = 0;
        std::string text;
        std::string help;
    };

    /// Parses a string such as "num_encoders=1 num_stepgens=3 sserial_port_0=00xxxxxx". Returns the
    /// first problem; its text is empty without a problem. [setup]
    Problem parse(std::string_view text);

    /// Returns how many instances of a module are asked for; `all`: as many as there are. [setup]
    int count(Tag tag) const noexcept;
    /// Returns the mode of a smart-serial channel, or -1 for one that is not used. [setup]
    int serial_mode(std::size_t port, std::size_t channel) const noexcept;
    bool enable_raw() const noexcept { return enable_raw_; }
    /// Pins of each step generator that it uses.
    unsigned stepgen_width() const noexcept { return stepgen_width_; }

    /// Returns the name of the item of a module, "num_stepgens"; "" if it has none. [any]
    static std::string_view item_of(Tag tag) noexcept;

private:
    Problem parse_item(std::string_view item, std::size_t begin);
    Problem parse_ports(std::string_view key, std::string_view value, const Problem& where);

    struct Count {
        Tag tag;
        int instances;
    };
    std::vector<Count> counts_;
    std::array<std::array<int, max_channels>, max_ports> modes_{};
    unsigned stepgen_width_ = 2;
    bool enable_raw_ = false;
};

}  // namespace hal::mesa
