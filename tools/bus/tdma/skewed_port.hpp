// SPDX-License-Identifier: MIT
// Simulates a station with another quartz than this machine's: a clock, and a port with all times
// on that clock.
#pragma once

#include <cmath>
#include <memory>
#include <utility>

#include "discipline/discipline.hpp"
#include "link/ethernet.hpp"

namespace hal::tools {

/// local = true + skew t + drift t²/2, t since the start. [realtime]
class SkewedClock {
public:
    SkewedClock(std::int64_t began_ns, double skew, double drift_per_s) noexcept
        : began_(began_ns), skew_(skew), drift_(drift_per_s) {}
    std::int64_t local(std::int64_t true_ns) const noexcept { return true_ns + ahead(true_ns); }
    std::int64_t from_local(std::int64_t local_ns) const noexcept {
        auto guess = local_ns;
        // each step is a thousand times closer
        for (int n = 0; n < 4; ++n) {
            guess = local_ns - ahead(guess);
        }
        return guess;
    }
    std::int64_t ahead(std::int64_t true_ns) const noexcept {
        const double t = static_cast<double>(true_ns - began_);
        return std::llround(t * (skew_ + drift_ * t * 0.5e-9));
    }

private:
    const std::int64_t began_;
    const double skew_, drift_;
};

/// A port on that clock, including the timestamps in frames.
class SkewedPort final : public ethernet::Port {
public:
    SkewedPort(std::unique_ptr<ethernet::Port> port, const SkewedClock& clock)
        : port_(std::move(port)), clock_(clock) {}

    const ethernet::Address& address() const noexcept override { return port_->address(); }
    ethernet::Sent send(std::span<const std::uint8_t> frame, const ethernet::Launch& launch,
                        std::int64_t now_ns) noexcept override {
        auto real = launch;
        if (real.at_ns != 0) {
            real.at_ns = clock_.from_local(launch.at_ns);
        }
        const auto now = clock_.from_local(now_ns);
        real.stamp_add_ns += clock_.ahead(real.at_ns != 0 ? real.at_ns : now);
        return port_->send(frame, real, now);
    }
    std::optional<ethernet::Arrival> receive(std::int64_t now_ns) noexcept override {
        auto arrival = port_->receive(clock_.from_local(now_ns));
        if (arrival) {
            arrival->time_ns = clock_.local(arrival->time_ns);
        }
        return arrival;
    }
    bool wait(std::int64_t until_ns) noexcept override {
        return port_->wait(clock_.from_local(until_ns));
    }
    ethernet::Statistics statistics() const noexcept override { return port_->statistics(); }
    const ethernet::Description& description() const noexcept override {
        return port_->description();
    }
    int descriptor() const noexcept override { return port_->descriptor(); }

private:
    const std::unique_ptr<ethernet::Port> port_;
    const SkewedClock& clock_;
};

/// A discipline on that clock, for links whose ports use the machine's clock.
class SkewedDiscipline final : public ethernet::Discipline {
public:
    SkewedDiscipline(ethernet::Discipline& its, const SkewedClock& clock) noexcept
        : its_(its), clock_(clock) {}

    ethernet::Sent send(std::span<const std::uint8_t> frame, unsigned slot, unsigned priority,
                        ethernet::Finisher* finisher) noexcept override {
        return its_.send(frame, slot, priority, finisher);
    }
    void count_dropped() noexcept override { its_.count_dropped(); }
    std::size_t capacity(unsigned slot) const noexcept override { return its_.capacity(slot); }
    bool ready() const noexcept override { return its_.ready(); }
    const ethernet::Address& address() const noexcept override { return its_.address(); }
    Origin origin(const ethernet::Address& from, std::int64_t arrived_ns,
                  std::size_t length) const noexcept override {
        return its_.origin(from, clock_.local(arrived_ns), length);
    }

private:
    ethernet::Discipline& its_;
    const SkewedClock& clock_;
};

}  // namespace hal::tools
