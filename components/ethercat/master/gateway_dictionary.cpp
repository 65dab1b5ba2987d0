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

MasterValue value_of(std::span<const GatewaySlave> slaves, std::uint16_t index,
                     std::uint8_t sub) noexcept {
    if (index == 0x1000 && sub == 0) {
        return {5000, 4, {}};  // modular device
    }
    if (index == 0x1008 && sub == 0) {
        return {0, 0, "Halcyon EtherCAT master"};
    }
    if (index == 0x1018 && sub == 0) {
        return {4, 1, {}};
    }
    if (index == 0x1018 && sub <= 4) {
        return {0, 4, {}};
    }
    if (index == 0xf000 && sub <= 2) {
        if (sub == 0) {
            return {2, 1, {}};
        }
        const auto slaves_at_most = static_cast<std::uint32_t>(most_slaves);
        return {sub == 1 ? 1U : slaves_at_most, 2, {}};
    }
    if (index >= 0xf020 && index <= 0xf02f) {
        const std::size_t first = (index - 0xf020U) * addresses_per_object;
        const std::size_t count =
            slaves.size() <= first ? 0 : std::min(slaves.size() - first, addresses_per_object);
        if (sub == 0) {
            return {static_cast<std::uint32_t>(count), 1, {}};
        }
        return sub <= count ? MasterValue{slaves[first + sub - 1].station, 2, {}} : MasterValue{};
    }
    if (index >= 0x8000 && index - 0x8000U < std::min(slaves.size(), most_slaves)) {
        const GatewaySlave& slave = slaves[index - 0x8000U];
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
    return {};
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
