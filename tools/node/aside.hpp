// SPDX-License-Identifier: MIT
// Writes on standard output what a loop in real time has to say. A disk or a terminal may take its time, and the loop has none.
#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "say.hpp"

namespace hal::tools {

class Aside {
public:
    Aside() : thread_([this] { write(); }) {}  // [setup]
    Aside(const Aside&) = delete;
    Aside& operator=(const Aside&) = delete;
    /// Everything is written when it is gone. [setup]
    ~Aside() {
        {
            const std::lock_guard lock(mutex_);
            waiting_ += held_;
            ended_ = true;
        }
        bell_.notify_one();
        thread_.join();
    }

    /// False: nobody reads any more. Never waits: while the writer is at the row, the text stays here until the next call. One thread.
    bool say(const std::string& text) {
        held_ += text;
        if (!held_.empty() && mutex_.try_lock()) {
            waiting_ += held_;
            mutex_.unlock();
            held_.clear();
            bell_.notify_one();
        }
        return is_read_.load(std::memory_order_relaxed);
    }

private:
    void write() {
        std::unique_lock lock(mutex_);
        while (!ended_ || !waiting_.empty()) {
            bell_.wait(lock, [this] { return ended_ || !waiting_.empty(); });
            std::string text;
            text.swap(waiting_);
            lock.unlock();
            if (!text.empty() && !print(text)) is_read_ = false;
            lock.lock();
        }
    }

    std::string held_;  // the caller's
    std::mutex mutex_;
    std::condition_variable bell_;
    std::string waiting_;  // by the mutex, as is the next
    bool ended_ = false;
    std::atomic<bool> is_read_{true};  // written by the thread
    std::thread thread_;
};

}  // namespace hal::tools
