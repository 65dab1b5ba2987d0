// SPDX-License-Identifier: MIT
#include "ethercat/devices/coe_server.hpp"

#include <gtest/gtest.h>

namespace hal::ethercat::devices {
namespace {

/// ETG.1000.6, SDO download: the answer has the complete access bit of its request.
TEST(EthercatCoeServer, Answers_a_segmented_download_of_a_whole_object_as_one) {
    constexpr std::uint8_t download_complete = 0x31;  // size given
    constexpr std::uint16_t both = coe::access::read | coe::access::write;
    Dictionary dictionary;
    dictionary.record(0x8000, "Settings", 2);
    dictionary.entry(1, "Long text", coe::type::octet_string, 8 * 60, both);
    dictionary.entry(2, "Another", coe::type::octet_string, 8 * 60, both);
    dictionary.finish();
    dictionary.power_on();
    CoeServer server(dictionary);
    Outbox out;
    out.clear(64);
    std::vector<std::uint8_t> request(coe::sdo_bytes + 40);
    coe::write_sdo(request.data(), coe::Service::sdo_request, {download_complete, 0x8000, 1, 120});
    MailboxMessage message;
    message.type = MailboxType::coe;
    message.payload = request;
    server.take(message, State::preop, out);
    ASSERT_FALSE(out.empty());
    const auto answer = read_mailbox(out.front());
    ASSERT_TRUE(answer.has_value());
    const auto sdo = coe::read_sdo(answer->payload);
    ASSERT_TRUE(sdo.has_value());
    EXPECT_EQ(sdo->command, 0x70) << "download response, complete access";
    EXPECT_EQ(sdo->index, 0x8000);
}

}  // namespace
}  // namespace hal::ethercat::devices
