// SPDX-License-Identifier: MIT
#include "ethercat/config/lcec_cia402.hpp"

#include <algorithm>

namespace hal::ethercat::config {

namespace {

using master::Type;

constexpr const char* parameter_names[] = {
    "ciaChannels",        "pdoIncrement",       "ciaRxPDOEntryLimit", "ciaTxPDOEntryLimit",
    "zeroBasedAxisNames", "enablePP",           "enablePV",           "enableCSP",
    "enableCSV",          "enableHM",           "enableActualTorque", "enableActualFollowingError",
    "enableErrorCode",    "enableTargetTorque", "enableProbeStatus",  "enableDigitalInput",
    "enableDigitalOutput"};

/// A feature is on if one of the parameters is; objects are in the order of the driver.
struct Feature {
    const char* parameters[4];  ///< the first nullptr: always
    std::uint16_t index;
    std::uint8_t sub;
    Type type;
    std::uint8_t bits;
    bool output;
    const char* pin;
};
constexpr Feature features[] = {
    {{nullptr}, 0x6041, 0, Type::u16, 16, false, "cia-statusword"},
    {{"enableActualFollowingError"}, 0x60f4, 0, Type::s32, 32, false, "actual-following-error"},
    {{"enableCSP", "enablePP"}, 0x6064, 0, Type::s32, 32, false, "actual-position"},
    {{"enableActualTorque"}, 0x6077, 0, Type::s16, 16, false, "actual-torque"},
    {{"enableCSP", "enableCSV", "enablePV"}, 0x606c, 0, Type::s32, 32, false, "actual-velocity"},
    {{"enableDigitalInput"}, 0x60fd, 0, Type::u32, 32, false, "din"},
    {{"enableErrorCode"}, 0x603f, 0, Type::u16, 16, false, "error-code"},
    {{nullptr}, 0x6061, 0, Type::s8, 8, false, "opmode-display"},
    {{"enableProbeStatus"}, 0x60b9, 0, Type::u16, 16, false, "probe-status"},
    {{nullptr}, 0x6040, 0, Type::u16, 16, true, "cia-controlword"},
    {{nullptr}, 0x6060, 0, Type::s8, 8, true, "opmode"},
    {{"enableDigitalOutput"}, 0x60fe, 1, Type::u32, 32, true, "dout"},
    {{"enableHM"}, 0x6098, 0, Type::s8, 8, true, "home-method"},
    {{"enableCSP", "enablePP"}, 0x607a, 0, Type::s32, 32, true, "target-position"},
    {{"enableTargetTorque"}, 0x6071, 0, Type::s16, 16, true, "target-torque"},
    {{"enableCSV", "enablePV"}, 0x60ff, 0, Type::s32, 32, true, "target-velocity"},
};

class Cia402 {
public:
    Cia402(const std::map<std::string, std::string>& parameters, master::Slave& slave,
           SlaveInfo& info, std::vector<std::string>& problems)
        : parameters_(parameters), slave_(slave), info_(info), problems_(problems) {}

    void build() {
        const auto axes = number("ciaChannels", 1, 1, 8);

        const auto increment = number("pdoIncrement", 1, 1, 64);
        const bool zero = flag("zeroBasedAxisNames", false);
        info_.cia402_axes = axes;
        for (const bool output : {true, false}) {
            master::SyncManager sm;
            sm.number = output ? 2 : 3;
            sm.output = output;
            sm.write_assignment = true;
            const unsigned limit =
                number(output ? "ciaRxPDOEntryLimit" : "ciaTxPDOEntryLimit", 8, 1, 254);
            for (unsigned axis = 0; axis < axes; ++axis) {
                const unsigned first = zero ? 0 : 1;
                const std::string prefix =
                    axes == 1 ? "srv-" : "srv-" + std::to_string(axis + first) + "-";
                std::vector<std::vector<master::Entry>> objects;
                for (const Feature& f : features) {
                    if (f.output == output && on(f)) {
                        objects.push_back(entries(f, axis, prefix));
                    }
                }
                unsigned index = (output ? 0x1600U : 0x1a00U) + axis * increment;
                for (std::size_t i = 0; i < objects.size(); ++index) {
                    master::Pdo p;
                    p.index = static_cast<std::uint16_t>(index);
                    p.write_mapping = true;
                    for (unsigned n = 0; n < limit && i < objects.size(); ++n, ++i) {
                        for (auto& e : objects[i]) {
                            p.entries.push_back(std::move(e));
                        }
                    }
                    if (index >= (output ? 0x1600U : 0x1a00U) + (axis + 1) * increment &&
                        axis + 1 < axes) {
                        problems_.push_back("axis " + std::to_string(axis + 1) +
                                            " needs more PDOs than pdoIncrement leaves; raise "
                                            "pdoIncrement or the entry limit");
                    }
                    sm.pdos.push_back(std::move(p));
                }
            }
            slave_.sync_managers.push_back(std::move(sm));
        }
    }

private:
    const std::string* find(const char* name) const {
        const auto at = parameters_.find(name);
        return at == parameters_.end() ? nullptr : &at->second;
    }
    bool flag(const char* name, bool otherwise) {
        const std::string* value = find(name);
        if (value == nullptr) return otherwise;
        for (const char* word : {"1", "true", "enabled"}) {
            if (same_word(*value, word)) return true;
        }
        for (const char* word : {"0", "false", "disabled"}) {
            if (same_word(*value, word)) return false;
        }
        problems_.push_back("invalid value '" + *value + "' of modParam '" + name +
                            "': expected true or false");
        return otherwise;
    }
    unsigned number(const char* name, unsigned otherwise, unsigned least, unsigned most) {
        const std::string* value = find(name);
        if (value == nullptr) return otherwise;
        if (const auto n = parse_natural(*value); n && *n >= least && *n <= most) {
            return static_cast<unsigned>(*n);
        }
        problems_.push_back("invalid value '" + *value + "' of modParam '" + name + "': expected " +
                            std::to_string(least) + ".." + std::to_string(most));
        return otherwise;
    }
    bool on(const Feature& f) {
        if (f.parameters[0] == nullptr) return true;
        return std::any_of(std::begin(f.parameters), std::end(f.parameters), [&](const char* p) {
            return p != nullptr && flag(p, std::string_view(p) == "enablePV");
        });
    }
    std::vector<master::Entry> entries(const Feature& f, unsigned axis, const std::string& prefix) {
        master::Entry e;
        e.index = static_cast<std::uint16_t>(f.index + 0x800 * axis);
        e.sub = f.sub;

        e.bits = f.bits;
        e.type = f.type;
        e.is_signed = is_signed(f.type);
        const bool in = f.index == 0x60fd;
        const bool out = f.index == 0x60fe;
        std::vector<master::Entry> list;
        if (!in && !out) {
            e.name = prefix + f.pin;
            list.push_back(std::move(e));
        }
        for (unsigned bit = 0; (in || out) && bit < 32; ++bit) {
            constexpr const char* inputs[] = {"negative-limit", "positive-limit", "home",
                                              "interlock"};
            master::Entry part = e;
            part.bits = 1;
            part.type = Type::bit;
            part.part = bit != 0;
            if (bit >= 16) {
                part.name = prefix + f.pin + "-" + std::to_string(bit - 16);
            } else if (in && bit < 4) {
                part.name = prefix + "din-" + inputs[bit];
            } else if (out && bit == 0) {
                part.name = prefix + "dout-brake";
            }
            list.push_back(std::move(part));
        }
        for (const auto& made : list) {
            if (!made.name.empty()) {
                info_.pins.push_back({made.name, {"", object_text(made.index, made.sub)}});
            }
        }
        return list;
    }

    const std::map<std::string, std::string>& parameters_;
    master::Slave& slave_;
    SlaveInfo& info_;
    std::vector<std::string>& problems_;
};

}  // namespace

std::span<const char* const> cia402_parameters() { return parameter_names; }

void build_cia402(const std::map<std::string, std::string>& parameters, master::Slave& slave,
                  SlaveInfo& info, std::vector<std::string>& problems) {
    Cia402(parameters, slave, info, problems).build();
    std::sort(problems.begin(), problems.end());
    problems.erase(std::unique(problems.begin(), problems.end()), problems.end());
}

}  // namespace hal::ethercat::config
