// SPDX-License-Identifier: MIT
// Homing methods 1–37, each from several places. Where home is, is stated here by edge and side,
// not by how one gets there.
#include "drive_bench.hpp"

namespace hal::canopen::test {
namespace {

constexpr double turn = 4096;
constexpr double travel_begin = -20480;
constexpr double travel_end = 20480;

enum class At { begin, end, left_edge, right_edge, start };
struct Place {
    int method;
    At at;
    int side;  ///< −1, +1: the first index pulse left, right of it; 0: itself
};
constexpr Place places[] = {
    {1, At::begin, 1},       {2, At::end, -1},        {3, At::left_edge, -1},
    {4, At::left_edge, 1},   {5, At::right_edge, 1},  {6, At::right_edge, -1},
    {7, At::left_edge, -1},  {8, At::left_edge, 1},   {9, At::right_edge, -1},
    {10, At::right_edge, 1}, {11, At::right_edge, 1}, {12, At::right_edge, -1},
    {13, At::left_edge, 1},  {14, At::left_edge, -1}, {17, At::begin, 0},
    {18, At::end, 0},        {19, At::left_edge, 0},  {20, At::left_edge, 0},
    {21, At::right_edge, 0}, {22, At::right_edge, 0}, {23, At::left_edge, 0},
    {24, At::left_edge, 0},  {25, At::right_edge, 0}, {26, At::right_edge, 0},
    {27, At::right_edge, 0}, {28, At::right_edge, 0}, {29, At::left_edge, 0},
    {30, At::left_edge, 0},  {33, At::start, -1},     {34, At::start, 1},
    {35, At::start, 0},      {37, At::start, 0},
};

struct HomingCase {
    Place place;
    double left, right, start;
};

std::vector<HomingCase> cases_of(const Place& place) {
    std::vector<HomingCase> result;
    struct Switch {
        double left, right;
    };
    // A wide switch, one narrower than the way to stop from the fast search, and one with an index
    // pulse in the middle of nowhere.
    for (Switch s : {Switch{3000, 9000}, Switch{-5000, -4900}, Switch{1000, 2500}}) {
        const int base = place.method > 16 ? place.method - 16 : place.method;
        if (base == 3 || base == 4) {
            s.right = 1e9;  // to the positive end
        }
        if (base == 5 || base == 6) {
            s.left = -1e9;  // from the negative end
        }
        for (const double start :
             {-15000.0, s.left - 10, s.left + 10, (s.left + s.right) / 2, s.right - 10,
              s.right + 10, 17000.0, travel_begin - 500, travel_end + 500}) {
            if (std::abs(start) > 21000) continue;
            if (place.at == At::start && std::abs(start) > 20000) continue;
            result.push_back({place, s.left, s.right, start});
        }
    }
    return result;
}

double expected(const HomingCase& c, double start) {
    const double at = c.place.at == At::begin        ? travel_begin
                      : c.place.at == At::end        ? travel_end
                      : c.place.at == At::left_edge  ? c.left
                      : c.place.at == At::right_edge ? c.right
                                                     : start;
    if (c.place.side == 0) return at;
    return c.place.side > 0 ? (std::floor(at / turn) + 1) * turn
                            : (std::ceil(at / turn) - 1) * turn;
}

struct DriveHoming : DriveBench {
    void prepare(int method, double start, double left = 3000, double right = 9000) {
        auto& m = settings.axis[0].motor;
        m.negative_limit = travel_begin;
        m.positive_limit = travel_end;
        m.negative_stop = travel_begin - turn;
        m.positive_stop = travel_end + turn;
        m.start = start;
        m.home_from = left;
        m.home_to = right;
        make();
        set(object::homing_method, method);
        enable(Mode::homing);
    }
    Homing homing() { return homing_of(word()); }
    double place() { return drive->status(0).place; }
};

struct DriveHomingMethod : DriveHoming, testing::WithParamInterface<Place> {};

TEST_P(DriveHomingMethod, Ends_at_its_place_from_wherever_it_starts) {
    for (const auto& c : cases_of(GetParam())) {
        SCOPED_TRACE(testing::Message()
                     << "switch " << c.left << "…" << c.right << ", from " << c.start);
        prepare(c.place.method, c.start, c.left, c.right);
        set(object::home_offset, 123);
        ASSERT_EQ(homing(), Homing::interrupted);
        const double start = place();
        control(0x1f);
        ASSERT_TRUE(until(
            [&] { return homing() == Homing::done || homing() == Homing::error_stopped; }, 20000))
            << homing();
        ASSERT_EQ(homing(), Homing::done);
        EXPECT_NEAR(place(), expected(c, start), 12);
        run(50);
        EXPECT_NEAR(place(), expected(c, start), 1.5);
        EXPECT_NEAR(position(), 123, 2);
        // What the position shows fits the place, whether it stands there exactly or not.
        EXPECT_NEAR(position() - 123, place() - expected(c, start), 1);
        EXPECT_TRUE(drive->status(0).homed);
        EXPECT_EQ(state(), State::operation_enabled);
    }
}
INSTANTIATE_TEST_SUITE_P(, DriveHomingMethod, testing::ValuesIn(places),
                         [](const auto& p) { return "Method" + std::to_string(p.param.method); });

TEST_F(DriveHoming, All_supported_methods_are_in_60E3h_and_tested_here) {
    make();
    const auto count = get<std::uint8_t>(object::supported_homing_methods);
    ASSERT_EQ(count, std::size(places));
    for (unsigned n = 0; n < count; ++n) {
        EXPECT_EQ(
            get<std::int8_t>(object::supported_homing_methods, 0, static_cast<std::uint8_t>(n + 1)),
            places[n].method);
    }
}
TEST_F(DriveHoming, Speeds_are_those_of_6099h) {
    prepare(23, -15000);
    set(object::homing_speeds, 30000, 0, 1);
    set(object::homing_speeds, 1000, 0, 2);
    control(0x1f);
    run(400);
    EXPECT_NEAR(velocity(), 30000, 100);
    ASSERT_TRUE(
        until([&] { return (get<std::uint32_t>(object::digital_inputs) & input::home) != 0; }));
    run(400);
    EXPECT_NEAR(velocity(), -1000, 50);
}
TEST_F(DriveHoming, The_edge_that_counts_is_passed_slowly) {
    for (const auto& p : places) {
        if (p.at == At::start) continue;
        prepare(p.method, p.method == 5 || p.method == 6 || p.method == 21 || p.method == 22
                              ? 15000
                              : -15000);
        const double slow = get<std::uint32_t>(object::homing_speeds, 0, 2);
        control(0x1f);
        ASSERT_TRUE(until([&] { return bit(status::homing_attained); }, 20000)) << p.method;
        EXPECT_LE(std::abs(velocity()), slow * 1.2) << p.method;
    }
}
TEST_F(DriveHoming, Says_attained_before_it_says_done) {
    prepare(34, 100);
    control(0x1f);
    EXPECT_EQ(homing(), Homing::running);
    ASSERT_TRUE(until([&] { return homing() != Homing::running; }));
    EXPECT_EQ(homing(), Homing::attained_but_moving);
    EXPECT_TRUE(until([&] { return homing() == Homing::done; }));
}
TEST_F(DriveHoming, Taking_the_start_bit_back_interrupts_it) {
    prepare(17, 0);
    control(0x1f);
    run(100);
    control(0x0f);
    EXPECT_TRUE(until([&] { return homing() == Homing::interrupted; }, 500)) << homing();
    EXPECT_FALSE(drive->status(0).homed);
    const auto stood = place();
    run(100);
    EXPECT_NEAR(place(), stood, 10);
    control(0x1f);
    EXPECT_TRUE(until([&] { return homing() == Homing::done; }, 20000));
    EXPECT_NEAR(place(), travel_begin, 12);
}
TEST_F(DriveHoming, Halt_pauses_it) {
    for (const int wait : {50, 300, 700, 1500, 3000, 4200}) {
        prepare(1, 0);
        control(0x1f);
        run(wait);
        control(0x11f);
        run(300);
        EXPECT_NEAR(velocity(), 0, 10) << wait;
        control(0x1f);
        ASSERT_TRUE(until([&] { return homing() == Homing::done; }, 20000)) << wait;
        EXPECT_NEAR(place(), -16384, 12) << wait;
    }
}
TEST_F(DriveHoming, Without_home_switch_ends_in_an_error) {
    for (const int method : {7, 11, 23, 27, 3, 21}) {
        prepare(method, 0, 0, 0);
        control(0x1f);
        EXPECT_TRUE(until([&] { return homing() == Homing::error_stopped; }, 20000))
            << method << ' ' << homing();
        EXPECT_EQ(state(), State::operation_enabled);
        EXPECT_FALSE(drive->status(0).homed);
    }
}
TEST_F(DriveHoming, Without_index_pulse_ends_in_an_error) {
    settings.axis[0].motor.index_pulse = false;
    for (const int method : {1, 7, 33, 34}) {
        prepare(method, 0);
        control(0x1f);
        EXPECT_TRUE(until([&] { return homing() == Homing::error_stopped; }, 20000))
            << method << ' ' << homing();
    }
}
TEST_F(DriveHoming, Without_speed_ends_in_an_error) {
    prepare(17, 0);
    set(object::homing_speeds, 0, 0, 1);
    control(0x1f);
    EXPECT_EQ(homing(), Homing::error_stopped);
}
TEST_F(DriveHoming, Without_a_method_ends_in_an_error) {
    prepare(0, 0);
    control(0x1f);
    EXPECT_EQ(homing(), Homing::error_stopped);
}
TEST_F(DriveHoming, The_second_time_ends_at_the_same_place) {
    prepare(10, -15000);
    for (int n = 0; n < 3; ++n) {
        control(0x1f);
        ASSERT_TRUE(until([&] { return homing() == Homing::done; }, 20000));
        EXPECT_NEAR(place(), 12288, 12);
        control(0x0f);
    }
}
TEST_F(DriveHoming, Works_in_user_units_with_a_gear_and_reversed) {
    auto& m = settings.axis[0].motor;
    m.start = -15000;
    prepare(24, -15000);
    control(0x06);
    run(600);
    set(object::gear_ratio, 10, 0, 1);  // 10 turns of the motor
    set(object::feed_constant, 360000, 0, 1);  // are 360 000 units
    set(object::polarity, 0x80);
    set(object::home_offset, 1000);
    set(object::homing_speeds, 180000, 0, 1);
    set(object::homing_speeds, 18000, 0, 2);
    set(object::homing_acceleration, 3600000);
    enable(Mode::homing);
    control(0x1f);
    ASSERT_TRUE(until([&] { return homing() == Homing::done; }, 20000));
    run(20);
    EXPECT_NEAR(place(), 3000, 1.5);
    EXPECT_NEAR(position(), 1000, 12);
}

}  // namespace
}  // namespace hal::canopen::test
