// SPDX-License-Identifier: MIT
// A component whose output depends on what a cycle must not depend on; `kind` chooses it.
#include <atomic>
#include <cfenv>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <functional>
#include <random>
#include <sys/socket.h>
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
        socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
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
        ::close(socket_);
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
        case 9: return std::rand() % 1009;
        case 10: return received();
        case 11: std::fesetround(FE_DOWNWARD); return static_cast<double>(count_);
        case 12: return old_value();
        default: return static_cast<double>(count_);
        }
    }

    double received() const noexcept {
        unsigned char byte = 0;
        return ::recv(socket_, &byte, 1, MSG_DONTWAIT) == 1 ? byte : -1.0;
    }
    /// Keeps the address of a value, which is valid for one plan only.
    double old_value() noexcept {
        if (!address_) {
            hal_pin pin;
            static_assert(sizeof in == sizeof pin);
            std::memcpy(&pin, static_cast<const void*>(&in), sizeof pin);
            address_ = pin.slot;
        }
        return address_->real;
    }

    int socket_ = -1;
    const hal_value* address_ = nullptr;
    std::uint64_t count_ = 0;
    unsigned char* bytes_ = nullptr;
    std::atomic<std::uint64_t> turns_ = 0;
    std::jthread thread_;
};

}  // namespace

HAL_COMPONENT(Seeds, "seeds", "Reads what a cycle must not depend on", "Only for a test.")
