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
    hal::TextArgument link{*this,
                           "link",
                           "sim:canopen",
                           "address of a simulated bus, sim:NAME",
                           {.per_instance = true}};
    hal::Argument period{*this,
                         "period_us",
                         1000,
                         "SYNC period in us, by its own clock",
                         {.min = 100, .max = 60'000'000}};
    hal::Argument identifier{
        *this, "cob_id", 0x80, "identifier of the SYNC", {.min = 1, .max = 0x7ff}};

    hal::Function update{*this, "update", &CanopenSync::send,
                         "sends the SYNCs due before the next cycle"};

    hal::In<bool> enable{
        *this, "enable", "false: no SYNC is sent; the clock keeps running", {.initial = true}};
    hal::In<double> skew{*this,
                         "skew-ppm",
                         "how much slower its clock runs than that of the threads, at most 100000",
                         {.unit = "ppm"}};
    hal::Out<std::uint32_t> count{*this, "count", "SYNCs sent"};

    void start() {
        const hal::can::Description bus = hal::can::describe(link.get());
        if (!bus.in_memory || !bus.has_bit_rate) {
            throw std::runtime_error("link=" + link.get() +
                                     " is not a simulated bus; write link=sim:NAME");
        }
        auto opened = hal::can::open(link.get());
        if (!opened) throw std::runtime_error(opened.problem);
        link_ = std::move(opened.link);
        next_ns_ = -1;
    }
    void stop() noexcept { link_.reset(); }

    void send(hal::Cycle cycle) noexcept {
        const auto now = static_cast<double>(cycle.start_ns());

        const auto end = now + static_cast<double>(cycle.period_ns());
        const double ppm = std::isfinite(skew) ? std::clamp(skew.get(), -1e5, 1e5) : 0.0;
        const double every = static_cast<double>(period) * 1e3 * (1 + ppm * 1e-6);
        if (next_ns_ < 0) {
            next_ns_ = now;
        }
        // after missed cycles
        if (next_ns_ < now) {
            next_ns_ += std::ceil((now - next_ns_) / every) * every;
        }
        for (; next_ns_ < end; next_ns_ += every) {
            if (enable && link_->send({static_cast<std::uint32_t>(identifier), {}},
                                      std::llround(next_ns_)) == hal::can::Sent::queued) {
                count = count + 1;
            }
        }
        link_->flush(cycle.start_ns());
    }

private:
    std::unique_ptr<hal::can::Link> link_;
    // on the runtime's clock, whatever the threads are synchronised to
    double next_ns_ = -1;
};

}  // namespace

HAL_COMPONENT(CanopenSync, "canopen_sync",
              "SYNC producer with a clock of its own on a simulated CAN bus", R"(
Sends SYNC on a simulated bus by a clock of its own that drifts against the threads, like a remote
node with another quartz. For testing masters with `sync = follow`: how they lock to the SYNC and
what they do when it is lost.

    loadrt canopen_sync link=sim:arm period_us=1000
    setp canopen-sync.0.skew-ppm 200
    addf canopen-sync.0.update servo
)")
