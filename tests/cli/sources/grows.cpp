// SPDX-License-Identifier: MIT
// A component whose memory grows in its cycles, as it must not in a machine that has deadlines.
#include <deque>
#include <map>
#include <string>

#include "hal/component.hpp"

namespace {

struct Grows : hal::Component {
    using Component::Component;
    hal::In<double> in{*this, "in", "noted in each cycle"};
    hal::Out<double> out{*this, "out", "the sum of what is kept"};
    hal::Function run{*this, "", hal::step<&Grows::update>, "adds and removes"};

    void update(hal::Cycle) noexcept {
        ++count_;
        history_.push_back(in);
        texts_[std::to_string(count_ % 97) + " is longer than a short text"] += in;
        if (count_ % 3 == 0) {
            history_.pop_front();
        }
        if (count_ % 1000 == 0) {
            history_.clear();
            texts_.clear();
        }
        double sum = 0;
        for (const double one : history_) {
            sum += one;
        }
        for (const auto& [text, one] : texts_) {
            sum += one * static_cast<double>(text.size());
        }
        out = sum;
    }

    std::uint64_t count_ = 0;
    std::deque<double> history_;
    std::map<std::string, double> texts_;
};

}  // namespace

HAL_COMPONENT(Grows, "grows", "Keeps what it has read")
