// SPDX-License-Identifier: MIT
#include "sim_ethernet.hpp"

#include <algorithm>
#include <cstring>

#include "ethernet_switch.hpp"
#include "link/trace_frame.hpp"

namespace hal::ethernet::simbus {

namespace {

constexpr std::size_t babble_capacity = 256;

class SimulatedPort final : public Port, public Segment {
public:
    /// `user` is already on the segment.
    SimulatedPort(std::shared_ptr<Switch> segment, std::unique_ptr<User> user,
                  Description description)
        : switch_(std::move(segment)),
          owned_(std::move(user)),
          user_(*owned_),
          station_(*user_.station),
          description_(std::move(description)) {}
    ~SimulatedPort() override { switch_->remove(std::move(owned_)); }

    const Address& address() const noexcept override { return station_.address; }

    Sent send(std::span<const std::uint8_t> frame, const Launch& launch,
              std::int64_t now_ns) noexcept override {
        switch_->pump(now_ns);
        const auto now = switch_->time(now_ns);
        if (!launch.fits(frame.size()) || frame.size() > max_frame) {
            count(user_.rejected);
            return Sent::rejected;
        }
        if (station_.cut.load(std::memory_order_relaxed)) {
            count(user_.dropped);
            return Sent::down;
        }
        if (launch.is_late(now)) {
            count(user_.late);
            return Sent::late;
        }
        const std::uint32_t* unused = user_.unused.front();
        if (unused == nullptr) {
            count(user_.dropped);
            return Sent::full;
        }
        const auto slot = *unused;
        user_.unused.drop();
        Outgoing& f = user_.places[slot];
        std::memcpy(f.bytes.data(), frame.data(), frame.size());
        // frames of a station leave in order
        if (launch.finisher != nullptr) {
            launch.finisher->leaves({f.bytes.data(), frame.size()});
        }
        f.length = std::max(frame.size(), smallest_frame);
        std::memset(f.bytes.data() + frame.size(), 0, f.length - frame.size());
        f.launch = launch;
        f.at_ns = std::max(launch.at_ns != 0 ? launch.at_ns : unclocked, now);
        link::trace_frame(link::ethernet_sent, frame);
        user_.outgoing.push(slot);  // the queue is as large as the pool
        return Sent::queued;
    }

    std::optional<Arrival> receive(std::int64_t now_ns) noexcept override {
        if (held_) {
            user_.incoming.drop();
            held_ = false;
        }
        switch_->pump(now_ns);
        const Incoming* next = user_.incoming.front();
        if (next == nullptr || next->time_ns > switch_->time(now_ns)) return std::nullopt;
        held_ = true;
        link::trace_frame(link::ethernet_received, {next->bytes.data(), next->length});
        return Arrival{{next->bytes.data(), next->length}, next->stamp_ns};
    }

    bool wait(std::int64_t) noexcept override {
        switch_->pump(unclocked);
        const Incoming* next = user_.incoming.at(held_ ? 1 : 0);
        return next != nullptr && next->time_ns <= switch_->time(unclocked);
    }

    Statistics statistics() const noexcept override {
        const auto read = [](const auto& counter) {
            return counter.load(std::memory_order_relaxed);
        };
        Statistics s;
        s.up = !read(station_.cut);
        s.speed = switch_->speed;
        s.sent = read(user_.sent);
        s.sent_bytes = read(user_.sent_bytes);
        s.received = read(user_.received);
        s.received_bytes = read(user_.received_bytes);
        s.lost = read(user_.lost);
        s.dropped = read(user_.dropped) + read(user_.thrown_away) + read(user_.rejected);
        s.late = read(user_.late);
        s.errors = read(user_.runts) + read(user_.rejected);
        s.downs = read(station_.downs);
        s.launch_error_ns = read(user_.launch_error_ns);
        return s;
    }
    const Description& description() const noexcept override { return description_; }
    Segment* segment() noexcept override { return this; }

    int port() const noexcept override { return station_.number; }
    void seed(std::uint64_t value) override {
        switch_->exclusively([&] { switch_->disturbances.random.seed(value); });
    }
    int disturb(const Disturbance& what) override {
        return switch_->exclusively([&] { return switch_->disturbances.add(what); });
    }
    std::uint64_t hits(int number) const override {
        return switch_->exclusively([&] { return switch_->disturbances.hits(number); });
    }
    void calm() override {
        switch_->exclusively([&] {
            switch_->disturbances.clear();
            for (auto& s : switch_->stations) {
                s->babble_period = 0;
                s->cut.store(false);
            }
        });
    }
    void babble(int port, std::span<const std::uint8_t> frame, std::int64_t period_ns) override {
        std::unique_ptr<User> babbler;
        const bool has_one = switch_->exclusively([&] {
            const Station* s = switch_->station(port);
            return s == nullptr || s->babbler != nullptr;
        });
        if (!has_one) {
            Options options;
            options.send_capacity = babble_capacity;
            babbler = std::make_unique<User>(options);
        }
        switch_->exclusively([&] {
            Station* s = switch_->station(port);
            if (s == nullptr || (!s->babbler && !babbler)) return;
            if (!s->babbler) {
                s->babbler = std::move(babbler);
                s->babbler->station = s;
            }
            s->babble.fill(0);
            const auto length = std::min(frame.size(), max_frame);
            if (length != 0) {
                std::memcpy(s->babble.data(), frame.data(), length);
            }
            s->babble_length = std::max(length, smallest_frame);
            s->babble_period = length >= header_bytes && period_ns > 0 ? period_ns : 0;
            s->babble_at = std::max(switch_->time(unclocked), std::int64_t{0});
        });
    }
    void cut(int port, bool is_cut) override {
        switch_->exclusively([&] {
            Station* s = switch_->station(port);
            if (s != nullptr && s->cut.exchange(is_cut) != is_cut && is_cut) {
                s->downs.fetch_add(1);
            }
        });
    }
    std::int64_t time_ns() const noexcept override { return switch_->time(unclocked); }
    bool respond(Responder* responder) override {
        return switch_->exclusively([&] {
            if (switch_->responding != nullptr && switch_->responding != &user_) return false;
            switch_->responding = responder != nullptr ? &user_ : nullptr;
            user_.responder = responder;
            return true;
        });
    }

private:
    static void count(std::atomic<std::uint64_t>& counter) noexcept {
        counter.fetch_add(1, std::memory_order_relaxed);
    }

    const std::shared_ptr<Switch> switch_;
    std::unique_ptr<User> owned_;
    User& user_;
    Station& station_;
    Description description_;
    bool held_ = false;  ///< receiving thread: the oldest frame is still in use
};

}  // namespace

Description describe(const std::string& target) {
    const auto slash = target.find('/');
    return {.address = "sim:" + target,
            .transport = "segment in memory",
            .interface = slash + 1 < target.size() ? target.substr(slash + 1) : target,
            .simulated = true,
            .in_memory = true};
}

Opened open(const std::string& target, const Options& options) {
    const auto slash = target.find('/');
    const auto name = target.substr(0, slash);
    const auto station = slash == target.npos ? std::string{} : target.substr(slash + 1);
    if (name.empty()) {
        return {nullptr, "missing name of the segment; write sim:net0"};
    }
    if (slash != target.npos && station.empty()) {
        return {nullptr, "missing name of the station; write sim:" + name + "/master"};
    }
    std::string problem;
    auto segment = Switch::find(name, options, problem);
    if (!segment) {
        return {nullptr, problem};
    }
    auto user = std::make_unique<User>(options);
    if (!segment->add(*user, station, options, problem)) {
        return {nullptr, problem};
    }
    return {std::make_unique<SimulatedPort>(std::move(segment), std::move(user), describe(target)),
            {}};
}

}  // namespace hal::ethernet::simbus
