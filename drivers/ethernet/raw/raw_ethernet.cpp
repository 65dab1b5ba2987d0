// SPDX-License-Identifier: MIT
#include "raw_ethernet.hpp"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>

#include "ethernet_interface.hpp"
#include "ethernet_monitor.hpp"
#include "link/trace_frame.hpp"
#include "pacer.hpp"
#include "raw_clock.hpp"
#include "receiver.hpp"
#include "sender.hpp"

namespace hal::ethernet::rawether {

namespace {

class RawPort final : public Port {
public:
    explicit RawPort(const Options& options)
        : options_(options), sender_(clock_), budget_(SpinBudget::is_needed()) {}

    /// Opens the port. Returns the problem, or "". [setup]
    std::string open(const std::string& name) {
        if (auto problem = receiver_.open(options_); !problem.empty()) return problem;
        if (auto problem = sender_.open(options_.transmit_stamps); !problem.empty()) return problem;
        const Interface found = ask(name);
        if (found.index == 0) return "no interface '" + name + "'; interfaces are " + interfaces();
        if (!found.ethernet) {
            return name + " is not an Ethernet interface; to list them: ip -br link";
        }
        if (!receiver_.bind(found.index) || !sender_.bind(found.index)) {
            return "cannot bind to " + name + ": " + link::reason();
        }
        address_ = found.address;
        monitor_ = std::make_unique<EthernetMonitor>(name, found, receiver_, sender_, clock_);
        if (options_.pacer) {
            pacer_ = std::make_unique<Pacer>(sender_, options_);
        }
        description_ = describe(name);
        if (pacer_) {
            description_.remark = pacer_->remark();
        }
        return {};
    }

    const Address& address() const noexcept override { return address_; }

    Sent send(std::span<const std::uint8_t> frame, const Launch& launch,
              std::int64_t) noexcept override {
        const auto max_bytes = header_bytes + sender_.mtu.load(std::memory_order_relaxed);
        if (!launch.fits(frame.size()) || frame.size() > max_bytes) {
            return sender_.drop(Sent::rejected);
        }
        if (!sender_.up.load(std::memory_order_relaxed)) return sender_.drop(Sent::down);
        link::trace_frame(link::ethernet_sent, frame);
        if (launch.at_ns == 0) return sender_.leave(frame, launch);
        // The caller's now is the start of its cycle; the remaining time counts from here.
        const auto now = link::monotonic_ns();
        if (now >= launch.at_ns) return sender_.leave(frame, launch);
        if (pacer_) {
            return frame.size() <= max_frame ? pacer_->send(frame, launch, now)
                                             : sender_.drop(Sent::rejected);
        }
        if (launch.at_ns - now > options_.spin_ns) return sender_.drop(Sent::full);
        sender_.await(launch.at_ns);
        return sender_.leave(frame, launch);
    }

    std::optional<Arrival> receive(std::int64_t) noexcept override {
        const auto next = receiver_.next(clock_);
        if (next) {
            link::trace_frame(link::ethernet_received, next->bytes);
        }
        return next;
    }

    bool wait(std::int64_t until_ns) noexcept override {
        if (receiver_.ready()) return true;
        auto now = link::monotonic_ns();
        if (options_.policy == Policy::block) return block(now, until_ns);
        if (options_.policy == Policy::hybrid && until_ns - now > options_.spin_ns) {
            sleep_until(until_ns - options_.spin_ns);
            now = link::monotonic_ns();
        }
        for (auto began = now;;) {
            if (receiver_.ready()) {
                budget_.spent(began, now);
                return true;
            }
            if (now >= until_ns) {
                budget_.spent(began, now);
                return false;
            }
            pause_processor();
            now = link::monotonic_ns();
            if (now - began < 20'000) continue;
            if (!budget_.spent(began, now)) {
                sleep_until(std::min(now + SpinBudget::rest_ns, until_ns));
            }
            began = now = link::monotonic_ns();
        }
    }

    Statistics statistics() const noexcept override {
        const auto read = [](const auto& counter) {
            return counter.load(std::memory_order_relaxed);
        };
        Statistics s;
        s.up = read(sender_.up);
        s.speed = read(monitor_->speed);
        s.mtu = read(sender_.mtu);
        s.sent = read(sender_.sent);
        s.sent_bytes = read(sender_.sent_bytes);
        s.received = read(receiver_.received);
        s.received_bytes = read(receiver_.received_bytes);
        s.lost = read(monitor_->lost);
        s.dropped = read(sender_.dropped);
        s.late = read(sender_.late);
        s.errors = read(sender_.errors) + read(receiver_.errors);
        s.downs = read(monitor_->downs);
        s.launch_error_ns = read(sender_.launch_error_ns);
        s.departure_ns = read(sender_.departure_ns);
        return s;
    }
    const Description& description() const noexcept override { return description_; }
    int descriptor() const noexcept override { return receiver_.descriptor(); }

private:
    bool block(std::int64_t now, std::int64_t until) noexcept {
        while (now < until) {
            pollfd p{receiver_.descriptor(), POLLIN, 0};
            const timespec limit = link::to_timespec(until - now);
            ::ppoll(&p, 1, &limit, nullptr);
            if (receiver_.ready()) return true;
            // the interface went down: reported once, until it is read
            if ((p.revents & POLLERR) != 0) {
                int error = 0;
                socklen_t size = sizeof error;
                (void)getsockopt(receiver_.descriptor(), SOL_SOCKET, SO_ERROR, &error, &size);
            }
            now = link::monotonic_ns();
        }
        return false;
    }

    const Options options_;
    RealTime clock_;
    Receiver receiver_;
    Sender sender_;
    SpinBudget budget_;  ///< of the receiving thread
    Address address_{};
    Description description_;
    std::unique_ptr<EthernetMonitor> monitor_;
    std::unique_ptr<Pacer> pacer_;
};

}  // namespace

Description describe(const std::string& interface) {
    return {.address = "eth:" + interface,
            .transport = "raw Ethernet",
            .interface = interface,
            .paced = true};
}

Opened open(const std::string& interface, const Options& options) {
    if (interface.empty()) {
        return {nullptr, "missing interface; write eth:enp3s0; interfaces are " + interfaces()};
    }
    auto port = std::make_unique<RawPort>(options);
    auto problem = port->open(interface);
    if (!problem.empty()) {
        return {nullptr, std::move(problem)};
    }
    return {std::move(port), {}};
}

}  // namespace hal::ethernet::rawether
