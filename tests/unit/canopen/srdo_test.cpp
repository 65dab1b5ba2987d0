// SPDX-License-Identifier: MIT
// SRDOs of EN 50325-5: the frames sent, and which received data is valid.
#include "canopen/protocol/srdo_description.hpp"
#include "node.hpp"

namespace hal::canopen::test {
namespace {

using enum NmtCommand;

struct Heard : SafetyEvents {
    std::vector<unsigned> good;
    std::vector<std::pair<unsigned, SrdoFault>> faults;
    int fail_safes = 0;
    void on_srdo(unsigned n, Time) noexcept override { good.push_back(n); }
    void on_srdo_fault(unsigned n, SrdoFault f, Time) noexcept override {
        faults.emplace_back(n, f);
    }
    void on_fail_safe(Time) noexcept override { ++fail_safes; }
};

/// SRDO 1 sends 2300h, SRDO 2 receives 2310h; refresh time 20 ms, SCT 50 ms, SRVT 10 ms.
struct Srdo : Node {
    Heard heard;
    static constexpr std::uint32_t sent_id = 0x109;
    static constexpr std::uint32_t received_id = 0x10b;

    static SrdoDescription sends() {
        return {.direction = SrdoDirection::sends,
                .cycle_ms = 20,
                .validation_ms = 10,
                .cob = sent_id,
                .mapping = {map_entry(0x2300, 0, 8), map_entry(0x2301, 0, 8)}};
    }
    static SrdoDescription receives() {
        return {.direction = SrdoDirection::receives,
                .cycle_ms = 50,
                .validation_ms = 10,
                .cob = received_id,
                .mapping = {map_entry(0x2310, 0, 8), map_entry(0x2311, 0, 8)}};
    }
    static Description with_srdos() {
        Description d = example();
        for (const std::uint16_t index :
             std::initializer_list<std::uint16_t>{0x2300, 0x2301, 0x2310, 0x2311}) {
            d.add(index, 0, Type::unsigned8, Access::read_write, (index & 1) != 0 ? 0xff : 0)
                .mappable();
        }
        const SrdoDescription both[] = {sends(), receives()};
        add_srdos(d, both);
        return d;
    }
    void SetUp() override {
        make(with_srdos());
        device->srdos().listen(heard);
    }
    void make_anew(const Description& d) {
        bus = Bus{};
        make(d);
    }
    void operational() {
        nmt(start);
        bus.log.clear();
    }
    void frame(std::uint32_t id, std::uint8_t value) { send({id, {value}}); }
    void good(std::uint8_t value) {
        frame(received_id, value);
        frame(received_id + 1, static_cast<std::uint8_t>(~value));
    }
    std::uint8_t value() { return device->dictionary().get<std::uint8_t>(0x2310, 0); }
    Srdos::Status status(unsigned n = 2) { return device->srdos().status(n); }
    void expect_fault(SrdoFault fault) {
        ASSERT_EQ(heard.faults.size(), 1U);
        EXPECT_EQ(heard.faults[0], std::pair(2U, fault));
        EXPECT_EQ(status().fault, fault);
        EXPECT_FALSE(status().valid);
        EXPECT_TRUE(device->emcy().active(0x8100, 2));
    }
};

TEST_F(Srdo, Signature_is_the_one_of_a_makers_worked_example) {
    // SICK scanGrid2 CANopen, operating instructions 8025990, table 42: 4370h.
    const SrdoDescription s{.direction = SrdoDirection::receives,
                            .cycle_ms = 0x32,
                            .validation_ms = 0x14,
                            .cob = 0x111,
                            .mapping = {0x60100108, 0x60110108, 0x60100208, 0x60110208}};
    EXPECT_EQ(srdo_signature(s), 0x4370);
}

TEST_F(Srdo, Signature_of_the_objects_is_that_of_the_description) {
    EXPECT_EQ(device->srdos().signature(1), srdo_signature(sends()));
    EXPECT_EQ(device->srdos().signature(2), srdo_signature(receives()));
}

TEST_F(Srdo, Sender_sends_both_frames_once_per_refresh_time_and_only_when_operational) {
    run(100);
    EXPECT_TRUE(since(sent_id).empty());
    device->dictionary().set(0x2300, 0, std::uint8_t{0x5a});

    device->dictionary().set(0x2301, 0, std::uint8_t{0xa5});
    operational();
    run(100);
    EXPECT_EQ(since(sent_id).size(), 6U);
    ASSERT_EQ(since(sent_id + 1).size(), 6U);
    for (std::size_t n = 0; n + 1 < bus.log.size(); n += 2) {
        EXPECT_EQ(bus.log[n].id, sent_id);
        EXPECT_EQ(bus.log[n].length, 1);
        EXPECT_EQ(bus.log[n].data[0], 0x5a);
        EXPECT_EQ(bus.log[n + 1].id, sent_id + 1);
        EXPECT_EQ(bus.log[n + 1].data[0], 0xa5);
    }
}

TEST_F(Srdo, Sender_whose_objects_do_not_match_sends_nothing_and_says_so) {
    operational();
    device->dictionary().set(0x2300, 0, std::uint8_t{0x01});
    run(100);
    EXPECT_TRUE(since(sent_id).empty());
    ASSERT_EQ(heard.faults.size(), 1U);
    EXPECT_EQ(heard.faults[0], std::pair(1U, SrdoFault::own_data));
    device->dictionary().set(0x2301, 0, std::uint8_t{0xfe});
    run(100);
    EXPECT_TRUE(since(sent_id).empty()) << "not before the fault is acknowledged";
    device->srdos().acknowledge(1, now);
    run(100);
    EXPECT_FALSE(since(sent_id).empty());
}

TEST_F(Srdo, Sender_can_make_the_inverted_frame_itself) {
    device->srdos().derive_inverted(1);
    device->dictionary().set(0x2300, 0, std::uint8_t{0x0f});
    operational();
    run(1);
    ASSERT_EQ(since(sent_id + 1).size(), 1U);
    EXPECT_EQ(since(sent_id + 1)[0].data[0], 0xf0);
}

TEST_F(Srdo, Sender_that_is_triggered_does_not_wait_for_its_refresh_time) {
    operational();
    run(2);
    bus.log.clear();
    EXPECT_TRUE(device->srdos().trigger(1));
    EXPECT_FALSE(device->srdos().trigger(2)) << "that one is received";
    run(1);
    EXPECT_EQ(since(sent_id).size(), 1U);
}

TEST_F(Srdo, Receiver_believes_a_pair_in_order_and_writes_both_objects) {
    operational();
    EXPECT_FALSE(status().valid);
    good(0x21);
    EXPECT_TRUE(status().valid);
    EXPECT_EQ(value(), 0x21);
    EXPECT_EQ(device->dictionary().get<std::uint8_t>(0x2311, 0), 0xde);
    EXPECT_EQ(heard.good, std::vector<unsigned>{2});
    EXPECT_TRUE(heard.faults.empty());
}

TEST_F(Srdo, Receiver_waits_for_the_first_one_without_a_fault_unless_it_is_expected) {
    operational();
    run(500);
    EXPECT_TRUE(heard.faults.empty());
    device->srdos().expect(2, true, now);
    run(50);
    EXPECT_TRUE(heard.faults.empty()) << "the SCT is not over yet";
    run(1);
    expect_fault(SrdoFault::late);
}

TEST_F(Srdo, Receiver_that_is_told_not_to_listen_hears_nothing) {
    operational();
    device->srdos().expect(2, false, now);
    good(1);
    frame(received_id + 1, 0);
    run(100);
    EXPECT_TRUE(heard.faults.empty());
    EXPECT_TRUE(heard.good.empty());
    EXPECT_EQ(value(), 0);
}

TEST_F(Srdo, Silence_longer_than_the_sct_is_a_fault) {
    operational();
    good(1);
    run(50);
    EXPECT_TRUE(heard.faults.empty());
    run(1);
    expect_fault(SrdoFault::late);
}

TEST_F(Srdo, One_that_comes_after_the_sct_is_not_believed_even_if_nobody_looked_meanwhile) {
    operational();
    good(1);
    now += 51 * millisecond;
    good(2);
    EXPECT_EQ(value(), 1);
    expect_fault(SrdoFault::late);
}

TEST_F(Srdo, Second_frame_that_does_not_come_within_the_srvt_is_a_fault) {
    operational();
    frame(received_id, 1);
    run(10);
    EXPECT_TRUE(heard.faults.empty());
    run(1);
    expect_fault(SrdoFault::incomplete);
}

TEST_F(Srdo, Second_frame_after_the_srvt_is_not_believed_even_if_nobody_looked_meanwhile) {
    operational();
    frame(received_id, 1);
    now += 11 * millisecond;
    frame(received_id + 1, 0xfe);
    EXPECT_EQ(value(), 0);
    expect_fault(SrdoFault::incomplete);
}

TEST_F(Srdo, Second_frame_first_is_a_fault) {
    operational();
    frame(received_id + 1, 0xfe);
    expect_fault(SrdoFault::order);
}

TEST_F(Srdo, First_frame_twice_is_a_fault) {
    operational();
    frame(received_id, 1);
    frame(received_id, 1);
    expect_fault(SrdoFault::order);
}

TEST_F(Srdo, Each_single_wrong_bit_is_a_fault) {
    for (unsigned bit = 0; bit < 8; ++bit) {
        heard.faults.clear();
        nmt(enter_pre_operational);
        operational();
        frame(received_id, 0x35);

        frame(received_id + 1, static_cast<std::uint8_t>(~0x35 ^ 1 << bit));
        EXPECT_NE(value(), 0x35);
        expect_fault(SrdoFault::complement);
    }
}

TEST_F(Srdo, Frame_of_another_length_is_a_fault) {
    operational();
    send({received_id, {1, 0}});
    expect_fault(SrdoFault::length);
}

TEST_F(Srdo, Global_fail_safe_command_ends_belief_in_all_received_ones) {
    operational();
    good(1);
    send({0x001, {}});
    EXPECT_EQ(heard.fail_safes, 1);
    expect_fault(SrdoFault::fail_safe);
}

TEST_F(Srdo, Global_fail_safe_command_is_not_heard_nor_sent_where_1300_says_so) {
    EXPECT_EQ(write(0x1300, 0, 0, 1), Abort::none);
    operational();
    good(1);
    send({0x001, {}});
    EXPECT_TRUE(status().valid);
    EXPECT_FALSE(device->srdos().send_fail_safe());
}

TEST_F(Srdo, Global_fail_safe_command_has_identifier_1_and_no_data) {
    operational();
    EXPECT_TRUE(device->srdos().send_fail_safe());
    run(0);
    ASSERT_EQ(since(0x001).size(), 1U);
    EXPECT_EQ(since(0x001)[0].length, 0);
}

TEST_F(Srdo, After_a_fault_nothing_is_believed_before_it_was_acknowledged) {
    operational();
    frame(received_id + 1, 0);
    good(7);
    EXPECT_FALSE(status().valid);
    EXPECT_EQ(value(), 0);
    device->srdos().acknowledge(2, now);
    EXPECT_FALSE(status().valid) << "nor before a good one came";
    EXPECT_FALSE(device->emcy().active(0x8100, 2));
    good(7);
    EXPECT_TRUE(status().valid);
    EXPECT_EQ(value(), 7);
    EXPECT_EQ(heard.faults.size(), 1U);
}

TEST_F(Srdo, Leaving_the_operational_state_ends_belief) {
    operational();
    good(1);
    nmt(enter_pre_operational);
    EXPECT_FALSE(status().valid);
    EXPECT_FALSE(status().active);
    good(9);
    EXPECT_EQ(value(), 1);
}

TEST_F(Srdo, Whoever_changes_a_parameter_has_to_say_anew_that_all_are_valid) {
    EXPECT_EQ(read(0x13fe, 0), 0xa5U);
    EXPECT_EQ(write(0x1302, 2, 100, 2), Abort::none);
    EXPECT_EQ(read(0x13fe, 0), 0U);
    EXPECT_EQ(write(0x13fe, 0, 0xa5, 1), Abort::value) << "the signature is the old one";
    operational();
    good(1);
    run(100);
    EXPECT_EQ(value(), 0);
    EXPECT_TRUE(since(sent_id).empty()) << "SRDO 1 does not work either";
    nmt(enter_pre_operational);
    auto changed = receives();
    changed.cycle_ms = 100;
    EXPECT_EQ(write(0x13ff, 2, srdo_signature(changed), 2), Abort::none);
    EXPECT_EQ(write(0x13fe, 0, 0xa5, 1), Abort::none);
    operational();
    good(1);
    EXPECT_EQ(value(), 1);
}

TEST_F(Srdo, Parameters_cannot_be_written_while_operational) {
    operational();
    for (const std::uint8_t sub : std::initializer_list<std::uint8_t>{1, 3}) {
        EXPECT_EQ(write(0x1301, sub, 1, 1), Abort::device_state);
    }
    EXPECT_EQ(write(0x1381, 1, 0x23000008, 4), Abort::device_state);
    EXPECT_EQ(write(0x13fe, 0, 0, 1), Abort::device_state);
    EXPECT_EQ(write(0x13ff, 1, 0, 2), Abort::device_state);
}

TEST_F(Srdo, Parameters_that_cannot_be_are_refused) {
    EXPECT_EQ(write(0x1301, 1, 3, 1), Abort::value);
    EXPECT_EQ(write(0x1301, 2, 0, 2), Abort::value);
    for (const std::uint32_t cob : {0x0ffU, 0x102U, 0x181U, 0x80000109U}) {
        EXPECT_EQ(write(0x1301, 5, cob, 4), Abort::value) << cob;
    }
    for (const std::uint32_t cob : {0x109U, 0x182U}) {
        EXPECT_EQ(write(0x1301, 6, cob, 4), Abort::value) << cob;
    }
    EXPECT_EQ(write(0x13fe, 0, 0x5a, 1), Abort::value);
}

TEST_F(Srdo, What_does_not_hold_together_cannot_be_made_valid) {
    const auto tried = [&](std::uint16_t index, std::uint8_t sub, std::uint32_t value,
                           unsigned size) {
        make_anew(with_srdos());
        EXPECT_EQ(write(index, sub, value, size), Abort::none);
        EXPECT_EQ(write(0x13ff, 2, device->srdos().signature(2), 2), Abort::none);
        return write(0x13fe, 0, 0xa5, 1);
    };
    EXPECT_EQ(tried(0x1302, 5, 0x10d, 4), Abort::value)
        << "the second frame has not the next identifier";
    EXPECT_EQ(tried(0x1302, 3, 0, 1), Abort::value) << "no SRVT";
    EXPECT_EQ(tried(0x1382, 0, 1, 1), Abort::pdo_length) << "an odd number of objects";
    EXPECT_EQ(tried(0x1382, 2, map_entry(0x2001, 0, 16), 4), Abort::pdo_length)
        << "a pair of two lengths";
    EXPECT_EQ(tried(0x1382, 1, map_entry(0x200a, 0, 8), 4), Abort::not_mappable);
    EXPECT_EQ(tried(0x1382, 1, map_entry(0x5555, 0, 8), 4), Abort::no_object);
}

TEST_F(Srdo, Two_with_one_identifier_cannot_be_made_valid) {
    EXPECT_EQ(write(0x1302, 5, sent_id, 4), Abort::none);
    EXPECT_EQ(write(0x1302, 6, sent_id + 1, 4), Abort::none);
    EXPECT_EQ(write(0x13ff, 2, device->srdos().signature(2), 2), Abort::none);
    EXPECT_EQ(write(0x13fe, 0, 0xa5, 1), Abort::value);
}

TEST_F(Srdo, First_one_has_predefined_identifiers_where_none_are_given) {
    Description d = example();
    d.add(0x2300, 0, Type::unsigned8, Access::read_write).mappable();
    const SrdoDescription one[] = {{.mapping = {map_entry(0x2300, 0, 8), map_entry(0x2300, 0, 8)}}};
    add_srdos(d, one);
    make_anew(d);
    EXPECT_EQ(read(0x1301, 5), 0xffU + 2 * 5);
    EXPECT_EQ(read(0x1301, 6), 0x100U + 2 * 5);
}

TEST_F(Srdo, Reset_of_communication_brings_the_valid_configuration_of_power_on_back) {
    write(0x1302, 2, 100, 2);
    nmt(reset_communication);
    EXPECT_EQ(read(0x13fe, 0), 0xa5U);
    operational();
    good(3);
    EXPECT_EQ(value(), 3);
}

TEST_F(Srdo, Every_lost_doubled_or_overtaken_frame_ends_belief_or_changes_nothing) {
    // The sender of one node is the receiver of another: with every n-th frame disturbed no value
    // is accepted that was not sent.
    for (const unsigned every : {2U, 3U, 5U, 7U}) {
        for (int kind = 0; kind < 3; ++kind) {
            Bus wire;
            wire.logging = false;
            Recorder a_events, b_events;
            Description da = with_srdos();
            Description db = with_srdos();
            auto there = sends();
            there.cob = received_id;
            const SrdoDescription of_a[] = {there}, of_b[] = {receives()};
            std::erase_if(da.entries,
                          [](const auto& e) { return e.index >= 0x1300 && e.index < 0x1400; });
            std::erase_if(db.entries,
                          [](const auto& e) { return e.index >= 0x1300 && e.index < 0x1400; });
            add_srdos(da, of_a);
            add_srdos(db, of_b);
            Device a(da, {.node_id = 5, .auto_start = true}, a_events),
                b(db, {.node_id = 6, .auto_start = true}, b_events);
            wire.attach(a);
            wire.attach(b);
            a.srdos().derive_inverted(1);
            Heard told;
            b.srdos().listen(told);
            Time t = 0;
            a.start(t);
            b.start(t);
            wire.exchange(t);
            (kind == 0   ? wire.faults.lose
             : kind == 1 ? wire.faults.repeat
                         : wire.faults.delay) = every;
            for (unsigned n = 0; n < 2000; ++n) {
                t += millisecond;
                a.dictionary().set(0x2300, 0, static_cast<std::uint8_t>(n & 0x7f));
                const auto before = told.good.size();
                a.poll(t);
                wire.exchange(t);
                b.poll(t);
                wire.exchange(t);
                if (told.good.size() != before) {
                    EXPECT_EQ(b.dictionary().get<std::uint8_t>(0x2310, 0), n & 0x7f);
                }
            }
            EXPECT_FALSE(told.faults.empty()) << "kind " << kind << ", every " << every;
        }
    }
}

}  // namespace
}  // namespace hal::canopen::test
