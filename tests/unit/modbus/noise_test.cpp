// SPDX-License-Identifier: MIT
// A line on which 10 % of the bytes are changed, of requests and of answers.
// HALCYON_MODBUS_NOISE=3600 makes an hour of it instead of ten minutes, and one without `confirm`.
#include <cstdlib>
#include <deque>

#include "passing_line.hpp"
#include "world.hpp"

namespace hal::modbus::test {
namespace {

const char* const given_seconds = std::getenv("HALCYON_MODBUS_NOISE");

std::int64_t duration() {
    return (given_seconds != nullptr ? std::atoll(given_seconds) : 600) * second;
}

struct Read {
    std::uint64_t accepted = 0;  ///< values that are another one than before
    std::uint64_t wrong = 0;     ///< that the slave has not held in the last minute
    std::uint64_t errors = 0;
    std::uint64_t telegrams = 0;
};

/// Reads six values of a slave that change every 5 s, while the line is disturbed.
Read read_with_noise(const std::string& confirm, std::int64_t time) {
    const std::vector<std::string> names = {"a", "b", "c", "d", "e", "f"};
    std::string text =
        "[bus]\nlink = sim:x\nbaud = 115200\n[slave 1 s]\ntimeout = 10ms\nlost = 100\n"
        "every = 10ms\nmax-gap = 0\nconfirm = " +
        confirm + "\n";
    for (std::size_t n = 0; n < names.size(); ++n) {
        text += "read " + names[n] + " = holding " + std::to_string(16 * n) + "\n";
    }
    World w(text);
    SlaveFault fault;
    fault.kind = FaultKind::noise;
    w.slaves->faults().push_back(fault);
    link::Random random;
    std::vector<std::deque<std::uint64_t>> held(names.size(), {0});  // of the last minute
    std::vector<std::uint64_t> shown(names.size(), 0);
    Read read;
    std::int64_t change_at = w.now;
    for (const std::int64_t end = w.now + time; w.now < end;) {
        for (std::size_t n = 0; w.now >= change_at && n < names.size(); ++n) {
            held[n].push_back(random.draw() & 0xffff);
            if (held[n].size() > 13) {
                held[n].pop_front();
            }
            w.slaves->slaves()[0].set(names[n], static_cast<double>(held[n].back()));
        }
        change_at = w.now >= change_at ? w.now + 5 * second : change_at;
        w.run(5 * ms);
        for (std::size_t n = 0; n < names.size(); ++n) {
            const std::uint64_t value = w.number(names[n]);
            if (value == shown[n]) continue;
            shown[n] = value;
            ++read.accepted;
            read.wrong += std::count(held[n].begin(), held[n].end(), value) == 0 ? 1U : 0U;
        }
    }
    read.errors = w.image.slave(0).errors.load();
    read.telegrams = w.image.header().telegrams.load();
    std::printf("confirm = %s, %lld s: %llu answers, %llu corrupt ones; %llu changes, %llu wrong\n",
                confirm.c_str(), static_cast<long long>(time / second),
                static_cast<unsigned long long>(read.telegrams),
                static_cast<unsigned long long>(read.errors),
                static_cast<unsigned long long>(read.accepted),
                static_cast<unsigned long long>(read.wrong));
    return read;
}

TEST(Noise, No_wrong_value_is_accepted_while_a_tenth_of_the_bytes_is_wrong) {
    const Read read = read_with_noise("errors", duration());
    EXPECT_EQ(read.wrong, 0U);
    EXPECT_GT(read.errors, 1000U);
    // the slave changes its six values 12 times a minute
    EXPECT_GT(read.accepted, static_cast<std::uint64_t>(duration() / second));
    if (given_seconds != nullptr) {
        read_with_noise("no", duration());  // what the check sequence alone lets pass
    }
}

/// A line on which each 20th answer has another value and a valid check sequence.
class ForgingLine final : public PassingLine {
public:
    using PassingLine::PassingLine;
    bool send(std::span<const std::uint8_t> bytes, std::int64_t now) noexcept override {
        received_ = 0;
        return PassingLine::send(bytes, now);
    }
    std::size_t receive(std::span<std::uint8_t> bytes, std::int64_t now) noexcept override {
        const std::size_t count = PassingLine::receive(bytes, now);
        if (count != 0 && received_ == 0) {
            ++answers_;
        }
        for (std::size_t n = 0; n < count && answers_ % 20 == 0; ++n) {
            if (received_ + n < forged.size()) {
                bytes[n] = forged[received_ + n];
            }
        }
        received_ += count;
        return count;
    }

    /// The value 999 in the answer of slave 1 to a read of a register.
    static constexpr std::array<std::uint8_t, 7> forged = {1, 3, 2, 3, 0xe7, 0xf8, 0xfe};

private:
    std::size_t received_ = 0;  // bytes since the last request
    std::uint64_t answers_ = 0;
};

/// Returns how often the forged value was accepted, on a line with corrupt answers or without.
int accept_forged(const std::string& confirm, bool is_disturbed) {
    World w(
        "[bus]\nlink = sim:x\nbaud = 115200\n[slave 1 s]\ntimeout = 20ms\nlost = 100\n"
        "confirm = " +
            confirm + "\nread a = holding 0 every 10ms\n",
        {}, [](std::unique_ptr<line::Line> line) {
        return std::make_unique<ForgingLine>(std::move(line));
    });
    SlaveFault fault;
    fault.kind = FaultKind::corrupt;
    fault.every = 9;
    fault.is_active = is_disturbed;
    w.slaves->faults().push_back(fault);
    w.slaves->slaves()[0].set("a", 5);
    w.run(500 * ms);
    int wrong = 0;
    int right = 0;
    for (int n = 0; n < 1000; ++n) {
        w.run(5 * ms);
        const std::uint64_t value = w.number("a");
        wrong += value == 999 ? 1 : 0;
        right += value == 5 ? 1 : 0;
    }
    EXPECT_EQ(wrong + right, 1000);
    w.slaves->slaves()[0].set("a", 6);
    w.run(500 * ms);
    EXPECT_TRUE(w.number("a") == 6U || w.number("a") == 999U);
    return wrong;
}

TEST(Noise, Wrong_answer_with_a_valid_check_sequence_is_not_accepted_once_answers_are_corrupt) {
    EXPECT_EQ(crc16(ForgingLine::forged), 0);
    EXPECT_GT(accept_forged("no", true), 0);
    EXPECT_EQ(accept_forged("errors", true), 0);
    EXPECT_EQ(accept_forged("yes", true), 0);
    EXPECT_EQ(accept_forged("yes", false), 0);
}

/// Three values of one telegram, of which `angle` changes between all answers.
struct ChangingValue : testing::Test {
    static std::string text(const std::string& confirm) {
        return "[bus]\nlink = sim:x\nbaud = 115200\n[slave 1 s]\nevery = 10ms\nconfirm = " +
               confirm +
               "\nread limit = holding 0\nread angle = holding 1 f32\nread on = holding 3.2\n";
    }
    explicit ChangingValue(const std::string& confirm = "yes") : w(text(confirm)) {}
    void run(std::int64_t duration, bool changes) {
        for (const std::int64_t end = w.now + duration; w.now < end;) {
            angle += changes ? 1.0 : 0.0;
            w.slaves->slaves()[0].set("angle", angle);
            w.run(ms);
        }
    }
    std::int64_t age(const std::string& name) const {
        return w.now - w.image.value_stamp(w.value(name)).load();
    }
    double angle = 0.0;
    World w;
};

TEST_F(ChangingValue, Waits_alone_and_is_a_fault_until_it_is_accepted) {
    w.slaves->slaves()[0].set("limit", 7);
    w.slaves->slaves()[0].set("on", 1);
    run(200 * ms, true);
    EXPECT_EQ(w.number("limit"), 7U);
    EXPECT_EQ(w.number("on"), 1U);
    EXPECT_LT(age("limit"), 20 * ms);
    EXPECT_LT(age("on"), 20 * ms);
    EXPECT_EQ(w.image.value_stamp(w.value("angle")).load(), 0) << "never accepted";
    EXPECT_EQ(w.image.stamp(0).load(), 0) << "that of the oldest value";
    EXPECT_EQ(w.lines(), std::vector<std::string>{"slave 1 (s) is online"});

    run(second, true);
    EXPECT_EQ(w.lines(),
              std::vector<std::string>{
                  "slave 1 (s): a value that changes between all answers is not accepted: "
                  "angle; write confirm = errors for this slave; see test.modbus:8"});
    w.slaves->slaves()[0].set("limit", 8);
    run(50 * ms, true);
    EXPECT_EQ(w.number("limit"), 8U);

    run(100 * ms, false);
    EXPECT_EQ(w.real("angle"), angle);
    EXPECT_LT(age("angle"), 20 * ms);
    EXPECT_EQ(w.image.stamp(0).load(), w.image.value_stamp(w.value("angle")).load());
    EXPECT_EQ(w.lines(), std::vector<std::string>{"slave 1 (s): all values are accepted again"});
}

struct DisturbedChangingValue : ChangingValue {
    DisturbedChangingValue() : ChangingValue("errors") {}
};

TEST_F(DisturbedChangingValue, Is_accepted_again_when_the_line_is_repaired) {
    SlaveFault fault;
    fault.kind = FaultKind::corrupt;
    fault.every = 9;
    w.slaves->faults().push_back(fault);
    run(2 * second, true);
    std::vector<std::string> all = w.lines();
    EXPECT_EQ(
        all.back(),
        "slave 1 (s): a value that changes between all answers is not accepted: angle; repair "
        "the line, or write confirm = no for this slave; see test.modbus:8");
    w.slaves->faults().clear();
    run(4 * second, true);
    EXPECT_EQ(w.lines(), std::vector<std::string>{"slave 1 (s): all values are accepted again"});
    EXPECT_LT(age("angle"), 20 * ms);
}

}  // namespace
}  // namespace hal::modbus::test
