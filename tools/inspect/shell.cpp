// SPDX-License-Identifier: MIT
// `hal shell` and `halcmd`: the client of the control socket. One-shot commands must start quickly: they create no session.
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

/// `watch NAME…` is a command of this program, which is `hal watch` with the same names; `help watch` describes it. Returns nothing
/// for another command.
std::optional<int> run_own(const RemoteShellOptions& options, const Client& client,
                           std::string_view line) {
    std::istringstream words{std::string(line)};
    std::string first;
    if (options.classic || !(words >> first)) return std::nullopt;
    if (std::string topic, more;
        first == "help" && words >> topic && topic == "watch" && !(words >> more)) {
        return print(watch_help) ? 0 : 1;
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

/// Executes commands from standard input that is not a terminal: a file as a whole; from a pipe,
/// each line when it comes, so that a program can wait for the answer.
int follow_input(Client& client, const RemoteShellOptions& options) {
    struct stat about{};
    if (::fstat(STDIN_FILENO, &about) == 0 && S_ISREG(about.st_mode)) {
        std::string text;
        if (!read_file("-", text)) {
            return complain(options, fmt::format("cannot read standard input: {}", text));
        }
        return show(options, client.run_text("<stdin>", text));
    }
    RemoteShell executor(client, options, "<stdin>");
    LineReader input(STDIN_FILENO);
    int status = 0;
    // where the lines begin that are collected; 0: none are
    std::uint32_t number = 1;
    std::uint32_t first = 1;
    std::uint32_t begin = 0;
    for (std::string line, more;
         !executor.over() && (status == 0 || options.keep_going) && input.read(line); ++number) {
        first = number;
        for (; line.ends_with('\\') && input.read(more); ++number) {
            line += '\n' + more;
        }
        const int done = executor.execute(line, first);
        status = std::max(status, done);
        if (executor.collecting() && begin == 0) {
            begin = first;
        }
        if (!executor.collecting() && (done == 0 || options.keep_going)) {
            begin = 0;
        }
    }
    if (status != 0 && !options.keep_going && first > 1) {
        const std::uint32_t last = (begin != 0 ? begin : first) - 1;  // that took effect
        std::string sentence = "a pipe is read line by line: ";
        if (last > 0) {
            sentence += fmt::format(
                "{} carried out before the error in line {}",
                last == 1 ? "line 1 was" : fmt::format("lines 1 to {} were", last), first);
        }
        if (last > 0 && begin != 0) {
            sentence += "; ";
        }
        if (begin != 0) {
            sentence += fmt::format("the edits collected from line {} on had no effect", begin);
        }
        complain(options, sentence);
    } else if (executor.collecting()) {
        return complain(
            options,
            fmt::format("'begin' in line {} without 'commit': the collected edits had no effect",
                        begin));
    }
    return status;
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

}  // namespace

int run_shell(const RemoteShellOptions& options) {
    if (options.from_file && !options.words.empty() && !options.classic &&
        options.words.size() > 1) {
        return complain(options,
                        fmt::format("unexpected argument '{}' after the file; options go before -f",
                                    options.words[1]));
    }
    std::string problem;
    const auto client = Client::connect(instance_wanted(options.name), problem);
    if (!client) return complain(options, problem);
    client->on_notice([](std::string_view text) { write_all(STDERR_FILENO, text); });
    Client::Options how = client_options(options);
    if (!options.ini.empty() && !read_ini(options, how)) return 1;
    if (!client->set_options(how) && !client->connected()) {
        return complain(options, fmt::format("instance '{}' does not respond", client->instance()));
    }
    if (options.from_file && !options.words.empty()) return follow_file(*client, options);
    if (!options.execute.empty()) {
        int status = 0;
        Client::Answer last{};
        for (const std::string& command : options.execute) {
            if (status != 0 && !options.keep_going) break;
            const auto own = run_own(options, *client, command);
            status = std::max(
                status, own ? *own : show(options, last = client->run(command, "<commandline>")));
        }
        return without_commit(options, last, status);
    }
    if (!options.words.empty() && !options.from_file) {
        // A single word with blanks is a line that was typed between quotes.
        if (const auto own =
                run_own(options, *client, fmt::format("{}", fmt::join(options.words, " ")))) {
            return *own;
        }
        const bool line =
            options.words.size() == 1 && options.words[0].find_first_of(" \t") != std::string::npos;
        const Client::Answer answer =
            line ? client->run(options.words[0], "<commandline>") : client->run(options.words);
        return without_commit(options, answer, show(options, answer));
    }
    if (!::isatty(STDIN_FILENO)) return follow_input(*client, options);
    if (!options.classic) {
        print(fmt::format("instance '{}', process {}; 'help' lists the commands, Tab completes\n",
                          client->instance(), client->pid()));
    }
    const Interrupts interrupts;
    client->cancel_on(interrupts.descriptor());
    RemoteShell executor(*client, options, "<shell>");
    const Prompt prompt = options.script    ? Prompt{"%%\n", "%%\n"}
                          : options.classic ? Prompt{"halcmd: ", "halcmd+: "}
                                            : Prompt{"hal> ", "hal+> "};
    const int status = run_prompt_loop(executor, prompt);
    if (client->connected()) return status;
    const std::string& why = client->closed_because();
    return complain(options, why.empty()
                                 ? fmt::format("instance '{}' has ended", client->instance())
                                 : fmt::format("instance '{}' closed the connection: {}",
                                               client->instance(), why));
}

}  // namespace hal::tools
