// SPDX-License-Identifier: MIT
// What setup calls of components got from outside, recorded and given back.
#include <deque>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "machine/load/setup_call.hpp"
#include "machine/run/execution_sink.hpp"
#include "machine/run/setup_journal.hpp"

namespace hal::test {
namespace {

/// What one call got, from the journal that records to the schedule that gives back.
struct Results final : ExecutionSink, CycleSchedule {
    std::deque<SetupResults> calls;
    std::vector<SetupFile> files;

    void called(const SetupResults& results) override { calls.push_back(results); }
    void file_read(const SetupFile& file) override { files.push_back(file); }
    CycleInputs* thread_made(const std::string&, std::int64_t, std::uint32_t) override {
        return nullptr;
    }
    void edited(JournaledTransaction, const Model&) override {}
    void withdrawn(JournaledTransaction) override {}
    void rejected(JournaledTransaction) override {}
    void written(std::vector<std::pair<std::string, std::uint64_t>>) override {}
    void switched(bool) override {}
    void halted() noexcept override {}
    std::string save(const std::string&) override { return ""; }
    void opened(const std::string&, const std::string&, const OutsideWorld&) override {}

    CycleInputs& inputs_of(std::uint32_t) override { throw std::logic_error("no thread"); }
    void begin(Core&) override {}
    void end(Core&) override {}
    bool step() override { return false; }
    std::int64_t now_ns() const override { return 0; }
    std::optional<SetupResults> results_of(const std::string& call) override {
        if (calls.empty() || calls.front().call != call) return std::nullopt;
        SetupResults results = std::move(calls.front());
        calls.pop_front();
        return results;
    }
};

TEST(SetupJournal, Gives_back_readings_of_clocks_of_calls_that_took_effect) {
    Results results;
    std::vector<std::int64_t> times;
    {
        SetupJournal journal(nullptr);
        {
            const SetupCall call("x", "test", "start");
            times.push_back(journal.reading(17));
            journal.hide_readings(true);
            journal.reading(18);
            journal.hide_readings(false);
        }
        journal.forget();  // the transaction was rejected
        {
            const SetupCall call("x", "test", "start");
            times.push_back(journal.reading(19));
        }
        journal.flush(results);
    }
    ASSERT_EQ(results.calls.size(), 1u);
    SetupJournal journal(&results);
    const SetupCall call("x", "test", "start");
    times.push_back(journal.reading(20));
    times.push_back(journal.reading(21));
    EXPECT_EQ(times, (std::vector<std::int64_t>{17, 19, 19, 21}));
}

}  // namespace
}  // namespace hal::test
