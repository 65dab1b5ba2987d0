// SPDX-License-Identifier: MIT
// Objects as pins. Declared in the component's constructor; the cycle moves numbers only.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <string>

#include "hal/component.hpp"
#include "runner.hpp"

namespace hal::canopen {

/// The number in an object. [realtime]
inline double real_of(Type type, std::uint64_t raw) noexcept {
    if (type == Type::real32) return static_cast<double>(load<float>(&raw));
    if (type == Type::real64) return load<double>(&raw);
    return is_signed(type) ? static_cast<double>(static_cast<std::int64_t>(raw))
                           : static_cast<double>(raw);
}

/// What an object can hold.
struct Range {
    double low = 0;
    double high = 0;                     ///< for a real pin
    std::int64_t least = 0;                       ///< for a whole one
    std::uint64_t most = 0;

    explicit Range(const config::Object& o) {
        const unsigned bits = o.bits == 0 || o.bits > 64 ? 64 : o.bits;
        most = bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
        if (is_signed(o.type)) {
            most >>= 1;
            least = -static_cast<std::int64_t>(most) - 1;
        }
        low = static_cast<double>(least);
        // The greatest double that is not beyond: of 64 bits the next one below.
        high =
            bits < 64 ? static_cast<double>(most) : std::nextafter(static_cast<double>(most), 0.0);
    }
};

/// A pin and the object behind it.
template <class Pin>
struct Bound {
    Pin pin;
    std::size_t slot;
    Type type;
    double scale, offset;
    unsigned bit;
    Range range;

    template <class T>
    Bound(Component& component, const Function& function, const std::string& name,
          const std::string& about, hal::PinOptions<T> options, std::size_t at,
          const config::Object& o, unsigned bit_)
        : pin(component, function, name.c_str(), about.c_str(), options),
          slot(at),
          type(o.type),
          scale(o.scale),
          offset(o.offset),
          bit(bit_),
          range(o) {}
};

class ObjectPins {
public:
    /// Outputs are written by the one function, inputs read by the other. [setup]
    ObjectPins(const Function& shows, const Function& takes) : shows_(shows), takes_(takes) {}
    /// Declares the pins of a slot. `prefix` ends with a dot or is empty. [setup]
    void declare(Component& component, const std::string& prefix, bool to_node,
                 const config::Object& o, std::size_t slot) {
        if (!o.bit_pins.empty()) {
            for (const config::BitPin& b : o.bit_pins) {
                add<bool>(component, prefix + b.name, o.about + ", bit " + std::to_string(b.bit),
                          to_node, o, slot, b.bit, in_bits_, out_bits_);
            }
            if (to_node) {
                with_bits_.push_back(slot);
            }
            return;
        }
        const std::string name = prefix + o.pin;
        switch (o.as) {
        case config::PinType::bit:
            add<bool>(component, name, o.about, to_node, o, slot, whole, in_bits_, out_bits_);
            break;
        case config::PinType::u32:
            add<std::uint32_t>(component, name, o.about, to_node, o, slot, 0, in_u32_, out_u32_);
            break;
        case config::PinType::s64:
            add<std::int64_t>(component, name, o.about, to_node, o, slot, 0, in_s64_, out_s64_);
            break;
        case config::PinType::u64:
            add<std::uint64_t>(component, name, o.about, to_node, o, slot, 0, in_u64_, out_u64_);
            break;
        case config::PinType::real:
            add<double>(component, name, o.about, to_node, o, slot, 0, in_real_, out_real_);
            break;
        case config::PinType::s32:
        case config::PinType::none:
            add<std::int32_t>(component, name, o.about, to_node, o, slot, 0, in_s32_, out_s32_);
            break;
        }
    }

    /// [realtime]
    void show(Runner& runner) noexcept {
        show(runner.slots(), [&runner](const Slot& s) noexcept {
            return s.has_safe && !runner.operational(s.node);
        });
    }
    /// Shows the safe values of all nodes, and the last ones of objects without. [realtime]
    void show_safe(Runner& runner) noexcept {
        show(runner.slots(), [](const Slot& s) noexcept { return s.has_safe; });
    }

    /// [realtime]
    void take(Runner& runner) noexcept {
        const auto slots = runner.slots();
        for (const std::size_t n : with_bits_) {
            slots[n].wish = 0;
        }
        for (auto& b : in_bits_) {
            if (b.bit == whole) {
                slots[b.slot].wish = b.pin ? 1 : 0;
            } else {
                slots[b.slot].wish |= std::uint64_t{b.pin.get()} << b.bit;
            }
        }
        for (auto& b : in_real_) {
            const double value = b.pin * b.scale + b.offset;
            if (std::isnan(value)) {
                continue;  // the last one stays
            }
            slots[b.slot].wish = whole_or_real(b, value);
        }
        const auto integers = [&](auto& pins) noexcept {
            for (auto& b : pins) {
                const auto value = b.pin.get();
                if (is_real(b.type)) {
                    slots[b.slot].wish = whole_or_real(b, static_cast<double>(value));
                } else {
                    slots[b.slot].wish = cut_to(b.range, value);
                }
            }
        };
        integers(in_s32_);
        integers(in_u32_);
        integers(in_s64_);
        integers(in_u64_);
    }

private:
    static constexpr unsigned whole = 64;

    /// Sets the output pins; `is_safe` selects the slots that have their safe value. [realtime]
    template <class Slots, class IsSafe>
    void show(Slots slots, IsSafe is_safe) noexcept {
        const auto raw = [&](std::size_t n) noexcept {
            const Slot& s = slots[n];
            return is_safe(s) ? s.safe : number_in(*s.entry);
        };
        for (auto& b : out_bits_) {
            b.pin = b.bit == whole ? raw(b.slot) != 0 : (raw(b.slot) >> b.bit & 1) != 0;
        }
        for (auto& b : out_real_) {
            b.pin = (real_of(b.type, raw(b.slot)) - b.offset) / b.scale;
        }
        const auto integers = [&](auto& pins) noexcept {
            for (auto& b : pins) {
                using T = decltype(b.pin.get());
                b.pin = is_real(b.type) ? static_cast<T>(cut<T>(real_of(b.type, raw(b.slot))))
                                        : static_cast<T>(raw(b.slot));
            }
        };
        integers(out_s32_);
        integers(out_u32_);
        integers(out_s64_);
        integers(out_u64_);
    }

    template <class T, class Ins, class Outs>
    void add(Component& component, const std::string& name, const std::string& about, bool to_node,
             const config::Object& o, std::size_t slot, unsigned bit, Ins& ins, Outs& outs) {
        hal::PinOptions<T> options;
        options.unit = o.unit.c_str();
        if (to_node) {
            ins.emplace_back(component, takes_, name, about, options, slot, o, bit);
        } else {
            outs.emplace_back(component, shows_, name, about, options, slot, o, bit);
        }
    }
    template <class T>
    static double cut(double value) noexcept {
        if (std::isnan(value)) return 0;
        constexpr auto high = std::numeric_limits<T>::max();
        const double most = sizeof(T) < 8 ? static_cast<double>(high)
                                          : std::nextafter(static_cast<double>(high), 0.0);
        return std::clamp(value, static_cast<double>(std::numeric_limits<T>::min()), most);
    }
    template <class T>
    static std::uint64_t cut_to(const Range& range, T value) noexcept {
        if constexpr (std::is_signed_v<T>) {
            if (value < range.least) return static_cast<std::uint64_t>(range.least);
            if (value < 0) {
                return static_cast<std::uint64_t>(std::int64_t{value});
            }
        }
        return std::min(static_cast<std::uint64_t>(value), range.most);
    }
    template <class B>
    static std::uint64_t whole_or_real(const B& b, double value) noexcept {
        std::uint64_t raw = 0;
        if (b.type == Type::real32) {
            store(&raw, static_cast<float>(value));
        } else if (b.type == Type::real64) {
            store(&raw, value);
        } else if (value < 0) {
            raw = static_cast<std::uint64_t>(
                static_cast<std::int64_t>(std::nearbyint(std::max(value, b.range.low))));
        } else {
            raw = static_cast<std::uint64_t>(std::nearbyint(std::min(value, b.range.high)));
        }
        return raw;
    }

    const Function& shows_;
    const Function& takes_;
    // Deques: a pin may not move once it is declared.
    std::deque<Bound<hal::In<bool>>> in_bits_;
    std::deque<Bound<hal::In<double>>> in_real_;
    std::deque<Bound<hal::In<std::int32_t>>> in_s32_;
    std::deque<Bound<hal::In<std::uint32_t>>> in_u32_;
    std::deque<Bound<hal::In<std::int64_t>>> in_s64_;
    std::deque<Bound<hal::In<std::uint64_t>>> in_u64_;
    std::deque<Bound<hal::Out<bool>>> out_bits_;
    std::deque<Bound<hal::Out<double>>> out_real_;
    std::deque<Bound<hal::Out<std::int32_t>>> out_s32_;
    std::deque<Bound<hal::Out<std::uint32_t>>> out_u32_;
    std::deque<Bound<hal::Out<std::int64_t>>> out_s64_;
    std::deque<Bound<hal::Out<std::uint64_t>>> out_u64_;
    std::vector<std::size_t> with_bits_;
};

/// What is known of a node.
struct NodePins {
    hal::Out<bool> online, operational, fault;
    hal::Out<std::uint32_t> state, step, error_register, emcy, emcy_count, retries, boot_result;
    hal::Out<double> age;
    hal::In<bool> restart;  // of both functions, which may therefore not be in two threads
    bool was_restart = false;
    bool is_faulty = false;
    std::uint32_t losses = 0;

    NodePins(Component& c, const Function& f, const std::string& n)
        : online(c, f, (n + ".online").c_str(), "it is heard", {.safe = false}),
          operational(c, f, (n + ".operational").c_str(), "it exchanges process data",
                      {.safe = false}),
          fault(c, f, (n + ".fault").c_str(),
                "it was lost or could not be booted, and is not operational again yet"),
          state(
              c, f, (n + ".state").c_str(),
              "its NMT state: 0 booting or unknown, 4 stopped, 5 operational, 127 pre-operational",
              {.safe = 0U}),
          step(
              c, f, (n + ".step").c_str(),
              "where the master is with it: 0 off to 13 running, 14 waiting, 15 failed, 16 stopped",
              {.safe = 0U}),
          error_register(c, f, (n + ".error-register").c_str(),
                         "error register 1001h of its newest emergency"),
          emcy(c, f, (n + ".emcy").c_str(),
               "code of its newest emergency; 0: none, or the error is gone"),
          emcy_count(c, f, (n + ".emcy-count").c_str(), "emergencies heard"),
          retries(c, f, (n + ".retries").c_str(), "boots begun again after a failure or loss"),
          boot_result(
              c, f, (n + ".boot-result").c_str(),
              "0 not finished, 1 booted, else the character of CiA 302's letter, 65 (A) to 79 (O)"),
          age(c, f, (n + ".heartbeat-age-ms").c_str(), "since its last sign of life; -1: none yet",
              {.unit = "ms"}),
          restart(c, (n + ".restart").c_str(), "rising edge: resets it and boots it anew") {}

    /// [realtime]
    void show(Runner& runner, std::size_t place, Time now) noexcept {
        const NodeStatus& s = runner.status(place);
        online = s.online;
        operational = s.operational;
        if (s.operational) {
            is_faulty = false;
        }
        fault = is_faulty;
        state = static_cast<std::uint32_t>(s.state);
        step = static_cast<std::uint32_t>(s.step);
        error_register = s.error_register;
        emcy = s.emergency.time != 0 ? s.emergency.code : 0;
        emcy_count = static_cast<std::uint32_t>(s.emergencies);
        retries = s.retries;
        if (s.result == BootResult::none) {
            boot_result = 0U;
        } else if (booted(s.result)) {
            boot_result = 1U;
        } else {
            boot_result = static_cast<std::uint32_t>(s.result);
        }
        age = s.last_heard == 0 ? -1.0 : static_cast<double>(now - s.last_heard) * 1e-6;
        if (restart && !was_restart) {
            runner.restart_node(place, now);
        }
        was_restart = restart;
    }
    /// Nothing is sent to the node. [realtime]
    void show_offline() noexcept {
        online = false;
        operational = false;
        state = 0U;
        step = 0U;
    }
};

/// Which of several flying masters leads.
struct FlyingPins {
    hal::Out<bool> active;
    hal::Out<std::uint32_t> state, master, negotiations;

    FlyingPins(Component& c, const Function& f)
        : active(c, f, "active", "this one is the NMT master", {.safe = false}),
          state(c, f, "flying-state",
                "0 off, 1 waiting, 2 asking, 3 negotiating, 4 passive, 5 active", {.safe = 0U}),
          master(c, f, "active-master", "node-id of the NMT master; 0: there is none now"),
          negotiations(c, f, "negotiations", "which of the masters is it was negotiated so often") {
    }

    /// [realtime]
    void show(const Runner& runner) noexcept {
        const FlyingMaster& flying = runner.flying();
        active = flying.active();
        state = static_cast<std::uint32_t>(flying.state());
        master = flying.master();
        negotiations = static_cast<std::uint32_t>(flying.negotiations());
    }
    /// [realtime]
    void show_offline() noexcept {
        active = false;
        state = 0U;
    }
};

/// What is known of the bus and the network on it.
struct BusPins {
    hal::Out<bool> operational, bus_off;
    hal::Out<std::uint32_t> state, nodes_operational, tx_errors, rx_errors, frames_lost,
        frames_lost_here, frames_dropped, frames_rejected, sync_count, sync_overruns;
    hal::Out<double> load;
    hal::In<bool> restart;  // of both functions, which may therefore not be in two threads
    bool was_restart = false;

    BusPins(Component& c, const Function& f)
        : operational(c, f, "operational", "all mandatory nodes are", {.safe = false}),
          bus_off(c, f, "bus-off", "the controller is off the bus, or the bus is gone"),
          state(c, f, "state", "0 off, 1 booting, 2 operational, 3 degraded, 4 stopped, 5 failed",
                {.safe = 0U}),
          nodes_operational(c, f, "nodes-operational", "how many nodes are", {.safe = 0U}),
          tx_errors(c, f, "tx-errors", "the controller's send error counter"),
          rx_errors(c, f, "rx-errors", "the controller's receive error counter"),
          frames_lost(c, f, "frames-lost",
                      "frames of others lost on the wire, where they are numbered (packed frames "
                      "on Ethernet)"),
          frames_lost_here(c, f, "frames-lost-here",
                           "received frames dropped on this computer because a queue was full"),
          frames_dropped(
              c, f, "frames-dropped",
              "own frames that were not sent: no bus, queue full, or too late for their slot"),
          frames_rejected(
              c, f, "frames-rejected",
              "frames of stations that may not send them (commands from another than the master)"),
          sync_count(c, f, "sync-count", "SYNCs sent"),
          sync_overruns(c, f, "sync-overruns",
                        "SYNCs that were due before everything of the one before was sent"),
          load(c, f, "bus-load", "share of the bus's time in use", {.unit = "%"}),
          restart(c, "restart", "rising edge: resets all nodes and boots the network anew") {}

    /// [realtime]
    void show(Runner& runner, Time now) noexcept {
        const NetworkStatus& n = runner.network();
        const can::Statistics& s = runner.link_statistics();
        operational = n.state == NetworkState::operational;
        state = static_cast<std::uint32_t>(n.state);
        nodes_operational = n.operational;
        bus_off = s.state == can::State::bus_off || s.state == can::State::down;
        tx_errors = s.send_errors;
        rx_errors = s.receive_errors;
        frames_lost = static_cast<std::uint32_t>(s.lost_on_wire);
        frames_lost_here = static_cast<std::uint32_t>(s.lost - s.lost_on_wire);
        frames_dropped = static_cast<std::uint32_t>(s.dropped + runner.withheld());
        frames_rejected = static_cast<std::uint32_t>(s.rejected);
        sync_count = static_cast<std::uint32_t>(runner.syncs());
        sync_overruns = static_cast<std::uint32_t>(runner.sync_overruns());
        load = 100.0 * s.load;
        if (restart && !was_restart) {
            runner.restart(now);
        }
        was_restart = restart;
    }
    /// Nothing is sent. [realtime]
    void show_offline() noexcept {
        operational = false;
        state = 0U;
        nodes_operational = 0U;
    }
};

}  // namespace hal::canopen
