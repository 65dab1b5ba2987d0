// SPDX-License-Identifier: MIT
// One SDO server channel (CiA 301): expedited, segmented and block transfer in both directions.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "dictionary.hpp"
#include "frames.hpp"
#include "sdo_block.hpp"

namespace hal::canopen {

/// Timing of an SDO server.
struct SdoServerSettings {
    /// ns without a frame of the client after which a transfer ends with Abort::timeout
    Time timeout = 1 * second;
    /// block download: ns after which an incomplete block is acknowledged; 0: half of `timeout`
    Time acknowledge_after = 0;
    std::uint8_t block_size = 127;  ///< segments per block of a download, 1..127
    /// answers a repeated segment again instead of aborting with "toggle bit not alternated"
    bool tolerate_repeats = false;
};

/// An SDO server channel on an object dictionary. All calls belong to one thread.
class SdoServer {
public:
    /// Creates a disabled channel; dictionary and queue outlive it. [setup]
    SdoServer(Dictionary&, FrameQueue& out, const SdoServerSettings& = {});

    /// Sets the COB-IDs (1200h:1 and :2); bit 31 in either disables the channel. Drops a transfer
    /// in progress. [realtime]
    void configure(std::uint32_t request_cob, std::uint32_t answer_cob) noexcept;
    /// Returns true for frames that handle() must get. [any]
    bool listens_to(const Frame& f) const noexcept {
        return on_ && f.id == request_id_ && f.extended == request_extended_ && !f.remote;
    }
    /// Processes a request for which listens_to() returned true. [realtime]
    void handle(const Frame&, Time now) noexcept;
    /// Checks timeouts and sends what did not fit into the queue; call it once per cycle.
    /// [realtime]
    void poll(Time now) noexcept;
    /// Drops a transfer without an abort frame: the node was reset or stopped. [realtime]
    void reset() noexcept;

    /// Returns true while a transfer is in progress. [any]
    bool busy() const noexcept { return state_ != State::idle; }
    /// Returns the number of completed transfers. [any]
    std::uint64_t transfers() const noexcept { return transfers_; }
    /// Returns the number of aborted transfers. [any]
    std::uint64_t aborted() const noexcept { return aborted_; }
    /// Returns the last abort code, of either side. [any]
    Abort last_abort() const noexcept { return last_abort_; }

private:
    enum class State : std::uint8_t {
        idle,
        download,
        upload,
        block_download,
        block_download_end,
        block_upload_start,
        block_upload,
        block_upload_end,
    };
    using Bytes = std::array<std::uint8_t, 8>;

    void answer(const Bytes&) noexcept;
    void answer_initiate(std::uint8_t command, std::uint32_t value) noexcept;
    void abort(Abort, bool notify = true) noexcept;
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
    void send_block() noexcept;
    void acknowledge_block(BlockChange) noexcept;
    void on_block_timeout() noexcept;
    Time acknowledge_after() const noexcept {
        return settings_.acknowledge_after > 0 ? settings_.acknowledge_after
                                               : settings_.timeout / 2;
    }
    void end_block_upload() noexcept;

    bool open_read() noexcept;
    Abort open_write(std::uint32_t size) noexcept;
    Abort write_object(std::span<const std::uint8_t>) noexcept;
    Abort read_object(std::uint32_t offset, std::span<std::uint8_t>) noexcept;
    Abort commit() noexcept;

    Dictionary& dictionary_;
    FrameQueue& out_;
    const SdoServerSettings settings_;
    std::unique_ptr<std::uint8_t[]> scratch_;  // holds values other than domains during a transfer
    const std::size_t scratch_size_;

    bool on_ = false;
    bool request_extended_ = false;
    std::uint32_t request_id_ = 0;
    std::uint32_t answer_cob_ = 0;
    State state_ = State::idle;
    Entry* entry_ = nullptr;
    std::uint16_t index_ = 0;
    std::uint8_t sub_ = 0;
    bool writing_ = false;
    bool stream_open_ = false;
    std::uint8_t toggle_ = 0;
    bool crc_used_ = false;
    bool size_known_ = false;
    std::uint32_t size_ = 0;  // as announced, or of the value that is sent
    std::uint32_t offset_ = 0;  // bytes transferred; block upload: where the block begins
    // block transfer
    std::uint8_t block_size_ = 0;
    std::uint8_t sequence_ = 0;
    std::uint8_t held_count_ = 0;
    std::uint8_t unused_ = 0;
    bool last_seen_ = false;
    bool block_sent_ = false;
    bool block_any_ = false;
    bool gap_ = false;  // a segment of this block is missing
    // the block was acknowledged before its end: ignore the rest until a new block begins
    bool acknowledged_early_ = false;
    std::size_t block_end_ = 0;  // FrameQueue::popped() once the whole block has left the queue
    // the end frame carries the number of valid bytes in the last segment
    std::array<std::uint8_t, 7> held_{};
    std::uint8_t acknowledged_ = 0;
    std::uint16_t crc_ = 0;
    std::uint16_t last_acknowledgement_ = 0;
    std::uint32_t crc_until_ = 0;

    Bytes last_request_{};
    Bytes last_answer_{};
    Bytes block_request_{};
    bool repeatable_ = false;
    // state in which the last transfer ended, while its last frame may be repeated
    State ended_ = State::idle;
    bool pending_ = false;  // last_answer_ did not fit into the queue
    Time heard_ = 0;
    Time reminded_ = 0;
    Time acknowledged_at_ = 0;
    Time now_ = 0;
    std::uint64_t transfers_ = 0;
    std::uint64_t aborted_ = 0;
    Abort last_abort_ = Abort::none;
};

}  // namespace hal::canopen
