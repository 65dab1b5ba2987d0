// SPDX-License-Identifier: MIT
// The dictionary of the master as the gateway offers it under station address 0 (ETG.1510).
#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>

#include "ethercat/master/gateway.hpp"

namespace hal::ethercat::master {
namespace {

constexpr std::size_t max_slaves = 0x1000;
constexpr std::size_t addresses_per_object = 255;
constexpr std::uint16_t first_description = 0x8000;
constexpr std::uint16_t first_addresses = 0xf020;
constexpr std::uint16_t last_addresses = 0xf02f;

using Slaves = std::span<const GatewaySlave>;

/// An object of the master, as SDO information describes it.
struct MasterObject {
    std::string_view name;
    std::uint16_t type = 0;
    coe::ObjectCode code = coe::ObjectCode::variable;
    std::uint8_t last_sub = 0;

    explicit operator bool() const noexcept { return !name.empty(); }
};

/// An entry of an object.
struct MasterEntry {
    std::string_view name;
    std::uint16_t type = 0;
    std::uint32_t number = 0;
    std::string_view text{};  // instead of a number

    explicit operator bool() const noexcept { return !name.empty(); }
    std::size_t bytes() const noexcept {
        switch (type) {
        case coe::type::u8: return 1;
        case coe::type::u16: return 2;
        case coe::type::u32: return 4;
        default: return text.size();
        }
    }
};

constexpr MasterEntry last_sub(std::uint32_t number) noexcept {
    return {"Number of entries", coe::type::u8, number};
}

/// F000h: modular device profile.
MasterEntry modular_device(std::uint8_t sub) noexcept {
    switch (sub) {
    case 0: return last_sub(2);
    case 1: return {"Index distance", coe::type::u16, 1};  // of the objects of two slaves
    case 2: return {"Maximum number of modules", coe::type::u16, max_slaves};
    default: return {};
    }
}

/// Returns how many addresses an object from F020h to F02Fh has, 255 at most.
std::uint8_t address_count(Slaves slaves, std::uint16_t index) noexcept {
    const std::size_t first = std::size_t{addresses_per_object} * (index - first_addresses);
    const std::size_t rest = slaves.size() - std::min(first, slaves.size());
    return static_cast<std::uint8_t>(std::min(rest, addresses_per_object));
}

/// F020h to F02Fh: addresses of the slaves.
MasterEntry address(Slaves slaves, std::uint16_t index, std::uint8_t sub) noexcept {
    const std::uint8_t count = address_count(slaves, index);
    if (sub == 0) return last_sub(count);
    if (sub > count) return {};
    const std::size_t first = std::size_t{addresses_per_object} * (index - first_addresses);
    return {"Configured address", coe::type::u16, slaves[first + sub - 1U].station};
}

/// 8000h + n: what slave n is.
MasterEntry description(const GatewaySlave& slave, std::uint8_t sub) noexcept {
    switch (sub) {
    case 0: return last_sub(8);
    case 1: return {"Fixed station address", coe::type::u16, slave.station};
    case 5: return {"Vendor ID", coe::type::u32, slave.vendor};
    case 6: return {"Product code", coe::type::u32, slave.product};
    case 7: return {"Revision number", coe::type::u32, slave.revision};
    case 8: return {"Serial number", coe::type::u32, slave.serial};
    default: return {};
    }
}

/// 1018h: identity.
MasterEntry identity(std::uint8_t sub) noexcept {
    switch (sub) {
    case 0: return last_sub(4);
    case 1: return {"Vendor ID", coe::type::u32, 0};
    case 2: return {"Product code", coe::type::u32, 0};
    case 3: return {"Revision number", coe::type::u32, 0};
    case 4: return {"Serial number", coe::type::u32, 0};
    default: return {};
    }
}

bool is_addresses(std::uint16_t index) noexcept {
    return index >= first_addresses && index <= last_addresses;
}
bool is_description(Slaves slaves, std::uint16_t index) noexcept {
    return index >= first_description &&
           index - first_description < static_cast<int>(std::min(slaves.size(), max_slaves));
}

MasterEntry entry_of(Slaves slaves, std::uint16_t index, std::uint8_t sub) noexcept {
    constexpr std::uint32_t modular = 5000;
    const auto only = [sub](MasterEntry entry) { return sub == 0 ? entry : MasterEntry{}; };
    switch (index) {
    case 0x1000: return only({"Device type", coe::type::u32, modular});
    case 0x1008:
        return only({"Device name", coe::type::visible_string, 0, "Halcyon EtherCAT master"});
    case 0x1018: return identity(sub);
    case 0xf000: return modular_device(sub);
    default: break;
    }
    if (is_addresses(index)) return address(slaves, index, sub);
    if (is_description(slaves, index)) return description(slaves[index - first_description], sub);
    return {};
}

MasterObject object_of(Slaves slaves, std::uint16_t index) noexcept {
    using coe::ObjectCode;
    switch (index) {
    case 0x1000: return {"Device type", coe::type::u32};
    case 0x1008: return {"Device name", coe::type::visible_string};
    case 0x1018: return {"Identity", coe::type::identity, ObjectCode::record, 4};
    case 0xf000: return {"Modular device profile", coe::type::u16, ObjectCode::record, 2};
    default: break;
    }
    if (is_addresses(index)) {
        return {"Configured addresses", coe::type::u16, ObjectCode::array,
                address_count(slaves, index)};
    }
    if (is_description(slaves, index)) {
        return {"Configuration of a slave", coe::type::u32, ObjectCode::record, 8};
    }
    return {};
}

/// Writes an answer behind the mailbox header of a message. All functions return the length of the
/// payload.
class MasterAnswer {
public:
    MasterAnswer(Slaves slaves, std::span<std::uint8_t> payload) noexcept
        : slaves_(slaves), to_(payload) {}

    std::size_t upload(coe::Sdo sdo) noexcept {
        const MasterEntry entry = entry_of(slaves_, sdo.index, sdo.sub);
        if (!sdo.is(coe::command::upload)) return abort(sdo, coe::Abort::read_only);
        if (!entry) {
            return abort(
                sdo, object_of(slaves_, sdo.index) ? coe::Abort::no_sub : coe::Abort::no_object);
        }
        if (sdo.complete()) {
            return sdo.sub > 1 ? abort(sdo, coe::Abort::no_complete_access) : upload_complete(sdo);
        }
        if (entry.text.empty()) {
            sdo.command = coe::expedited_command(coe::command::upload_response, entry.bytes());
            sdo.value = entry.number;
            return coe::write_sdo(to_.data(), coe::Service::sdo_response, sdo);
        }
        end_ = coe::sdo_bytes;
        put_text(entry.text);
        return finish_upload(sdo);
    }

    /// `request` has the parameters of its opcode.
    std::size_t describe(std::span<const std::uint8_t> request) noexcept {
        const auto h = coe::read_information(request);
        const auto data = request.subspan(coe::information_header_bytes);
        const auto word = get<std::uint16_t>(data.data());
        switch (h->opcode) {
        case coe::Information::list_request: return list(word);
        case coe::Information::object_request: return describe_object(word);
        case coe::Information::entry_request: return describe_entry(word, data[2], data[3]);
        default: return information_error(coe::Abort::command);
        }
    }

private:
    std::size_t abort(coe::Sdo sdo, coe::Abort why) noexcept {
        sdo.command = coe::command::abort;
        sdo.value = code_of(why);
        return coe::write_sdo(to_.data(), coe::Service::sdo_response, sdo);
    }

    /// From the sub-index of the request; sub-index 0 takes 16 bits (ETG.1000.6, clause 5.6.2.1).
    std::size_t upload_complete(const coe::Sdo& sdo) noexcept {
        end_ = coe::sdo_bytes;
        const std::uint8_t last = object_of(slaves_, sdo.index).last_sub;
        for (unsigned sub = sdo.sub; sub <= last; ++sub) {
            const MasterEntry entry = entry_of(slaves_, sdo.index, static_cast<std::uint8_t>(sub));
            if (!entry) continue;
            if (to_.size() - end_ < std::max<std::size_t>(entry.bytes(), 4)) break;
            if (!entry.text.empty()) {
                put_text(entry.text);
                continue;
            }
            put(to_.data() + end_, entry.number);
            end_ += sub == 0 && last != 0 ? 2 : entry.bytes();
        }
        return finish_upload(sdo);
    }

    std::size_t finish_upload(coe::Sdo sdo) noexcept {
        const auto complete = sdo.command & coe::command::complete;
        sdo.command = static_cast<std::uint8_t>(coe::command::upload_response |
                                                coe::command::size_given | complete);
        sdo.value = static_cast<std::uint32_t>(end_ - coe::sdo_bytes);
        coe::write_sdo(to_.data(), coe::Service::sdo_response, sdo);
        return end_;
    }

    void put_text(std::string_view text) noexcept {
        const std::size_t length = std::min(text.size(), to_.size() - end_);
        std::memcpy(to_.data() + end_, text.data(), length);
        end_ += length;
    }
    void put_word(std::uint16_t word) noexcept {
        if (to_.size() - end_ < sizeof word) return;
        put(to_.data() + end_, word);
        end_ += sizeof word;
    }
    void begin(coe::Information opcode) noexcept {
        coe::write_information(to_.data(), {opcode, false, 0});
        end_ = coe::information_header_bytes;
    }

    std::size_t information_error(coe::Abort why) noexcept {
        begin(coe::Information::error);
        put(to_.data() + end_, code_of(why));
        return end_ + 4;
    }

    /// Answers with a list of all objects, as many as one message holds; no object is in another
    /// list.
    std::size_t list(std::uint16_t number) noexcept {
        constexpr std::uint16_t lists = 5;
        if (number > lists) return information_error(coe::Abort::incompatible);
        begin(coe::Information::list_response);
        put_word(number);
        if (number == static_cast<std::uint16_t>(coe::List::lengths)) {
            put_word(static_cast<std::uint16_t>(fixed_objects + described()));
            for (unsigned other = 1; other < lists; ++other) {
                put_word(0);
            }
        } else if (number == static_cast<std::uint16_t>(coe::List::all)) {
            put_objects();
        }
        return end_;
    }
    void put_objects() noexcept {
        constexpr std::uint16_t own_objects[] = {0x1000, 0x1008, 0x1018};
        for (const std::uint16_t index : own_objects) {
            put_word(index);
        }
        for (std::size_t n = 0; n < described(); ++n) {
            put_word(static_cast<std::uint16_t>(first_description + n));
        }
        put_word(0xf000);
        for (std::uint16_t index = first_addresses; index <= last_addresses; ++index) {
            put_word(index);
        }
    }
    std::size_t described() const noexcept { return std::min(slaves_.size(), max_slaves); }

    std::size_t describe_object(std::uint16_t index) noexcept {
        const MasterObject object = object_of(slaves_, index);
        if (!object) return information_error(coe::Abort::no_object);
        begin(coe::Information::object_response);
        put_word(index);
        put_word(object.type);
        to_[end_++] = object.last_sub;
        to_[end_++] = static_cast<std::uint8_t>(object.code);
        put_text(object.name);
        return end_;
    }

    std::size_t describe_entry(std::uint16_t index, std::uint8_t sub,
                               std::uint8_t details) noexcept {
        const MasterEntry entry = entry_of(slaves_, index, sub);
        if (!entry) {
            return information_error(object_of(slaves_, index) ? coe::Abort::no_sub
                                                               : coe::Abort::no_object);
        }
        begin(coe::Information::entry_response);
        put_word(index);
        to_[end_++] = sub;
        to_[end_++] = details & 0x07;  // defaults and limits are not offered
        put_word(entry.type);
        put_word(static_cast<std::uint16_t>(8 * entry.bytes()));
        put_word(coe::access::read);
        put_text(entry.name);
        return end_;
    }

    // 1000h, 1008h, 1018h, F000h, F020h to F02Fh
    static constexpr std::size_t fixed_objects = 4 + last_addresses - first_addresses + 1;

    Slaves slaves_;
    std::span<std::uint8_t> to_;
    std::size_t end_ = 0;
};

/// Returns whether a request for SDO information has the parameters of its opcode.
bool is_complete(std::span<const std::uint8_t> request) noexcept {
    const auto h = coe::read_information(request);
    if (!h) return false;
    const std::size_t parameters = h->opcode == coe::Information::entry_request ? 4 : 2;
    return request.size() >= coe::information_header_bytes + parameters;
}

}  // namespace

std::size_t answer_for_master(std::span<const GatewaySlave> slaves, std::span<std::uint8_t> message,
                              std::size_t length) noexcept {
    const auto request = read_mailbox(message.first(std::min(length, message.size())));
    constexpr std::size_t reserve = 64;
    if (!request || message.size() < mailbox_header_bytes + coe::sdo_bytes + reserve) return 0;
    const std::span<std::uint8_t> payload = message.subspan(mailbox_header_bytes);
    const auto finish = [&](MailboxType type, std::size_t bytes) {
        write_mailbox_header(message.data(), bytes, 0, type, request->counter);
        return mailbox_header_bytes + bytes;
    };
    const auto refuse = [&](MailboxError why) {
        return finish(MailboxType::error, write_mailbox_error(payload.data(), why));
    };
    if (request->type != MailboxType::coe) return refuse(MailboxError::protocol_not_supported);
    MasterAnswer answer(slaves, payload);
    const bool has_service = request->payload.size() >= 2;
    const auto service = has_service ? coe::service_of(request->payload.data()) : coe::Service{};
    if (service == coe::Service::sdo_information) {
        if (!is_complete(request->payload)) return refuse(MailboxError::too_short);
        std::array<std::uint8_t, 16> copy{};  // the answer is written over the request
        std::copy_n(request->payload.begin(), std::min(copy.size(), request->payload.size()),
                    copy.begin());
        return finish(MailboxType::coe, answer.describe(copy));
    }
    const auto sdo = coe::read_sdo(request->payload);
    if (!sdo || service != coe::Service::sdo_request) {
        return refuse(MailboxError::service_not_supported);
    }
    if (sdo->command == coe::command::abort) return 0;
    return finish(MailboxType::coe, answer.upload(*sdo));
}

}  // namespace hal::ethercat::master
