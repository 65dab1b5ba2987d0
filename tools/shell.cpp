// SPDX-License-Identifier: MIT
// `hal shell` and `halcmd`: the client of the control socket. One-shot commands must stay light: no session is made.
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fmt/core.h>
#include <sys/signalfd.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/diagnostic.hpp"
#include "editor.hpp"
#include "netlist/netlist.hpp"
#include "options.hpp"
#include "say.hpp"
#include "shell/client.hpp"
#include "talk.hpp"

namespace hal::tools {

namespace {

/// Prints what a command printed. Returns its exit status.
int show(const Client::Answer& answer) {
    const bool good = print(answer.out);
    write_all(STDERR_FILENO, answer.err);
    return good ? answer.status : 1;
}

class RemoteShell final : public Listener {
public:
    RemoteShell(Client& client, const char* name) : client_(client), name_(name) {}
    int execute(std::string_view line) override { return execute(line, 1); }
    int execute(std::string_view line, std::uint32_t number) {
        last_ = client_.run(line, name_, number);
        return show(last_);
    }
    Completion complete(std::string_view line, std::size_t cursor) override { return client_.complete(line, cursor); }
    bool collecting() const override { return last_.collecting; }
    bool over() const override { return last_.quit || !client_.connected(); }

private:
    Client& client_;
    const char* name_;
    Client::Answer last_{};
};

Client::Options client_options(const Options& options) {
    Client::Options how;
    how.keep_going = options.keep_going;
    how.echo = options.echo;
    how.script = options.script;
    how.json = options.json;
    how.color = colours(STDERR_FILENO);
    how.level = options.loudness == Loudness::nothing ? "nothing" : options.loudness == Loudness::results ? "results" : "errors";
    std::error_code unknown;
    how.directory = std::filesystem::current_path(unknown).string();
    return how;
}

/// Commands on standard input that is no terminal: a file as a whole; from a pipe, each line when it comes, so that a
/// program can wait for the answer.
int follow_input(Client& client, const Options& options) {
    struct stat about{};
    if (::fstat(STDIN_FILENO, &about) == 0 && S_ISREG(about.st_mode)) {
        std::string text;
        if (!read_file("-", text)) return fail(options, fmt::format("cannot read standard input: {}", text));
        return show(client.run_text("<stdin>", text));
    }
    RemoteShell listener(client, "<stdin>");
    LineReader input(STDIN_FILENO);
    int status = 0;
    std::uint32_t number = 1;
    for (std::string line, more; !listener.over() && (status == 0 || options.keep_going) && input.read(line); ++number) {
        const std::uint32_t first = number;
        for (; line.ends_with('\\') && input.read(more); ++number) line += '\n' + more;
        status = std::max(status, listener.execute(line, first));
    }
    return status;
}

/// Puts the values of this user's INI file into a netlist, line by line: the instance knows only its own INI file. False
/// after printing what is wrong.
bool substitute(const Options& options, const std::string& path, std::string& text) {
    Sources sources;
    Diagnostics diagnostics;
    const Ini ini = Ini::read(sources, options.ini, diagnostics);
    const std::uint32_t source = sources.add(path, text);
    std::vector<Command> commands;
    if (!diagnostics.failed()) commands = parse(sources, source, {&ini, {}}, diagnostics);
    if (diagnostics.failed()) {
        write_all(STDERR_FILENO, render(diagnostics, sources, colours(STDERR_FILENO)));
        return false;
    }
    text.clear();
    std::uint32_t line = 1;
    for (const Command& command : commands) {
        for (const std::uint32_t wanted = sources.place(command.span).line; line < wanted; ++line) text += '\n';
        text += command.name.text;
        for (const Token& word : command.args) text += " " + word.text;
    }
    text += '\n';
    return true;
}

/// While it lives, Ctrl-C is a message: it ends the command that is waited for, not this program.
class Interrupts {
public:
    Interrupts() {
        sigset_t interrupt;
        sigemptyset(&interrupt);
        sigaddset(&interrupt, SIGINT);
        ::pthread_sigmask(SIG_BLOCK, &interrupt, &before_);
        descriptor_ = ::signalfd(-1, &interrupt, SFD_CLOEXEC | SFD_NONBLOCK);
    }
    ~Interrupts() {
        ::close(descriptor_);
        ::pthread_sigmask(SIG_SETMASK, &before_, nullptr);
    }
    Interrupts(const Interrupts&) = delete;
    int descriptor() const { return descriptor_; }

private:
    sigset_t before_;
    int descriptor_;
};

int follow_file(Client& client, const Options& options) {
    const std::string& path = options.words.front();
    std::string text;
    if (!read_file(path, text)) {
        fail(options, fmt::format("cannot read '{}': {}", path, text));
        return options.classic ? 255 : 1;
    }
    if (!options.ini.empty() && !substitute(options, path, text)) return 1;
    return show(client.run_text(path, text));
}

}  // namespace

int run_shell(const Options& options) {
    if (options.from_file && !options.words.empty() && !options.classic && options.words.size() > 1)
        return fail(options, fmt::format("nothing is expected behind the file at '{}'; options go before -f", options.words[1]));
    std::string problem;
    const auto client = Client::connect(instance_wanted(options.name), problem);
    if (!client) return fail(options, problem);
    if (!client->set_options(client_options(options)) && !client->connected())
        return fail(options, fmt::format("instance '{}' does not answer", client->instance()));
    if (options.from_file && !options.words.empty()) return follow_file(*client, options);
    if (!options.execute.empty()) {
        int status = 0;
        for (const std::string& command : options.execute)
            if (status == 0 || options.keep_going) status = std::max(status, show(client->run(command, "<commandline>")));
        return status;
    }
    if (!options.words.empty() && !options.from_file) return show(client->run(joined(options.words), "<commandline>"));
    if (!::isatty(STDIN_FILENO)) return follow_input(*client, options);
    if (!options.classic)
        print(fmt::format("instance '{}', process {}; 'help' lists the commands, Tab completes\n", client->instance(), client->pid()));
    const Interrupts interrupts;
    client->cancel_on(interrupts.descriptor());
    RemoteShell listener(*client, "<shell>");
    const Prompt prompt = options.script    ? Prompt{"%%\n", "%%\n"}
                          : options.classic ? Prompt{"halcmd: ", "halcmd+: "}
                                            : Prompt{"hal> ", "hal+> "};
    const int status = talk(listener, prompt);
    return client->connected() ? status : fail(options, fmt::format("instance '{}' has ended", client->instance()));
}

}  // namespace hal::tools
