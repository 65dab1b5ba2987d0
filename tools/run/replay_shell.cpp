// SPDX-License-Identifier: MIT
#include "run/replay_shell.hpp"

#include <array>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstring>
#include <fmt/core.h>
#include <functional>
#include <iomanip>
#include <optional>
#include <poll.h>
#include <sstream>
#include <string_view>
#include <sys/socket.h>
#include <system_error>
#include <unistd.h>
#include <vector>

#include "cli/output.hpp"
#include "cli/prompt_loop.hpp"
#include "cli/signals.hpp"
#include "journal/keyframes.hpp"
#include "run/replayed_moment.hpp"
#include "run/replayed_traces.hpp"
#include "run/stop_rule.hpp"

namespace hal::tools {
namespace {

constexpr std::string_view help_text =
    R"(step [N] [THREAD]       execute the next N cycles (default 1), of all threads or of one
step back [N] [THREAD]  go back by N cycles
continue                execute until the break condition begins to hold, or to the end
reverse                 go back to the last cycle in which the break condition began to hold
goto CYCLE|TIME         go to a cycle of the fastest thread, or to a time: goto 12000, goto 3.5s
break [NAME > VALUE]    set the break condition (> < >= <= == !=), or remove it
where                   print the cycle
scope NAME... [--pre 50ms] [--post 50ms] [--svg FILE] [--csv FILE]
                        draw values around the present cycle
quit                    leave

and the commands that only read a machine: show, list, getp, gets, ptype, stype, save, explain
)";

std::vector<std::string> split(const std::string& line) {
    std::istringstream in(line);
    std::vector<std::string> words;
    for (std::string word; in >> std::quoted(word);) {
        words.push_back(word);
    }
    return words;
}

template <std::size_t size>
bool store(char (&to)[size], const std::string& text) {
    if (text.size() >= size) return false;
    std::memcpy(to, text.c_str(), text.size() + 1);
    return true;
}

class ReplayShell final : public LineExecutor {
public:
    ReplayShell(Keyframes& frames, JournalFile& file, StopRequest& stop, int socket)
        : frames_(frames), file_(file), stop_(stop), socket_(socket) {}

    int execute(std::string_view line) override {
        frames_.interrupt(false);
        const std::string text(line);
        const std::vector<std::string> words = split(text.substr(0, text.find('#')));
        if (words.empty()) return 0;
        for (const Row& row : rows) {
            if (words[0] == row.name) return (this->*row.execute)(words);
        }
        Errand errand;
        errand.kind = Errand::Kind::command;
        return send(errand, text);
    }
    Completion complete(std::string_view line, std::size_t cursor) override;
    bool collecting() const override { return false; }
    bool over() const override { return over_ || stop_.requested(); }

    int go_to(const std::string& text) { return position({"goto", text}); }
    /// Sets the break condition and continues.
    int run_to(const std::string& condition) {
        const int status = set_break({"break", condition});
        return status != 0 ? status : run({"continue"});
    }

private:
    using Words = const std::vector<std::string>&;
    struct Row {
        std::string_view name;
        int (ReplayShell::*execute)(Words);
    };
    static const std::array<Row, 11> rows;

    int step(Words words);
    int run(Words words);
    int reverse(Words words);
    int position(Words words);
    int set_break(Words words);
    int where(Words words);
    int scope(Words words);
    int help(Words words);
    int quit(Words words);
    std::string parse_step(Words words, std::size_t first, Errand& errand);
    int send(Errand errand, const std::string& text = "");
    std::optional<std::string> receive();

    Keyframes& frames_;
    JournalFile& file_;
    StopRequest& stop_;
    const int socket_;
    std::string condition_;
    bool over_ = false;
};

const std::array<ReplayShell::Row, 11> ReplayShell::rows = {{
    {"step", &ReplayShell::step},
    {"continue", &ReplayShell::run},
    {"reverse", &ReplayShell::reverse},
    {"goto", &ReplayShell::position},
    {"break", &ReplayShell::set_break},
    {"where", &ReplayShell::where},
    {"scope", &ReplayShell::scope},
    {"help", &ReplayShell::help},
    {"quit", &ReplayShell::quit},
    {"exit", &ReplayShell::quit},
    {"back", &ReplayShell::step},
}};

int complain(const std::string& text) {
    write_all(STDERR_FILENO, text + "\n");
    return 1;
}

/// Returns why the words are invalid: [N] [THREAD].
std::string ReplayShell::parse_step(Words words, std::size_t first, Errand& errand) {
    errand.count = 1;
    std::size_t at = first;
    if (at < words.size()) {
        const std::string& word = words[at];
        const char* const end = word.data() + word.size();
        const auto [rest, error] = std::from_chars(word.data(), end, errand.count);
        if (error == std::errc() && rest == end) {
            ++at;
        } else {
            errand.count = 1;
        }
        if (errand.count == 0) return "the number of cycles is 1 or more";
    }
    if (at < words.size()) {
        const std::string& name = words[at++];
        bool known = false;
        for (const auto& [number, thread] : file_.threads()) {
            known = known || thread.name == name;
        }
        if (!known || !store(errand.thread, name)) {
            return fmt::format("the journal has no thread '{}'", name);
        }
    }
    return at < words.size() ? fmt::format("unexpected '{}'", words[at]) : "";
}

int ReplayShell::step(Words words) {
    const bool is_back = words[0] == "back" || (words.size() > 1 && words[1] == "back");
    const std::size_t first = is_back && words[0] == "step" ? 2 : 1;
    Errand errand;
    if (const std::string problem = parse_step(words, first, errand); !problem.empty()) {
        return complain(fmt::format("step: {}; write: step [back] [N] [THREAD]", problem));
    }
    errand.kind = is_back ? Errand::Kind::back : Errand::Kind::step;
    return send(errand);
}

int ReplayShell::run(Words words) {
    if (words.size() != 1) return complain("continue: it has no arguments");
    Errand errand;
    errand.kind = Errand::Kind::run;
    store(errand.condition, condition_);
    return send(errand);
}

int ReplayShell::reverse(Words words) {
    if (words.size() != 1) return complain("reverse: it has no arguments");
    if (condition_.empty()) {
        return complain("reverse: no break condition; write: break NAME > VALUE");
    }
    Errand errand;
    errand.kind = Errand::Kind::back;
    errand.count = 1;
    store(errand.condition, condition_);
    return send(errand);
}

int ReplayShell::position(Words words) {
    JournalPosition position;
    if (words.size() != 2 || !position.parse(words[1])) {
        return complain("goto: write a cycle or a time: goto 12000, goto 3.5s");
    }
    Errand errand;
    errand.kind = Errand::Kind::position;
    return send(errand, words[1]);
}

int ReplayShell::set_break(Words words) {
    std::string text;
    for (std::size_t i = 1; i < words.size(); ++i) {
        text += (i == 1 ? "" : " ") + words[i];
    }
    ValueCondition condition;
    Errand errand;
    if (!text.empty() && (!condition.parse(text) || !store(errand.condition, text))) {
        return complain(
            fmt::format("break: invalid condition '{}'; {}", text, ValueCondition::form));
    }
    condition_ = text;
    if (text.empty()) return 0;
    errand.kind = Errand::Kind::check;
    return send(errand);
}

int ReplayShell::where(Words) { return send({}); }

int ReplayShell::scope(Words words) {
    Errand errand;
    errand.kind = Errand::Kind::scope;
    return send(errand, ScopeCommand::joined(words));
}

int ReplayShell::help(Words) { return exit_code(print(help_text)); }

int ReplayShell::quit(Words) {
    over_ = true;
    return 0;
}

Completion ReplayShell::complete(std::string_view line, std::size_t cursor) {
    Errand errand;
    errand.kind = Errand::Kind::complete;
    errand.count = cursor;
    Completion completion;
    if (!store(errand.text, std::string(line))) return completion;
    if (::send(socket_, &errand, sizeof errand, MSG_NOSIGNAL) < 0) return completion;
    std::istringstream in(receive().value_or(""));
    std::string status;
    std::string text;
    std::getline(in, status);
    in >> completion.begin;
    std::getline(in, text);
    while (std::getline(in, text)) {
        const std::size_t tab = text.find('\t');
        if (tab == std::string::npos) break;
        completion.candidates.push_back({text.substr(0, tab), text.substr(tab + 1)});
    }
    return completion;
}

int ReplayShell::send(Errand errand, const std::string& text) {
    if (!store(errand.text, text)) return complain("the line is too long");
    if (::send(socket_, &errand, sizeof errand, MSG_NOSIGNAL) < 0) {
        over_ = true;
        return complain("the re-execution has ended");
    }
    stop_.spare(true);  // Ctrl-C is for the errand now
    const std::optional<std::string> reply = receive();
    stop_.spare(false);
    if (!reply) {
        over_ = true;
        return complain(
            "the re-execution has ended unexpectedly: a component has crashed, or the "
            "process was terminated");
    }
    return reply->starts_with("0") ? 0 : 1;
}

/// Returns nothing when the active process has ended.
std::optional<std::string> ReplayShell::receive() {
    std::vector<char> buffer(std::size_t{1} << 17);
    for (;;) {
        pollfd event{socket_, POLLIN, 0};
        constexpr int check_every_ms = 100;
        const int ready = ::poll(&event, 1, check_every_ms);
        if (ready < 0) continue;
        if (ready == 0) {
            if (!frames_.alive()) return std::nullopt;
            continue;
        }
        const ssize_t bytes = ::recv(socket_, buffer.data(), buffer.size(), 0);
        if (bytes <= 0) return std::nullopt;
        return std::string(buffer.data(), static_cast<std::size_t>(bytes));
    }
}

}  // namespace

int run_replay_shell(const ReplayOptions& options, JournalFile& file, const WhatIf& change) {
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) {
        return fail(options, fmt::format("cannot create a socket: {}", std::strerror(errno)));
    }
    Keyframes frames;
    const pid_t moment = frames.start();
    if (moment < 0) {
        return fail(options, fmt::format("cannot create a process: {}", std::strerror(errno)));
    }
    if (moment == 0) {
        ::close(ends[0]);
        std::signal(SIGTTOU, SIG_IGN);  // it prints while the front has the terminal
        ReplayedMoment(options, file, frames, change, ends[1]).serve();
    }
    ::close(ends[1]);
    StopRequest stop;
    stop.when_signalled([&frames] { frames.interrupt(true); });
    ReplayShell shell(frames, file, stop, ends[0]);
    int status = 0;
    if (!options.until.empty()) {
        status = shell.go_to(options.until);
    }
    if (!options.break_condition.empty()) {
        status = std::max(status, shell.run_to(options.break_condition));
    }
    const int lines = run_prompt_loop(shell, {"replay> ", "...> "}, stop.fd());
    stop.release();
    ::close(ends[0]);
    return std::max(status, lines);
}

}  // namespace hal::tools
