// SPDX-License-Identifier: MIT
#include "control/executors.hpp"
#include "execute/process_setup.hpp"

namespace hal {

void Executors::start() {
    constexpr std::size_t count = 2;
    for (std::size_t i = 0; i < count; ++i) {
        threads_.emplace_back([this] { work(); });
    }
}

void Executors::give(ServedClient& client) {
    {
        const std::scoped_lock lock(mutex_);
        queue_.push_back(&client);
    }
    wake_.notify_one();
}

void Executors::end() {
    {
        const std::scoped_lock lock(mutex_);
        ending_ = true;
    }
    wake_.notify_all();
    for (std::thread& thread : threads_) {
        thread.join();
    }
    threads_.clear();
}

void Executors::work() {
    release_unused_stack();
    for (;;) {
        ServedClient* client = nullptr;
        {
            std::unique_lock lock(mutex_);
            wake_.wait(lock, [this] { return ending_ || !queue_.empty(); });
            if (ending_) return;
            client = queue_.front();
            queue_.pop_front();
        }
        carry_out(*client);
        client->turn_over.store(true, std::memory_order_release);
        told_();
    }
}

void Executors::carry_out(ServedClient& client) {
    Turn& turn = client.turn;
    if (turn.closes) return client.connection.reset();
    Connection& connection = *client.connection;
    const std::uint64_t requests = connection.requests();
    const std::uint64_t invalid = connection.invalid_requests();
    std::size_t taken = 0;
    while (taken < turn.lines.size() && turn.replies.size() <= turn.capacity &&
           turn.waiting.empty() && !turn.stop && (taken == 0 || !ends_())) {
        const std::size_t end = turn.lines.find('\n', taken);
        std::string_view line = std::string_view(turn.lines).substr(taken, end - taken);
        if (line.ends_with('\r')) {
            line.remove_suffix(1);
        }
        taken = end + 1;
        if (line.empty()) continue;
        const auto handled = connection.handle(line, turn.replies);
        turn.stop = handled == Connection::Handled::stop;
        if (handled == Connection::Handled::wants_thread) {
            turn.waiting = line;
        }
    }
    turn.told_end = connection.told_end();
    turn.lines.erase(0, taken);
    turn.requests = connection.requests() - requests;
    turn.invalid = connection.invalid_requests() - invalid;
    if (const std::int64_t now = monotonic_ns(); connection.next_due_ns() <= now) {
        connection.publish(now, turn.congested, turn.replies);
    }
}

}  // namespace hal
