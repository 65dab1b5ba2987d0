// SPDX-License-Identifier: MIT
// The datagrams of a cycle. A request ends with a number that the card keeps in its scratch
// registers and returns with the data: the answer to the newest request is found by it, also behind
// late and duplicate ones. The writes of a cycle have a number as well: an answer shows whether the
// newest writes have arrived.
//
//   cycle n   write   writes, read count n, reads, write count n  -->  card
//   cycle n+1 read    data, counts (n, n-1)                       <--  card, some time in between
//   cycle n+1 write   writes, read count n+1, …
//
// One datagram each way, unless writes and reads exceed 1400 bytes, or another function sends the
// reads.
#pragma once

#include <array>
#include <cstdint>

#include "mesa/driver/read_layout.hpp"

namespace hal::mesa {

/// What a cycle got from the card.
enum class Answer : std::uint8_t {
    fresh,
    missing,  ///< to a request: one of the datagrams is lost or late
    unrequested,  ///< nothing was requested
};

/// Counts of datagrams since the beginning.
struct LinkCounts {
    std::uint64_t requests = 0;
    std::uint64_t lost = 0;  ///< requests without an answer in time
    std::uint64_t unexpected = 0;  ///< late, duplicate or other answers, which were not used
    std::uint64_t lost_writes = 0;  ///< answers that show that the newest writes did not arrive
};

/// One card. Used by the functions of one thread; [realtime] unless marked.
class CycleLink {
public:
    /// `session` is in the high half of all numbers, so that those of another master differ. The
    /// port outlives it. Throws CardError when the reads exceed a datagram. [setup]
    CycleLink(datagram::Port& port, ReadLayout layout, std::uint16_t session);

    /// Forgets requests and counts of the card, as after a pause. [setup] or [realtime]
    void restart() noexcept {
        is_requested_ = false;
        has_packets_ = false;
    }

    /// Sends the reads of this cycle, unless they are under way.
    void request(std::int64_t now_ns) noexcept;
    bool is_requested() const noexcept { return is_requested_; }
    /// Takes the answer to the newest request, and waits for it for at most `limit_ns` from the
    /// cycle of the request, or for min_wait_ns.
    Answer receive(std::int64_t now_ns, std::int64_t limit_ns) noexcept;
    /// Returns the newest answer.
    Reply reply() const noexcept { return Reply({buffers_[newest_].data(), reply_size_}); }

    /// Returns the request of this cycle's writes, which is empty.
    Request& begin_write() noexcept {
        writes_.clear();
        return writes_;
    }
    /// Leaves out the write counts of the coming cycles, up to the next answer: if the card is reset
    /// among them, that answer shows the count 0. Returns false if the card has no count to forget.
    bool keep_count() noexcept {
        keeps_count_ = card_write_count_ != 0;
        return keeps_count_;
    }
    /// Sends the writes, with the reads for the next cycle if `requests`. `late(request)` appends
    /// the writes that are executed behind the reads, of at most `late_size` bytes.
    template <class Late>
    void send_write(std::int64_t now_ns, bool requests, std::size_t late_size,
                    Late&& late) noexcept {
        const bool joins = begin_send(now_ns, requests, late_size);
        late(writes_);
        end_send(now_ns, requests && !joins);
    }

    /// Returns whether the newest answer shows that the writes before its reads have arrived.
    bool writes_arrived() const noexcept { return writes_arrived_; }
    /// Returns whether the newest answer has another write count of another master than the one
    /// before.
    bool has_foreign_writes() const noexcept { return has_foreign_writes_; }
    /// Returns whether the card has received more requests since the answer before than were sent:
    /// settings may have been changed.
    bool has_other_requests() const noexcept { return has_other_requests_; }
    /// Returns whether the newest answer shows that the card has forgotten a count that was kept: it
    /// was reset.
    bool has_forgotten_count() const noexcept { return has_forgotten_count_; }
    /// Returns how old the newest answer is at `now_ns`, from the cycle of its request, ns.
    std::int64_t age_ns(std::int64_t now_ns) const noexcept { return now_ns - requested_ns_; }
    const LinkCounts& counts() const noexcept { return counts_; }

    /// Waiting for an answer takes at least this long.
    static constexpr std::int64_t min_wait_ns = 100'000;

private:
    static constexpr unsigned max_datagrams = 64;  // read in one cycle

    static constexpr std::size_t count_size = 8;  // of the command that writes one

    bool begin_send(std::int64_t now_ns, bool requests, std::size_t late_size) noexcept;
    void end_send(std::int64_t now_ns, bool requests) noexcept;
    void note_request(std::int64_t now_ns, bool is_joined) noexcept;
    bool drain(std::int64_t now_ns) noexcept;
    bool accept(std::size_t size) noexcept;
    void note_counts() noexcept;
    void note_packets() noexcept;
    std::uint32_t number(std::uint16_t count) const noexcept {
        return std::uint32_t{session_} << 16 | count;
    }

    datagram::Port& port_;
    const ReadLayout layout_;
    const std::uint16_t session_;
    Request reads_;  ///< of a cycle, with the newest number
    Request writes_;
    std::size_t read_count_offset_ = 0;  ///< of the number in the reads
    std::size_t reply_size_ = 0;
    std::size_t counts_offset_ = 0;
    std::size_t packets_offset_ = 0;
    std::uint16_t sent_ = 0;  ///< datagrams, as the card counts them
    std::uint16_t sent_with_request_ = 0;
    std::uint16_t surplus_ = 0;  ///< of the packets of the card over those
    bool has_packets_ = false;  ///< `surplus_` is that of the answer of the cycle before
    bool has_other_requests_ = false;
    std::uint16_t read_count_ = 0;
    std::uint16_t write_count_ = 0;
    std::uint16_t expected_write_count_ = 0;  ///< before the newest request
    bool is_requested_ = false;
    bool is_joined_ = false;  ///< the newest request has the writes of its cycle as well
    std::int64_t requested_ns_ = 0;
    bool writes_arrived_ = true;
    bool has_foreign_writes_ = false;
    bool has_forgotten_count_ = false;
    bool keeps_count_ = false;
    std::uint32_t card_write_count_ = 0;
    std::array<std::array<std::uint8_t, datagram::max_size>, 2> buffers_{};
    std::size_t newest_ = 0;
    LinkCounts counts_;
};

}  // namespace hal::mesa
