// SPDX-License-Identifier: MIT
// hal-frame-guardian NAME LINK FRAMES CONFIRMATIONS ROUNDS EVERY_NS REPORT PARENT: sends the stop
// frames of a link when the process PARENT ends, when no cycle of it runs, or when it asks for it.
#include <poll.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
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
          parent_(std::move(parent)) {
        text_.reserve(4096);
    }

    /// Until there is nothing left to stop. Returns the exit code.
    int run() {
        show(Phase::watching);
        while (phase_ != Phase::ended) {
            const std::int64_t now = link::monotonic_ns();
            watch(now);
            const std::int64_t next = transmitter_.work(now);
            follow(now);
            memory_.turns.fetch_add(1, std::memory_order_relaxed);
            wait(next - now);
        }
        return 0;
    }

private:
    void show(Phase phase) {
        phase_ = phase;
        memory_.rounds.store(transmitter_.rounds_sent(), std::memory_order_relaxed);
        memory_.elapsed_ns.store(transmitter_.elapsed_ns(), std::memory_order_relaxed);
        memory_.reason.store(static_cast<std::uint32_t>(reason_), std::memory_order_relaxed);
        memory_.status.store(Status{phase, transmitter_.outcome(), stops_}.word(),
                             std::memory_order_release);
    }

    /// Begins a stop for each of its reasons.
    void watch(std::int64_t now) {
        const auto count = memory_.stop_count.load(std::memory_order_acquire);
        if (count != stop_count_) {
            stop_count_ = count;
            begin(static_cast<StopReason>(memory_.stop_reason.load(std::memory_order_relaxed)),
                  now);
        }
        const std::uint64_t cycles = memory_.heartbeat.load(std::memory_order_relaxed);
        // the frames were sent when the thread was stopped
        const bool stands = (memory_.stop_held.load() & bit_of(StopReason::fault)) != 0;
        switch (parent_.look(cycles, memory_.limit_ns.load(std::memory_order_relaxed),
                             cycles != 0 && !stands, now)) {
        case bus::ParentWatch::Change::none: break;
        case bus::ParentWatch::Change::died: begin(StopReason::death, now); break;
        case bus::ParentWatch::Change::hangs: begin(StopReason::heartbeat, now); break;
        }
    }

    void begin(StopReason reason, std::int64_t now) {
        had_hung_ = had_hung_ || reason == StopReason::heartbeat;
        reason_ = reason;
        begun_ns_ = now;
        ++stops_;
        transmitter_.begin(now);
        show(Phase::stopping);
    }

    /// Decides what comes behind the stop frames.
    void follow(std::int64_t now) {
        if (phase_ == Phase::stopping) {
            show(transmitter_.is_over() ? Phase::stopped : Phase::stopping);
        }
        // a request that came behind watch() is begun first
        const bool is_ending = memory_.ending.load(std::memory_order_acquire) != 0 &&
                               memory_.stop_count.load(std::memory_order_acquire) == stop_count_;
        if (parent_.is_dead() || is_ending) {
            const std::int64_t limit = parent_.is_dead() ? give_up_ns : unload_ns;
            if (phase_ == Phase::stopped || now - begun_ns_ > limit) {
                finish();
            }
        } else if (phase_ == Phase::stopped && !parent_.hangs() &&
                   memory_.stop_held.load(std::memory_order_acquire) == 0) {
            had_hung_ = false;
            show(Phase::watching);
        }
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
        char part[160];
        const std::uint32_t rounds = transmitter_.rounds_sent();
        if (rounds == 0) {
            std::snprintf(part, sizeof part, "the stop frames were not sent: %s is %s", address_,
                          transmitter_.link_state());
            text_ += part;
            return;
        }
        std::snprintf(part, sizeof part, "the stop frames were sent %u time%s", rounds,
                      rounds == 1 ? "" : "s");
        text_ += part;
        switch (transmitter_.outcome()) {
        case Outcome::confirmed: text_ += " and confirmed"; break;
        case Outcome::unconfirmed: text_ += " and not confirmed"; break;
        case Outcome::sending:
        case Outcome::delayed:
            text_ += "; then the link was ";
            text_ += transmitter_.link_state();
            break;
        default: break;
        }
        std::snprintf(part, sizeof part, "; %.1f ms",
                      static_cast<double>(transmitter_.elapsed_ns()) * 1e-6);
        text_ += part;
    }

    const char* name_;
    const char* report_;
    const char* address_;
    GuardianMemory& memory_;
    StopTransmitter& transmitter_;
    bus::ParentWatch parent_;
    Phase phase_ = Phase::starting;
    StopReason reason_ = StopReason::none;
    bool had_hung_ = false;  // before the end of the process
    std::uint32_t stop_count_ = 0;
    std::uint32_t stops_ = 0;
    std::int64_t begun_ns_ = 0;
    std::string text_;
};

/// Ends the start with a reason for the component.
int reject(GuardianMemory& memory, const std::string& problem) {
    std::strncpy(memory.problem.data(), problem.c_str(), memory.problem.size() - 1);
    memory.status.store(Status{Phase::ended}.word(), std::memory_order_release);
    return 1;
}

GuardianMemory* map_memory() {
    struct stat memory{};
    if (fstat(bus::guardian_memory_fd, &memory) != 0 ||
        static_cast<std::size_t>(memory.st_size) != sizeof(GuardianMemory)) {
        return nullptr;
    }
    void* const mapped = mmap(nullptr, sizeof(GuardianMemory), PROT_READ | PROT_WRITE,
                              MAP_SHARED | MAP_POPULATE, bus::guardian_memory_fd, 0);
    return mapped == MAP_FAILED ? nullptr : static_cast<GuardianMemory*>(mapped);
}

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
    if (!parent) return 1;  // it has ended already: nothing was started
    GuardianMemory* const memory = map_memory();
    if (memory == nullptr) return 1;

    StopFrames frames;
    std::string problem = parse(argv[3], argv[4], frames);
    if (!problem.empty()) return reject(*memory, problem);
    const StopSchedule schedule{.rounds = static_cast<std::uint32_t>(std::atoi(argv[5])),
                                .every_ns = std::atoll(argv[6])};
    StopTransmitter transmitter(std::move(frames), schedule);
    problem = transmitter.open(argv[2]);
    if (!problem.empty()) return reject(*memory, problem);
    bus::be_resident();
    Guardian guardian(argv[1], argv[7], argv[2], *memory, transmitter, std::move(parent));
    return guardian.run();
}
