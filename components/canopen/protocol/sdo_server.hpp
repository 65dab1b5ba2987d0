// SPDX-License-Identifier: MIT
// One SDO server channel: expedited, segmented and block transfer in both directions.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "dictionary.hpp"
#include "frames.hpp"

namespace hal::canopen {

struct SdoServerSettings {
    Time timeout = 1 * second;       ///< silence of the client that ends a transfer
    /// Block download: silence in a block after which what came of it is acknowledged; 0: half of `timeout`.
    Time acknowledge_after = 0;
    std::uint8_t block_size = 127;   ///< segments per block of a download
    bool tolerate_repeats = false;   ///< a segment that comes twice is answered again instead of aborted with "toggle bit not alternated"
};

class SdoServer {
public:
    SdoServer(Dictionary&, FrameQueue& out, const SdoServerSettings& = {});  // [setup]

    /// COB-IDs as object 1200h holds them; with bit 31 in either the channel is off. Ends a transfer under way. [realtime]
    void configure(std::uint32_t request_cob, std::uint32_t answer_cob) noexcept;
    bool listens_to(const Frame& f) const noexcept { return on_ && f.id == request_id_ && f.extended == request_extended_ && !f.remote; }
    /// A frame listens_to() said yes to. [realtime]
    void handle(const Frame&, Time now) noexcept;
    /// Time-outs, and what found no room in the queue. [realtime]
    void poll(Time now) noexcept;
    /// Drops a transfer without a word: the node was reset or stopped. [realtime]
    void reset() noexcept;

    bool busy() const noexcept { return state_ != State::idle; }
    std::uint64_t transfers() const noexcept { return transfers_; }
    std::uint64_t aborted() const noexcept { return aborted_; }
    Abort last_abort() const noexcept { return last_abort_; }

private:
    enum class State : std::uint8_t {
        idle, download, upload, block_download, block_download_end, block_upload_start, block_upload, block_upload_end,
    };
    using Bytes = std::array<std::uint8_t, 8>;

    void answer(const Bytes&) noexcept;
    void answer_initiate(std::uint8_t command, std::uint32_t value) noexcept;
    void abort(Abort, bool tell = true) noexcept;
    void finish() noexcept;
    Entry* select(const Frame&) noexcept;

    void start_download(const Frame&) noexcept;
    void download_segment(const Frame&) noexcept;
    void start_upload(const Frame&) noexcept;
    void upload_segment(const Frame&) noexcept;
    void start_block_download(const Frame&) noexcept;
    void block_segment(const Frame&) noexcept;
    void end_block_download(const Frame&) noexcept;
    void start_block_upload(const Frame&) noexcept;
    void block_upload_command(const Frame&) noexcept;
    void pump() noexcept;
    enum class Size : std::uint8_t { smaller, same, larger };
    void acknowledge_block(Size next) noexcept;
    void on_silence_in_block() noexcept;
    Time acknowledge_after() const noexcept {
        return settings_.acknowledge_after > 0 ? settings_.acknowledge_after : settings_.timeout / 2;
    }
    void end_block_upload() noexcept;

    bool open_read() noexcept;
    Abort open_write(std::uint32_t size) noexcept;
    Abort take(std::span<const std::uint8_t>) noexcept;
    Abort give(std::uint32_t offset, std::span<std::uint8_t>) noexcept;
    Abort commit() noexcept;

    Dictionary& dictionary_;
    FrameQueue& out_;
    const SdoServerSettings settings_;
    std::unique_ptr<std::uint8_t[]> scratch_;  // values that are no domain are collected and given out from here
    const std::size_t scratch_size_;

    bool on_ = false, request_extended_ = false;
    std::uint32_t request_id_ = 0, answer_cob_ = 0;
    State state_ = State::idle;
    Entry* entry_ = nullptr;
    std::uint16_t index_ = 0;
    std::uint8_t sub_ = 0;
    bool writing_ = false, stream_open_ = false;
    std::uint8_t toggle_ = 0;
    bool crc_used_ = false, size_told_ = false;
    std::uint32_t size_ = 0;    // told, or of what is sent
    std::uint32_t offset_ = 0;  // bytes through; block upload: where the block begins
    // block transfer
    std::uint8_t block_size_ = 0, sequence_ = 0, held_count_ = 0, unused_ = 0;
    bool last_seen_ = false, block_sent_ = false, block_any_ = false;
    bool gap_ = false;         // a segment of this block did not come
    bool cut_short_ = false;   // the block was acknowledged before its end: the rest of it does not count until a block begins
    std::size_t block_end_ = 0;  // of a block that is sent: FrameQueue::taken() when all of it has left
    std::array<std::uint8_t, 7> held_{};  // how much of the last segment counts is known only at the end
    std::uint8_t acknowledged_ = 0;
    std::uint16_t crc_ = 0, last_acknowledgement_ = 0;
    std::uint32_t crc_until_ = 0;

    Bytes last_request_{}, last_answer_{}, block_request_{};
    bool repeatable_ = false;
    State ended_ = State::idle;    // what the last transfer was, as long as its last frame may come again
    bool pending_ = false;         // last_answer_ found no room
    Time heard_ = 0, reminded_ = 0, acknowledged_at_ = 0, now_ = 0;
    std::uint64_t transfers_ = 0, aborted_ = 0;
    Abort last_abort_ = Abort::none;
};

}  // namespace hal::canopen
