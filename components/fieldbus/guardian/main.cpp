// SPDX-License-Identifier: MIT
// hal-frame-guardian NAME LINK FRAMES CONFIRMATIONS ROUNDS EVERY_NS REPORT PARENT: sends the stop
// frames of a link when the process PARENT ends, when no cycle of it runs, or when it asks for it.
#include <poll.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>

#include "bus/guardian/parent_watch.hpp"
#include "bus/guardian/report.hpp"
#include "bus/guardian/resident.hpp"
#include "fieldbus/guardian/guardian_process.hpp"

namespace {

using namespace hal::guardian;
namespace bus = hal::bus;
namespace link = hal::link;

constexpr std::int64_t longest_turn_ns = 5'000'000;

class Guardian {
public:
    Guardian(const char* name, const char* report, const char* address, GuardianMemory& memory,
             StopTransmitter& transmitter, link::Descriptor parent)
        : name_(name),
          report_(report),
          address_(address),
          memory_(memory),
          transmitter_(transmitter),
          parent_(std::move(parent)),
          previous_(memory.record.last()),
          begun_(previous_),
          stop_count_(memory.followed.load(std::memory_order_acquire)),
          stops_(previous_.status.stops) {
        text_.reserve(4096);
    }

    /// Until there is nothing left to stop. Returns the exit code.
    int run() {
        take_over(link::monotonic_ns());
        memory_.start.accept();
        while (phase_ != Phase::ended) {
            const std::int64_t now = link::monotonic_ns();
            watch(now);
            const std::int64_t next = transmitter_.work(now);
            follow(now);
            memory_.turns.fetch_add(1, std::memory_order_relaxed);
            starvation_.turn();
            wait(next - now);
        }
        return 0;
    }

private:
    /// Begins where a guardian that was killed has left off: watch() finds a request that this one
    /// had not followed to its end.
    void take_over(std::int64_t now) {
        const bool was_stopping = previous_.status.phase == Phase::stopping;
        const bool is_requested = memory_.requests.newest().count != stop_count_;
        if (!is_requested && (was_stopping || memory_.requests.holds_any())) {
            begin(begun_.reason, now);
        } else {
            show(Phase::watching);
        }
    }

    void show(Phase phase) {
        phase_ = phase;
        is_ready_ = transmitter_.is_ready();
        StopRecord record = previous_;
        if (transmitter_.outcome() != Outcome::none) {
            record.status.outcome = transmitter_.outcome();
            record.status.failure = transmitter_.failure();
            record.rounds = transmitter_.rounds_sent();
            record.elapsed_ns = transmitter_.elapsed_ns();
            record.unsent = transmitter_.unsent();
        }
        record.reason = begun_.reason;
        record.earlier = begun_.earlier;
        record.status.phase = phase;
        record.status.is_ready = is_ready_;
        record.status.sees_bus = transmitter_.sees_bus();
        record.status.stops = stops_;
        memory_.record.write(record);
    }

    /// Begins a stop for each of its reasons.
    void watch(std::int64_t now) {
        const bus::StopRequests::Request request = memory_.requests.newest();
        if (request.count != stop_count_) {
            stop_count_ = request.count;
            begin(request.reason, now);
        }
        // the frames were sent when the thread was stopped; read before the cycles (CycleCounter)
        const bool stands = memory_.requests.holds(StopReason::fault);
        const std::uint64_t cycles = memory_.cycles.count();
        switch (parent_.look(cycles, memory_.cycles.limit_ns(), cycles != 0 && !stands, now)) {
        case bus::ParentWatch::Change::none: break;
        case bus::ParentWatch::Change::died: begin(StopReason::death, now); break;
        case bus::ParentWatch::Change::hangs: begin(StopReason::heartbeat, now); break;
        }
    }

    void begin(StopReason reason, std::int64_t now) {
        had_hung_ = had_hung_ || reason == StopReason::heartbeat;
        begun_.begin(reason);
        begun_ns_ = now;
        ++stops_;
        transmitter_.begin(now);
        show(Phase::stopping);
    }

    /// Decides what comes behind the stop frames.
    void follow(std::int64_t now) {
        if (phase_ == Phase::stopping) {
            const bool is_over = transmitter_.is_over();
            show(is_over ? Phase::stopped : Phase::stopping);
            if (is_over) {
                memory_.followed.store(stop_count_, std::memory_order_release);
            }
        } else if (transmitter_.is_ready() != is_ready_) {
            show(phase_);
        }
        // a request that came behind watch() is begun first
        const bool is_ending =
            memory_.requests.is_ending() && memory_.requests.newest().count == stop_count_;
        if (parent_.is_dead() || is_ending) {
            if (phase_ == Phase::stopped || now - begun_ns_ > limit_ns()) {
                finish();
            }
        } else if (phase_ == Phase::stopped && !parent_.hangs() && !memory_.requests.holds_any()) {
            had_hung_ = false;
            show(Phase::watching);
        }
    }

    /// Returns how long the last stop may take.
    std::int64_t limit_ns() const {
        const std::int64_t tries_ns = parent_.is_dead() ? give_up_ns : unload_ns;
        return transmitter_.schedule().duration_ns() + tries_ns;
    }

    void wait(std::int64_t ns) {
        const std::int64_t limit = std::clamp<std::int64_t>(ns, 20'000, longest_turn_ns);
        pollfd fds[] = {{parent_.descriptor(), POLLIN, 0}, {transmitter_.descriptor(), POLLIN, 0}};
        const timespec time = link::to_timespec(limit);
        ppoll(fds, 2, &time, nullptr);
    }

    /// Ends, and reports what was done if the runtime cannot.
    void finish() {
        show(Phase::ended);
        if (!parent_.is_dead()) return;
        text_ = bus::report_time();
        text_ += "the process has ended";
        text_ += had_hung_ ? " after its cycles had stopped; " : "; ";
        describe();
        bus::report_end(name_, report_, text_);
    }

    void describe() {
        const std::uint32_t rounds = transmitter_.rounds_sent();
        if (rounds == 0) {
            text_ += "the stop frames were not sent on ";
            text_ += address_;
            append_failure(": ");
            return;
        }
        char part[160];
        std::snprintf(part, sizeof part, "the stop frames were %s %u time%s",
                      sent_text(transmitter_.sees_bus()), rounds, rounds == 1 ? "" : "s");
        text_ += part;
        switch (transmitter_.outcome()) {
        case Outcome::confirmed: text_ += " and confirmed"; break;
        case Outcome::unconfirmed: text_ += " and not confirmed"; break;
        case Outcome::sending:
        case Outcome::delayed: append_failure(", then no more: "); break;
        default: break;
        }
        std::snprintf(part, sizeof part, "; %.1f ms",
                      static_cast<double>(transmitter_.elapsed_ns()) * 1e-6);
        text_ += part;
    }

    /// Of the last attempt, if it has failed by now.
    void append_failure(const char* before) {
        if (transmitter_.failure() == Failure::none) return;
        text_ += before;
        append_unsent(text_, transmitter_.frames(), transmitter_.unsent(), transmitter_.failure());
    }

    const char* name_;
    const char* report_;
    const char* address_;
    GuardianMemory& memory_;
    StopTransmitter& transmitter_;
    bus::ParentWatch parent_;
    bus::StarvationWatch starvation_;
    const StopRecord previous_;  // of a guardian that was killed
    Phase phase_ = Phase::watching;
    StopRecord begun_;  // its reasons
    bool is_ready_ = false;
    bool had_hung_ = false;  // before the end of the process
    std::uint32_t stop_count_;
    std::uint32_t stops_;
    std::int64_t begun_ns_ = 0;
    std::string text_;
};

}  // namespace

int main(int argc, char** argv) {
    if (argc != 9) {
        std::fputs(
            "hal-frame-guardian is started by the component frame_guardian; type: hal doc "
            "frame_guardian\n",
            stderr);
        return 2;
    }
    bus::ignore_signals();
    link::Descriptor parent = bus::open_parent(argv[8]);
    auto* const memory =
        static_cast<GuardianMemory*>(bus::map_guardian_memory(sizeof(GuardianMemory)));
    if (memory == nullptr) return 1;
    // one that replaces another stops the devices also when the process has ended meanwhile
    if (!parent && memory->cycles.count() == 0) return 1;

    StopFrames frames;
    std::string problem = parse(argv[3], argv[4], frames);
    if (!problem.empty()) return memory->start.reject(problem);
    const StopSchedule schedule{.rounds = static_cast<std::uint32_t>(std::atoi(argv[5])),
                                .every_ns = std::atoll(argv[6])};
    StopTransmitter transmitter(std::move(frames), schedule);
    problem = transmitter.open(argv[2]);
    if (!problem.empty()) {
        if (!parent) {
            bus::report_end(argv[1], argv[7],
                            bus::report_time() +
                                "the process has ended; the stop frames were not "
                                "sent on " +
                                argv[2] + ": " + problem);
        }
        return memory->start.reject(problem);
    }
    bus::be_resident();
    Guardian guardian(argv[1], argv[7], argv[2], *memory, transmitter, std::move(parent));
    return guardian.run();
}
