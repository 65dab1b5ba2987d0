// SPDX-License-Identifier: MIT
// Journaled links give their user the same results again, and open nothing.
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstring>
#include <optional>
#include <semaphore>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "can/journal/journaled_link.hpp"
#include "can/journal/ordered_link.hpp"
#include "ethernet/journal/journaled_port.hpp"
#include "ethernet/journal/ordered_port.hpp"
#include "link/call_journal.hpp"
#include "link/call_order.hpp"
#include "link/datagram.hpp"
#include "link/ordered_hold.hpp"
#include "link/segment.hpp"

namespace hal::test {
namespace {

/// In the place of the program with journals.
struct FakeJournal {
    int mode = 0;
    std::string data;
    std::size_t at = 0;
    bool hidden = false;
    std::string differing;
    std::uint64_t tickets = 0;
    std::vector<std::uint64_t> waited;
};
FakeJournal journal;
std::atomic<unsigned> yields{0};

}  // namespace
}  // namespace hal::test

using hal::test::journal;
using hal::test::yields;

extern "C" {
int hal_journal_mode() noexcept { return journal.mode; }
void hal_journal_put(const void* bytes, std::size_t size) noexcept {
    journal.data.append(static_cast<const char*>(bytes), size);
}
int hal_journal_get(void* bytes, std::size_t size) noexcept {
    const bool has = size <= journal.data.size() - journal.at;
    std::memset(bytes, 0, size);
    if (has) {
        std::memcpy(bytes, journal.data.data() + journal.at, size);
        journal.at += size;
    }
    return has ? 1 : 0;
}
void hal_journal_differs(const char* link) noexcept { journal.differing = link; }
int hal_journal_hide(int hidden) noexcept {
    return std::exchange(journal.hidden, hidden != 0) ? 1 : 0;
}
void hal_journal_order() noexcept {
    std::uint64_t ticket = journal.tickets++;
    if (journal.mode == 1) return hal_journal_put(&ticket, sizeof ticket);
    hal_journal_get(&ticket, sizeof ticket);
    journal.waited.push_back(ticket);
}
void hal_journal_link(int) noexcept {}

/// In the place of that of the system.
int sched_yield() noexcept {
    ++yields;
    return static_cast<int>(syscall(SYS_sched_yield));
}
}

namespace hal::test {
namespace {

/// Calls `use` once recording, and then with what was recorded. Returns the tickets of the second
/// time.
template <class Use>
std::vector<std::uint64_t> twice(Use use) {
    journal = {};
    journal.mode = 1;
    use(false);
    EXPECT_FALSE(journal.hidden) << "readings stay hidden";
    journal.mode = 2;
    journal.tickets = 0;
    use(true);
    EXPECT_EQ(journal.at, journal.data.size()) << "results are left";
    return std::exchange(journal, {}).waited;
}

/// A CAN link that gives other results in each call.
struct ChangingLink final : can::Link {
    can::Description about{.address = "test:1", .transport = "a test", .bit_rate = 500'000};
    std::uint8_t calls = 0;

    can::Sent send(const can::Frame&, std::int64_t) noexcept override {
        return ++calls == 1 ? can::Sent::queued : can::Sent::full;
    }
    void flush(std::int64_t) noexcept override {}
    std::size_t receive(std::span<can::Frame> frames, std::int64_t now_ns) noexcept override {
        ++calls;
        frames[0] = can::Frame(0x181, {1, calls});
        frames[0].data[7] = 9;  // behind its data
        frames[0].time_ns = now_ns - 1234;
        frames[1] = can::Frame(0x12345678, {});
        frames[1].length = 0;
        frames[1].own = true;
        frames[1].time_ns = now_ns + 5;
        return 2;
    }
    can::Statistics statistics() const noexcept override {
        can::Statistics s;
        s.state = can::State::passive;
        s.lost = std::uint64_t{1} << 40;
        s.load = 0.25;
        return s;
    }
    can::State state() const noexcept override { return can::State::bus_off; }
    bool set_filters(std::span<const can::Filter>) override { return true; }
    const can::Description& description() const noexcept override { return about; }
    std::vector<can::DeliveryTime> delivery_times() const override {
        return {{"x", 1000, -7, 1, 2, 3}};
    }
    bool wait(std::int64_t) override { return true; }
    bool rejected(can::Rejected& report) noexcept override {
        report = {can::Rejected::Why::wrong_tag, 0x80, 0xabcdef, 4};
        return true;
    }
};

/// Everything that the link gives, as text.
std::string all_of(can::Link& link) {
    constexpr std::int64_t now_ns = 1'000'000'000'000;
    std::string text = link.description().address + " " + link.description().transport + " " +
                       std::to_string(link.description().bit_rate);
    for (int i = 0; i < 2; ++i) {
        text += std::string(" ") + can::to_string(link.send(can::Frame(0x201, {5}), now_ns));
    }
    link.flush(now_ns);
    std::array<can::Frame, 4> frames;
    const std::size_t count = link.receive(frames, now_ns);
    for (const can::Frame& frame : std::span(frames).first(count)) {
        text += " " + std::to_string(frame.id) + (frame.extended ? "x" : "") +
                (frame.own ? "own" : "") + " at " + std::to_string(frame.time_ns);
        for (const std::uint8_t byte : frame.data) {
            text += " " + std::to_string(byte);
        }
    }
    const can::Statistics s = link.statistics();
    text += std::string(" ") + can::to_string(s.state) + " " + std::to_string(s.lost) + " " +
            std::to_string(s.load) + " " + can::to_string(link.state());
    for (const can::DeliveryTime& time : link.delivery_times()) {
        text += " " + time.station + std::to_string(time.there_ns) + " " +
                std::to_string(time.back_ns) + " " + std::to_string(time.round_trip);
    }
    can::Rejected report;
    text += link.rejected(report) ? " " + can::to_string(report) : " none";
    return text + (link.wait(0) ? " waited" : "") + (link.set_filters({}) ? " set" : "");
}

TEST(JournaledLink, Gives_all_results_again_without_opening_a_link) {
    std::vector<std::string> texts;
    twice([&texts](bool again) {
        auto opened = can::journal::open_journaled([again]() -> can::Opened {
            if (again) throw std::logic_error("a link is opened");
            return {std::make_unique<ChangingLink>(), {}};
        });
        ASSERT_TRUE(opened) << opened.problem;
        texts.push_back(all_of(*opened.link));
    });
    ASSERT_EQ(texts.size(), 2u);
    EXPECT_EQ(texts[0], texts[1]);
    EXPECT_NE(texts[0].find("queued full 385 at 999999998766 1 3 0 0 0 0 0 0 "), std::string::npos)
        << texts[0];
    EXPECT_NE(texts[0].find("signed with another key"), std::string::npos) << texts[0];
}

TEST(JournaledLink, Fails_to_open_as_it_did) {
    std::vector<std::string> problems;
    const auto open = []() -> can::Opened { return {nullptr, "no such interface"}; };
    twice([&](bool) { problems.push_back(can::journal::open_journaled(open).problem); });
    EXPECT_EQ(problems, (std::vector<std::string>{"no such interface", "no such interface"}));
    journal.mode = 2;
    EXPECT_EQ(can::journal::open_journaled(open).problem, "the journal does not have this link");
    journal = {};
}

TEST(JournaledLink, Reports_that_other_frames_are_sent) {
    for (const bool differs : {false, true}) {
        std::string differing;
        twice([&](bool again) {
            auto opened = can::journal::open_journaled(
                []() -> can::Opened { return {std::make_unique<ChangingLink>(), {}}; });
            can::Frame frame(0x201, {1, 2, 3});
            if (again && differs) {
                frame.data[2] = 4;
            }
            opened.link->send(frame, 0);
            opened.link->flush(0);
            opened.link->flush(0);
            differing = journal.differing;
        });
        EXPECT_EQ(differing, differs ? "test:1" : "");
    }
}

struct ChangingPort final : ethernet::Port {
    ethernet::Address own{2, 0, 0, 0, 0, 7};
    ethernet::Description about{.address = "test:eth", .transport = "a test", .paced = true};
    std::vector<std::uint8_t> frame;

    const ethernet::Address& address() const noexcept override { return own; }
    ethernet::Sent send(std::span<const std::uint8_t>, const ethernet::Launch&,
                        std::int64_t) noexcept override {
        return ethernet::Sent::late;
    }
    std::optional<ethernet::Arrival> receive(std::int64_t now_ns) noexcept override {
        if (frame.size() > 2000) return std::nullopt;
        frame.resize(frame.size() + 999, static_cast<std::uint8_t>(frame.size() / 999 + 1));
        return ethernet::Arrival{frame, now_ns - 77};
    }
    bool wait(std::int64_t) noexcept override { return true; }
    ethernet::Statistics statistics() const noexcept override {
        ethernet::Statistics s;
        s.up = false;
        s.launch_error_ns = -5;
        s.departure_ns = 123'456'789'012;
        return s;
    }
    const ethernet::Description& description() const noexcept override { return about; }
};

TEST(JournaledPort, Gives_all_results_again_without_opening_a_port) {
    std::vector<std::string> texts;
    twice([&texts](bool again) {
        auto opened = ethernet::journal::open_journaled([again]() -> ethernet::Opened {
            if (again) throw std::logic_error("a port is opened");
            return {std::make_unique<ChangingPort>(), {}};
        });
        ASSERT_TRUE(opened) << opened.problem;
        ethernet::Port& port = *opened.port;
        std::string text = ethernet::to_string(port.address()) + port.description().transport;
        const std::vector<std::uint8_t> frame(60);
        text += ethernet::to_string(port.send(frame, {}, 5));
        while (const auto arrival = port.receive(1000)) {
            text += " " + std::to_string(arrival->time_ns) + ":" +
                    std::string(arrival->bytes.begin(), arrival->bytes.end());
        }
        const ethernet::Statistics s = port.statistics();
        text += std::to_string(s.up) + std::to_string(s.launch_error_ns) +
                std::to_string(s.departure_ns) + (port.wait(0) ? " waited" : "") +
                (port.description().paced ? " paced" : "");
        texts.push_back(text);
    });
    ASSERT_EQ(texts.size(), 2u);
    EXPECT_EQ(texts[0], texts[1]);
    EXPECT_GT(texts[0].size(), 5994u);
}

TEST(JournaledPort, Reports_that_another_frame_is_sent) {
    for (const bool differs : {false, true}) {
        std::string differing;
        twice([&](bool again) {
            auto opened = ethernet::journal::open_journaled(
                []() -> ethernet::Opened { return {std::make_unique<ChangingPort>(), {}}; });
            std::vector<std::uint8_t> frame(61);
            frame[60] = again && differs ? 1 : 0;
            opened.port->send(frame, {}, 0);
            differing = journal.differing;
        });
        EXPECT_EQ(differing, differs ? "test:eth" : "");
    }
}

TEST(OrderedPort, Answers_frames_within_the_call_of_their_sender) {
    struct Echo final : ethernet::Responder {
        ethernet::Port* port = nullptr;
        void arrived(std::span<std::uint8_t> frame, std::int64_t first_bit_ns) noexcept override {
            port->send(frame, {.at_ns = first_bit_ns}, first_bit_ns);
        }
    };
    std::vector<std::int64_t> arrivals;
    twice([&arrivals](bool) {
        const auto port_of = [](const std::string& station) {
            const std::string name = "ordered-port/" + station;
            return ethernet::journal::open_ordered(
                name, [&name] { return ethernet::open("sim:" + name); });
        };
        auto master = port_of("master");
        auto slave = port_of("slave");
        ASSERT_TRUE(master && slave) << master.problem << slave.problem;
        Echo echo;
        echo.port = slave.port.get();
        ASSERT_TRUE(slave.port->segment()->respond(&echo));
        std::vector<std::uint8_t> frame(60, 0xff);
        EXPECT_EQ(master.port->send(frame, {}, 1'000'000), ethernet::Sent::queued);
        const auto arrival = master.port->receive(2'000'000);
        arrivals.push_back(arrival ? arrival->time_ns : 0);
        slave.port->segment()->respond(nullptr);
    });
    ASSERT_EQ(arrivals.size(), 2u);
    EXPECT_GT(arrivals[0], 1'000'000);
    EXPECT_EQ(arrivals[0], arrivals[1]);
}

TEST(OrderedLink, Waits_for_the_tickets_of_its_calls) {
    std::vector<std::size_t> received;
    const std::vector<std::uint64_t> waited = twice([&received](bool) {
        const auto open = [] {
            return can::open("sim:ordered-link", {.bit_rate = can::unlimited});
        };
        auto first = can::journal::open_ordered("ordered-link", open);
        auto second = can::journal::open_ordered("ordered-link?fd", open);
        ASSERT_TRUE(first && second) << first.problem << second.problem;
        first.link->send(can::Frame(0x123, {1}), 1000);
        first.link->flush(1000);
        std::array<can::Frame, 4> frames;
        received.push_back(second.link->receive(frames, 2000));
    });
    EXPECT_EQ(received, (std::vector<std::size_t>{1, 1}));
    // two openings, three calls, two closings
    EXPECT_EQ(waited, (std::vector<std::uint64_t>{0, 1, 2, 3, 4, 5, 6}));
}

/// Another thread that has a bus until this is destroyed.
class BusHolder {
public:
    explicit BusHolder(link::CallOrder& order)
        : thread_([this, &order] {
              const link::OrderedCall call(order, link::OrderedCall::Wait::made);
              has_it_.release();
              ends_.acquire();
          }) {
        has_it_.acquire();
    }
    ~BusHolder() {
        ends_.release();
        thread_.join();
    }

private:
    std::binary_semaphore has_it_{0}, ends_{0};
    std::thread thread_;
};

TEST(OrderedLink, Keeps_frames_while_another_thread_has_the_bus) {
    std::vector<std::string> texts;
    twice([&texts](bool again) {
        const auto order = link::CallOrder::of("can", "sim:held-bus");
        const auto open = [] { return can::open("sim:held-bus", {.bit_rate = can::unlimited}); };
        auto sender = can::journal::open_ordered("sim:held-bus", open);
        auto receiver = can::journal::open_ordered("sim:held-bus", open);
        ASSERT_TRUE(sender && receiver) << sender.problem << receiver.problem;
        std::array<can::Frame, 4> frames;
        const auto receive = [&] { return receiver.link->receive(frames, 5000); };
        std::string text;
        std::optional<BusHolder> holder;
        if (!again) {
            holder.emplace(*order);
        } else {  // the holder's own call
            const link::OrderedCall call(*order, link::OrderedCall::Wait::made);
        }
        text += can::to_string(sender.link->send(can::Frame(0x101, {1}), 1000));
        sender.link->flush(1000);
        text += std::to_string(receive());
        text += can::to_string(sender.link->state());
        text += std::to_string(sender.link->statistics().sent);
        holder.reset();
        text += can::to_string(sender.link->send(can::Frame(0x102, {2}), 2000));
        sender.link->flush(2000);
        text += std::to_string(receive());
        text += " " + std::to_string(frames[0].id) + " " + std::to_string(frames[1].id) + " " +
                std::to_string(sender.link->statistics().sent);
        texts.push_back(text);
    });
    ASSERT_EQ(texts.size(), 2u);
    EXPECT_EQ(texts[0], "queued0active0queued2 257 258 2");
    EXPECT_EQ(texts[1], texts[0]);
}

TEST(OrderedHold, Gives_the_outcome_of_each_try_back_and_orders_the_calls_within) {
    using link::OrderedHold;
    std::vector<std::string> texts;
    const std::vector<std::uint64_t> waited = twice([&texts](bool again) {
        std::atomic_flag flag;
        const auto order = link::CallOrder::of("can", "sim:held-flag");
        std::string text;
        const auto attempt = [&] {
            const OrderedHold hold(flag, OrderedHold::Wait::none);
            if (!hold.is_held()) return text += "in use ";
            const link::OrderedCall call(*order, link::OrderedCall::Wait::bounded);
            return text += call.is_made() ? "called " : "not called ";
        };
        attempt();
        if (!again) {
            flag.test_and_set();  // by another thread
        }
        attempt();
        flag.clear();
        attempt();
        const OrderedHold in_setup(flag, OrderedHold::Wait::made);
        text += in_setup.is_held() ? "held" : "not held";
        texts.push_back(text);
    });
    ASSERT_EQ(texts.size(), 2u);
    EXPECT_EQ(texts[0], "called in use called held");
    EXPECT_EQ(texts[1], texts[0]);
    // the two that were held, each with a call, and the one in setup
    EXPECT_EQ(waited, (std::vector<std::uint64_t>{0, 1, 2, 3, 4}));
}

/// A card that does not answer.
struct SilentCard final : datagram::Server {
    int requests = 0;
    void serve(std::span<const std::uint8_t>, std::int64_t, datagram::Replies&) noexcept override {
        ++requests;
    }
};

/// A stop that is executed again.
struct JournaledDatagram : testing::Test {
    void SetUp() override {
        ASSERT_TRUE(opened) << opened.problem;
        yields = 0;
        journal = {};
        journal.mode = 2;
    }

    SilentCard card;
    decltype(datagram::attach("", card)) attached = datagram::attach("sim:stopped", card);
    decltype(datagram::open("")) opened = datagram::open("sim:stopped");
    const std::array<std::uint8_t, 4> request{};
};

TEST_F(JournaledDatagram, A_stop_that_the_journal_does_not_have_does_not_wait) {
    EXPECT_FALSE(opened.port->send(request, datagram::unclocked));
    EXPECT_EQ(0U, yields);
    EXPECT_FALSE(journal.hidden);
    journal = {};
    EXPECT_TRUE(opened.port->send(request, datagram::unclocked));
    EXPECT_EQ(1, card.requests);
}

TEST_F(JournaledDatagram, A_stop_while_the_card_was_busy_is_executed_with_the_same_tries) {
    journal.data = std::string("\0\0\1", 3) + std::string(sizeof(std::uint64_t), '\7');
    EXPECT_TRUE(opened.port->send(request, datagram::unclocked));
    EXPECT_EQ(journal.data.size(), journal.at);
    EXPECT_EQ(1U, journal.waited.size());
    EXPECT_EQ(0U, yields);
    EXPECT_EQ(1, card.requests);
    journal = {};
}

}  // namespace
}  // namespace hal::test
