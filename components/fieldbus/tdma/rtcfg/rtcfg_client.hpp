// SPDX-License-Identifier: MIT
// Takes a station's configuration from a server: stage 1 (its block of the schedule) as soon as it is heard, stage 2 (a file of any
// kind) when the station may send; then shows with heartbeats that it is alive.
#pragma once

#include <vector>

#include "fieldbus/tdma/station/station.hpp"
#include "fieldbus/tdma/wire/rtcfg_frames.hpp"

namespace hal::tdma::rtcfg {

inline constexpr std::size_t largest_stage_2 = 65536;  ///< bytes

/// [realtime] called by the client
class ClientEvents {
public:
    virtual ~ClientEvents() = default;
    /// Stage 1 from there. Nothing comes of it before accept().
    virtual void on_stage_1(std::span<const std::uint8_t>, const Address& server) noexcept = 0;
    /// All `length` bytes of stage 2 are in `file`, which may be swapped for another of its size; 0: the server has none.
    virtual void on_stage_2(std::vector<std::uint8_t>& file, std::uint32_t length, const Address& server) noexcept = 0;
    virtual void on_dead_station(const Address&) noexcept = 0;
    /// Another server than the accepted one; it is not listened to.
    virtual void on_other_server(const Address&) noexcept = 0;
};

class Client final : public Companion {
public:
    /// `own`: what the server calls this station, beside its MAC address. It asks for stage 2 when `wants_file`. [setup]
    Client(Station& station, Logical own, ClientEvents& events, bool wants_file = true);

    void arrived(std::span<const std::uint8_t> frame, Time now) noexcept override;
    void before_slots(Time now) noexcept override;
    void begin() noexcept;  ///< [realtime] forgets the server
    /// What this server sent as stage 1 is used: it is this station's from now on, and is told so. [realtime]
    void          accept(const Address& server, std::uint16_t heartbeat_ms) noexcept;
    bool          configured() const noexcept { return step_ != Step::waiting; }
    bool          complete() const noexcept { return step_ == Step::ready; }
    std::uint64_t foreign() const noexcept { return foreign_; }  ///< frames that were not acted on: cut, invented, of others

private:
    static constexpr Time patience = 1'000'000'000;
    enum class Step : std::uint8_t { waiting, announcing, receiving, finished, ready };
    void take(const Message&, std::span<const std::uint8_t> data, Time now) noexcept;
    bool send(Message& m) noexcept;
    bool is_for_us(const Message&) const noexcept;

    Station&                                          station_;
    Logical                                           own_;
    ClientEvents&                                     events_;
    const bool                                        wants_file_;
    std::vector<std::uint8_t>                         file_;
    Step                                              step_ = Step::waiting;
    Address                                           server_{};
    std::uint32_t                                     length_ = 0, received_ = 0;
    std::uint8_t                                      burst_ = 4, since_ = 0;  // fragments since the last acknowledgement
    bool                                              acknowledge_ = false;
    std::uint16_t                                     heartbeat_ms_ = 1000;
    std::uint64_t                                     foreign_ = 0;
    Time                                              said_ = INT64_MIN / 2;
    Address                                           reply_to_{};
    bool                                              reply_ = false;
    std::array<std::uint8_t, ethernet::largest_frame> frame_{};
};

}  // namespace hal::tdma::rtcfg
