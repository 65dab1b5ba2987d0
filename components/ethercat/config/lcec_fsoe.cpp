// SPDX-License-Identifier: MIT
#include "ethercat/config/lcec_fsoe.hpp"

#include <algorithm>

#include "ethercat/config/data_copies.hpp"

namespace hal::ethercat::config {

namespace {

using master::Type;

constexpr std::size_t max_standard_bits = 8;

master::Entry object(std::uint16_t index, std::uint8_t sub, unsigned bits) {
    master::Entry e;
    e.index = index;
    e.sub = sub;
    e.bits = static_cast<std::uint16_t>(bits);
    e.type = bits == 1 ? Type::bit : type_of(std::max(bits, 2U), false);
    return e;
}

/// Builds a logic terminal as TwinSAFE projects map it: a PDO for each connection in the order of
/// fsoeSlaveIdx, then the state or control of the device, then the standard bits.
class FsoeLogic {
public:
    FsoeLogic(Bus& bus, std::size_t logic, std::vector<std::string>& problems)
        : bus_(bus), logic_(logic), problems_(problems) {}

    void build(const FsoeParameters& parameters) {
        master::SyncManager outputs;
        outputs.number = 2;
        outputs.output = true;
        master::SyncManager inputs;
        inputs.number = 3;
        std::size_t connection = 0;
        for (const auto& [name, value] : parameters) {
            if (name == "fsoeSlaveIdx" && add_connection(value, connection, outputs, inputs)) {
                ++connection;
            }
        }
        outputs.pdos.push_back(control());
        inputs.pdos.push_back(state());
        standard_bits(parameters, "stdInName", 0x17f1, 0xf201, outputs);
        standard_bits(parameters, "stdOutName", 0x1bf1, 0xf101, inputs);
        auto& slave = bus_.setup.slaves[logic_];
        slave.sync_managers = {std::move(outputs), std::move(inputs)};
        for (const Frame& frame : frames_) {
            copy(frame);
        }
    }

private:
    /// A safety frame, by its first objects.
    struct Frame {
        std::size_t from_slave = 0;
        std::uint16_t from = 0;
        std::size_t to_slave = 0;
        std::uint16_t to = 0;
        unsigned bytes = 0;
    };

    /// Copies a frame in each cycle. While one of both terminals is not operational, 0 is sent: an
    /// invalid frame, so that the safe terminals go to their safe state by their watchdog.
    void copy(const Frame& frame) {
        const auto from = locate(bus_, frame.from_slave, false, frame.from, 1);
        const auto to = locate(bus_, frame.to_slave, true, frame.to, 1);
        if (!from || !to) return;
        const std::size_t bits = std::min(
            {std::size_t{8} * frame.bytes, bits_behind(bus_, *from), bits_behind(bus_, *to)});
        bus_.copies.push_back({*from, *to, static_cast<unsigned>(bits)});
    }

    /// Returns false after reporting a slave that is not a safe terminal.
    bool add_connection(const std::string& value, std::size_t connection,
                        master::SyncManager& outputs, master::SyncManager& inputs) {
        const auto position = parse_natural(value);
        const auto& slaves = bus_.setup.slaves;
        const auto found = std::find_if(slaves.begin(), slaves.end(), [&](const auto& slave) {
            return position && slave.position == *position;
        });
        if (found == slaves.end()) {
            problems_.push_back("fsoeSlaveIdx '" + value + "': no slave has this idx");
            return false;
        }
        const auto terminal = static_cast<std::size_t>(found - slaves.begin());
        const FsoeFrame& frame = bus_.slaves[terminal].fsoe;
        if (frame.channels == 0) {
            problems_.push_back("fsoeSlaveIdx '" + value + "': slave '" + found->name +
                                "' is not a safe terminal");
            return false;
        }
        const auto step = static_cast<std::uint16_t>(0x10 * connection);
        const auto from_logic = static_cast<std::uint16_t>(0x6000 + step);
        const auto to_logic = static_cast<std::uint16_t>(0x7000 + step);
        outputs.pdos.push_back(frame_pdo(static_cast<std::uint16_t>(0x1600 + connection), to_logic,
                                         frame.slave_bytes, frame.channels));
        inputs.pdos.push_back(frame_pdo(static_cast<std::uint16_t>(0x1a00 + connection), from_logic,
                                        frame.master_bytes, frame.channels));
        frames_.push_back(
            {terminal, frame.slave_object, logic_, to_logic, frame.size(frame.slave_bytes)});
        frames_.push_back(
            {logic_, from_logic, terminal, frame.master_object, frame.size(frame.master_bytes)});
        const std::string name = "fsoe-" + std::to_string(connection) + "-";
        for (const auto& [role, index] :
             {std::pair{"master", from_logic}, std::pair{"slave", to_logic}}) {
            show(name + role + "-cmd", index, 1);
            show(name + role + "-connid", index, 2);
            for (unsigned channel = 0; channel < frame.channels; ++channel) {
                show(name + role + "-crc" + std::to_string(channel), index,
                     static_cast<std::uint8_t>(3 + channel));
            }
        }
        return true;
    }
    static master::Pdo frame_pdo(std::uint16_t pdo, std::uint16_t index, unsigned data_bytes,
                                 unsigned channels) {
        master::Pdo p;
        p.index = pdo;
        p.entries.push_back(object(index, 1, 8));
        for (unsigned channel = 0; channel < channels; ++channel) {
            p.entries.push_back(object(0, 0, 8 * data_bytes));
            p.entries.push_back(object(index, static_cast<std::uint8_t>(3 + channel), 16));
        }
        p.entries.push_back(object(index, 2, 16));
        return p;
    }
    void show(const std::string& pin, std::uint16_t index, std::uint8_t sub) {
        Channel number;
        number.kind = "number";
        number.name = pin;
        number.objects["val"] = {index, sub, 0, 0};
        number.settings["unsigned"] = 1;
        bus_.slaves[logic_].channels.push_back(std::move(number));
    }

    master::Pdo control() {
        master::Pdo p;
        p.index = 0x17f0;
        p.entries.push_back(object(0xf200, 1, 16));
        p.entries.back().name = "control";
        return p;
    }
    master::Pdo state() {
        master::Pdo p;
        p.index = 0x1bf0;
        p.entries = {object(0xf100, 1, 2), object(0, 0, 5),       object(0xf100, 8, 1),
                     object(0xf100, 9, 1), object(0xf100, 10, 1), object(0, 0, 6)};
        p.entries[0].name = "state";
        p.entries[2].name = "login-active";
        p.entries[3].name = "input-size-missmatch";
        p.entries[4].name = "output-size-missmatch";
        return p;
    }
    void standard_bits(const FsoeParameters& parameters, const std::string& parameter,
                       std::uint16_t pdo, std::uint16_t index, master::SyncManager& to) {
        master::Pdo p;
        p.index = pdo;
        for (const auto& [name, value] : parameters) {
            if (name != parameter) continue;
            p.entries.push_back(object(index, static_cast<std::uint8_t>(p.entries.size() + 1), 1));
            p.entries.back().name = value;
        }
        if (p.entries.empty()) return;
        if (p.entries.size() > max_standard_bits) {
            problems_.push_back("more than " + std::to_string(max_standard_bits) + " modParams '" +
                                parameter + "'");
        }
        if (const std::size_t rest = p.entries.size() % 8; rest != 0) {
            p.entries.push_back(object(0, 0, static_cast<unsigned>(8 - rest)));
        }
        to.pdos.push_back(std::move(p));
    }

    Bus& bus_;
    const std::size_t logic_;
    std::vector<std::string>& problems_;
    std::vector<Frame> frames_;
};

}  // namespace

void build_fsoe_logic(Bus& bus, std::size_t logic, const FsoeParameters& parameters,
                      std::vector<std::string>& problems) {
    FsoeLogic(bus, logic, problems).build(parameters);
}

}  // namespace hal::ethercat::config
