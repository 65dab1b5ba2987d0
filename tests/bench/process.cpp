// SPDX-License-Identifier: MIT
#include "process.hpp"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <poll.h>
#include <sched.h>
#include <sstream>
#include <stdexcept>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include "sample.hpp"

namespace hal::bench {
namespace {

using Ends = std::array<int, 2>;

Ends make_pipe() {
    Ends ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    return ends;
}

/// vfork, because a parent with locked memory is slow to fork: everything the child needs is made
/// before.
pid_t spawn(const Start& start, int in, int out) {
    std::vector<char*> arguments, environment;
    for (const auto& a : start.arguments) {
        arguments.push_back(const_cast<char*>(a.c_str()));
    }
    arguments.push_back(nullptr);
    for (const auto& e : start.environment) {
        environment.push_back(const_cast<char*>(e.c_str()));
    }
    // the first of two equal names counts for getenv
    for (char** e = environ; *e; ++e) {
        environment.push_back(*e);
    }
    environment.push_back(nullptr);
    cpu_set_t all;
    CPU_ZERO(&all);
    // the system takes those that exist
    for (std::size_t cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
        CPU_SET(cpu, &all);
    }
    const int null = open("/dev/null", O_RDWR | O_CLOEXEC);
    const pid_t pid = vfork();
    if (pid == 0) {
        dup2(in >= 0 ? in : null, STDIN_FILENO);
        dup2(out >= 0 ? out : null, STDOUT_FILENO);
        dup2(null, STDERR_FILENO);
        if (start.everywhere) {
            sched_setaffinity(0, sizeof all, &all);
        }
        // not setuid(): glibc's notifies all threads, and those are the parent's
        if (start.user != static_cast<uid_t>(-1) &&
            (syscall(SYS_setgroups, 0, nullptr) != 0 || syscall(SYS_setuid, start.user) != 0)) {
            _exit(126);
        }
        execvpe(arguments[0], arguments.data(), environment.data());
        _exit(127);
    }
    close(null);
    return pid;
}

int status_of(int status) {
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace

std::string find_program(const std::string& name) {
    const char* const path = std::getenv("PATH");
    std::istringstream folders(std::string(path ? path : "/usr/bin:/bin") + ":/usr/sbin");
    for (std::string folder; std::getline(folders, folder, ':');) {
        if (const std::string file = folder + "/" + name; access(file.c_str(), X_OK) == 0) {
            return file;
        }
    }
    return "";
}

Finished run(const Start& start, double max_ms) {
    const Ends out = make_pipe();
    Finished finished;
    const Stopwatch watch;
    const pid_t pid = spawn(start, -1, out[1]);
    close(out[1]);
    if (pid < 0) {
        close(out[0]);
        return finished;
    }
    bool open = true;
    std::array<char, 65536> buffer;
    while (open) {
        pollfd wait{out[0], POLLIN, 0};
        const double left = max_ms - watch.ms();
        if (left <= 0 || poll(&wait, 1, static_cast<int>(left) + 1) == 0) break;
        const ssize_t n = read(out[0], buffer.data(), buffer.size());
        if (n > 0) {
            finished.out.append(buffer.data(), static_cast<std::size_t>(n));
        } else {
            open = n < 0 && errno == EINTR;
        }
    }
    close(out[0]);
    if (open) {
        kill(pid, SIGKILL);
    }
    int status = 0;
    waitpid(pid, &status, 0);
    finished.ms = watch.ms();
    finished.status = open ? -1 : status_of(status);
    return finished;
}

std::string find_python(const std::string& packages) {
    const auto has_them = [&](const std::string& python) {
        return run({.arguments = {python, "-c", "import " + packages}}).status == 0;
    };
    if (const char* const named = std::getenv("HALCYON_PYTHON")) {
        return has_them(named) ? named : "";
    }
    for (const std::string& python :
         {find_program("python3"), std::string(HALCYON_SOURCE "/build/peers/bin/python")}) {
        if (!python.empty() && has_them(python)) return python;
    }
    return "";
}

Child::Child(const Start& start, bool talk) {
    if (!talk) {
        pid_ = spawn(start, -1, -1);
        return;
    }
    const Ends in = make_pipe();
    const Ends out = make_pipe();
    pid_ = spawn(start, in[0], out[1]);
    close(in[0]);
    close(out[1]);
    in_ = in[1];
    out_ = out[0];
}

Child::~Child() { end(); }

bool Child::alive() {
    if (pid_ > 0 && waitpid(pid_, nullptr, WNOHANG) != 0) {
        pid_ = -1;
    }
    return pid_ > 0;
}

void Child::write(const std::string& text) {
    if (::write(in_, text.data(), text.size()) < 0) {
        throw std::runtime_error("a program under measurement has ended");
    }
}

std::optional<std::string> Child::line(int max_ms) {
    for (;;) {
        if (const auto end = read_.find('\n'); end != std::string::npos) {
            std::string line = read_.substr(0, end);
            read_.erase(0, end + 1);
            return line;
        }
        pollfd wait{out_, POLLIN, 0};
        std::array<char, 4096> buffer;
        if (poll(&wait, 1, max_ms) <= 0) return std::nullopt;
        const ssize_t n = read(out_, buffer.data(), buffer.size());
        if (n <= 0) return std::nullopt;
        read_.append(buffer.data(), static_cast<std::size_t>(n));
    }
}

void Child::end() {
    if (in_ >= 0) {
        close(in_);
    }
    if (out_ >= 0) {
        close(out_);
    }
    in_ = out_ = -1;
    if (pid_ <= 0) return;
    kill(pid_, SIGTERM);
    for (const Stopwatch watch; waitpid(pid_, nullptr, WNOHANG) == 0;
         std::this_thread::sleep_for(std::chrono::milliseconds(2))) {
        if (watch.ms() > 2000) {
            kill(pid_, SIGKILL);
        }
    }
    pid_ = -1;
}

TemporaryFolder::TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "hal-bench-XXXXXX").string();
    if (!mkdtemp(pattern.data())) throw std::runtime_error("no temporary folder: " + pattern);
    path_ = pattern;
    std::filesystem::permissions(path_, std::filesystem::perms::all);
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

std::string TemporaryFolder::file(const std::string& name, const std::string& text) const {
    const std::string path = path_ + "/" + name;
    std::ofstream(path) << text;
    return path;
}

}  // namespace hal::bench
