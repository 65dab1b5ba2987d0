// SPDX-License-Identifier: MIT
// `hal can drive`: controls a CiA 402 drive by SDO, one command or an interactive session.
#include "bus/canopen/drive.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <optional>
#include <unistd.h>

#include "base/types.hpp"
#include "bus/canopen/drive_shell.hpp"
#include "cli/output.hpp"

namespace hal::tools {

namespace {

bool duration_of(const Options& options, const std::string& text, std::int64_t& to) {
    const auto ns = parse_duration_ns(text);
    if (!ns || *ns <= 0) {
        fail(options, fmt::format("invalid duration '{}'; use 200ms or 1s", text));
        return false;
    }
    to = *ns;
    return true;
}

/// An option with a value.
struct ValueOption {
    std::string_view name;
    std::string& value;
};

/// Moves the options out of the words: they may be before or after the address. The rest is the
/// command.
bool parse_options(DriveOptions& options) {
    std::string timeout;
    const ValueOption with_value[] = {
        {"--node", options.node},
        {"--axis", options.axis},
        {"--timeout", timeout},
        {"--within", options.within},
        {"--supervise", options.supervise},
        {"--heartbeat-id", options.heartbeat_id},
    };
    std::vector<std::string> rest;
    for (std::size_t i = 0; i < options.words.size(); ++i) {
        const std::string& word = options.words[i];
        const auto* const option =
            std::find_if(std::begin(with_value), std::end(with_value),
                         [&](const ValueOption& each) { return word == each.name; });
        if (word == "-k" || word == "--keep-going") {
            options.keep_going = true;
        } else if (option != std::end(with_value)) {
            if (i + 1 == options.words.size()) {
                fail(options, fmt::format("missing value of {}", word));
                return false;
            }
            option->value = options.words[++i];
        } else if (word.starts_with("--")) {
            fail(options, fmt::format("unknown option '{}'; see: hal help can drive", word));
            return false;
        } else {
            rest.push_back(word);
        }
    }
    options.words = std::move(rest);
    return timeout.empty() || duration_of(options, timeout, options.timeout_ns);
}

bool supervision_of(const DriveOptions& options, SupervisionSettings& settings) {
    if (!options.heartbeat_id.empty() &&
        !node_of(options, options.heartbeat_id, settings.own_node)) {
        return false;
    }
    if (options.supervise.empty()) return true;
    if (options.supervise == "off") {
        settings.limit_ns = 0;
        return true;
    }
    const auto ns = parse_duration_ns(options.supervise);
    if (!ns || *ns < 50'000'000 || *ns > 65'000'000'000) {
        fail(options,
             fmt::format("invalid --supervise '{}'; write 50ms to 65s, or off", options.supervise));

        return false;
    }
    settings.limit_ns = *ns;
    return true;
}

/// What the command line asks for.
struct DriveRequest {
    DriveSession::Settings session;
    SupervisionSettings supervision;
    bool terminal = false;  ///< commands come from a terminal
};

/// Reads node, axis and times. Returns nullopt after printing the reason.
std::optional<DriveRequest> parse_request(const DriveOptions& options) {
    DriveRequest request;
    if (options.words.empty()) {
        fail(options, "missing address; type: hal can drive can:can0 --node 2 A on");
        return std::nullopt;
    }
    if (options.node.empty()) {
        fail(options,
             fmt::format("missing --node; type: hal can drive {} --node 2", options.words[0]));
        return std::nullopt;
    }
    if (!node_of(options, options.node, request.session.node)) return std::nullopt;
    const std::string& letter = options.axis;
    const char axis = letter.empty() ? 'A' : static_cast<char>(letter[0] & ~0x20);
    if (letter.size() > 1 || axis < 'A' || axis > 'H') {
        fail(options, fmt::format("invalid axis '{}'; write A to H", letter));
        return std::nullopt;
    }
    if (!supervision_of(options, request.supervision)) return std::nullopt;
    if (!options.within.empty() &&
        !duration_of(options, options.within, request.session.within_ns)) {
        return std::nullopt;
    }
    request.terminal = ::isatty(STDIN_FILENO) == 1;
    request.session.axis = static_cast<unsigned>(axis - 'A');
    request.session.axis_given = !letter.empty();
    request.session.one_shot = options.words.size() > 1;
    request.session.ends_at_failure = !request.terminal && !options.keep_going;
    request.session.prompt = !request.session.one_shot && request.terminal;
    return request;
}

/// Reports options that have no effect together. Returns true when it did.
bool has_conflict(const DriveOptions& options, const DriveRequest& request) {
    if (request.session.one_shot && options.keep_going) {
        fail(options,
             "--keep-going is for commands from a file or pipe; delete it, or the command");
        return true;
    }
    if (options.supervise == "off" && !options.heartbeat_id.empty()) {
        fail(options, "--heartbeat-id has no effect with --supervise off; delete one of them");
        return true;
    }
    return false;
}

/// Runs the command of the command line, or those of the input. Returns the exit status.
int run_commands(DriveShell& shell, const DriveOptions& options, const DriveRequest& request,
                 int stop_fd) {
    if (request.session.one_shot) {
        std::string line;
        for (std::size_t i = 1; i < options.words.size(); ++i) {
            line += options.words[i] + " ";
        }
        return shell.execute(line);
    }
    if (request.terminal) {
        print(fmt::format("node {} on {}; type 'help' for the commands, Tab completes\n",
                          request.session.node, options.words[0]));
    }
    return run_prompt_loop(shell, {"drive> ", "drive> "}, stop_fd);
}

}  // namespace

int run_can_drive(const DriveOptions& given) {
    DriveOptions options = given;
    if (!parse_options(options)) return 1;
    const std::optional<DriveRequest> request = parse_request(options);
    if (!request) return 1;
    NodeClient station(options, options.timeout_ns);
    if (has_conflict(options, *request)) return 1;
    const bool one_shot = request->session.one_shot;

    Supervision supervision(options, station, request->session.node, request->supervision);
    DriveSession session(options, station, supervision, request->session);
    DriveShell shell(session);
    station.bus.stop.when_signalled([&session] { session.press(); });
    // at a prompt Ctrl-C ends a command, not the session
    station.bus.stop.spare(request->session.prompt);
    station.outlasts_stop = true;  // axes are stopped before the session ends
    if (!station.open(options.words[0])) return 1;
    int status = 1;
    try {
        status = run_commands(shell, options, *request, station.bus.stop.fd());
    } catch (...) {
        session.end(false, "internal error", false);
        throw;
    }
    if (station.bus.stop.requested()) {
        session.end(false, "interrupted", false);
        return 1;
    }
    const bool leave = shell.left() || (one_shot && status == 0);
    const bool failed = one_shot || shell.over();
    const char* const why = failed ? "after the failure" : "end of input";
    return std::max(status, session.end(leave, why, !failed));
}

}  // namespace hal::tools
