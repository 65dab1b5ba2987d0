// SPDX-License-Identifier: MIT
// The threads that execute the requests of clients. Internal to the server.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "control/served_client.hpp"

namespace hal {

/// Carries out the turns of clients, in the order in which they were given. A turn may wait for the
/// session's lock for long: the server's thread never does.
class Executors {
public:
    /// `told` is called after each turn; while `ends` is true a turn is one request. Both are
    /// called by the executors' threads.
    Executors(std::function<void()> told, std::function<bool()> ends)
        : told_(std::move(told)), ends_(std::move(ends)) {}
    ~Executors() { end(); }
    void start();
    void give(ServedClient& client);
    /// Ends the threads after their present turns.
    void end();

private:
    void work();
    void carry_out(ServedClient& client);

    const std::function<void()> told_;
    const std::function<bool()> ends_;
    std::mutex mutex_;
    std::condition_variable wake_;
    std::deque<ServedClient*> queue_;  // guarded by mutex_
    bool ending_ = false;  // guarded by mutex_
    std::vector<std::thread> threads_;
};

}  // namespace hal
