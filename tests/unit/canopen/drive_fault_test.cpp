// SPDX-License-Identifier: MIT
// Faults with their EMCY, loss of the master, touch probes, inputs and outputs, several axes, PDOs.
#include "drive_bench.hpp"

namespace hal::canopen::test {
namespace {

struct DriveFault : DriveBench {
    void moving(Mode mode = Mode::profile_velocity) {
        settings.axis[0].motor.endless();
        make();
        enable(mode);
        set(object::target_velocity, 20000);
        run(300);
        sent.clear();
    }
    /// One fault: reaction, code, EMCY with the axis, and after the cause is gone the reset and its EMCY.
    void expect_fault(std::uint16_t code, std::uint8_t register_bit, unsigned axis = 0) {
        ASSERT_TRUE(until([&] { return state(axis) == State::fault; }, 2000)) << state(axis);
        EXPECT_EQ(get<std::uint16_t>(object::error_code, axis), code);
        const auto told = emergencies();
        ASSERT_FALSE(told.empty());
        EXPECT_EQ(told.back().code, code);
        EXPECT_EQ(told.back().error_register, register_bit | error_generic);
        EXPECT_EQ(told.back().manufacturer[0], axis);
        EXPECT_EQ(device().dictionary().get<std::uint8_t>(0x1001, 0), register_bit | error_generic);
        EXPECT_EQ(device().dictionary().get<std::uint32_t>(0x1003, 1) & 0xffff, code);
    }
    void expect_reset(unsigned axis = 0) {
        sent.clear();
        control(0, axis);
        control(command::fault_reset, axis);
        EXPECT_EQ(state(axis), State::switch_on_disabled);
        EXPECT_EQ(get<std::uint16_t>(object::error_code, axis), 0);
        const auto told = emergencies();
        ASSERT_EQ(told.size(), 1U);
        EXPECT_EQ(told[0].code, 0);
        EXPECT_EQ(told[0].error_register, 0);
    }
};

TEST_F(DriveFault, Following_error_after_its_time) {
    settings.axis[0].motor.endless();
    make();
    set(object::following_error_window, 500);
    set(object::following_error_timeout, 50);
    enable(Mode::profile_position);
    set(object::max_torque, 50);
    drive->set_load_torque(0, -0.1);  // drags it away
    int over = 0;
    ASSERT_TRUE(until([&] {
        over += bit(status::following_error) ? 1 : 0;
        return state() != State::operation_enabled;
    }, 2000));
    EXPECT_NEAR(over, 49, 1);
    EXPECT_EQ(state(), State::fault_reaction_active);
    drive->set_load_torque(0, 0);
    expect_fault(0x8611, error_profile);
    EXPECT_LT(load<std::int32_t>(emergencies().back().manufacturer.data() + 1), 5000);
    EXPECT_GT(load<std::int32_t>(emergencies().back().manufacturer.data() + 1), 500);
    expect_reset();
}
TEST_F(DriveFault, Following_error_window_can_be_off) {
    settings.axis[0].motor.endless();
    make();
    set(object::following_error_window, 0xffffffff);
    enable(Mode::profile_position);
    set(object::max_torque, 50);
    drive->set_load_torque(0, -0.1);
    run(200);
    EXPECT_LT(position(), -1000);
    EXPECT_EQ(state(), State::operation_enabled);
}
TEST_F(DriveFault, Against_a_stop_the_position_modes_see_a_following_error) {
    settings.axis[0].motor.positive_stop = 3000;
    make();
    enable(Mode::profile_position);
    set(object::target_position, 20000);
    control(0x1f);
    expect_fault(0x8611, error_profile);
    EXPECT_NEAR(position(), 3000, 100);
}
TEST_F(DriveFault, Over_current_when_it_presses_too_long) {
    settings.axis[0].motor.positive_stop = 3000;
    make();
    enable(Mode::profile_torque);
    set(object::target_torque, 2000);
    // θ = 4 (1 − e^(−t/10 s)) is 1.1 after 3.2 s
    run(3000);
    EXPECT_EQ(state(), State::operation_enabled);
    EXPECT_TRUE(bit(status::warning));
    ASSERT_TRUE(until([&] { return state() == State::fault; }, 500));
    expect_fault(0x2310, error_current);
    control(0);
    control(command::fault_reset);
    EXPECT_EQ(state(), State::fault);  // still hot
    run(2000);
    expect_reset();
}
TEST_F(DriveFault, Rated_torque_is_not_too_much) {
    settings.axis[0].motor.positive_stop = 3000;
    make();
    enable(Mode::profile_torque);
    set(object::target_torque, 1000);
    for (int n = 0; n < 60; ++n) run(1000);
    EXPECT_EQ(state(), State::operation_enabled);
}
TEST_F(DriveFault, Voltages) {
    moving();
    drive->set_dc_link(0, 70);
    expect_fault(0x3210, error_voltage);
    drive->set_dc_link(0, 48);
    expect_reset();
    enable(Mode::profile_velocity);
    drive->set_dc_link(0, 30);
    EXPECT_EQ(get<std::uint32_t>(object::dc_link_voltage), 48000U);
    run(1);
    EXPECT_EQ(get<std::uint32_t>(object::dc_link_voltage), 30000U);
    EXPECT_FALSE(bit(status::voltage_enabled));
    expect_fault(0x3220, error_voltage);
    drive->set_dc_link(0, 48);
    run(1);
    expect_reset();
}
TEST_F(DriveFault, Broken_encoder_takes_the_torque_away) {
    moving();
    drive->set_encoder_broken(0, true);
    run(2);
    EXPECT_EQ(state(), State::fault);
    const auto stood = position();
    run(10);
    EXPECT_EQ(get<std::int16_t>(object::torque_actual), 0);
    EXPECT_EQ(position(), stood);
    expect_fault(0x7305, error_profile);
    control(command::fault_reset);
    EXPECT_EQ(state(), State::fault);
    drive->set_encoder_broken(0, false);
    expect_reset();
}
TEST_F(DriveFault, Over_speed) {
    settings.axis[0].motor.endless();
    make();
    set(object::following_error_window, 0xffffffff);
    enable(Mode::profile_torque);
    drive->set_load_torque(0, 0.3);
    expect_fault(0x8480, error_profile);
    drive->set_load_torque(0, 0);
    until([&] { return std::abs(drive->status(0).speed) < 7000; });
    expect_reset();
}
TEST_F(DriveFault, Each_simulated_fault_over_2011h) {
    struct Row {
        int bit;
        std::uint16_t code;
        std::uint8_t register_bit;
    };
    for (const auto& row : {Row{1, 0x7305, error_profile}, Row{2, 0x3210, error_voltage}, Row{4, 0x3220, error_voltage},
                            Row{8, 0x4310, error_temperature}, Row{16, 0x2310, error_current}}) {
        moving();
        set(0x2011, row.bit);
        expect_fault(row.code, row.register_bit);
        set(0x2011, 0);
        expect_reset();
    }
}
TEST_F(DriveFault, A_second_fault_is_told_too_and_both_must_go) {
    moving();
    set(0x2011, 8);
    ASSERT_TRUE(until([&] { return state() == State::fault; }, 1000));
    set(0x2011, 10);
    run(1);
    EXPECT_EQ(get<std::uint16_t>(object::error_code), 0x3210);
    EXPECT_EQ(emergencies().size(), 2U);
    EXPECT_EQ(device().dictionary().get<std::uint8_t>(0x1001, 0), error_generic | error_temperature | error_voltage);
    set(0x2011, 8);
    control(command::fault_reset);
    EXPECT_EQ(state(), State::fault);
    set(0x2011, 0);
    control(0);
    control(command::fault_reset);
    EXPECT_EQ(state(), State::switch_on_disabled);
    EXPECT_EQ(device().dictionary().get<std::uint8_t>(0x1001, 0), 0);
}

// The master is lost: 6007h.

struct Lost {
    int option;
    State after;
    std::uint16_t code;
};
struct DriveLost : DriveFault, testing::WithParamInterface<Lost> {
    void lose_heartbeat() {
        device().command(NmtCommand::start, now);
        EXPECT_EQ(device().dictionary().write(0x1016, 1, std::array<std::uint8_t, 4>{100, 0, 1, 0}), Abort::none);
        device().handle({0x701, {5}}, now);
        run(50);
        EXPECT_EQ(state(), State::operation_enabled);
        run(60);
    }
};
TEST_P(DriveLost, Does_what_6007h_says) {
    moving();
    set(object::abort_connection_option, GetParam().option);
    lose_heartbeat();
    run(500);
    EXPECT_EQ(state(), GetParam().after);
    EXPECT_EQ(get<std::uint16_t>(object::error_code), GetParam().code);
    EXPECT_NEAR(velocity(), GetParam().after == State::operation_enabled ? 20000 : 0, 200);
    EXPECT_EQ(events.communication_errors, 1);
    const auto told = emergencies();
    ASSERT_FALSE(told.empty());
    EXPECT_EQ(told[0].code, 0x8130);
    if (GetParam().code == 0) return;
    control(0);
    control(command::fault_reset);
    EXPECT_EQ(state(), State::fault);  // still silent
    device().handle({0x701, {5}}, now);
    run(1);
    control(0);
    control(command::fault_reset);
    EXPECT_EQ(state(), State::switch_on_disabled);
    EXPECT_EQ(device().dictionary().get<std::uint8_t>(0x1001, 0), 0);
}
INSTANTIATE_TEST_SUITE_P(, DriveLost,
                         testing::Values(Lost{0, State::operation_enabled, 0}, Lost{1, State::fault, 0x8130},
                                         Lost{2, State::switch_on_disabled, 0}, Lost{3, State::switch_on_disabled, 0}),
                         [](const auto& p) { return "Option" + std::to_string(p.param.option); });

TEST_F(DriveFault, Bus_off_nmt_stop_and_reset_communication_are_a_lost_master_too) {
    for (const int way : {0, 1, 2}) {
        moving();
        device().command(NmtCommand::start, now);
        run(1);
        if (way == 0) device().bus_off(now);
        if (way == 1) device().command(NmtCommand::stop, now);
        if (way == 2) device().command(NmtCommand::reset_communication, now);
        run(500);
        EXPECT_EQ(state(), State::fault) << way;
        EXPECT_NEAR(velocity(), 0, 10) << way;
    }
}
TEST_F(DriveFault, Reset_of_the_node_is_a_power_cycle) {
    moving();
    set(object::profile_velocity, 1234);
    const auto place = drive->status(0).place;
    device().command(NmtCommand::reset_node, now);
    EXPECT_EQ(state(), State::not_ready_to_switch_on);
    run(1);
    EXPECT_EQ(state(), State::switch_on_disabled);
    EXPECT_EQ(get<std::uint32_t>(object::profile_velocity), 40960U);
    EXPECT_NEAR(position(), 20, 5);  // counted since
    EXPECT_NEAR(drive->status(0).place, place + 20, 5);
    EXPECT_EQ(get<std::int16_t>(object::torque_actual) != 0 || velocity() > 10000, true);
    run(5000);
    EXPECT_EQ(velocity(), 0);
}

// Touch probes.

struct DriveProbe : DriveFault {
    void at(double from, double to) {
        settings.axis[0].motor.endless();
        settings.axis[0].motor.probe_from[0] = from;
        settings.axis[0].motor.probe_to[0] = to;
        make();
        enable(Mode::profile_velocity);
    }
    std::uint16_t probes() { return get<std::uint16_t>(object::touch_probe_status); }
    std::int32_t found(unsigned n) { return get<std::int32_t>(static_cast<std::uint16_t>(object::touch_probe_1_positive + n)); }
    void pass(int velocity) {
        set(object::target_velocity, velocity);
        run(1000);
        set(object::target_velocity, 0);
        run(500);
    }
};
TEST_F(DriveProbe, Both_edges_to_the_increment) {
    at(7001, 9003);
    set(object::touch_probe_function, probe::enable | probe::positive_edge | probe::negative_edge);
    run(1);
    EXPECT_EQ(probes() & 7, probe::enabled);
    pass(20000);
    EXPECT_EQ(probes() & 7, probe::enabled | probe::positive_stored | probe::negative_stored);
    EXPECT_EQ(found(0), 7001);
    EXPECT_EQ(found(1), 9003);
    pass(-20000);  // it was the first edge that counts
    EXPECT_EQ(found(0), 7001);
    set(object::touch_probe_function, 0);
    run(1);
    EXPECT_EQ(probes(), 0);
    set(object::touch_probe_function, probe::enable | probe::positive_edge);
    pass(20000);
    pass(-20000);
    EXPECT_EQ(found(0), 7001);
    EXPECT_EQ(probes() & 7, probe::enabled | probe::positive_stored);
}
TEST_F(DriveProbe, Continuous_takes_every_edge_and_toggles) {
    at(7001, 9003);
    set(object::touch_probe_function, probe::enable | probe::continuous | probe::positive_edge);
    pass(20000);
    EXPECT_EQ(found(0), 7001);
    const auto toggle = probes() & probe::updated;
    pass(-20000);
    EXPECT_EQ(found(0), 9003);  // comes in from the other side
    EXPECT_NE(probes() & probe::updated, toggle);
}
TEST_F(DriveProbe, Index_pulse_can_be_the_trigger) {
    at(0, 0);
    pass(3000);
    set(object::touch_probe_function, probe::enable | probe::index_pulse | probe::positive_edge);
    pass(20000);
    EXPECT_EQ(found(0), 4096);
}
TEST_F(DriveProbe, Inputs_from_outside_trigger_probe_2) {
    at(0, 0);
    settings.axis[0].motor.probe_from = settings.axis[0].motor.probe_to = {0, 0};
    make();
    enable(Mode::profile_velocity);
    set(object::target_velocity, 10000);
    set(object::touch_probe_function, (probe::enable | probe::positive_edge | probe::negative_edge) << 8);
    run(500);
    drive->set_inputs(0, input::probe_2);
    run(1);
    const auto at_edge = position();
    EXPECT_NE(get<std::uint32_t>(object::digital_inputs) & input::probe_2, 0U);
    run(100);
    drive->set_inputs(0, 0);
    run(100);
    EXPECT_EQ(probes(), probes() & 0xff00);
    EXPECT_NEAR(found(2), at_edge, 1);
    EXPECT_NEAR(found(3), at_edge + 1010, 15);
}
TEST_F(DriveProbe, Unknown_triggers_are_refused) {
    at(0, 0);
    EXPECT_EQ(write(object::touch_probe_function, 0, 0x08), Abort::value);
    EXPECT_EQ(write(object::touch_probe_function, 0, 0x0900), Abort::value);
}

// Inputs, outputs, several axes, PDOs.

TEST_F(DriveFault, Outputs_act_under_their_mask) {
    settings.axis[0].motor.brake_torque = 1;
    make();
    set(object::digital_outputs, 0x00030001, 0, 1);
    EXPECT_EQ(drive->status(0).outputs, 0U);
    set(object::digital_outputs, 0x00010000, 0, 2);
    EXPECT_EQ(drive->status(0).outputs, 0x10000U);
    enable(Mode::profile_velocity);
    run(50);
    EXPECT_FALSE(drive->status(0).brake_closed);
    set(object::digital_outputs, 0x00010001, 0, 2);
    EXPECT_TRUE(drive->status(0).brake_closed);
}

struct DriveAxes : DriveFault {
    void eight() {
        settings.axes = 8;
        for (auto& a : settings.axis) a.motor.endless();
        make();
    }
};
TEST_F(DriveAxes, Eight_axes_do_eight_things) {
    eight();
    ASSERT_EQ(drive->axes(), 8U);
    for (unsigned n = 0; n < 8; ++n) {
        EXPECT_EQ(get<std::uint32_t>(object::drive_type, n), 0x00020192U);
        enable(n % 2 == 0 ? Mode::profile_position : Mode::profile_velocity, n);
        set(object::target_position, 1000 * static_cast<int>(n + 1), n);
        set(object::target_velocity, -1000 * static_cast<int>(n + 1), n);
        control(0x1f, n);
    }
    run(2000);
    for (unsigned n = 0; n < 8; ++n) {
        EXPECT_EQ(state(n), State::operation_enabled);
        if (n % 2 == 0) EXPECT_NEAR(position(n), 1000 * static_cast<int>(n + 1), 10) << n;
        else EXPECT_NEAR(velocity(n), -1000 * static_cast<int>(n + 1), 30) << n;
    }
}
TEST_F(DriveAxes, A_fault_of_one_leaves_the_others_alone) {
    eight();
    for (unsigned n = 0; n < 8; ++n) enable(Mode::profile_velocity, n), set(object::target_velocity, 5000, n);
    run(500);
    sent.clear();
    set(0x2011, 8, 3);
    expect_fault(0x4310, error_temperature, 3);
    sent.clear();
    set(0x2011, 8, 5);  // the same fault of another axis is another one
    expect_fault(0x4310, error_temperature, 5);
    for (const unsigned n : {0U, 1U, 2U, 4U, 6U, 7U}) {
        EXPECT_EQ(state(n), State::operation_enabled);
        EXPECT_NEAR(velocity(n), 5000, 60);
    }
    set(0x2011, 0, 3);
    set(0x2011, 0, 5);
    control(0, 3);
    control(command::fault_reset, 3);
    EXPECT_EQ(state(3), State::switch_on_disabled);
    EXPECT_EQ(state(5), State::fault);
    EXPECT_EQ(device().dictionary().get<std::uint8_t>(0x1001, 0), error_generic | error_temperature);
    expect_reset(5);
}
TEST_F(DriveAxes, Default_pdos_carry_what_they_should) {
    eight();
    EXPECT_TRUE(device().dictionary().problems().empty());
    const auto mapped = [&](std::uint16_t index, std::uint8_t sub) { return device().dictionary().get<std::uint32_t>(index, sub); };
    for (unsigned axis = 0; axis < 8; ++axis) {
        const auto up = static_cast<std::uint16_t>(64 * axis);
        const std::uint32_t objects = axis * 0x08000000;
        const std::uint32_t received[] = {0, 0x60600008, 0x607a0020, 0x60ff0020, 0x60710010, 0x60420010, 0x60fe0120};
        const std::uint32_t transmitted[] = {0, 0x60610008, 0x60640020, 0x606c0020, 0x60770010, 0x60440010, 0x60fd0020};
        for (std::uint16_t n = 0; n < 7; ++n) {
            EXPECT_EQ(mapped(static_cast<std::uint16_t>(0x1600 + up + n), 1), 0x60400010 + objects);
            EXPECT_EQ(mapped(static_cast<std::uint16_t>(0x1a00 + up + n), 1), 0x60410010 + objects);
            EXPECT_EQ(mapped(static_cast<std::uint16_t>(0x1600 + up + n), 2), n == 0 ? 0 : received[n] + objects);
            EXPECT_EQ(mapped(static_cast<std::uint16_t>(0x1a00 + up + n), 2), n == 0 ? 0 : transmitted[n] + objects);
            EXPECT_EQ(device().pdos().rpdo(up + n + 1U).valid, axis == 0 && n < 4);
        }
    }
}
TEST_F(DriveAxes, Pdos_move_it) {
    settings.axis[0].motor.endless();
    make();
    sent.clear();
    device().command(NmtCommand::start, now);
    run(1);
    const auto send = [&](std::uint32_t id, std::initializer_list<std::uint8_t> data) {
        device().handle({id, data}, now);
        run(1);
    };
    send(0x305, {0x06, 0, 8});
    send(0x205, {0x07, 0});
    send(0x205, {0x0f, 0});
    EXPECT_EQ(state(), State::operation_enabled);
    EXPECT_EQ(get<std::int8_t>(object::modes_of_operation_display), 8);
    // Each state change sends its own statusword.
    std::vector<State> told;
    for (const auto& f : sent)
        if (f.id == 0x185) told.push_back(state_of(load<std::uint16_t>(f.data.data())));
    EXPECT_EQ(told, (std::vector{State::switch_on_disabled, State::ready_to_switch_on, State::switched_on, State::operation_enabled}));
    for (int n = 1; n <= 100; ++n) {
        Frame f{0x405, {0x0f, 0, 0, 0, 0, 0}};
        store(f.data.data() + 2, n * 10);
        device().handle(f, now);
        run(1);
    }
    sent.clear();
    device().handle({0x80, {}}, now);
    run(1);
    const auto position_frame = std::find_if(sent.begin(), sent.end(), [](const Frame& f) { return f.id == 0x385; });
    ASSERT_NE(position_frame, sent.end());
    EXPECT_NEAR(load<std::int32_t>(position_frame->data.data() + 2), 1000, 20);
}
TEST_F(DriveAxes, Mode_that_does_not_exist_is_not_heard_in_a_pdo) {
    moving();
    device().command(NmtCommand::start, now);
    device().handle({0x305, {0x0f, 0, 5}}, now);
    run(10);
    EXPECT_EQ(get<std::int8_t>(object::modes_of_operation_display), 3);
    EXPECT_NEAR(velocity(), 20000, 200);
}
TEST_F(DriveAxes, Any_value_in_any_object_leaves_it_a_drive) {
    std::uint64_t seed = 1;
    const auto random = [&] { return seed = seed * 6364136223846793005U + 1442695040888963407U, seed >> 33; };
    for (int round = 0; round < 40; ++round) {
        settings.axes = 2;
        make();
        auto entries = device().dictionary().entries();
        for (int n = 0; n < 3000; ++n) {
            auto& e = entries[random() % entries.size()];
            if (e.index >= 0x2000 && e.size <= 8) {
                // Small, large and any; as an SDO, and past all checks as a PDO.
                const std::int64_t extreme[] = {0, 1, -1, 0x7fffffff, -0x80000000LL, static_cast<std::int64_t>(random()),
                                                static_cast<std::int64_t>(random() % 1000)};
                std::uint8_t bytes[8];
                store(bytes, extreme[random() % 7]);
                if (random() % 4 != 0 || !e.rpdo) {
                    device().dictionary().write(e, {bytes, e.size});
                } else {
                    std::memcpy(e.data, bytes, e.size);
                    e.handler->written(e);
                }
            }
            if (n % 10 == 0) {
                const std::uint16_t words[] = {0x00, 0x80, 0x06, 0x07, 0x0f, 0x1f, 0x7f, 0x3f, 0x02};
                set(object::controlword, words[random() % 9], static_cast<unsigned>(random() % 2));
            }
            run(1);
            for (unsigned axis = 0; axis < 2; ++axis) {
                ASSERT_NE(state(axis), State::unknown) << round << ' ' << n;
                ASSERT_TRUE(std::isfinite(drive->status(axis).place) && std::isfinite(drive->status(axis).torque)) << round << ' ' << n;
            }
        }
    }
}
TEST_F(DriveAxes, Motor_that_cannot_be_is_made_possible) {
    auto& m = settings.axis[0].motor;
    m.inertia = m.rated_torque = m.peak_torque = m.rated_current = m.rated_voltage = m.highest_speed = 0;
    m.viscous_friction = m.coulomb_friction = std::numeric_limits<double>::quiet_NaN();
    m.resolution = 0;
    make();
    enable(Mode::profile_velocity);
    set(object::target_velocity, 1);
    run(100);
    EXPECT_TRUE(std::isfinite(drive->status(0).place));
}
TEST_F(DriveAxes, A_pause_of_the_caller_is_no_leap) {
    moving();
    now += 3600 * second;
    drive->step(now);
    EXPECT_EQ(state(), State::operation_enabled);
    EXPECT_LT(position(), 20000);
    now -= second;  // a clock that goes back does nothing
    drive->step(now);
    EXPECT_EQ(state(), State::operation_enabled);
}
TEST_F(DriveAxes, Steps_of_any_length_do_the_same) {
    std::vector<std::int32_t> ends;
    for (const Time step : {100 * microsecond, 250 * microsecond, 1 * millisecond, 10 * millisecond}) {
        settings.axis[0].motor.endless();
        make();
        enable(Mode::profile_position);
        set(object::target_position, 50000);
        set(object::controlword, 0x1f);
        const Time end = now + 800 * millisecond;
        while (now < end) drive->step(now += step);
        ends.push_back(position());
        EXPECT_EQ(state(), State::operation_enabled);
    }
    for (const auto e : ends) EXPECT_NEAR(e, ends[0], 400);
}

}  // namespace
}  // namespace hal::canopen::test
