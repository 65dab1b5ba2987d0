// SPDX-License-Identifier: MIT
// A CANopen network as its configuration file describes it: the bus, the master, the nodes, and
// which objects become pins by which PDO. Everything here is [setup].
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canopen/master/boot/flying_master.hpp"
#include "canopen/master/boot/node_setup.hpp"
#include "canopen/protocol/description.hpp"
#include "text/config_text.hpp"

namespace hal::canopen::config {

using hal::Severity;
using text::Span;

/// Subject of a message: its diagnostic code, with a page each (`hal explain`).
enum class Topic : std::uint8_t {
    line,    ///< an invalid line, section or key
    value,   ///< an invalid value
    object,  ///< an unknown object, or one that a PDO cannot carry
    node,    ///< conflicting nodes or messages, or an incomplete node
    load,    ///< bus overload
};
/// "canopen-line", …: the diagnostic's code.
const char* code_of(Topic);

using Message = text::Message<Topic>;

enum class PinType : std::uint8_t { none, bit, s32, u32, s64, u64, real };

/// A bit of an object as a pin of its own.
struct BitPin {
    unsigned bit = 0;
    std::string name;
};

/// An object that a PDO carries.
struct Object {
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    std::uint8_t bits = 0;
    /// with `bits`, how it lies on the wire
    Type type = Type::none;
    bool filler = false;            ///< a dummy: no pin
    /// name below the node's; of the bits' pins when there are some, their common beginning
    std::string pin;
    std::string about;  ///< the description's own name for it
    PinType as = PinType::none;
    double scale = 1.0;
    double offset = 0.0;  ///< object = pin * scale + offset
    std::string unit{};
    std::vector<BitPin> bit_pins{};
    /// the object's bits while the node is not operational; none: the last ones stay
    std::optional<std::uint64_t> safe{};
    bool safe_given = false;  ///< in the file
    /// by the file: 1 bits as pins, -1 not, 0 not given
    int bits_wanted = 0;

    bool same(const Object& o) const {
        return !filler && !o.filler && index == o.index && sub == o.sub;
    }
};

/// What makes a PDO a safety-related one of EN 50325-5: two frames, the second inverted.
struct Safety {
    Time refresh = 25 * millisecond;     ///< of its sender
    /// of its receiver
    Time sct = 50 * millisecond;
    Time srvt = 20 * millisecond;
    std::vector<std::uint32_t> inverted;  ///< the node's inverted objects, as mapping entries
};

/// Of Pdo::limit: derived from the transmission of the PDO.
inline constexpr Time automatic_limit = -1;

struct Pdo {
    bool to_node = false;  ///< an RPDO of the node: the master sends it
    unsigned number = 0;  ///< of the node, from 1
    std::uint32_t cob = 0;  ///< identifier, with bit 29 for a 29-bit one
    std::uint8_t transmission = 255;
    std::uint16_t inhibit_100us = 0;
    std::uint16_t event_ms = 0;
    std::uint8_t sync_start = 0;
    Multiplex multiplex = Multiplex::none;  ///< MPDO: one object per frame
    Time request = 0;  ///< TPDO: period of the remote requests; 0: none
    Time limit = automatic_limit;  ///< TPDO: timeout; 0: none
    std::vector<Object> objects;
    Span at{};
    /// an SRDO: `number` is that of the SRDO, `cob` of its first frame; the PDO timing is unused
    std::optional<Safety> safety{};

    bool synchronous() const { return transmission <= 240; }
    unsigned bits() const;
    unsigned bytes() const { return multiplexed() ? 8 : (bits() + 7) / 8; }
    bool multiplexed() const { return multiplex != Multiplex::none; }
};

struct Node {
    NodeSetup setup;
    std::string name;  ///< of its pins
    std::vector<Pdo> pdos;
    /// 1020h is derived from what is written to the node
    bool dated_by_content = false;
    Span at{};
};

/// A message of another network on the same bus, from [messages]; it counts for the schedule only.
struct Foreign {
    std::uint32_t id = 0;
    bool extended = false;
    bool remote = false;
    bool fd = false;
    bool bit_rate_switch = false;
    std::uint8_t bytes = 8;
    Time period = 0;
    Time deadline = 0;
    Time jitter = 0;
    std::string name;
    std::string queue;  ///< of its node, which sends in order of arrival; empty: by priority
    Span at{};
};

enum class SyncMode : std::uint8_t { none, cycle, timed, follow };

/// NMT state that the master commands when it stops.
enum class AtStop : std::uint8_t { nothing, pre_operational, stopped };

struct MasterConfig {
    std::string link = "sim:canopen";
    std::uint32_t bit_rate = 1'000'000;
    std::uint32_t data_rate = 0;
    std::uint8_t node_id = 127;
    SyncMode sync = SyncMode::none;
    Time sync_period = 0;  ///< timed: its period; follow: its expected period
    std::uint32_t sync_cob = 0x80;
    std::uint8_t sync_counter = 0;  ///< 1019h
    Time sync_window = 0;  ///< 1007h
    /// from the first cycle; else after all mandatory nodes are configured
    bool sync_at_boot = false;
    bool sync_clock = true;  ///< follow: the threads are synchronised to it
    /// follow: time from the SYNC to the next cycle; < 0: half the period of the thread
    Time sync_phase = -1;
    Time time_period = 0;  ///< TIME; 0: none
    std::uint16_t heartbeat_ms = 100;  ///< of the master; 0: none
    AtStop at_stop = AtStop::pre_operational;
    MasterSetup master;  ///< without its nodes: see `nodes`
    FlyingSetup flying;
    std::vector<Node> nodes;
    std::vector<Foreign> foreign;
    Span at{};  ///< of [bus]

    /// `master` with all nodes in it.
    MasterSetup setup() const;
};

/// Reads a whole file. Returns false and sets `bytes` to the reason.
using ReadFile = std::function<bool(const std::string& path, std::string& bytes)>;
bool read_from_disk(const std::string& path, std::string& bytes);

struct ReadResult {
    MasterConfig config;
    std::vector<Message> messages;  ///< in order of place
    bool good() const;  ///< no error among them
};

/// Reads a configuration. Relative paths in it start at the folder of `path`.
ReadResult read(std::string_view text, const std::string& path, const ReadFile& = read_from_disk);

/// Return the keys of [bus], of a node, and the options of a PDO, an SRDO and an object, as tables
/// in Markdown.
std::string bus_reference();
std::string node_reference();
std::string pdo_reference();
std::string srdo_reference();
std::string object_reference();

/// Formats each error as "file:12:7: error: sentence; help", for hosts without a renderer.
std::string to_string(const ReadResult&, const std::string& path);

/// The network of a single node of which only object indices are known: `loadrt canopen
/// inputs=24831 outputs=24675,25600 …`.
struct ByIndex {
    /// comma lists of INDEX[:SUB][/BITS]: what the node receives, and what it sends
    std::string inputs, outputs;
    std::string eds;  ///< may be empty
    unsigned slave = 0;
    unsigned master = 0;
};
/// Reads it; the messages have no spans.
ReadResult read(const ByIndex&, const ReadFile& = read_from_disk);

}  // namespace hal::canopen::config
