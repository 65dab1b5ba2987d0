// SPDX-License-Identifier: MIT
// SDO information: lists of objects, descriptions of objects and entries.
#include <algorithm>
#include <cstring>

#include "ethercat/devices/coe_server.hpp"

namespace hal::ethercat::devices {

void CoeServer::information_error(std::uint32_t code, Outbox& out) noexcept {
    std::uint8_t* to = out.payload();
    coe::write_information(to, {coe::Information::error, false, 0});
    put(to + coe::information_header_bytes, code);
    out.send(MailboxType::coe, coe::information_header_bytes + 4);
}

bool CoeServer::in_list(const DictionaryObject& o, coe::List list) const noexcept {
    if (list == coe::List::all) return true;
    const std::uint16_t right = list == coe::List::rx_mappable   ? coe::access::rx_mappable
                                : list == coe::List::tx_mappable ? coe::access::tx_mappable
                                : list == coe::List::backup      ? coe::access::backup
                                                                 : coe::access::setting;
    return std::any_of(o.entries.begin(), o.entries.end(),
                       [&](const auto& e) { return (e.access & right) != 0; });
}

void CoeServer::information(std::span<const std::uint8_t> payload, Outbox& out) noexcept {
    const auto h = coe::read_information(payload);
    const auto data = payload.subspan(std::min(payload.size(), coe::information_header_bytes));
    if (!h || data.size() < 2) {
        return out.send(MailboxType::error,
                        write_mailbox_error(out.payload(), MailboxError::too_short));
    }
    const auto word = get<std::uint16_t>(data.data());
    switch (h->opcode) {
    case coe::Information::list_request: {
        if (word > 5) return information_error(coe::abort::parameter, out);
        list_ = List{};
        list_.list = static_cast<coe::List>(word);
        list_.active = true;
        const auto& all = dictionary_.objects();
        if (word == 0) {
            list_.count = 5;
        } else {
            list_.count = static_cast<std::size_t>(std::count_if(
                all.begin(), all.end(), [&](const auto& o) { return in_list(o, list_.list); }));
        }
        const std::size_t bytes = 2 + list_.count * 2;

        const std::size_t capacity =
            (out.mailbox() - mailbox_header_bytes - coe::information_header_bytes) &
            ~std::size_t{1};
        list_.fragments_left = static_cast<std::uint16_t>((bytes + capacity - 1) / capacity - 1);
        pump(out);
        return;
    }
    case coe::Information::object_request: return object(word, out);
    case coe::Information::entry_request:
        if (data.size() < 4) {
            return out.send(MailboxType::error,
                            write_mailbox_error(out.payload(), MailboxError::too_short));
        }
        return entry(word, data[2], data[3], out);
    default: return information_error(coe::abort::command, out);
    }
}

void CoeServer::pump(Outbox& out) noexcept {
    if (!list_.active) return;
    std::uint8_t* to = out.payload();
    const std::size_t end = (out.mailbox() - mailbox_header_bytes) & ~std::size_t{1};
    coe::write_information(
        to, {coe::Information::list_response, list_.fragments_left != 0, list_.fragments_left});
    std::size_t length = coe::information_header_bytes;
    const auto add = [&](std::size_t value) {
        put(to + length, static_cast<std::uint16_t>(value));
        length += 2;
    };
    const auto& all = dictionary_.objects();
    const bool first = list_.at == 0;
    if (list_.list == coe::List::lengths) {
        add(0);
        for (std::uint16_t n = 1; n <= 5; ++n) {
            add(static_cast<std::size_t>(std::count_if(all.begin(), all.end(), [&](const auto& o) {
                return in_list(o, static_cast<coe::List>(n));
            })));
        }
        list_.active = false;
        out.send(MailboxType::coe, length);
        return;
    }
    if (first) {
        add(static_cast<std::size_t>(list_.list));
    }
    std::size_t i = first ? 0 : list_.at - 1;  // at counts from 1, so that 0 is the beginning
    for (; i < all.size() && length + 2 <= end; ++i) {
        if (in_list(all[i], list_.list)) {
            add(all[i].index);
        }
    }
    list_.at = i + 1;
    if (list_.fragments_left == 0) {
        list_.active = false;
    } else {
        --list_.fragments_left;
    }
    out.send(MailboxType::coe, length);
}

void CoeServer::object(std::uint16_t index, Outbox& out) noexcept {
    const auto* o = dictionary_.find(index);
    if (o == nullptr) return information_error(coe::abort::no_object, out);
    std::uint8_t* to = out.payload();
    coe::write_information(to, {coe::Information::object_response, false, 0});
    std::uint8_t* at = to + coe::information_header_bytes;
    put(at, o->index);
    put(at + 2, o->type);
    at[4] = o->entries.back().sub;
    at[5] = static_cast<std::uint8_t>(o->code);
    const std::size_t n =
        std::min(o->name.size(), out.mailbox() - mailbox_header_bytes - coe::object_name);
    std::memcpy(to + coe::object_name, o->name.data(), n);
    out.send(MailboxType::coe, coe::object_name + n);
}

void CoeServer::entry(std::uint16_t index, std::uint8_t sub, std::uint8_t info,
                      Outbox& out) noexcept {
    if (dictionary_.find(index) == nullptr) return information_error(coe::abort::no_object, out);
    const auto* e = dictionary_.find(index, sub);
    if (e == nullptr) return information_error(coe::abort::no_sub, out);
    std::uint8_t* to = out.payload();
    coe::write_information(to, {coe::Information::entry_response, false, 0});
    std::uint8_t* at = to + coe::information_header_bytes;
    put(at, index);
    at[2] = sub;
    at[3] = info & 0x07;  // the access rights, mappability; defaults and limits are not offered
    put(at + 4, e->type);
    put(at + 6, e->bits);
    put(at + 8, e->access);
    const std::size_t n =
        std::min(e->name.size(), out.mailbox() - mailbox_header_bytes - coe::entry_name);
    std::memcpy(to + coe::entry_name, e->name.data(), n);
    out.send(MailboxType::coe, coe::entry_name + n);
}

}  // namespace hal::ethercat::devices
