// SPDX-License-Identifier: MIT
// SDO block transfer (CiA 301): both sides of the segments of a block, which are the same for
// client and server. A sender numbers the segments of a block from 1; the receiver acknowledges the
// number of those that arrived in sequence and asks for the size of the next block. A gap
// invalidates the rest of the block: the sender continues after the acknowledged segment.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "frames.hpp"
#include "numbers.hpp"

namespace hal::canopen {

/// How the next block compares with this one: smaller after a lost segment, larger after a complete
/// block.
enum class BlockChange : std::uint8_t { smaller, same, larger };

/// Returns true for a number of segments that a block may have. [any]
constexpr bool is_block_size(unsigned size) noexcept { return size >= 1 && size <= 127; }

/// Returns the size of the next block, 1..127 segments. `good` is the number of segments just
/// received in sequence, `acknowledged` that of the previous acknowledgement, `max` the configured
/// limit. After a loss the size differs from the size before and from `good`, so that two
/// successive acknowledgements are never equal and the sender can recognise a duplicate. [any]
constexpr std::uint8_t next_block_size(std::uint8_t size, BlockChange change, std::uint8_t good,
                                       std::uint8_t acknowledged, std::uint8_t max) noexcept {
    const unsigned limit = std::clamp<unsigned>(max, 1, 127);
    const auto larger = static_cast<std::uint8_t>(std::min(size * 2U, limit));
    const auto after_loss = [&] {
        if (limit <= 2) return larger;
        unsigned next = size > 1 ? size / 2U : 2;
        while (next == good || next == size) {
            ++next;
        }
        return static_cast<std::uint8_t>(next);
    };
    auto next = size;
    if (change == BlockChange::smaller) {
        next = after_loss();
    } else if (change == BlockChange::larger) {
        next = larger;
    }
    return good == acknowledged && next == size && good != size ? after_loss() : next;
}

/// The receiver of blocks. The last segment is held back until the next one or the end frame, which
/// has the number of its valid bytes. [realtime]
class BlockReceiver {
public:
    enum class Arrived : std::uint8_t {
        ignored,  ///< of a block that was acknowledged before its end
        repeated,  ///< the last segment of the previous block: its acknowledgement was lost
        duplicate,  ///< of this block
        out_of_order,
        in_order,
        failed,  ///< the segment before could not be stored
    };
    /// Starts with blocks of `size` segments.
    void begin(std::uint8_t size) noexcept {
        *this = {};
        size_ = size;
    }
    void use_crc(bool used) noexcept { crc_used_ = used; }
    /// Returns true for the next segment in sequence.
    bool expects(const Frame& f) const noexcept { return (f.data[0] & 0x7f) == sequence_ + 1; }
    /// Processes a segment; `store` receives the one before, and returns false when that fails.
    template <class Store>
    Arrived accept(const Frame& f, Store&& store) noexcept {
        const unsigned number = f.data[0] & 0x7f;
        if (acknowledged_early_ && number != 1) return Arrived::ignored;
        if (repeats_acknowledged(f, number)) return Arrived::repeated;
        acknowledged_early_ = false;
        any_ = true;
        if (number != sequence_ + 1U || number > size_) return misplaced(f, number);
        if (holds_) {
            update_crc();
            if (!store(std::span<const std::uint8_t>(held_))) return Arrived::failed;
        }
        hold(f);
        return Arrived::in_order;
    }
    /// Returns true when the block ends with this segment.
    bool ends_with(const Frame& f) const noexcept {
        return (f.data[0] & 0x7f) == size_ || (f.data[0] & 0x80) != 0;
    }
    /// Ends the block; the next has another size, at most `max`. Returns the number of segments to
    /// acknowledge.
    std::uint8_t acknowledge(BlockChange, std::uint8_t max) noexcept;
    /// Ignores the rest of the block, which was acknowledged before its end.
    void ignore_rest() noexcept { acknowledged_early_ = true; }

    /// Returns how the next block compares with this one when it ends with `complete`.
    BlockChange change(BlockChange complete) const noexcept {
        return gap_ ? BlockChange::smaller : complete;
    }
    std::uint8_t size() const noexcept { return size_; }  ///< of the block
    std::uint8_t acknowledged() const noexcept { return acknowledged_; }
    bool any() const noexcept { return any_; }  ///< a segment of this block arrived
    bool holds() const noexcept { return holds_; }  ///< a segment of the transfer arrived
    bool last_seen() const noexcept { return last_seen_; }
    bool crc_used() const noexcept { return crc_used_; }
    /// Returns the valid bytes of the last segment.
    std::span<const std::uint8_t> rest(const Frame& end) const noexcept {
        return {held_.data(), 7U - (end.data[0] >> 2 & 7)};
    }
    /// Returns true when the checksum of an end frame is that of the data.
    bool crc_matches(const Frame& end) const noexcept {
        return crc16(rest(end), crc_) == load<std::uint16_t>(end.data.data() + 1);
    }
    /// Returns true for a frame that repeats the last segment.
    bool repeats_last(const Frame& f) const noexcept {
        return f.data[0] == last_command_ && has_held_bytes(f);
    }

private:
    bool has_held_bytes(const Frame& f) const noexcept {
        return std::equal(held_.begin(), held_.end(), f.data.begin() + 1);
    }
    bool repeats_acknowledged(const Frame& f, unsigned number) const noexcept {
        return !any_ && number != 1 && number == acknowledged_ && has_held_bytes(f);
    }
    Arrived misplaced(const Frame&, unsigned number) noexcept;
    void hold(const Frame&) noexcept;
    void update_crc() noexcept {
        if (crc_used_) {
            crc_ = crc16(held_, crc_);
        }
    }

    std::array<std::uint8_t, 7> held_{};
    std::uint8_t size_ = 0;
    std::uint8_t sequence_ = 0;  // of the last segment in order
    std::uint8_t acknowledged_ = 0;
    std::uint8_t last_command_ = 0;
    std::uint16_t crc_ = 0;
    bool crc_used_ = false;
    bool holds_ = false;
    bool any_ = false;
    bool gap_ = false;  // a segment of this block is missing
    bool last_seen_ = false;
    bool acknowledged_early_ = false;
};

/// What an acknowledgement means for the sender of the block.
enum class Acknowledgement : std::uint8_t {
    duplicate,  ///< or of an earlier block
    beyond,  ///< of segments that were not sent
    stalled,  ///< the last one again, after a pause: its segments are counted, the rest is lost
    of_this_block,  ///< its first good segments, perhaps none, have arrived
};

/// The sender of blocks. [realtime]
class BlockSender {
public:
    void begin(std::uint8_t block_size, bool crc) noexcept {
        *this = {};
        block_size_ = block_size;
        crc_used_ = crc;
    }
    /// Sends segments of the block while `out` has space. `read` fills the bytes of a segment from
    /// an offset of the value, which has `size` bytes; it returns false to end that.
    template <class Read>
    void send(FrameQueue& out, std::uint32_t cob, std::uint32_t size, Read&& read) noexcept {
        while (!complete_ && out.space() > out.reserve()) {
            const auto from = offset_ + sequence_ * 7U;
            const auto count = std::min<std::uint32_t>(7, size - from);
            last_ = make_frame(cob, 8);
            const std::span<std::uint8_t> bytes{last_.data.data() + 1, count};
            if (!read(from, bytes)) return;
            add_to_crc(from, bytes);
            const bool ends = from + count == size;
            unused_ = static_cast<std::uint8_t>(7 - count);
            last_.data[0] = static_cast<std::uint8_t>(++sequence_ | (ends ? 0x80 : 0));
            out.push(last_);
            complete_ = ends || sequence_ == block_size_;
            end_in_queue_ = out.popped() + out.size();
        }
    }
    /// Returns what an acknowledgement of `good` segments that asks for blocks of `next` means; two
    /// alike within `interval` are a duplicate.
    Acknowledgement evaluate(std::uint8_t good, std::uint8_t next, const FrameQueue& out, Time now,
                             Time interval) const noexcept;
    /// Sends the rest of the block again, as a new block.
    void repeat(Time now) noexcept {
        acknowledged_at_ = now;
        restart_block();
    }
    /// Continues after `good` segments with a block of `next`; the value has `size` bytes.
    void advance(std::uint8_t good, std::uint8_t next, std::uint32_t size, Time now) noexcept;
    void acknowledged(std::uint8_t good, std::uint8_t next, Time now) noexcept {
        last_acknowledgement_ = static_cast<std::uint16_t>(good << 8 | next);
        acknowledged_at_ = now;
    }

    bool complete() const noexcept { return complete_; }  ///< the block was sent
    std::uint8_t sequence() const noexcept { return sequence_; }
    std::uint32_t offset() const noexcept { return offset_; }  ///< acknowledged bytes
    const Frame& last() const noexcept { return last_; }  ///< segment
    /// Returns the checksum for the end frame, 0 when it is not used.
    std::uint16_t crc() const noexcept { return crc_used_ ? crc_ : std::uint16_t{0}; }
    /// Returns the number of unused bytes in the last segment.
    unsigned unused() const noexcept { return unused_; }

private:
    void restart_block() noexcept {
        sequence_ = 0;
        complete_ = false;
    }
    void add_to_crc(std::uint32_t from, std::span<const std::uint8_t> bytes) noexcept {
        if (!crc_used_ || from != crc_until_) return;
        crc_ = crc16(bytes, crc_);
        crc_until_ += static_cast<std::uint32_t>(bytes.size());
    }

    Frame last_;
    std::uint32_t offset_ = 0;
    std::uint32_t crc_until_ = 0;
    std::uint16_t crc_ = 0;
    std::uint16_t last_acknowledgement_ = 0;
    std::uint8_t block_size_ = 0;
    std::uint8_t sequence_ = 0;
    std::uint8_t unused_ = 0;
    bool crc_used_ = false;
    bool complete_ = false;
    std::size_t end_in_queue_ = 0;  // FrameQueue::popped() once the whole block has left the queue
    Time acknowledged_at_ = 0;
};

}  // namespace hal::canopen
