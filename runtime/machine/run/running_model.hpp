// SPDX-License-Identifier: MIT
// A model that threads run, as its parts: the model and its transactions, the threads, the values,
// the plugin host and the reports. A Session is one with programs.
//
// Every member and every member of its parts is [setup] and is called with lock() held, unless it
// is marked otherwise.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <vector>

#include "machine/load/plugin_host.hpp"
#include "machine/report/event_log.hpp"
#include "machine/report/reports.hpp"
#include "machine/report/traces.hpp"
#include "machine/run/live_values.hpp"
#include "machine/run/probes.hpp"
#include "machine/run/thread_control.hpp"
#include "machine/run/transaction.hpp"
#include "model/absence.hpp"
#include "model/model.hpp"
#include "netlist/netlist.hpp"
#include "text/diagnostic.hpp"

namespace hal {

struct SessionState;

class CycleSchedule;
class ExecutionSink;
class ExitObserver;

struct SessionOptions {
    std::string name = "default";  ///< of the instance; its control socket carries it
    bool virtual_clock = false;  ///< `hal sim`: threads run only in ThreadControl::advance_ns()
    bool check_only = false;  ///< `hal check`: construct, but start nothing
    bool hardware_allowed = true;  ///< false, as in an editor: constructors access no hardware
    /// virtual clock: how long, in wall time, a command waits for a program; 0: without limit
    std::int64_t wait_limit_ns = 0;
    /// Longest gap without CPU that is reported and does not stop a thread: without a real-time
    /// policy, and with one.
    std::int64_t max_gap_ns = 0;
    std::int64_t max_gap_realtime_ns = 0;
    std::vector<std::string> plugin_path;  ///< searched first
    /// what the command line loads, as it was typed; the control socket names it
    std::vector<std::string> files;
    /// made before the session, and outlives it; nullptr: none
    ExitObserver* observer = nullptr;
    /// outlives the session; nullptr: the execution has no journal
    ExecutionSink* sink = nullptr;
    /// outlives the session: the cycles of a journal are executed again; with virtual_clock
    CycleSchedule* schedule = nullptr;
};

/// Groups of commands that the `lock` command locks; LinuxCNC's names and bits.
enum class Lock : unsigned {
    none = 0,
    load = 1,
    config = 2,
    params = 4,
    run = 8,
    tune = 3,
    all = 255
};

/// Exclusive access to a session; a command that waits releases it meanwhile.
using SessionLock = std::unique_lock<std::mutex>;

class RunningModel {
public:
    RunningModel(const RunningModel&) = delete;

    /// Waits for exclusive access to the session. Not recursive. [any]
    [[nodiscard]] SessionLock lock() const { return SessionLock(mutex_); }
    /// The same without waiting: the result owns nothing while another thread has access. [any]
    [[nodiscard]] SessionLock try_lock() const { return {mutex_, std::try_to_lock}; }

    /// Opens the transaction. Throws std::logic_error while another one is open. Values, model and
    /// reports show the machine with the edits made so far.
    Transaction begin();
    bool in_transaction() const;
    /// As Transaction::when_committed(), for what is destroyed at the end of the open transaction.
    /// Forgotten when none is open.
    void when_committed(std::function<void()> action);
    /// Offers the names of the model to diagnostics about unknown ones. To be called before
    /// Diagnostics::look_up(), which needs no lock.
    void offer_names(Diagnostics& diagnostics);
    /// Frees texts of `sources` that nothing refers to any more, when that is worth the time. Not
    /// while a transaction is open.
    void sweep_texts() noexcept;
    /// Interrupts what other threads do with this session: the commands of a text end at the next
    /// line, and queries end early. Used before shut_down(), which would wait for them. [any]
    void interrupt() noexcept { ending_.request_stop(); }
    /// after interrupt() [any]
    bool ending() const noexcept { return ending_.stop_requested(); }
    /// The same for long work that does not know the session: it is requested to stop by
    /// interrupt(). [any]
    std::stop_token end_token() const noexcept { return ending_.get_token(); }
    /// Rolls back an open transaction, stops the threads with safe outputs, and stops and destroys
    /// all instances. Idempotent.
    void shut_down();
    /// Returns the instances that have raised a fault while they were stopped or destroyed: what
    /// they drive may not have stopped.
    const std::vector<std::string>& failed_stops() const;

    const SessionOptions& options() const;
    const Model& model() const;
    /// What `hal check` knows to exist elsewhere or could not read, and the lines that depend on
    /// it.
    Absences& absences();

    ThreadControl& threads() { return threads_; }
    const ThreadControl& threads() const { return threads_; }
    LiveValues& values() { return values_; }
    Probes& probes();
    EventLog& event_log();
    Traces& traces();
    Reports& reports() { return reports_; }
    const Reports& reports() const { return reports_; }
    const PluginHost& host() const { return host_; }

    Sources sources;  ///< the texts that spans of the model refer to
    Ini ini;  ///< values of [SECTION]KEY
    /// may be read without the session's lock; command groups that are locked: bits of Lock
    std::atomic<unsigned> locked{0};

protected:
    /// Prepares the process for real time unless the clock is virtual or nothing is to run.
    explicit RunningModel(SessionOptions options);
    /// Takes the lock and calls shut_down().
    ~RunningModel();
    SessionState& state() { return *state_; }

private:
    friend class Transaction;
    mutable std::mutex mutex_;
    std::stop_source ending_;
    std::unique_ptr<SessionState> state_;
    ThreadControl threads_;
    LiveValues values_;
    Reports reports_;
    PluginHost host_;
};

}  // namespace hal
