// SPDX-License-Identifier: MIT
#include "ethercat/config/lcec_cia402.hpp"

#include <algorithm>
#include <numeric>

namespace hal::ethercat::config {

namespace {

using master::Type;
using Parameters = std::map<std::string, std::string>;

/// The parameters of the whole device.
constexpr const char* device_parameters[] = {
    "ciaChannels",        "pdoIncrement", "ciaRxPDOEntryLimit", "ciaTxPDOEntryLimit",
    "zeroBasedAxisNames", "pdoAutoflow",  "pdoLimit",           "pdoEntryLimit"};

/// How the value of an object reaches its pin.
enum class Way : std::uint8_t {
    input,   ///< in the inputs of the slave
    output,  ///< in the outputs of the slave
    object,  ///< written by SDO when the pin changes
};

/// A pin of an axis, which exists if one of the parameters is on.
struct Feature {
    const char* parameters[3];  ///< the first nullptr: always
    std::uint16_t index;
    std::uint8_t sub;
    std::uint8_t bits;
    bool is_signed;
    Way way;
    const char* pin;
};
constexpr Feature features[] = {
    {{nullptr}, 0x6041, 0, 16, false, Way::input, "cia-statusword"},
    {{"enableActualCurrent"}, 0x6078, 0, 16, true, Way::input, "actual-current"},
    {{"enableActualFollowingError"}, 0x60f4, 0, 32, false, Way::input, "actual-following-error"},
    {{"enableCSP", "enablePP"}, 0x6064, 0, 32, true, Way::input, "actual-position"},
    {{"enableActualTorque"}, 0x6077, 0, 16, true, Way::input, "actual-torque"},
    {{"enableCSP", "enableCSV", "enablePV"}, 0x606c, 0, 32, true, Way::input, "actual-velocity"},
    {{"enableActualVelocitySensor"}, 0x6069, 0, 32, true, Way::input, "actual-velocity-sensor"},
    {{"enableActualVL", "enableVL"}, 0x6044, 0, 16, true, Way::input, "actual-vl"},
    {{"enableActualVoltage"}, 0x6079, 0, 32, false, Way::input, "actual-voltage"},
    {{"enableControlEffort"}, 0x60fa, 0, 32, true, Way::input, "control-effort"},
    {{"enableErrorCode"}, 0x603f, 0, 16, false, Way::input, "error-code"},
    {{"enableOpmode"}, 0x6061, 0, 8, true, Way::input, "opmode-display"},
    {{"enablePositionDemand"}, 0x6062, 0, 32, true, Way::input, "position-demand"},
    {{"enableProbeStatus"}, 0x60b9, 0, 16, false, Way::input, "probe-status"},
    {{"enableTorqueDemand"}, 0x6074, 0, 16, true, Way::input, "torque-demand"},
    {{"enableVelocityDemand"}, 0x606b, 0, 32, true, Way::input, "velocity-demand"},
    {{"enableVLDemand", "enableVL"}, 0x6043, 0, 16, true, Way::input, "vl-demand"},
    {{"enableDigitalInput"}, 0x60fd, 0, 32, false, Way::input, "din"},
    {{nullptr}, 0x6040, 0, 16, false, Way::output, "cia-controlword"},
    {{"enableOpmode"}, 0x6060, 0, 8, true, Way::output, "opmode"},
    {{"enableProfileVelocity"}, 0x6081, 0, 32, false, Way::output, "profile-velocity"},
    {{"enableCSP", "enablePP"}, 0x607a, 0, 32, true, Way::output, "target-position"},
    {{"enableTargetTorque"}, 0x6071, 0, 16, true, Way::output, "target-torque"},
    {{"enableCSV", "enablePV"}, 0x60ff, 0, 32, true, Way::output, "target-velocity"},
    {{"enableTargetVL", "enableVL"}, 0x6042, 0, 16, true, Way::output, "target-vl"},
    {{"enableDigitalOutput"}, 0x60fe, 1, 32, false, Way::output, "dout"},
    {{"enableFollowingErrorTimeout"}, 0x6066, 0, 16, false, Way::object, "following-error-timeout"},
    {{"enableFollowingErrorWindow"}, 0x6065, 0, 32, false, Way::object, "following-error-window"},
    {{"enableHomeAccel"}, 0x609a, 0, 32, false, Way::object, "home-accel"},
    {{"enableHM"}, 0x6098, 0, 8, true, Way::object, "home-method"},
    {{"enableHM"}, 0x6099, 1, 32, false, Way::object, "home-velocity-fast"},
    {{"enableHM"}, 0x6099, 2, 32, false, Way::object, "home-velocity-slow"},
    {{"enableInterpolationTimePeriod"},
     0x60c2,
     1,
     8,
     false,
     Way::object,
     "interpolation-time-period"},
    {{"enableMaximumAcceleration"}, 0x60c5, 0, 32, false, Way::object, "maximum-acceleration"},
    {{"enableMaximumCurrent"}, 0x6073, 0, 16, false, Way::object, "maximum-current"},
    {{"enableMaximumDeceleration"}, 0x60c6, 0, 32, false, Way::object, "maximum-deceleration"},
    {{"enableMaximumMotorRPM"}, 0x6080, 0, 32, false, Way::object, "maximum-motor-rpm"},
    {{"enableMaximumSlippage"}, 0x60f8, 0, 32, true, Way::object, "maximum-slippage"},
    {{"enableMaximumTorque"}, 0x6072, 0, 16, false, Way::object, "torque-maximum"},
    {{"enableMotionProfile"}, 0x6086, 0, 16, true, Way::object, "motion-profile"},
    {{"enableMotorRatedCurrent"}, 0x6075, 0, 32, false, Way::object, "motor-rated-current"},
    {{"enableMotorRatedTorque"}, 0x6076, 0, 32, false, Way::object, "motor-rated-torque"},
    {{"enablePolarity"}, 0x607e, 0, 8, false, Way::object, "polarity"},
    {{"enablePositioningTime"}, 0x6068, 0, 16, false, Way::object, "positioning-time"},
    {{"enablePositioningWindow"}, 0x6067, 0, 32, false, Way::object, "positioning-window"},
    {{"enableProfileAccel"}, 0x6083, 0, 32, false, Way::object, "profile-accel"},
    {{"enableProfileDecel"}, 0x6084, 0, 32, false, Way::object, "profile-decel"},
    {{"enableProfileEndVelocity"}, 0x6082, 0, 32, false, Way::object, "profile-end-velocity"},
    {{"enableProfileMaxVelocity"}, 0x607f, 0, 32, false, Way::object, "profile-max-velocity"},
    {{"enableTorqueProfileType"}, 0x6088, 0, 16, true, Way::object, "torque-profile-type"},
    {{"enableTorqueSlope"}, 0x6087, 0, 32, false, Way::object, "torque-slope"},
    {{"enableVelocityErrorTime"}, 0x606e, 0, 16, false, Way::object, "velocity-error-time"},
    {{"enableVelocityErrorWindow"}, 0x606d, 0, 16, false, Way::object, "velocity-error-window"},
    {{"enableVelocitySensorSelector"},
     0x606a,
     0,
     16,
     true,
     Way::object,
     "velocity-sensor-selector"},
    {{"enableVelocityThresholdTime"}, 0x6070, 0, 16, false, Way::object, "velocity-threshold-time"},
    {{"enableVelocityThresholdWindow"},
     0x606f,
     0,
     16,
     false,
     Way::object,
     "velocity-threshold-window"},
    {{"enableVLMaximum", "enableVL"}, 0x6046, 2, 32, false, Way::object, "vl-maximum"},
    {{"enableVLMinimum", "enableVL"}, 0x6046, 1, 32, false, Way::object, "vl-minimum"},
};
/// Modes that have no pins of their own.
constexpr const char* mode_parameters[] = {"enableCST", "enableIP", "enableTQ"};

/// A parameter that is written to an object of the axis.
struct Setting {
    const char* parameter;
    std::uint16_t index;
    std::uint8_t sub;
    std::uint8_t bits;
};
constexpr Setting settings[] = {
    {"positionLimitMin", 0x607b, 1, 32},
    {"positionLimitMax", 0x607b, 2, 32},
    {"swPositionLimitMin", 0x607d, 1, 32},
    {"swPositionLimitMax", 0x607d, 2, 32},
    {"homeOffset", 0x607c, 0, 32},
    {"homeMethod", 0x6098, 0, 8},
    {"quickDecel", 0x6085, 0, 32},
    {"quickStopOptionCode", 0x605a, 0, 16},
    {"shutdownOptionCode", 0x605b, 0, 16},
    {"disableOptionCode", 0x605c, 0, 16},
    {"haltOptionCode", 0x605d, 0, 16},
    {"faultOptionCode", 0x605e, 0, 16},
    {"positioningOptionCode", 0x60f2, 0, 16},
    {"connectionOptionCode", 0x6007, 0, 16},
    {"probeFunction", 0x60b8, 0, 16},
    {"probe1Positive", 0x60ba, 0, 32},
    {"probe1Negative", 0x60bb, 0, 32},
    {"probe2Positive", 0x60bc, 0, 32},
    {"probe2Negative", 0x60bd, 0, 32},
};
/// A parameter "3/4", "3:4" or "0.75", which is written to sub-indexes 1 and 2.
struct Ratio {
    const char* parameter;
    std::uint16_t index;
    std::uint8_t numerator_bits;
    std::uint8_t denominator_bits;
};
constexpr Ratio ratios[] = {
    {"vlAccel", 0x6048, 32, 16},           {"vlDecel", 0x6049, 32, 16},
    {"vlQuickStopRatio", 0x604a, 32, 16},  {"vlSetPoint", 0x604b, 16, 16},
    {"vlDimensionFactor", 0x604c, 32, 32}, {"encoderRatio", 0x608f, 32, 32},
    {"velEncoderRatio", 0x6090, 32, 32},   {"gearRatio", 0x6091, 32, 32},
    {"feedRatio", 0x6092, 32, 32},         {"eGearRatio", 0x6093, 32, 32},
};
constexpr const char* digital_inputs = "digitalInChannels";
constexpr const char* digital_outputs = "digitalOutChannels";
constexpr unsigned max_axes = 8;

/// Builds the process data and the pins of all axes.
class Cia402 {
public:
    Cia402(const Parameters& parameters, master::Slave& slave, SlaveInfo& info,
           std::vector<std::string>& problems)
        : parameters_(parameters), slave_(slave), info_(info), problems_(problems) {}

    void build() {
        axes_ = number("ciaChannels", 1, 1, max_axes);
        info_.cia402_axes = axes_;
        for (const bool output : {true, false}) {
            sync_manager(output);
        }
        for (unsigned axis = 0; axis < axes_; ++axis) {
            settings_of(axis);
            channels_of(axis);
        }
    }

private:
    /// The bits of 60FDh and 60FEh that have names.
    static constexpr const char* input_names[] = {"negative-limit", "positive-limit", "home",
                                                  "interlock"};

    void sync_manager(bool output) {
        master::SyncManager sm;
        sm.number = output ? 2 : 3;
        sm.output = output;
        sm.write_assignment = true;
        const unsigned increment = number("pdoIncrement", 1, 1, 64);
        const unsigned limit = entry_limit(output);
        const unsigned first = output ? 0x1600U : 0x1a00U;
        const unsigned step = is_on("pdoAutoflow", false) ? increment : 1;
        for (unsigned axis = 0; axis < axes_; ++axis) {
            const std::vector<master::Entry> objects = entries_of(axis, output);
            unsigned index = first + axis * increment;
            for (std::size_t i = 0; i < objects.size(); index += step) {
                master::Pdo p;
                p.index = static_cast<std::uint16_t>(index);
                p.write_mapping = true;
                for (unsigned n = 0; n < limit && i < objects.size(); ++n, ++i) {
                    p.entries.push_back(objects[i]);
                }
                if (index >= first + (axis + 1) * increment && axis + 1 < axes_) {
                    problems_.push_back("axis " + std::to_string(axis + 1) +
                                        " needs more PDOs than pdoIncrement leaves; raise "
                                        "pdoIncrement or the entry limit");
                }
                sm.pdos.push_back(std::move(p));
            }
        }
        slave_.sync_managers.push_back(std::move(sm));
    }
    /// Returns how many objects a PDO has. The next PDO has the rest.
    unsigned entry_limit(bool output) {
        if (is_on("pdoAutoflow", false)) return number("pdoEntryLimit", 254, 1, 254);
        return number(output ? "ciaRxPDOEntryLimit" : "ciaTxPDOEntryLimit", 8, 1, 254);
    }

    std::string prefix(unsigned axis) {
        if (axes_ == 1) return "srv-";
        const unsigned first = is_on("zeroBasedAxisNames", false) ? 0 : 1;
        return "srv-" + std::to_string(axis + first) + "-";
    }
    static std::uint16_t of_axis(std::uint16_t index, unsigned axis) {
        return static_cast<std::uint16_t>(index + 0x800 * axis);
    }
    static bool is_digital(const Feature& f) { return f.index == 0x60fd || f.index == 0x60fe; }

    std::vector<master::Entry> entries_of(unsigned axis, bool output) {
        std::vector<master::Entry> entries;
        for (const Feature& f : features) {
            if (f.way == Way::object || (f.way == Way::output) != output || !has(f, axis)) {
                continue;
            }
            master::Entry e;
            e.index = of_axis(f.index, axis);
            e.sub = f.sub;
            e.bits = f.bits;
            e.is_signed = f.is_signed;
            e.type = type_of(f.bits, f.is_signed);
            if (!is_digital(f)) {
                e.name = prefix(axis) + f.pin;
                add_pin(e.name, e.index, e.sub);
            }
            entries.push_back(std::move(e));
        }
        return entries;
    }
    void add_pin(const std::string& name, std::uint16_t index, std::uint8_t sub) {
        info_.pins.push_back({name, {"", object_text(index, sub)}});
    }

    /// Adds the pins that are not entries of the process data.
    void channels_of(unsigned axis) {
        Channel modes;
        modes.kind = "drive-modes";
        modes.name = prefix(axis);
        modes.name.pop_back();
        modes.objects["object"] = {of_axis(0x6502, axis), 0, 0, 0};
        info_.channels.push_back(std::move(modes));
        for (const Feature& f : features) {
            if (!has(f, axis)) continue;
            const ChannelObject object{of_axis(f.index, axis), f.sub, 0, 0};
            if (f.way == Way::object) {
                Channel pin;
                pin.kind = "object-pin";
                pin.name = prefix(axis) + f.pin;
                pin.objects["object"] = object;
                pin.settings = {{"bits", f.bits}, {"signed", f.is_signed ? 1 : 0}};
                add_pin(pin.name, object.index, object.sub);
                info_.channels.push_back(std::move(pin));
            }
            if (f.index == 0x60fd) {
                digital(axis, object, "din-", "in", axis_number(digital_inputs, axis));
            }
            if (f.index == 0x60fe) {
                digital(axis, object, "dout-", "out", axis_number(digital_outputs, axis));
            }
        }
    }
    void digital(unsigned axis, ChannelObject object, const std::string& kind, const char* role,
                 unsigned count) {
        const auto add = [&](const std::string& name, unsigned bit) {
            Channel pin;
            pin.kind = role == std::string_view("in") ? "din" : "dout";
            pin.name = prefix(axis) + kind + name;
            object.first_bit = bit;
            object.bits = 1;
            pin.objects[role] = object;
            pin.settings["invert"] = 0;
            add_pin(pin.name, object.index, object.sub);
            info_.channels.push_back(std::move(pin));
        };
        if (role == std::string_view("in")) {
            for (unsigned bit = 0; bit < std::size(input_names); ++bit) {
                add(input_names[bit], bit);
            }
        } else {
            add("brake", 0);
        }
        for (unsigned n = 0; n < count; ++n) {
            add(std::to_string(n), 16 + n);
        }
    }

    void settings_of(unsigned axis) {
        for (const Setting& s : settings) {
            const std::string* const value = find(s.parameter, axis);
            if (value == nullptr) continue;
            const auto number = parse_real(*value);
            if (!number) {
                invalid(s.parameter, *value, "a number");
                continue;
            }
            write(of_axis(s.index, axis), s.sub, s.bits, std::int64_t(*number));
        }
        for (const Ratio& r : ratios) {
            const std::string* const value = find(r.parameter, axis);
            if (value == nullptr) continue;
            const auto ratio = fraction(*value, r.denominator_bits == 16 ? 1 << 14 : 1 << 30);
            if (!ratio) {
                invalid(r.parameter, *value, "a ratio such as 3/4");
                continue;
            }
            write(of_axis(r.index, axis), 1, r.numerator_bits, ratio->first);
            write(of_axis(r.index, axis), 2, r.denominator_bits, ratio->second);
        }
    }
    /// Parses "3/4", "3:4" or a number, which becomes a fraction.
    static std::optional<std::pair<std::int64_t, std::int64_t>> fraction(
        const std::string& text, std::int64_t max_denominator) {
        const std::size_t separator = text.find_first_of("/:");
        if (separator != std::string::npos) {
            const auto above = parse_natural(trimmed(std::string_view(text).substr(0, separator)));
            const auto below = parse_natural(trimmed(std::string_view(text).substr(separator + 1)));
            if (!above || !below || *below == 0) return {};
            return std::pair{static_cast<std::int64_t>(*above), static_cast<std::int64_t>(*below)};
        }
        const auto value = parse_real(text);
        if (!value) return {};
        std::int64_t below = 1;
        while (below < max_denominator / 10 &&
               *value * static_cast<double>(below) !=
                   static_cast<double>(std::int64_t(*value * static_cast<double>(below)))) {
            below *= 10;
        }
        const auto above = static_cast<std::int64_t>(*value * static_cast<double>(below));
        const std::int64_t common = std::max<std::int64_t>(1, std::gcd(above, below));
        return std::pair{above / common, below / common};
    }
    void write(std::uint16_t index, std::uint8_t sub, unsigned bits, std::int64_t value) {
        master::StartupWrite w;
        w.index = index;
        w.sub = sub;
        w.line = slave_.line;
        w.data = little_endian(static_cast<std::uint64_t>(value), bits);
        slave_.startup.push_back(std::move(w));
    }

    /// Returns the value for an axis: that of `ch1NAME`, or of NAME.
    const std::string* find(const std::string& name, unsigned axis) const {
        const auto own = parameters_.find("ch" + std::to_string(axis + 1) + name);
        if (own != parameters_.end()) return &own->second;
        const auto common = parameters_.find(name);
        return common == parameters_.end() ? nullptr : &common->second;
    }
    bool has(const Feature& f, unsigned axis) {
        if (f.parameters[0] == nullptr) return true;
        return std::any_of(std::begin(f.parameters), std::end(f.parameters), [&](const char* p) {
            if (p == nullptr) return false;
            const std::string_view name = p;
            return is_on(p, name == "enablePV" || name == "enableOpmode", axis);
        });
    }
    bool is_on(const char* name, bool otherwise, unsigned axis = 0) {
        const std::string* const value = find(name, axis);
        if (value == nullptr) return otherwise;
        for (const char* word : {"1", "true", "enabled"}) {
            if (same_word(*value, word)) return true;
        }
        for (const char* word : {"0", "false", "disabled"}) {
            if (same_word(*value, word)) return false;
        }
        invalid(name, *value, "true or false");
        return otherwise;
    }
    unsigned axis_number(const char* name, unsigned axis) {
        const std::string* const value = find(name, axis);
        return value == nullptr ? 16 : number_of(name, *value, 16, 0, 16);
    }
    unsigned number(const char* name, unsigned otherwise, unsigned min, unsigned max) {
        const std::string* const value = find(name, 0);
        return value == nullptr ? otherwise : number_of(name, *value, otherwise, min, max);
    }
    unsigned number_of(const char* name, const std::string& text, unsigned otherwise, unsigned min,
                       unsigned max) {
        if (const auto n = parse_natural(text); n && *n >= min && *n <= max) {
            return static_cast<unsigned>(*n);
        }
        invalid(name, text, std::to_string(min) + ".." + std::to_string(max));
        return otherwise;
    }
    void invalid(const std::string& name, const std::string& value, const std::string& expected) {
        problems_.push_back("invalid value '" + value + "' of modParam '" + name + "': expected " +
                            expected);
    }

    const Parameters& parameters_;
    master::Slave& slave_;
    SlaveInfo& info_;
    std::vector<std::string>& problems_;
    unsigned axes_ = 1;
};

}  // namespace

std::vector<std::string> cia402_parameters() {
    std::vector<std::string> of_axis;
    const auto add = [&](const char* name) {
        if (std::find(of_axis.begin(), of_axis.end(), name) == of_axis.end()) {
            of_axis.emplace_back(name);
        }
    };
    for (const Feature& f : features) {
        for (const char* name : f.parameters) {
            if (name != nullptr) {
                add(name);
            }
        }
    }
    std::for_each(std::begin(mode_parameters), std::end(mode_parameters), add);
    for (const Setting& s : settings) {
        add(s.parameter);
    }
    for (const Ratio& r : ratios) {
        add(r.parameter);
    }
    add(digital_inputs);
    add(digital_outputs);
    std::vector<std::string> all(std::begin(device_parameters), std::end(device_parameters));
    all.insert(all.end(), of_axis.begin(), of_axis.end());
    for (unsigned axis = 1; axis <= max_axes; ++axis) {
        for (const std::string& name : of_axis) {
            all.push_back("ch" + std::to_string(axis) + name);
        }
    }
    return all;
}

void build_cia402(const std::map<std::string, std::string>& parameters, master::Slave& slave,
                  SlaveInfo& info, std::vector<std::string>& problems) {
    Cia402(parameters, slave, info, problems).build();
    std::sort(problems.begin(), problems.end());
    problems.erase(std::unique(problems.begin(), problems.end()), problems.end());
}

}  // namespace hal::ethercat::config
