// SPDX-License-Identifier: MIT
// Python's lock released for a call that may wait.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <thread>

#include <pybind11/pybind11.h>
#include <unistd.h>

namespace hal::python {

/// Releases the lock while it exists. At the end of the interpreter a daemon thread that wants the
/// lock back is ended by pthread_exit(), which aborts the program where a destructor calls it. So it
/// sleeps instead, until the process ends.
class ReleasedGil {
public:
    ReleasedGil() : state_(PyEval_SaveThread()) {}
    ReleasedGil(const ReleasedGil&) = delete;
    ~ReleasedGil() {
        ++restoring_;
        if (ends_ && PyThreadState_GetID(state_) != main_thread_) {
            --restoring_;
            while (true) {
                ::pause();
            }
        }
        PyEval_RestoreThread(state_);
        --restoring_;
    }
    /// Called while the module is loaded. [setup]
    static void note_main_thread() { main_thread_ = PyThreadState_GetID(PyThreadState_Get()); }
    /// In a child process, after fork(): the other threads do not exist here. [setup]
    static void after_fork() {
        restoring_ = 0;
        note_main_thread();
    }
    /// Called last at the end of the program, in the main thread, with the lock held: no other
    /// thread waits for the lock in the destructor when it returns. [setup]
    static void end() {
        ends_ = true;
        PyThreadState* const state = PyEval_SaveThread();
        while (restoring_ != 0) {
            std::this_thread::sleep_for(std::chrono::microseconds(100));
        }
        PyEval_RestoreThread(state);
    }

private:
    inline static std::uint64_t main_thread_ = 0;
    inline static std::atomic<bool> ends_{false};
    inline static std::atomic<int> restoring_{0};  // threads that want the lock back
    PyThreadState* const state_;
};

}  // namespace hal::python
