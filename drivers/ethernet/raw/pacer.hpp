// SPDX-License-Identifier: MIT
// A thread that sends frames at their times. Frames are in a pool of buffers, whose numbers
// circulate: sender -> `outgoing` -> pacer -> `unused` -> sender. The sender rings only when the
// pacer would sleep too long:
//   1. sender: frame into `outgoing`       2. pacer: exchanges `asleep_until`
//   3. sender: adds nothing to it          4. pacer: checks `outgoing`
// 2 and 3 are read-modify-writes of one variable, so one comes first: 3 then reads what 2 wrote, or
// 4 sees what 1 queued.
#pragma once

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "hal/queue.hpp"
#include "sender.hpp"

namespace hal::ethernet::rawether {

class Pacer {
public:
    /// [setup]
    Pacer(Sender&, const Options&);
    ~Pacer();

    /// Sends a frame at its time; from the calling thread when that is nearer than a wake-up takes.
    /// [realtime] sender
    Sent send(std::span<const std::uint8_t> frame, const Launch&, std::int64_t now_ns) noexcept;
    /// Returns what the thread could not obtain, as a sentence; empty: nothing. [setup]
    const std::string& remark() const noexcept { return remark_; }

private:
    struct Place {
        std::array<std::uint8_t, max_frame> bytes;
        std::size_t length = 0;
        Launch launch;
    };
    struct Waiting {
        std::int64_t at_ns;
        std::uint64_t sequence;
        std::uint32_t slot;
        bool operator<(const Waiting& o) const noexcept {
            return at_ns != o.at_ns ? at_ns > o.at_ns : sequence > o.sequence;
        }
    };

    void prepare(const Options&);
    void run() noexcept;
    bool collect() noexcept;
    bool look_until(std::int64_t time_ns) noexcept;
    void sleep(std::int64_t until_ns) noexcept;
    void ring() noexcept;

    Sender& sender_;
    const std::int64_t spin_ns_;
    std::vector<Place> places_;
    hal::Queue<std::uint32_t> unused_, outgoing_;
    std::vector<Waiting> waiting_;  ///< a heap, the next to leave first; the pacer's
    std::uint64_t sequence_ = 0;
    SpinBudget budget_;
    /// written by the pacer; INT64_MIN: it is awake
    std::atomic<std::int64_t> asleep_until_{INT64_MIN};
    std::atomic<std::uint32_t> bell_{0};
    std::atomic<bool> ending_{false};
    std::atomic<bool> ready_{false};
    std::string remark_;
    std::thread thread_;
};

}  // namespace hal::ethernet::rawether
