// SPDX-License-Identifier: MIT
// Gets the configuration of a station from a server (RTnet, Documentation/RTcfg): stage 1 (its
// block of the schedule) as soon as it is received, stage 2 (any file) when the station may send;
// then sends heartbeats.
#pragma once

#include <vector>

#include "fieldbus/tdma/station/station.hpp"
#include "fieldbus/tdma/wire/rtcfg_frames.hpp"
#include "hal/task.hpp"

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

class Client final : public Companion, private hal::TaskChannel {
public:
    /// `own`: identifies this station besides its MAC address. Requests stage 2 when `wants_file`.
    /// [setup]
    Client(Station& station, Logical own, ClientEvents& events, bool wants_file = true);

    void arrived(std::span<const std::uint8_t> frame, Time now) noexcept override;
    void before_slots(Time now) noexcept override;
    void begin() noexcept;  ///< forgets the server. [realtime]
    /// Accepts a server whose stage 1 is used, and announces this station to it. [realtime]
    void accept(const Address& server, std::uint16_t heartbeat_ms) noexcept;
    /// A server was accepted. [realtime]
    bool configured() const noexcept { return busy(); }
    /// The stage 2 file, if wanted, is complete, and the server knows it. [realtime]
    bool complete() const noexcept { return ready_; }
    /// frames ignored: truncated, forged, of others
    std::uint64_t foreign() const noexcept { return foreign_; }

private:
    static constexpr Time retry_after = 1'000'000'000;
    static constexpr std::size_t task_bytes = 2048;
    enum class File : std::uint8_t { not_announced, expected, arriving, complete };

    /// Waits for the next slots of the station: a task may send then.
    struct NextSlots {
        Client& client;
        bool await_ready() const noexcept { return false; }
        void await_suspend(std::coroutine_handle<> task) const noexcept { client.suspend(task); }
        void await_resume() const noexcept {}
    };
    NextSlots next_slots() noexcept { return {*this}; }
    hal::Task<> work() noexcept;
    hal::Task<> receive_file() noexcept;
    hal::Task<> sent(Id) noexcept;

    Message message(Id) const noexcept;
    bool send(Message) noexcept;
    bool send(Id) noexcept;
    bool is_late() const noexcept { return now_ - sent_at_ >= retry_after; }
    bool arrived_stage_1(const Message&) noexcept;
    bool arrived_stage_2(const Message&) noexcept;
    bool arrived_fragment(const Message&) noexcept;
    bool arrived(const Message&) noexcept;
    void store(std::uint32_t offset, std::span<const std::uint8_t> data) noexcept;
    bool is_for_us(const Message&) const noexcept;

    Station& station_;
    Logical own_;
    ClientEvents& events_;
    const bool wants_file_;
    std::vector<std::uint8_t> file_;
    File file_state_ = File::not_announced;
    bool ready_ = false;
    Address server_{};
    std::uint32_t length_ = 0;
    std::uint32_t received_ = 0;
    // fragments since the last acknowledgement
    std::uint8_t burst_ = 4;
    std::uint8_t since_ = 0;
    bool acknowledge_ = false;
    std::uint16_t heartbeat_ms_ = 1000;
    std::uint64_t foreign_ = 0;
    Time now_ = 0;
    // when the newest frame to the server was sent, or one of the file received
    Time sent_at_ = INT64_MIN / 2;
    Address reply_to_{};
    bool reply_ = false;
    std::array<std::uint8_t, ethernet::max_frame> frame_{};
};

}  // namespace hal::tdma::rtcfg
