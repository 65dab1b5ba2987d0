// SPDX-License-Identifier: MIT
// An output that each further instance in a process sets a few cycles earlier, where the environment
// has EARLIER: each execution of its journal in one process has another first difference.
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <string>
#include <unistd.h>

#include "hal/component.hpp"

namespace {

constexpr const char* prefix = "EARLIER=";

/// Returns the variable's text, or nullptr, without getenv, which a journal records.
const char* earlier() {
    for (const char* const* at = environ; *at != nullptr; ++at) {
        if (std::strncmp(*at, prefix, std::strlen(prefix)) == 0) return *at + std::strlen(prefix);
    }
    return nullptr;
}

struct Earlier : hal::Component {
    using Component::Component;

    hal::In<double> in{*this, "in", "a value to name"};
    hal::Out<bool> out{*this, "out", "TRUE from one of the first cycles on"};
    hal::Function run{*this, "", &Earlier::step, "counts the cycles"};

    void start(const hal_host&) {
        const char* const text = earlier();
        if (text == nullptr) return;
        first_ = std::max(std::atoi(text), 1);
        setenv("EARLIER", std::to_string(first_ - 20).c_str(), 1);
    }
    void step(hal::Cycle) noexcept {
        ++cycles_;
        out = first_ != 0 && cycles_ >= first_;
    }

private:
    int cycles_ = 0;
    int first_ = 0;  // 0: never
};

}  // namespace

HAL_COMPONENT(Earlier, "earlier", "Has an output that each execution sets earlier")
