// SPDX-License-Identifier: MIT
// The configuration of an EtherCAT bus: a `.ethercat` file, or LinuxCNC's ethercat-conf.xml.
// docs/ethercat-configuration.md is the reference.
//
//     config::ReadResult reading = config::read(text, "machine.ethercat");
//     if (!reading.good()) print(config::to_string(reading, "machine.ethercat"));
//     for (const config::Bus& bus : reading.buses) start(bus.link, bus.setup);
//
// Everything here is [setup].
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "ethercat/config/lcec_channel.hpp"
#include "ethercat/esi/esi.hpp"
#include "ethercat/master/setup.hpp"
#include "text/config_text.hpp"

namespace hal::ethercat::config {

using hal::Severity;
using text::Span;

/// Subject of a message: its diagnostic code.
enum class Topic : std::uint8_t {
    line,  ///< an invalid line, section, key or element
    value,  ///< an invalid value
    object,  ///< an unknown object, or one that a PDO cannot carry
    slave,  ///< conflicting or incomplete slaves
};
/// Returns "ethercat-line" and the like: the diagnostic's code.
const char* code_of(Topic);

using Message = text::Message<Topic>;

/// What belongs to a pin besides its entry in the setup.
struct PinInfo {
    std::string unit, about;
};

/// An interface of the host for Ethernet over EtherCAT.
struct HostInterface {
    std::string name;  ///< empty: none
    std::uint32_t ip = 0;  ///< its address, C0A80201h for 192.168.2.1; 0: configured by other means
    unsigned prefix = 24;
};

/// The safety frames of a terminal: command, then data and CRC of each channel, then connection.
struct FsoeFrame {
    unsigned slave_bytes = 0;  ///< of a channel, from the terminal
    unsigned master_bytes = 0;  ///< of a channel, to the terminal
    unsigned channels = 0;  ///< 0: not a safe terminal
    std::uint16_t slave_object = 0x6000;  ///< of the frame from the terminal, sub-index 1 first
    std::uint16_t master_object = 0x7000;  ///< of the frame to the terminal
    /// Returns the bytes of a frame with so many bytes of data in each channel.
    unsigned size(unsigned data_bytes) const { return 1 + channels * (data_bytes + 2) + 2; }
};

/// Where a value begins in the process data.
struct DataLocation {
    std::size_t slave = 0;  ///< index in Setup::slaves
    std::size_t sync_manager = 0;  ///< index in Slave::sync_managers
    std::size_t bit = 0;
};

/// Bits that the master copies in each cycle from the inputs of a slave to the outputs of one.
struct DataCopy {
    DataLocation from, to;
    unsigned bits = 0;
    /// while one of both slaves is not operational: the outputs stay; else they are `safe`
    bool hold = false;
    std::uint64_t safe = 0;  ///< the first 64 bits; further ones are 0
};

/// A slave as the user sees it; the slave of the same number in the setup is how the master sees
/// it.
struct SlaveInfo {
    /// order code or name of its device, for messages and lists
    std::string type;
    std::string description;  ///< path of its ESI; empty: none
    unsigned cia402_axes = 0;  ///< drives of CiA 402
    std::vector<std::pair<std::string, PinInfo>> pins;  ///< by name
    std::vector<Channel> channels;  ///< LinuxCNC's format: pins that are computed
    FsoeFrame fsoe;
    bool fsoe_logic = false;  ///< a logic terminal, whose process data come from its modParams
    Span at{};
    /// of a slave with EoE, unless the bus has a switch
    HostInterface eoe;
    const PinInfo* find(std::string_view pin) const;
};

/// One bus with its master.
struct Bus {
    std::string name;  ///< of its pins in LinuxCNC's format; empty in a `.ethercat` file
    bool lcec = false;  ///< of LinuxCNC's format
    /// of the master in LinuxCNC's format: MASTER0_DEVICE of ethercat.conf
    unsigned index = 0;
    /// link addresses; a backup closes a ring
    std::string link = "sim:ethercat", backup;
    /// why LinuxCNC's format has no link; the master cannot start then
    std::string missing_link;
    /// IPv4 address on which the mailbox gateway listens; empty: no gateway
    std::string gateway;
    std::uint16_t gateway_port = 34980;
    HostInterface eoe_switch;  ///< of all slaves with EoE; without a name each has its own
    /// setup.cycle_ns is from the file; else it is that of the thread
    bool cycle_given = false;
    master::Setup setup;
    std::vector<SlaveInfo> slaves;  ///< as many as in setup.slaves
    std::vector<DataCopy> copies;
    Span at{};
};

struct ReadResult {
    std::vector<Bus> buses;  ///< one for a `.ethercat` file
    bool lcec = false;  ///< LinuxCNC's format: pins are named lcec.MASTER.SLAVE.PIN
    std::vector<Message> messages;  ///< in order of place
    bool good() const { return text::good(messages); }
};

/// Reads a whole file. Returns false and sets `bytes` to the reason.
using ReadFile = std::function<bool(const std::string& path, std::string& bytes)>;
bool read_from_disk(const std::string& path, std::string& bytes);

/// Returns whether the pins of a slave are assumed to exist ("lcec.0.x").
using IsAssumed = std::function<bool(const std::string& slave)>;

/// Reads a configuration of either format: XML if its first character is `<`. Relative paths in it
/// start at the folder of `path`. A slave of an unknown type of lcec is an error, unless its pins
/// are assumed to exist; it then has none.
ReadResult read(std::string_view text, const std::string& path, const ReadFile& = read_from_disk,
                const IsAssumed& = {});

/// Return the keys of [bus], of a slave, of its clocks and of its objects, as tables in Markdown.
std::string bus_reference();
std::string slave_reference();
std::string process_data_reference();
std::string clock_reference();
std::string object_reference();

/// Sets the mailbox gateway of a bus: "none", ADDRESS or ADDRESS:PORT. Returns false for anything
/// else.
bool read_gateway(std::string_view text, Bus&);

/// Formats each error as "file:12:7: error: sentence; help", for hosts without a renderer.
std::string to_string(const ReadResult&, const std::string& path);

/// A slave as found on a bus or described in an ESI, for write().
struct Found {
    std::string name;  ///< of its section; empty: slave-POSITION
    std::string device;  ///< name or order code, for a comment
    std::string esi;  ///< path of its description; empty: none
    std::string order;  ///< its order code there
    std::uint32_t vendor = 0;
    std::uint32_t product = 0;
    std::uint32_t revision = 0;
    std::uint16_t alias = 0;
    std::vector<sii::Pdo> rx, tx;  ///< of the SII; those with a sync manager are assigned
    std::vector<sii::SyncManager> sync_managers;
    std::uint16_t assign_activate = 0;  ///< 0: without SYNC
};
/// Returns the text of a `.ethercat` file for these slaves in order of position. It can be read
/// without errors.
std::string write(const std::string& link, std::int64_t cycle_ns, const std::vector<Found>& slaves);

/// Returns the text of a netlist that runs the bus of the configuration `file`: its master, a
/// component cia402 for each drive, linked and disabled, and the remaining pins as comments.
/// `segment`: devices of ethercat_segment, or empty for a real bus.
std::string netlist(const Bus&, const std::string& file, const std::string& segment);

/// Returns the HAL type of the pin of an entry: "u32".
const char* pin_type(const master::Entry&);

/// Returns "out u32   SLAVE.NAME  6041:0" with a line end, seen from the netlist: an output of the bus is an input there.
std::string pin_line(const master::Entry&, bool output, const std::string& slave);

}  // namespace hal::ethercat::config
