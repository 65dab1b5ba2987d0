// SPDX-License-Identifier: MIT
#pragma once

#include <deque>

#include "ethercat/plugins/channels/object_request.hpp"

namespace hal::ethercat {

/// The modes that a drive of CiA 402 supports (its `object`, 6502h), as NAME-supported-modes and a
/// bit for each.
class DriveModes final : public Channel {
public:
    explicit DriveModes(const ChannelPlan& plan)
        : object_(plan),
          modes_(plan.component, plan.reads, plan.pin("supported-modes").c_str(),
                 "supported modes, 6502h") {
        for (const Mode& mode : known_modes) {
            const std::string name = std::string("supports-mode-") + mode.name;
            bits_.emplace_back(plan.component, plan.reads, plan.pin(name).c_str(),
                               "the drive supports this mode");
        }
    }

    void read(const SlaveImage& image) noexcept override {
        const bool was_known = object_.known();
        object_.step(image);
        if (was_known || !object_.known()) return;
        const auto modes = static_cast<std::uint32_t>(object_.value());
        modes_ = modes;
        for (std::size_t i = 0; i < bits_.size(); ++i) {
            bits_[i] = (modes >> known_modes[i].bit & 1U) != 0;
        }
    }
    void restart() noexcept override { object_.restart(); }

private:
    struct Mode {
        const char* name;
        unsigned bit;
    };
    static constexpr Mode known_modes[] = {{"pp", 0}, {"vl", 1},  {"pv", 2},  {"tq", 3}, {"hm", 5},
                                           {"ip", 6}, {"csp", 7}, {"csv", 8}, {"cst", 9}};

    ObjectRequest object_;
    Out<std::uint32_t> modes_;
    std::deque<Out<bool>> bits_;
};

}  // namespace hal::ethercat
