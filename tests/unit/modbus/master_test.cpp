// SPDX-License-Identifier: MIT
#include "modbus/master/event_texts.hpp"
#include "passing_line.hpp"
#include "tests/unit/bytes_text.hpp"
#include "world.hpp"

namespace hal::modbus::test {
namespace {

TEST(Plan, Values_of_one_period_share_a_telegram_within_its_limits) {
    const ReadResult r = read(
        "[bus]\nlink = sim:x\n[slave 1 a]\nmax-gap = 4\nmax-registers = 10\n"
        "read a = holding 0\nread b = holding 5\nread c = holding 11\nread d = holding 12 every "
        "1s\n"
        "write e = holding 20\nwrite f = holding 21\nwrite g = holding 23\n",
        "x");
    ASSERT_TRUE(r.good());
    const Plan plan = make_plan(r.bus);
    std::vector<std::pair<unsigned, unsigned>> found;
    for (const Telegram& t : plan.telegrams) {
        found.emplace_back(t.address, t.count);
    }
    // written: contiguous ones only; read: a gap of 4 is filled, 10 registers are not exceeded
    const std::vector<std::pair<unsigned, unsigned>> expected = {
        {20, 2}, {23, 1}, {0, 6}, {11, 1}, {12, 1}};
    EXPECT_EQ(found, expected);
}

TEST(Plan, Times_are_those_of_the_specification) {
    line::Options line;
    line.parity = line::Parity::even;  // 11 bits
    line.baud = 19200;
    EXPECT_NEAR(static_cast<double>(silence_ns(line)), 2.0e6, 0.01e6);
    EXPECT_NEAR(static_cast<double>(line::characters_ns(line, 8)), 4.58e6, 0.01e6);
    line.baud = 115200;
    EXPECT_EQ(silence_ns(line), 1'750'000);
}

struct ProfileTest : testing::TestWithParam<std::string> {};

TEST_P(ProfileTest, Drive_runs_both_ways_and_stops) {
    std::string text = "[bus]\nlink = sim:x\nbaud = 38400\n[slave 1 d]\nprofile = " + GetParam() +
                       "\nmax-speed = 12000\nmax-frequency = 200\n";
    if (GetParam() == "generic") {
        text +=
            "forward = holding 0x10 1\nreverse = holding 0x10 2\nstop = holding 0x10 0\n"
            "speed = holding 0x11 4000\nfeedback = holding 0x12 4000\n";
    }
    World w(text);
    SlaveImage& slave = w.image.slave(0);
    DriveModel& motor = *w.slaves->slaves()[0].drive();
    const auto command = [&](std::uint32_t direction, double rpm) {
        slave.speed.store(std::bit_cast<std::uint64_t>(rpm));
        slave.command.store(direction);
        w.run(3 * second);
    };
    w.run(200 * ms);
    EXPECT_EQ(slave.online.load(), 1U);
    EXPECT_EQ(motor.speed_rpm, 0.0);
    command(drive_forward, 6000);
    EXPECT_NEAR(motor.speed_rpm, 6000, 4);
    EXPECT_NEAR(w.real("speed-fb"), 6000, 4);
    command(drive_stop, 0);
    EXPECT_EQ(motor.speed_rpm, 0.0);
    command(drive_reverse, 3000);
    EXPECT_NEAR(motor.speed_rpm, -3000, 4);
    EXPECT_NEAR(w.real("speed-fb"), 3000, 4);

    // the stop telegrams of the profile, and no command behind them
    w.image.header().requests.hold(StopReason::estop);
    w.image.stop(StopReason::estop);
    w.run(3 * second);
    EXPECT_EQ(slave.stopped.load(), 1U);
    EXPECT_EQ(motor.speed_rpm, 0.0);
    EXPECT_EQ(slave.exceptions.load(), 0U);
    EXPECT_EQ(slave.errors.load(), 0U);
}

INSTANTIATE_TEST_SUITE_P(All, ProfileTest, testing::ValuesIn([] {
                             std::vector<std::string> names;
                             for (const Profile& p : profiles()) {
                                 names.emplace_back(p.name);
                             }
                             return names;
                         }()),
                         [](const auto& of) {
                             std::string name = of.param;
                             std::replace(name.begin(), name.end(), '-', '_');
                             return name;
                         });

/// Records what is sent.
class RecordedLine final : public PassingLine {
public:
    RecordedLine(std::unique_ptr<line::Line> line, std::vector<std::string>& frames)
        : PassingLine(std::move(line)), frames_(frames) {}
    bool send(std::span<const std::uint8_t> bytes, std::int64_t now) noexcept override {
        frames_.push_back(hal::test::hex(bytes));
        return PassingLine::send(bytes, now);
    }

private:
    std::vector<std::string>& frames_;
};

TEST(Drive, Stop_telegrams_are_those_of_the_manuals) {
    const std::pair<const char*, const char*> telegrams[] = {
        {"huanyang", "01 03 01 08 F1 8E"},
        {"huanyang-gt", "01 06 10 00 00 05 4D 09"},
        {"huanyang-p2a", "01 06 20 00 00 06 02 08"},
        {"h100", "01 05 00 4B FF 00 FC 2C"},
        {"yl620", "01 06 20 00 00 01 43 CA"},
        {"delta-ms300", "01 06 20 00 00 01 43 CA"},
        {"gs2", "01 06 09 1B 00 00 FA 51"},
        {"vfs11", "01 06 FA 00 C0 00 E9 12"},
        {"wj200", "01 05 00 00 00 00 CD CA"},
        {"danfoss-fc", "01 0F 00 00 00 20 04 3C 04 00 00 89 19"},
    };
    EXPECT_EQ(std::size(telegrams) + 1, profiles().size());  // generic has none
    for (const auto& [profile, telegram] : telegrams) {
        std::vector<std::string> frames;
        World w(std::string("[bus]\nlink = sim:x\n[slave 1 d]\nprofile = ") + profile + "\n", {},
                [&](std::unique_ptr<line::Line> line) {
            return std::make_unique<RecordedLine>(std::move(line), frames);
        });
        w.run(500 * ms);
        w.image.header().requests.hold(StopReason::estop);
        frames.clear();
        w.image.stop(StopReason::death);
        w.run(300 * ms);
        EXPECT_EQ(std::count(frames.begin(), frames.end(), telegram), 1) << profile;
        EXPECT_EQ(w.image.slave(0).stopped.load(), 1U) << profile;
    }
}

std::string many_slaves(int count) {
    std::string text =
        "[bus]\nlink = sim:x\nbaud = 38400\n[defaults]\ntimeout = 20ms\nevery = 10ms\n";
    for (int unit = 1; unit <= count; ++unit) {
        text += "[slave " + std::to_string(unit) + "]\nread v = holding 0\n";
    }
    return text;
}

TEST(Master, Dead_slaves_cost_the_others_at_most_a_tenth) {
    const auto telegrams_of = [](bool some_are_dead) {
        World w(many_slaves(31));
        for (const unsigned unit : {3U, 9U, 14U, 20U, 31U}) {
            SlaveFault fault;
            fault.unit = static_cast<std::uint8_t>(unit);
            fault.is_active = some_are_dead;
            w.slaves->faults().push_back(fault);
        }
        w.run(5 * second);  // until they are known to be offline
        const std::uint64_t before = w.image.header().telegrams.load();
        w.run(20 * second);
        return w.image.header().telegrams.load() - before;
    };
    const double all = static_cast<double>(telegrams_of(false));
    const double without = static_cast<double>(telegrams_of(true));
    EXPECT_GE(without, 0.9 * all) << without << " of " << all;
}

TEST(Master, Busy_line_is_used_as_far_as_its_gaps_allow) {
    World w(many_slaves(4));
    w.run(second);
    const std::uint64_t before = w.image.header().telegrams.load();
    w.run(20 * second);
    const std::uint64_t telegrams = w.image.header().telegrams.load() - before;
    const TelegramTime time = time_of(w.plan().telegrams[0], w.bus(), Framing::rtu);
    const double use = static_cast<double>(telegrams) * static_cast<double>(time.all(0)) /
                       static_cast<double>(20 * second);
    // a quarter of a millisecond of each telegram is the step of this test
    EXPECT_GE(use, 0.93) << telegrams;
    EXPECT_LE(use, 1.0);
}

TEST(Master, Late_answer_is_never_the_value_of_another_request) {
    World w(
        "[bus]\nlink = sim:x\nbaud = 38400\n[slave 1 s]\ntimeout = 20ms\nmax-gap = 0\n"
        "read a = holding 0 every 10ms\nread b = holding 100 every 10ms\n");
    w.slaves->slaves()[0].set("a", 111);
    w.slaves->slaves()[0].set("b", 222);
    SlaveFault fault;
    fault.kind = FaultKind::late;
    fault.every = 20;
    fault.late_ns = 25 * ms;
    w.slaves->faults().push_back(fault);
    w.run(100 * ms);
    for (int n = 0; n < 3000; ++n) {
        w.run(10 * ms);
        ASSERT_EQ(w.number("a"), 111U) << n;
        ASSERT_EQ(w.number("b"), 222U) << n;
    }
    EXPECT_GT(w.image.slave(0).timeouts.load(), 100U);
}

/// A line on which one answer comes late.
class LateLine final : public PassingLine {
public:
    using PassingLine::PassingLine;
    std::size_t receive(std::span<std::uint8_t> bytes, std::int64_t now) noexcept override {
        std::array<std::uint8_t, 256> part;
        const std::size_t received = PassingLine::receive(part, now);
        held_.insert(held_.end(), part.begin(),
                     part.begin() + static_cast<std::ptrdiff_t>(received));
        if (now < until) return 0;
        const std::size_t count = std::min(bytes.size(), held_.size());
        std::copy_n(held_.begin(), count, bytes.begin());
        held_.erase(held_.begin(), held_.begin() + static_cast<std::ptrdiff_t>(count));
        return count;
    }

    std::int64_t until = 0;  // nothing arrives

private:
    std::vector<std::uint8_t> held_;
};

/// Reads six values of one shape, each its address, while answers are late, by up to `late_ns`.
void expect_own_values(const std::string& reads, std::int64_t late_ns) {
    LateLine* late = nullptr;
    World w(
        "[bus]\nlink = sim:x\nbaud = 38400\n[slave 1 s]\ntimeout = 50ms\nlost = 20\nmax-gap = 0\n" +
            reads,
        {}, [&](std::unique_ptr<line::Line> line) {
        auto made = std::make_unique<LateLine>(std::move(line));
        late = made.get();
        return made;
    });
    for (const int address : {10, 20, 30, 40}) {
        w.slaves->slaves()[0].set("v" + std::to_string(address), address);
    }
    w.run(500 * ms);
    for (int round = 0; round < 20; ++round) {
        late->until = w.now + late_ns;
        for (int n = 0; n < 100; ++n) {
            w.run(10 * ms);
            for (const int address : {10, 20, 30, 40}) {
                ASSERT_EQ(w.number("v" + std::to_string(address)), static_cast<unsigned>(address))
                    << late_ns << " round " << round;
            }
        }
    }
    EXPECT_GT(w.image.slave(0).timeouts.load(), 5U);
    EXPECT_EQ(w.image.slave(0).online.load(), 1U);
}

TEST(Master, Answer_later_than_two_timeouts_is_never_the_value_of_another_request) {
    const std::string one =
        "read v10 = holding 10\nread v20 = holding 20\nread v30 = holding 30\n"
        "read v40 = holding 40\n";
    const std::string two =
        "read v10 = holding 10 u32\nread v20 = holding 20 u32\nread v30 = holding 30 u32\n"
        "read v40 = holding 40 u32\n";
    for (const std::int64_t late : {120 * ms, 135 * ms, 180 * ms, 260 * ms, 400 * ms}) {
        expect_own_values(one, late);
        expect_own_values(two, late);
    }
}

/// A slave that does not answer a request for more than one register.
class IgnoringLine final : public PassingLine {
public:
    using PassingLine::PassingLine;
    bool send(std::span<const std::uint8_t> bytes, std::int64_t now) noexcept override {
        if (bytes[1] == 3 && bytes[5] > 1) return true;
        return PassingLine::send(bytes, now);
    }
};

TEST(Master, Slave_that_ignores_unknown_registers_stays_online_after_a_timeout) {
    // after a timeout two registers are read, and the slave has one
    World w(
        "[bus]\nlink = sim:x\nbaud = 38400\n[slave 1 s]\ntimeout = 20ms\n"
        "read a = holding 0 every 50ms\n",
        {}, [](std::unique_ptr<line::Line> line) {
        return std::make_unique<IgnoringLine>(std::move(line));
    });
    w.slaves->slaves()[0].set("a", 5);
    w.run(500 * ms);
    EXPECT_EQ(w.number("a"), 5U);
    const std::uint32_t before = w.image.slave(0).timeouts.load();
    EXPECT_LE(before, 1U) << "it is asked once";
    SlaveFault fault;
    fault.every = 20;
    w.slaves->faults().push_back(fault);
    for (int n = 0; n < 1000; ++n) {
        w.run(10 * ms);
        ASSERT_EQ(w.image.slave(0).online.load(), 1U);
    }
    EXPECT_GT(w.image.slave(0).timeouts.load(), 5U);
}

TEST(Master, Corrupted_answer_is_never_a_value) {
    World w(
        "[bus]\nlink = sim:x\nbaud = 115200\n[slave 1 s]\ntimeout = 20ms\nlost = 100\n"
        "read a = holding 0 u64 every 5ms\n");
    w.slaves->slaves()[0].set("a", 1234567890);
    w.run(100 * ms);
    SlaveFault fault;
    fault.kind = FaultKind::corrupt;
    fault.every = 3;
    w.slaves->faults().push_back(fault);
    for (int n = 0; n < 2000; ++n) {
        w.run(10 * ms);
        ASSERT_EQ(w.number("a"), 1234567890U);
    }
    EXPECT_GT(w.image.slave(0).errors.load(), 500U);
}

TEST(Master, Stop_waits_for_at_most_the_telegram_on_the_line) {
    World w(
        "[bus]\nlink = sim:x\nbaud = 19200\n[slave 1 s]\nread a = holding 0 every 10ms\n"
        "write c = holding 50\nstop = holding 50 7\n");
    w.run(500 * ms);
    w.image.header().requests.hold(StopReason::estop);
    w.image.stop(StopReason::death);
    const std::int64_t since = w.now;
    while (w.image.slave(0).stopped.load() == 0 && w.now - since < second) {
        w.run(ms);
    }
    // the running read and the stop telegram with their answers and gaps, at 19200 baud
    EXPECT_LT(w.now - since, 35 * ms);
    EXPECT_EQ(w.slaves->slaves()[0].get(Table::holding, 50), 7);
}

TEST(Master, Stop_of_one_slave_does_not_wait_for_another_that_is_dead) {
    World w(
        "[bus]\nlink = sim:x\nbaud = 19200\n[slave 1 dead]\ntimeout = 100ms\n"
        "write c = holding 50\nstop = holding 50 7\n[slave 2 alive]\nwrite c = holding 50\n"
        "stop = holding 50 7\n");
    SlaveFault fault;
    fault.unit = 1;
    w.slaves->faults().push_back(fault);
    w.run(2 * second);
    w.image.stop(StopReason::death);
    w.run(300 * ms);
    EXPECT_EQ(w.slaves->slaves()[1].get(Table::holding, 50), 7);
    EXPECT_EQ(w.image.slave(1).stopped.load(), 1U);
    EXPECT_EQ(w.image.slave(0).stopped.load(), 0U);
}

/// A slave with a set-point in register 51, of which register 50 is 7 when it is stopped.
struct Stop : testing::Test {
    void start() {
        w.image.value(w.value("c")).store(9);
        w.run(second);
        ASSERT_EQ(get(51), 9);
        set(50, 1);
    }
    void stop() {
        w.image.header().requests.hold(StopReason::estop);
        w.image.stop(StopReason::estop);
    }
    void release() { w.image.header().requests.release(StopReason::estop); }
    void fail(FaultKind kind) {
        SlaveFault fault;
        fault.kind = kind;
        w.slaves->faults().push_back(fault);
    }
    void recover() { w.slaves->faults().clear(); }
    int get(std::uint16_t address) {
        return w.slaves->slaves()[0].get(Table::holding, address).value_or(-1);
    }
    void set(int address, double value) {
        EXPECT_TRUE(w.slaves->slaves()[0].set("r" + std::to_string(address), value));
    }
    bool is_stopped() const { return w.image.slave(0).stopped.load() != 0; }
    std::vector<Event> events() const {
        std::vector<Event> all;
        for (EventRecord record; w.image.pop(record);) {
            all.push_back(record.event);
        }
        return all;
    }

    static constexpr const char* slave =
        "[bus]\nlink = sim:x\nbaud = 38400\n[slave 1 s]\ntimeout = 50ms\nread a = holding 0\n";
    World w{std::string(slave) + "write c = holding 51\nstop = holding 50 7\n",
            std::string(slave) + "read r50 = holding 50\nread r51 = holding 51\n"};
};

TEST_F(Stop, Is_repeated_until_a_slave_that_was_not_responding_acknowledges) {
    start();
    fail(FaultKind::silence);
    stop();
    w.run(4 * second);
    EXPECT_FALSE(is_stopped());
    events();
    set(50, 1);  // whatever it has received before
    recover();
    w.run(second);
    EXPECT_EQ(get(50), 7);
    EXPECT_TRUE(is_stopped());
    EXPECT_EQ(events(), (std::vector{Event::slave_online, Event::stop_acknowledged}));
    set(50, 1);
    w.run(5 * second);
    EXPECT_EQ(get(50), 1) << "it was acknowledged once";
}

TEST_F(Stop, Is_repeated_until_a_slave_that_rejected_it_acknowledges) {
    start();
    fail(FaultKind::exception);
    stop();
    w.run(4 * second);
    EXPECT_FALSE(is_stopped());
    set(50, 1);
    recover();
    w.run(2 * second);
    EXPECT_EQ(get(50), 7);
    EXPECT_TRUE(is_stopped());
    release();
    w.run(second);
    EXPECT_FALSE(is_stopped());
    EXPECT_EQ(w.image.slave(0).stop_pending.load(), 0U);
}

TEST_F(Stop, Comes_before_the_set_points_also_when_the_cause_has_ended) {
    start();
    fail(FaultKind::silence);
    stop();
    w.run(2 * second);
    release();
    w.run(2 * second);
    EXPECT_EQ(w.image.slave(0).stop_pending.load(), 1U);
    set(50, 1);
    set(51, 0);
    recover();
    for (int n = 0; n < 6000 && get(51) == 0; ++n) {
        w.run(ms);
    }
    EXPECT_EQ(get(51), 9);
    EXPECT_EQ(get(50), 7);
    EXPECT_EQ(w.image.slave(0).stop_pending.load(), 0U);
    EXPECT_FALSE(is_stopped()) << "it is written to again";
}

TEST_F(Stop, Is_sent_again_to_a_slave_that_returns_while_it_lasts) {
    start();
    stop();
    w.run(second);
    EXPECT_TRUE(is_stopped());
    fail(FaultKind::silence);
    w.run(2 * second);
    set(50, 1);  // switched off and on
    recover();
    w.run(5 * second);
    EXPECT_EQ(get(50), 7);
    EXPECT_TRUE(is_stopped());
}

TEST_F(Stop, Is_not_repeated_to_a_slave_that_returns_later) {
    start();
    stop();
    w.run(second);
    release();
    w.run(second);
    fail(FaultKind::silence);
    w.run(2 * second);
    set(50, 1);
    recover();
    w.run(5 * second);
    EXPECT_EQ(get(50), 1);
    EXPECT_EQ(get(51), 9);
}

/// A line that is lost, or is open and accepts no bytes.
class FailingLine final : public PassingLine {
public:
    enum class State : std::uint8_t { good, accepts_nothing, lost };
    FailingLine(std::unique_ptr<line::Line> line, const State& state)
        : PassingLine(std::move(line)), state_(state) {}
    bool is_open(std::int64_t now) noexcept override {
        return state_ != State::lost && PassingLine::is_open(now);
    }
    bool send(std::span<const std::uint8_t> bytes, std::int64_t now) noexcept override {
        return state_ == State::good && PassingLine::send(bytes, now);
    }

private:
    const State& state_;
};

/// Two slaves with the register 50, of which only the second has a stop telegram of its own.
struct BroadcastStop : testing::Test {
    void start() {
        w.run(second);
        for (EmulatedSlave& slave : w.slaves->slaves()) {
            ASSERT_TRUE(slave.set("c", 1));
        }
        frames.clear();
    }
    void stop() {
        w.image.header().requests.hold(StopReason::estop);
        w.image.stop(StopReason::estop);
    }
    int get(std::size_t slave) {
        return w.slaves->slaves()[slave].get(Table::holding, 50).value_or(-1);
    }
    std::ptrdiff_t sent(const std::string& frame) const {
        return std::count(frames.begin(), frames.end(), frame);
    }

    static constexpr const char* broadcast = "00 06 00 32 00 07 68 16";
    static constexpr const char* bus =
        "[bus]\nlink = sim:x\nbaud = 38400\nbroadcast-stop = holding 50 7\nturnaround = 100ms\n"
        "[defaults]\ntimeout = 50ms\n";
    std::vector<std::string> frames;
    FailingLine::State state = FailingLine::State::good;
    World w{std::string(bus) +
                "[slave 1 a]\nread r = holding 0\n"
                "[slave 2 b]\nread r = holding 0\nstop = holding 50 7\n",
            std::string(bus) +
                "[slave 1 a]\nread r = holding 0\nread c = holding 50\n"
                "[slave 2 b]\nread r = holding 0\nread c = holding 50\n",
            [this](std::unique_ptr<line::Line> line) {
        return std::make_unique<FailingLine>(
            std::make_unique<RecordedLine>(std::move(line), frames), state);
    }};
};

TEST_F(BroadcastStop, Reaches_all_slaves_first_and_again_behind_the_addressed_telegrams) {
    start();
    stop();
    w.run(50 * ms);
    EXPECT_EQ(get(0), 7);
    EXPECT_EQ(get(1), 7) << "by the broadcast";
    EXPECT_EQ(w.image.slave(1).stopped.load(), 0U) << "a broadcast acknowledges nothing";
    EXPECT_EQ(sent(broadcast), 1);
    const std::size_t before = frames.size();
    w.run(50 * ms);
    EXPECT_EQ(frames.size(), before) << "nothing is sent during the turnaround";
    w.run(second);
    EXPECT_EQ(sent(broadcast), 2);
    EXPECT_EQ(w.image.slave(0).stopped.load(), 0U);
    EXPECT_EQ(w.image.slave(1).stopped.load(), 1U);
    EXPECT_EQ(w.image.header().broadcasts.load(), 2U);
    EXPECT_EQ(w.image.header().phase.load(), static_cast<std::uint32_t>(Phase::stopped));
    ASSERT_GE(frames.size(), before + 3);
    EXPECT_EQ(frames[before].substr(0, 17), "02 06 00 32 00 07");
    EXPECT_EQ(frames[before + 1], broadcast);
    EXPECT_EQ(frames[before + 2].substr(0, 8), "01 03 00") << "the reads go on";
}

TEST_F(BroadcastStop, Is_sent_when_nobody_answers) {
    start();
    w.slaves->faults().push_back({});
    stop();
    w.run(2 * second);
    EXPECT_EQ(get(0), 7);
    EXPECT_EQ(sent(broadcast), 2);
    EXPECT_EQ(w.image.slave(1).stopped.load(), 0U);
    EXPECT_EQ(w.image.slave(1).stop_pending.load(), 1U);
    std::vector<Event> all;
    for (EventRecord record; w.image.pop(record);) {
        all.push_back(record.event);
    }
    EXPECT_EQ(std::count(all.begin(), all.end(), Event::stop_broadcast), 1);
    EXPECT_EQ(std::count(all.begin(), all.end(), Event::stop_unconfirmed), 1);
}

TEST_F(BroadcastStop, Is_sent_once_more_by_each_further_stop) {
    start();
    stop();
    w.run(second);
    w.image.header().requests.release(StopReason::estop);
    w.run(second);
    EXPECT_EQ(w.image.header().phase.load(), static_cast<std::uint32_t>(Phase::running));
    stop();
    w.run(second);
    EXPECT_EQ(sent(broadcast), 4);
}

TEST_F(BroadcastStop, Is_sent_again_and_not_reported_until_the_line_accepts_it) {
    start();
    w.lines();
    state = FailingLine::State::accepts_nothing;
    stop();
    w.run(200 * ms);
    EXPECT_EQ(w.image.header().broadcasts.load(), 0U);
    EXPECT_EQ(w.lines(),
              std::vector<std::string>{"sends the stop telegrams: the pin estop is TRUE"});
    state = FailingLine::State::good;
    w.run(second);
    EXPECT_EQ(sent(broadcast), 2);
    EXPECT_EQ(w.image.header().broadcasts.load(), 2U);
    EXPECT_EQ(w.lines(),
              (std::vector<std::string>{
                  "the broadcast stop was sent after 202.1 ms; no slave acknowledges a broadcast",
                  "slave 2 (b) acknowledged its stop telegrams after 308.1 ms"}));
}

TEST_F(BroadcastStop, Is_reported_when_it_is_sent_only_after_the_line_has_returned) {
    start();
    w.lines();
    state = FailingLine::State::lost;
    stop();
    w.run(2 * second);
    EXPECT_EQ(w.image.header().phase.load(), static_cast<std::uint32_t>(Phase::stopped));
    EXPECT_EQ(w.image.header().broadcasts.load(), 0U);
    EXPECT_EQ(w.lines(),
              (std::vector<std::string>{
                  "sends the stop telegrams: the pin estop is TRUE",
                  "sim:x is lost; it is opened again as soon as possible",
                  "slave 2 (b) did not acknowledge its stop telegrams; stop it by other means"}));
    state = FailingLine::State::good;
    w.run(second);
    EXPECT_EQ(sent(broadcast), 1);
    EXPECT_EQ(w.image.header().broadcasts.load(), 1U);
    EXPECT_EQ(w.lines(),
              (std::vector<std::string>{
                  "sim:x is open again",
                  "the broadcast stop was sent after 2002.1 ms; no slave acknowledges a broadcast",
                  "slave 1 (a) is online", "slave 2 (b) is online",
                  "slave 2 (b) acknowledged its stop telegrams after 2115.5 ms"}));
}

TEST_F(BroadcastStop, Ends_on_a_line_that_accepts_nothing) {
    start();
    w.lines();
    state = FailingLine::State::accepts_nothing;
    stop();
    w.run(4 * second);
    EXPECT_EQ(w.image.header().phase.load(), static_cast<std::uint32_t>(Phase::stopped));
    EXPECT_EQ(w.image.header().broadcasts.load(), 0U);
    EXPECT_EQ(sent(broadcast), 0);
}

TEST(EventTexts, Stops_with_different_reasons_are_not_counted_as_one) {
    World w("[bus]\nlink = sim:x\n[slave 1 a]\nread r = holding 0\nstop = holding 50 7\n");
    const EventTexts texts(w.bus(), w.plan());
    std::vector<std::string> printed;
    hal::MessageLog log{"m", [&](const std::string& line) { printed.push_back(line); }};
    for (const StopReason reason :
         {StopReason::fault, StopReason::estop, StopReason::fault, StopReason::unload}) {
        const EventRecord record{Event::stopping, 0, 0, static_cast<std::int64_t>(reason)};
        const std::string line = texts.line(record);
        log.print(EventTexts::subject(record, line), line, 0);
    }
    std::vector<std::string> expected;
    for (const StopReason reason :
         {StopReason::fault, StopReason::estop, StopReason::fault, StopReason::unload}) {
        expected.push_back("m: sends the stop telegrams: " + std::string(to_string(reason)) + "\n");
    }
    EXPECT_EQ(printed, expected);
}

TEST(Master, A_broadcast_stop_is_a_request_to_unit_0_on_TCP) {
    std::vector<std::string> frames;
    World w(
        "[bus]\nlink = sim:x\nprotocol = tcp\nbroadcast-stop = holding 50 7\n"
        "[slave 1 a]\nread c = holding 50\n",
        "", [&frames](std::unique_ptr<line::Line> line) {
        return std::make_unique<RecordedLine>(std::move(line), frames);
    });
    w.run(second);
    frames.clear();
    w.image.stop(StopReason::estop);
    w.run(second);
    const auto is_broadcast = [](const std::string& frame) {
        return frame.substr(5) == " 00 00 00 06 00 06 00 32 00 07";
    };
    EXPECT_EQ(std::count_if(frames.begin(), frames.end(), is_broadcast), 2);
    EXPECT_EQ(w.image.header().broadcasts.load(), 2U);
    EXPECT_EQ(w.slaves->slaves()[0].get(Table::holding, 50).value_or(-1), 7);
}

/// Returns the time from a stop to its end, on a line of this configuration without answers, behind
/// the expected longest one.
std::pair<std::int64_t, std::int64_t> time_of_stop(const std::string& text) {
    World w(text);
    w.run(second);
    w.slaves->faults().push_back({});
    w.run(100 * ms);
    w.image.header().requests.hold(StopReason::estop);
    w.image.stop(StopReason::unload);
    const std::int64_t begin = w.now;
    do {
        w.run(10 * ms);
    } while (w.image.header().phase.load() != static_cast<std::uint32_t>(Phase::stopped));
    return {max_stop_ns(w.plan(), w.bus()), w.now - begin};
}

TEST(Master, Longest_time_of_a_stop_is_that_of_slaves_that_do_not_answer) {
    const std::string slave = "timeout = 200ms\nlost = 1\nread a = holding 0\n";
    for (const std::string& text :
         {"[bus]\nlink = sim:x\nturnaround = 1s\nbroadcast-stop = holding 50 7, holding 51 7, "
          "holding 52 7, holding 53 7, holding 54 7, holding 55 7, holding 56 7, holding 57 7\n"
          "[slave 1 s]\n" +
              slave,
          "[bus]\nlink = sim:x\nbaud = 1200\n[slave 1 s]\nstop-attempts = 20\n"
          "stop = holding 50 7, holding 51 7\n" +
              slave + "[slave 2 t]\ngap = 50ms\nstop = holding 50 7\n" + slave}) {
        const auto [max, measured] = time_of_stop(text);
        EXPECT_LE(measured, max) << text;
        EXPECT_GE(measured, max / 2) << text;
        EXPECT_GE(measured, 15 * second) << text;
    }
}

TEST(Master, Stop_with_a_rejected_telegram_is_not_acknowledged) {
    const std::string bus = "[bus]\nlink = sim:x\nbaud = 38400\n[slave 1 s]\nread a = holding 0\n";
    World w(bus + "write c = holding 50\nstop = holding 500 1, holding 50 7\n",
            bus + "write c = holding 50\n");
    w.run(second);
    w.image.header().requests.hold(StopReason::estop);
    w.image.stop(StopReason::estop);
    w.run(3 * second);
    EXPECT_EQ(w.slaves->slaves()[0].get(Table::holding, 50), 7) << "the further telegrams are sent";
    EXPECT_EQ(w.image.slave(0).stopped.load(), 0U);
    EXPECT_EQ(w.image.slave(0).stop_pending.load(), 1U);
    const std::uint32_t before = w.image.slave(0).exceptions.load();
    w.run(10 * second);
    EXPECT_LE(w.image.slave(0).exceptions.load() - before, 12U);
}

TEST(Master, Stop_of_offline_slaves_leaves_three_quarters_of_the_line) {
    World w(
        "[bus]\nlink = sim:x\nbaud = 38400\n[slave 1 dead]\nwrite c = holding 50\n"
        "stop = holding 50 7\n[slave 2 dead-too]\nwrite c = holding 50\nstop = holding 50 7\n"
        "[slave 3 alive]\nread a = holding 0 every 50ms\n");
    for (const int unit : {1, 2}) {
        SlaveFault fault;
        fault.unit = static_cast<std::uint8_t>(unit);
        w.slaves->faults().push_back(fault);
    }
    w.run(2 * second);
    w.image.header().requests.hold(StopReason::estop);
    w.image.stop(StopReason::estop);
    w.run(4 * second);
    const std::uint64_t before = w.image.header().telegrams.load();
    const std::uint32_t timeouts = w.image.slave(0).timeouts.load();
    w.run(20 * second);
    EXPECT_GE(w.image.header().telegrams.load() - before, 300U);
    EXPECT_GE(w.image.slave(0).timeouts.load() - timeouts, 10U);
}

TEST(Master, Stop_of_a_drive_during_a_short_disturbance_arrives_within_a_second) {
    World w(
        "[bus]\nlink = sim:x\nbaud = 38400\n[slave 1 s]\nprofile = delta-ms300\nlost = 1\n"
        "every = 50ms\n");
    w.image.slave(0).speed.store(std::bit_cast<std::uint64_t>(12000.0));
    w.image.slave(0).command.store(drive_forward);
    w.run(5 * second);
    EXPECT_EQ(w.slaves->slaves()[0].get(Table::holding, 0x2000), 0x12);
    for (int n = 0; n < 10; ++n) {
        w.slaves->faults().push_back({});
        w.run(150 * ms);
        ASSERT_EQ(w.image.slave(0).online.load(), 0U);
        w.image.slave(0).command.store(drive_stop);
        w.slaves->faults().clear();
        w.run(second);
        EXPECT_EQ(w.slaves->slaves()[0].get(Table::holding, 0x2000), 0x01) << n;
        w.image.slave(0).command.store(drive_forward);
        w.run(n * 777 * ms);
    }
}

TEST(Master, Slave_without_reads_returns) {
    World w("[bus]\nlink = sim:x\nbaud = 38400\n[slave 1 s]\nwrite c = holding 50\n");
    w.image.value(w.value("c")).store(9);
    w.run(second);
    EXPECT_EQ(w.image.slave(0).online.load(), 1U);
    w.slaves->faults().push_back({});
    w.run(10 * second);
    EXPECT_EQ(w.image.slave(0).online.load(), 0U);
    w.slaves->faults().clear();
    w.image.value(w.value("c")).store(10);
    w.run(10 * second);
    EXPECT_EQ(w.image.slave(0).online.load(), 1U);
    EXPECT_EQ(w.slaves->slaves()[0].get(Table::holding, 50), 10);
}

TEST(Master, Rejected_register_does_not_slow_down_the_others) {
    World w(
        "[bus]\nlink = sim:x\nbaud = 38400\n[slave 1 s]\nmax-gap = 0\n"
        "read good = holding 0 every 20ms\nread bad = holding 500 every 20ms\n",
        "[bus]\nlink = sim:x\nbaud = 38400\n[slave 1 s]\nread good = holding 0\n");
    w.slaves->slaves()[0].set("good", 5);
    w.run(5 * second);
    EXPECT_EQ(w.number("good"), 5U);
    EXPECT_EQ(w.image.slave(0).online.load(), 1U);
    EXPECT_GE(w.image.slave(0).exceptions.load(), 3U);
    EXPECT_LE(w.image.slave(0).exceptions.load(), 8U);
    EXPECT_EQ(w.image.rejected(0).load() + w.image.rejected(1).load(), 1U) << "the bad one";
}

TEST_F(Stop, Rejected_requests_are_reported_after_as_many_as_silence_until_they_are_accepted) {
    start();
    events();
    fail(FaultKind::exception);
    w.run(2 * second);
    std::vector<Event> all = events();
    EXPECT_EQ(std::count(all.begin(), all.end(), Event::slave_rejects), 1);
    for (std::size_t n = 0; n < w.plan().telegrams.size(); ++n) {
        EXPECT_EQ(w.image.rejected(n).load(), 1U) << n;
    }
    EXPECT_EQ(w.image.slave(0).online.load(), 1U);
    recover();
    w.run(2 * second);
    all = events();
    EXPECT_EQ(std::count(all.begin(), all.end(), Event::slave_accepts), 1);
    for (std::size_t n = 0; n < w.plan().telegrams.size(); ++n) {
        EXPECT_EQ(w.image.rejected(n).load(), 0U) << n;
    }
}

TEST_F(Stop, A_request_that_is_rejected_once_is_repeated_and_not_a_fault) {
    start();
    events();
    SlaveFault fault;
    fault.kind = FaultKind::exception;
    fault.every = 2;
    w.slaves->faults().push_back(fault);
    w.image.value(w.value("c")).store(11);
    w.run(3 * second);
    EXPECT_EQ(get(51), 11);
    for (const Event event : events()) {
        EXPECT_NE(event, Event::slave_rejects);
    }
}

/// A two-wire adapter without receiver disable: what is sent is also received.
class EchoLine final : public PassingLine {
public:
    using PassingLine::PassingLine;
    bool send(std::span<const std::uint8_t> bytes, std::int64_t now) noexcept override {
        echo_.insert(echo_.end(), bytes.begin(), bytes.end());
        return PassingLine::send(bytes, now);
    }
    std::size_t receive(std::span<std::uint8_t> bytes, std::int64_t now) noexcept override {
        if (now < PassingLine::sent_until_ns()) return 0;
        const std::size_t count = std::min(bytes.size(), echo_.size());
        std::copy_n(echo_.begin(), count, bytes.begin());
        echo_.erase(echo_.begin(), echo_.begin() + static_cast<std::ptrdiff_t>(count));
        return count != 0 ? count : PassingLine::receive(bytes, now);
    }

private:
    std::vector<std::uint8_t> echo_;
};

TEST(Master, Echo_of_a_request_is_not_its_answer) {
    const auto echoing = [](std::unique_ptr<line::Line> line) {
        return std::make_unique<EchoLine>(std::move(line));
    };
    const std::string text =
        "[bus]\nlink = sim:x\nbaud = 38400\n[slave 1 s]\nread a = holding 0\n"
        "write c = holding 50\nstop = holding 50 7\n[slave 2 dead]\nread a = holding 0\n"
        "write c = holding 50\nstop = holding 50 7\n";
    World w(text, {}, echoing);
    SlaveFault fault;
    fault.unit = 2;
    w.slaves->faults().push_back(fault);
    w.slaves->slaves()[0].set("a", 5);
    w.image.value(w.value("c")).store(9);
    w.run(3 * second);
    EXPECT_EQ(w.number("a"), 5U);
    EXPECT_EQ(w.slaves->slaves()[0].get(Table::holding, 50), 9);
    EXPECT_EQ(w.image.slave(0).errors.load(), 0U);
    EXPECT_EQ(w.image.slave(0).timeouts.load(), 0U);
    EXPECT_EQ(w.image.slave(1).online.load(), 0U);
    w.image.header().requests.hold(StopReason::estop);
    w.image.stop(StopReason::estop);
    w.run(3 * second);
    EXPECT_EQ(w.image.slave(0).stopped.load(), 1U);
    EXPECT_EQ(w.image.slave(1).stopped.load(), 0U);
}

TEST(Master, Echo_of_a_write_is_not_its_answer_on_a_line_without_reads) {
    const auto echoing = [](std::unique_ptr<line::Line> line) {
        return std::make_unique<EchoLine>(std::move(line));
    };
    const std::string bus = "[bus]\nlink = sim:x\nbaud = 38400\n[slave 1 s]\n";
    for (const bool stops_first : {false, true}) {
        for (const bool is_alive : {false, true}) {
            World w(bus + "write c = holding 50\nstop = holding 50 7\n", {}, echoing);
            if (!is_alive) {
                w.slaves->faults().push_back({});
            }
            const auto stop = [&] {
                w.image.header().requests.hold(StopReason::estop);
                w.image.stop(StopReason::estop);
            };
            if (stops_first) {
                stop();
            }
            w.image.value(w.value("c")).store(9);
            w.run(5 * second);
            EXPECT_EQ(w.image.slave(0).online.load() != 0, is_alive) << stops_first;
            if (!stops_first) {
                stop();
                w.run(3 * second);
            }
            EXPECT_EQ(w.image.slave(0).stopped.load() != 0, is_alive) << stops_first;
        }
    }
}

TEST(Master, Slave_that_is_not_on_the_line_is_offline) {
    World w("[bus]\nlink = sim:x\nbaud = 9600\n[slave 1 s]\nread a = holding 0\n");
    w.slaves->slaves()[0].set("a", 5);
    auto other = line::open("sim:other-line", w.bus().line);
    w.slaves->attach(*other.line);  // nobody is on the line of the master
    w.run(3 * second);
    EXPECT_EQ(w.image.slave(0).online.load(), 0U);
    EXPECT_EQ(w.image.stamp(0).load(), 0);
    EXPECT_EQ(w.number("a"), 0U);
}

}  // namespace
}  // namespace hal::modbus::test
