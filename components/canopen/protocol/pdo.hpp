// SPDX-License-Identifier: MIT
// The process data objects (PDOs) of one node (CiA 301): up to 512 RPDOs and 512 TPDOs as its
// objects 1400h/1600h and 1800h/1A00h configure them. A node may be remapped while it runs.
// `Device` owns and drives them; an application describes, triggers and observes them:
//
//     Description d = basic_device({.vendor = 1, .product = 2});
//     d.add(0x2000, 0, Type::integer32, Access::read_write).mappable();
//     add_tpdo(d, 1, {.transmission = 255, .event_ms = 100, .mapping = {map_entry(0x2000, 0, 32)}});   // 181h..1FFh, every 100 ms
//     Device device(d, {.node_id = 5}, events);
//     device.dictionary().set(0x2000, 0, std::int32_t{42});
//     device.pdos().trigger(1);                // sends TPDO 1 at the next poll
//     events: void on_rpdo(unsigned number, Time) noexcept override { ... }    // the values are in the dictionary
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "dictionary.hpp"
#include "emcy.hpp"
#include "events.hpp"
#include "frames.hpp"
#include "mapping.hpp"

namespace hal::canopen {

/// How a node treats its PDOs where CiA 301 leaves a choice.
struct PdoSettings {
    /// sends event-driven TPDOs once when the node becomes operational
    bool send_at_start = true;
    /// EMCY 8220h for an RPDO that is longer than its mapping; it is processed nevertheless
    bool report_too_long = true;
};

/// All PDOs of a node. PDO numbers count from 1. All calls belong to one thread.
class Pdos final : public Handler {
public:
    static constexpr unsigned max_pdos = 512;  ///< RPDOs, and as many TPDOs

    /// Creates the PDOs that the dictionary describes; all arguments outlive them. [setup]
    Pdos(Dictionary&, FrameQueue& out, Emcy&, DeviceEvents&, const PdoSettings& = {});
    /// Reads all parameters after a communication reset. [realtime]
    void reset(std::uint8_t node_id) noexcept;
    /// Starts or stops the exchange of PDOs; they exist only in the NMT state operational.
    /// [realtime]
    void set_operational(bool operational, Time now) noexcept;
    /// Processes an RPDO or a remote request; returns true if the identifier belongs to one of the
    /// PDOs. [realtime]
    bool handle(const Frame&, Time now) noexcept;
    /// Writes the synchronous RPDOs received since the last SYNC to the dictionary. `window` is the
    /// synchronous window 1007h in ns; 0: none. [realtime]
    void on_sync(Time now, Time window) noexcept;
    /// Samples and sends the synchronous TPDOs, after the application has reacted to the SYNC.
    /// `counted`: the SYNC carries `counter`. [realtime]
    void send_synchronous(std::uint8_t counter, bool counted, Time now) noexcept;
    /// Sends TPDOs that are due and checks RPDO deadlines; call it once per cycle. [realtime]
    void poll(Time now) noexcept;

    /// Sends the event-driven TPDO at the next poll(), after its inhibit time. Returns false if it
    /// does not exist. [realtime]
    bool trigger(unsigned number) noexcept;
    /// Triggers all event-driven TPDOs that carry the object. [realtime]
    void trigger(const Entry&) noexcept;
    /// Sends event-driven TPDO `number` whenever one of its values changes. Returns false if it
    /// does not exist. [setup]
    bool send_on_change(unsigned number, bool on = true) noexcept;
    /// Suspends a TPDO while its consumer is not configured yet; `on` false resumes it. [realtime]
    void hold_tpdo(unsigned number, bool on) noexcept;
    /// Suspends an RPDO while its producer is not configured yet; `on` false resumes it. [realtime]
    void hold_rpdo(unsigned number, bool on) noexcept;
    /// Requests RPDO `number` from its producer by a remote frame. Returns false if it is not valid
    /// or the queue is full. [realtime]
    bool request(unsigned number) noexcept;
    /// Sends `value` by the DAM-MPDO `number` to an object of node `destination` (0: all nodes).
    /// Returns false if the PDO is not a DAM-MPDO or the queue is full. [realtime]
    bool send_dam(unsigned number, std::uint8_t destination, std::uint16_t index, std::uint8_t sub,
                  std::uint32_t value) noexcept;
    /// Sends an object of this node by the SAM-MPDO `number`; objects of the scanner list are sent
    /// without this call. Returns false if the PDO is not a SAM-MPDO, the object is not mappable or
    /// the queue is full. [realtime]
    bool send_sam(unsigned number, std::uint16_t index, std::uint8_t sub) noexcept;

    /// The state of one PDO.
    struct Status {
        bool exists = false;
        bool valid = false;  ///< bit 31 of the COB-ID is clear
        bool late = false;  ///< RPDO: its event timer has expired (EMCY 8250h)
        std::uint32_t cob = cob_invalid;
        std::uint8_t transmission = 0;  ///< transmission type
        std::uint8_t bytes = 0;  ///< mapped length
        std::uint64_t count = 0;  ///< PDOs sent, or received and written to the dictionary
        /// RPDO: wrong length or outside the synchronous window; TPDO: the queue was full
        std::uint64_t errors = 0;
        Time last = 0;  ///< when the last one was sent or received
    };
    /// Returns the state of an RPDO; `exists` is false for an unknown number. [realtime]
    Status rpdo(unsigned number) const noexcept;
    /// Returns the state of a TPDO; `exists` is false for an unknown number. [realtime]
    Status tpdo(unsigned number) const noexcept;

    /// Checks a value that SDO writes to a parameter of a PDO, in the remapping order of CiA 301.
    /// [realtime]
    Abort writing(Entry&, std::span<const std::uint8_t>) noexcept override;
    /// Applies the new parameter. [realtime]
    void written(Entry&) noexcept override;

private:
    enum class Kind : std::uint8_t { plain, destination_address, source_address };
    struct Pdo {
        std::uint16_t number = 0;
        Kind kind = Kind::plain;
        std::uint8_t transmission = 255;
        std::uint32_t cob = cob_invalid;
        Mapping mapping;
        Time event = 0;
        Time last = 0;
        std::uint64_t image = 0;  // received and pending for the SYNC, or sampled
        std::uint64_t count = 0;
        std::uint64_t errors = 0;
        std::int16_t next = -1;  // index of the next PDO with the same identifier
        bool held = false;
        explicit Pdo(unsigned n, std::size_t capacity)
            : number(static_cast<std::uint16_t>(n)), mapping(capacity) {}
        bool valid() const noexcept { return (cob & cob_invalid) == 0; }
        bool event_driven() const noexcept { return transmission >= 254; }
        bool synchronous() const noexcept { return transmission <= 240; }
    };
    struct Rpdo : Pdo {
        bool fresh = false;
        bool supervised = false;
        bool late = false;
        bool wrong_length = false;
        using Pdo::Pdo;
    };
    struct Tpdo : Pdo {
        Time inhibit = 0;
        std::uint8_t sync_start = 0;
        std::uint8_t syncs = 0;
        bool pending = false;
        bool waits_for_start = false;
        bool sampled = false;
        bool sent_once = false;

        bool on_change = false;
        bool retry = false;
        std::uint64_t last_sent = 0;
        using Pdo::Pdo;
    };
    static constexpr std::size_t extended_slot = 2048;
    /// An object of the scanner list 1FA0h–1FCFh: a SAM-MPDO carries it whenever it changes.
    struct Scanned {
        Entry* entry = nullptr;
        std::uint32_t last_sent = 0;
        bool sent = false;  // since the node became operational
    };
    static constexpr std::size_t max_scanned = 1024;

    Rpdo* find_rpdo(unsigned number) noexcept;
    Tpdo* find_tpdo(unsigned number) noexcept;
    void read_communication(Rpdo&) noexcept;
    void read_communication(Tpdo&) noexcept;
    static Kind kind_of(std::uint8_t count) noexcept;
    static Status status_of(const Pdo*, bool late) noexcept;
    Abort read_mapping(Pdo&, bool received) noexcept;
    void restart(Tpdo&, Time now) noexcept;
    void index_identifiers() noexcept;
    void apply_parameter(Rpdo&, bool mapping) noexcept;
    void apply_parameter(Tpdo&, bool mapping, std::uint8_t sub) noexcept;
    bool handle_request(const Frame&, std::size_t slot, Time now) noexcept;
    bool handle_data(const Frame&, std::size_t slot, Time now) noexcept;
    bool check_length(Rpdo&, const Frame&, Time now) noexcept;
    bool receive(Rpdo&, const Frame&, Time now) noexcept;
    bool receive_multiplexed(Rpdo&, const Frame&, Time now) noexcept;
    bool write_multiplexed(const Frame&, std::uint16_t index, std::uint8_t sub) noexcept;
    bool dispatch(std::uint8_t node, const Frame&) noexcept;
    void check_deadline(Rpdo&, Time now) noexcept;
    bool is_due_at_sync(Tpdo&, std::uint8_t counter, bool counted) const noexcept;
    bool has_expired(Time since, Time timer, Time part, Time now) const noexcept;
    void poll(Tpdo&, Time now) noexcept;
    void retry(Tpdo&, Time now) noexcept;
    Tpdo* find_multiplexed(unsigned number, Kind) noexcept;
    bool send_multiplexed(Tpdo&, std::uint8_t address, std::uint16_t index, std::uint8_t sub,
                          std::span<const std::uint8_t> bytes) noexcept;
    /// Returns true if the synchronous window after the SYNC is over.
    bool is_after_window(Time now) const noexcept {
        return window_ != 0 && now - synced_ > window_;
    }
    void apply(Rpdo&, std::uint64_t image, Time now) noexcept;
    void restart_deadline(Rpdo&, Time now) noexcept;
    void read_scanner_list() noexcept;
    void scan(Tpdo&, Time now) noexcept;
    bool send(Tpdo&, std::uint64_t image, Time now) noexcept;
    Abort check_communication(const Entry&, std::span<const std::uint8_t>, bool received,
                              Pdo&) noexcept;
    Abort check_mapping(const Entry&, std::span<const std::uint8_t>, bool received, Pdo&) noexcept;

    Dictionary& dictionary_;
    FrameQueue& out_;
    Emcy& emcy_;
    DeviceEvents& events_;
    const PdoSettings settings_;
    std::uint8_t node_id_ = 0;
    bool operational_ = false;
    bool polled_ = false;
    Time now_ = 0;
    Time window_ = 0;
    Time synced_ = 0;
    Time polled_at_ = 0;
    Time poll_interval_ = 0;
    std::vector<Rpdo> rpdos_;
    std::vector<Tpdo> tpdos_;
    std::vector<Scanned> scanned_;  // capacity reserved in setup if there is a scanner list
    std::size_t next_scanned_ = 0;
    // number to position in the vector, -1: none
    std::array<std::int16_t, max_pdos + 1> rpdo_of_{}, tpdo_of_{};
    // identifier to first position; 29-bit identifiers share one slot
    std::array<std::int16_t, extended_slot + 1> rpdo_heads_{}, tpdo_heads_{};
};

}  // namespace hal::canopen
