// SPDX-License-Identifier: MIT
// The only way to change the model of a machine: one atomic edit.
#pragma once

#include <functional>
#include <span>
#include <utility>

#include "netlist/netlist.hpp"
#include "netlist/usage.hpp"
#include "text/diagnostic.hpp"

namespace hal {

class RunningModel;
struct Elaboration;

/// How an edit is written and what carries it out: from its row of the command table.
struct EditForm {
    Usage usage;
    void (*elaborate)(Elaboration& on, std::span<const Token> args);
    bool arrows = false;  ///< arrows may stand among its arguments and are not counted
};

/// The open transaction of a machine, made by RunningModel::begin(). There is at most one at a
/// time, and its owner holds the machine's lock. Destruction rolls back. [setup]
class Transaction {
public:
    Transaction(Transaction&& other) noexcept : machine_(std::exchange(other.machine_, nullptr)) {}
    Transaction& operator=(Transaction&&) = delete;
    ~Transaction() { roll_back(); }

    /// Elaborates one command, whose names of several things stand for a command each, by the form
    /// of its row in the command table. Problems, among them a wrong number of arguments, go to
    /// `diagnostics`.
    void apply(const EditForm& form, const Command& command, Diagnostics& diagnostics);
    /// Queues an action that commit() carries out right after the edits have taken effect, in the
    /// order of these calls. A transaction that is rolled back forgets it. The action may begin a
    /// transaction of its own.
    void when_committed(std::function<void()> action);
    RunningModel& machine() { return *machine_; }
    /// It is rejected when a thread hangs at the commit: what is done then needs its answer.
    void needs_threads();
    /// Ends the transaction: checks, starts new instances, compiles, swaps and returns true; or
    /// reports and rolls back everything. With any error already in `diagnostics` it rolls back.
    /// Throws std::logic_error when the transaction has ended before.
    bool commit(Diagnostics& diagnostics);
    /// Ends the transaction as a commit() that is rejected when its instances have been started.
    void start_and_reject(Diagnostics& diagnostics);
    /// Ends the transaction and undoes everything. Does nothing when it has ended before.
    void roll_back();

private:
    friend class RunningModel;
    explicit Transaction(RunningModel& machine) : machine_(&machine) {}
    RunningModel* machine_;  ///< nullptr: it has ended
};

}  // namespace hal
