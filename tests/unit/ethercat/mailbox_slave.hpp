// SPDX-License-Identifier: MIT
// A slave of which only the mailbox exists, and the cycle that drives one channel to it: for the
// tests of the mailbox clients.
#pragma once

#include <deque>
#include <functional>
#include <vector>

#include "ethercat/master/coe_client.hpp"
#include "ethercat/master/object_information.hpp"
#include "ethercat/wire/registers.hpp"

namespace hal::ethercat::tests {

using Bytes = std::vector<std::uint8_t>;

/// The firmware is `on_request`, which answers with reply().
struct MailboxSlave {
    master::BusSlave bus;
    master::Channel channel;
    std::function<void(const MailboxMessage&)> on_request = [](const MailboxMessage&) {};
    std::deque<Bytes> outbox;
    std::int64_t now_ns = 0;
    // every n-th datagram, alternately before and after the slave
    unsigned lose_every = 0;
    unsigned datagrams = 0;
    unsigned lost = 0;
    unsigned double_every = 0;
    unsigned replies = 0;             // every n-th reply is sent twice
    bool counts = true;
    bool present = true;
    bool takes = true;   // takes: the firmware reads its mailbox
    unsigned requests = 0;

    MailboxSlave(std::uint16_t size = 64) {
        bus.number = 0;
        bus.station = 0x1001;
        bus.present = true;
        bus.configured = 0;
        bus.state = State::preop;
        bus.mailbox = {0x1000, size, 0x1400, size};
        bus.timeouts.mailbox_response = 100;
    }
    void reply(MailboxType type, const Bytes& payload) { reply_as(type, payload, 0); }
    void reply_as(MailboxType type, const Bytes& payload, std::uint16_t station) {
        counter_ = next_mailbox_counter(counter_);
        Bytes message(mailbox_header_bytes);
        write_mailbox_header(message.data(), payload.size(), station, type, counts ? counter_ : 0);
        message.insert(message.end(), payload.begin(), payload.end());
        outbox.push_back(message);
        if (double_every != 0 && ++replies % double_every == 0) {
            outbox.push_back(message);
        }
    }
    /// Runs cycles of 1 ms until the channel has no more work. Returns whether it ended within
    /// `cycles`.
    bool run(unsigned cycles = 20000) {
        for (unsigned i = 0; i < cycles && channel.busy(); ++i) {
            step();
        }
        return !channel.busy();
    }
    void step() { step(channel); }
    void step(master::Channel& on) {
        now_ns += 1'000'000;
        on.set_now(now_ns);
        firmware();
        using Stage = master::Channel::Stage;
        if (on.stage() == Stage::sleeping && on.until_ns() <= now_ns) return on.wake();
        if (on.stage() != Stage::waiting) return;
        on.set_sent(now_ns);
        const bool lose = lose_every != 0 && ++datagrams % lose_every == 0;
        if (lose) {
            ++lost;
        }
        if (lose && lost % 2 == 0) {
            return on.lose();  // before the slave
        }
        const std::uint16_t wkc = present ? execute(on) : 0;
        if (lose) {
            return on.lose();                   // behind it
        }
        on.arrive(wkc);
    }

private:
    void firmware() {
        // repeat request: the last message again, then the one it pushed out
        if (((activate_ ^ repeat_) & 2) != 0) {
            if (full_) {
                outbox.push_front(in_);
            }
            full_ = false;
            if (!sent_.empty()) {
                outbox.push_front(sent_);
            }
            repeat_ = activate_ & 2;
        }
        if (out_full_ && takes) {
            out_full_ = false;
            const Bytes request = out_;
            if (const auto message = read_mailbox(request);
                message && !(counts && message->counter == taken_ && message->counter != 0)) {
                taken_ = message->counter;
                ++requests;
                on_request(*message);
            }
        }
        if (!full_ && !outbox.empty()) {
            in_ = outbox.front();
            outbox.pop_front();
            full_ = true;
        }
    }
    std::uint16_t execute(master::Channel& on) {
        if (on.address() % 0x10000 != bus.station) return 0;
        const auto at = static_cast<std::uint16_t>(on.address() >> 16);
        const bool reading = on.command() == Command::fprd;
        std::uint8_t* data = on.data();
        if (at == bus.area().out_start && !reading) {
            if (out_full_) return 0;
            out_.assign(data, data + on.length());
            out_full_ = true;
            return 1;
        }
        if (at == bus.area().in_start && reading) {
            if (!full_) return 0;
            std::fill(data, data + on.length(), std::uint8_t{0});
            std::copy_n(in_.begin(), std::min<std::size_t>(in_.size(), on.length()), data);
            sent_ = in_;
            full_ = false;
            return 1;
        }
        for (unsigned i = 0; i < on.length(); ++i) {
            const unsigned r = at + i;
            if (reading) {
                data[i] = r == 0x805   ? (out_full_ ? 8 : 0)
                          : r == 0x80d ? (full_ ? 8 : 0)
                          : r == 0x80e ? activate_
                          : r == 0x80f ? repeat_
                                       : 0;
            } else if (r == 0x80e) {
                activate_ = data[i];
            }
        }
        return 1;
    }

    Bytes out_, in_, sent_;
    bool out_full_ = false;
    bool full_ = false;
    std::uint8_t activate_ = 1;
    std::uint8_t repeat_ = 0;
    std::uint8_t counter_ = 0;
    std::uint8_t taken_ = 0;
};

}  // namespace hal::ethercat::tests
