// SPDX-License-Identifier: MIT
// hal-guardian NAME FILE LINK REPORT PARENT: exchanges the telegrams of a Modbus line for the
// process PARENT, and sends the stop telegrams when that ends or no cycle runs.
//
// Three things end the exchange, whichever is first: `ending` in the image (unload), the end of the
// process (pidfd), and missing cycles (the heartbeat). Only the last one sees a process that hangs
// or is suspended. A process that is killed before this one runs has never been able to write: the
// component waits for Phase::running.
#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <string>

#include "modbus/guardian/guardian_process.hpp"
#include "modbus/guardian/heartbeat.hpp"
#include "modbus/master/master.hpp"

namespace {

using namespace hal::modbus;
namespace line = hal::line;
namespace link = hal::link;

constexpr std::int64_t millisecond = 1'000'000;
constexpr std::int64_t poll_ns = 5 * millisecond;  // of the heartbeat

/// Nothing ends the guardian before it has stopped the drives.
void ignore_signals() {
    for (const int signal :
         {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE, SIGUSR1, SIGUSR2, SIGTSTP}) {
        ::signal(signal, SIG_IGN);
    }
}

/// Each of these is an improvement that the system may deny.
void be_resident() {
    mlockall(MCL_CURRENT | MCL_FUTURE);
    const sched_param priority{.sched_priority = 10};
    if (sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &priority) != 0) {
        setpriority(PRIO_PROCESS, 0, -10);
    }
    const int fd = ::open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC);
    if (fd >= 0) {
        [[maybe_unused]] const ssize_t written = ::write(fd, "-1000", 5);
        ::close(fd);
    }
}

std::string read_all(int fd) {
    std::string text;
    std::array<char, 4096> part;
    lseek(fd, 0, SEEK_SET);
    while (true) {
        const ssize_t count = ::read(fd, part.data(), part.size());
        if (count <= 0) return text;
        text.append(part.data(), static_cast<std::size_t>(count));
    }
}

/// Time during which the system was suspended: drives go on meanwhile.
std::int64_t suspended_ns() {
    return link::clock_ns(CLOCK_BOOTTIME) - link::clock_ns(CLOCK_MONOTONIC);
}

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
        suspended_ = suspended_ns();
        image_.header().phase.store(static_cast<std::uint32_t>(Phase::running),
                                    std::memory_order_release);
        while (true) {
            const std::int64_t now = link::monotonic_ns();
            watch(now);
            image_.header().turns.fetch_add(1, std::memory_order_relaxed);
            const std::int64_t next = master_.work(now);
            if (master_.is_stopped()) {
                if (is_dead_ || image_.header().ending.load(std::memory_order_acquire) != 0) {
                    return finish(now);
                }
                if (!is_hung_ && image_.header().stop_held.load(std::memory_order_acquire) == 0) {
                    master_.release();
                }
            }
            wait(next - now);
        }
    }

private:
    void watch(std::int64_t now) {
        const ImageHeader& header = image_.header();
        if (!is_dead_ && link::readable_within(parent_.get(), 0)) {
            is_dead_ = true;
            begin(StopReason::death, now);
        }
        const std::int64_t suspended = suspended_ns();
        const bool resumed = suspended - suspended_ > 100 * millisecond;
        suspended_ = suspended;
        const bool missing =
            heartbeat_.is_missing(header.heartbeat.load(std::memory_order_relaxed),
                                  header.limit_ns.load(std::memory_order_relaxed), now);
        const bool writes = header.outputs_valid.load(std::memory_order_acquire) != 0;
        const bool hangs = writes && (missing || resumed);
        if (hangs && !is_hung_ && !is_dead_) {
            begin(StopReason::heartbeat, now);
        }
        is_hung_ = hangs;
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
        pollfd fds[] = {{is_dead_ ? -1 : parent_.get(), POLLIN, 0},
                        {line_.descriptor(), POLLIN, 0}};
        const timespec time = link::to_timespec(limit);
        ppoll(fds, 2, &time, nullptr);
    }

    /// Reports what was done, if the runtime cannot.
    int finish(std::int64_t now) {
        image_.header().phase.store(static_cast<std::uint32_t>(Phase::ended),
                                    std::memory_order_release);
        if (!is_dead_) return 0;
        char part[160];
        time_t seconds = time(nullptr);
        tm local{};
        localtime_r(&seconds, &local);
        strftime(part, sizeof part, "%Y-%m-%d %H:%M:%S, ", &local);
        text_ = part;
        text_ += "the process has ended";
        if (reason_ == StopReason::heartbeat) {
            text_ += " after its cycles had stopped";
        }
        if (!bus_.broadcast_stop.empty()) {
            const bool was_sent = image_.header().broadcasts.load() != broadcasts_;
            text_ += was_sent ? "; the broadcast stop was sent"
                              : "; the broadcast stop was not sent: the line is lost";
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
        dprintf(STDERR_FILENO, "%s: guardian: %s\n", name_, text_.c_str());
        keep();
        return 0;
    }

    void keep() {
        if (report_[0] == '\0') return;
        const link::Descriptor fd(
            ::open(report_, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600));
        if (fd) {
            dprintf(fd.get(), "%s\n", text_.c_str());
        }
    }

    const char* name_;
    const char* report_;
    const Bus& bus_;
    Image image_;
    line::Line& line_;
    link::Descriptor parent_;
    Master master_;
    Heartbeat heartbeat_;
    bool is_dead_ = false;
    bool is_hung_ = false;
    StopReason reason_ = StopReason::none;
    std::int64_t begun_at_ = 0;
    std::uint32_t broadcasts_ = 0;  // before the stop
    std::int64_t suspended_ = 0;
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

/// Ends the start with a reason for the component.
int reject(const Image& image, const std::string& problem) {
    ImageHeader& header = image.header();
    std::strncpy(header.problem.data(), problem.c_str(), header.problem.size() - 1);
    header.phase.store(static_cast<std::uint32_t>(Phase::ended), std::memory_order_release);
    return 1;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 6) {
        std::fputs("hal-guardian is started by the component modbus; see docs/modbus.md\n", stderr);
        return 2;
    }
    ignore_signals();
    // nothing of the runtime but the two descriptors of this process
    syscall(SYS_close_range, guardian_text_fd + 1, ~0U, 0);
    const auto parent_pid = static_cast<pid_t>(atoi(argv[5]));
    link::Descriptor parent(static_cast<int>(syscall(SYS_pidfd_open, parent_pid, 0)));
    if (!parent || getppid() != parent_pid) return 1;  // it has ended already: nothing was written

    const ReadResult config = read(read_all(guardian_text_fd), argv[2]);
    struct stat memory{};
    const Plan plan = make_plan(config.bus);
    const std::size_t size = Image::size_of(config.bus, plan);
    if (!config.good() || fstat(guardian_memory_fd, &memory) != 0 ||
        static_cast<std::size_t>(memory.st_size) != size) {
        return 1;
    }
    void* const mapped = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE,
                              guardian_memory_fd, 0);
    if (mapped == MAP_FAILED) return 1;
    const Image image(mapped, config.bus, plan, false);
    auto opened = open_line(argv[3], config.bus.line);
    if (!opened) return reject(image, opened.problem);
    be_resident();
    Guardian guardian(argv[1], argv[4], config.bus, plan, image, *opened.line, std::move(parent));
    return guardian.run();
}
