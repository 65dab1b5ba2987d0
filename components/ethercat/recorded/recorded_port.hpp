// SPDX-License-Identifier: MIT
// A port behind which the slaves of a capture answer.
#pragma once

#include <array>
#include <atomic>
#include <vector>

#include "ethercat/recorded/recorded_answers.hpp"

namespace hal::ethercat {

/// Each frame that is sent returns at once, with the answers of the capture. Frames that are no
/// EtherCAT frames are rejected. `errors` of the statistics counts datagrams that the capture does
/// not have.
class RecordedPort final : public hal::ethernet::Port {
public:
    /// [setup]
    RecordedPort(const std::string& address, const std::vector<hal::ethernet::Captured>& frames);

    const hal::ethernet::Address& address() const noexcept override { return address_; }
    hal::ethernet::Sent send(std::span<const std::uint8_t> frame,
                             const hal::ethernet::Launch& launch,
                             std::int64_t now_ns) noexcept override;
    std::optional<hal::ethernet::Arrival> receive(std::int64_t now_ns) noexcept override;
    bool wait(std::int64_t until_ns) noexcept override;
    hal::ethernet::Statistics statistics() const noexcept override;
    const hal::ethernet::Description& description() const noexcept override { return description_; }
    /// Returns the number of datagrams in the capture that have an answer. [any]
    std::size_t answers() const noexcept { return answers_.size(); }

private:
    using Count = std::atomic<std::uint64_t>;
    static constexpr std::size_t capacity = 64;  // frames
    struct Frame {
        std::array<std::uint8_t, max_frame_bytes> bytes;
        std::size_t size = 0;
        std::int64_t time_ns = 0;
    };

    RecordedAnswers answers_;
    hal::ethernet::Address address_{2, 'R', 'E', 'C', 'O', 'R'};
    hal::ethernet::Description description_;
    std::vector<Frame> frames_{capacity};
    std::size_t first_ = 0;  // of those that wait
    std::size_t waiting_ = 0;
    Count sent_{0};
    Count received_{0};
    Count dropped_{0};
    Count unknown_{0};
};

}  // namespace hal::ethercat
