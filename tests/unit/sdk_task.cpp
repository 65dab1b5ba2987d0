// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <vector>

#include "hal/task.hpp"

namespace {

/// Asks for a number and waits until reply() brings it.
class Asker : public hal::TaskChannel {
public:
    explicit Asker(std::size_t bytes = 4096) : TaskChannel(bytes) {}

    struct Reply {
        Asker& asker;
        bool await_ready() const noexcept { return false; }
        void await_suspend(std::coroutine_handle<> task) const noexcept { asker.suspend(task); }
        int await_resume() const noexcept { return asker.value_; }
    };
    Reply ask(int what) noexcept {
        asked.push_back(what);
        return {*this};
    }
    void reply(int value) noexcept {
        value_ = value;
        resume();
    }
    hal::Task<> add_two(int& sum) noexcept {
        sum += co_await ask(1);
        sum += co_await ask(2);
    }

    std::vector<int> asked;

private:
    int value_ = 0;
};

struct Guard {
    bool& released;
    ~Guard() { released = true; }
};

hal::Task<int> twice(Asker& asker, int what) noexcept {
    const int value = co_await asker.ask(what);
    co_return 2 * value;
}

hal::Task<> sum_of_two(Asker& asker, int& sum) noexcept {
    const int first = co_await twice(asker, 10);
    const int second = co_await twice(asker, 20);
    sum = first + second;
}

hal::Task<> guarded(Asker& asker, bool& released) noexcept {
    const Guard guard{released};
    co_await asker.ask(0);
    co_await asker.ask(1);
}

}  // namespace

TEST(Task, Runs_up_to_its_first_wait_and_continues_with_each_answer) {
    Asker asker;
    int sum = 0;
    asker.start([&] { return sum_of_two(asker, sum); });
    EXPECT_TRUE(asker.busy());
    EXPECT_EQ(asker.asked, (std::vector<int>{10}));
    asker.reply(1);
    EXPECT_EQ(asker.asked, (std::vector<int>{10, 20}));
    EXPECT_EQ(sum, 0);
    asker.reply(2);
    EXPECT_FALSE(asker.busy());
    EXPECT_EQ(sum, 6);
}

TEST(Task, Finds_its_memory_in_the_object_whose_member_it_is) {
    Asker asker;
    int sum = 0;
    asker.start([&] { return asker.add_two(sum); });
    asker.reply(3);
    asker.reply(4);
    EXPECT_FALSE(asker.busy());
    EXPECT_EQ(sum, 7);
    EXPECT_GT(asker.task_memory().max_used(), 0U);
}

TEST(Task, Ends_where_it_waits_when_its_channel_is_stopped_or_starts_another) {
    Asker asker;
    bool first = false;
    bool second = false;
    asker.start([&] { return guarded(asker, first); });
    asker.reply(0);
    asker.start([&] { return guarded(asker, second); });
    EXPECT_TRUE(first);
    EXPECT_FALSE(second);
    asker.stop();
    EXPECT_TRUE(second);
    EXPECT_FALSE(asker.busy());
}

TEST(Task, Uses_the_same_memory_again) {
    Asker asker;
    int sum = 0;
    std::size_t used = 0;
    for (int i = 0; i < 100; ++i) {
        asker.start([&] { return sum_of_two(asker, sum); });
        asker.reply(0);
        asker.reply(0);
        if (i == 0) {
            used = asker.task_memory().max_used();
        }
    }
    EXPECT_EQ(asker.task_memory().max_used(), used);
}

TEST(TaskMemory, Returns_the_newest_frame_only) {
    hal::TaskMemory memory(64);
    void* first = memory.take(8);
    void* second = memory.take(20);
    EXPECT_EQ(memory.max_used(), 48U);
    memory.give_back(second, 20);
    memory.give_back(first, 8);
    EXPECT_EQ(memory.take(8), first);
    EXPECT_EQ(memory.size(), 64U);
}

TEST(TaskMemory, Ends_the_program_when_a_frame_is_returned_before_a_newer_one) {
    hal::TaskMemory memory(64);
    void* first = memory.take(8);
    memory.take(8);
    EXPECT_DEATH(memory.give_back(first, 8), "");
    EXPECT_DEATH(memory.give_back(first, 100), "");
}

TEST(Task, Ends_the_program_when_the_chain_of_tasks_is_deeper_than_its_memory) {
    EXPECT_DEATH(
        {
            Asker asker(32);
            int sum = 0;
            asker.start([&] { return sum_of_two(asker, sum); });
        },
        "");
}
