// SPDX-License-Identifier: MIT
// The frames of a capture: which of them returned from the slaves, and what they answer.
#include <gtest/gtest.h>

#include "ethercat/recorded/frame_directions.hpp"
#include "ethercat/recorded/recorded_answers.hpp"
#include "ethercat/recorded/recorded_port.hpp"

namespace {

using namespace hal::ethercat;
using Bytes = std::vector<std::uint8_t>;
using hal::ethernet::Captured;
using Direction = FrameDirections::Direction;

constexpr std::uint8_t unmarked = 0x00;  // first byte of a source address
constexpr std::uint8_t marked = 0x02;
constexpr std::uint32_t al_status = at_station(0x1001, 0x0130);
constexpr std::uint32_t al_control = at_station(0x1001, 0x0120);
constexpr std::uint32_t process_data = 0x10000;

struct Datagram {
    Command command = Command::fprd;
    std::uint32_t address = al_status;
    Bytes data{0, 0};
    std::uint16_t wkc = 0;
    std::uint8_t index = 1;
};

Bytes frame_with(const std::vector<Datagram>& datagrams, std::uint8_t source) {
    std::array<std::uint8_t, max_frame_bytes> buffer{};
    FrameWriter writer(buffer, {source, 1, 2, 3, 4, 5});
    for (const Datagram& d : datagrams) {
        const auto length = static_cast<std::uint16_t>(d.data.size());
        std::uint8_t* const to = writer.add(d.command, d.index, d.address, length);
        std::copy(d.data.begin(), d.data.end(), to);
        put(to + length, d.wkc);
    }
    const auto frame = writer.finish();
    return {frame.begin(), frame.end()};
}

Bytes frame_of(const Datagram& datagram, std::uint8_t source) {
    return frame_with({datagram}, source);
}

class EthercatFrameDirections : public testing::Test {
protected:
    /// Returns "sent", "returned 3" with the number of the sent frame, or "returned".
    std::string take(const Datagram& datagram, std::uint8_t source) {
        const Direction direction = directions_.take(frame_of(datagram, source));
        if (!direction.returned) return "sent";
        if (direction.sent == Direction::npos) return "returned";
        return "returned " + std::to_string(direction.sent);
    }

private:
    FrameDirections directions_;
};

TEST_F(EthercatFrameDirections, Marked_frames_have_returned_also_in_another_order) {
    EXPECT_EQ(take({.index = 1}, unmarked), "sent");
    EXPECT_EQ(take({.index = 2}, unmarked), "sent");
    EXPECT_EQ(take({.wkc = 1, .index = 2}, marked), "returned 1");
    EXPECT_EQ(take({.wkc = 0, .index = 1}, marked), "returned 0") << "no slave has processed it";
}

TEST_F(EthercatFrameDirections, Second_of_two_frames_has_returned_when_the_master_is_marked) {
    EXPECT_EQ(take({.index = 1}, marked), "sent");
    EXPECT_EQ(take({.index = 2}, marked), "sent");
    EXPECT_EQ(take({.wkc = 1, .index = 1}, marked), "returned 0");
    EXPECT_EQ(take({.wkc = 0, .index = 2}, marked), "returned 1");
    EXPECT_EQ(take({.index = 1}, marked), "sent") << "the index is used again";
}

TEST_F(EthercatFrameDirections, Lost_answer_does_not_shift_those_that_follow) {
    EXPECT_EQ(take({.index = 1}, unmarked), "sent");
    EXPECT_EQ(take({.index = 1}, unmarked), "sent");
    EXPECT_EQ(take({.wkc = 1, .index = 1}, marked), "returned 1");
    EXPECT_EQ(take({.wkc = 1, .index = 1}, marked), "returned") << "late: no frame waits for it";
}

TEST_F(EthercatFrameDirections, Frame_waits_for_its_answer_while_64_others_are_sent) {
    EXPECT_EQ(take({.index = 0}, unmarked), "sent");
    for (std::uint8_t index = 1; index <= 64; ++index) {
        EXPECT_EQ(take({.index = index}, unmarked), "sent");
    }
    EXPECT_EQ(take({.wkc = 1, .index = 1}, marked), "returned 1");
    EXPECT_EQ(take({.wkc = 1, .index = 0}, marked), "returned") << "no longer waiting";
}

TEST_F(EthercatFrameDirections, Capture_of_received_frames_only_has_no_sent_ones) {
    EXPECT_EQ(take({.wkc = 1, .index = 1}, marked), "returned");
    EXPECT_EQ(take({.wkc = 3, .index = 2}, marked), "returned");
    EXPECT_EQ(take({.wkc = 1, .index = 1}, marked), "returned");
}

/// Answers of a capture, one datagram per frame.
class EthercatRecordedAnswers : public testing::Test {
protected:
    void record(const Datagram& sent, const Bytes& returned, std::uint16_t wkc = 1) {
        Datagram answer = sent;
        answer.data = returned;
        answer.wkc = wkc;
        frames_.push_back({.bytes = frame_of(sent, unmarked)});
        frames_.push_back({.bytes = frame_of(answer, marked)});
    }
    void record_read(std::uint8_t value) { record({}, {value, 0}); }
    void record_write(std::uint8_t value) { record(write_of(value), {value, 0}); }
    void record_lost(const Datagram& sent) {
        frames_.push_back({.bytes = frame_of(sent, unmarked)});
    }
    static Datagram write_of(std::uint8_t value) {
        return {.command = Command::fpwr, .address = al_control, .data = {value, 0}};
    }

    /// Returns the data of the answer, and keeps its working counter and the unknown datagrams.
    Bytes ask(const Datagram& datagram) {
        if (!answers_) {
            answers_.emplace(frames_);
        }
        Bytes frame = frame_of(datagram, unmarked);
        unknown_ = answers_->answer(frame);
        FrameReader reader(frame);
        const auto d = reader.next();
        wkc_ = d->wkc();
        return {d->data, d->data + d->length};
    }
    unsigned read() { return ask({})[0]; }
    void write(std::uint8_t value) { EXPECT_EQ(ask(write_of(value)), (Bytes{value, 0})); }

    std::vector<Captured> frames_;
    std::optional<RecordedAnswers> answers_;
    std::size_t unknown_ = 0;
    unsigned wkc_ = 0;
};

TEST_F(EthercatRecordedAnswers, Repetition_gets_the_next_answer_and_then_the_last_again) {
    record_read(1);
    record_read(2);
    record_read(3);
    EXPECT_EQ(read(), 1U);
    EXPECT_EQ(wkc_, 1U);
    EXPECT_EQ(read(), 2U);
    EXPECT_EQ(read(), 3U);
    EXPECT_EQ(read(), 3U);
    EXPECT_EQ(answers_->size(), 3U);
}

TEST_F(EthercatRecordedAnswers, Reads_get_no_answer_from_behind_a_write_that_was_not_repeated) {
    record_read(1);
    record_write(4);
    record_read(4);
    record_write(8);
    record_read(8);
    EXPECT_EQ(read(), 1U);
    EXPECT_EQ(read(), 1U);
    write(4);
    EXPECT_EQ(read(), 4U);
    EXPECT_EQ(read(), 4U);
    write(8);
    EXPECT_EQ(read(), 8U);
}

TEST_F(EthercatRecordedAnswers, Write_skips_the_reads_before_it) {
    record_read(1);
    record_read(2);
    record_write(4);
    record_read(4);
    write(4);
    EXPECT_EQ(read(), 4U);
}

TEST_F(EthercatRecordedAnswers, Write_of_other_bytes_gets_the_next_answer_and_moves_nothing) {
    record_read(1);
    record_write(4);
    record_read(4);
    write(9);
    EXPECT_EQ(wkc_, 1U);
    EXPECT_EQ(read(), 1U);
}

TEST_F(EthercatRecordedAnswers, Write_to_another_slave_does_not_bound_reads) {
    record_read(1);
    record({.command = Command::fpwr, .address = at_station(0x1002, 0x0120)}, {0, 0});
    record_read(2);
    EXPECT_EQ(read(), 1U);
    EXPECT_EQ(read(), 2U);
}

TEST_F(EthercatRecordedAnswers, Unknown_datagram_stays_with_the_working_counter_0) {
    record_read(1);
    const Datagram unknown[] = {
        {.command = Command::aprd, .data = {7, 7}},
        {.address = al_control, .data = {7, 7}},
        {.data = {7, 7, 7}},
    };
    for (const Datagram& d : unknown) {
        EXPECT_EQ(ask(d), d.data);
        EXPECT_EQ(wkc_, 0U);
        EXPECT_EQ(unknown_, 1U);
    }
    read();
    EXPECT_EQ(unknown_, 0U);
}

TEST_F(EthercatRecordedAnswers, Lost_answer_is_left_out) {
    record_read(1);
    record_lost({});
    record_read(2);
    EXPECT_EQ(read(), 1U);
    EXPECT_EQ(read(), 2U);
    EXPECT_EQ(answers_->size(), 2U);
}

TEST_F(EthercatRecordedAnswers, Capture_of_received_frames_only_has_no_answers) {
    frames_.push_back({.bytes = frame_of({.wkc = 1}, marked)});
    frames_.push_back({.bytes = frame_of({.wkc = 1}, marked)});
    frames_.push_back({.bytes = Bytes(60, 0xff)});
    EXPECT_EQ(RecordedAnswers(frames_).size(), 0U);
}

TEST_F(EthercatRecordedAnswers, Each_datagram_of_a_frame_gets_its_own_answer) {
    const Datagram clock{.address = at_station(0x1001, 0x0910)};
    Datagram clock_answer = clock;
    clock_answer.data = {5, 6};
    frames_.push_back({.bytes = frame_with({{}, clock}, unmarked)});
    frames_.push_back({.bytes = frame_with({{.data = {4, 0}, .wkc = 1}, clock_answer}, marked)});
    EXPECT_EQ(ask(clock), (Bytes{5, 6}));
    EXPECT_EQ(wkc_, 0U);
    EXPECT_EQ(read(), 4U);
    EXPECT_EQ(wkc_, 1U);
    EXPECT_EQ(answers_->size(), 2U);
}

TEST_F(EthercatRecordedAnswers, Position_of_an_answer_is_that_of_the_capture) {
    const std::uint32_t second = at_position(1, 0x0130);
    const std::uint32_t passed_by_3 = (second & 0xffff0000) | 0x0002;
    frames_.push_back({.bytes = frame_of({.command = Command::aprd, .address = second}, unmarked)});
    frames_.push_back({.bytes = frame_of(
                           {.command = Command::aprd, .address = passed_by_3, .wkc = 1}, marked)});
    RecordedAnswers answers(frames_);
    Bytes frame = frame_of({.command = Command::aprd, .address = second}, unmarked);
    EXPECT_EQ(answers.answer(frame), 0U);
    EXPECT_EQ(FrameReader(frame).next()->position(), 2U);
}

TEST_F(EthercatRecordedAnswers, Bytes_of_process_data_that_no_slave_changed_stay_as_sent) {
    record({.command = Command::lrw, .address = process_data, .data = {1, 0}}, {1, 5}, 3);
    EXPECT_EQ(ask({.command = Command::lrw, .address = process_data, .data = {9, 0}}),
              (Bytes{9, 5}));
    EXPECT_EQ(wkc_, 3U);
}

TEST_F(EthercatRecordedAnswers, Input_equal_to_what_the_master_of_the_capture_sent_is_an_input) {
    const Datagram first{.command = Command::lrw, .address = process_data, .data = {1, 0}};
    const Datagram second{.command = Command::lrw, .address = process_data, .data = {1, 5}};
    record(first, {1, 5}, 3);
    record(second, {1, 5}, 3);  // a master that sends the inputs which it has received
    const Datagram sent{.command = Command::lrw, .address = process_data, .data = {9, 0}};
    EXPECT_EQ(ask(sent), (Bytes{9, 5}));
    EXPECT_EQ(ask(sent), (Bytes{9, 5}));
}

TEST(EthercatRecordedPort, Sent_frames_return_in_order_with_their_answers) {
    const std::vector<Captured> frames{
        {.bytes = frame_of(Datagram{}, unmarked)},
        {.bytes = frame_of({.data = {4, 0}, .wkc = 1}, marked)},
    };
    RecordedPort port("replay:a.pcapng", frames);
    const std::int64_t now_ns = 1'000;
    EXPECT_FALSE(port.receive(now_ns));
    EXPECT_EQ(port.send(frame_of({.index = 7}, unmarked), {}, now_ns), hal::ethernet::Sent::queued);
    EXPECT_EQ(port.send(frame_of({.address = 0, .index = 8}, unmarked), {}, now_ns),
              hal::ethernet::Sent::queued);
    EXPECT_TRUE(port.wait(now_ns));
    const auto known = port.receive(now_ns);
    ASSERT_TRUE(known);
    EXPECT_EQ(known->time_ns, now_ns);
    Bytes bytes(known->bytes.begin(), known->bytes.end());
    EXPECT_EQ(bytes, frame_of({.data = {4, 0}, .wkc = 1, .index = 7}, unmarked));
    const auto unknown = port.receive(now_ns);
    ASSERT_TRUE(unknown);
    bytes.assign(unknown->bytes.begin(), unknown->bytes.end());
    EXPECT_EQ(bytes, frame_of({.address = 0, .index = 8}, unmarked));
    EXPECT_FALSE(port.receive(now_ns));
    EXPECT_EQ(port.statistics().sent, 2U);
    EXPECT_EQ(port.statistics().received, 2U);
    EXPECT_EQ(port.statistics().errors, 1U) << "datagrams without answer";
}

TEST(EthercatRecordedPort, Other_frames_are_rejected_and_a_full_queue_drops) {
    RecordedPort port("replay:a.pcapng", {});
    EXPECT_EQ(port.send(Bytes(60, 0xff), {}, 0), hal::ethernet::Sent::rejected);
    EXPECT_FALSE(port.receive(0));
    const Bytes frame = frame_of(Datagram{}, unmarked);
    while (port.send(frame, {}, 0) == hal::ethernet::Sent::queued) {
    }
    EXPECT_EQ(port.send(frame, {}, 0), hal::ethernet::Sent::full);
    EXPECT_EQ(port.statistics().sent, 64U);
    EXPECT_EQ(port.statistics().dropped, 3U);
}

}  // namespace
