// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <string>

namespace hal::bus {

/// How the start of a guardian ended, in memory that it shares with its component.
class StartState {
public:
    enum class Phase : std::uint32_t { starting, running, rejected };

    /// Before the guardian is started. The component. [setup]
    void begin() noexcept { phase_.store(Phase::starting, std::memory_order_release); }
    /// It watches. The guardian.
    void accept() noexcept { phase_.store(Phase::running, std::memory_order_release); }
    /// It ends with a reason for the component. Returns its exit code. The guardian. [setup]
    int reject(const std::string& problem) noexcept {
        const std::size_t length = std::min(problem.size(), problem_.size() - 1);
        std::copy_n(problem.data(), length, problem_.data());
        problem_[length] = '\0';
        phase_.store(Phase::rejected, std::memory_order_release);
        return 1;
    }

    Phase phase() const noexcept { return phase_.load(std::memory_order_acquire); }
    /// Returns the reason; valid when it was rejected.
    const char* problem() const noexcept { return problem_.data(); }

private:
    std::atomic<Phase> phase_{Phase::starting};
    std::array<char, 512> problem_{};
};

}  // namespace hal::bus
