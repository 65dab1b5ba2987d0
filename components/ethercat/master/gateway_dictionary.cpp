// SPDX-License-Identifier: MIT
// The dictionary of the master as the gateway offers it under station address 0 (ETG.1510).
#include <cstring>
#include <string_view>

#include "ethercat/master/gateway.hpp"

namespace hal::ethercat::master {
namespace {

constexpr std::size_t most_slaves = 0x1000;
constexpr std::size_t addresses_per_object = 255;

struct MasterValue {
    std::uint32_t number = 0;
    std::size_t bytes = 0;  // 0: does not exist
    std::string_view text;  // instead of a number
};

/// F000h: modular device profile.
MasterValue modular_device(std::uint8_t sub) noexcept {
    switch (sub) {
    case 0: return {2, 1, {}};
    case 1: return {1, 2, {}};  // distance of the objects of two slaves
    case 2: return {static_cast<std::uint32_t>(most_slaves), 2, {}};
    default: return {};
    }
}

/// F020h to F02Fh: addresses of the slaves, 255 in each.
MasterValue addresses(std::span<const GatewaySlave> slaves, std::size_t object,
                      std::uint8_t sub) noexcept {
    const std::size_t first = object * addresses_per_object;
    const auto rest = slaves.subspan(std::min(first, slaves.size()));
    const std::size_t count = std::min(rest.size(), addresses_per_object);
    if (sub == 0) return {static_cast<std::uint32_t>(count), 1, {}};
    return sub <= count ? MasterValue{rest[sub - 1U].station, 2, {}} : MasterValue{};
}

/// 8000h + n: what slave n is.
MasterValue description(const GatewaySlave& slave, std::uint8_t sub) noexcept {
    switch (sub) {
    case 0: return {8, 1, {}};
    case 1: return {slave.station, 2, {}};
    case 5: return {slave.vendor, 4, {}};
    case 6: return {slave.product, 4, {}};
    case 7: return {slave.revision, 4, {}};
    case 8: return {slave.serial, 4, {}};
    default: return {};
    }
}

/// 1018h: identity.
MasterValue identity(std::uint8_t sub) noexcept {
    if (sub == 0) return {4, 1, {}};
    return sub <= 4 ? MasterValue{0, 4, {}} : MasterValue{};
}

MasterValue value_of(std::span<const GatewaySlave> slaves, std::uint16_t index,
                     std::uint8_t sub) noexcept {
    constexpr std::uint32_t modular = 5000;
    constexpr std::uint16_t first_addresses = 0xf020;
    constexpr std::uint16_t last_addresses = 0xf02f;
    constexpr std::uint16_t first_description = 0x8000;
    switch (index) {
    case 0x1000: return sub == 0 ? MasterValue{modular, 4, {}} : MasterValue{};
    case 0x1008: return sub == 0 ? MasterValue{0, 0, "Halcyon EtherCAT master"} : MasterValue{};
    case 0x1018: return identity(sub);
    case 0xf000: return modular_device(sub);
    default: break;
    }
    if (index >= first_addresses && index <= last_addresses) {
        return addresses(slaves, index - first_addresses, sub);
    }
    if (index < first_description) return {};
    const std::size_t slave = index - first_description;
    const bool exists = slave < std::min(slaves.size(), most_slaves);
    return exists ? description(slaves[slave], sub) : MasterValue{};
}

}  // namespace

std::size_t answer_for_master(std::span<const GatewaySlave> slaves, std::span<std::uint8_t> message,
                              std::size_t length) noexcept {
    const auto request = read_mailbox(message.first(std::min(length, message.size())));
    constexpr std::size_t reserve = 64;
    if (!request || message.size() < mailbox_header_bytes + coe::sdo_bytes + reserve) return 0;
    const auto finish = [&](MailboxType type, std::size_t bytes) {
        write_mailbox_header(message.data(), bytes, 0, type, request->counter);
        return mailbox_header_bytes + bytes;
    };
    std::uint8_t* payload = message.data() + mailbox_header_bytes;
    const auto sdo =
        request->type == MailboxType::coe ? coe::read_sdo(request->payload) : std::nullopt;
    if (!sdo || coe::service_of(request->payload.data()) != coe::Service::sdo_request) {
        const auto fault = request->type == MailboxType::coe ? MailboxError::service_not_supported
                                                             : MailboxError::protocol_not_supported;
        return finish(MailboxType::error, write_mailbox_error(payload, fault));
    }
    coe::Sdo reply = *sdo;
    const MasterValue value = value_of(slaves, sdo->index, sdo->sub);
    reply.command = coe::command::abort;
    if (sdo->command == coe::command::abort) return 0;
    if (!sdo->is(coe::command::upload)) {
        reply.value = code_of(coe::Abort::read_only);
    } else if (sdo->complete()) {
        reply.value = code_of(coe::Abort::no_complete_access);
    } else if (value.bytes == 0 && value.text.empty()) {
        reply.value = value_of(slaves, sdo->index, 0).bytes != 0 ? code_of(coe::Abort::no_sub)
                                                                 : code_of(coe::Abort::no_object);
    } else if (value.text.empty()) {
        reply.command = coe::expedited_command(coe::command::upload_response, value.bytes);

        reply.value = value.number;
    } else {
        reply.command = coe::command::upload_response | coe::command::size_given;

        reply.value = static_cast<std::uint32_t>(value.text.size());
    }
    std::size_t bytes = coe::write_sdo(payload, coe::Service::sdo_response, reply);
    if (reply.command != coe::command::abort && !value.text.empty()) {
        std::memcpy(payload + bytes, value.text.data(), value.text.size());
        bytes += value.text.size();
    }
    return finish(MailboxType::coe, bytes);
}

}  // namespace hal::ethercat::master
