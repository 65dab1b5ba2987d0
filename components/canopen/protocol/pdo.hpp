// SPDX-License-Identifier: MIT
// PDOs of one node: up to 512 received and 512 sent, each as its objects 1400h/1600h and 1800h/1A00h say, re-mapped while it runs.
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

struct PdoSettings {
    bool send_at_start = true;    ///< event-driven TPDOs are sent once when the node becomes operational
    bool report_too_long = true;  ///< EMCY 8220h for an RPDO with more bytes than are mapped; it is processed all the same
};

class Pdos final : public Handler {
public:
    static constexpr unsigned most = 512;

    Pdos(Dictionary&, FrameQueue& out, Emcy&, Events&, const PdoSettings& = {});  // [setup]
    /// Communication was reset: all parameters are read anew. [realtime]
    void reset(std::uint8_t node_id) noexcept;
    void set_operational(bool operational, Time now) noexcept;
    /// True: it is one of ours. [realtime]
    bool handle(const Frame&, Time now) noexcept;
    /// Synchronous RPDOs take effect; then, after the application had its turn, on_sync_send(). [realtime]
    void on_sync(Time now, Time window) noexcept;
    void on_sync_send(std::uint8_t counter, bool counted, Time now) noexcept;
    void poll(Time now) noexcept;

    /// An event-driven TPDO has something to say. False: there is no such PDO. [realtime]
    bool trigger(unsigned number) noexcept;
    /// All event-driven TPDOs that carry the object. [realtime]
    void trigger(const Entry&) noexcept;
    /// Event-driven TPDO `number` is sent whenever a value in it changed. False: there is no such PDO. [setup]
    bool send_on_change(unsigned number, bool on = true) noexcept;
    /// One that is held is not sent, or not taken: whom it is for, or who sends it, is not configured yet. [realtime]
    void hold_tpdo(unsigned number, bool on) noexcept;
    void hold_rpdo(unsigned number, bool on) noexcept;
    /// Asks the producer of RPDO `number` for it by a remote frame. [realtime]
    bool request(unsigned number) noexcept;
    /// A multiplexed PDO by TPDO `number`, besides those of the scanner list, which are sent by themselves: to an object of node
    /// `destination` (0: all), or of one of ours to whom it concerns. [realtime]
    bool send_to(unsigned number, std::uint8_t destination, std::uint16_t index, std::uint8_t sub, std::uint32_t value) noexcept;
    bool send_from(unsigned number, std::uint16_t index, std::uint8_t sub) noexcept;

    struct Status {
        bool exists = false, valid = false, late = false;
        std::uint32_t cob = cob_invalid;
        std::uint8_t transmission = 0, bytes = 0;
        std::uint64_t count = 0;   ///< sent, or received and taken over
        std::uint64_t errors = 0;  ///< not processed: length or window; not sent: no room
        Time last = 0;
    };
    Status rpdo(unsigned number) const noexcept;
    Status tpdo(unsigned number) const noexcept;

    Abort writing(Entry&, std::span<const std::uint8_t>) noexcept override;
    void written(Entry&) noexcept override;

private:
    enum class Kind : std::uint8_t { plain, destination_address, source_address };
    struct Pdo {
        std::uint16_t number = 0;
        Kind kind = Kind::plain;
        std::uint8_t transmission = 255;
        std::uint32_t cob = cob_invalid;
        Mapping mapping;
        Time event = 0, last = 0;
        std::uint64_t image = 0;  // received and waiting for the SYNC, or sampled
        std::uint64_t count = 0, errors = 0;
        std::int16_t next = -1;   // with the same identifier
        bool held = false;
        explicit Pdo(unsigned n, std::size_t room) : number(static_cast<std::uint16_t>(n)), mapping(room) {}
        bool valid() const noexcept { return (cob & cob_invalid) == 0; }
    };
    struct Rpdo : Pdo {
        bool fresh = false, supervised = false, late = false, wrong_length = false;
        using Pdo::Pdo;
    };
    struct Tpdo : Pdo {
        Time inhibit = 0;
        std::uint8_t sync_start = 0, syncs = 0;
        bool pending = false, waits_for_start = false, sampled = false, sent_once = false, on_change = false, again = false;
        std::uint64_t said = 0;
        using Pdo::Pdo;
    };
    static constexpr std::size_t extended_slot = 2048;
    /// An object of the scanner list 1FA0h–1FCFh: a multiplexed TPDO that tells sources tells it whenever it changes.
    struct Scanned {
        Entry* entry = nullptr;
        std::uint32_t said = 0;
        bool told = false;  // since the node is operational
    };
    static constexpr std::size_t most_scanned = 1024;

    Rpdo* find_rpdo(unsigned number) noexcept;
    Tpdo* find_tpdo(unsigned number) noexcept;
    void read_communication(Rpdo&) noexcept;
    void read_communication(Tpdo&) noexcept;
    Abort read_mapping(Pdo&, bool received) noexcept;
    void restart(Tpdo&, Time now) noexcept;
    void index_identifiers() noexcept;
    bool receive(Rpdo&, const Frame&, Time now) noexcept;
    bool receive_multiplexed(Rpdo&, const Frame&, Time now) noexcept;
    void take_over(Rpdo&, std::uint64_t image, Time now) noexcept;
    void came(Rpdo&, Time now) noexcept;
    void read_scanner_list() noexcept;
    void scan(Tpdo&, Time now) noexcept;
    bool send(Tpdo&, std::uint64_t image, Time now) noexcept;
    Abort check_communication(const Entry&, std::span<const std::uint8_t>, bool received, Pdo&) noexcept;
    Abort check_mapping(const Entry&, std::span<const std::uint8_t>, bool received, Pdo&) noexcept;

    Dictionary& dictionary_;
    FrameQueue& out_;
    Emcy& emcy_;
    Events& events_;
    const PdoSettings settings_;
    std::uint8_t node_id_ = 0;
    bool operational_ = false, polled_ = false;
    Time now_ = 0, window_ = 0, synced_ = 0, polled_at_ = 0;
    std::vector<Rpdo> rpdos_;
    std::vector<Tpdo> tpdos_;
    std::vector<Scanned> scanned_;  // its room is taken in setup, where there is such a list
    std::size_t next_scanned_ = 0;
    std::array<std::int16_t, most + 1> rpdo_of_{}, tpdo_of_{};               // number to place, -1: none
    std::array<std::int16_t, extended_slot + 1> rpdo_heads_{}, tpdo_heads_{};  // identifier to the first place; 29-bit ones share one
};

}  // namespace hal::canopen
