// SPDX-License-Identifier: MIT
// Writes a netlist to start from: the master, an axis for each drive of CiA 402, and the pins that
// are left.
#include <set>

#include "bus/config/object_address.hpp"
#include "ethercat/config/config.hpp"

namespace hal::ethercat::config {

namespace {

using master::Entry;
using master::Type;

/// Pins that a drive on the bus and the component cia402 have under the same name.
constexpr const char* drive_inputs[] = {"statusword",
                                        "modes-of-operation-display",
                                        "position-actual-value",
                                        "velocity-actual-value",
                                        "torque-actual-value",
                                        "error-code",
                                        "touch-probe-status",
                                        "touch-probe-1-positive-edge",
                                        "touch-probe-1-negative-edge",
                                        "touch-probe-2-positive-edge",
                                        "touch-probe-2-negative-edge"};
constexpr const char* drive_outputs[] = {
    "controlword",          "modes-of-operation",   "target-position",     "target-velocity",
    "target-torque",        "velocity-offset",      "torque-offset",       "profile-velocity",
    "profile-acceleration", "profile-deceleration", "touch-probe-function"};

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
        for_each_pin(slave, [&](bool, const Entry& e) {
            if (!e.copied) {
                mapped_.insert(e.name);
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
        for (const char* pin : drive_inputs) {
            if (has(pin)) {
                text += net(name_ + "-" + pin, from_bus(pin, linked), name_ + "." + pin);
            }
        }
        for (const char* pin : drive_outputs) {
            if (has(pin)) {
                text += net(name_ + "-" + pin, name_ + "." + pin, from_bus(pin, linked));
            }
        }
        return text + "setp " + name_ + ".enable FALSE           # TRUE switches the axis on\n\n";
    }

private:
    bool has(const char* pin) const { return mapped_.count(prefix_ + pin) != 0; }
    std::string from_bus(const char* pin, std::set<std::string>& linked) const {
        linked.insert(bus_ + prefix_ + pin);
        return bus_ + prefix_ + pin;
    }
    std::string net(const std::string& signal, const std::string& from,
                    const std::string& to) const {
        return "net " + padded(signal, name_.size() + 28) +
               padded(from, bus_.size() + prefix_.size() + 26) + " => " + to + "\n";
    }

    std::string name_, slave_;
    bool first_;
    std::string bus_, prefix_;
    std::set<std::string> mapped_;
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

std::string netlist(const Bus& bus, const std::string& file, const std::string& segment) {
    std::vector<Axis> axes;
    for (std::size_t n = 0; n < bus.slaves.size(); ++n) {
        for (unsigned axis = 0; axis < bus.slaves[n].cia402_axes; ++axis) {
            if (Axis one(bus.setup.slaves[n], axis, bus.slaves[n].cia402_axes); one.complete()) {
                axes.push_back(std::move(one));
            }
        }
    }

    std::string text = "# The master of " + file +
                       " and what is on its bus: a start. See docs/ethercat-configuration.md.\n\n"
                       "loadrt threads name1=servo-thread period1=" +
                       std::to_string(bus.setup.cycle_ns) + "\n\n";
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
    text += "\n";

    std::set<std::string> linked;
    for (const Axis& axis : axes) {
        text += axis.lines(linked);
    }
    std::string others;
    for (const auto& slave : bus.setup.slaves) {
        for_each_pin(slave, [&](bool output, const Entry& e) {
            if (linked.count("ethercat.0." + slave.name + "." + e.pin_name()) == 0) {
                others += "#   " + pin_line(e, output, "ethercat.0." + slave.name);
            }
        });
    }
    if (!others.empty()) {
        text += "# Pins that are not linked yet. in: written by the netlist, out: read by it\n" +
                others + "\n";
    }

    text += "addf ethercat.0.receive servo-thread\n";
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
    return text + "\nstart\n";
}

}  // namespace hal::ethercat::config
