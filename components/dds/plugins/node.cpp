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
#include "dds/status.hpp"

namespace {

using namespace hal::dds;

/// Another node, as its cycle and the engine's threads know it.
struct Other {
    Other(hal::Component& c, const hal::Function& f, std::string node)
        : name(std::move(node)),
          heard_name(name + ".heard"),
          age_name(name + ".heard-age-ms"),
          online_name(name + ".online"),
          age_ms_name(name + ".age-ms"),
          refused_name(name + ".refused"),
          heard(c, f, heard_name.c_str(), "its signals come; linked when it sends some to this node"),
          heard_age(c, f, age_name.c_str(), "how old they are", {.unit = "ms"}),
          online(c, f, online_name.c_str(), "it is there: its signals come, or, when it sends none to this node, its status",
                 {.safe = false}),
          age(c, f, age_ms_name.c_str(), "since its signals, or its status, were sent", {.unit = "ms"}),
          refused(c, f, refused_name.c_str(), "it runs a netlist whose signals are others than here") {}

    const std::string name, heard_name, age_name, online_name, age_ms_name, refused_name;
    hal::In<bool>     heard;
    hal::In<double>   heard_age;
    hal::Out<bool>    online;
    hal::Out<double>  age;
    hal::Out<bool>    refused;
    bool              sends = false;  ///< to this node
    // Between the engine and the cycle
    std::atomic<std::int64_t> told{0};  ///< when its status came last, CLOCK_MONOTONIC
    std::atomic<bool>         differs{false};
    // The engine's
    std::string  said;
    std::int64_t said_at = 0;
};

class Node : public hal::Component, private Listener {
public:
    static constexpr hal::Traits traits{.singleton = true};

    explicit Node(const hal_host* host) : Component(host) {
        const auto wanted = topics_of(wants_.get());
        for (Other& other : others_)
            other.sends =
                std::any_of(wanted.begin(), wanted.end(), [&](const auto& topic) { return topic.first.starts_with(other.name + "/"); });
    }

    void start() {
        participant_ = open(settings_);
        Quality quality = status_quality();
        quality.depth = 64;
        own_ = this_process();
        reader_ = participant_->reader(status_topic(), quality, this);
        beacon_ = beacon(participant_, hal::extension<hal_status>(HAL_STATUS));
        // Whoever is there answers within a moment; who is not may come later.
        {
            std::unique_lock lock(mutex_);
            const auto       patience = std::chrono::milliseconds(static_cast<std::int64_t>(patience_ms_));
            const auto       begin = std::chrono::steady_clock::now();
            while (refusal_.empty() && greeted_.size() < others_.size()) {
                // who is there and has not said who it is will do so soon
                const auto known = participant_->known();
                const auto instances = std::count_if(known.begin(), known.end(), [](const Known& one) { return one.name == "halcyon"; });
                const bool silent = static_cast<std::size_t>(instances) > told_.size();
                if (std::chrono::steady_clock::now() - begin > (silent ? 5 * patience : patience)) break;
                changed_.wait_for(lock, std::chrono::milliseconds(20));
            }
            started_ = true;
            if (!refusal_.empty()) {
                const std::string why = refusal_;
                lock.unlock();
                stop();
                throw std::runtime_error(why);
            }
        }
        beacon_->add(this,
                     "cell " + cell_.get() + "\nnode " + self_.get() + "\noffers " + offers_.get() + "\nwants " + wants_.get() + "\n");
    }
    void stop() noexcept {
        reader_.reset();
        if (beacon_) beacon_->add(this, "");
        beacon_.reset();
        participant_.reset();
    }

    /// [realtime]
    void watch(hal::Cycle cycle) noexcept {
        for (Other& other : others_) {
            const std::int64_t told = other.told.load(std::memory_order_relaxed);
            const double       since = static_cast<double>(cycle.start_ns() - told) * 1e-6;
            const bool         there = told != 0 && since < static_cast<double>(5 * status_period_ns) * 1e-6;
            other.refused = other.differs.load(std::memory_order_relaxed);
            other.online = !other.refused && (other.sends ? static_cast<bool>(other.heard) : there);
            if (other.sends) other.age = other.heard_age;
            else if (told != 0) other.age = std::max(since, 0.0);
        }
    }

private:
    /// Host and process, as the host words them in its status.
    static std::string this_process() {
        char name[256] = "";
        ::gethostname(name, sizeof name - 1);
        return std::string(name) + ":" + std::to_string(::getpid());
    }
    void on_sample(const Sample& sample) noexcept override {
        try {
            const std::string_view text = status_text(sample.bytes);
            const auto             cell = values_of(text, "cell"), node = values_of(text, "node");
            {
                const std::lock_guard        lock(mutex_);
                std::array<std::uint8_t, 12> prefix;
                std::copy_n(sample.writer.begin(), prefix.size(), prefix.begin());
                if (told_.size() < 1000) told_.insert(prefix);
            }
            if (cell.empty() || node.empty() || cell[0] != cell_.get()) return;
            const std::lock_guard lock(mutex_);
            if (node[0] == self_.get()) return twin(text);
            for (Other& other : others_)
                if (other.name == node[0]) judge(other, text, sample.monotonic_ns);
        } catch (const std::exception&) {  // NOLINT(bugprone-empty-catch): a text that cannot be kept is one that did not come
        }
    }

    static std::string whom(std::string_view text) {
        const auto instance = values_of(text, "instance"), host = values_of(text, "host"), pid = values_of(text, "pid");
        return shown("instance '" + (instance.empty() ? "?" : instance[0]) + "' on " + (host.empty() ? "?" : host[0]) + ", process " +
                     (pid.empty() ? "?" : pid[0]));
    }

    static std::string process(std::string_view text) {
        const auto host = values_of(text, "host"), pid = values_of(text, "pid");
        return (host.empty() ? "?" : host[0]) + ":" + (pid.empty() ? "?" : pid[0]);
    }

    /// Of our name: our own status comes back, too.
    void twin(std::string_view text) {
        if (process(text) == own_) return;
        if (!started_) refusal_ = "node '" + self_.get() + "' of '" + cell_.get() + "' runs already: " + whom(text);
        else if (twin_.empty())
            std::fputs(("node: node '" + self_.get() + "' of '" + cell_.get() + "' runs twice: here and as " + whom(text) + "\n").c_str(),
                       stderr);
        twin_ = whom(text);
        changed_.notify_all();
    }

    void judge(Other& other, std::string_view text, std::int64_t when) {
        greeted_.insert(other.name);
        other.told.store(when, std::memory_order_relaxed);
        const auto  offers = values_of(text, "offers"), wants = values_of(text, "wants");
        const auto  theirs = topics_of(offers.empty() ? "" : offers[0]), wanted = topics_of(wants.empty() ? "" : wants[0]);
        std::string why;
        for (const auto& [topic, layout] : topics_of(wants_.get()))
            if (why.empty() && topic.starts_with(other.name + "/")) {
                const auto sent = theirs.find(topic);
                why = difference(sent == theirs.end() ? "" : sent->second, other.name, layout, self_.get());
            }
        for (const auto& [topic, layout] : topics_of(offers_.get()))
            if (const auto taken = wanted.find(topic); why.empty() && taken != wanted.end())
                why = difference(layout, self_.get(), taken->second, other.name);
        other.differs.store(!why.empty(), std::memory_order_relaxed);
        if (!why.empty())
            why = "node '" + other.name + "' (" + whom(text) + ") runs another version of netlist '" + cell_.get() + "' than node '" +
                  self_.get() + "': " + why + "; run the same file on both";
        why = shown(why);
        if (!started_) {
            if (!why.empty()) refusal_ = why;
        } else if (why != other.said) {
            // not more often than anybody reads it, whatever is sent
            if (when - other.said_at < 1'000'000'000) return;
            other.said_at = when;
            std::fputs(("node: " + (why.empty() ? "node '" + other.name + "' runs the same version again" : why) + "\n").c_str(), stderr);
        }
        other.said = why;
        changed_.notify_all();
    }

    ParticipantArguments arguments_{*this};
    hal::TextArgument    cell_{*this, "cell", "cell", "name of the netlist: nodes of others are not looked at"};
    hal::TextArgument    self_{*this, "node", "node", "which of its nodes this is"};
    hal::TextArgument    names_{*this, "others", "", "the other nodes"};
    hal::TextArgument    offers_{*this, "offers", "", "what this node sends: NODE/THREAD=SIGNAL:TYPE,...;"};
    hal::TextArgument    wants_{*this, "wants", "", "what this node takes, likewise"};
    hal::Argument patience_ms_{*this, "patience_ms", 1000, "how long the start waits to hear of other nodes", {.min = 0, .max = 60'000}};
    hal::Function watch_{*this, "watch", &Node::watch, "looks which nodes are there"};

    std::deque<Other> others_ = [this] {
        std::deque<Other> all;
        for (const std::string& name : list_of(names_.get())) all.emplace_back(*this, watch_, name);
        return all;
    }();

    const hal::dds::Settings settings_ = arguments_.settings();

    // Between the engine's threads and start()
    std::mutex                             mutex_;
    std::condition_variable                changed_;
    std::set<std::string>                  greeted_;
    std::string                            refusal_, own_, twin_;
    std::set<std::array<std::uint8_t, 12>> told_;  ///< participants whose status came
    bool                                   started_ = false;

    std::shared_ptr<Participant> participant_;
    std::shared_ptr<Beacon>      beacon_;
    std::unique_ptr<Reader>      reader_;
};

}  // namespace

HAL_COMPONENT(Node, "node", "Watches over the other nodes of a netlist for several machines", R"(
`hal run FILE --node NAME` loads it; nobody writes it into a netlist. Its pins say of every other node whether it is there:

* `node.OTHER.online`: its signals come within their deadline. A node that sends none to this one is there while its status comes.
* `node.OTHER.age-ms`: how old its signals are.
* `node.OTHER.refused`: it runs a version of the netlist in which a signal between the two is another one. Nothing of it is taken, and a
  line on standard error says which signal, and who the two are. A node that starts and finds such a one, or its own twin, does not start.

A part of the netlist links them like any other pins. By hand, as the loader does it for the node `motor`, whose netlist has a part `desk`,
too:

    loadrt node cell=conveyor node=motor others=desk
    loadrt not names=alarm
    addf node.watch servo
    addf alarm servo
    net desk-there node.desk.online => alarm.in
)")
