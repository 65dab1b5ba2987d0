// SPDX-License-Identifier: MIT
#include <array>
#include <cstdlib>
#include <fcntl.h>
#include <unistd.h>

#include "hal/component.hpp"

namespace {

/// Reads a number from a file that stays open, which no journal has.
struct Gauge : hal::Component {
    using Component::Component;

    hal::TextArgument file{*this, "file", "", "what to read"};
    hal::Out<double> out{*this, "out", "the number"};
    hal::Function run{*this, "", &Gauge::step, "sets the output"};

    void start(const hal_host&) {
        descriptor_ = ::open(file.get().c_str(), O_RDWR | O_CLOEXEC);
        std::array<char, 32> text{};
        if (::read(descriptor_, text.data(), text.size() - 1) > 0) {
            number_ = std::atof(text.data());
        }
    }
    void stop() noexcept { ::close(descriptor_); }
    void step(hal::Cycle) noexcept { out = number_; }

private:
    int descriptor_ = -1;
    double number_ = 0;
};

}  // namespace

HAL_COMPONENT(Gauge, "gauge", "Depends on a file")
