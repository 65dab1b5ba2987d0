// SPDX-License-Identifier: MIT
// The edit of a session's open transaction, from its first command until it has taken effect in
// the threads or is rolled back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "machine/load/elaborate.hpp"
#include "machine/run/commit_checks.hpp"
#include "machine/run/execution_sink.hpp"
#include "machine/run/thread_plans.hpp"
#include "model/edit.hpp"
#include "text/diagnostic.hpp"

namespace hal {

struct SessionState;

/// There is one for each session; most of the time no transaction is open. [setup]
class OpenTransaction {
public:
    explicit OpenTransaction(SessionState& state) : state_(state) {}

    bool is_open() const { return open_; }
    /// Throws std::logic_error while another one is open.
    void begin();
    /// What the open transaction has edited; nullptr before its first edit.
    const Edit* edit() const { return edit_.get(); }
    /// The same, made by its first edit; the next problems go to `diagnostics`.
    Edit& editing(Diagnostics& diagnostics);
    std::vector<AutoOrder>& auto_orders() { return auto_orders_; }
    void count_command() { ++commands_; }
    /// Adds the words of a command to what the journal of the execution gets at the commit.
    void note(std::vector<std::string> words) { words_.push_back(std::move(words)); }
    /// As Transaction::when_committed().
    void when_committed(std::function<void()> action) { actions_.push_back(std::move(action)); }
    /// It does not take effect while a thread hangs.
    void need_threads() { needs_threads_ = true; }

    /// Ends the transaction: makes it take effect, or rolls it back. False after reporting.
    bool commit(Diagnostics& diagnostics);
    /// Ends the transaction as a commit() that is rejected when its instances have been started.
    void start_and_reject(Diagnostics& diagnostics);
    /// Ends the transaction and undoes it.
    void roll_back();
    /// Undoes what the open transaction has edited; its end does nothing more.
    void abandon();

    /// Reports that there is no memory left, and makes some.
    void out_of_memory(Diagnostics& diagnostics);

private:
    JournaledTransaction journaled(std::uint64_t epoch);
    void journal(std::uint64_t epoch) noexcept;
    bool carry_out(Diagnostics& diagnostics);
    bool carry_out_checked(Diagnostics& diagnostics);
    bool start_added(Diagnostics& diagnostics);
    void withdraw(Diagnostics* diagnostics, std::uint64_t epoch);
    void journal_withdrawal(std::uint64_t epoch, bool is_undone) noexcept;
    void journal_rejection(std::uint64_t epoch) noexcept;
    bool restore_threads(Diagnostics& diagnostics);
    void close_edit();
    void forget_edit();

    SessionState& state_;
    bool open_ = false;
    bool starts_ = false;  // its instances have been started
    bool is_rejected_ = false;  // by start_and_reject()
    std::unique_ptr<Edit> edit_;
    std::vector<std::function<void()>> actions_;
    bool needs_threads_ = false;
    std::vector<AutoOrder> auto_orders_;
    std::size_t commands_ = 0;
    std::vector<std::vector<std::string>> words_;
    /// threads may have been made, ended or given a plan
    bool touched_ = false;
    EarlierValues before_;
    CommitChecks checks_;
    /// freed when memory has run out, so that undoing has some
    std::unique_ptr<char[]> reserve_;
};

}  // namespace hal
