// SPDX-License-Identifier: MIT
// One SDO server channel (CiA 301): expedited, segmented and block transfer in both directions.
#pragma once

#include <array>
#include <cstdint>

#include "dictionary.hpp"
#include "frames.hpp"
#include "object_transfer.hpp"
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
    void address(const Frame&) noexcept;
    bool select(const Frame&) noexcept;
    bool open_read() noexcept;
    /// Aborts unless a step of the transfer succeeded; returns true when it did.
    bool proceed(Abort why) noexcept {
        if (why != Abort::none) {
            abort(why);
        }
        return why == Abort::none;
    }

    void dispatch(const Frame&) noexcept;
    void start_download(const Frame&) noexcept;
    void expedited_download(const Frame&) noexcept;
    void download_segment(const Frame&) noexcept;
    void start_upload(const Frame&) noexcept;
    void upload_segment(const Frame&) noexcept;
    // Block download: a gap invalidates the rest of the block; the acknowledgement names the last
    // good segment, after which the client continues.
    void start_block_download(const Frame&) noexcept;
    void block_segment(const Frame&) noexcept;
    void acknowledge_block(BlockChange) noexcept;
    void on_block_timeout() noexcept;
    void end_block_download(const Frame&) noexcept;
    // block upload
    void start_block_upload(const Frame&) noexcept;
    void block_upload_command(const Frame&) noexcept;
    void start_blocks() noexcept;
    void on_acknowledgement(const Frame&) noexcept;
    void send_block() noexcept;
    void end_block_upload() noexcept;
    void confirm_block_upload() noexcept;
    Time acknowledge_after() const noexcept {
        return settings_.acknowledge_after > 0 ? settings_.acknowledge_after
                                               : settings_.timeout / 2;
    }

    FrameQueue& out_;
    const SdoServerSettings settings_;
    ObjectTransfer object_;
    BlockReceiver receiver_;
    BlockSender sender_;

    bool on_ = false;
    bool request_extended_ = false;
    std::uint32_t request_id_ = 0;
    std::uint32_t answer_cob_ = 0;
    State state_ = State::idle;
    // state in which the last transfer ended, while its last frame may be repeated
    State ended_ = State::idle;
    std::uint16_t index_ = 0;
    std::uint8_t sub_ = 0;
    std::uint8_t toggle_ = 0;

    Bytes last_request_{};
    Bytes last_answer_{};
    Bytes block_request_{};
    bool repeatable_ = false;
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
