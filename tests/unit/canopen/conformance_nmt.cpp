// SPDX-License-Identifier: MIT
// State 01 to 04, Transition 01 to 04 and Testing other 01 to 10 of the conformance test, against
// our device.
#include "conformance.hpp"

namespace hal::canopen::test {
namespace {

using enum NmtCommand;

struct ConformanceNmt : Conformance {
    static constexpr std::uint32_t save = 0x65766173;
    static constexpr std::uint32_t load_defaults = 0x64616f6c;

    static constexpr std::uint32_t wrong_save = 0x6e6f7277;
    /// Returns the NMT state in the last heartbeat of the node.
    int said() {
        const auto beats = (bus.log.clear(), run(25), since(0x705));
        return beats.empty() ? -1 : beats.back().data[0];
    }
    void SetUp() override {
        Conformance::SetUp();
        put(0x1017, 0, 10);
    }
    bool answers_sdo() { return sdo({0x40, 0, 0x10, 0, 0, 0, 0, 0}).data[0] == 0x43; }
    bool answers_sync() {
        put(0x1800, 1, 0x80000185);
        put(0x1800, 2, 1);
        put(0x1800, 1, 0x185);
        return count_of_syncs(0x185, 3) == 3;
    }
    std::size_t boot_ups() const {
        std::size_t n = 0;
        for (const auto& f : bus.sent(0x705)) {
            n += f.data[0] == 0 ? 1 : 0;
        }
        return n;
    }
};

TEST_F(ConformanceNmt, State_01_initialisation_restores_defaults_and_says_boot_up) {
    for (const NmtCommand reset : {reset_node, reset_communication}) {
        put(0x1006, 0, 5000);
        put(0x1014, 0, 0x80000085);
        put(0x1800, 5, 77);

        put(0x1016, 1, 9 << 16 | 100);
        bus.log.clear();
        nmt(reset);
        run(1);
        EXPECT_EQ(boot_ups(), 1U);
        EXPECT_EQ(get(0x1006, 0), 0U);
        EXPECT_EQ(get(0x1014, 0), 0x85U);
        EXPECT_EQ(get(0x1800, 5), 0U);
        EXPECT_EQ(get(0x1016, 1), 0U);
        EXPECT_EQ(get(0x1017, 0), 0U);
    }
}
TEST_F(ConformanceNmt, State_02_pre_operational_has_sdo_sync_and_emcy_but_no_pdo) {
    EXPECT_EQ(said(), 0x7f);
    EXPECT_TRUE(answers_sdo());
    EXPECT_FALSE(answers_sync());
    send({0x205, {1, 2}});
    EXPECT_EQ(get(0x6200, 1), 0U);
    device->emcy().raise(0x1000, error_generic);
    run(1);
    EXPECT_EQ(count(0x085), 1U);
}
TEST_F(ConformanceNmt, State_03_operational_has_all) {
    operational();
    EXPECT_EQ(said(), 5);
    EXPECT_TRUE(answers_sdo());
    EXPECT_TRUE(answers_sync());
    send({0x205, {1, 2}});
    EXPECT_EQ(get(0x6200, 1), 1U);
}
TEST_F(ConformanceNmt, State_04_stopped_has_nmt_and_error_control_only) {
    nmt(stop);
    EXPECT_EQ(said(), 4);
    EXPECT_FALSE(answers_sdo());
    bus.log.clear();
    device->emcy().raise(0x1000, error_generic);
    sync();
    send({0x205, {1, 2}});
    run(5);
    EXPECT_EQ(count(0x085), 0U);
    EXPECT_EQ(device->dictionary().get<std::uint8_t>(0x6200, 1), 0);
}
TEST_F(ConformanceNmt, Transition_01_resets_work_in_every_state) {
    for (const NmtCommand from : {enter_pre_operational, start, stop}) {
        for (const NmtCommand reset : {reset_node, reset_communication}) {
            nmt(from);
            bus.log.clear();
            nmt(reset, 0);
            run(1);
            EXPECT_EQ(boot_ups(), 1U);
            EXPECT_EQ(device->state(), NmtState::pre_operational);
        }
    }
}
TEST_F(ConformanceNmt, Transition_02_enter_pre_operational_from_every_state) {
    for (const NmtCommand from : {enter_pre_operational, start, stop}) {
        nmt(from);
        nmt(enter_pre_operational);
        EXPECT_EQ(said(), 0x7f);
    }
}
TEST_F(ConformanceNmt, Transition_03_start_from_every_state) {
    for (const NmtCommand from : {enter_pre_operational, start, stop}) {
        nmt(from);
        nmt(start);
        EXPECT_EQ(said(), 5);
    }
}
TEST_F(ConformanceNmt, Transition_04_stop_from_every_state) {
    for (const NmtCommand from : {enter_pre_operational, start, stop}) {
        nmt(from);
        nmt(stop, 0);
        EXPECT_EQ(said(), 4);
        nmt(stop, 6);
        nmt(start, 6);
        EXPECT_EQ(said(), 4) << "the command of another node";
    }
}

TEST_F(ConformanceNmt, Other_01_store_all_with_a_wrong_signature) {
    EXPECT_EQ(get(0x1010, 1) & 1, 1U);
    EXPECT_EQ(write(0x1010, 1, wrong_save, 4), Abort::cannot_store);
    EXPECT_EQ(events.stored, 0);
}
TEST_F(ConformanceNmt, Other_02_store_all) {
    put(0x1017, 0, 123);
    put(0x2000, 0, 77);
    EXPECT_EQ(write(0x1010, 1, save, 4), Abort::none);
    nmt(reset_node);
    EXPECT_EQ(get(0x1017, 0), 123U);
    EXPECT_EQ(get(0x2000, 0), 77U);
}
TEST_F(ConformanceNmt, Other_03_restore_all_with_a_wrong_signature) {
    EXPECT_EQ(write(0x1011, 1, wrong_save, 4), Abort::cannot_store);
}
TEST_F(ConformanceNmt, Other_04_restore_all_holds_from_the_next_reset_on) {
    put(0x1017, 0, 123);
    put(0x2000, 0, 77);
    write(0x1010, 1, save, 4);
    EXPECT_EQ(write(0x1011, 1, load_defaults, 4), Abort::none);
    EXPECT_EQ(get(0x1017, 0), 123U);
    nmt(reset_node);
    EXPECT_EQ(get(0x1017, 0), 0U);
    EXPECT_EQ(get(0x2000, 0), 5U);
}
TEST_F(ConformanceNmt, Other_05_store_communication_with_a_wrong_signature) {
    EXPECT_EQ(write(0x1010, 2, wrong_save, 4), Abort::cannot_store);
}
TEST_F(ConformanceNmt, Other_06_store_communication_only) {
    put(0x1017, 0, 123);
    put(0x2000, 0, 77);
    EXPECT_EQ(write(0x1010, 2, save, 4), Abort::none);
    nmt(reset_node);
    EXPECT_EQ(get(0x1017, 0), 123U);
    EXPECT_EQ(get(0x2000, 0), 5U);
}
TEST_F(ConformanceNmt, Other_07_restore_communication_with_a_wrong_signature) {
    EXPECT_EQ(write(0x1011, 2, wrong_save, 4), Abort::cannot_store);
}
TEST_F(ConformanceNmt, Other_08_restore_communication_only) {
    put(0x1017, 0, 123);
    put(0x2000, 0, 77);
    write(0x1010, 1, save, 4);
    EXPECT_EQ(write(0x1011, 2, load_defaults, 4), Abort::none);
    nmt(reset_node);
    EXPECT_EQ(get(0x1017, 0), 0U);
    EXPECT_EQ(get(0x2000, 0), 77U);
}
TEST_F(ConformanceNmt, Other_09_configuration_date_is_kept_only_when_it_is_stored) {
    Description d = conforming();
    d.add(0x1020, 0, Type::unsigned8, Access::constant, 2);
    for (std::uint8_t sub = 1; sub <= 2; ++sub) {
        d.add(0x1020, sub, Type::unsigned32, Access::read_write, 0);
    }
    bus = {};
    make(d);
    put(0x1020, 1, 1234);
    put(0x1020, 2, 5678);
    nmt(reset_node);
    EXPECT_EQ(get(0x1020, 1), 0U);
    put(0x1020, 1, 1234);
    put(0x1020, 2, 5678);
    write(0x1010, 1, save, 4);
    nmt(reset_node);
    EXPECT_EQ(get(0x1020, 1), 1234U);
    EXPECT_EQ(get(0x1020, 2), 5678U);
}
TEST_F(ConformanceNmt, Other_10_restricted_identifiers_are_refused_everywhere) {
    const auto all = [](std::uint32_t first, std::uint32_t last) {
        std::vector<std::uint32_t> ids;
        for (auto id = first; id <= last; ++id) {
            ids.push_back(id);
        }
        return ids;
    };
    std::vector<std::uint32_t> ids;
    for (const auto& [first, last] : {std::pair{0U, 0x7fU},
                                      {0x101U, 0x180U},
                                      {0x581U, 0x5ffU},
                                      {0x601U, 0x67fU},
                                      {0x6e0U, 0x6ffU},
                                      {0x701U, 0x7ffU}}) {
        for (const auto id : all(first, last)) {
            ids.push_back(id);
        }
    }
    struct Place {
        std::uint16_t index;
        std::uint8_t sub;
    };
    for (const Place& p : {Place{0x1005, 0},
                           {0x1012, 0},
                           {0x1014, 0},
                           {0x1201, 1},
                           {0x1201, 2},
                           {0x1280, 1},
                           {0x1280, 2},
                           {0x1400, 1},
                           {0x1800, 1}}) {
        // 1012h and SDO channels reject any new identifier while they are enabled; they are
        // disabled here.
        write(p.index, p.sub,
              cob_invalid | (p.index == 0x1014   ? 0x85
                             : p.index >= 0x1800 ? 0x185
                             : p.index >= 0x1400 ? 0x205
                                                 : 0),
              4);
        for (const auto id : ids) {
            if ((p.index == 0x1201 || p.index == 0x1280) &&
                ((id >= 0x581 && id <= 0x5ff) || (id >= 0x601 && id <= 0x67f))) {
                continue;  // these are SDO's
            }
            EXPECT_NE(write(p.index, p.sub, id, 4), Abort::none)
                << std::hex << p.index << " " << id;
        }
    }
}

}  // namespace
}  // namespace hal::canopen::test
