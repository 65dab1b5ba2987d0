// SPDX-License-Identifier: MIT
// A component of a Python program: its connection to the machine and a local copy of the values of
// its pins.
//
// Reading and writing a pin accesses the copy. Written values are sent with the next fetch of the
// inputs, or half a millisecond later by the component's own thread. A read fetches all inputs in
// one request when the copy is older than one millisecond. A series of accesses therefore costs one
// request, and a program that has slept sees current values.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>

#include "control/client.hpp"
#include "values.hpp"

namespace hal::python {

/// Python's exception `hal.error`.
struct Problem : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Connects to the instance the environment names. Throws Problem.
std::unique_ptr<hal::Client> connect_to_instance();
/// Returns the JSON as text; invalid UTF-8 is replaced by U+FFFD.
std::string dump(const Json& json);

/// The functions that Python calls hold the GIL when they are called and release it while they
/// wait.
class Component {
public:
    /// Connects and announces the component. `timeout` is null or the time in milliseconds after
    /// this program's end at which its pins take their safe values (-1: never); `every_ms` the
    /// declared maximum interval between accesses, 0 for none. Throws Problem.
    Component(std::string name, std::string prefix, Json timeout, long every_ms,
              bool ends_when_lost);
    ~Component();
    Component(const Component&) = delete;

    const std::string& name() const { return name_; }
    const std::string& prefix() const { return prefix_; }
    void set_prefix(std::string prefix) { prefix_ = std::move(prefix); }

    /// Creates a pin or parameter and returns its index; `more` is a JSON object with doc, unit and
    /// safe. Throws Problem.
    std::size_t add(const std::string& name, int type, const std::string& dir,
                    const std::string& more);
    /// Marks the component as ready, or as not ready. Sends what was written before.
    void ready(bool on);
    /// Returns the index of a pin or parameter, -1 for an unknown name.
    long find(const std::string& name) const;
    /// Returns the value of a pin, fetched from the machine when the copy is stale. Throws Problem.
    py::object get(std::size_t i);
    /// Writes the local copy of a pin. Throws Problem.
    void set(std::size_t i, const py::object& value);
    /// Sends a request after the values written before it, and returns the reply.
    std::string request(const std::string& text);
    /// Sends the written values and marks the copy as stale. Called from Python's audit hook,
    /// without the GIL.
    void flush();
    /// Reports activity, for a component with a declared interval that accesses no pin.
    void alive();
    /// Marks the copy as stale: the next read fetches the inputs.
    void invalidate();
    /// Ends the component. `clean` removes its pins at once; otherwise the machine handles it as
    /// the death of this process.
    void leave(bool clean);
    /// Marks the component as belonging to the parent process, after fork().
    void forget();
    bool is_connected();

    const Item& item(std::size_t i) const { return items_.at(i); }
    std::size_t size() const { return items_.size(); }

private:
    Json announcement() const;
    /// Locks `lock` and checks that the component is usable. The caller must not hold the GIL: the
    /// holder of the lock may wait for it.
    void acquire(std::unique_lock<std::mutex>& lock) const;
    void check_process() const;
    void check_usable() const;
    bool stale(const Item& item) const;
    /// Returns true when the machine is to know that the program accesses its pins, although this
    /// access needs nothing from it.
    bool report_due() const;
    void report();
    /// Sends what another component of this process has written before, so that the machine sees
    /// the writes in their order. The caller holds the GIL and no lock.
    void send_earlier_writes();
    /// Sends all written values, and fetches all inputs where `read` is set, in one request.
    void exchange(bool read);
    void run_flusher();
    /// Records that a machine is connected, and whether the kernel ends this process with it.
    void note_connected();
    /// Handles the loss of the machine: ends the program as SIGTERM does, or sets the declared safe
    /// values.
    void handle_loss();
    /// Declares the component again to an instance that was restarted, or that closed this
    /// connection.
    void reconnect();

    std::string name_, prefix_;
    Json timeout_;
    long every_ms_;
    bool ends_when_lost_;
    bool tied_ = false;  // the kernel ends this process with the machine
    bool loss_reported_ = false;
    std::mutex mutex_;  // guards everything below
    std::condition_variable changed_;
    std::unique_ptr<hal::Client> client_;
    std::vector<Item> items_;  // modified only with the GIL held, too
    std::vector<std::string> prefixes_;
    std::unordered_map<std::string, std::size_t> index_;
    bool dirty_ = false;  // some item is dirty
    bool loops_ = false;  // an output of this component is linked to one of its inputs
    bool ready_ = false;
    std::atomic<bool> left_{false};  // written under the mutex
    std::string lost_;  // why the instance rejected the last exchange
    std::atomic<bool> forked_{false};
    std::chrono::steady_clock::time_point fetched_{};
    std::chrono::steady_clock::time_point reported_{};  // of the last sign of life
    std::thread flusher_;
};

/// Calls `flush`, `leave` or `forget` for all components of this process.
void flush_all();
void leave_all(bool clean);
void forget_all();

}  // namespace hal::python
