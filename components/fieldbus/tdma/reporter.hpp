// SPDX-License-Identifier: MIT
// What happened on the segment, in sentences on standard error: numbers out of the cycle, words in a thread of their own.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdio>
#include <string>
#include <thread>

#include "config.hpp"
#include "hal/queue.hpp"

namespace hal::tdma {

class Reporter {
public:
    /// The schedule outlives it. [setup]
    Reporter(std::string instance, const config::Schedule& schedule) : instance_(std::move(instance)), schedule_(schedule) {}
    ~Reporter() { stop(); }

    void start() {  // [setup]
        ended_.store(false);
        thread_ = std::thread([this] { run(); });
    }
    void stop() noexcept {  // [setup]
        ended_.store(true);
        if (thread_.joinable()) thread_.join();
    }
    /// By the cycle. What finds no room is not said. [realtime]
    void event(Event event, const Address& who, Time value) noexcept { events_.push({event, who, value}); }

    /// "x (02:00:00:00:00:02)", or the address alone. [setup]
    static std::string called(const config::Schedule& schedule, const Address& who) {
        for (const config::StationEntry& s : schedule.stations)
            if (s.mac == who) return s.name + " (" + ethernet::to_string(who) + ")";
        return ethernet::to_string(who);
    }

private:
    struct Happened {
        Event   event = Event::running;
        Address who{};
        Time    value = 0;
    };
    void run() {
        for (bool last = false; !last;) {
            last = ended_.load();  // looked at before the queue, so that what came before the end is still said
            for (Happened h; events_.pop(h);) say(words(h));
            if (!last) std::this_thread::sleep_for(std::chrono::milliseconds(20));
        }
    }
    void        say(const std::string& sentence) const { std::fputs((instance_ + ": " + sentence + "\n").c_str(), stderr); }
    std::string words(const Happened& h) const {
        const std::string who = called(schedule_, h.who), value = std::to_string(h.value);
        switch (h.event) {
        case Event::synchronised: return "the sync of " + who + " is followed";
        case Event::calibrated: return "calibrated: frames take " + config::microseconds(h.value) + " from or to " + who;
        case Event::running: return "runs: its slots may be used";
        case Event::uncalibrated:
            return who + " does not answer calibrations, " + value + " by now; it is asked on. Is there another " +
                   "station in this one's first slot, or a line that carries frames one way only?";
        case Event::sync_lost: return "the sync of " + who + " is lost; this station is silent until there is one again";
        case Event::leading: return "sends the syncs from now on";
        case Event::yielded: return "a master with more right sends the syncs again: " + who;
        case Event::other_master:
            return "there is a second master, with a schedule of its own: " + who +
                   "; one of both has to be a backup-master:, or on another segment";
        case Event::withdrew:
            return "withdrew from being master, as " + who + " is one and has the smaller address; after mending: setp " + instance_ +
                   ".reset TRUE";
        case Event::foreign_frame: return who + " sends in slot " + value + " of this station; compare the configurations of both";
        case Event::babbling: return who + " babbles: " + value + " frames in one cycle";
        case Event::master_changed: return "the syncs come from " + who + " now";
        }
        return {};
    }

    const std::string       instance_;
    const config::Schedule& schedule_;
    hal::Queue<Happened>    events_{256};  // cycle to thread
    std::atomic<bool>       ended_{false};
    std::thread             thread_;
};

}  // namespace hal::tdma
