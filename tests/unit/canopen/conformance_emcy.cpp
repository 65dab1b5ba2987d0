// SPDX-License-Identifier: MIT
// Emergency 01 to 06 of the conformance test, against our device; an RPDO that is too short makes
// the emergency.
#include "conformance.hpp"

namespace hal::canopen::test {
namespace {

struct ConformanceEmcy : Conformance {
    Frame forced() {
        operational();
        send({0x205, {1}});
        run(1);
        const auto all = since(0x085);
        return all.size() == 1 ? all[0] : Frame{};
    }
};

TEST_F(ConformanceEmcy, Emergency_01_1014h_holds_the_predefined_identifier) {
    EXPECT_EQ(get(0x1014, 0), 0x85U);
}
TEST_F(ConformanceEmcy, Emergency_02_error_register_is_clear_without_errors) {
    EXPECT_EQ(get(0x1001, 0), 0U);
}
TEST_F(ConformanceEmcy, Emergency_03_history_is_empty_without_errors) {
    EXPECT_EQ(get(0x1003, 0), 0U);
    EXPECT_TRUE(one_of(read_abort(0x1003, 1), {Abort::none, Abort::no_data, Abort::no_sub}));
}
TEST_F(ConformanceEmcy, Emergency_04_an_error_is_told) {
    const Frame f = forced();
    ASSERT_EQ(f.length, 8);
    EXPECT_EQ(load<std::uint16_t>(f.data.data()), 0x8210);
}
TEST_F(ConformanceEmcy, Emergency_05_error_register_has_the_communication_bit) {
    const Frame f = forced();
    EXPECT_EQ(get(0x1001, 0) & error_communication, error_communication);
    EXPECT_EQ(get(0x1001, 0), f.data[2]);
    send({0x205, {1, 2}});
    run(1);
    EXPECT_EQ(get(0x1001, 0), 0U) << "and loses it again";
}
TEST_F(ConformanceEmcy, Emergency_06_history_holds_what_was_told) {
    const Frame f = forced();
    EXPECT_EQ(get(0x1003, 0), 1U);
    EXPECT_EQ(get(0x1003, 1) & 0xffff, load<std::uint16_t>(f.data.data()));
    EXPECT_EQ(put(0x1003, 0, 5), Abort::value);
    EXPECT_EQ(put(0x1003, 0, 0), Abort::none);
    EXPECT_EQ(get(0x1003, 0), 0U);
}

}  // namespace
}  // namespace hal::canopen::test
