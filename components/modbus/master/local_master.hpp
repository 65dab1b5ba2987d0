// SPDX-License-Identifier: MIT
// A master in this process: its turns are called by a background thread, or between the instants of
// the virtual clock.
#pragma once

#include <poll.h>

#include <algorithm>
#include <cstdint>
#include <memory>

#include "link/system.hpp"
#include "modbus/master/master.hpp"

namespace hal::modbus {

class LocalMaster {
public:
    /// `bus` and `plan` outlive it. [setup]
    LocalMaster(const Bus& bus, const Plan& plan, Image image, std::unique_ptr<line::Line> line)
        : image_(image), line_(std::move(line)), master_(bus, plan, image) {
        image_.header().phase.store(static_cast<std::uint32_t>(Phase::running));
    }

    /// A piece of the work; waits for bytes for at most 20 ms when it `may_wait`.
    void turn(std::int64_t now_ns, bool may_wait) noexcept {
        if (!attached_) {
            attached_ = true;
            master_.attach(*line_, now_ns);
        }
        const std::int64_t next = work(now_ns);
        if (!may_wait) return;
        const std::int64_t limit = std::clamp<std::int64_t>(next - now_ns, 20'000, 20'000'000);
        pollfd p{line_->descriptor(), POLLIN, 0};
        const timespec time = link::to_timespec(limit);
        ppoll(&p, p.fd >= 0 ? 1 : 0, &time, nullptr);
    }

private:
    std::int64_t work(std::int64_t now_ns) noexcept {
        const ImageHeader& header = image_.header();
        const std::int64_t next = master_.work(now_ns);
        if (!header.requests.holds_any() && master_.is_stopped()) {
            master_.release();
        }
        return next;
    }

    Image image_;
    std::unique_ptr<line::Line> line_;
    Master master_;
    bool attached_ = false;
};

}  // namespace hal::modbus
