// SPDX-License-Identifier: MIT
// A thread that reads the status of the machine as often as it can.
#include <array>
#include <atomic>
#include <thread>

#include "hal/component.hpp"
#include "hal/status.h"

struct TestStatus : hal::Component {
    using Component::Component;
    hal::Out<std::uint32_t> texts{*this, "texts", "status texts that were read"};
    hal::Function run{*this, "", &TestStatus::cycle, "counts"};

    void start() {
        const hal_status* const status = hal::extension<hal_status>(HAL_STATUS);
        reader_ = std::jthread([this, status](const std::stop_token& end) {
            std::array<char, 4096> text{};
            while (!end.stop_requested()) {
                texts_ += status->text(status, text.data(), text.size()) != 0 ? 1 : 0;
            }
        });
    }
    void stop() noexcept { reader_ = {}; }
    void cycle(hal::Cycle) noexcept { texts = texts_.load(std::memory_order_relaxed); }

private:
    std::atomic<std::uint32_t> texts_{0};
    std::jthread reader_;
};

HAL_COMPONENT(TestStatus, "test-status", "Reads the status of the machine in a thread")
