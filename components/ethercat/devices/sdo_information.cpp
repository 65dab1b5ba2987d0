// SPDX-License-Identifier: MIT
#include "ethercat/devices/sdo_information.hpp"

#include <algorithm>
#include <cstring>

namespace hal::ethercat::devices {

namespace {

/// Lists besides that of their lengths.
constexpr std::uint16_t max_list = 5;

/// Returns the access right that puts an entry into a list; 0: every entry.
std::uint16_t right_of(coe::List list) noexcept {
    switch (list) {
    case coe::List::rx_mappable: return coe::access::rx_mappable;
    case coe::List::tx_mappable: return coe::access::tx_mappable;
    case coe::List::backup: return coe::access::backup;
    case coe::List::settings: return coe::access::setting;
    default: return 0;
    }
}

bool in_list(const DictionaryObject& o, coe::List list) noexcept {
    if (list == coe::List::all) return true;
    const std::uint16_t right = right_of(list);
    return std::any_of(o.entries.begin(), o.entries.end(),
                       [right](const auto& e) { return (e.access & right) != 0; });
}

std::size_t capacity_of(const Outbox& out) noexcept {
    return (out.mailbox() - mailbox_header_bytes) & ~std::size_t{1};
}

void send_error(coe::Abort why, Outbox& out) noexcept {
    std::uint8_t* to = out.payload();
    coe::write_information(to, {coe::Information::error, false, 0});
    put(to + coe::information_header_bytes, cia301::code_of(why));
    out.send(MailboxType::coe, coe::information_header_bytes + 4);
}

void refuse_short(Outbox& out) noexcept {
    out.send(MailboxType::error, write_mailbox_error(out.payload(), MailboxError::too_short));
}

/// Sends the description that ends with a name at offset `at` of the payload.
void send_named(const std::string& name, std::size_t at, Outbox& out) noexcept {
    const std::size_t n = std::min(name.size(), out.mailbox() - mailbox_header_bytes - at);
    std::memcpy(out.payload() + at, name.data(), n);
    out.send(MailboxType::coe, at + n);
}

}  // namespace

void SdoInformation::take(std::span<const std::uint8_t> payload, Outbox& out) noexcept {
    const auto h = coe::read_information(payload);
    const auto data = payload.subspan(std::min(payload.size(), coe::information_header_bytes));
    if (!h || data.size() < 2) return refuse_short(out);
    const auto word = get<std::uint16_t>(data.data());
    switch (h->opcode) {
    case coe::Information::list_request: return begin_list(word, out);
    case coe::Information::object_request: return describe_object(word, out);
    case coe::Information::entry_request:
        if (data.size() < 4) return refuse_short(out);
        return describe_entry(word, data[2], data[3], out);
    default: return send_error(coe::Abort::command, out);
    }
}

std::size_t SdoInformation::count(coe::List list) const noexcept {
    const auto& all = dictionary_.objects();
    return static_cast<std::size_t>(
        std::count_if(all.begin(), all.end(), [list](const auto& o) { return in_list(o, list); }));
}

void SdoInformation::begin_list(std::uint16_t number, Outbox& out) noexcept {
    if (number > max_list) return send_error(coe::Abort::incompatible, out);
    list_ = List{};
    if (number == static_cast<std::uint16_t>(coe::List::lengths)) return send_lengths(out);
    list_.list = static_cast<coe::List>(number);
    list_.active = true;
    const std::size_t bytes = 2 + 2 * count(list_.list);
    const std::size_t capacity = capacity_of(out) - coe::information_header_bytes;
    list_.fragments_left = static_cast<std::uint16_t>((bytes + capacity - 1) / capacity - 1);
    pump(out);
}

void SdoInformation::send_lengths(Outbox& out) noexcept {
    std::uint8_t* to = out.payload();
    coe::write_information(to, {coe::Information::list_response, false, 0});
    std::uint8_t* at = to + coe::information_header_bytes;
    put(at, static_cast<std::uint16_t>(coe::List::lengths));
    for (std::uint16_t n = 1; n <= max_list; ++n) {
        put(at + std::size_t{2} * n, static_cast<std::uint16_t>(count(static_cast<coe::List>(n))));
    }
    out.send(MailboxType::coe, coe::information_header_bytes + 2 * (max_list + 1));
}

void SdoInformation::pump(Outbox& out) noexcept {
    if (!list_.active) return;
    std::uint8_t* to = out.payload();
    const bool more = list_.fragments_left != 0;
    coe::write_information(to, {coe::Information::list_response, more, list_.fragments_left});
    std::size_t length = coe::information_header_bytes;
    const auto add = [&](std::uint16_t value) {
        put(to + length, value);
        length += sizeof value;
    };
    if (!list_.begun) {
        list_.begun = true;
        add(static_cast<std::uint16_t>(list_.list));
    }
    const auto& all = dictionary_.objects();
    for (; list_.at < all.size() && length + 2 <= capacity_of(out); ++list_.at) {
        if (in_list(all[list_.at], list_.list)) {
            add(all[list_.at].index);
        }
    }
    list_.active = more;
    if (more) {
        --list_.fragments_left;
    }
    out.send(MailboxType::coe, length);
}

void SdoInformation::describe_object(std::uint16_t index, Outbox& out) noexcept {
    const auto* o = dictionary_.find(index);
    if (o == nullptr) return send_error(coe::Abort::no_object, out);
    std::uint8_t* to = out.payload();
    coe::write_information(to, {coe::Information::object_response, false, 0});
    std::uint8_t* at = to + coe::information_header_bytes;
    put(at, o->index);
    put(at + 2, o->type);
    at[4] = o->entries.back().sub;
    at[5] = static_cast<std::uint8_t>(o->code);
    send_named(o->name, coe::object_name, out);
}

void SdoInformation::describe_entry(std::uint16_t index, std::uint8_t sub, std::uint8_t info,
                                    Outbox& out) noexcept {
    if (dictionary_.find(index) == nullptr) return send_error(coe::Abort::no_object, out);
    const auto* e = dictionary_.find(index, sub);
    if (e == nullptr) return send_error(coe::Abort::no_sub, out);
    std::uint8_t* to = out.payload();
    coe::write_information(to, {coe::Information::entry_response, false, 0});
    std::uint8_t* at = to + coe::information_header_bytes;
    put(at, index);
    at[2] = sub;
    at[3] = info & 0x07;  // the access rights, mappability; defaults and limits are not offered
    put(at + 4, e->type);
    put(at + 6, e->bits);
    put(at + 8, e->access);
    send_named(e->name, coe::entry_name, out);
}

}  // namespace hal::ethercat::devices
