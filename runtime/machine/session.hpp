// SPDX-License-Identifier: MIT
// One running machine: the model, the plugins, the threads, and edits as transactions (docs/design.md).
// Only the shell, the tools and tests use it. Every member is [setup] and may be called from any one thread at a time
// (callers hold Session::mutex).
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "text/diagnostic.hpp"
#include "model/model.hpp"
#include "netlist/netlist.hpp"
#include "machine/declared.hpp"
#include "machine/transaction.hpp"

namespace hal {

class Executor;

struct SessionOptions {
    std::string name = "default";    ///< of the instance; its control socket carries it
    bool virtual_clock = false;      ///< `hal sim`: threads run only in advance()
    bool check_only = false;         ///< `hal check`: construct, but start nothing
    std::vector<std::string> plugin_path;  ///< searched first
};

/// One value read from the running machine.
struct Reading {
    hal_type type = HAL_TYPE_BIT;
    hal_value value{};
};

/// A pin or parameter of a component that is a program of its own.
struct OutsidePin {
    std::string name;                ///< full name
    hal_type type = HAL_TYPE_BIT;
    hal_dir dir = HAL_DIR_IN;
    bool read_only = false;          ///< a parameter that only the program sets
    hal_value initial{};
    std::optional<hal_value> safe = {};  ///< what it goes to when the program is dead; none: it keeps its value
    std::string doc = {}, unit = {};
};

/// What a thread has done so far, for `show thread`, the report at the end and the protocol.
struct ThreadReport {
    std::string name;
    std::int64_t period_ns = 0;
    std::uint64_t cycles = 0, missed = 0, overruns = 0;
    double wakeup_p50_ns = 0, wakeup_p99_ns = 0, wakeup_max_ns = 0;  ///< lateness of the wake-up
    double busy_p50_ns = 0, busy_p99_ns = 0, busy_max_ns = 0;        ///< execution time of the whole cycle
    std::string policy;              ///< "SCHED_FIFO 98", "SCHED_OTHER (no privilege)", "virtual clock"
    int cpu = -1;
    std::uint64_t page_faults = 0;   ///< minor and major, in cycles after the first 100
    bool faulted = false;            ///< stopped by a fault
    bool hung = false;               ///< it ends no cycle, and the supervisor has stopped it
    std::uint64_t hangs = 0;         ///< how often it was found hung
    std::int64_t silent_ns = 0;      ///< hung: since its last finished cycle
    std::string function;            ///< hung: the function it is in; empty: between two
    bool supervised = true;          ///< not so with supervise=off
};

/// Who makes the threads follow an outside beat, and what it has come to.
struct ClockReport {
    std::string leader;              ///< an instance
    std::int64_t shift_ns = 0;       ///< how much later than by their own clock the threads are due by now
    double rate = 0;                 ///< how much longer their second has lately been: 200e-6 is 200 ppm
};

/// One recorded fault, worded.
struct FaultRecord {
    std::uint64_t number = 0;
    std::int64_t age_ns = 0;
    std::uint64_t cycle = 0;
    std::string thread, code, sentence;  ///< sentence: what happened, since when, what was done
    std::uint64_t count = 1;             ///< of the same kind in a row, less than 2 s apart
    std::int64_t span_ns = 0;            ///< from the first of them to the last

    /// The sentence, and how often it happened.
    std::string line() const;
};

enum class Lock : unsigned { none = 0, load = 1, config = 2, params = 4, run = 8, tune = 3, all = 255 };

class Session {
public:
    explicit Session(SessionOptions options = {});
    ~Session();                      ///< stops threads, writes safe values, stops and destroys all instances
    Session(const Session&) = delete;

    std::mutex mutex;                ///< one edit or query at a time
    Sources sources;
    Ini ini;                         ///< what [SECTION]KEY is looked up in
    const SessionOptions& options() const;
    const Model& model() const;

    // --- edits ------------------------------------------------------------------------------------------------------
    /// Opens the transaction. Throws std::logic_error while another one is open. What reads the machine meanwhile (read,
    /// read_pins, the model, reports) sees it with the edits made so far.
    Transaction begin();
    bool in_transaction() const;

    /// `hal check`: a component, or the beginning of names, that exists only elsewhere.
    void assume(const std::string& name);
    /// `hal check`: a program that would be started: its component has one of these names.
    void note_program(const std::string& program, const std::vector<std::string>& names);
    /// A netlist that cannot be read: what it would make is not known, and no error in the texts after it.
    void note_missing_text(const std::string& path);

    // --- the machine --------------------------------------------------------------------------------------------
    /// `start`, also of threads that a fault stopped. False: one hangs, and none was started that was not running.
    bool start_threads(Diagnostics* diagnostics = nullptr);
    /// `stop`: gates the functions, writes safe values. False: one hangs and did not take part; its outputs are safe all the same.
    bool stop_threads(Diagnostics* diagnostics = nullptr);
    /// Reports the threads that hang as errors. False: there are none.
    bool hung_threads(Diagnostics& diagnostics) const;
    /// Feeds a watchdog device (Linux watchdog API) while all supervised threads make progress. False: `problem` says why not.
    bool attach_watchdog(const std::string& path, std::string& problem);
    /// At the end: true when the device was told not to reset the host, or there is none.
    bool watchdog_disarmed() const;
    bool running() const;
    /// Virtual clock: runs threads for so long. Real clock: waits until the fastest thread has done it (or `give_up`).
    void advance_ns(std::int64_t ns);
    void advance_cycles(std::uint64_t cycles);   ///< of the fastest thread
    std::int64_t now_ns() const;     ///< the runtime's clock
    /// Makes all outputs safe, for the end of the process. Idempotent.
    void shut_down();

    // --- values -----------------------------------------------------------------------------------------------------
    /// Values of pins or signals by name; all that belong to one thread come from one finished cycle. An unknown name
    /// gives nothing at its place.
    std::vector<std::optional<Reading>> read(const std::vector<std::string>& names);
    /// The same for objects of the model, without look-up.
    std::vector<hal_value> read_pins(const std::vector<const Pin*>& pins);
    std::vector<hal_value> read_signals(const std::vector<const Signal*>& signals);
    /// The same at once: each value by itself, as it is now. For programs that look often.
    std::vector<hal_value> peek_pins(const std::vector<Pin*>& pins);

    // --- reports ----------------------------------------------------------------------------------------------------
    std::vector<ThreadReport> thread_reports() const;
    ThreadReport thread_report(const Thread& thread) const;
    std::optional<ClockReport> clock_report() const;  ///< nothing while the threads run by their own clock
    std::vector<FaultRecord> faults() const;
    std::uint64_t fault_count() const;
    void clear_faults();
    /// What of real time is missing here and how to grant it; empty when nothing is. Said once by `hal run`.
    std::vector<std::string> missing_privileges() const;
    /// One line per signal: writer -> reader, cycles of delay and why (`show latency`).
    std::vector<std::string> latency_lines() const;
    /// The instance, its threads and faults as lines "KEY VALUE" (hal/status.h).
    std::string status_text() const;
    /// Lines for it about signals that pass between machines, which the model of this one does not show.
    void note_latencies(std::vector<std::string> lines);

    // --- locks, streams, processes ----------------------------------------------------------------------------------
    unsigned lock = 0;               ///< bits of Lock
    hal_stream* find_stream(std::string_view name) const;
    std::vector<std::string> stream_names() const;
    /// Registers a process started by loadusr as a component, so that unloadusr and show find it.
    void add_process(Transaction& transaction, const std::string& name, std::int64_t pid, const Command& command);
    /// Another process has taken the program's place.
    void set_process(Transaction& transaction, std::string_view name, std::int64_t pid);
    /// Removes a program's component with its pins; what they drove goes to its declared values.
    void remove_process(Transaction& transaction, std::string_view name);
    /// The component stays in the model, because a thread that hangs may use its pins, but no process answers for it.
    void disown_process(std::string_view name);
    /// Gives a program's component a pin, owned by the session: it is linked like any other, and no thread runs it.
    /// Returns nullptr and sets `problem` to the reason.
    Pin* add_outside_pin(Transaction& transaction, std::string_view component, const OutsidePin& pin, std::string& problem);
    void remove_outside_pins(Transaction& transaction, std::string_view component, const std::vector<Pin*>& pins);
    /// Values for such pins, in one cycle of each thread that reads them. An input takes its value only while nothing writes it.
    void write_outside(const std::vector<std::pair<Pin*, hal_value>>& values);
    /// All plugin names that can be loaded, from the search path.
    std::vector<std::string> available_components() const;
    /// What a component that can be loaded declares with default arguments; nothing when it cannot be constructed so.
    std::optional<Declared> declared(std::string_view component) const;

    struct State;

private:
    friend class Transaction;
    std::unique_ptr<State> state_;
};

}  // namespace hal
