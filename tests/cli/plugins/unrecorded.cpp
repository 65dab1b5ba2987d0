// SPDX-License-Identifier: MIT
// An output that no journal reproduces: it comes from a clock that is read by a system call of its
// own.
#include <ctime>
#include <stdexcept>
#include <sys/syscall.h>
#include <unistd.h>

#include "hal/component.hpp"

namespace {

struct Unrecorded : hal::Component {
    using Component::Component;

    hal::In<bool> enable{*this, "enable", "FALSE holds the output", {.initial = true}};
    hal::Out<double> out{*this, "out", "the time modulo 1000", {.unit = "us"}};
    hal::Function run{*this, "", &Unrecorded::step, "reads the clock"};

    void start(const hal_host& host) {
        const auto* streams = hal::extension<hal_stream_host>("hal.stream/1");
        fifo_.size = sizeof fifo_;
        fifo_.columns = 1;
        fifo_.depth = 1;
        fifo_.types = "f";
        fifo_.data = values_;
        if (streams == nullptr || !streams->publish(&host, "", &fifo_)) {
            throw std::runtime_error("the stream could not be published");
        }
    }
    void step(hal::Cycle) noexcept {
        if (!enable) return;
        timespec now{};
        syscall(SYS_clock_gettime, CLOCK_MONOTONIC, &now);
        out = static_cast<double>(now.tv_nsec / 1000 % 1000);
    }

private:
    hal_value values_[2]{};
    hal_stream fifo_{};
};

}  // namespace

HAL_COMPONENT(Unrecorded, "unrecorded", "Has a stream and an output that no journal reproduces")
