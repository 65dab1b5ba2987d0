// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <unistd.h>

#include "dds/arguments.hpp"
#include "dds/links/links.hpp"
#include "dds/status.hpp"
#include "hal/age.hpp"
#include "hal/journal.hpp"

namespace {

using namespace hal::dds;

/// A topic that another node sends to this one: the signals of one of its threads.
struct Received {
    Received(hal::Component& c, const hal::Function& f, const std::string& topic)
        : valid_name(NodeLink::heard(topic, pin::heard)),
          age_name(NodeLink::heard(topic, pin::heard_age_ms)),
          valid(c, f, valid_name.c_str(), "the signals of this thread are valid"),
          age(c, f, age_name.c_str(), "age of the signals of this thread", {.unit = "ms"}) {}

    const std::string valid_name, age_name;
    hal::In<bool> valid;
    hal::In<double> age;
};

/// Another node, as its cycle and the engine's threads know it.
struct Other {
    /// `wanted`: the topics that this node receives, of any node.
    Other(hal::Component& c, const hal::Function& f, std::string node,
          const std::map<std::string, std::string>& wanted)
        : name(std::move(node)),
          online_name(name + ".online"),
          age_ms_name(name + ".age-ms"),
          incompatible_name(name + ".incompatible"),
          online(c, f, online_name.c_str(),
                 "online: all its signals are valid, or its status is received if it sends none "
                 "to this node",
                 {.safe = false}),
          age(c, f, age_ms_name.c_str(),
              "age of its oldest signal, or of its status; infinite: none yet, or the thread is "
              "stopped",
              {.initial = hal::infinite_age, .unit = "ms", .safe = hal::infinite_age}),
          incompatible(c, f, incompatible_name.c_str(),
                       "it runs another version of the netlist; its signals are ignored") {
        for (const auto& [topic, layout] : wanted) {
            if (topic.starts_with(name + "/")) {
                received.emplace_back(c, f, topic);
            }
        }
    }

    /// Returns true when the signals of all its threads are valid. [realtime]
    bool all_valid() const noexcept {
        return std::all_of(received.begin(), received.end(),
                           [](const Received& topic) { return topic.valid.get(); });
    }
    /// Returns the age of the signals that were received first, in ms. [realtime]
    double max_age() const noexcept {
        double oldest = 0.0;
        for (const Received& topic : received) {
            oldest = std::max(oldest, topic.age.get());
        }
        return oldest;
    }

    const std::string name, online_name, age_ms_name, incompatible_name;
    std::deque<Received> received;  ///< empty: it sends nothing to this node
    hal::Out<bool> online;
    hal::Out<double> age;
    hal::Out<bool> incompatible;
    // Between the engine and the cycle
    std::atomic<std::int64_t> status_at{0};  ///< reception of its last status, CLOCK_MONOTONIC
    std::atomic<bool> differs{false};
    hal::JournaledValue<std::int64_t> seen_status_at;  // by the cycle, as the next one
    hal::JournaledValue<bool> seen_differs;
    // The engine's
    std::string reported;
    std::int64_t reported_at = 0;
};

class Node : public hal::Component, private Listener {
public:
    static constexpr hal::Traits traits{.singleton = true};

    using Component::Component;

    void start() {
        if (hal::is_executed_again())
            return;  // what the cycle reads of the others is in the journal
        const hal::JournaledSource journaled;
        participant_ = open(settings_);
        Quality quality = status_quality();
        quality.depth = 64;
        own_ = this_process();
        reader_ = participant_->reader(status_topic(), quality, this);
        beacon_ = beacon(participant_, hal::extension<hal_status>(HAL_STATUS));
        // Running nodes answer within a moment; others may start later.
        {
            std::unique_lock lock(mutex_);
            const auto timeout =
                std::chrono::milliseconds(static_cast<std::int64_t>(discovery_timeout_ms_));
            const auto begin = std::chrono::steady_clock::now();
            while (rejection_.empty() && seen_.size() < others_.size()) {
                // an instance that was discovered publishes its status soon
                const auto known = participant_->known();
                const auto instances =
                    std::count_if(known.begin(), known.end(),
                                  [](const Known& one) { return one.name == "halcyon"; });
                const bool pending = static_cast<std::size_t>(instances) > known_.size();
                if (std::chrono::steady_clock::now() - begin > (pending ? 5 * timeout : timeout)) {
                    break;
                }
                changed_.wait_for(lock, std::chrono::milliseconds(20));
            }
            started_ = true;
            if (!rejection_.empty()) {
                const std::string why = rejection_;
                lock.unlock();
                stop();
                throw std::runtime_error(why);
            }
        }
        beacon_->add(this, "cell " + cell_.get() + "\nnode " + self_.get() + "\noffers " +
                               offers_.get() + "\nwants " + wants_.get() + "\n");
    }
    void stop() noexcept {
        reader_.reset();
        if (beacon_) {
            beacon_->add(this, "");
        }
        beacon_.reset();
        participant_.reset();
    }

    /// [realtime]
    void watch(hal::Cycle cycle) noexcept {
        for (Other& other : others_) {
            const std::int64_t status_at =
                other.seen_status_at(other.status_at.load(std::memory_order_relaxed));
            const double since = static_cast<double>(cycle.start_ns() - status_at) * 1e-6;
            const bool there =
                status_at != 0 && since < static_cast<double>(5 * status_period_ns) * 1e-6;
            other.incompatible = other.seen_differs(other.differs.load(std::memory_order_relaxed));
            const bool sends = !other.received.empty();
            other.online = !other.incompatible && (sends ? other.all_valid() : there);
            if (sends) {
                other.age = other.max_age();
            } else if (status_at != 0) {
                other.age = std::max(since, 0.0);
            }
        }
    }

private:
    /// Returns host and process in the format of the status.
    static std::string this_process() {
        char name[256] = "";
        ::gethostname(name, sizeof name - 1);
        return std::string(name) + ":" + std::to_string(::getpid());
    }
    void on_sample(const Sample& sample) noexcept override {
        try {
            const std::string_view text = status_text(sample.bytes);
            const auto cell = values_of(text, "cell");
            const auto node = values_of(text, "node");
            {
                const std::lock_guard lock(mutex_);
                std::array<std::uint8_t, 12> prefix;
                std::copy_n(sample.writer.begin(), prefix.size(), prefix.begin());
                if (known_.size() < 1000) {
                    known_.insert(prefix);
                }
            }
            if (cell.empty() || node.empty() || cell[0] != cell_.get()) return;
            const std::lock_guard lock(mutex_);
            if (node[0] == self_.get()) return check_duplicate(text);
            for (Other& other : others_) {
                if (other.name == node[0]) {
                    compare(other, text, sample.monotonic_ns);
                }
            }
        } catch (
            const std::
                exception&) {  // NOLINT(bugprone-empty-catch): without memory the status is ignored
        }
    }

    /// Returns the first value of a key, or "?".
    static std::string value_of(std::string_view text, const char* key) {
        const auto values = values_of(text, key);
        return values.empty() ? "?" : std::string(values[0]);
    }

    static std::string describe(std::string_view text) {
        return shown("instance '" + value_of(text, "instance") + "' on " + value_of(text, "host") +
                     ", process " + value_of(text, "pid"));
    }

    static std::string process(std::string_view text) {
        return value_of(text, "host") + ":" + value_of(text, "pid");
    }

    /// Reports another process with this node's name. The own status is received too.
    void check_duplicate(std::string_view text) {
        if (process(text) == own_) return;
        const std::string duplicate = "node '" + self_.get() + "' of '" + cell_.get() +
                                      "' is already running: " + describe(text);
        if (!started_) {
            rejection_ = duplicate;
        } else if (!has_duplicate_) {
            std::fputs(("node: duplicate node: " + duplicate + "; stop one of the two\n").c_str(),
                       stderr);
        }
        has_duplicate_ = true;
        changed_.notify_all();
    }

    /// Compares the signals of both netlists.
    void compare(Other& other, std::string_view text, std::int64_t when) {
        seen_.insert(other.name);
        other.status_at.store(when, std::memory_order_relaxed);
        const auto offers = values_of(text, "offers");
        const auto wants = values_of(text, "wants");
        const auto theirs = topics_of(offers.empty() ? "" : offers[0]);

        const auto wanted = topics_of(wants.empty() ? "" : wants[0]);
        std::string why;
        for (const auto& [topic, layout] : topics_of(wants_.get())) {
            if (why.empty() && topic.starts_with(other.name + "/")) {
                const auto sent = theirs.find(topic);
                why = difference(sent == theirs.end() ? "" : sent->second, other.name, layout,
                                 self_.get());
            }
        }
        for (const auto& [topic, layout] : topics_of(offers_.get())) {
            if (const auto taken = wanted.find(topic); why.empty() && taken != wanted.end()) {
                why = difference(layout, self_.get(), taken->second, other.name);
            }
        }
        other.differs.store(!why.empty(), std::memory_order_relaxed);
        if (!why.empty()) {
            why = "node '" + other.name + "' (" + describe(text) +
                  ") runs another version of netlist '" + cell_.get() + "' than node '" +
                  self_.get() + "': " + why + "; run the same file on both";
        }
        why = shown(why);
        if (!started_) {
            if (!why.empty()) {
                rejection_ = why;
            }
        } else if (why != other.reported) {
            // at most one line per second, whatever the other node sends
            if (when - other.reported_at < 1'000'000'000) return;
            other.reported_at = when;
            std::fputs(("node: " +
                        (why.empty() ? "node '" + other.name +
                                           "' runs the same version of the netlist again"
                                     : why) +
                        "\n")
                           .c_str(),
                       stderr);
        }
        other.reported = why;
        changed_.notify_all();
    }

    ParticipantArguments arguments_{*this};
    hal::TextArgument cell_{*this, argument::cell, "cell",
                            "name of the netlist; nodes of other netlists are ignored"};
    hal::TextArgument self_{*this, argument::node, "node", "name of this node"};
    hal::TextArgument names_{*this, argument::others, "", "the other nodes"};
    hal::TextArgument offers_{*this, argument::offers, "",
                              "topics that this node sends: NODE/THREAD=SIGNAL:TYPE,...;"};
    hal::TextArgument wants_{*this, argument::wants, "",
                             "topics that this node receives, in the same format"};
    hal::Argument discovery_timeout_ms_{
        *this,
        "discovery_timeout_ms",
        1000,
        "how long the start waits for the status of other nodes (ms)",
        {.min = 0, .max = 60'000}};
    hal::Function watch_{*this, "watch", &Node::watch, "updates which nodes are online"};

    std::deque<Other> others_ = [this] {
        std::deque<Other> all;
        const auto wanted = topics_of(wants_.get());
        for (const std::string& name : list_of(names_.get())) {
            all.emplace_back(*this, watch_, name, wanted);
        }
        return all;
    }();

    const hal::dds::Settings settings_ = arguments_.settings();

    // Between the engine's threads and start()
    std::mutex mutex_;
    std::condition_variable changed_;
    std::set<std::string> seen_;  ///< nodes whose status was received
    std::set<std::array<std::uint8_t, 12>> known_;  ///< participants whose status was received
    std::string rejection_, own_;
    bool started_ = false;
    bool has_duplicate_ = false;

    std::shared_ptr<Participant> participant_;
    std::shared_ptr<Beacon> beacon_;
    std::unique_ptr<Reader> reader_;
};

}  // namespace

HAL_COMPONENT(Node, "node", "Monitors the other nodes of a netlist for several machines", R"(
`hal run FILE --node NAME` loads it; a netlist does not. Its pins show whether every other node is
online:

* `node.OTHER.online`: all its signals are received within their deadline, those of each of its
  threads. A node that sends none to this one is online while its status is received.
* `node.OTHER.age-ms`: the age of its oldest signal.
* `node.OTHER.incompatible`: it runs a version of the netlist in which a signal between the two
  differs. Its signals are ignored, and a line on standard error names the signal and both nodes. A
  node that finds an incompatible node, or a duplicate of itself, while it starts fails to start.

A part of the netlist links them like any other pins. What the loader does for the node `motor` of a
netlist that also has a node `desk`, by hand:

    loadrt node cell=conveyor node=motor others=desk
    loadrt not names=alarm
    addf node.watch servo
    addf alarm servo
    net desk-there node.desk.online => alarm.in

With `wants=desk/servo=speed:float;` it also has the pins `node.desk.servo.heard` and
`node.desk.servo.heard-age-ms`, which the loader links to the subscriber for that thread.
)")
