// SPDX-License-Identifier: MIT
// Gets the configuration of a station from a server (RTnet, Documentation/RTcfg): stage 1 (its
// block of the schedule) as soon as it is received, stage 2 (any file) when the station may send;
// then sends heartbeats.
#pragma once

#include <vector>

#include "fieldbus/tdma/station/station.hpp"
#include "fieldbus/tdma/wire/rtcfg_frames.hpp"

namespace hal::tdma::rtcfg {

inline constexpr std::size_t max_stage_2_size = 65536;  ///< bytes

/// Events of the client. [realtime]
class ClientEvents {
public:
    virtual ~ClientEvents() = default;
    /// Stage 1 received; accept() uses it.
    virtual void on_stage_1(std::span<const std::uint8_t>, const Address& server) noexcept = 0;
    /// Stage 2 is complete: `length` bytes in `file`, which may be swapped for another vector of
    /// its size; 0: the server has no file.
    virtual void on_stage_2(std::vector<std::uint8_t>& file, std::uint32_t length,
                            const Address& server) noexcept = 0;
    /// The server reports a dead station.
    virtual void on_dead_station(const Address&) noexcept = 0;
    /// Ignored a second server.
    virtual void on_other_server(const Address&) noexcept = 0;
};

class Client final : public Companion {
public:
    /// `own`: identifies this station besides its MAC address. Requests stage 2 when `wants_file`. [setup]
    Client(Station& station, Logical own, ClientEvents& events, bool wants_file = true);

    void arrived(std::span<const std::uint8_t> frame, Time now) noexcept override;
    void before_slots(Time now) noexcept override;
    void begin() noexcept;  ///< forgets the server. [realtime]
    /// Accepts a server whose stage 1 is used, and announces this station to it. [realtime]
    void accept(const Address& server, std::uint16_t heartbeat_ms) noexcept;
    bool configured() const noexcept { return step_ != Step::waiting; }
    bool complete() const noexcept { return step_ == Step::ready; }
    /// frames ignored: truncated, forged, of others
    std::uint64_t foreign() const noexcept { return foreign_; }

private:
    static constexpr Time retry_after = 1'000'000'000;
    enum class Step : std::uint8_t { waiting, announcing, receiving, finished, ready };
    void take(const Message&, std::span<const std::uint8_t> data, Time now) noexcept;
    bool send(Message& m) noexcept;
    bool is_for_us(const Message&) const noexcept;

    Station& station_;
    Logical own_;
    ClientEvents& events_;
    const bool wants_file_;
    std::vector<std::uint8_t> file_;
    Step step_ = Step::waiting;
    Address server_{};
    std::uint32_t length_ = 0;
    std::uint32_t received_ = 0;
    // fragments since the last acknowledgement
    std::uint8_t burst_ = 4;
    std::uint8_t since_ = 0;
    bool acknowledge_ = false;
    std::uint16_t heartbeat_ms_ = 1000;
    std::uint64_t foreign_ = 0;
    Time sent_at_ = INT64_MIN / 2;
    Address reply_to_{};
    bool reply_ = false;
    std::array<std::uint8_t, ethernet::largest_frame> frame_{};
};

}  // namespace hal::tdma::rtcfg
