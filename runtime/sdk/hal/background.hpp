// SPDX-License-Identifier: MIT
// For components with work that is not real time: a thread of its own on the real clock; on the
// virtual clock it is done between two instants, so that a run comes out the same every time.
#pragma once

#include <atomic>
#include <functional>
#include <stdexcept>
#include <thread>
#include <time.h>

#include "hal/background.h"
#include "hal/clock.hpp"
#include "hal/component.hpp"

namespace hal {

class Background {
public:
    /// `turn` does a piece of the work at the runtime clock's time `now_ns`. When it `may_wait` it
    /// is called again and again by a thread of its own, and waits by itself, for at most 0.1 s,
    /// until there is something to do; else it must not wait. It meets the cycle through
    /// hal/queue.hpp only and throws nothing. [setup]
    explicit Background(std::function<void(std::int64_t now_ns, bool may_wait)> turn)
        : turn_(std::move(turn)) {}
    Background(const Background&) = delete;
    ~Background() { stop(); }

    /// In the component's start(). [setup]
    void start() {
        host_ = extension<hal_background>(HAL_BACKGROUND);
        if (host_ != nullptr && host_->is_virtual != 0) {
            attached_ = host_->attach(host_, [](void* self, std::int64_t now) {
                static_cast<Background*>(self)->turn_(now, false);
            }, this);
            if (!attached_) {
                throw std::runtime_error("out of memory for its work outside the cycle");
            }
            return;
        }
        ended_.store(false);
        thread_ = std::thread([this] {
            while (!ended_.load()) {
                turn_(monotonic_ns(), true);
            }
        });
    }
    /// Call it in stop(). No turn is running when it returns. [setup]
    void stop() noexcept {
        if (attached_) {
            host_->detach(host_, this);
        }
        attached_ = false;
        ended_.store(true);
        if (thread_.joinable()) {
            thread_.join();
        }
    }

private:
    const std::function<void(std::int64_t, bool)> turn_;
    const hal_background* host_ = nullptr;
    bool attached_ = false;
    // written by start() and stop(), read by the thread
    std::atomic<bool> ended_{false};
    std::thread thread_;
};

}  // namespace hal
