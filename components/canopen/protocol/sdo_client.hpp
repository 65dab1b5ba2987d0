// SPDX-License-Identifier: MIT
// One SDO client channel with a line of requests. A master has one for each node, so nodes are served side by side.
//
//     SdoRequest read{.index = 0x1018, .sub = 1, .upload = true, .room = room};
//     client.submit(read);            // `read` and its memory stay where they are until it is done
//     ... client.poll(now); client.handle(frame, now); ...
//     if (read.done()) use(read.abort, read.size);
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "frames.hpp"
#include "numbers.hpp"

namespace hal::canopen {

enum class SdoMode : std::uint8_t {
    automatic,  ///< downloads of many bytes go by blocks, the rest expedited or by segments; by segments, too, when blocks broke
    segmented,
    block,      ///< by segments when the server refuses
};

struct SdoRequest {
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    bool upload = false;
    SdoMode mode = SdoMode::automatic;
    std::span<const std::uint8_t> data{};  ///< what to write
    std::span<std::uint8_t> room{};        ///< where to put what was read
    void (*on_done)(SdoRequest&, void*) noexcept = nullptr;  ///< [realtime] called by poll() or handle(); may submit again
    void* context = nullptr;

    // The client's part.
    enum class Status : std::uint8_t { fresh, waiting, active, done };
    Status status = Status::fresh;
    Abort abort = Abort::none;     ///< none: it worked
    bool aborted_by_server = false;    ///< the server refused; otherwise the client gave up
    bool unsent = false;           ///< it gave up because there was no room to send for all of its patience: the bus takes no frames
    std::size_t size = 0;          ///< bytes through
    unsigned retries = 0;          ///< frames sent again and transfers begun again
    SdoRequest* next = nullptr;

    bool done() const noexcept { return status == Status::done; }
    bool ok() const noexcept { return done() && abort == Abort::none; }
};

struct SdoClientSettings {
    Time timeout = 500 * millisecond;  ///< silence after which a frame is sent again
    unsigned resends = 2;              ///< how often
    unsigned restarts = 1;             ///< how often a transfer that broke on the way is begun anew
    std::uint8_t block_size = 127;
    std::size_t block_from = 1000;     ///< bytes from which a download in automatic mode goes by blocks
};

class SdoClient {
public:
    SdoClient(FrameQueue& out, const SdoClientSettings& = {});  // [setup]

    /// COB-IDs as object 1280h holds them. Ends what is under way. [realtime]
    void configure(std::uint32_t request_cob, std::uint32_t answer_cob) noexcept;
    /// The default channel of that node.
    void configure(std::uint8_t node) noexcept { configure(0x600U + node, 0x580U + node); }
    bool listens_to(const Frame& f) const noexcept { return f.id == answer_id_ && f.extended == answer_extended_ && !f.remote; }

    /// Puts the request at the end of the line; one that is in a line already is not taken. Starts at the next poll. [realtime]
    bool submit(SdoRequest&) noexcept;
    /// Ends one request, or all: an abort is sent for what is under way. [realtime]
    void cancel(SdoRequest&, Abort why = Abort::general) noexcept;
    void cancel_all(Abort why = Abort::general) noexcept;
    void handle(const Frame&, Time now) noexcept;
    void poll(Time now) noexcept;
    bool idle() const noexcept { return first_ == nullptr; }

    SdoClientSettings& settings() noexcept { return settings_; }
    std::uint64_t unexpected_responses() const noexcept { return unexpected_; }  ///< responses to no pending request
    std::uint64_t retries() const noexcept { return retries_; }

private:
    enum class State : std::uint8_t {
        idle, download_start, download, upload_start, upload,
        block_download_start, block_download, block_download_end, block_upload_start, block_upload, block_upload_end,
    };
    using Bytes = std::array<std::uint8_t, 8>;

    void take(const Frame&) noexcept;
    void begin() noexcept;
    void begin_mode(bool block) noexcept;
    void send(const Bytes&) noexcept;
    void send_again() noexcept;
    void send_initiate(std::uint8_t command, std::uint32_t value) noexcept;
    void send_segment() noexcept;
    void pump() noexcept;
    void send_block_end() noexcept;
    enum class Size : std::uint8_t { smaller, same, larger };
    void acknowledge_block(Size next) noexcept;
    void finish(Abort, bool there = false) noexcept;
    void give_up(Abort) noexcept;
    void broke(Abort, bool there) noexcept;
    void on_abort(const Frame&) noexcept;
    void on_upload_start(const Frame&) noexcept;
    void on_upload_segment(const Frame&) noexcept;
    void on_block_segment(const Frame&) noexcept;
    void on_block_acknowledge(const Frame&) noexcept;
    void on_block_end(const Frame&) noexcept;
    void silence() noexcept;
    void no_room() noexcept;
    bool put(std::span<const std::uint8_t>) noexcept;
    void progress() noexcept { heard_ = now_, resends_left_ = settings_.resends; }
    void stranger(Abort why) noexcept { ++unexpected_, wrong_ = why; }
    bool is_about(const Frame&) const noexcept;

    FrameQueue& out_;
    SdoClientSettings settings_;
    std::uint32_t request_cob_ = cob_invalid, answer_id_ = 0xffffffff;
    bool answer_extended_ = false;

    SdoRequest* first_ = nullptr;
    SdoRequest* last_ = nullptr;
    State state_ = State::idle;
    std::uint8_t toggle_ = 0, block_size_ = 0, sequence_ = 0, acknowledged_ = 0, held_count_ = 0, last_command_ = 0;
    bool crc_used_ = false, block_sent_ = false, last_seen_ = false, block_refused_ = false, in_block_ = false;
    bool size_told_ = false, pending_ = false, heard_block_ = false, block_any_ = false;
    bool gap_ = false;         // a segment of this block did not come
    bool cut_short_ = false;   // the block was acknowledged before its end: the rest of it does not count until a block begins
    std::size_t block_end_ = 0;  // of a block that is sent: FrameQueue::taken() when all of it has left
    std::array<std::uint8_t, 7> held_{};
    std::uint16_t crc_ = 0, last_acknowledgement_ = 0;
    std::uint32_t crc_until_ = 0, offset_ = 0, size_ = 0;
    std::uint32_t segment_ = 0;  // bytes of the segment that waits for its confirmation
    unsigned resends_left_ = 0, restarts_left_ = 0, stalls_ = 0;
    Abort wrong_ = Abort::none;  // what was wrong with the answers dropped since the last good one
    Bytes sent_{};
    Time heard_ = 0, acknowledged_at_ = 0, now_ = 0;
    Time full_since_ = -1;    // since when there is no room for what it has to say
    std::size_t taken_ = 0;  // of out_, when room was looked for last
    std::uint64_t unexpected_ = 0, retries_ = 0;
};

}  // namespace hal::canopen
