// SPDX-License-Identifier: MIT
// hal-guardian NAME FILE LINK REPORT PARENT: exchanges the telegrams of a Modbus line for the
// process PARENT, and sends the stop telegrams when that ends or no cycle runs.
//
// Three things end the exchange, whichever is first: `ending` in the image (unload), the end of the
// process (pidfd), and missing cycles (the heartbeat). Only the last one sees a process that hangs
// or is suspended. A process that is killed before this one runs has never been able to write: the
// component waits for StartState::accept().
#include <poll.h>
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <string>

#include "bus/guardian/parent_watch.hpp"
#include "bus/guardian/report.hpp"
#include "bus/guardian/resident.hpp"
#include "modbus/guardian/guardian_process.hpp"
#include "modbus/master/master.hpp"

namespace {

using namespace hal::modbus;
namespace bus = hal::bus;
namespace line = hal::line;
namespace link = hal::link;

constexpr std::int64_t millisecond = 1'000'000;
constexpr std::int64_t poll_ns = 5 * millisecond;  // of the heartbeat

class Guardian {
public:
    Guardian(const char* name, const char* report, const Bus& bus, const Plan& plan, Image image,
             line::Line& line, link::Descriptor parent)
        : name_(name),
          report_(report),
          bus_(bus),
          image_(image),
          line_(line),
          parent_(std::move(parent)),
          master_(bus, plan, image) {
        text_.reserve(4096);
    }

    /// Until the drives are stopped for good. Returns the exit code.
    int run() {
        master_.attach(line_, link::monotonic_ns());
        image_.header().phase.store(static_cast<std::uint32_t>(Phase::running),
                                    std::memory_order_release);
        image_.header().start.accept();
        while (true) {
            const std::int64_t now = link::monotonic_ns();
            watch(now);
            image_.header().turns.fetch_add(1, std::memory_order_relaxed);
            starvation_.turn();
            // read before work(), which then follows the stop that was requested before
            const bool is_ending = image_.header().requests.is_ending();
            const std::int64_t next = master_.work(now);
            if (master_.is_stopped()) {
                if (parent_.is_dead() || is_ending) return finish(now);
                if (!parent_.hangs() && !image_.header().requests.holds_any()) {
                    master_.release();
                }
            }
            wait(next - now);
        }
    }

private:
    void watch(std::int64_t now) {
        const ImageHeader& header = image_.header();
        // before the cycles: a thread that runs again counts one before its outputs are valid
        const bool has_outputs = header.outputs_valid.load(std::memory_order_acquire) != 0;
        const std::uint64_t cycles = header.cycles.count();
        switch (parent_.look(cycles, header.cycles.limit_ns(), has_outputs, now)) {
        case bus::ParentWatch::Change::none: break;
        case bus::ParentWatch::Change::died: begin(StopReason::death, now); break;
        case bus::ParentWatch::Change::hangs:
            // a stop that precedes the end must not begin anew because its machine runs no cycles
            if (!header.requests.is_ending()) {
                begin(StopReason::heartbeat, now);
            }
            break;
        }
    }

    void begin(StopReason reason, std::int64_t now) {
        if (reason_ == StopReason::none || reason == StopReason::death) {
            reason_ = reason;
        }
        begun_at_ = now;
        broadcasts_ = image_.header().broadcasts.load();
        master_.stop(reason, now);
    }

    void wait(std::int64_t ns) {
        const std::int64_t limit = std::clamp<std::int64_t>(ns, 20'000, poll_ns);
        pollfd fds[] = {{parent_.descriptor(), POLLIN, 0}, {line_.descriptor(), POLLIN, 0}};
        const timespec time = link::to_timespec(limit);
        ppoll(fds, 2, &time, nullptr);
    }

    /// Reports what was done, if the runtime cannot.
    int finish(std::int64_t now) {
        image_.header().phase.store(static_cast<std::uint32_t>(Phase::ended),
                                    std::memory_order_release);
        if (!parent_.is_dead()) return 0;
        char part[160];
        text_ = bus::report_time();
        text_ += "the process has ended";
        if (reason_ == StopReason::heartbeat) {
            text_ += " after its cycles had stopped";
        }
        if (!bus_.broadcast_stop.empty()) {
            text_ += broadcast_text();
        }
        for (std::size_t n = 0; n < bus_.slaves.size(); ++n) {
            const Slave& slave = bus_.slaves[n];
            if (slave.stop.empty()) continue;
            const bool stopped = image_.slave(n).stopped.load() != 0;
            std::snprintf(part, sizeof part, "; slave %u (%s) %s its stop telegrams", slave.unit,
                          slave.name.c_str(), stopped ? "acknowledged" : "did not acknowledge");
            text_ += part;
        }
        std::snprintf(part, sizeof part, "; %.1f ms", static_cast<double>(now - begun_at_) * 1e-6);
        text_ += part;
        bus::report_end(name_, report_, text_);
        return 0;
    }

    const char* broadcast_text() const {
        if (image_.header().broadcasts.load() != broadcasts_) {
            return "; the broadcast stop was sent";
        }
        return image_.header().line_open.load() == 0
                   ? "; the broadcast stop was not sent: the line is lost"
                   : "; the broadcast stop was not sent: the line does not accept it";
    }

    const char* name_;
    const char* report_;
    const Bus& bus_;
    Image image_;
    line::Line& line_;
    bus::ParentWatch parent_;
    bus::StarvationWatch starvation_;
    Master master_;
    StopReason reason_ = StopReason::none;
    std::int64_t begun_at_ = 0;
    std::uint32_t broadcasts_ = 0;  // before the stop
    std::string text_;
};

/// The guardian of a machine that has just ended may still send its stop telegrams.
line::Opened open_line(const char* address, const line::Options& options) {
    const std::int64_t limit = link::monotonic_ns() + 2'000 * millisecond;
    while (true) {
        line::Opened opened = line::open(address, options);
        if (opened || !opened.is_in_use || link::monotonic_ns() > limit) return opened;
        const timespec pause = link::to_timespec(50 * millisecond);
        nanosleep(&pause, nullptr);
    }
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 6) {
        std::fputs("hal-guardian is started by the component modbus; see docs/modbus.md\n", stderr);
        return 2;
    }
    bus::ignore_signals();
    link::Descriptor parent = bus::open_parent(argv[5]);
    if (!parent) return 1;  // it has ended already: nothing was written

    const ReadResult config = read(bus::read_guardian_text(), argv[2]);
    const Plan plan = make_plan(config.bus);
    if (!config.good()) return 1;
    void* const memory = bus::map_guardian_memory(Image::size_of(config.bus, plan));
    if (memory == nullptr) return 1;
    const Image image(memory, config.bus, plan, false);
    auto opened = open_line(argv[3], config.bus.line);
    if (!opened) return image.header().start.reject(opened.problem);
    bus::be_resident();
    Guardian guardian(argv[1], argv[4], config.bus, plan, image, *opened.line, std::move(parent));
    return guardian.run();
}
