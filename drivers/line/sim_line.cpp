// SPDX-License-Identifier: MIT
// A line in memory: what one user sends arrives at all others, a character at a time. Two users
// that send at the same time destroy each other's characters, and a user with another baud rate or
// parity receives other characters.
#include "sim_line.hpp"

#include <algorithm>
#include <deque>
#include <map>
#include <mutex>
#include <vector>

#include "link/bus_key.hpp"

namespace hal::line::sim {

namespace {

struct Character {
    std::int64_t arrives_ns;
    std::uint8_t value;
};

class SimLine;

/// The users of one name. All members are guarded by `mutex`.
struct Segment {
    std::mutex mutex;
    std::vector<SimLine*> users;
    const SimLine* last_sender = nullptr;
    std::int64_t busy_until_ns = INT64_MIN / 2;
};

constexpr std::size_t max_waiting = 4096;  // of a user that never reads

class SimLine final : public Line {
public:
    SimLine(std::shared_ptr<Segment> segment, Description description, const Options& options)
        : segment_(std::move(segment)), description_(std::move(description)), options_(options) {
        const std::lock_guard lock(segment_->mutex);
        segment_->users.push_back(this);
    }
    ~SimLine() override {
        const std::lock_guard lock(segment_->mutex);
        std::erase(segment_->users, this);
        if (segment_->last_sender == this) {
            segment_->last_sender = nullptr;
        }
    }
    const Description& description() const noexcept override { return description_; }
    bool is_open(std::int64_t) noexcept override { return true; }

    bool send(std::span<const std::uint8_t> bytes, std::int64_t now_ns) noexcept override {
        const std::lock_guard lock(segment_->mutex);
        const std::int64_t begin = std::max(now_ns, sent_until_);
        const bool collides = segment_->last_sender != nullptr && segment_->last_sender != this &&
                              begin < segment_->busy_until_ns;
        for (std::size_t n = 0; n < bytes.size(); ++n) {
            const std::int64_t arrives = begin + characters_ns(options_, n + 1);
            for (SimLine* user : segment_->users) {
                if (user != this) {
                    user->deliver({arrives, bytes[n]}, collides || !user->reads(options_));
                }
            }
        }
        sent_until_ = begin + characters_ns(options_, bytes.size());
        segment_->busy_until_ns = std::max(segment_->busy_until_ns, sent_until_);
        segment_->last_sender = this;
        return true;
    }
    std::size_t receive(std::span<std::uint8_t> bytes, std::int64_t now_ns) noexcept override {
        const std::lock_guard lock(segment_->mutex);
        std::size_t count = 0;
        while (count < bytes.size() && !waiting_.empty() && waiting_.front().arrives_ns <= now_ns) {
            bytes[count++] = waiting_.front().value;
            waiting_.pop_front();
        }
        return count;
    }
    std::int64_t sent_until_ns() const noexcept override { return sent_until_; }

private:
    bool reads(const Options& sender) const noexcept {
        return sender.baud == options_.baud && sender.parity == options_.parity;
    }
    void deliver(Character character, bool garbled) {
        if (waiting_.size() >= max_waiting) {
            waiting_.pop_front();
        }
        if (garbled) {
            character.value = static_cast<std::uint8_t>(character.value * 5 + 0x33);
        }
        waiting_.push_back(character);
    }

    const std::shared_ptr<Segment> segment_;
    const Description description_;
    const Options options_;
    std::deque<Character> waiting_;
    std::int64_t sent_until_ = INT64_MIN / 2;
};

std::shared_ptr<Segment> segment_named(const std::string& name) {
    static std::mutex mutex;
    static std::map<std::string, std::weak_ptr<Segment>> all;
    const std::lock_guard lock(mutex);
    std::weak_ptr<Segment>& known = all[link::bus_key(name)];
    std::shared_ptr<Segment> segment = known.lock();
    if (!segment) {
        segment = std::make_shared<Segment>();
        known = segment;
        std::erase_if(all, [](const auto& entry) { return entry.second.expired(); });
    }
    return segment;
}

}  // namespace

Opened open(const std::string& target, const Options& options) {
    return {std::make_unique<SimLine>(segment_named(target), describe(target), options), {}};
}
Description describe(const std::string& target) {
    return {.address = "sim:" + target, .transport = "line in memory", .in_memory = true};
}

}  // namespace hal::line::sim
