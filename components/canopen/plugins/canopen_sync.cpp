// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "hal/component.hpp"
#include "link/can.hpp"

namespace {

struct CanopenSync : hal::Component {
    using Component::Component;
    hal::TextArgument link{*this, "link", "sim:canopen", "the bus in memory, sim:NAME", {.per_instance = true}};
    hal::Argument     period{*this, "period_us", 1000, "time between two SYNCs by its own clock", {.min = 100, .max = 60'000'000}};
    hal::Argument     identifier{*this, "cob_id", 0x80, "of the SYNC", {.min = 1, .max = 0x7ff}};

    hal::Function update{*this, "update", &CanopenSync::send, "hands the bus the SYNCs that are due before the next cycle"};

    hal::In<bool>            enable{*this, "enable", "false: it is silent, and its clock runs on", {.initial = true}};
    hal::In<double>          skew{*this, "skew-ppm", "how much slower than the threads' its clock runs, at most 100000", {.unit = "ppm"}};
    hal::Out<std::uint32_t>  count{*this, "count", "SYNCs sent"};

    void start() {
        const hal::can::Description bus = hal::can::describe(link.get());
        if (!bus.in_memory || !bus.has_bit_rate) throw std::runtime_error("link=" + link.get() + " is no bus in memory; write link=sim:NAME");
        auto opened = hal::can::open(link.get());
        if (!opened) throw std::runtime_error(opened.problem);
        link_ = std::move(opened.link);
        next_ns_ = -1;
    }
    void stop() noexcept { link_.reset(); }

    void send(hal::Cycle cycle) noexcept {
        const auto   now = static_cast<double>(cycle.start_ns()), end = now + static_cast<double>(cycle.period_ns());
        const double ppm = std::isfinite(skew) ? std::clamp(skew.get(), -1e5, 1e5) : 0.0;
        const double every = static_cast<double>(period) * 1e3 * (1 + ppm * 1e-6);
        if (next_ns_ < 0) next_ns_ = now;
        if (next_ns_ < now) next_ns_ += std::ceil((now - next_ns_) / every) * every;  // cycles were missed
        for (; next_ns_ < end; next_ns_ += every)
            if (enable && link_->send({static_cast<std::uint32_t>(identifier), {}}, std::llround(next_ns_)) == hal::can::Sent::queued)
                count = count + 1;
        link_->flush(cycle.start_ns());
    }

private:
    std::unique_ptr<hal::can::Link> link_;
    double                          next_ns_ = -1;  // on the runtime's clock, whatever the threads are made to follow
};

}  // namespace

HAL_COMPONENT(CanopenSync, "canopen_sync", "SYNC by a clock of its own on a simulated CAN bus", R"(
Sends SYNC on a bus in memory at the times of a clock of its own, and not in step with the thread: what a node elsewhere does, whose
quartz is another one. It is for trying out masters with `sync = follow`: how they lock, what they do when the SYNC is lost.

    loadrt canopen_sync link=sim:arm period_us=1000
    setp canopen-sync.0.skew-ppm 200
    addf canopen-sync.0.update servo
)")
