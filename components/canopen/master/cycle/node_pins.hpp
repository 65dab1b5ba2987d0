// SPDX-License-Identifier: MIT
// Objects as pins. Declared in the component's constructor; the cycle moves numbers only.
#pragma once

#include <atomic>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "hal/age.hpp"
#include "hal/any_pin.hpp"
#include "hal/pin_codec.hpp"
#include "runner.hpp"

namespace hal::canopen {

class ObjectPins {
public:
    /// Outputs are written by the one function, inputs read by the other. [setup]
    ObjectPins(const Function& receive, const Function& transmit)
        : receive_(receive), transmit_(transmit) {}
    /// Declares the pins of a slot. `prefix` ends with a dot or is empty. [setup]
    void declare(Component& component, const std::string& prefix, bool to_node,
                 const config::Object& o, std::size_t slot) {
        const auto add = [&](hal_type type, const std::string& name, const std::string& about,
                             const Bound& bound) {
            if (to_node) {
                ins_.declare(component, &transmit_, type, prefix + name, about, bound,
                             {.unit = o.unit.c_str()});
            } else {
                outs_.declare(component, &receive_, type, prefix + name, about, bound,
                              {.unit = o.unit.c_str(), .safe = safe_value(type, o, bound)});
            }
        };
        const bool may_be_invalid = to_node ? o.as == config::PinType::real : is_real(o.type);
        if (may_be_invalid && !invalid_) {
            invalid_ = std::make_unique<Out<std::uint32_t>>(
                component, receive_, "invalid",
                "real values that are not finite, of nodes and of input pins, counted in each "
                "cycle: the pin or the object keeps the last finite value");
        }
        for (const config::BitPin& b : o.bit_pins) {
            add(HAL_TYPE_BIT, b.name, o.about + ", bit " + std::to_string(b.bit),
                {slot, codec_of(o), std::uint64_t{1} << b.bit, std::uint64_t{1} << b.bit});
        }
        if (o.bit_pins.empty()) {
            add(type_of(o.as), o.pin, o.about,
                {slot, codec_of(o), 1, ~std::uint64_t{0}, o.scale, o.offset});
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

    /// Copies input pins to the objects of the nodes. Returns whether a pin is not finite: its
    /// object keeps the last value. [realtime]
    bool transmit(Runner& runner) noexcept {
        std::uint32_t invalid = 0;
        ins_.each(
            [slots = runner.slots(), &invalid]<class T>(const In<T>& pin, const Bound& b) noexcept {
            std::uint64_t& output = slots[b.slot].output;
            if constexpr (std::is_same_v<T, bool>) {
                output = (output & ~b.mask) | (pin ? b.high : 0);
            } else if constexpr (std::is_same_v<T, double>) {
                const double value = pin * b.scale + b.offset;
                if (!std::isfinite(value)) {
                    ++invalid;
                    return;  // the last one stays
                }
                output = b.codec.encode(value);
            } else {
                output = b.codec.encode(pin.get());
            }
        });
        transmitted_invalid_.fetch_add(invalid, std::memory_order_relaxed);
        return invalid != 0;
    }

private:
    /// A pin's part of an object.
    struct Bound {
        std::size_t slot;
        PinCodec codec;
        std::uint64_t high;  ///< of a bit: what TRUE is
        std::uint64_t mask;  ///< of a bit: what the pin writes
        double scale = 1.0;
        double offset = 0.0;
    };

    /// Sets the output pins; `is_safe` selects the slots that have their safe value. A value that
    /// is not finite leaves its pin. [realtime]
    template <class Slots, class IsSafe>
    void show(Slots slots, IsSafe is_safe) noexcept {
        std::uint32_t invalid = 0;
        outs_.each([slots, is_safe, &invalid]<class T>(Out<T>& pin, const Bound& b) noexcept {
            const Slot& s = slots[b.slot];
            const T value = value_of<T>(is_safe(s) ? s.safe : number_in(*s.entry), b);
            if constexpr (std::is_same_v<T, double>) {
                if (!std::isfinite(value)) {
                    ++invalid;
                    return;
                }
            }
            pin = value;
        });
        invalid += transmitted_invalid_.exchange(0, std::memory_order_relaxed);
        if (invalid_ && invalid != 0) {
            *invalid_ = *invalid_ + invalid;
        }
    }

    /// Returns the value of a pin from that of its object. [realtime]
    template <class T>
    static T value_of(std::uint64_t raw, const Bound& b) noexcept {
        if constexpr (std::is_same_v<T, bool>) {
            return (raw & b.mask) != 0;
        } else if constexpr (std::is_same_v<T, double>) {
            return (b.codec.decode<T>(raw) - b.offset) / b.scale;
        } else {
            return b.codec.decode<T>(raw);
        }
    }
    /// Returns the value that a pin gets when its thread stops; none if the object has no safe
    /// value. [setup]
    static std::optional<hal_value> safe_value(hal_type type, const config::Object& o,
                                               const Bound& b) {
        std::optional<hal_value> safe;
        if (o.safe) {
            visit_type(type, [&]<class T>(std::type_identity<T>) {
                safe = to_value<T>(value_of<T>(*o.safe, b));
            });
        }
        return safe;
    }

    static PinCodec codec_of(const config::Object& o) noexcept {
        using Format = PinCodec::Format;
        const unsigned bits = o.bits == 0 || o.bits > 64 ? 64 : o.bits;
        if (is_real(o.type)) return {Format::real, o.type == Type::real32 ? 32U : 64U};
        return {is_signed(o.type) ? Format::signed_integer : Format::unsigned_integer, bits};
    }
    static hal_type type_of(config::PinType type) noexcept {
        switch (type) {
        case config::PinType::bit: return HAL_TYPE_BIT;
        case config::PinType::u32: return HAL_TYPE_U32;
        case config::PinType::s64: return HAL_TYPE_S64;
        case config::PinType::u64: return HAL_TYPE_U64;
        case config::PinType::real: return HAL_TYPE_FLOAT;
        case config::PinType::s32:
        case config::PinType::none: break;
        }
        return HAL_TYPE_S32;
    }

    const Function& receive_;
    const Function& transmit_;
    AnyIns<Bound> ins_;
    AnyOuts<Bound> outs_;
    std::unique_ptr<Out<std::uint32_t>> invalid_;  // if there are real values
    // counted by transmit(), added to the pin by show()
    std::atomic<std::uint32_t> transmitted_invalid_{0};
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
          operational(c, f, (n + ".operational").c_str(),
                      "it exchanges process data, and none of its TPDOs is late", {.safe = false}),
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
          age(c, f, (n + ".heartbeat-age-ms").c_str(),
              "since its last sign of life; infinite: none yet, or the thread is stopped",
              {.initial = infinite_age, .unit = "ms", .safe = infinite_age}),
          restart(c, (n + ".restart").c_str(), "rising edge: resets it and boots it anew") {}

    /// [realtime]
    void show(Runner& runner, std::size_t position, Time now) noexcept {
        const NodeStatus& s = runner.status(position);
        online = s.online;
        operational = runner.operational(position);
        if (operational) {
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
        age = s.last_heard == 0 ? infinite_age : static_cast<double>(now - s.last_heard) * 1e-6;
        if (restart && !was_restart) {
            runner.restart_node(position, now);
        }
        was_restart = restart;
    }
    /// Nothing is sent to the node. [realtime]
    void show_offline() noexcept {
        online = false;
        operational = false;
        state = 0U;
        step = 0U;
        age = infinite_age;
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
        operational = n.state == NetworkState::operational && !runner.any_late();
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
