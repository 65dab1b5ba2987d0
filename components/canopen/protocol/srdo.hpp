// SPDX-License-Identifier: MIT
// The safety-related data objects (SRDOs) of one node as its objects 1300h to 13FFh configure them
// (EN 50325-5, formerly CiA 304). An SRDO consists of two frames; the second is the bitwise inverse
// of the first:
//
//     plain     COB-ID 1 (odd)     101h … 17Fh     objects 1, 3, 5 … of the mapping
//     inverted  COB-ID 2 = 1 + 1   102h … 180h     objects 2, 4, 6 …
//
// Received data is valid if both frames arrive in this order, within the safety-relevant validation
// time (SRVT) of each other, complementary and of the mapped length, and each SRDO within the
// safeguard cycle time (SCT) of the previous one. Anything else is a fault; invalid data is not
// written to the dictionary.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "dictionary.hpp"
#include "emcy.hpp"
#include "frames.hpp"
#include "mapping.hpp"

namespace hal::canopen {

/// The direction of an SRDO as seen from the node.
enum class SrdoDirection : std::uint8_t { none = 0, sends = 1, receives = 2 };  // 1301h:1

/// Why the data of a received SRDO is invalid, or why an SRDO is not sent.
enum class SrdoFault : std::uint8_t {
    none,
    late,  ///< no SRDO within the SCT
    incomplete,  ///< the second frame did not arrive within the SRVT
    order,  ///< the second frame arrived first, or the first one twice
    length,  ///< the length of a frame differs from the mapping
    complement,  ///< the second frame is not the inverse of the first
    fail_safe,  ///< a global fail-safe command (GFC) was received
    own_data,  ///< sender: the two objects of a pair are not complementary; nothing is sent
};
/// Returns the fault as a clause: "second frame is not the inverse of the first". [any]
const char* to_string(SrdoFault) noexcept;

/// Notifications about SRDOs. All calls come from poll() or handle(). [realtime]
class SafetyEvents {
public:
    virtual ~SafetyEvents() = default;
    /// A valid SRDO was received; its values are in the dictionary. Numbers count from 1.
    virtual void on_srdo(unsigned number, Time) noexcept { (void)number; }
    /// The data is invalid and must enter its safe state. It stays invalid until
    /// Srdos::acknowledge() or until the node leaves operational.
    virtual void on_srdo_fault(unsigned number, SrdoFault, Time) noexcept { (void)number; }
    /// A global fail-safe command was received; called before on_srdo_fault() of each received
    /// SRDO.
    virtual void on_fail_safe(Time) noexcept {}
};

/// All SRDOs of a node. Numbers count from 1. All calls belong to one thread.
class Srdos final : public Handler {
public:
    static constexpr unsigned max_srdos = 64;
    /// value of 13FEh that marks the configuration as valid
    static constexpr std::uint8_t valid_mark = 0xa5;

    /// Creates the SRDOs that the dictionary describes; all arguments outlive them. [setup]
    Srdos(Dictionary&, FrameQueue& out, Emcy&);
    /// Sets the receiver of notifications, which outlives this. [setup]
    void listen(SafetyEvents& events) noexcept { events_ = &events; }
    /// Reads all parameters after a communication reset. [realtime]
    void reset(std::uint8_t node_id) noexcept;
    /// Starts or stops the exchange of SRDOs; they exist only in the NMT state operational.
    /// [realtime]
    void set_operational(bool operational, Time now) noexcept;
    /// Processes a frame; returns true if it belongs to an SRDO or is a global fail-safe command.
    /// [realtime]
    bool handle(const Frame&, Time now) noexcept;
    /// Sends SRDOs that are due and checks SCT and SRVT; call it once per cycle. [realtime]
    void poll(Time now) noexcept;

    /// Expects a received SRDO from now on, the first one within the SCT; without this call the SCT
    /// starts with the first SRDO received. `on` false: ignores it. [realtime]
    void expect(unsigned number, bool on, Time now) noexcept;
    /// Acknowledges a fault; the data is valid again from the next valid SRDO on. [realtime]
    void acknowledge(unsigned number, Time now) noexcept;
    /// Sends an SRDO at the next poll() instead of when it is due. Returns false if it does not
    /// exist. [realtime]
    bool trigger(unsigned number) noexcept;
    /// Derives the second frame from the first; the inverted objects of the mapping are not used.
    /// [setup]
    void derive_inverted(unsigned number) noexcept;
    /// Sends the global fail-safe command if 1300h allows it; returns false if not, or if the queue
    /// is full. [realtime]
    bool send_fail_safe() noexcept;

    /// The state of one SRDO.
    struct Status {
        bool exists = false;
        bool active = false;  ///< the configuration is valid and the node operational
        bool valid = false;  ///< received: at least one arrived, and there is no fault
        SrdoDirection direction = SrdoDirection::none;
        SrdoFault fault = SrdoFault::none;
        std::uint64_t count = 0;  ///< SRDOs sent, or received and valid
    };
    /// Returns the state of an SRDO; `exists` is false for an unknown number. [realtime]
    Status status(unsigned number) const noexcept;
    /// Returns true if 13FEh marks the configuration as valid and all signatures match. [realtime]
    bool configuration_valid() const noexcept { return valid_; }
    /// Returns the signature of SRDO `number` that 13FFh must contain. [realtime]
    std::uint16_t signature(unsigned number) const noexcept;

    Abort writing(Entry&, std::span<const std::uint8_t>) noexcept override;
    void written(Entry&) noexcept override;

private:
    struct Srdo {
        std::uint8_t number = 0;
        SrdoDirection direction = SrdoDirection::none;
        std::uint32_t cob = 0;  // of the first frame
        Time cycle = 0;
        Time validation = 0;  // refresh time or SCT; SRVT
        Mapping plain, inverted;
        SrdoFault fault = SrdoFault::none;
        bool ignored = false;
        bool strict = false;  // set by expect()
        // at least one valid SRDO arrived; the first frame awaits the second
        bool heard = false;
        bool half = false;
        bool derived = false;
        bool now = false;
        std::uint64_t first = 0;
        Time first_at = 0;
        Time last = 0;
        Time next = 0;
        std::uint64_t count = 0;
        Srdo(unsigned n, std::size_t capacity)
            : number(static_cast<std::uint8_t>(n)), plain(capacity), inverted(capacity) {}
        /// It is neither sent nor received.
        bool suspended() const noexcept { return fault != SrdoFault::none || ignored; }
    };
    static constexpr std::uint32_t first_id = 0x101;
    static constexpr std::uint32_t last_id = 0x180;

    Srdo* find(unsigned number) noexcept;
    void begin(Srdo&, Time now) noexcept;
    void fail(Srdo&, SrdoFault, Time now) noexcept;
    void take(Srdo&, const Frame&, bool is_second, Time now) noexcept;
    bool too_late(const Srdo& s, Time now) const noexcept {
        return (s.heard || s.strict) && now - s.last > s.cycle;
    }
    void send(Srdo&, Time now) noexcept;
    void check_times(Srdo&, Time now) noexcept;
    bool fail_safe_enabled() const noexcept;
    void on_fail_safe(Time now) noexcept;
    /// Reads all SRDOs from the dictionary. Returns why the configuration is invalid.
    Abort configure() noexcept;
    /// Reads one SRDO from its objects 13xxh (EN 50325-5). Returns why it is invalid.
    Abort configure(Srdo&) noexcept;
    void read_communication(Srdo&) const noexcept;
    /// Returns whether identifiers and times are permitted, and no other SRDO has the identifiers.
    bool is_valid(const Srdo&) const noexcept;
    Abort map(Srdo&) noexcept;

    Dictionary& dictionary_;
    FrameQueue& out_;
    Emcy& emcy_;
    SafetyEvents* events_ = nullptr;
    std::vector<Srdo> srdos_;
    std::array<std::int8_t, max_srdos + 1> of_number_{};
    // received SRDOs by identifier of either frame
    std::array<std::int8_t, last_id - first_id + 1> of_id_{};
    bool operational_ = false;
    bool valid_ = false;
    Time now_ = 0;
};

}  // namespace hal::canopen
