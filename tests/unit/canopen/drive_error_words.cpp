// SPDX-License-Identifier: MIT
// Codes of errors in words: those of drives are not those of other nodes.
#include <gtest/gtest.h>

#include "canopen/master/cycle/emergency_text.hpp"
#include "canopen/protocol/emcy.hpp"
#include "cia402/drive_profile.hpp"
#include "cia402/error_words.hpp"

namespace hal::canopen {
namespace {

TEST(DriveErrorWords, Codes_of_cia_402_have_their_own_words) {
    EXPECT_STREQ(cia402::error_word(0x7305), "incremental sensor 1");
    EXPECT_STREQ(cia402::error_word(0x2310), "continuous over-current");
    EXPECT_STREQ(cia402::error_word(0x3220), "DC link under-voltage");
    EXPECT_STREQ(cia402::error_word(0x8611), "following error");
    EXPECT_STREQ(cia402::error_word(0x2110), "short circuit or earth leakage, input");
    EXPECT_STREQ(cia402::error_word(0xf004), "control");
}

TEST(DriveErrorWords, Other_codes_have_the_word_of_their_class) {
    EXPECT_STREQ(cia402::error_word(0x8130), emergency_text(0x8130));
    EXPECT_STREQ(cia402::error_word(0x7399), "additional modules");
    EXPECT_STREQ(cia402::error_word(0xff42), "device specific");
    EXPECT_STREQ(cia402::error_word(0), emergency_text(0));
}

TEST(DriveErrorWords, Master_says_them_of_drives_only) {
    config::MasterConfig config;
    for (const std::uint8_t id : std::initializer_list<std::uint8_t>{5, 6, 7}) {
        config::Node n;
        n.setup.id = id;
        n.name = "n" + std::to_string(id);
        if (id == 5) {
            n.setup.device_type = 0x00020192;
        }
        if (id == 6) {  // no device type, but a mapped statusword of its second axis
            config::Pdo pdo;
            config::Object word;
            word.index = 0x6841;
            pdo.objects.push_back(word);
            n.pdos.push_back(pdo);
        }
        config.nodes.push_back(n);
    }
    EXPECT_STREQ(emergency_text(config, 5, 0x7305), "incremental sensor 1");
    EXPECT_STREQ(emergency_text(config, 6, 0x7305), "incremental sensor 1");
    EXPECT_STREQ(emergency_text(config, 7, 0x7305), "additional modules");
    EXPECT_STREQ(emergency_text(config, 8, 0x7305), "additional modules")
        << "nobody knows that node";
}

}  // namespace
}  // namespace hal::canopen
