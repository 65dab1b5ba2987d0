// SPDX-License-Identifier: MIT
#include <cstdio>
#include <ctime>
#include <fcntl.h>
#include <stdexcept>
#include <unistd.h>

#include "hal/component.hpp"

namespace {

/// Hangs on demand, and writes down in a file when it begins to and when its outputs are made safe
/// (CLOCK_MONOTONIC, ns).
struct Stall : hal::Component {
    using Component::Component;

    hal::TextArgument file{*this, "file", "", "where to write"};
    hal::In<std::uint32_t> mode{
        *this, "mode",
        "1: block for ever; 2: loop for ever; 3: loop for `ms`; 4: block for `ms`; 5: throw"};
    hal::In<std::uint32_t> ms{*this, "ms", "how long", {.initial = 1000}};
    hal::Out<double> out{*this, "out", "5 in every cycle", {.safe = -1.0}};
    hal::Function run{*this, "", &Stall::step, "counts"};
    hal::Emergency emergency{*this, &Stall::make_safe, "writes it down"};

    void start(const hal_host&) {
        descriptor_ = ::open(file.get().c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
    }
    void stop() noexcept {
        write("stop");
        if (descriptor_ >= 0) {
            ::close(descriptor_);
        }
    }
    void step(hal::Cycle) noexcept {
        out = 5.0;
        if (mode == 0 || done_ == mode) return;
        done_ = mode;
        if (mode == 5) {
            fail();
        }
        write("hang");
        const std::int64_t end = mode >= 3 ? now() + ms * std::int64_t{1'000'000} : INT64_MAX;
        while (now() < end) {
            if (mode == 1 || mode == 4) {
                ::usleep(1000);
            }
        }
        write("back");
    }
    void make_safe(hal::Cycle) noexcept { write("safe"); }

private:
    static void fail() { throw std::runtime_error("thrown in a cycle"); }
    static std::int64_t now() noexcept {
        timespec t{};
        clock_gettime(CLOCK_MONOTONIC, &t);
        return t.tv_sec * 1'000'000'000LL + t.tv_nsec;
    }
    void write(const char* what) const noexcept {
        char line[64];
        const int n =
            std::snprintf(line, sizeof line, "%s %lld\n", what, static_cast<long long>(now()));
        if (descriptor_ < 0) return;
        [[maybe_unused]] const ssize_t written =
            ::write(descriptor_, line, static_cast<std::size_t>(n));
    }
    int descriptor_ = -1;
    std::uint32_t done_ = 0;
};

}  // namespace

HAL_COMPONENT(Stall, "stall", "Hangs when a test asks for it")
