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
    ReleasedGil() : thread_(present_thread()), state_(PyEval_SaveThread()) {}
    ReleasedGil(const ReleasedGil&) = delete;
    ~ReleasedGil() {
        ++restoring_;
        if (ends_ && thread_ != main_thread_) {
            --restoring_;
            while (true) {
                ::pause();
            }
        }
        PyEval_RestoreThread(state_);
        --restoring_;
    }
    /// In a child process, after fork(): the other threads do not exist here. [setup]
    static void after_fork() {
        restoring_ = 0;
        main_thread_ = present_thread();
    }
    /// Called last at the end of the program, in the main thread, with the lock held: no other
    /// thread waits for the lock in the destructor when it returns. Another thread may have loaded
    /// the module. [setup]
    static void end() {
        main_thread_ = present_thread();
        ends_ = true;
        PyThreadState* const state = PyEval_SaveThread();
        while (restoring_ != 0) {
            std::this_thread::sleep_for(std::chrono::microseconds(100));
        }
        PyEval_RestoreThread(state);
    }

private:
    static std::uint64_t present_thread() { return PyThreadState_GetID(PyThreadState_Get()); }

    inline static std::uint64_t main_thread_ = 0;  // written before ends_
    inline static std::atomic<bool> ends_{false};
    inline static std::atomic<int> restoring_{0};  // threads that want the lock back
    const std::uint64_t thread_;  // a state may be freed while the lock is released
    PyThreadState* const state_;
};

}  // namespace hal::python
