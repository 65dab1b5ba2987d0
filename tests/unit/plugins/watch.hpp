// SPDX-License-Identifier: MIT
// The record that a test lets a component fill: its address is a load argument (watch=ADDRESS), 0
// for none.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>

namespace hal::test {

struct Watch {
    std::atomic<int> constructed{0};
    std::atomic<int> started{0};
    std::atomic<int> stopped{0};
    std::atomic<int> destroyed{0};
    std::atomic<int> emergencies{0};
    /// how many threads run the function now, and ever did
    std::atomic<int> inside{0};
    std::atomic<int> max_inside{0};
    std::atomic<bool> hang{false};
    std::atomic<bool> hanging{false};
    /// the next start returns once the function of the component with this record hangs
    std::atomic<Watch*> hang_at_start{nullptr};
    std::atomic<std::uint64_t> runs{0};

    std::string argument() const {
        return "watch=" + std::to_string(reinterpret_cast<std::uintptr_t>(this));
    }
    static Watch& at(std::int64_t address) {
        static Watch nobody;
        return address ? *reinterpret_cast<Watch*>(static_cast<std::uintptr_t>(address)) : nobody;
    }
};

}  // namespace hal::test
