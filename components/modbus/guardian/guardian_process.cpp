// SPDX-License-Identifier: MIT
#include "guardian_process.hpp"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "hal/read_file.hpp"

extern char** environ;

namespace hal::modbus {

namespace {

constexpr std::int64_t arm_ns = 3'000'000'000;
constexpr std::int64_t end_ns = 15'000'000'000;

link::Descriptor open_process(pid_t pid) {
    return link::Descriptor(static_cast<int>(syscall(SYS_pidfd_open, pid, 0)));
}

/// The attributes of the process: a session of its own, so that Ctrl-C and a closed terminal miss
/// it, and no signal mask of the runtime.
struct Attributes {
    Attributes() {
        posix_spawnattr_init(&attributes);
        posix_spawn_file_actions_init(&actions);
        sigset_t empty;
        sigemptyset(&empty);
        posix_spawnattr_setsigmask(&attributes, &empty);
        sigset_t all;
        sigfillset(&all);
        posix_spawnattr_setsigdefault(&attributes, &all);
        posix_spawnattr_setflags(
            &attributes, POSIX_SPAWN_SETSID | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    }
    ~Attributes() {
        posix_spawnattr_destroy(&attributes);
        posix_spawn_file_actions_destroy(&actions);
    }
    posix_spawnattr_t attributes;
    posix_spawn_file_actions_t actions;
};

}  // namespace

std::string report_file(const std::string& link) {
    namespace fs = std::filesystem;
    const char* const state = std::getenv("XDG_STATE_HOME");
    const char* const home = std::getenv("HOME");
    fs::path folder;
    if (state != nullptr && state[0] == '/') {
        folder = state;
    } else if (home != nullptr && home[0] == '/') {
        folder = fs::path(home) / ".local/state";
    } else {
        return {};
    }
    folder /= "halcyon";
    std::error_code none;
    fs::create_directories(folder, none);
    std::string name = "guardian-" + link;
    std::replace_if(name.begin(), name.end(),
                    [](char c) { return c == '/' || c == ':' || c == '?' || c == '&'; }, '-');
    return (folder / name).string();
}

std::string take_report(const std::string& file) {
    std::string text;
    if (file.empty() || !read_regular_file(file, 4096, text)) return {};
    ::unlink(file.c_str());
    while (!text.empty() && text.back() == '\n') {
        text.pop_back();
    }
    return text;
}

GuardianProcess::~GuardianProcess() {
    end();
    if (memory_ != nullptr) {
        munmap(memory_, size_);
    }
}

std::string GuardianProcess::start(const GuardianArguments& arguments, const std::string& text,
                                   const Bus& bus, const Plan& plan) {
    size_ = Image::size_of(bus, plan);
    const link::Descriptor memory(memfd_create("modbus-image", MFD_CLOEXEC));
    const link::Descriptor config(memfd_create("modbus-config", MFD_CLOEXEC));
    if (!memory || !config || ftruncate(memory.get(), static_cast<off_t>(size_)) != 0 ||
        write(config.get(), text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
        return "no memory for the guardian: " + link::reason();
    }
    void* const mapped =
        mmap(nullptr, size_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, memory.get(), 0);
    if (mapped == MAP_FAILED) return "no memory for the guardian: " + link::reason();
    memory_ = mapped;
    image_ = Image(memory_, bus, plan, true);

    Attributes spawn;
    // dup2 onto the same number would keep O_CLOEXEC, so both go through numbers above
    const link::Descriptor memory_copy(fcntl(memory.get(), F_DUPFD_CLOEXEC, 16));
    const link::Descriptor config_copy(fcntl(config.get(), F_DUPFD_CLOEXEC, 16));
    posix_spawn_file_actions_adddup2(&spawn.actions, memory_copy.get(), guardian_memory_fd);
    posix_spawn_file_actions_adddup2(&spawn.actions, config_copy.get(), guardian_text_fd);
    posix_spawn_file_actions_addopen(&spawn.actions, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&spawn.actions, 1, "/dev/null", O_WRONLY, 0);
    const std::string parent = std::to_string(getpid());
    std::array<const char*, 7> argv = {arguments.program.c_str(),
                                       arguments.name.c_str(),
                                       arguments.file.c_str(),
                                       arguments.link.c_str(),
                                       arguments.report.c_str(),
                                       parent.c_str(),
                                       nullptr};
    const int error = posix_spawn(&pid_, arguments.program.c_str(), &spawn.actions,
                                  &spawn.attributes, const_cast<char**>(argv.data()), environ);
    if (error != 0) {
        pid_ = -1;
        return "cannot start the guardian '" + arguments.program + "': " + link::reason(error);
    }
    process_ = open_process(pid_);
    const std::int64_t limit = link::monotonic_ns() + arm_ns;
    const ImageHeader& header = image_.header();
    while (header.phase.load(std::memory_order_acquire) ==
           static_cast<std::uint32_t>(Phase::starting)) {
        const bool ended = has_ended_within(2'000'000);
        if (!ended && link::monotonic_ns() < limit) continue;
        if (header.phase.load() != static_cast<std::uint32_t>(Phase::starting)) break;
        end();
        return ended ? "the guardian has ended during its start"
                     : "the guardian did not start within 3 s";
    }
    if (header.phase.load() == static_cast<std::uint32_t>(Phase::ended)) {
        std::string problem(header.problem.data());
        end();
        return problem;
    }
    return {};
}

bool GuardianProcess::has_ended_within(std::int64_t limit_ns) noexcept {
    if (pid_ < 0) return true;
    if (!link::readable_within(process_.get(), limit_ns)) return false;
    waitpid(pid_, nullptr, WNOHANG);
    pid_ = -1;
    return true;
}

void GuardianProcess::resume() const noexcept {
    if (process_) {
        syscall(SYS_pidfd_send_signal, process_.get(), SIGCONT, nullptr, 0);
    }
}

bool GuardianProcess::end() noexcept {
    if (pid_ < 0) return true;
    resume();
    image_.header().ending.store(1, std::memory_order_release);
    image_.stop(StopReason::unload);
    if (has_ended_within(end_ns)) return true;
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    pid_ = -1;
    return false;
}

}  // namespace hal::modbus
