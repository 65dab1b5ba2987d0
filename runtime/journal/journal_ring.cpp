// SPDX-License-Identifier: MIT
#include "journal/journal_ring.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fmt/core.h>
#include <fstream>
#include <sched.h>
#include <spawn.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <system_error>
#include <unistd.h>
#include <utility>

#include "hal/clock.hpp"
#include "journal/journal_join.hpp"

namespace hal {
namespace {

namespace fs = std::filesystem;

constexpr auto look_every = std::chrono::milliseconds(100);
constexpr std::int64_t parts_per_keep = 4;
constexpr std::int64_t min_part_ns = 1'000'000'000;
/// Cycles of other threads that the newest ones read may be in the next file.
constexpr std::int64_t margin_ns = 300'000'000;

constexpr std::int64_t after_fault_ns = 2'000'000'000;
constexpr std::uint32_t max_fault_files = 10;

/// Returns the last line of a file; "" when it has none.
std::string last_line(const std::string& path) {
    std::ifstream file(path);
    std::string last;
    for (std::string line; std::getline(file, line);) {
        last = line.empty() ? last : line;
    }
    return last;
}

/// Returns why the process that has ended with `status` has not written the journal again, or "".
std::string why_cut_failed(int status, const std::string& log) {
    if (WIFSIGNALED(status)) {
        return fmt::format("its re-execution was terminated by signal {}", WTERMSIG(status));
    }
    if (WEXITSTATUS(status) == 0) return "";
    const std::string why = last_line(log);
    return why.empty()
               ? fmt::format("its re-execution ended with exit status {}", WEXITSTATUS(status))
               : why;
}

/// Returns the first of the names NAME(1), NAME(2) … that nothing has.
template <class Name>
std::string free_name(Name name) {
    std::error_code ignored;
    for (int number = 1;; ++number) {
        std::string found = name(number);
        if (!fs::exists(found, ignored)) return found;
    }
}

/// Returns a descriptor of a folder that this process has locked; -1 with errno, EWOULDBLOCK when
/// another process has it. A file system may have no locks.
int locked_folder(const std::string& folder) {
    const int file = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (file < 0 || ::flock(file, LOCK_EX | LOCK_NB) == 0) return file;
    const int error = errno;
    ::close(file);
    errno = error;
    return -1;
}

std::string is_used(const std::string& path, const std::string& folder) {
    return fmt::format(
        "cannot write '{}': another machine keeps its journal in '{}'; end that machine, or name "
        "another file",
        path, folder);
}

/// Starts a program that has the CPUs only when nothing else wants them. Returns its process, 0 if
/// it cannot be started.
pid_t start_idle(const std::vector<std::string>& words, const std::string& log) {
    std::vector<char*> arguments;
    for (const std::string& word : words) {
        arguments.push_back(const_cast<char*>(word.c_str()));
    }
    arguments.push_back(nullptr);
    posix_spawnattr_t how;
    posix_spawn_file_actions_t files;
    if (posix_spawnattr_init(&how) != 0) return 0;
    if (posix_spawn_file_actions_init(&files) != 0) {
        posix_spawnattr_destroy(&how);
        return 0;
    }
    const sched_param none{};
    posix_spawnattr_setschedpolicy(&how, SCHED_IDLE);
    posix_spawnattr_setschedparam(&how, &none);
    posix_spawnattr_setpgroup(&how, 0);  // Ctrl-C is for the machine
    sigset_t signals;
    sigemptyset(&signals);
    posix_spawnattr_setsigmask(&how, &signals);
    posix_spawnattr_setflags(
        &how, POSIX_SPAWN_SETSCHEDULER | POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK);
    posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, log.c_str(),
                                     O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
    pid_t process = 0;
    const int error =
        ::posix_spawn(&process, arguments[0], &files, &how, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&how);
    return error == 0 ? process : 0;
}

}  // namespace

JournalRing::JournalRing(std::string path, std::int64_t keep_ns)
    : path_(std::move(path)),
      folder_(path_ + ".ring"),
      keep_ns_(keep_ns),
      part_ns_(std::max(keep_ns / parts_per_keep, min_part_ns)) {
    std::error_code error;
    if (fs::exists(folder_, error)) {
        keep_folder();
    }
    if (problem_.empty()) {
        take_folder();
    }
}

void JournalRing::keep_folder() {
    const int lock = locked_folder(folder_);
    if (lock < 0 && errno == EWOULDBLOCK) {
        problem_ = is_used(path_, folder_);
        return;
    }
    kept_ = free_name([this](int number) { return fmt::format("{}.{}", folder_, number); });
    std::error_code error;
    fs::rename(folder_, kept_, error);
    if (error) {
        problem_ = fmt::format("cannot rename '{}' to '{}': {}", folder_, kept_, error.message());
    }
    if (lock >= 0) {
        ::close(lock);
    }
}

void JournalRing::take_folder() {
    std::error_code error;
    const bool is_new = fs::create_directory(folder_, error);
    if (error) {
        problem_ = fmt::format("cannot create '{}': {}", folder_, error.message());
        return;
    }
    lock_ = is_new ? locked_folder(folder_) : -1;
    const bool is_others = !is_new || (lock_ < 0 && errno == EWOULDBLOCK);
    if (is_others) {
        problem_ = is_used(path_, folder_);
    }
}

JournalRing::~JournalRing() {
    end();
    if (lock_ >= 0) {
        ::close(lock_);
    }
}

std::string JournalRing::path_of(std::uint32_t number) const {
    return fmt::format("{}/{:06}.mcap", folder_, number);
}

std::vector<std::string> JournalRing::paths(bool with_current) const {
    std::vector<std::string> all;
    for (const Part& part : parts_) {
        all.push_back(path_of(part.number));
    }
    if (!with_current) return all;
    // none when the newest file could not be created, as on a full disk
    const std::string current = path_of(current_) + ".part";
    std::error_code ignored;
    if (fs::exists(current, ignored)) {
        all.push_back(current);
    }
    return all;
}

void JournalRing::begin(ExecutionJournal& journal, Machine machine) {
    journal_ = &journal;
    machine_ = std::move(machine);
    begun_ns_ = monotonic_ns();
    thread_ = std::thread([this] { work(); });
}

void JournalRing::work() {
    std::unique_lock own(mutex_);
    while (!ends_) {
        wake_.wait_for(own, look_every);
        if (ends_) return;
        const std::int64_t now_ns = monotonic_ns();
        if (now_ns - begun_ns_ >= part_ns_) {
            rotate(now_ns);
        }
        look_at_cut();
        start_cut(now_ns);
        look_at_faults(now_ns);
    }
}

void JournalRing::rotate(std::int64_t now_ns) {
    ++current_;
    const ExecutionJournal::FastestThread fastest = journal_->continue_in(path_of(current_));
    const std::uint64_t margin =
        fastest.period_ns > 0 ? static_cast<std::uint64_t>(margin_ns / fastest.period_ns) + 1 : 0;
    parts_.push_back({current_ - 1, now_ns, fastest.newest - std::min(margin, fastest.newest)});
    begun_ns_ = now_ns;
}

void JournalRing::start_cut(std::int64_t now_ns) {
    if (cut_ != 0 || keeps_all_ || parts_.size() < 2) return;
    const Part& second = parts_[1];
    if (now_ns - second.end_ns < keep_ns_ || second.last_cycle == 0) return;
    cut_ = start_idle(
        {"/proc/self/exe", "replay", "--exact", path_of(parts_[0].number), path_of(second.number),
         "--until", std::to_string(second.last_cycle), "--cut", cut_path() + ".mcap"},
        log_path());
    if (cut_ == 0) {
        fail("its re-execution cannot be started");
    }
}

void JournalRing::look_at_cut() {
    if (cut_ == 0) return;
    int status = 0;
    const pid_t ended = ::waitpid(cut_, &status, WNOHANG);
    if (ended == 0) return;
    cut_ = 0;
    if (ended < 0) return fail("the end of its re-execution was not seen");
    if (const std::string why = why_cut_failed(status, log_path()); !why.empty()) return fail(why);
    const std::string cut = cut_path() + ".mcap";
    if (::rename(cut.c_str(), path_of(parts_[1].number).c_str()) != 0) {
        return fail(fmt::format("cannot rename '{}': {}", cut, std::strerror(errno)));
    }
    ::unlink(path_of(parts_[0].number).c_str());
    parts_.erase(parts_.begin());
}

/// A journal that could not be written has reported this itself.
void JournalRing::fail(const std::string& why) {
    keeps_all_ = true;
    if (!journal_->problem().empty()) return;
    machine_.note("the journal cannot begin later than the machine and is kept whole: " + why);
}

std::string JournalRing::save(const std::string& to) {
    const std::scoped_lock own(mutex_);
    return save_now(to);
}

std::string JournalRing::save_now(const std::string& to) {
    journal_->flush();
    return join_journals(paths(true), to);
}

/// Faults that follow soon are in the same file.
void JournalRing::look_at_faults(std::int64_t now_ns) {
    const std::optional<std::uint64_t> count = machine_.faults();
    if (count) {
        const bool is_new = *count > std::exchange(faults_, *count);
        if (is_new && fault_ns_ == 0 && fault_files_ < max_fault_files) {
            fault_ns_ = now_ns;
        }
    }
    if (fault_ns_ == 0 || now_ns - fault_ns_ < after_fault_ns) return;
    fault_ns_ = 0;
    const std::string stem = path_.substr(0, path_.rfind(".mcap"));
    ++fault_files_;
    const std::string file =  // that of an earlier run stays
        free_name([&](int number) { return fmt::format("{}-fault-{}.mcap", stem, number); });
    const std::string problem = save_now(file);
    machine_.note(problem.empty() ? fmt::format("'{}' has the journal up to {} s after a fault",
                                                file, after_fault_ns / 1'000'000'000)
                                  : fmt::format("cannot write '{}': {}", file, problem));
}

void JournalRing::end() {
    if (!thread_.joinable()) return;
    {
        const std::scoped_lock own(mutex_);
        ends_ = true;
    }
    wake_.notify_one();
    thread_.join();
    if (cut_ != 0) {
        ::kill(cut_, SIGKILL);
        ::waitpid(cut_, nullptr, 0);
        cut_ = 0;
    }
}

std::string JournalRing::finish() {
    std::vector<std::string> all = paths(false);
    std::error_code ignored;
    if (fs::exists(path_of(current_), ignored)) {
        all.push_back(path_of(current_));
    }
    std::string problem = join_journals(all, path_);
    if (problem.empty()) {
        fs::remove_all(folder_, ignored);
    }
    return problem;
}

}  // namespace hal
