// SPDX-License-Identifier: MIT
// Several axes, PDOs, and any value in any object.
#include <algorithm>
#include <cstring>
#include <limits>

#include "drive_fault_bench.hpp"
namespace hal::canopen::test {
namespace {

struct DriveAxes : DriveFault {
    void eight() {
        settings.axes = 8;
        for (auto& a : settings.axis) {
            a.motor.endless();
        }
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
        if (n % 2 == 0) {
            EXPECT_NEAR(position(n), 1000 * static_cast<int>(n + 1), 10) << n;
        } else {
            EXPECT_NEAR(velocity(n), -1000 * static_cast<int>(n + 1), 30) << n;
        }
    }
}
TEST_F(DriveAxes, A_fault_of_one_leaves_the_others_alone) {
    eight();
    for (unsigned n = 0; n < 8; ++n) {
        enable(Mode::profile_velocity, n);
        set(object::target_velocity, 5000, n);
    }
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
    EXPECT_EQ(device().dictionary().get<std::uint8_t>(0x1001, 0),
              error_generic | error_temperature);
    expect_reset(5);
}
TEST_F(DriveAxes, Default_pdos_carry_what_they_should) {
    eight();
    EXPECT_TRUE(device().dictionary().problems().empty());
    const auto mapped = [&](std::uint16_t index, std::uint8_t sub) {
        return device().dictionary().get<std::uint32_t>(index, sub);
    };
    for (unsigned axis = 0; axis < 8; ++axis) {
        const auto up = static_cast<std::uint16_t>(64 * axis);
        const std::uint32_t objects = axis * 0x08000000;
        const std::uint32_t received[] = {0,          0x60600008, 0x607a0020, 0x60ff0020,
                                          0x60710010, 0x60420010, 0x60fe0120};
        const std::uint32_t transmitted[] = {0,          0x60610008, 0x60640020, 0x606c0020,
                                             0x60770010, 0x60440010, 0x60fd0020};
        for (std::uint16_t n = 0; n < 7; ++n) {
            EXPECT_EQ(mapped(static_cast<std::uint16_t>(0x1600 + up + n), 1), 0x60400010 + objects);
            EXPECT_EQ(mapped(static_cast<std::uint16_t>(0x1a00 + up + n), 1), 0x60410010 + objects);
            EXPECT_EQ(mapped(static_cast<std::uint16_t>(0x1600 + up + n), 2),
                      n == 0 ? 0 : received[n] + objects);
            EXPECT_EQ(mapped(static_cast<std::uint16_t>(0x1a00 + up + n), 2),
                      n == 0 ? 0 : transmitted[n] + objects);
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
    for (const auto& f : sent) {
        if (f.id == 0x185) {
            told.push_back(state_of(load<std::uint16_t>(f.data.data())));
        }
    }
    EXPECT_EQ(told, (std::vector{State::switch_on_disabled, State::ready_to_switch_on,
                                 State::switched_on, State::operation_enabled}));
    for (int n = 1; n <= 100; ++n) {
        Frame f{0x405, {0x0f, 0, 0, 0, 0, 0}};
        store(f.data.data() + 2, n * 10);
        device().handle(f, now);
        run(1);
    }
    sent.clear();
    device().handle({0x80, {}}, now);
    run(1);
    const auto position_frame =
        std::find_if(sent.begin(), sent.end(), [](const Frame& f) { return f.id == 0x385; });
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
    const auto random = [&] {
        seed = seed * 6364136223846793005U + 1442695040888963407U;
        return seed >> 33;
    };
    for (int round = 0; round < 40; ++round) {
        settings.axes = 2;
        make();
        auto entries = device().dictionary().entries();
        for (int n = 0; n < 3000; ++n) {
            auto& e = entries[random() % entries.size()];
            if (e.index >= 0x2000 && e.size <= 8) {
                // Small, large and any; as an SDO, and past all checks as a PDO.
                const std::int64_t extreme[] = {0,
                                                1,
                                                -1,
                                                0x7fffffff,
                                                -0x80000000LL,
                                                static_cast<std::int64_t>(random()),
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
                const std::uint16_t words[] = {0x00, 0x80, 0x06, 0x07, 0x0f,
                                               0x1f, 0x7f, 0x3f, 0x02};
                set(object::controlword, words[random() % 9], static_cast<unsigned>(random() % 2));
            }
            run(1);
            for (unsigned axis = 0; axis < 2; ++axis) {
                ASSERT_NE(state(axis), State::unknown) << round << ' ' << n;
                ASSERT_TRUE(std::isfinite(drive->status(axis).place) &&
                            std::isfinite(drive->status(axis).torque))
                    << round << ' ' << n;
            }
        }
    }
}
TEST_F(DriveAxes, Motor_that_cannot_be_is_made_possible) {
    auto& m = settings.axis[0].motor;
    m.inertia = m.rated_torque = m.peak_torque = m.rated_current = m.rated_voltage =
        m.highest_speed = 0;
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
    for (const Time step :
         {100 * microsecond, 250 * microsecond, 1 * millisecond, 10 * millisecond}) {
        settings.axis[0].motor.endless();
        make();
        enable(Mode::profile_position);
        set(object::target_position, 50000);
        set(object::controlword, 0x1f);
        const Time end = now + 800 * millisecond;
        while (now < end) {
            drive->step(now += step);
        }
        ends.push_back(position());
        EXPECT_EQ(state(), State::operation_enabled);
    }
    for (const auto e : ends) {
        EXPECT_NEAR(e, ends[0], 400);
    }
}

}  // namespace
}  // namespace hal::canopen::test
