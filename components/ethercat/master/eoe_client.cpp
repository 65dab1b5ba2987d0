// SPDX-License-Identifier: MIT
#include "ethercat/master/eoe_client.hpp"

#include <algorithm>
#include <cstring>

namespace hal::ethercat::master {
namespace {

constexpr std::size_t ethernet_addresses = 12;

bool accepts_eoe(const Expected& expected, std::span<const std::uint8_t> payload) noexcept {
    const auto header = eoe::read(payload);
    return header && static_cast<std::uint32_t>(header->type) == expected.first;
}

}  // namespace

EoeSwitch::EoeSwitch(Mailboxes& mailboxes, std::span<const EoePort> ports, std::size_t depth)
    : mailboxes_(mailboxes) {
    for (const EoePort& port : ports) {
        while (hosts_.size() <= port.host) {
            hosts_.push_back(std::make_unique<Host>(depth * 4));
        }
        if (port_by_slave_.size() <= port.slave) {
            port_by_slave_.resize(port.slave + std::size_t{1}, -1);
        }
        port_by_slave_[port.slave] = static_cast<int>(ports_.size());
        ports_.push_back(std::make_unique<Port>(port.host, depth));
    }
    for (std::size_t n = 0; n < mailboxes.size(); ++n) {
        mailboxes.at(n).set_sink(MailboxType::eoe, this);
    }
}

EoeSwitch::Port* EoeSwitch::port_of(const BusSlave& slave) const noexcept {
    const auto n = static_cast<std::size_t>(slave.configured);
    if (slave.configured < 0 || n >= port_by_slave_.size() || port_by_slave_[n] < 0) return nullptr;
    return ports_[static_cast<std::size_t>(port_by_slave_[n])].get();
}

bool EoeSwitch::pending(const BusSlave& slave) const noexcept {
    const Port* port = port_of(slave);
    const bool mailbox_works =
        slave.state == State::preop || slave.state == State::safeop || slave.state == State::op;
    return port != nullptr && mailbox_works && port->queue.size() != 0;
}

EoeCounters EoeSwitch::counters(const BusSlave& slave) const noexcept {
    const Port* port = port_of(slave);
    return port != nullptr ? port->counters : EoeCounters{};
}

void EoeSwitch::pump() noexcept {
    for (std::uint16_t n = 0; n < hosts_.size(); ++n) {
        Queue<EthernetFrame>& queue = hosts_[n]->from;
        for (std::size_t left = queue.capacity(); left-- != 0;) {
            const EthernetFrame* frame = queue.front();
            if (frame == nullptr) break;
            if (frame->length <= frame->bytes.size()) {
                forward(n, the_host, {frame->bytes.data(), frame->length});
            }
            queue.drop();
        }
    }
}

void EoeSwitch::drop_stale(Port& port) noexcept {
    for (; port.stale != 0 && !port.sending; --port.stale) {
        port.queue.drop();
        ++port.counters.lost;
    }
}

void EoeSwitch::discard() noexcept {
    pump();
    for (const auto& port : ports_) {
        port->stale = port->queue.size();
        drop_stale(*port);
    }
}

std::uint32_t EoeSwitch::lost() const noexcept {
    std::uint32_t sum = 0;
    for (const auto& port : ports_) {
        sum += port->counters.lost;
    }
    return sum;
}

bool EoeSwitch::take(const BusSlave& slave, const MailboxMessage& message) noexcept {
    const auto header = eoe::read(message.payload);
    Port* port = port_of(slave);
    if (!header || port == nullptr) return false;
    if (header->type == eoe::Type::timestamp) return true;
    if (header->type != eoe::Type::fragment) return false;
    const auto frame = port->joiner.take(message.payload);
    if (frame.empty()) return true;
    ++port->counters.from_slave;
    forward(port->host,
            static_cast<unsigned>(port_by_slave_[static_cast<std::size_t>(slave.configured)]),
            frame);
    return true;
}

EoeSwitch::Learned& EoeSwitch::slot_of(std::uint16_t host, const std::uint8_t* address) noexcept {
    unsigned sum = host;
    for (unsigned i = 0; i < 6; ++i) {
        sum = sum * 31 + address[i];
    }
    return learned_[sum % learned_.size()];
}

void EoeSwitch::forward(std::uint16_t host, unsigned from,
                        std::span<const std::uint8_t> frame) noexcept {
    if (frame.size() < ethernet_addresses) return;
    const std::uint8_t* to = frame.data();
    const std::uint8_t* source = frame.data() + 6;
    if ((source[0] & 1) == 0) {
        Learned& slot = slot_of(host, source);
        std::memcpy(slot.address.data(), source, 6);
        slot.host = host;
        slot.port = from;
        slot.used = true;
    }
    const Learned& known = slot_of(host, to);
    if ((to[0] & 1) == 0 && known.used && known.host == host &&
        std::memcmp(known.address.data(), to, 6) == 0) {
        if (known.port != from) {
            deliver(host, known.port, frame);
        }
        return;
    }
    if (from != the_host) {
        deliver(host, the_host, frame);
    }
    for (unsigned i = 0; i < ports_.size(); ++i) {
        if (i != from && ports_[i]->host == host) {
            deliver(host, i, frame);
        }
    }
}

void EoeSwitch::deliver(std::uint16_t host, unsigned port,
                        std::span<const std::uint8_t> frame) noexcept {
    Queue<EthernetFrame>& queue = port == the_host ? hosts_[host]->to : ports_[port]->queue;
    EthernetFrame* place = queue.place();
    if (place == nullptr) {
        if (port != the_host) {
            ++ports_[port]->counters.lost;
        }
        return;
    }
    place->length = static_cast<std::uint16_t>(frame.size());
    std::memcpy(place->bytes.data(), frame.data(), frame.size());
    queue.commit();
}

Task<MailboxResult> EoeSwitch::serve(Channel& channel, BusSlave& slave) noexcept {
    SlaveMailbox* mailbox = mailboxes_.find(slave);
    Port* port = port_of(slave);
    if (mailbox == nullptr || port == nullptr) co_return refused();
    const SlaveMailbox::Hold hold = co_await mailbox->hold(channel);
    const auto body = mailbox->body(slave);
    port->sending = false;  // only who holds the mailbox sends
    drop_stale(*port);
    const EthernetFrame* frame = port->queue.front();
    if (frame == nullptr) co_return succeeded();
    MailboxResult result = refused();
    port->sending = true;
    if (body.size() >= eoe::header_bytes + 32) {
        eoe::Splitter splitter({frame->bytes.data(), frame->length}, port->frame++ & 15U,
                               body.size() + mailbox_header_bytes);
        for (std::size_t length = splitter.next(body.data()); length != 0;
             length = splitter.next(body.data())) {
            result = co_await mailbox->send(channel, slave, MailboxType::eoe, length);
            if (!result) break;
        }
    }
    port->sending = false;
    port->queue.drop();
    ++(result ? port->counters.to_slave : port->counters.lost);
    if (port->stale != 0) {
        --port->stale;
        drop_stale(*port);
    }
    co_return result;
}

Task<MailboxResult> EoeClient::set_ip(Channel& channel, BusSlave& slave,
                                      const eoe::Ip& ip) noexcept {
    SlaveMailbox* mailbox = mailboxes_.find(slave);
    if (mailbox == nullptr) co_return refused();
    const SlaveMailbox::Hold hold = co_await mailbox->hold(channel);
    const auto body = mailbox->body(slave);
    if (body.size() < eoe::header_bytes + eoe::max_ip) co_return refused();
    eoe::Ip all = ip;
    all.flags |= eoe::ip_flag::mac | eoe::ip_flag::address | eoe::ip_flag::mask |
                 eoe::ip_flag::gateway | eoe::ip_flag::dns;
    if ((ip.flags & ~eoe::ip_flag::mac) == 0) {
        all.flags = ip.flags;  // DHCP: the MAC address only
    }
    eoe::Header header;
    header.type = eoe::Type::set_ip;
    header.last = true;
    eoe::write(body.data(), header);
    const std::size_t length =
        eoe::header_bytes + eoe::write_ip(body.data() + eoe::header_bytes, all);
    const Expected expected{accepts_eoe, static_cast<std::uint32_t>(eoe::Type::set_ip_response)};
    const MailboxResult result =
        co_await mailbox->exchange(channel, slave, MailboxType::eoe, length, expected);
    if (!result) co_return result;
    const std::uint16_t code = eoe::read(mailbox->reply().payload)->word;
    if (code != 0) co_return aborted(code);
    co_return succeeded();
}

Task<MailboxResult> EoeClient::get_ip(Channel& channel, BusSlave& slave, eoe::Ip& to) noexcept {
    SlaveMailbox* mailbox = mailboxes_.find(slave);
    if (mailbox == nullptr) co_return refused();
    const SlaveMailbox::Hold hold = co_await mailbox->hold(channel);
    const auto body = mailbox->body(slave);
    if (body.size() < eoe::header_bytes) co_return refused();
    eoe::Header header;
    header.type = eoe::Type::get_ip;
    header.last = true;
    eoe::write(body.data(), header);
    const Expected expected{accepts_eoe, static_cast<std::uint32_t>(eoe::Type::get_ip_response)};
    const MailboxResult result =
        co_await mailbox->exchange(channel, slave, MailboxType::eoe, eoe::header_bytes, expected);
    if (!result) co_return result;
    const auto payload = mailbox->reply().payload;
    const std::uint16_t code = eoe::read(payload)->word;
    if (code != 0) co_return aborted(code);
    const auto ip = eoe::read_ip(payload.subspan(eoe::header_bytes));
    if (!ip) co_return refused();
    to = *ip;
    co_return succeeded();
}

}  // namespace hal::ethercat::master
