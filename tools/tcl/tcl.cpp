// SPDX-License-Identifier: MIT
#include "tcl/tcl.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <fmt/core.h>
#include <optional>
#include <poll.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "commands/table.hpp"
#include "comp/toolchain.hpp"
#include "tcl/prelude.hpp"

namespace hal::tools {

namespace {

/// The text as one word of Tcl in which nothing is substituted.
std::string tcl_word(std::string_view text) {
    std::string word = "\"";
    for (const char c : text) {
        if (c == '\n') {
            word += "\\n";
            continue;
        }
        if (std::strchr("\\\"$[]{};", c) && c != '\0') {
            word += '\\';
        }
        word += c;
    }
    return word + "\"";
}

const char* name_of(Pass pass) {
    if (pass == Pass::loads) return "loads";
    if (pass == Pass::rest) return "rest";
    return "both";
}

std::string prelude_of(const TclScript& script, const std::string& requests,
                       const std::string& answers) {
    std::string text = "namespace eval halcyon {}\n";
    text += fmt::format("set halcyon::requests [open {} w]\nset halcyon::answers [open {} r]\n",
                        tcl_word(requests), tcl_word(answers));
    text += fmt::format("set halcyon::pass {}\nset halcyon::commands {{}}\n", name_of(script.pass));
    for (const std::string& name : command_names()) {
        text += fmt::format("lappend halcyon::commands {}\n", tcl_word(name));
    }
    text += tcl_prelude;
    if (!script.ini_path.empty()) {
        text += fmt::format("set EMC_INIFILE {}\n", tcl_word(script.ini_path));
    }
    if (script.ini) {
        for (const Ini::Entry& entry : script.ini->entries()) {
            if (!entry.section.empty()) {
                text += fmt::format("lappend {} {}\n",
                                    tcl_word("::" + entry.section + "(" + entry.key + ")"),
                                    tcl_word(entry.value));
            }
        }
    }
    text += fmt::format("set argv0 haltcl\nset argv {{}}\nset argc {}\n", script.arguments.size());
    for (const std::string& argument : script.arguments) {
        text += fmt::format("lappend argv {}\n", tcl_word(argument));
    }
    text += script.path.empty() ? fmt::format("halcyon::converse {}\n", ::isatty(STDIN_FILENO))
                                : fmt::format("halcyon::run {}\n", tcl_word(script.path));
    return text;
}

/// tclsh as a child, with two named pipes for what its procedures ask for. Named, because programs
/// that are started meanwhile must not inherit them.
class Interpreter {
public:
    ~Interpreter() {
        for (const int descriptor : {requests_, answers_}) {
            if (descriptor >= 0) {
                ::close(descriptor);
            }
        }
        if (pid_ > 0) {
            ::kill(pid_, SIGKILL);
            ::waitpid(pid_, nullptr, 0);
        }
    }

    bool start(const TclScript& script, std::string& problem) {
        const std::string requests = folder_.file("requests");
        const std::string answers = folder_.file("answers");

        const std::string prelude = folder_.file("prelude.tcl");
        problem = folder_.problem();
        if (problem.empty() &&
            (::mkfifo(requests.c_str(), 0600) != 0 || ::mkfifo(answers.c_str(), 0600) != 0)) {
            problem = std::strerror(errno);
        }
        if (problem.empty()) {
            problem = write_file(prelude, prelude_of(script, requests, answers));
        }
        if (!problem.empty()) return false;
        requests_ = ::open(requests.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
        // both ways: opening it waits for nobody
        answers_ = ::open(answers.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
        if (requests_ < 0 || answers_ < 0) {
            problem = std::strerror(errno);
            return false;
        }
        posix_spawnattr_t how;
        ::posix_spawnattr_init(&how);
        sigset_t none, all;
        sigemptyset(&none);
        sigfillset(&all);
        ::posix_spawnattr_setsigmask(&how, &none);
        ::posix_spawnattr_setsigdefault(&how, &all);
        ::posix_spawnattr_setflags(&how, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
        std::string words[] = {"tclsh", "-encoding", "utf-8", prelude};
        char* const arguments[] = {words[0].data(), words[1].data(), words[2].data(),
                                   words[3].data(), nullptr};
        posix_spawn_file_actions_t actions;
        ::posix_spawn_file_actions_init(&actions);
        if (!script.directory.empty()) {
            ::posix_spawn_file_actions_addchdir_np(&actions, script.directory.c_str());
        }
        const int error = ::posix_spawnp(&pid_, "tclsh", &actions, &how, arguments, environ);
        ::posix_spawn_file_actions_destroy(&actions);
        ::posix_spawnattr_destroy(&how);
        if (error == 0) return true;
        pid_ = 0;
        problem = error == ENOENT ? "tclsh is not installed; type: sudo apt-get install tcl"
                                  : std::string("cannot start tclsh: ") + std::strerror(error);
        return false;
    }

    int serve(const TclCommand& command, int stop_fd) {
        std::optional<std::chrono::steady_clock::time_point> killed;
        for (;;) {
            pollfd ready[] = {{requests_, POLLIN, 0}, {killed ? -1 : stop_fd, POLLIN, 0}};
            const bool hung_up =
                ::poll(ready, 2, 50) > 0 && (ready[0].revents & (POLLIN | POLLHUP)) == POLLHUP;
            if (ready[0].revents & POLLIN) {
                answer_requests(command);
            }
            if (ready[1].revents != 0) {
                ::kill(pid_, SIGTERM);
                killed = std::chrono::steady_clock::now();
            }
            if (killed && std::chrono::steady_clock::now() - *killed > std::chrono::seconds(2)) {
                ::kill(pid_, SIGKILL);
            }
            int status = 0;
            if (::waitpid(pid_, &status, WNOHANG) == pid_) {
                pid_ = 0;
                return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
            }
            if (hung_up) {
                ::usleep(1000);  // it is just ending
            }
        }
    }

private:
    void answer_requests(const TclCommand& command) {
        char bytes[4096];
        for (ssize_t got; (got = ::read(requests_, bytes, sizeof bytes)) > 0;) {
            received_.append(bytes, static_cast<std::size_t>(got));
        }
        for (;;) {
            const auto line = received_.find('\n');
            std::size_t size = 0;
            if (line == received_.npos ||
                std::from_chars(received_.data(), received_.data() + line, size).ec !=
                    std::errc{} ||
                received_.size() - line - 1 < size) {
                return;
            }
            std::vector<std::string> words(1);
            for (const char c : received_.substr(line + 1, size)) {
                if (c == '\0') {
                    words.emplace_back();
                } else {
                    words.back() += c;
                }
            }
            received_.erase(0, line + 1 + size);
            TclAnswer answer = command(words);
            std::string& text = answer.status == 0 ? answer.out : answer.err;
            if (answer.status == 0) {
                write_all(STDERR_FILENO, answer.err);
            }
            if (text.ends_with('\n')) {
                text.pop_back();
            }
            give(fmt::format("{} {}\n{}", answer.status, text.size(), text));
        }
    }

    /// Writes all of the text, unless tclsh ends.
    void give(std::string_view text) {
        for (siginfo_t ended{}; !text.empty() && ended.si_pid == 0;
             ::waitid(P_PID, static_cast<id_t>(pid_), &ended, WEXITED | WNOHANG | WNOWAIT)) {
            const ssize_t written = ::write(answers_, text.data(), text.size());
            if (written > 0) {
                text.remove_prefix(static_cast<std::size_t>(written));
            }
            pollfd space{answers_, POLLOUT, 0};
            if (written < 0) {
                ::poll(&space, 1, 50);
            }
        }
    }

    TemporaryFolder folder_;
    int requests_ = -1;
    int answers_ = -1;
    pid_t pid_ = 0;
    std::string received_;
};

}  // namespace

int run_tcl(const TclScript& script, const TclCommand& command, int stop_fd, std::string& problem) {
    Interpreter interpreter;
    return interpreter.start(script, problem) ? interpreter.serve(command, stop_fd) : -1;
}

}  // namespace hal::tools
