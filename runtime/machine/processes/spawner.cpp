// SPDX-License-Identifier: MIT
#include "machine/processes/spawner.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <fcntl.h>
#include <new>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "execute/process_setup.hpp"
#include "linuxcnc/find/programs.hpp"
#include "machine/load/plugins.hpp"
#include "machine/processes/programs.hpp"
#include "paths.hpp"

namespace hal {
namespace {

/// `folders` before those of a variable like PATH, as far as they are there and not among those
/// already.
std::string with_folders(const char* variable, const std::vector<std::string>& folders) {
    const char* const before = std::getenv(variable);
    const std::string there = before ? before : "";
    std::string all;
    for (const std::string& folder : folders) {
        std::error_code ignored;
        if ((":" + there + ":").find(":" + folder + ":") == std::string::npos &&
            std::filesystem::is_directory(folder, ignored)) {
            all += folder + ":";
        }
    }
    all += there;
    if (all.ends_with(':')) {
        all.pop_back();
    }
    return all;
}

/// Where the Python module may be: beside the program first, so that a build tree or an
/// installation that was moved finds its own.
std::vector<std::string> python_folders(const std::filesystem::path& programs) {
    for (const auto& folder :
         {programs / "../python", programs / paths::libraries_from_programs / "halcyon/python"}) {
        std::error_code none;
        if (std::filesystem::exists(folder / "hal/__init__.py", none)) {
            return {std::filesystem::canonical(folder, none).string()};
        }
    }
    return {std::string(paths::build_python), std::string(paths::install_python)};
}

/// The environment of a child: ours, plus which instance started it, so that `hal shell` in it
/// talks to that one; our own programs and Python module are found; and it ends when the machine is
/// lost, unless the user wants otherwise.
std::vector<std::string> environment_of(const std::string& instance) {
    std::error_code ignored;
    const auto program = std::filesystem::read_symlink("/proc/self/exe", ignored);
    const char* const lost = std::getenv("HALCYON_LOST");
    const std::string linuxcnc = linuxcnc_folder();
    const std::pair<std::string, std::string> ours[] = {
        {"HALCYON_INSTANCE=", instance},
        {"HALCYON_LOST=", lost && *lost ? lost : "end"},
        {"HALCYON_PARENT=", std::to_string(getpid())},
        {"PATH=", with_folders("PATH", {linuxcnc.empty() ? linuxcnc : linuxcnc + "/bin",
                                        program.parent_path().string(), user_folder("bin")})},
        {"LD_LIBRARY_PATH=", with_folders("LD_LIBRARY_PATH", {linuxcnc})},
        {"PYTHONPATH=", with_folders("PYTHONPATH", python_folders(program.parent_path()))}};
    std::vector<std::string> all;
    for (char** entry = environ; *entry; ++entry) {
        if (std::none_of(std::begin(ours), std::end(ours), [&](const auto& one) {
            return std::string_view(*entry).starts_with(one.first);
        })) {
            all.push_back(*entry);
        }
    }
    for (const auto& [name, value] : ours) {
        if (!value.empty()) {
            all.push_back(name + value);
        }
    }
    return all;
}

/// Where the PATH of `environment` has the program; `name` itself when it is a path, or nowhere.
std::string program_in(const std::vector<std::string>& environment, const std::string& name) {
    if (name.find('/') != std::string::npos) return name;
    std::string not_executable;
    for (const std::string& entry : environment) {
        if (!entry.starts_with("PATH=")) continue;
        for (std::size_t at = 5, end = 0; at < entry.size(); at = end + 1) {
            end = std::min(entry.find(':', at), entry.size());
            const std::string file = entry.substr(at, end - at) + "/" + name;
            std::error_code ignored;
            if (!std::filesystem::is_regular_file(file, ignored)) continue;
            if (access(file.c_str(), X_OK) == 0) return file;
            if (not_executable.empty()) {
                not_executable = file;
            }
        }
    }
    return not_executable;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
    std::vector<char*> all;
    for (auto& text : texts) {
        all.push_back(text.data());
    }
    all.push_back(nullptr);
    return all;
}

}  // namespace

struct Spawner::Job {
    const char* file;
    char** arguments;
    char** environment;
    const char* directory;  // nullptr: ours
    int out, err;  // -1: ours
    bool keep_stdin;
    pid_t parent;
    pid_t pid;
    int error;
    bool done;
};

namespace {

// Bare system calls only: this runs in the parent's memory, where a sanitizer's wrappers would note
// what only the child does.
template <class T>
__attribute__((no_sanitize("address", "thread", "undefined"))) int child_main(void* given) {
    T& job = *static_cast<T*>(given);
    const auto fail = [&](int error)
                          __attribute__((no_sanitize("address", "thread", "undefined"))) {
        job.error = error;
        syscall(SYS_exit_group, 127);
    };
    unsigned long long as_it_was[8] = {};  // a kernel's sigaction: SIG_DFL, no flags, an empty mask
    for (int number = 1; number <= 64; ++number) {
        syscall(SYS_rt_sigaction, number, as_it_was, nullptr, 8);
    }
    syscall(SYS_prctl, PR_SET_PDEATHSIG, SIGTERM, 0, 0, 0);
    if (syscall(SYS_getppid) != job.parent) {
        fail(ECHILD);
    }
    if (!job.keep_stdin) {
        const long nothing = syscall(SYS_openat, AT_FDCWD, "/dev/null", O_RDONLY, 0);
        if (nothing < 0) {
            fail(errno);
        }
        if (nothing != 0) {
            syscall(SYS_dup3, nothing, 0, 0);
            syscall(SYS_close, nothing);
        }
    }
    if (job.out >= 0 && syscall(SYS_dup3, job.out, 1, 0) < 0) {
        fail(errno);
    }
    if (job.err >= 0 && syscall(SYS_dup3, job.err, 2, 0) < 0) {
        fail(errno);
    }
    if (job.directory && syscall(SYS_chdir, job.directory) < 0) {
        fail(errno);
    }
    // An ordinary program, whatever the thread that made it blocks or is scheduled as.
    const int ordinary_priority = 0;
    syscall(SYS_sched_setscheduler, 0, SCHED_OTHER, &ordinary_priority);
    syscall(SYS_rt_sigprocmask, SIG_SETMASK, &as_it_was[7], nullptr, 8);
    syscall(SYS_execve, job.file, job.arguments, job.environment);
    fail(errno);
    return 127;
}

}  // namespace

Spawner::Spawner() : stack_(new std::byte[stack_size]) {
    // signals are for the program's own thread, and none may come between
    sigset_t all_signals, before;
    sigfillset(&all_signals);
    pthread_sigmask(SIG_SETMASK, &all_signals, &before);
    try {
        thread_ = std::thread([this] { work(); });
    } catch (...) {
        pthread_sigmask(SIG_SETMASK, &before, nullptr);
        throw;
    }
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

Spawner::~Spawner() {
    {
        const std::scoped_lock lock(mutex_);
        ending_ = true;
        changed_.notify_all();
    }
    thread_.join();
}

void Spawner::work() {
    release_unused_stack();
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [&] { return ending_ || (job_ && !job_->done); });
        if (ending_) return;
        job_->pid = make_child(*job_);
        job_->done = true;
        changed_.notify_all();
    }
}

pid_t Spawner::make_child(Job& job) {
    job.parent = getpid();
    job.error = 0;
    const auto top =
        reinterpret_cast<std::uintptr_t>(stack_.get() + stack_size) & ~std::uintptr_t{15};
#ifdef __SANITIZE_THREAD__
    // The thread sanitizer takes every clone for a fork, and would ignore this thread from then on:
    // the child gets memory of its own.
    void* const page =
        mmap(nullptr, sizeof job, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (page == MAP_FAILED) {
        job.error = errno;
        return 0;
    }
    Job& shared = *new (page) Job(job);
    const pid_t pid =
        clone(child_main<Job>, reinterpret_cast<void*>(top), CLONE_VFORK | SIGCHLD, &shared);
    job.error = pid < 0 ? errno : shared.error;
    munmap(page, sizeof job);
#else
    const pid_t pid = clone(child_main<Job>, reinterpret_cast<void*>(top),
                            CLONE_VM | CLONE_VFORK | SIGCHLD, &job);
    if (pid < 0) {
        job.error = errno;
    }
#endif
    if (pid > 0 && job.error != 0) {
        siginfo_t ended{};
        waitid(P_PID, static_cast<id_t>(pid), &ended, WEXITED);
    }
    return pid > 0 && job.error == 0 ? pid : 0;
}

pid_t Spawner::start(const ProcessStart& start, const std::string& instance, std::string& problem) {
    auto arguments = start.arguments;
    auto environment = environment_of(instance);
    const std::string file = program_in(environment, arguments[0]);
    const auto argument_pointers = pointers(arguments);

    const auto environment_pointers = pointers(environment);
    if (file.empty()) {
        problem = std::strerror(ENOENT);
        return 0;
    }
    Job job{file.c_str(),
            const_cast<char**>(argument_pointers.data()),
            const_cast<char**>(environment_pointers.data()),
            start.directory.empty() ? nullptr : start.directory.c_str(),
            start.out,
            start.err,
            start.keep_stdin,
            0,
            0,
            0,
            false};
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !job_; });
    job_ = &job;
    changed_.notify_all();
    changed_.wait(lock, [&] { return job.done; });
    job_ = nullptr;
    changed_.notify_all();
    if (job.pid == 0) {
        problem = std::strerror(job.error);
    }
    return job.pid;
}

unsigned long long start_time(pid_t pid) {
    std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
    std::string text;
    std::getline(file, text, '\0');  // an iterator would throw when the process ends in between
    const auto behind_name = text.rfind(')');  // a name may have blanks and brackets
    if (behind_name == std::string::npos) return 0;
    std::size_t at = behind_name + 1;
    for (int field = 3; field <= 22; ++field) {
        at = text.find_first_not_of(' ', at);
        if (at == std::string::npos) return 0;
        if (field == 22) return std::strtoull(text.c_str() + at, nullptr, 10);
        at = text.find(' ', at);
    }
    return 0;
}

}  // namespace hal
