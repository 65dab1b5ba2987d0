// SPDX-License-Identifier: MIT
#pragma once

#include "events.hpp"
#include "frames.hpp"
#include "lss.hpp"

namespace hal::canopen {

/// The slave's side: gets a node id and a bit rate from the master, before it has either.
class LssSlave {
public:
    LssSlave(FrameQueue& out, Events& events) noexcept : out_(out), events_(events) {}
    void configure(const Identity& identity, std::uint8_t node_id) noexcept { identity_ = identity, active_id_ = pending_id_ = node_id; }
    /// True: it is an LSS frame. [realtime]
    bool handle(const Frame&) noexcept;
    void poll() noexcept {
        if (waiting_answer_) waiting_answer_ = !out_.push(answer_);
    }
    /// The id that holds after the next reset of communication.
    std::uint8_t pending_id() const noexcept { return pending_id_; }
    void took_over() noexcept { active_id_ = pending_id_, wants_reset_ = false; }
    /// A node without id has got one: communication starts now.
    bool wants_reset() const noexcept { return wants_reset_; }
    bool configuring() const noexcept { return configuring_; }

private:
    void answer(std::uint8_t command, std::uint32_t value = 0) noexcept;
    void select(unsigned part, std::uint32_t value) noexcept;
    void identify(unsigned step, std::uint32_t value) noexcept;
    void fastscan(const Frame&) noexcept;
    void configure_bit_timing(const Frame&) noexcept;

    FrameQueue& out_;
    Events& events_;
    Identity identity_{};
    std::uint8_t active_id_ = unconfigured, pending_id_ = unconfigured;
    std::uint32_t pending_rate_ = 0;
    bool configuring_ = false, wants_reset_ = false, waiting_answer_ = false;
    std::uint8_t selected_ = 0, identified_ = 0;  // steps that fit so far
    std::uint8_t scan_part_ = 0;
    Frame answer_;
};

}  // namespace hal::canopen
