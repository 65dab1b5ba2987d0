// SPDX-License-Identifier: MIT
#include "trace/sched.hpp"

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fcntl.h>
#include <fmt/core.h>
#include <fstream>
#include <sys/stat.h>
#include <unistd.h>

namespace hal::tools {

namespace {

bool write_word(const std::string& path, std::string_view word) {
    const int file = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (file < 0) return false;
    const bool good = ::write(file, word.data(), word.size()) == static_cast<ssize_t>(word.size());
    ::close(file);
    return good;
}

/// Returns the text between `key` and the next blank.
std::string_view value_of(std::string_view line, std::string_view key) {
    const auto at = line.find(key);
    if (at == line.npos) {
        return {};
    }
    line.remove_prefix(at + key.size());
    return line.substr(0, line.find(' '));
}

template <class T>
bool read_number(std::string_view text, T& to) {
    return std::from_chars(text.data(), text.data() + text.size(), to).ec == std::errc{};
}

/// The kernel's bits for the letters of prev_state: R 0, S 1, D 2, T 4, t 8, X 16, Z 32, I 128.
std::int64_t state_of(std::string_view letters) {
    if (letters.empty()) return 0;
    static constexpr std::pair<char, std::int64_t> states[] = {
        {'S', 1}, {'D', 2}, {'T', 4}, {'t', 8}, {'X', 16}, {'Z', 32}, {'I', 128}};
    for (const auto& [letter, bits] : states) {
        if (letters[0] == letter) return bits;
    }
    return 0;
}

}  // namespace

std::optional<Switch> read_switch(std::string_view line) {
    // "          <idle>-0       [001] d..2.  1234.567890: sched_switch: prev_comm=swapper/1 prev_pid=0 prev_prio=120 prev_state=R ==> next_comm=servo next_pid=77 next_prio=1"
    const auto kind = line.find(": sched_switch: ");
    const auto cpu = line.find(" [");
    if (kind == line.npos || cpu == line.npos || cpu > kind) return std::nullopt;
    Switch one;
    const auto blank = line.rfind(' ', kind);
    double seconds = 0;
    if (!read_number(line.substr(cpu + 2), one.cpu) ||
        !read_number(line.substr(blank + 1, kind - blank - 1), seconds)) {
        return std::nullopt;
    }
    one.time_ns = std::llround(seconds * 1e9);
    const std::string_view what = line.substr(kind);
    const auto arrow = what.find(" ==> ");
    if (arrow == what.npos) return std::nullopt;
    const std::string_view before = what.substr(0, arrow);
    const std::string_view after = what.substr(arrow);
    // a name may have blanks
    const auto comm = [](std::string_view part, std::string_view key, std::string_view next) {
        const auto begin = part.find(key);
        const auto end = part.find(next);
        return begin == part.npos || end == part.npos
                   ? std::string{}
                   : std::string(part.substr(begin + key.size(), end - begin - key.size()));
    };
    one.previous_name = comm(before, "prev_comm=", " prev_pid=");
    one.next_name = comm(after, "next_comm=", " next_pid=");
    one.previous_state = state_of(value_of(before, "prev_state="));
    if (!read_number(value_of(before, "prev_pid="), one.previous_tid) ||
        !read_number(value_of(before, "prev_prio="), one.previous_priority) ||
        !read_number(value_of(after, "next_pid="), one.next_tid) ||
        !read_number(value_of(after, "next_prio="), one.next_priority)) {
        return std::nullopt;
    }
    return one;
}

std::string SchedulerEvents::open() {
    std::string problem =
        "tracefs is not mounted; type: sudo mount -t tracefs nodev /sys/kernel/tracing";
    for (const char* root : {"/sys/kernel/tracing", "/sys/kernel/debug/tracing"}) {
        if (::access((std::string(root) + "/events/sched/sched_switch").c_str(), F_OK) != 0) {
            if (errno == EACCES) {
                problem = fmt::format("{} may not be read; run it as root", root);
            }
            continue;
        }
        const std::string folder = fmt::format("{}/instances/halcyon-{}", root, ::getpid());
        if (::mkdir(folder.c_str(), 0700) != 0) {
            problem = fmt::format("{}/instances may not be written: {}; run it as root", root,
                                  std::strerror(errno));
            continue;
        }
        folder_ = folder;
        if (!write_word(folder + "/trace_clock", "boot") ||
            !write_word(folder + "/buffer_size_kb", "4096") ||
            !write_word(folder + "/events/sched/sched_switch/enable", "1")) {
            return fmt::format("{} rejects the event sched_switch: {}", folder,
                               std::strerror(errno));
        }
        pipe_ = ::open((folder + "/trace_pipe").c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
        return pipe_ >= 0
                   ? ""
                   : fmt::format("cannot read {}/trace_pipe: {}", folder, std::strerror(errno));
    }
    return problem;
}

SchedulerEvents::~SchedulerEvents() {
    if (pipe_ >= 0) {
        ::close(pipe_);
    }
    if (folder_.empty()) return;
    write_word(folder_ + "/events/sched/sched_switch/enable", "0");
    ::rmdir(folder_.c_str());
}

std::vector<Switch> SchedulerEvents::take() {
    std::vector<Switch> all;
    if (pipe_ < 0) return all;
    char block[1 << 16];
    for (ssize_t n = 0; (n = ::read(pipe_, block, sizeof block)) > 0;) {
        rest_.append(block, static_cast<std::size_t>(n));
        std::size_t begin = 0;
        for (std::size_t end; (end = rest_.find('\n', begin)) != std::string::npos;
             begin = end + 1) {
            if (auto one = read_switch(std::string_view(rest_).substr(begin, end - begin))) {
                all.push_back(std::move(*one));
            }
        }
        rest_.erase(0, begin);
    }
    return all;
}

std::optional<ThreadTimes> thread_times(std::int64_t pid, int tid) {
    std::ifstream file(fmt::format("/proc/{}/task/{}/schedstat", pid, tid));
    ThreadTimes times;
    return file >> times.ran_ns >> times.waited_ns ? std::optional(times) : std::nullopt;
}

}  // namespace hal::tools
