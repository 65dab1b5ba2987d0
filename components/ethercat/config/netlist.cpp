// SPDX-License-Identifier: MIT
// Writes a netlist to start from: the master, an axis for each drive of CiA 402, and the pins that
// are left.
#include <algorithm>
#include <map>
#include <set>

#include "bus/config/object_address.hpp"
#include "ethercat/config/config.hpp"

namespace hal::ethercat::config {

namespace {

using master::Entry;
using master::Type;

/// A pin that a drive on the bus and the component cia402 have under the same name.
struct DrivePin {
    const char* name;
    std::string_view type;  ///< in the component
    bool output;            ///< of the bus: the component writes it
};

constexpr DrivePin drive_pins[] = {
    {"statusword", "u32", false},
    {"modes-of-operation-display", "s32", false},
    {"position-actual-value", "s32", false},
    {"velocity-actual-value", "s32", false},
    {"torque-actual-value", "s32", false},
    {"error-code", "u32", false},
    {"touch-probe-status", "u32", false},
    {"touch-probe-1-positive-edge", "s32", false},
    {"touch-probe-1-negative-edge", "s32", false},
    {"touch-probe-2-positive-edge", "s32", false},
    {"touch-probe-2-negative-edge", "s32", false},
    {"controlword", "u32", true},
    {"modes-of-operation", "s32", true},
    {"target-position", "s32", true},
    {"target-velocity", "s32", true},
    {"target-torque", "s32", true},
    {"velocity-offset", "s32", true},
    {"torque-offset", "s32", true},
    {"profile-velocity", "u32", true},
    {"profile-acceleration", "u32", true},
    {"profile-deceleration", "u32", true},
    {"touch-probe-function", "u32", true},
};

const DrivePin& drive_pin(std::string_view name) {
    return *std::find_if(std::begin(drive_pins), std::end(drive_pins),
                         [name](const DrivePin& pin) { return pin.name == name; });
}

/// Calls `use(output, entry)` for each entry with a pin.
template <class Use>
void for_each_pin(const master::Slave& slave, Use use) {
    for (const auto& sm : slave.sync_managers) {
        for (const auto& pdo : sm.pdos) {
            for (const Entry& e : pdo.entries) {
                if (!e.name.empty()) {
                    use(sm.output, e);
                }
            }
        }
    }
}

std::string padded(std::string text, std::size_t width) {
    if (text.size() < width) {
        text.resize(width, ' ');
    }
    return text;
}

/// One drive of a slave, linked to the component cia402.
class Axis {
public:
    Axis(const master::Slave& slave, unsigned number, unsigned axes)
        : name_(axes > 1 ? slave.name + "-axis-" + std::to_string(number + 1) : slave.name),
          slave_(slave.name),
          first_(number == 0),
          bus_("ethercat.0." + slave.name + "."),
          prefix_(axes > 1 ? "axis-" + std::to_string(number + 1) + "-" : "") {
        for_each_pin(slave, [&](bool output, const Entry& e) {
            if (!e.copied) {
                mapped_.insert({e.name, {pin_type(e), output}});
            }
        });
    }
    const std::string& name() const { return name_; }
    /// Returns whether the drive can be switched on by its process data.
    bool complete() const { return has("controlword") && has("statusword"); }
    /// Returns the settings and the nets; `linked` receives the pins of the bus that they use.
    std::string lines(std::set<std::string>& linked) const {
        std::string text =
            "# --- axis " + name_ + " ---\nsetp " + name_ +
            ".position-scale 1      # counts per unit: see the manual of the drive\n";
        if (has("target-velocity")) {
            text += "setp " + name_ +
                    ".mode 9                # cyclic synchronous velocity: " + name_ +
                    ".velocity-cmd in units/s\n";
        } else if (has("target-position")) {
            text += "setp " + name_ +
                    ".mode 8                # cyclic synchronous position: " + name_ +
                    ".position-cmd in units\n"
                    "setp " +
                    name_ +
                    ".max-step 1000         # units; the axis is not enabled while position-cmd is "
                    "farther from position-fb\n";
        } else if (has("target-torque")) {
            text += "setp " + name_ +
                    ".mode 10               # cyclic synchronous torque: " + name_ +
                    ".torque-cmd\n";
        }
        text += net(slave_ + "-operational", first_ ? bus_ + "operational" : "",
                    name_ + ".operational");
        for (const DrivePin& pin : drive_pins) {
            if (!has(pin)) continue;
            const std::string signal = name_ + "-" + pin.name;
            const std::string here = name_ + "." + pin.name;
            const std::string there = bus_ + prefix_ + pin.name;
            linked.insert(there);
            text += pin.output ? net(signal, here, there) : net(signal, there, here);
        }
        return text + "setp " + name_ + ".enable FALSE           # TRUE switches the axis on\n\n";
    }

private:
    /// Type and direction of a pin of the bus.
    struct Mapped {
        std::string_view type;
        bool output;
    };
    bool has(std::string_view name) const { return has(drive_pin(name)); }
    /// Returns whether the bus has a pin that can be linked with the one of the component: a
    /// description may call objects of other types by these names.
    bool has(const DrivePin& pin) const {
        const auto found = mapped_.find(prefix_ + pin.name);
        return found != mapped_.end() && found->second.type == pin.type &&
               found->second.output == pin.output;
    }
    std::string net(const std::string& signal, const std::string& from,
                    const std::string& to) const {
        return "net " + padded(signal, name_.size() + 28) +
               padded(from, bus_.size() + prefix_.size() + 26) + " => " + to + "\n";
    }

    std::string name_, slave_;
    bool first_;
    std::string bus_, prefix_;
    std::map<std::string, Mapped> mapped_;  ///< by name
};

}  // namespace

const char* pin_type(const Entry& e) {
    if (e.scaled || e.type == Type::real32 || e.type == Type::real64) return "float";
    constexpr const char* names[] = {"bit", "u32", "u32", "u32", "u64", "s32", "s32", "s32", "s64"};
    return names[static_cast<std::size_t>(e.type)];
}

std::string pin_line(const Entry& e, bool output, const std::string& slave) {
    const std::string object = bus::object_text(e.index, e.sub).substr(2);
    return padded(output && !e.copied ? "in" : "out", 4) + padded(pin_type(e), 6) + slave + "." +
           e.pin_name() + "  " + object + "\n";
}

namespace {

/// Returns the axes of all slaves that process data can switch on.
std::vector<Axis> axes_of(const Bus& bus) {
    std::vector<Axis> axes;
    for (std::size_t n = 0; n < bus.slaves.size(); ++n) {
        const unsigned count = bus.slaves[n].cia402_axes;
        for (unsigned number = 0; number < count; ++number) {
            Axis axis(bus.setup.slaves[n], number, count);
            if (axis.complete()) {
                axes.push_back(std::move(axis));
            }
        }
    }
    return axes;
}

std::string load_lines(const Bus& bus, const std::string& file, const std::string& segment,
                       const std::vector<Axis>& axes) {
    std::string text =
        "loadrt threads name1=servo-thread period1=" + std::to_string(bus.setup.cycle_ns) + "\n\n";
    if (!segment.empty()) {
        text += "loadrt ethercat_segment devices=\"" + segment + "\" link=" + bus.link + "\n";
    }
    text += "loadrt ethercat config=" + file + "\n";
    std::string names;
    for (const Axis& axis : axes) {
        names += (names.empty() ? "" : ",") + axis.name();
    }
    if (!names.empty()) {
        text += "loadrt --native cia402 names=" + names + "\n";
    }
    return text + "\n";
}

/// Returns a comment with the pins of the master that are not in `linked`, for the user to link.
std::string unlinked_lines(const Bus& bus, const std::set<std::string>& linked) {
    std::string pins;
    for (const auto& slave : bus.setup.slaves) {
        const std::string prefix = "ethercat.0." + slave.name;
        for_each_pin(slave, [&](bool output, const Entry& e) {
            if (!linked.contains(prefix + "." + e.pin_name())) {
                pins += "#   " + pin_line(e, output, prefix);
            }
        });
    }
    if (pins.empty()) return "";
    return "# Pins that are not linked yet. in: written by the netlist, out: read by it\n" + pins +
           "\n";
}

/// Returns the functions in the order of a cycle: inputs, axes, the machine, axes, outputs.
std::string thread_lines(const std::string& segment, const std::vector<Axis>& axes) {
    std::string text = "addf ethercat.0.receive servo-thread\n";
    for (const Axis& axis : axes) {
        text += "addf " + axis.name() + ".read-all servo-thread\n";
    }
    text += "# functions of the machine: here\n";
    for (const Axis& axis : axes) {
        text += "addf " + axis.name() + ".write-all servo-thread\n";
    }
    text += "addf ethercat.0.transmit servo-thread\n";
    if (!segment.empty()) {
        text += "addf ethercat-segment.0.update servo-thread\n";
    }
    return text;
}

}  // namespace

std::string netlist(const Bus& bus, const std::string& file, const std::string& segment) {
    const std::vector<Axis> axes = axes_of(bus);
    std::string text = "# The master of " + file +
                       " and what is on its bus: a start. See docs/ethercat-configuration.md.\n\n";
    text += load_lines(bus, file, segment, axes);
    std::set<std::string> linked;
    for (const Axis& axis : axes) {
        text += axis.lines(linked);
    }
    text += unlinked_lines(bus, linked);
    text += thread_lines(segment, axes);
    return text + "\nstart\n";
}

}  // namespace hal::ethercat::config
