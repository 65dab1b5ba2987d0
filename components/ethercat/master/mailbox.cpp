// SPDX-License-Identifier: MIT
#include "ethercat/master/mailbox.hpp"

#include <algorithm>
#include <cstring>

#include "ethercat/wire/registers.hpp"

namespace hal::ethercat::master {
namespace {

constexpr std::uint8_t sm_full = 0x08;
constexpr std::uint8_t sm_repeat = 0x02;
// A mailbox of up to this size is read at once after a request, until that was in vain: most
// replies are there by the next cycle. Of others, the state is read first.
constexpr std::size_t max_eager_bytes = 256;
// answers with WKC 0 in a row after which a slave counts as not on the bus
constexpr unsigned max_absent = 4;
constexpr std::uint16_t status_of(unsigned n) {
    return static_cast<std::uint16_t>(registers::sync_manager_at(n) + 5);
}
constexpr std::uint16_t activate_of(unsigned n) {
    return static_cast<std::uint16_t>(registers::sync_manager_at(n) + 6);
}
MailboxResult too_late(bool lost) noexcept {
    return {lost ? MailboxResult::Outcome::lost : MailboxResult::Outcome::timed_out, 0, 0};
}

std::uint64_t sum_of(std::span<const std::uint8_t> bytes) noexcept {  // FNV-1a
    std::uint64_t sum = 0xcbf29ce484222325U;
    for (const auto byte : bytes) {
        sum = (sum ^ byte) * 0x100000001b3U;
    }
    return sum;
}

MailboxResult failed(MailboxResult::Outcome outcome) noexcept { return {outcome, 0, 0}; }

}  // namespace

Task<SlaveMailbox::Hold> SlaveMailbox::hold(Channel& channel) noexcept {
    while (held_) {
        co_await channel.sleep(1);
    }
    co_return Hold(*this);
}

Task<SlaveMailbox::Full> SlaveMailbox::is_full(Channel& channel, BusSlave& slave,
                                               unsigned sync_manager, unsigned repeats) noexcept {
    const Answer answer = co_await channel.exchange(
        Command::fprd, at_station(slave.station, status_of(sync_manager)), 1, repeats);
    if (!answer) co_return Full::lost;
    if (answer.wkc == 0) co_return Full::absent;
    co_return (channel.data()[0] & sm_full) != 0 ? Full::yes : Full::no;
}

Task<MailboxResult> SlaveMailbox::send(Channel& channel, BusSlave& slave, MailboxType type,
                                       std::size_t length) noexcept {
    const std::size_t size = size_of_out(slave);
    if (!slave.area().usable() || mailbox_header_bytes + length > size) co_return refused();
    if (std::exchange(stale_, false)) {
        co_await poll(channel, slave);
    }
    slave.mailbox_counter = next_mailbox_counter(slave.mailbox_counter);
    write_mailbox_header(request_.data(), length, 0, type, slave.mailbox_counter);
    const std::int64_t until =
        channel.now_ns() + std::int64_t{slave.timeouts.mailbox_request} * 1'000'000;
    const std::uint32_t address = at_station(slave.station, slave.area().out_start);
    unsigned absent = 0;
    bool unknown = false;  // a lost datagram may have been executed
    for (;;) {
        if (interrupted_) co_return failed(MailboxResult::Outcome::timed_out);
        std::memcpy(channel.data(), request_.data(), mailbox_header_bytes + length);
        std::memset(channel.data() + mailbox_header_bytes + length, 0,
                    size - mailbox_header_bytes - length);
        const Answer answer =
            co_await channel.exchange(Command::fpwr, address, static_cast<std::uint16_t>(size), 0);
        if (answer && answer.wkc != 0) break;
        if (!answer) {
            unknown = true;
            ++counters_.resent;
        }
        const Full full = co_await is_full(channel, slave, 0);
        if (full == Full::yes && unknown) {
            break;  // it is the message whose datagram was lost
        }
        absent = full == Full::absent ? absent + 1 : 0;
        if (absent >= max_absent) co_return failed(MailboxResult::Outcome::lost);
        if (channel.now_ns() >= until) co_return too_late(full == Full::lost);
        // see receive()
        if (!answer && (counters_.resent & 1) == 0) {
            co_await is_full(channel, slave, 0, 0);
        }
        // a slave may wait for its own message to be read
        if (full == Full::yes) {
            co_await poll(channel, slave);
        }
    }
    ++counters_.sent;
    co_return succeeded();
}

SlaveMailbox::Approach SlaveMailbox::approach(const BusSlave& slave) const noexcept {
    switch (lost_reads_ % 3) {
    case 1: return Approach::read;
    case 2: return Approach::shift_and_read;
    default: break;
    }
    if (slave.mailbox_status != nullptr) return Approach::status_in_process_data;
    if (eager_ && slave.area().in_size <= max_eager_bytes) return Approach::read;
    return Approach::ask_status;
}

Task<MailboxResult> SlaveMailbox::receive(Channel& channel, BusSlave& slave,
                                          std::int64_t until_ns) noexcept {
    if (!slave.area().usable()) co_return refused();
    unsigned absent = 0;
    for (;;) {
        if (interrupted_) co_return failed(MailboxResult::Outcome::timed_out);
        Full full = Full::yes;
        switch (approach(slave)) {
        case Approach::read: break;
        case Approach::shift_and_read: co_await is_full(channel, slave, 1, 0); break;
        case Approach::status_in_process_data:
            if ((*slave.mailbox_status & sm_full) == 0) {
                full = Full::no;
                co_await channel.sleep(1);  // until the next cycle
            }
            break;
        case Approach::ask_status: full = co_await is_full(channel, slave, 1); break;
        }
        if (full == Full::yes) {
            const bool got = co_await read(channel, slave, until_ns);
            if (got) co_return succeeded(reply_.payload.size());
            eager_ = false;
        }
        absent = full == Full::absent ? absent + 1 : 0;
        if (absent >= max_absent) co_return failed(MailboxResult::Outcome::lost);
        if (channel.now_ns() >= until_ns) co_return too_late(full == Full::lost);
    }
}

Task<MailboxResult> SlaveMailbox::exchange(Channel& channel, BusSlave& slave, MailboxType type,
                                           std::size_t length, Expected expected) noexcept {
    MailboxResult result = co_await send(channel, slave, type, length);
    if (!result) co_return result;
    result = co_await wait_for(channel, slave, type, response_timeout_ns(slave), expected);
    co_return result;
}

Task<MailboxResult> SlaveMailbox::wait_for(Channel& channel, BusSlave& slave, MailboxType type,
                                           std::int64_t timeout_ns, Expected expected) noexcept {
    const std::int64_t until = channel.now_ns() + timeout_ns;
    for (;;) {
        const MailboxResult result = co_await receive(channel, slave, until);
        if (!result) {
            stale_ = !interrupted_;  // the reply may still come
            co_return result;
        }
        if (reply_.type == MailboxType::error) {
            const auto error = read_mailbox_error(reply_.payload);
            if (error) co_return refused(static_cast<std::uint32_t>(*error));
        } else if (reply_.type == type && expected.accepts(expected, reply_.payload)) {
            co_return succeeded(reply_.payload.size());
        }
        drop();
    }
}

Task<MailboxResult> SlaveMailbox::poll(Channel& channel, BusSlave& slave) noexcept {
    if (!slave.area().usable()) co_return refused();
    Full full = Full::no;
    if (slave.mailbox_status != nullptr) {
        full = (*slave.mailbox_status & sm_full) != 0 ? Full::yes : Full::no;
    } else {
        full = co_await is_full(channel, slave, 1);
    }
    if (full != Full::yes) {
        co_return failed(full == Full::no ? MailboxResult::Outcome::timed_out
                                          : MailboxResult::Outcome::lost);
    }
    const bool got = co_await read(channel, slave, channel.now_ns() + response_timeout_ns(slave));
    if (got) {
        drop();
    }
    co_return succeeded();
}

Task<bool> SlaveMailbox::read(Channel& channel, BusSlave& slave, std::int64_t until_ns) noexcept {
    const std::size_t size = std::min<std::size_t>(slave.area().in_size, max_mailbox);
    const Answer answer =
        co_await channel.exchange(Command::fprd, at_station(slave.station, slave.area().in_start),
                                  static_cast<std::uint16_t>(size), 0);
    if (!answer) {  // the message may have left the slave
        ++counters_.repeated;
        ++lost_reads_;
        co_await repeat(channel, slave, until_ns);
        co_return false;
    }
    lost_reads_ = 0;
    if (answer.wkc == 0) {
        co_return false;  // the status was that of an earlier cycle
    }
    std::memcpy(reply_bytes_.data(), channel.data(), size);
    co_return accept(slave, size);
}

Task<bool> SlaveMailbox::repeat(Channel& channel, BusSlave& slave, std::int64_t until_ns) noexcept {
    const std::uint32_t address = at_station(slave.station, activate_of(1));
    // not every slave acknowledges
    until_ns = std::min(
        until_ns, channel.now_ns() + std::int64_t{slave.timeouts.mailbox_request} * 1'000'000);
    std::uint8_t wanted = 0;
    for (bool toggled = false; !toggled;) {
        Answer answer = co_await channel.exchange(Command::fprd, address, 1);
        if (answer && answer.wkc != 0) {
            wanted = channel.data()[0] ^ sm_repeat;
            channel.data()[0] = wanted;
            // the value, not the change: may be executed twice
            answer = co_await channel.exchange(Command::fpwr, address, 1);
            toggled = answer && answer.wkc != 0;
        }
        if (interrupted_ || (!toggled && channel.now_ns() >= until_ns)) co_return false;
    }
    for (;;) {
        const Answer answer = co_await channel.exchange(Command::fprd, address, 2);
        if (answer && answer.wkc != 0 && ((channel.data()[1] ^ wanted) & sm_repeat) == 0) {
            co_return true;
        }
        if (interrupted_ || channel.now_ns() >= until_ns) co_return false;
    }
}

bool SlaveMailbox::accept(const BusSlave& slave, std::size_t size) noexcept {
    const auto message = read_mailbox({reply_bytes_.data(), size});
    if (!message) {
        ++counters_.malformed;
        return false;
    }
    ++counters_.received;
    if (is_duplicate(*message)) {
        ++counters_.dropped;
        return false;
    }
    if (router_ != nullptr && message->station != 0 && message->station != slave.station &&
        router_->take(slave, *message)) {
        return false;
    }
    MailboxSink* sink = sinks_[static_cast<unsigned>(message->type) % types];
    if (sink != nullptr && sink->take(slave, *message)) return false;
    reply_ = *message;
    return true;
}

// A slave that repeats a message does so with its counter. One that never counts, or always sends
// the same number, is exempt.
bool SlaveMailbox::is_duplicate(const MailboxMessage& message) noexcept {
    const std::uint64_t sum = sum_of(message.payload);
    const bool same_counter = message.counter != 0 && message.counter == last_counter_;
    const bool same = same_counter && sum == last_sum_;
    if (same_counter && !same) {
        repeats_counter_ = true;
    }
    if (message.counter != 0 && last_counter_ != 0 && !same_counter) {
        advances_ = true;
    }
    last_counter_ = message.counter;
    last_sum_ = sum;
    return same && advances_ && !repeats_counter_;
}

}  // namespace hal::ethercat::master
