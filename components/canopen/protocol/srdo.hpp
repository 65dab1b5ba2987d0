// SPDX-License-Identifier: MIT
// Safety-related data objects of EN 50325-5 (CiA 304), sent and received by one node, as its objects 1300h to 13FFh say. An SRDO is two
// frames, the second one the first inverted bit by bit:
//
//     plain     COB-ID 1 (odd)     101h … 17Fh     objects 1, 3, 5 … of the mapping
//     inverted  COB-ID 2 = 1 + 1   102h … 180h     objects 2, 4, 6 …
//
// A receiver believes the data when both frames came in this order, within the SRVT of each other, complementary and of the mapped
// length, and an SRDO no later than the SCT behind the last. Anything else is a fault, and data that is not believed is not written.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "dictionary.hpp"
#include "emcy.hpp"
#include "frames.hpp"
#include "mapping.hpp"

namespace hal::canopen {

enum class SrdoDirection : std::uint8_t { none = 0, sends = 1, receives = 2 };  // 1301h:1

/// Why the data of an SRDO is not believed, or why it is not sent.
enum class SrdoFault : std::uint8_t {
    none,
    late,        ///< no SRDO for its SCT
    incomplete,  ///< the second frame did not come within the SRVT
    order,       ///< the second frame came first, or the first one twice
    length,      ///< a frame has not the mapped length
    complement,  ///< the second frame is not the first inverted
    fail_safe,   ///< a global fail-safe command
    own_data,    ///< a sender: the two objects of a pair are not complementary; nothing is sent
};
/// As a part of a sentence: "its second frame is not the first one inverted". [any]
const char* to_string(SrdoFault) noexcept;

/// All calls come from poll() or handle(). [realtime]
class SafetyEvents {
public:
    virtual ~SafetyEvents() = default;
    /// An SRDO was received and believed; its values are in the dictionary. Numbers count from 1.
    virtual void on_srdo(unsigned number, Time) noexcept { (void)number; }
    /// Its data belongs into its safe state now. It stays so until Srdos::acknowledge() or the node leaves the operational state.
    virtual void on_srdo_fault(unsigned number, SrdoFault, Time) noexcept { (void)number; }
    /// A global fail-safe command came; before on_srdo_fault() of each received SRDO.
    virtual void on_fail_safe(Time) noexcept {}
};

class Srdos final : public Handler {
public:
    static constexpr unsigned most = 64;
    static constexpr std::uint8_t valid_mark = 0xa5;  ///< of 13FEh

    Srdos(Dictionary&, FrameQueue& out, Emcy&);  // [setup]
    void listen(SafetyEvents& events) noexcept { events_ = &events; }  // [setup]
    /// Communication was reset: all parameters are read anew. [realtime]
    void reset(std::uint8_t node_id) noexcept;
    void set_operational(bool operational, Time now) noexcept;
    /// True: it is one of ours. [realtime]
    bool handle(const Frame&, Time now) noexcept;
    void poll(Time now) noexcept;

    /// A received SRDO has to come from now on, the first one within its SCT. Without this word the SCT counts from the first one
    /// received. `on` false: it is not listened to. [realtime]
    void expect(unsigned number, bool on, Time now) noexcept;
    /// The fault is seen to; the data is believed again from the next good SRDO on. [realtime]
    void acknowledge(unsigned number, Time now) noexcept;
    /// A sent SRDO goes out at once, not when it is next due. False: there is no such one. [realtime]
    bool trigger(unsigned number) noexcept;
    /// The second frame is made of the first one; the mapping has no inverted objects that mean something. [setup]
    void derive_inverted(unsigned number) noexcept;
    /// The global fail-safe command, if 1300h allows it. [realtime]
    bool send_fail_safe() noexcept;

    struct Status {
        bool exists = false;
        bool active = false;    ///< the configuration is valid and the node operational
        bool valid = false;     ///< received, no fault, and at least one came
        SrdoDirection direction = SrdoDirection::none;
        SrdoFault fault = SrdoFault::none;
        std::uint64_t count = 0;  ///< sent, or received and believed
    };
    Status status(unsigned number) const noexcept;
    /// 13FEh says so and all signatures are right. [realtime]
    bool configuration_valid() const noexcept { return valid_; }
    /// What 13FFh has to say of SRDO `number`. [realtime]
    std::uint16_t signature(unsigned number) const noexcept;

    Abort writing(Entry&, std::span<const std::uint8_t>) noexcept override;
    void written(Entry&) noexcept override;

private:
    struct Srdo {
        std::uint8_t number = 0;
        SrdoDirection direction = SrdoDirection::none;
        std::uint32_t cob = 0;                // of the first frame
        Time cycle = 0, validation = 0;       // refresh time or SCT; SRVT
        Mapping plain, inverted;
        SrdoFault fault = SrdoFault::none;
        bool ignored = false, strict = false;  // by expect()
        bool heard = false, half = false;      // at least one was believed; the first frame waits for the second
        bool derived = false, now = false;
        std::uint64_t first = 0;
        Time first_at = 0, last = 0, next = 0;
        std::uint64_t count = 0;
        Srdo(unsigned n, std::size_t room) : number(static_cast<std::uint8_t>(n)), plain(room), inverted(room) {}
    };
    static constexpr std::uint32_t first_id = 0x101, last_id = 0x180;

    Srdo* find(unsigned number) noexcept;
    void begin(Srdo&, Time now) noexcept;
    void fail(Srdo&, SrdoFault, Time now) noexcept;
    void take(Srdo&, const Frame&, bool is_second, Time now) noexcept;
    bool too_late(const Srdo& s, Time now) const noexcept { return (s.heard || s.strict) && now - s.last > s.cycle; }
    void send(Srdo&, Time now) noexcept;
    Abort configure() noexcept;
    Abort configure(Srdo&) noexcept;

    Dictionary& dictionary_;
    FrameQueue& out_;
    Emcy& emcy_;
    SafetyEvents* events_ = nullptr;
    std::vector<Srdo> srdos_;
    std::array<std::int8_t, most + 1> of_number_{};
    std::array<std::int8_t, last_id - first_id + 1> of_id_{};  // received ones by identifier, both frames
    bool operational_ = false, valid_ = false;
    Time now_ = 0;
};

}  // namespace hal::canopen
