// SPDX-License-Identifier: MIT
// One SDO client channel (CiA 301) with a queue of requests. A master has one channel per node, so
// all nodes are served concurrently.
//
//     std::array<std::uint8_t, 4> buffer;
//     SdoRequest read{.index = 0x1018, .sub = 1, .upload = true, .buffer = buffer};
//     client.configure(5);                    // the default channel of node 5
//     client.submit(read);                    // `read` and its buffer must outlive the transfer
//     each cycle:
//         while (link.receive(frame, now))
//             if (client.listens_to(frame)) client.handle(frame, now);
//         client.poll(now);
//         if (read.ok()) use(load<std::uint32_t>(buffer.data()));      // the vendor ID
//         else if (read.done()) report(to_string(read.abort));
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "frames.hpp"
#include "numbers.hpp"
#include "sdo_block.hpp"

namespace hal::canopen {

/// The SDO protocol of a request. Values of up to 4 bytes are transferred expedited in the first
/// two modes.
enum class SdoMode : std::uint8_t {
    /// block transfer for downloads of at least SdoClientSettings::block_from bytes, else segmented
    automatic,
    segmented,  ///< never block transfer
    block,  ///< block transfer; segmented if the server does not support it
};

/// One SDO transfer. The caller fills in the first part and keeps the request and its memory until
/// done().
struct SdoRequest {
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    bool upload = false;  ///< true: read the object; false: write it
    SdoMode mode = SdoMode::automatic;
    std::span<const std::uint8_t> data{};  ///< download: the value, little endian
    /// upload: receives the value; too small a buffer ends the request with Abort::memory
    std::span<std::uint8_t> buffer{};
    /// called by poll(), handle() or cancel(); may submit again. [realtime]
    void (*on_done)(SdoRequest&, void*) noexcept = nullptr;
    void* context = nullptr;  ///< the second argument of on_done

    // Written by the client.
    enum class Status : std::uint8_t { fresh, waiting, active, done };
    Status status = Status::fresh;
    Abort abort = Abort::none;  ///< none: success
    bool aborted_by_server = false;  ///< true: the server sent `abort`; false: the client did
    bool not_sent = false;  ///< the client timed out because the bus accepted no frames
    std::size_t size = 0;  ///< bytes transferred
    unsigned retries = 0;  ///< repeated frames and restarted transfers
    SdoRequest* next = nullptr;  ///< the next request in the queue

    /// Returns true once the transfer has ended, successfully or not. [any]
    bool done() const noexcept { return status == Status::done; }
    /// Returns true once the transfer has ended successfully. [any]
    bool ok() const noexcept { return done() && abort == Abort::none; }
};

/// Timing and retries of an SDO client.
struct SdoClientSettings {
    Time timeout = 500 * millisecond;  ///< response timeout in ns, after which a frame is repeated
    unsigned resends = 2;  ///< repeated frames per response
    /// restarts of a transfer that failed for a transient reason
    unsigned restarts = 1;
    std::uint8_t block_size = 127;  ///< segments per block of an upload, 1..127
    std::size_t block_from = 1000;  ///< bytes from which SdoMode::automatic uses block transfer
};

/// An SDO client channel. It does one transfer at a time, in the order of submit(). All calls
/// belong to one thread.
class SdoClient {
public:
    /// Creates a channel that sends through `out`, which outlives it. [setup]
    SdoClient(FrameQueue& out, const SdoClientSettings& = {});

    /// Sets the COB-IDs (1280h:1 and :2); bit 31 in either disables the channel. Ends all requests
    /// with Abort::no_resource. [realtime]
    void configure(std::uint32_t request_cob, std::uint32_t answer_cob) noexcept;
    /// Sets the predefined COB-IDs of node 1..127. [realtime]
    void configure(std::uint8_t node) noexcept { configure(0x600U + node, 0x580U + node); }
    /// Returns true for frames that handle() must get. [any]
    bool listens_to(const Frame& f) const noexcept {
        return f.id == answer_id_ && f.extended == answer_extended_ && !f.remote;
    }

    /// Queues a request; it starts at the next poll(). Returns false if the request is already
    /// queued. [realtime]
    bool submit(SdoRequest&) noexcept;
    /// Ends one request with `why`; a transfer in progress is aborted on the bus. [realtime]
    void cancel(SdoRequest&, Abort why = Abort::general) noexcept;
    /// Ends all queued requests with `why`. [realtime]
    void cancel_all(Abort why = Abort::general) noexcept;
    /// Processes a response of the server. [realtime]
    void handle(const Frame&, Time now) noexcept;
    /// Starts requests, sends segments and checks timeouts; call it once per cycle. [realtime]
    void poll(Time now) noexcept;
    /// Returns true if no request is queued. [any]
    bool idle() const noexcept { return first_ == nullptr; }

    /// Returns the settings; changes apply from the next frame on. [realtime]
    SdoClientSettings& settings() noexcept { return settings_; }
    /// Returns the number of responses that match no pending request. [any]
    std::uint64_t unexpected_responses() const noexcept { return unexpected_; }
    /// Returns the number of repeated frames and restarted transfers. [any]
    std::uint64_t retries() const noexcept { return retries_; }
    /// Returns the bytes of the transfer in progress that the other side has confirmed, or that
    /// were received; 0 when none is. Not for another thread.
    std::size_t transferred() const noexcept { return first_ != nullptr ? offset_ : 0; }
    /// Returns the bytes of the transfer in progress; 0 when the server has not announced them.
    std::size_t announced() const noexcept { return first_ != nullptr ? size_ : 0; }

private:
    /// dispatch() has the handler of each, in this order.
    enum class State : std::uint8_t {
        idle,
        download_start,
        download,
        upload_start,
        upload,
        block_download_start,
        block_download,
        block_download_end,
        block_upload_start,
        block_upload,
        block_upload_end,
    };
    using Bytes = std::array<std::uint8_t, 8>;

    void dispatch(const Frame&) noexcept;
    void begin() noexcept;
    void begin_mode(bool block) noexcept;
    void begin_upload(bool block) noexcept;
    void begin_download(bool block) noexcept;
    void send(const Bytes&) noexcept;
    void send_again() noexcept;
    void send_initiate(std::uint8_t command, std::uint32_t value) noexcept;
    void send_segment() noexcept;
    void send_block() noexcept;
    void send_block_end() noexcept;
    void acknowledge_block(BlockChange) noexcept;
    void finish(Abort, bool by_server = false) noexcept;
    void abort(Abort) noexcept;
    void restart_or_fail(Abort, bool by_server) noexcept;
    void on_abort(const Frame&) noexcept;
    void on_download_start(const Frame&) noexcept;
    void on_download_segment(const Frame&) noexcept;
    void on_upload_start(const Frame&) noexcept;
    void on_upload_segment(const Frame&) noexcept;
    void on_block_download_start(const Frame&) noexcept;
    void on_block_acknowledge(const Frame&) noexcept;
    void on_block_upload_start(const Frame&) noexcept;
    void on_block_segment(const Frame&) noexcept;
    void on_block_download_end(const Frame&) noexcept;
    void on_block_end(const Frame&) noexcept;
    void on_timeout() noexcept;
    void queue_full() noexcept;
    bool store_received(std::span<const std::uint8_t>) noexcept;
    bool starting() const noexcept;
    /// Counts a block without progress. Returns false when there were too many.
    bool count_stall() noexcept { return ++stalls_ <= 4 + settings_.resends; }
    void count_retry() noexcept {
        ++retries_;
        ++first_->retries;
    }
    void restart_timer() noexcept {
        last_received_ = now_;
        resends_left_ = settings_.resends;
    }
    void ignore(Abort why) noexcept {
        ++unexpected_;
        last_error_ = why;
    }
    bool concerns_request(const Frame&) const noexcept;

    FrameQueue& out_;
    SdoClientSettings settings_;
    std::uint32_t request_cob_ = cob_invalid;
    std::uint32_t answer_id_ = 0xffffffff;
    bool answer_extended_ = false;

    SdoRequest* first_ = nullptr;
    SdoRequest* last_ = nullptr;
    State state_ = State::idle;
    BlockSender sender_;
    BlockReceiver receiver_;
    std::uint8_t toggle_ = 0;
    bool in_block_ = false;
    bool block_refused_ = false;
    bool size_known_ = false;
    bool pending_ = false;  // sent_ did not fit into the queue
    std::uint32_t offset_ = 0;  // bytes that were confirmed or received
    std::uint32_t size_ = 0;
    std::uint32_t segment_ = 0;  // bytes of the segment that awaits its confirmation
    unsigned resends_left_ = 0;
    unsigned restarts_left_ = 0;
    unsigned stalls_ = 0;
    Abort last_error_ = Abort::none;  // of the responses dropped since the last valid one
    Bytes sent_{};
    Time last_received_ = 0;
    Time now_ = 0;
    Time queue_full_since_ = -1;  // -1: the queue has space
    std::size_t popped_ = 0;  // of out_ at the last poll
    std::uint64_t unexpected_ = 0;
    std::uint64_t retries_ = 0;
};

}  // namespace hal::canopen
