// SPDX-License-Identifier: MIT
// PDO 01 to 33 of the conformance test, against our device.
#include "conformance.hpp"

namespace hal::canopen::test {
namespace {

using enum NmtCommand;

struct ConformancePdo : Conformance {
    static constexpr std::uint32_t off = cob_invalid;
    /// Sets up TPDO 1 while it is off, as a configuration tool does.
    void set_up(std::uint8_t transmission, std::uint16_t event_ms = 0, std::uint8_t start = 0) {
        ASSERT_EQ(put(0x1800, 1, off | 0x185), Abort::none);
        ASSERT_EQ(put(0x1800, 2, transmission), Abort::none);
        ASSERT_EQ(put(0x1800, 5, event_ms), Abort::none);
        ASSERT_EQ(put(0x1800, 6, start), Abort::none);
        ASSERT_EQ(put(0x1800, 1, 0x185), Abort::none);
    }
    void counted(std::uint8_t overflow) { ASSERT_EQ(put(0x1019, 0, overflow), Abort::none); }
    void change() {
        device->dictionary().set<std::uint8_t>(
            0x6000, 1,
            static_cast<std::uint8_t>(device->dictionary().get<std::uint8_t>(0x6000, 1) + 1));
        device->pdos().trigger(*device->dictionary().find(0x6000, 1));
    }
    std::size_t changed(unsigned times) {
        bus.log.clear();
        for (unsigned n = 0; n < times; ++n) {
            change();
            run(2);
        }
        return count(0x185);
    }
    std::size_t requested() {
        bus.log.clear();
        send(Frame::request(0x185, 2));
        run(1);
        return count(0x185);
    }
    /// The transmission of TPDO 1 by type, in a state in which there is none.
    void nothing_is_sent() {
        set_up(255);
        EXPECT_EQ(changed(5), 0U);
    }
    // Mapping.
    void open_mapping(std::uint16_t communication) {
        ASSERT_EQ(put(communication, 1, get(communication, 1) | off), Abort::none);
        ASSERT_EQ(put(static_cast<std::uint16_t>(communication + 0x200), 0, 0), Abort::none);
    }
    Abort map(std::uint16_t mapping, std::uint8_t n, std::uint32_t entry) {
        return put(mapping, n, entry);
    }
    /// What becomes of the object as the first one of a PDO whose mapping is open.
    Abort first_object(std::uint16_t communication, std::uint16_t index, std::uint8_t sub,
                       unsigned bits) {
        open_mapping(communication);
        return map(static_cast<std::uint16_t>(communication + 0x200), 1,
                   map_entry(index, sub, bits));
    }
    void SetUp() override { make(conforming()); }
};

TEST_F(ConformancePdo, Pdo_01_receive_pdos_have_their_predefined_identifiers) {
    for (std::uint16_t n = 0; n < 4; ++n) {
        EXPECT_EQ(get(static_cast<std::uint16_t>(0x1400 + n), 1) & 0x7ff, 0x205U + n * 0x100);
        EXPECT_EQ(get(static_cast<std::uint16_t>(0x1400 + n), 0), 5U);
    }
}
TEST_F(ConformancePdo, Pdo_02_transmit_pdos_have_their_predefined_identifiers) {
    for (std::uint16_t n = 0; n < 4; ++n) {
        EXPECT_EQ(get(static_cast<std::uint16_t>(0x1800 + n), 1) & 0x7ff, 0x185U + n * 0x100);
        EXPECT_EQ(get(static_cast<std::uint16_t>(0x1800 + n), 0), 6U);
    }
}
TEST_F(ConformancePdo, Pdo_03_operational_remote_request_is_answered) {
    set_up(253);
    operational();
    EXPECT_EQ(requested(), 1U);
    set_up(252);
    sync();
    EXPECT_EQ(requested(), 1U);
    set_up(255);
    EXPECT_EQ(requested(), 1U) << "an event-driven PDO may be asked for, too";
}
TEST_F(ConformancePdo, Pdo_04_operational_event_driven) {
    set_up(255);
    operational();
    EXPECT_EQ(changed(5), 5U);
    EXPECT_EQ(count_in(0x185, 100), 0U);
}
TEST_F(ConformancePdo, Pdo_05_operational_event_timer) {
    set_up(255, 50);
    operational();
    EXPECT_NEAR(static_cast<double>(count_in(0x185, 1000)), 20, 1);
}
TEST_F(ConformancePdo, Pdo_06_operational_cyclic) {
    operational();
    for (const unsigned n : {1U, 2U, 5U, 240U}) {
        set_up(static_cast<std::uint8_t>(n));
        EXPECT_EQ(count_of_syncs(0x185, 480), 480 / n) << n;
    }
}
TEST_F(ConformancePdo, Pdo_07_operational_acyclic) {
    set_up(0);
    operational();
    EXPECT_EQ(count_of_syncs(0x185, 5), 0U);
    change();
    EXPECT_EQ(count_of_syncs(0x185, 5), 1U);
}
TEST_F(ConformancePdo, Pdo_08_operational_start_value) {
    counted(10);
    set_up(5, 0, 3);
    operational();
    bus.log.clear();
    for (int counter = 1; counter <= 2; ++counter) {
        sync(counter);
    }
    EXPECT_EQ(count(0x185), 0U);
    sync(3);
    EXPECT_EQ(count(0x185), 1U);
    for (int counter = 4; counter <= 7; ++counter) {
        sync(counter);
    }
    EXPECT_EQ(count(0x185), 1U);
    sync(8);
    EXPECT_EQ(count(0x185), 2U);
}
TEST_F(ConformancePdo, Pdo_09_stopped_remote_request) {
    set_up(253);
    nmt(stop);
    EXPECT_EQ(requested(), 0U);
}
TEST_F(ConformancePdo, Pdo_10_stopped_event_driven) {
    set_up(255);
    nmt(stop);
    EXPECT_EQ(changed(5), 0U);
}
TEST_F(ConformancePdo, Pdo_11_stopped_event_timer) {
    set_up(255, 20);
    nmt(stop);
    EXPECT_EQ(count_in(0x185, 200), 0U);
}
TEST_F(ConformancePdo, Pdo_12_stopped_cyclic) {
    set_up(1);
    nmt(stop);
    EXPECT_EQ(count_of_syncs(0x185, 10), 0U);
}
TEST_F(ConformancePdo, Pdo_13_stopped_acyclic) {
    set_up(0);
    nmt(stop);
    change();
    EXPECT_EQ(count_of_syncs(0x185, 10), 0U);
}
TEST_F(ConformancePdo, Pdo_14_stopped_start_value) {
    counted(10);
    set_up(1, 0, 3);
    nmt(stop);
    EXPECT_EQ(count_of_syncs(0x185, 20, 10), 0U);
}
TEST_F(ConformancePdo, Pdo_15_pre_operational_remote_request) {
    set_up(253);
    EXPECT_EQ(requested(), 0U);
}
TEST_F(ConformancePdo, Pdo_16_pre_operational_event_driven) { nothing_is_sent(); }
TEST_F(ConformancePdo, Pdo_17_pre_operational_event_timer) {
    set_up(255, 20);
    EXPECT_EQ(count_in(0x185, 200), 0U);
}
TEST_F(ConformancePdo, Pdo_18_pre_operational_cyclic) {
    set_up(1);
    EXPECT_EQ(count_of_syncs(0x185, 10), 0U);
}
TEST_F(ConformancePdo, Pdo_19_pre_operational_acyclic) {
    set_up(0);
    change();
    EXPECT_EQ(count_of_syncs(0x185, 10), 0U);
}
TEST_F(ConformancePdo, Pdo_20_pre_operational_start_value) {
    counted(10);
    set_up(1, 0, 3);
    EXPECT_EQ(count_of_syncs(0x185, 20, 10), 0U);
}
TEST_F(ConformancePdo, Pdo_21_default_mapping_names_objects_that_are_there) {
    for (std::uint16_t n = 0; n < 4; ++n) {
        for (const std::uint16_t mapping :
             {static_cast<std::uint16_t>(0x1600 + n), static_cast<std::uint16_t>(0x1a00 + n)}) {
            unsigned bits = 0;
            for (std::uint8_t item = 1; item <= get(mapping, 0); ++item) {
                const auto entry = get(mapping, item);
                const Entry* e = device->dictionary().find(static_cast<std::uint16_t>(entry >> 16),
                                                           static_cast<std::uint8_t>(entry >> 8));
                ASSERT_NE(e, nullptr) << std::hex << entry;
                EXPECT_EQ(e->bits, entry & 0xff);
                EXPECT_TRUE(mapping < 0x1800 ? e->rpdo : e->tpdo);
                bits += entry & 0xff;
            }
            EXPECT_LE(bits, 64U);
        }
    }
}
TEST_F(ConformancePdo, Pdo_22_mapping_by_the_procedure) {
    for (const auto& [communication, object] :
         {std::pair<std::uint16_t, std::uint16_t>{0x1400, 0x6200}, {0x1800, 0x6000}}) {
        const auto mapping = static_cast<std::uint16_t>(communication + 0x200);
        const auto cob = get(communication, 1);
        open_mapping(communication);
        for (std::uint8_t n = 1; n <= 4; ++n) {
            EXPECT_EQ(map(mapping, n, map_entry(object, n, 8)), Abort::none);
        }
        EXPECT_EQ(put(mapping, 0, 4), Abort::none);
        EXPECT_EQ(put(communication, 1, cob), Abort::none);
        EXPECT_EQ(get(mapping, 0), 4U);
    }
    operational();
    send({0x205, {1, 2, 3, 4}});
    EXPECT_EQ(get(0x6200, 4), 4U);
    bus.log.clear();
    change();
    run(1);
    ASSERT_EQ(count(0x185), 1U);
    EXPECT_EQ(since(0x185)[0].length, 4);
}
TEST_F(ConformancePdo, Pdo_23_mapping_without_the_procedure) {
    ASSERT_EQ(put(0x1400, 1, off | 0x205), Abort::none);
    EXPECT_TRUE(one_of(map(0x1600, 1, map_entry(0x6200, 3, 8)),
                       {Abort::access, Abort::not_mappable, Abort::general}));
    ASSERT_EQ(put(0x1800, 1, off | 0x185), Abort::none);
    EXPECT_TRUE(one_of(map(0x1a00, 1, map_entry(0x6000, 3, 8)),
                       {Abort::access, Abort::not_mappable, Abort::general}));
}
TEST_F(ConformancePdo, Pdo_24_mapping_of_a_pdo_that_is_on) {
    for (const std::uint16_t mapping : {std::uint16_t{0x1600}, std::uint16_t{0x1a00}}) {
        EXPECT_TRUE(
            one_of(put(mapping, 0, 0), {Abort::access, Abort::general, Abort::device_state}))
            << std::hex << mapping;
        EXPECT_TRUE(one_of(map(mapping, 1, map_entry(0x6200, 3, 8)),
                           {Abort::access, Abort::general, Abort::device_state}));
    }
}
TEST_F(ConformancePdo, Pdo_25_too_many_objects) {
    open_mapping(0x1400);
    for (std::uint8_t n = 1; n <= 8; ++n) {
        EXPECT_EQ(map(0x1600, n, map_entry(0x6200, 1, 8)), Abort::none);
    }
    EXPECT_TRUE(one_of(put(0x1600, 0, 9), {Abort::access, Abort::not_mappable, Abort::pdo_length}));
    EXPECT_EQ(get(0x1600, 0), 0U);
}
TEST_F(ConformancePdo, Pdo_26_objects_that_are_too_long) {
    open_mapping(0x1400);
    for (std::uint8_t n = 1; n <= 5; ++n) {
        EXPECT_EQ(map(0x1600, n, map_entry(0x6411, 0, 16)), Abort::none);
    }
    EXPECT_EQ(put(0x1600, 0, 5), Abort::pdo_length);
    EXPECT_EQ(put(0x1600, 0, 4), Abort::none);
}
TEST_F(ConformancePdo, Pdo_27_process_output_into_a_receive_pdo) {
    EXPECT_EQ(first_object(0x1400, 0x6200, 5, 8), Abort::none);
}
TEST_F(ConformancePdo, Pdo_28_process_input_into_a_receive_pdo) {
    EXPECT_EQ(first_object(0x1400, 0x6000, 5, 8), Abort::not_mappable);
}
TEST_F(ConformancePdo, Pdo_29_unmappable_object_into_a_receive_pdo) {
    EXPECT_EQ(first_object(0x1400, 0x2004, 0, 16), Abort::not_mappable);
}
TEST_F(ConformancePdo, Pdo_30_process_input_into_a_transmit_pdo) {
    EXPECT_EQ(first_object(0x1800, 0x6000, 5, 8), Abort::none);
}
TEST_F(ConformancePdo, Pdo_31_process_output_into_a_transmit_pdo) {
    EXPECT_EQ(first_object(0x1800, 0x6200, 5, 8), Abort::not_mappable);
}
TEST_F(ConformancePdo, Pdo_32_unmappable_object_into_a_transmit_pdo) {
    EXPECT_EQ(first_object(0x1800, 0x2004, 0, 16), Abort::not_mappable);
}
TEST_F(ConformancePdo, Pdo_33_dummy_object) {
    open_mapping(0x1400);
    EXPECT_EQ(map(0x1600, 1, map_entry(0x0005, 0, 8)), Abort::none);
    EXPECT_EQ(map(0x1600, 2, map_entry(0x6200, 6, 8)), Abort::none);
    EXPECT_EQ(put(0x1600, 0, 2), Abort::none);
    EXPECT_EQ(put(0x1400, 1, 0x205), Abort::none);
    operational();
    send({0x205, {0xaa, 0x55}});
    EXPECT_EQ(get(0x6200, 6), 0x55U);
}

}  // namespace
}  // namespace hal::canopen::test
