// SPDX-License-Identifier: MIT
// Writes standard output for a real-time loop, which must not wait for a disk or a terminal.
#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "cli/output.hpp"

namespace hal::tools {

/// Writes in a thread of its own.
class BackgroundWriter {
public:
    BackgroundWriter() : thread_([this] { serve(); }) {}  // [setup]
    BackgroundWriter(const BackgroundWriter&) = delete;
    BackgroundWriter& operator=(const BackgroundWriter&) = delete;
    /// Returns when everything is written. [setup]
    ~BackgroundWriter() {
        {
            const std::lock_guard lock(mutex_);
            waiting_ += held_;
            ended_ = true;
        }
        bell_.notify_one();
        thread_.join();
    }

    /// Queues text. Never waits: while the writer holds the buffer, the text is kept until the next
    /// call. Returns false when standard output is closed. One thread. [realtime] except for
    /// allocation
    bool write(const std::string& text) {
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
    void serve() {
        std::unique_lock lock(mutex_);
        while (!ended_ || !waiting_.empty()) {
            bell_.wait(lock, [this] { return ended_ || !waiting_.empty(); });
            std::string text;
            text.swap(waiting_);
            lock.unlock();
            if (!text.empty() && !print(text)) {
                is_read_ = false;
            }
            lock.lock();
        }
    }

    std::string held_;  // used by the caller
    std::mutex mutex_;
    std::condition_variable bell_;
    std::string waiting_;  // protected by the mutex, as is the next
    bool ended_ = false;
    std::atomic<bool> is_read_{true};  // written by the thread
    std::thread thread_;
};

}  // namespace hal::tools
