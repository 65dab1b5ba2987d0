// SPDX-License-Identifier: MIT
// `hal tdma ping`: measures the round-trip time to a station of a segment. The machine sends the
// ping in its own slot; this program requests it through a pin and reads the result from others.
#include "inspect/tdma_ping.hpp"

#include <algorithm>
#include <chrono>
#include <fmt/core.h>
#include <numeric>
#include <vector>

#include "cli/output.hpp"
#include "cli/signals.hpp"
#include "inspect/tdma_stations.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

using nlohmann::json;
using Clock = std::chrono::steady_clock;

constexpr std::uint64_t usual_count = 4;
constexpr std::int64_t pause_ns = 200'000'000;
constexpr std::int64_t look_ns = 2'000'000;
// the component times out long before, unless its thread stalls
constexpr auto reply_timeout = std::chrono::seconds(30);

// of the pin ping-result
enum class Outcome { none, answered, unanswered, no_room, no_address, not_running };

std::string names_of(const StationPins& pins) {
    std::string names;
    constexpr std::string_view marker = ".online";
    for (const auto& [name, value] : pins) {
        if (name.ends_with(marker)) {
            append_item(names, name.substr(0, name.size() - marker.size()));
        }
    }
    return names;
}

class Pinger {
public:
    Pinger(Client& client, std::string instance, std::string station)
        : client_(client),
          instance_(std::move(instance)),
          station_(std::move(station)),
          pin_(instance_ + "." + station_ + ".ping") {}

    /// Returns the outcome of a ping; none: no more can be sent, and `problem` is the reason.
    Outcome ask(const StopRequest& stop, std::string& problem) {
        if (!look(problem)) return Outcome::none;
        const auto requested = static_cast<std::uint32_t>(number(pins_, "ping")) + 1;
        if (const auto answer = client_.run({"setp", pin_, fmt::format("{}", requested)});
            answer.status != 0) {
            problem = answer.err;
            while (!problem.empty() && problem.back() == '\n') {
                problem.pop_back();
            }
            return Outcome::none;
        }
        const auto until = Clock::now() + reply_timeout;
        while (Clock::now() < until) {
            if (stop.wait_ns(look_ns)) return Outcome::none;
            if (!look(problem)) return Outcome::none;
            if (static_cast<std::uint32_t>(number(pins_, "ping-done")) == requested) {
                if (!look(problem)) {
                    return Outcome::none;  // now all of them are of that ping
                }
                return static_cast<Outcome>(static_cast<int>(number(pins_, "ping-result")));
            }
            if (static_cast<std::uint32_t>(number(pins_, "ping")) != requested) {
                problem = fmt::format("another client is pinging {} ({} is set); try again",
                                      station_, pin_);
                return Outcome::none;
            }
        }
        problem = fmt::format(
            "{} did not accept the ping request; check that the thread of {}.receive runs",
            instance_, instance_);
        return Outcome::none;
    }
    double time() const { return number(pins_, "ping-time"); }
    double held() const { return number(pins_, "ping-held"); }
    double cycles() const { return number(pins_, "ping-cycles"); }

private:
    bool look(std::string& problem) {
        const json reply =
            client_.request({{"describe", "pin"}, {"patterns", json::array({pin_ + "*"})}});
        if (!reply.value("ok", false)) {
            problem = reply.value("error", "no answer");
            return false;
        }
        const std::string before = instance_ + "." + station_ + ".";
        for (const json& pin : reply.value("objects", json::array())) {
            if (const std::string name = pin.value("name", "");
                name.starts_with(before) && pin.contains("value")) {
                pins_[name.substr(before.size())] = pin["value"];
            }
        }
        if (pins_.contains("ping")) return true;
        problem = fmt::format("pin {} was removed", pin_);
        return false;
    }

    Client& client_;
    const std::string instance_, station_, pin_;
    StationPins pins_;
};

/// Returns the reason when no ping was answered.
std::string explanation(Outcome last, const StationPins& pins, const std::string& instance,
                        const std::string& station) {
    switch (last) {
    case Outcome::no_room:
        return fmt::format(
            "{} sent nothing: other frames fill its slots, or it has none; increase a SIZE in the "
            "schedule",
            instance);
    case Outcome::no_address:
        return fmt::format(
            "{} has received no frame from {} and does not know its address; add its mac to the "
            "schedule",
            instance, station);
    case Outcome::not_running:
        return fmt::format("{} has no permission to send; see: hal tdma status", instance);
    default: break;
    }
    if (is_on(pins, station + ".online")) {
        return fmt::format(
            "{} is online but does not answer pings; earlier versions of Halcyon and RTnet "
            "stations do not support them",
            station);
    }
    return fmt::format("{} is offline; check its power and its cable", station);
}

const char* to_string(Outcome outcome) {
    switch (outcome) {
    case Outcome::unanswered: return "no answer";
    case Outcome::no_room: return "not sent, slots full";
    case Outcome::no_address: return "not sent, unknown address";
    case Outcome::not_running: return "not sent, no permission to send";
    default: return "?";
    }
}

/// Returns the instance that has this station among the others, with its pins; empty: sets
/// `problem`.
std::string instance_with(const std::map<std::string, StationPins>& instances,
                          const TdmaPingOptions& options, std::string& problem) {
    const std::string& station = options.words.front();
    std::string known;
    for (const auto& [instance, pins] : instances) {
        if (!options.from.empty() && instance != options.from) continue;
        if (pins.contains(station + ".ping")) return instance;
        const std::string names = names_of(pins);
        known += fmt::format("; {}{}", instance,
                             names.empty() ? " knows no other station" : " knows " + names);
    }
    if (known.empty()) {
        std::string all;
        for (const auto& [instance, pins] : instances) {
            append_item(all, instance);
        }
        problem = fmt::format("unknown station '{}' in --from; use {}", options.from, all);
    } else {
        problem = fmt::format("unknown station '{}'{}", station, known);
    }
    return {};
}

/// The line of ping number `done`.
std::string line_of(const Pinger& pinger, Outcome outcome, const std::string& station,
                    std::uint64_t done) {
    if (outcome != Outcome::answered) {
        return fmt::format("{} {}: {}\n", station, done, to_string(outcome));
    }
    return fmt::format(
        "{} {}: {:.2f} us, {:.2f} cycles; {:.2f} us of it at {}, {:.2f} us each way\n", station,
        done, pinger.time(), pinger.cycles(), pinger.held(), station,
        (pinger.time() - pinger.held()) / 2);
}

/// The last line. `times` are those of the answered pings, in us; `done` is not 0.
std::string summary(const std::string& instance, std::uint64_t done,
                    const std::vector<double>& times) {
    const std::uint64_t lost = done - times.size();
    const std::string text = fmt::format(
        "{} from {}, {} answered, {} lost ({:.0f} %)", counted(done, "ping"), instance,
        times.size(), lost, 100.0 * static_cast<double>(lost) / static_cast<double>(done));
    if (times.empty()) return text + "\n";
    const auto [min, max] = std::minmax_element(times.begin(), times.end());
    const double sum = std::accumulate(times.begin(), times.end(), 0.0);
    return fmt::format("{}; min {:.2f}, mean {:.2f}, max {:.2f} us\n", text, *min,
                       sum / static_cast<double>(times.size()), *max);
}

}  // namespace

int run_tdma_ping(const TdmaPingOptions& options) {
    if (options.words.size() != 1) {
        return fail(options, "exactly one station is required: hal tdma ping STATION");
    }
    StopRequest stop;
    SegmentMachine machine;
    std::string problem = machine.connect(options.name);
    if (!problem.empty()) return fail(options, problem);
    const std::string instance = instance_with(machine.instances, options, problem);
    if (instance.empty()) return fail(options, problem);
    const std::string& station = options.words.front();
    if (!is_on(machine.instances.at(instance), "running")) {
        return fail(options, fmt::format("{} is not running; see: hal tdma status", instance));
    }

    Pinger pinger(*machine.client, instance, station);
    std::vector<double> times;
    std::uint64_t done = 0;
    Outcome last = Outcome::none;
    const std::uint64_t count = options.count == 0 ? usual_count : options.count;
    while (done < count && !stop.requested()) {
        if (done != 0 && stop.wait_ns(pause_ns)) break;
        last = pinger.ask(stop, problem);
        if (last == Outcome::none) break;
        ++done;
        if (last == Outcome::answered) {
            times.push_back(pinger.time());
        }
        if (!print(line_of(pinger, last, station, done))) return 1;
    }
    if (!problem.empty()) return fail(options, problem);
    if (done == 0) return 1;  // Ctrl-C
    if (!print(summary(instance, done, times))) return 1;
    if (!times.empty()) return 0;
    const auto now = stations_of(*machine.client, problem);
    const auto pins = now.find(instance);
    const bool is_gone = pins == now.end();
    return fail(options, explanation(last, is_gone ? machine.instances.at(instance) : pins->second,
                                     instance, station));
}

}  // namespace hal::tools
