// SPDX-License-Identifier: MIT
// A component whose output depends on what a cycle must not depend on; `kind` chooses it.
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <random>
#include <sys/time.h>
#include <thread>
#include <unistd.h>

#include "hal/component.hpp"

namespace {

struct Seeds : hal::Component {
    using Component::Component;
    hal::In<double> in{*this, "in", "added to the output"};
    hal::Out<double> out{*this, "out", "what is read"};
    hal::Param<std::int32_t> kind{*this, "kind", "what is read"};
    hal::Function run{*this, "", hal::step<&Seeds::update>, "reads it"};

    void start() {
        bytes_ = static_cast<unsigned char*>(std::malloc(4096));
        thread_ = std::jthread([this](const std::stop_token& end) {
            while (!end.stop_requested()) {
                ++turns_;
            }
        });
        while (turns_.load() == 0) {  // on a busy computer it runs late
            std::this_thread::yield();
        }
    }
    void stop() noexcept {
        thread_ = {};
        std::free(bytes_);
    }

    void update(hal::Cycle) noexcept { out = in + read(); }

    double read() noexcept {
        ++count_;
        timespec clock{};
        timeval time{};
        switch (kind) {
        case 1: return static_cast<double>(reinterpret_cast<std::uintptr_t>(bytes_) >> 4 & 0xffff);
        case 2: clock_gettime(CLOCK_MONOTONIC, &clock); return static_cast<double>(clock.tv_nsec);
        case 3: gettimeofday(&time, nullptr); return static_cast<double>(time.tv_usec);
        case 4: return bytes_[2000];
        case 5: return static_cast<double>(turns_.load());
        case 6: return getpid();
        case 7: return static_cast<double>(std::hash<void*>()(this) / 16 % 1009);
        case 8: return std::random_device()() % 1000003;
        default: return static_cast<double>(count_);
        }
    }

    std::uint64_t count_ = 0;
    unsigned char* bytes_ = nullptr;
    std::atomic<std::uint64_t> turns_ = 0;
    std::jthread thread_;
};

}  // namespace

HAL_COMPONENT(Seeds, "seeds", "Reads what a cycle must not depend on", "Only for a test.")
