// SPDX-License-Identifier: MIT
// Ethernet over EtherCAT on this machine: TAP interfaces, the thread that serves them, and the
// switch in the cycle. The thread and the cycle meet in queues only; a frame that finds one full is
// dropped, as on any network.
#pragma once

#include <poll.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "ethercat/config/config.hpp"
#include "ethercat/master/eoe_client.hpp"
#include "ethercat/master/master.hpp"
#include "ethercat/wire/eoe.hpp"
#include "hal/background.hpp"
#include "hal/component.hpp"
#include "hal/message_log.hpp"
#include "tap/tap.hpp"

namespace hal::ethercat {

class EoeInterfaces {
public:
    /// Takes the slaves with EoE of a bus. [setup]
    EoeInterfaces(const std::string& instance, const config::Bus& bus, master::Mailboxes& mailboxes)
        : log_(instance), switch_(mailboxes, ports_of(bus)) {
        const bool shared = !bus.eoe_switch.name.empty();
        if (shared) {
            interfaces_.push_back(std::make_unique<Interface>(bus.eoe_switch));
        }
        for (std::size_t n = 0; n < bus.setup.slaves.size(); ++n) {
            if (!bus.setup.slaves[n].eoe) continue;
            if (!shared) {
                interfaces_.push_back(std::make_unique<Interface>(bus.slaves[n].eoe));
            }
            interfaces_.back()->slaves.push_back(n);
        }
    }
    ~EoeInterfaces() { background_.stop(); }
    EoeInterfaces(const EoeInterfaces&) = delete;
    EoeInterfaces& operator=(const EoeInterfaces&) = delete;

    /// Opens the interfaces and starts their thread; on the virtual clock no interface is opened.
    /// Throws std::runtime_error with the reason. [setup]
    void start() {
        const auto* host = hal::extension<hal_background>(HAL_BACKGROUND);
        if (host != nullptr && host->is_virtual != 0) {
            log_.print("eoe: no interfaces on the virtual clock; they are opened by: hal run", 0);
            return;
        }
        for (const auto& i : interfaces_) {
            if (const std::string problem = i->open(); !problem.empty()) {
                throw std::runtime_error("eoe: " + problem);
            }
        }
        opened_ = true;
        background_.start();
    }

    master::EoeSwitch& frames() noexcept { return switch_; }

    /// Moves frames of the interfaces towards the slaves, and shows which interfaces lead to a
    /// slave. [realtime]
    void step(const master::Master& bus) noexcept {
        if (!opened_) return;
        if (!runs_.exchange(true, std::memory_order_relaxed)) {
            switch_.discard();
        }
        switch_.pump();
        for (const auto& i : interfaces_) {
            bool any = false;
            for (const std::size_t n : i->slaves) {
                const State state = bus.slave_status(n).state;
                any |= bus.slave_status(n).online && state != State::none && state != State::init &&
                       state != State::boot;
            }
            i->reachable.store(any, std::memory_order_relaxed);
        }
    }

    /// No cycle follows until the next step(): the interfaces have no carrier, and what is sent to
    /// them is discarded. [realtime] and in a crash handler
    void interrupt() noexcept { runs_.store(false, std::memory_order_relaxed); }
    /// Returns how many frames to slaves were dropped: a queue was full, a slave did not take them,
    /// or the machine was stopped. [realtime]
    std::uint32_t dropped() const noexcept {
        return switch_.lost() + discarded_.load(std::memory_order_relaxed);
    }

private:
    static constexpr int busy_ms = 1;
    static constexpr int idle_ms = 10;
    static constexpr std::int64_t busy_for_ns = 1'000'000'000;
    static constexpr unsigned frames_at_once = 32;

    struct Interface {
        explicit Interface(const config::HostInterface& s) : setup(s) {}
        std::string open() {
            tap::Setup to;
            to.name = setup.name;
            to.prefix = setup.prefix;
            if (setup.ip != 0) {
                to.ip = tap::Ip{static_cast<std::uint8_t>(setup.ip >> 24),
                                static_cast<std::uint8_t>(setup.ip >> 16),
                                static_cast<std::uint8_t>(setup.ip >> 8),
                                static_cast<std::uint8_t>(setup.ip)};
            }
            const std::string problem = tap.open(to);
            if (problem.empty()) {
                tap.show_carrier(false);
            }
            return problem;
        }
        config::HostInterface setup;
        std::vector<std::size_t> slaves;  ///< in Setup::slaves
        tap::Interface tap;
        /// written by the cycle: a slave behind it has its mailbox
        std::atomic<bool> reachable{false};
        /// this and `tap` are the thread's
        bool carrier = false;
        bool lost = false;
    };

    static std::vector<master::EoePort> ports_of(const config::Bus& bus) {
        std::vector<master::EoePort> ports;
        for (std::size_t n = 0; n < bus.setup.slaves.size(); ++n) {
            if (bus.setup.slaves[n].eoe) {
                ports.push_back(
                    {static_cast<std::uint16_t>(n),
                     static_cast<std::uint16_t>(bus.eoe_switch.name.empty() ? ports.size() : 0)});
            }
        }
        return ports;
    }

    /// Moves frames between the interfaces and the queues, then waits for more.
    void turn(std::int64_t now_ns, bool may_wait) noexcept {
        if (!may_wait) return;
        const bool runs = runs_.load(std::memory_order_relaxed);
        bool moved = false;
        bool held = false;
        for (std::size_t n = 0; n < interfaces_.size(); ++n) {
            Interface& i = *interfaces_[n];
            if (i.lost) continue;
            const bool up = runs && i.reachable.load(std::memory_order_relaxed);
            if (up != i.carrier) {
                i.tap.show_carrier(i.carrier = up);
            }
            auto& to = switch_.to_host(n);
            for (const master::EthernetFrame* frame = to.front(); frame != nullptr;
                 frame = to.front()) {
                i.tap.write({frame->bytes.data(), frame->length});
                to.drop();
                moved = true;
            }
            moved |= runs ? pass_on(i, switch_.from_host(n), held) : discard(i);
        }
        if (moved) {
            busy_until_ns_ = now_ns + busy_for_ns;
        }
        log_.flush();
        wait(now_ns < busy_until_ns_ ? busy_ms : idle_ms, held);
    }

    /// Queues frames of an interface. `held` becomes true when the queue is full; the kernel keeps
    /// the others. Returns whether there was any.
    static bool pass_on(Interface& i, Queue<master::EthernetFrame>& to, bool& held) noexcept {
        for (unsigned k = 0; k < frames_at_once; ++k) {
            master::EthernetFrame* place = to.place();
            if (place == nullptr) {
                held = true;
                return true;
            }
            const std::size_t length = i.tap.read(place->bytes);
            if (length == 0) return k != 0;
            place->length = static_cast<std::uint16_t>(length);
            to.commit();
        }
        return true;
    }
    /// Reads frames of an interface while the machine is stopped: they would be stale at its start.
    bool discard(Interface& i) noexcept {
        std::array<std::uint8_t, eoe::max_frame> frame;
        for (unsigned k = 0; k < frames_at_once; ++k) {
            if (i.tap.read(frame) == 0) return k != 0;
            discarded_.fetch_add(1, std::memory_order_relaxed);
        }
        return true;
    }

    void wait(int at_most_ms, bool held) noexcept {
        if (held) return std::this_thread::sleep_for(std::chrono::milliseconds(busy_ms));
        std::vector<pollfd>& all = polled_;
        all.clear();
        for (const auto& i : interfaces_) {
            all.push_back({i->lost ? -1 : i->tap.descriptor(), POLLIN, 0});
        }
        ::poll(all.data(), static_cast<nfds_t>(all.size()), at_most_ms);
        for (std::size_t n = 0; n < all.size(); ++n) {
            if ((all[n].revents & (POLLERR | POLLHUP | POLLNVAL)) != 0 &&
                !std::exchange(interfaces_[n]->lost, true)) {
                log_.print("eoe: interface " + interfaces_[n]->tap.name() +
                           " was deleted; to open it again: unloadrt and loadrt");
            }
        }
    }

    std::vector<std::unique_ptr<Interface>> interfaces_;
    std::vector<pollfd> polled_;  // of the thread, as the next one
    std::int64_t busy_until_ns_ = 0;
    hal::MessageLog log_;
    master::EoeSwitch switch_;
    bool opened_ = false;
    std::atomic<bool> runs_{false};  // written by the cycle
    std::atomic<std::uint32_t> discarded_{0};  // written by the thread
    // the last: it uses the others
    hal::Background background_{[this](std::int64_t now, bool may_wait) { turn(now, may_wait); }};
};

}  // namespace hal::ethercat
