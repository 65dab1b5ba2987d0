// SPDX-License-Identifier: MIT
// `hal lsp`: a language server (Language Server Protocol 3.17) over standard input and output.
#include "lsp/lsp.hpp"

#include <cerrno>
#include <csignal>
#include <fcntl.h>
#include <fmt/format.h>
#include <malloc.h>
#include <poll.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "lsp/framing.hpp"
#include "lsp/language_server.hpp"

namespace hal::tools {

namespace {

/// Keeps standard output for messages: what a component prints while it is constructed goes to
/// standard error.
class MessageOutput {
public:
    MessageOutput() : descriptor_(::fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3)) {
        ::dup2(STDERR_FILENO, STDOUT_FILENO);
    }
    ~MessageOutput() {
        ::dup2(descriptor_, STDOUT_FILENO);
        ::close(descriptor_);
    }
    MessageOutput(const MessageOutput&) = delete;
    /// Returns false once the client has closed the pipe.
    bool send(std::string_view body) const { return write_all(descriptor_, framed(body)); }

private:
    int descriptor_;
};

/// The messages of the client. A component that reads standard input finds it empty.
class MessageInput {
public:
    MessageInput() : descriptor_(::fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 3)) {
        const int empty = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
        ::dup2(empty, STDIN_FILENO);
        ::close(empty);
    }
    ~MessageInput() { ::close(descriptor_); }
    MessageInput(const MessageInput&) = delete;

    enum class Event { bytes, timeout, end };
    /// Waits for at most `timeout_ms` (-1: for ever), then feeds what has come.
    Event read(MessageReader& reader, int timeout_ms) {
        pollfd waiting{descriptor_, POLLIN, 0};
        const int ready = ::poll(&waiting, 1, timeout_ms);
        if (ready < 0) return errno == EINTR ? Event::timeout : Event::end;
        if (ready == 0) return Event::timeout;
        char bytes[65536];
        const ssize_t got = ::read(descriptor_, bytes, sizeof bytes);
        if (got < 0 && errno == EINTR) return Event::timeout;
        if (got <= 0) return Event::end;
        reader.feed({bytes, static_cast<std::size_t>(got)});
        return Event::bytes;
    }

private:
    int descriptor_;
};

/// The next netlist is as large as the one that is freed: memory that goes back to the kernel is
/// requested from it again, and cleared, with each keystroke.
void keep_freed_memory() {
    ::mallopt(M_MMAP_THRESHOLD, 32 << 20);
    ::mallopt(M_TRIM_THRESHOLD, 512 << 20);
}

}  // namespace

int run_lsp(const LspOptions& options) {
    if (!options.words.empty()) {
        return fail(options,
                    fmt::format("unexpected argument '{}'; see: hal help lsp", options.words[0]));
    }
    ::signal(SIGPIPE, SIG_IGN);
    keep_freed_memory();
    const MessageOutput output;
    MessageInput input;
    bool connected = true;
    LanguageServer server(
        {options.ini, options.assume, options.name},
        [&](const std::string& body) { connected = output.send(body) && connected; });
    MessageReader reader;
    while (connected && !server.ended()) {
        // what has come is read before a netlist is loaded: the next keystroke may be among it
        const MessageInput::Event event = input.read(reader, server.idle_ms());
        if (event == MessageInput::Event::end) break;
        if (event == MessageInput::Event::timeout) {
            server.work();
        }
        while (const auto body = reader.next()) {
            server.handle(*body);
        }
        if (reader.failed()) return fail(options, reader.problem());
    }
    // `exit` without `shutdown` is an error: Language Server Protocol 3.17, exit
    return exit_code(server.was_shut_down());
}

}  // namespace hal::tools
