// SPDX-License-Identifier: MIT
#include <cstdio>
#include <fcntl.h>
#include <unistd.h>

#include "hal/component.hpp"

namespace {

/// Writes down in a file what happens to its output at the end.
struct Witness : hal::Component {
    using Component::Component;

    hal::TextArgument file{*this, "file", "", "where to write"};
    hal::Out<double> out{*this, "out", "5 in every cycle", {.safe = -1.0}};
    hal::In<bool> crash{*this, "crash", "true: the next cycle reads from address 0"};
    hal::Function run{*this, "", &Witness::step, "counts"};
    hal::Emergency emergency{*this, &Witness::make_safe, "writes it down"};

    void start(const hal_host&) {
        descriptor_ = ::open(file.get().c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
    }
    void stop() noexcept {
        char line[64];
        const int n = std::snprintf(line, sizeof line, "stop out=%g\n", out.get());
        write(line, static_cast<std::size_t>(n));
        if (descriptor_ >= 0) {
            ::close(descriptor_);
        }
    }
    void step(hal::Cycle) noexcept {
        out = 5.0;
        if (crash) {
            volatile int* const nowhere = nullptr;
            *nowhere = 0;
        }
    }
    void make_safe(hal::Cycle) noexcept { write("emergency\n", 10); }

private:
    void write(const char* text, std::size_t size) const noexcept {
        if (descriptor_ < 0) return;
        [[maybe_unused]] const ssize_t written = ::write(descriptor_, text, size);
    }
    int descriptor_ = -1;
};

}  // namespace

HAL_COMPONENT(Witness, "witness", "Reports to a test what happened at the end")
