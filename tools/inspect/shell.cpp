// SPDX-License-Identifier: MIT
// `hal shell` and `halcmd`: the client of the control socket. One-shot commands must start quickly:
// they create no session.
#include "inspect/shell.hpp"

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fmt/format.h>
#include <optional>
#include <sstream>
#include <sys/signalfd.h>
#include <sys/stat.h>
#include <unistd.h>
#include <vector>

#include "cli/editor.hpp"
#include "cli/other_program.hpp"
#include "cli/output.hpp"
#include "cli/prompt_loop.hpp"
#include "control/client.hpp"
#include "netlist/netlist.hpp"
#include "text/diagnostic.hpp"

namespace hal::tools {

namespace {

/// Prints an error, with -Q nothing. Returns 1.
int complain(const RemoteShellOptions& options, std::string_view sentence) {
    return options.loudness == Loudness::nothing ? 1 : fail(options, sentence);
}

/// Prints a command's output. Returns its exit status.
int show(const RemoteShellOptions& options, const Client::Answer& answer) {
    const bool good = print(answer.out);
    if (answer.executed || options.loudness != Loudness::nothing) {
        write_all(STDERR_FILENO, answer.err);
    }
    return good ? answer.status : 1;
}

constexpr std::string_view watch_help =
    "watch NAME…            show values live, with minimum, maximum and rate; q ends it\n";

/// `watch NAME…` is a command of this program, which is `hal watch` with the same names;
/// `help watch` describes it. Returns nothing for another command.
std::optional<int> run_own(const RemoteShellOptions& options, const Client& client,
                           std::string_view line) {
    std::istringstream words{std::string(line)};
    std::string first;
    if (options.classic || !(words >> first)) return std::nullopt;
    if (std::string topic, more;
        first == "help" && words >> topic && topic == "watch" && !(words >> more)) {
        return exit_code(print(watch_help));
    }
    if (first != "watch") return std::nullopt;
    std::vector<std::string> arguments{"watch", "--name", client.instance()};
    const std::size_t own = arguments.size();
    for (std::string name; words >> name;) {
        arguments.push_back(name);
    }
    if (arguments.size() == own) return complain(options, "missing name; type: watch NAME");
    return run_tool(std::move(arguments));
}

class RemoteShell final : public LineExecutor {
public:
    RemoteShell(Client& client, const RemoteShellOptions& options, const char* name)
        : client_(client), options_(options), name_(name) {}
    int execute(std::string_view line) override { return execute(line, 1); }
    int execute(std::string_view line, std::uint32_t number) {
        if (const auto status = run_own(options_, client_, line)) return *status;
        last_ = client_.run(line, name_, number);
        const int status = show(options_, last_);
        if (!options_.classic && line == "help") {
            print(watch_help);
        }
        return status;
    }
    Completion complete(std::string_view line, std::size_t cursor) override {
        constexpr std::string_view own = "watch ";
        if (options_.classic || !line.starts_with(own)) return client_.complete(line, cursor);
        Completion found =
            client_.complete(std::string("getp  ").append(line.substr(own.size())), cursor);
        const Completion signals =
            client_.complete(std::string("gets  ").append(line.substr(own.size())), cursor);
        found.candidates.insert(found.candidates.end(), signals.candidates.begin(),
                                signals.candidates.end());
        return found;
    }
    bool collecting() const override { return last_.collecting; }
    bool over() const override { return last_.quit || !client_.connected(); }

private:
    Client& client_;
    const RemoteShellOptions& options_;
    const char* name_;
    Client::Answer last_{};
};

Client::Options client_options(const RemoteShellOptions& options) {
    Client::Options how;
    how.keep_going = options.keep_going;
    how.echo = options.echo;
    how.script = options.script;
    how.json = options.json;
    how.color = colours(STDERR_FILENO);
    if (options.loudness == Loudness::nothing) {
        how.level = "nothing";
    } else if (options.loudness == Loudness::results) {
        how.level = "results";
    } else {
        how.level = "errors";
    }
    std::error_code unknown;
    how.directory = std::filesystem::current_path(unknown).string();
    return how;
}

/// Where a pipe stands.
struct PipeState {
    std::uint32_t line = 0;  ///< number of the last command
    std::uint32_t begin = 0;  ///< where the lines begin that are collected; 0: none are
    int status = 0;
};

/// Reports after an error what the lines before it have changed.
void report_partial(const RemoteShellOptions& options, const PipeState& at) {
    // the last line that took effect
    const std::uint32_t last = (at.begin != 0 ? at.begin : at.line) - 1;
    std::string sentence = "a pipe is read line by line: ";
    if (last > 0) {
        const std::string lines =
            last == 1 ? "line 1 was" : fmt::format("lines 1 to {} were", last);
        sentence += fmt::format("{} carried out before the error in line {}", lines, at.line);
    }
    if (last > 0 && at.begin != 0) {
        sentence += "; ";
    }
    if (at.begin != 0) {
        sentence += fmt::format("the edits collected from line {} on had no effect", at.begin);
    }
    complain(options, sentence);
}

/// Executes the lines of a pipe when they come, so that a program can wait for the answer.
int follow_pipe(Client& client, const RemoteShellOptions& options) {
    RemoteShell executor(client, options, "<stdin>");
    LineReader input(STDIN_FILENO);
    PipeState at;
    std::uint32_t next = 1;
    std::string line;
    while (!executor.over() && (at.status == 0 || options.keep_going) && input.read(line)) {
        at.line = next;
        std::string more;
        while (line.ends_with('\\') && input.read(more)) {
            line += '\n' + more;
            ++next;
        }
        ++next;
        const int done = executor.execute(line, at.line);
        at.status = std::max(at.status, done);
        if (executor.collecting() && at.begin == 0) {
            at.begin = at.line;
        }
        if (!executor.collecting() && (done == 0 || options.keep_going)) {
            at.begin = 0;
        }
    }
    if (at.status != 0 && !options.keep_going && at.line > 1) {
        report_partial(options, at);
        return at.status;
    }
    if (!executor.collecting()) return at.status;
    return complain(
        options,
        fmt::format("'begin' in line {} without 'commit': the collected edits had no effect",
                    at.begin));
}

/// Executes commands from standard input that is not a terminal: a file as a whole; a pipe line by
/// line.
int follow_input(Client& client, const RemoteShellOptions& options) {
    struct stat about{};
    if (::fstat(STDIN_FILENO, &about) != 0 || !S_ISREG(about.st_mode)) {
        return follow_pipe(client, options);
    }
    std::string text;
    if (!read_file("-", text)) {
        return complain(options, fmt::format("cannot read standard input: {}", text));
    }
    return show(options, client.run_text("<stdin>", text));
}

/// The end of a connection after `begin` discards the collected edits.
int without_commit(const RemoteShellOptions& options, const Client::Answer& last, int status) {
    if (!last.collecting) return status;
    return complain(
        options,
        "'begin' without 'commit' had no effect; write the transaction to a file, or type: "
        "hal shell");
}

/// Reads the user's INI file, which the instance has not read. Returns false after printing an
/// error.
bool read_ini(const RemoteShellOptions& options, Client::Options& how) {
    Sources sources;
    Diagnostics diagnostics;
    const Ini ini = Ini::read(sources, options.ini, diagnostics);
    if (options.loudness != Loudness::nothing) {
        write_all(STDERR_FILENO, render(diagnostics, sources, colours(STDERR_FILENO)));
    }
    for (const Ini::Entry& entry : ini.entries()) {
        how.ini.push_back(
            {entry.section, entry.key, entry.value, sources.location(entry.at, false)});
    }
    return !diagnostics.failed();
}

/// During its lifetime, Ctrl-C cancels the command that this program waits for, not the program.
class Interrupts {
public:
    Interrupts() {
        sigset_t interrupt;
        sigemptyset(&interrupt);
        sigaddset(&interrupt, SIGINT);
        ::pthread_sigmask(SIG_BLOCK, &interrupt, &before_);
        descriptor_ = ::signalfd(-1, &interrupt, SFD_CLOEXEC | SFD_NONBLOCK);
        if (descriptor_ < 0) {  // then Ctrl-C ends this program
            ::pthread_sigmask(SIG_SETMASK, &before_, nullptr);
        }
    }
    ~Interrupts() {
        if (descriptor_ < 0) return;
        ::close(descriptor_);
        ::pthread_sigmask(SIG_SETMASK, &before_, nullptr);
    }
    Interrupts(const Interrupts&) = delete;
    int descriptor() const { return descriptor_; }

private:
    sigset_t before_;
    int descriptor_;
};

int follow_file(Client& client, const RemoteShellOptions& options) {
    const std::string& path = options.words.front();
    std::string text;
    if (!read_file(path, text)) {
        complain(options, fmt::format("cannot read '{}': {}", path, text));
        return options.classic ? 255 : 1;
    }
    return show(options, client.run_text(path, text));
}

/// The commands of -e.
int run_commands(Client& client, const RemoteShellOptions& options) {
    int status = 0;
    Client::Answer last{};
    for (const std::string& command : options.execute) {
        if (status != 0 && !options.keep_going) break;
        std::optional<int> done = run_own(options, client, command);
        if (!done) {
            last = client.run(command, "<commandline>");
            done = show(options, last);
        }
        status = std::max(status, *done);
    }
    return without_commit(options, last, status);
}

/// The command of the command line.
int run_words(Client& client, const RemoteShellOptions& options) {
    const std::vector<std::string>& words = options.words;
    if (const auto own = run_own(options, client, fmt::format("{}", fmt::join(words, " ")))) {
        return *own;
    }
    // A single word with blanks is a line that was typed between quotes.
    const bool line = words.size() == 1 && words[0].find_first_of(" \t") != std::string::npos;
    const Client::Answer answer = line ? client.run(words[0], "<commandline>") : client.run(words);
    return without_commit(options, answer, show(options, answer));
}

Prompt prompt_of(const RemoteShellOptions& options) {
    if (options.script) return {"%%\n", "%%\n"};
    if (options.classic) return {"halcmd: ", "halcmd+: "};
    return {"hal> ", "hal+> "};
}

/// The commands that a person types.
int run_prompt(Client& client, const RemoteShellOptions& options) {
    if (!options.classic) {
        print(fmt::format("instance '{}', process {}; 'help' lists the commands, Tab completes\n",
                          client.instance(), client.pid()));
    }
    const Interrupts interrupts;
    client.cancel_on(interrupts.descriptor());
    RemoteShell executor(client, options, "<shell>");
    const int status = run_prompt_loop(executor, prompt_of(options));
    if (client.connected()) return status;
    const std::string& why = client.closed_because();
    if (why.empty()) {
        return complain(options, fmt::format("instance '{}' has ended", client.instance()));
    }
    return complain(options,
                    fmt::format("instance '{}' closed the connection: {}", client.instance(), why));
}

}  // namespace

int run_shell(const RemoteShellOptions& options) {
    const bool has_file = options.from_file && !options.words.empty();
    if (has_file && !options.classic && options.words.size() > 1) {
        return complain(options,
                        fmt::format("unexpected argument '{}' after the file; options go before -f",
                                    options.words[1]));
    }
    std::string problem;
    const auto client = Client::connect(instance_wanted(options.name), problem);
    if (!client) return complain(options, problem);
    client->on_notice([](std::string_view text) { write_all(STDERR_FILENO, text); });
    Client::Options settings = client_options(options);
    if (!options.ini.empty() && !read_ini(options, settings)) return 1;
    if (!client->set_options(settings) && !client->connected()) {
        return complain(options, fmt::format("instance '{}' does not respond", client->instance()));
    }
    if (has_file) return follow_file(*client, options);
    if (!options.execute.empty()) return run_commands(*client, options);
    if (!options.words.empty()) return run_words(*client, options);
    if (!::isatty(STDIN_FILENO)) return follow_input(*client, options);
    return run_prompt(*client, options);
}

}  // namespace hal::tools
