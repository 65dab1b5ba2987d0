// SPDX-License-Identifier: MIT
#include "cycle_link.hpp"

#include <algorithm>
#include <optional>

#include "mesa/lbp16/spaces.hpp"

namespace hal::mesa {

namespace {

/// Counts are two units of 16 bits, the low one first. Returns the offset of the count.
std::optional<std::size_t> put_count(Request& request, std::uint16_t address,
                                     std::uint32_t count) noexcept {
    std::array<std::uint8_t, 4> data;
    store(data.data(), count);
    return request.write(Space::timers, address, Unit::u16, data);
}

}  // namespace

CycleLink::CycleLink(datagram::Port& port, ReadLayout layout, std::uint16_t session)
    : port_(port), layout_(std::move(layout)), session_(session), reads_(layout_.request()) {
    const auto packets = reads_.read(Space::status, status::received_packets, Unit::u16);
    const auto count = put_count(reads_, timers::read_count, number(read_count_));
    const auto counts = reads_.read(Space::timers, timers::scratch, Unit::u16, 4);
    if (!packets || !count || !counts) {
        throw CardError(
            "the modules in use need more than the 1400 bytes of a datagram in each cycle; use "
            "fewer of them in config=");
    }
    reply_size_ = reads_.reply_size();
    read_count_offset_ = *count;
    counts_offset_ = *counts;
    packets_offset_ = *packets;
}

void CycleLink::request(std::int64_t now_ns) noexcept {
    if (is_requested_) return;
    note_request(now_ns, false);
    ++sent_;
    port_.send(reads_.bytes(), now_ns);
}

void CycleLink::note_request(std::int64_t now_ns, bool is_joined) noexcept {
    reads_.set(read_count_offset_, number(++read_count_));
    layout_.follow_addresses(reads_);
    is_requested_ = true;
    is_joined_ = is_joined;
    requested_ns_ = now_ns;
    sent_with_request_ = static_cast<std::uint16_t>(sent_ + 1);
    expected_write_count_ = write_count_;
    ++counts_.requests;
}

Answer CycleLink::receive(std::int64_t now_ns, std::int64_t limit_ns) noexcept {
    if (!is_requested_) {
        drain(now_ns);
        return Answer::unrequested;
    }
    is_requested_ = false;
    const std::int64_t passed_ns = std::max<std::int64_t>(now_ns - requested_ns_, 0);
    const std::int64_t wait_ns = std::max(limit_ns - passed_ns, min_wait_ns);
    // an unexpected datagram ends a wait, but not the waiting
    for (int tries = 0; tries < 3; ++tries) {
        if (drain(now_ns)) return Answer::fresh;
        if (!port_.wait(wait_ns)) break;
    }
    if (drain(now_ns)) return Answer::fresh;
    has_packets_ = false;
    ++counts_.lost;
    return Answer::missing;
}

bool CycleLink::drain(std::int64_t now_ns) noexcept {
    for (unsigned n = 0; n < max_datagrams; ++n) {
        const std::size_t size = port_.receive(buffers_[1 - newest_], now_ns);
        if (size == 0) return false;
        if (accept(size)) return true;
        ++counts_.unexpected;
    }
    return false;
}

bool CycleLink::accept(std::size_t size) noexcept {
    const std::uint8_t* const bytes = buffers_[1 - newest_].data();
    if (size != reply_size_) return false;
    if (load<std::uint32_t>(bytes + counts_offset_) != number(read_count_)) return false;
    newest_ = 1 - newest_;
    note_counts();
    note_packets();
    return true;
}

void CycleLink::note_counts() noexcept {
    const std::uint8_t* const bytes = buffers_[newest_].data();
    const auto count = load<std::uint32_t>(bytes + counts_offset_ + 4);
    const bool is_foreign = count != 0 && count >> 16 != session_;
    has_foreign_writes_ = is_foreign && count != card_write_count_;
    const bool is_expected = count == number(expected_write_count_);
    has_forgotten_count_ = keeps_count_ && count == 0;
    writes_arrived_ = is_joined_ || (is_expected && !keeps_count_);
    keeps_count_ = false;
    if (!is_expected && !is_foreign && count != 0) {
        ++counts_.lost_writes;
    }
    card_write_count_ = count;
}

/// Behind an answer that is missing, lost requests would hide those of others.
void CycleLink::note_packets() noexcept {
    const auto packets = load<std::uint16_t>(buffers_[newest_].data() + packets_offset_);
    const auto surplus = static_cast<std::uint16_t>(packets - sent_with_request_);
    const auto change = static_cast<std::int16_t>(surplus - surplus_);
    has_other_requests_ = has_packets_ && change > 0;
    surplus_ = surplus;
    has_packets_ = true;
}

/// Returns whether the reads are in the datagram of the writes.
bool CycleLink::begin_send(std::int64_t now_ns, bool requests, std::size_t late_size) noexcept {
    const std::size_t size = writes_.size() + reads_.size() + late_size + count_size;
    if (!requests || is_requested_ || size > max_datagram) return false;
    note_request(now_ns, true);
    return writes_.append(reads_);
}

void CycleLink::end_send(std::int64_t now_ns, bool requests) noexcept {
    // behind the reads, which so show a count that another master has written
    if (!keeps_count_) {
        put_count(writes_, timers::write_count, number(++write_count_));
    }
    ++sent_;
    port_.send(writes_.bytes(), now_ns);
    if (requests) {
        request(now_ns);
    }
}

}  // namespace hal::mesa
