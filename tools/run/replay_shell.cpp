// SPDX-License-Identifier: MIT
#include "run/replay_shell.hpp"

#include <algorithm>
#include <iomanip>
#include <sstream>
#include <string>
#include <string_view>
#include <unistd.h>
#include <vector>

#include "cli/output.hpp"
#include "cli/prompt_loop.hpp"
#include "cli/signals.hpp"
#include "journal/keyframes.hpp"
#include "run/moment_link.hpp"
#include "run/replay_command.hpp"
#include "run/replayed_traces.hpp"

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

int complain(const std::string& text) {
    write_all(STDERR_FILENO, text + "\n");
    return 1;
}

class ReplayShell final : public LineExecutor {
public:
    ReplayShell(MomentLink& moment, JournalFile& file, StopRequest& stop)
        : moment_(moment), commands_(file), stop_(stop) {}

    int execute(std::string_view line) override;
    Completion complete(std::string_view line, std::size_t cursor) override;
    bool collecting() const override { return false; }
    bool over() const override { return over_ || stop_.requested(); }

    int go_to(const std::string& text) { return move({"goto", text}); }
    /// Sets the break condition and continues.
    int run_to(const std::string& condition) {
        const int status = move({"break", condition});
        return status != 0 ? status : move({"continue"});
    }

private:
    int move(const std::vector<std::string>& words);
    int quit();
    int send(const Errand& errand);
    int wait();

    MomentLink& moment_;
    ReplayCommands commands_;
    StopRequest& stop_;
    std::string data_;  // of the newest answer
    bool over_ = false;
};

int ReplayShell::execute(std::string_view line) {
    moment_.interrupt(false);
    const std::string text(line);
    const std::vector<std::string> words = split(text.substr(0, text.find('#')));
    if (words.empty()) return 0;
    if (ReplayCommands::is_known(words[0])) return move(words);
    if (words[0] == "help") return exit_code(print(help_text));
    if (words[0] == "quit" || words[0] == "exit") return quit();
    Errand errand;
    const bool is_scope = words[0] == "scope";
    errand.kind = is_scope ? Errand::Kind::scope : Errand::Kind::command;
    if (!store(errand.text, is_scope ? ScopeCommand::joined(words) : text))
        return complain("the line is too long");
    return send(errand);
}

int ReplayShell::move(const std::vector<std::string>& words) {
    Errand errand;
    if (const std::string problem = commands_.parse(words, errand); !problem.empty()) {
        return complain(problem);
    }
    if (words[0] == "break" && commands_.condition().empty()) return 0;
    return send(errand);
}

int ReplayShell::quit() {
    over_ = true;
    return 0;
}

Completion ReplayShell::complete(std::string_view line, std::size_t cursor) {
    Errand errand;
    errand.kind = Errand::Kind::complete;
    errand.count = cursor;
    Completion completion;
    if (!store(errand.text, std::string(line)) || !moment_.send(errand)) return completion;
    wait();
    std::istringstream in(data_);
    std::string text;
    in >> completion.begin;
    std::getline(in, text);
    while (std::getline(in, text)) {
        const std::size_t tab = text.find('\t');
        if (tab == std::string::npos) break;
        completion.candidates.push_back({text.substr(0, tab), text.substr(tab + 1)});
    }
    return completion;
}

int ReplayShell::send(const Errand& errand) {
    if (!moment_.send(errand)) {
        over_ = true;
        return complain("the re-execution has ended");
    }
    stop_.spare(true);  // Ctrl-C is for the errand now
    const int status = wait();
    stop_.spare(false);
    if (status < 0) {
        over_ = true;
        return complain(ended_unexpectedly);
    }
    return status;
}

/// Prints what the errand reports, and keeps its answer. Returns its status; -1 when the process has
/// ended.
int ReplayShell::wait() {
    constexpr int without_limit = -1;
    data_.clear();
    while (const auto packet = moment_.receive(without_limit)) {
        switch (packet->kind) {
        case Packet::text: print(packet->text); break;
        case Packet::data: data_ += packet->text; break;
        case Packet::end: return packet->text == "0" ? 0 : 1;
        case Packet::now:
        case Packet::mark: break;
        }
    }
    return -1;
}

}  // namespace

int run_replay_shell(const ReplayOptions& options, JournalFile& file, const WhatIf& change) {
    Keyframes frames;
    MomentLink moment(frames);
    if (!moment.start(options, file, change)) return 1;
    StopRequest stop;
    stop.when_signalled([&moment] { moment.interrupt(true); });
    ReplayShell shell(moment, file, stop);
    int status = 0;
    if (!options.until.empty()) {
        status = shell.go_to(options.until);
    }
    if (!options.break_condition.empty()) {
        status = std::max(status, shell.run_to(options.break_condition));
    }
    const int lines = run_prompt_loop(shell, {"replay> ", "...> "}, stop.fd());
    stop.release();
    return std::max(status, lines);
}

}  // namespace hal::tools
