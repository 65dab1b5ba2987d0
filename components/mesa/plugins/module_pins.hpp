// SPDX-License-Identifier: MIT
// The pins of a kind of module, as the component sees them.
#pragma once

#include <cstdarg>
#include <cstdio>
#include <string>
#include <vector>

#include "bus/component/working_set.hpp"
#include "hal/component.hpp"
#include "mesa/driver/card_image.hpp"
#include "mesa/driver/outgoing.hpp"
#include "mesa/driver/read_layout.hpp"

namespace hal::mesa {

using bus::place;
using bus::Placed;

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
    double pause_s = 0.0;  ///< how long the thread stood, or read was not in it
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

/// Returns a name made by a format of printf, valid until the next call in this thread: longer than
/// the declaration of a pin. [setup]
[[gnu::format(printf, 1, 2)]] inline const char* brief_name(const char* format, ...) {
    static thread_local char text[96];
    va_list values;
    va_start(values, format);
    std::vsnprintf(text, sizeof text, format, values);
    va_end(values);
    return text;
}

/// Declares the units of a module that are used. [setup]
template <class Unit>
std::vector<Placed<Unit>> make_units(const PinOwner& o, const CardModule& module) {
    std::vector<Placed<Unit>> units;
    for (unsigned unit = 0; unit < module.used; ++unit) {
        units.push_back(place<Unit>(o, unit, module));
    }
    return units;
}

/// Calls `report(n)` for each unit whose `member()` returns true. [realtime]
template <class Unit, class Report>
void report_each(const std::vector<Placed<Unit>>& units, bool (Unit::*member)() noexcept,
                 Report&& report) noexcept {
    for (std::size_t n = 0; n < units.size(); ++n) {
        if (((*units[n]).*member)()) {
            report(n);
        }
    }
}

}  // namespace hal::mesa
