// SPDX-License-Identifier: MIT
// Takes a station's configuration from a server: stage 1 (its block of the schedule) as soon as it is heard, stage 2 (a file of any
// kind) when the station may send; then shows with heartbeats that it is alive.
#pragma once

#include <vector>

#include "rtcfg_frames.hpp"
#include "station.hpp"

namespace hal::tdma::rtcfg {

/// [realtime] called by the client
class ClientEvents {
public:
    virtual ~ClientEvents() = default;
    virtual void on_stage_1(std::span<const std::uint8_t>) noexcept = 0;
    virtual void on_stage_2(std::span<const std::uint8_t>) noexcept = 0;
    virtual void on_dead_station(const Address&) noexcept = 0;
};

class Client final : public Companion {
public:
    /// `own`: what the server calls this station, beside its MAC address. `most` bytes are taken as stage 2. [setup]
    Client(Station& station, Logical own, ClientEvents& events, std::size_t most = 65536);

    void arrived(std::span<const std::uint8_t> frame, Time now) noexcept override;
    void before_slots(Time now) noexcept override;
    void begin() noexcept;  ///< [realtime] forgets the server
    bool configured() const noexcept { return step_ != Step::waiting; }
    bool complete() const noexcept { return step_ == Step::ready; }

private:
    static constexpr Time patience = 1'000'000'000;
    enum class Step : std::uint8_t { waiting, announcing, receiving, finished, ready };
    void take(const Message&, std::span<const std::uint8_t> data, Time now) noexcept;
    bool send(Message& m) noexcept;

    Station&                  station_;
    Logical                   own_;
    ClientEvents&             events_;
    std::vector<std::uint8_t> file_;
    Step                      step_ = Step::waiting;
    Address                   server_{};
    std::uint32_t             length_ = 0, received_ = 0;
    std::uint8_t              burst_ = 4, since_ = 0;  // fragments since the last acknowledgement
    bool                      acknowledge_ = false;
    std::uint16_t             heartbeat_ms_ = 1000;
    Time                      said_ = INT64_MIN / 2;
    Address                   reply_to_{};
    bool                      reply_ = false;
    std::array<std::uint8_t, ethernet::largest_frame> frame_{};
};

}  // namespace hal::tdma::rtcfg
