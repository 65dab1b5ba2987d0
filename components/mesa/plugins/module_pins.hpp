// SPDX-License-Identifier: MIT
// The pins of a kind of module, as the component sees them.
#pragma once

#include <cstdio>
#include <string>

#include "hal/component.hpp"
#include "mesa/driver/card_image.hpp"
#include "mesa/driver/outgoing.hpp"
#include "mesa/driver/read_layout.hpp"

namespace hal::mesa {

/// The component and its functions, while pins are declared.
struct PinOwner {
    hal::Component& component;
    const hal::Function& read;
    const hal::Function& write;
};

/// What a cycle knows beside the answer.
struct Reading {
    double period_s = 0.0;
    double age_s = 0.0;  ///< of the answer, until now
    bool is_after_gap = false;  ///< the card was lost, or the thread stopped, before this answer
    double gap_s = 0.0;  ///< how long the card was lost
    bool has_bitten = false;  ///< its outputs are off
    bool has_lost_power = false;  ///< all registers begin anew
    bool is_after_reset = false;  ///< outputs were off: step generators do not continue
    bool writes_arrived = false;  ///< it shows that the card has the newest writes
};

/// What a cycle writes.
struct Writing {
    double period_s = 0.0;
    bool outputs_on = false;  ///< false: everything is off
    bool may_set_outputs = false;  ///< the newest answer shows that the watchdog has not bitten
    bool may_move = false;  ///< an answer has confirmed that the pins of modules are outputs
};

/// Declared in the constructor of the component, then used by its functions.
class ModulePins {
public:
    virtual ~ModulePins() = default;
    ModulePins() = default;
    ModulePins(const ModulePins&) = delete;
    ModulePins& operator=(const ModulePins&) = delete;

    /// Adds what a cycle reads. [setup]
    virtual void plan(ReadLayout&) {}
    /// Shows an answer. [realtime] read
    virtual void receive(const Reply&, const Reading&) noexcept {}
    /// Called in a cycle without an answer. [realtime] read
    virtual void miss(double /*period_s*/) noexcept {}
    /// [realtime] write
    virtual void transmit(Outgoing&, const Writing&) noexcept {}
    /// Writes what stops all movement, once: to a card that is left alone from then on. [setup]
    virtual void stop(Outgoing&) const {}
    /// That has been sent. [realtime] read
    virtual void has_stopped() noexcept {}
};

/// Returns "PREFIX.NN.NAME". [setup]
inline std::string pin_name(const char* prefix, unsigned unit, const char* name) {
    char text[96];
    std::snprintf(text, sizeof text, "%s.%02u.%s", prefix, unit, name);
    return text;
}

}  // namespace hal::mesa
