// SPDX-License-Identifier: MIT
#include "run/cell_netlists.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <fmt/format.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "machine/report/cycle_guard.hpp"
#include "run/offline.hpp"
#include "run/report.hpp"
#include "run/sim_summary.hpp"
#include "text/characters.hpp"
#include "text/diagnostic.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

int print_diagnostics(const ExecutionOptions& options, Diagnostics& diagnostics) {
    if (options.loudness != Loudness::nothing) {
        write_all(STDERR_FILENO, render(diagnostics, Sources{}, colours(STDERR_FILENO)));
    }
    return 1;
}

std::vector<std::string> names_of(const std::vector<NodeLine>& nodes) {
    std::vector<std::string> names;
    for (const NodeLine& node : nodes) {
        names.push_back(node.name);
    }
    return names;
}

ShellOptions for_check() {
    ShellOptions how;
    how.check = how.keep_going = true;
    how.color = colours(STDERR_FILENO);
    return how;
}

/// Splits settings into words KEY=VALUE for the DDS components. Returns nothing after printing an
/// invalid one.
std::optional<std::vector<std::string>> dds_settings(const Options& options,
                                                     const std::string& settings) {
    std::vector<std::string> words;
    static constexpr std::array<std::string_view, 7> keys{
        "domain", "interfaces", "peers", "server", "shared_memory", "profile", "security"};
    for (std::size_t at = settings.find_first_not_of(' '); at < settings.size();
         at = settings.find_first_not_of(' ', at)) {
        const std::size_t end = std::min(settings.find(' ', at), settings.size());
        const std::string word = settings.substr(at, end - at);
        const std::string key = word.substr(0, word.find('='));
        at = end;
        if (word.find('=') != word.npos && std::find(keys.begin(), keys.end(), key) != keys.end() &&
            word.find_first_of("\"'[]{}") ==
                word.npos) {  // loadrt removes quotes and expands ranges
            words.push_back(word);
            continue;
        }
        if (word.starts_with("--")) {
            fail(options,
                 fmt::format("--dds takes settings KEY=VALUE before {}; without any, leave "
                             "out --dds",
                             word));
            return std::nullopt;
        }
        fail(options,
             fmt::format("--dds: invalid setting '{}'; use KEY=VALUE with one of the keys: {}",
                         word, fmt::join(keys, " ")));
        return std::nullopt;
    }
    return words;
}

/// "NODE: COMMAND" or "all: COMMAND" of --execute.
struct NodeCommand {
    static constexpr std::size_t all = SIZE_MAX;
    std::size_t node = all;
    std::string line;
    std::int64_t advance_ns = 0;  ///< of all nodes; 0: `line` is another command
};

constexpr std::string_view blanks = " \t";

std::string_view trimmed(std::string_view text) {
    const auto begin = text.find_first_not_of(blanks);
    if (begin == text.npos) return {};
    return text.substr(begin, text.find_last_not_of(blanks) - begin + 1);
}

/// Returns what follows "advance" in a command line; nullopt: another command.
std::optional<std::string_view> advance_of(std::string_view line) {
    line = trimmed(line);
    constexpr std::string_view word = "advance";
    const bool is_other = line.size() > word.size() && blanks.find(line[word.size()]) == line.npos;
    if (!line.starts_with(word) || is_other) return std::nullopt;
    return trimmed(line.substr(word.size()));
}

/// Returns the commands of --execute; nullopt after printing what is wrong with one.
std::optional<std::vector<NodeCommand>> node_commands(const SimOptions& options,
                                                      const std::vector<NodeLine>& nodes) {
    std::vector<NodeCommand> commands;
    for (const std::string& text : options.execute) {
        const auto colon = text.find(':');
        const std::string_view name = trimmed(std::string_view(text).substr(0, colon));
        const auto at = std::find_if(nodes.begin(), nodes.end(),
                                     [name](const NodeLine& node) { return node.name == name; });
        if (colon == text.npos || (at == nodes.end() && name != "all")) {
            // "getp a:b" has a colon, but no node
            const bool is_command = colon == text.npos || name.find_first_of(blanks) != name.npos;
            const auto command =
                trimmed(is_command ? text : std::string_view(text).substr(colon + 1));
            fail(options,
                 fmt::format("--execute '{}' needs a node, or 'all'; use --execute '{}: {}'", text,
                             nodes.front().name, command));
            return std::nullopt;
        }
        NodeCommand command;
        command.line = text.substr(colon + 1);
        const auto amount = advance_of(command.line);
        if (at != nodes.end()) {
            command.node = static_cast<std::size_t>(at - nodes.begin());
        }
        if (amount && command.node != NodeCommand::all) {
            fail(options, fmt::format("--execute '{}': time passes for all nodes together; use "
                                      "--execute 'all: advance {}'",
                                      text, *amount));
            return std::nullopt;
        }
        if (amount) {
            const auto ns = is_digit(amount->empty() ? 'x' : amount->back())
                                ? std::nullopt
                                : parse_duration_ns(*amount);
            if (!ns || *ns <= 0) {
                fail(options,
                     fmt::format("--execute '{}': invalid time '{}'; use a number with its unit: "
                                 "--execute 'all: advance 5s'",
                                 text, *amount));
                return std::nullopt;
            }
            command.advance_ns = *ns;
        }
        commands.push_back(std::move(command));
    }
    return commands;
}

void advance(Cell& cell, std::int64_t ns, const StopRequest& stop) {
    constexpr std::int64_t slice_ns = 100'000'000;
    for (std::int64_t left = ns; left > 0 && !stop.requested(); left -= slice_ns) {
        cell.advance(std::min(left, slice_ns));
    }
}

/// Returns the exit status.
int execute(Cell& cell, const NodeCommand& command, const StopRequest& stop, Output& output) {
    if (command.advance_ns != 0) {
        advance(cell, command.advance_ns, stop);
        return 0;
    }
    int status = 0;
    for (std::size_t i = 0; i < cell.size(); ++i) {
        if (command.node == NodeCommand::all || command.node == i) {
            status = std::max(status, cell.shell(i).execute(command.line, output, "<commandline>"));
        }
    }
    return status;
}

/// Returns which option applies to one machine only, with what to use for several; "" when none.
std::string problem_of(const SimOptions& options, const std::vector<NodeLine>& nodes) {
    if (options.cycles != 0) {
        return "--cycles applies to one machine; for several use --for 10s";
    }
    if (!options.name.empty()) {
        return "--name applies to one machine; select it: --node " + nodes.front().name;
    }
    if (!options.show.empty()) {
        return "--show applies to one machine; for several use --execute 'NODE: getp NAME'";
    }
    return "";
}

/// The machines of a netlist with nodes, simulated together.
class CellSimulation {
public:
    /// `options` outlives it.
    CellSimulation(const SimOptions& options, std::vector<NodeLine> nodes)
        : options_(options),
          cell_(cell_name(options.words), std::move(nodes), session_options(), how()) {
        guard_.begin(options.cycle_limit_ns);
        stop_.when_signalled([this] {
            for (std::size_t i = 0; i < cell_.size(); ++i) {
                cell_.shell(i).cancel();
            }
            guard_.end_soon();
        });
    }

    /// Simulates the time of --for, then executes the commands. Returns the exit status.
    int run(const std::vector<NodeCommand>& commands) {
        const bool started = start();
        const auto begun = std::chrono::steady_clock::now();
        if (started) {
            advance(cell_, options_.for_ns, stop_);
        }
        const auto wall = std::chrono::steady_clock::now() - begun;
        int status = started ? execute_all(commands) : 1;
        if (started && !options_.report && summary_wanted(options_, output_.printed)) {
            print_summary(wall);
        }
        if (has_faulted_thread()) {
            status = 1;
        }
        if (options_.report) {
            print_reports();
        }
        stop_.release();
        return stop_.requested() ? 1 : status;
    }

private:
    SessionOptions session_options() const {
        SessionOptions session;
        session.name = fmt::format("sim-{}", ::getpid());
        session.virtual_clock = true;
        session.wait_limit_ns = options_.cycle_limit_ns;
        return session;
    }

    ShellOptions how() const {
        ShellOptions how = shell_options(options_);
        how.shared_time = options_.part.empty();
        return how;
    }

    bool start() {
        const bool started =
            cell_.load(options_.words, options_.ini, output_) && cell_.start(output_);
        if (!options_.part.empty()) {
            cell_.isolate(cell_.find(options_.part));
        }
        return started;
    }

    /// Ends with the first command that fails.
    int execute_all(const std::vector<NodeCommand>& commands) {
        for (const NodeCommand& command : commands) {
            if (stop_.requested()) break;
            if (const int status = execute(cell_, command, stop_, output_); status != 0) {
                return status;
            }
        }
        return 0;
    }

    void print_summary(std::chrono::steady_clock::duration wall) {
        if (cell_.size() == 0) return;
        write_all(STDERR_FILENO, simulated_for(cell_.session(0).threads().now_ns(), wall) + "\n");
        for (std::size_t i = 0; i < cell_.size(); ++i) {
            const std::string title = "node " + cell_.nodes()[i].name;
            write_all(STDERR_FILENO, simulated_summary(cell_.session(i), title));
        }
    }

    bool has_faulted_thread() {
        for (std::size_t i = 0; i < cell_.size(); ++i) {
            const auto threads = cell_.session(i).reports().threads();
            if (std::ranges::any_of(threads, &ThreadReport::faulted)) return true;
        }
        return false;
    }

    void print_reports() {
        for (std::size_t i = 0; i < cell_.size(); ++i) {
            write_all(STDERR_FILENO, fmt::format("node {}\n{}", cell_.nodes()[i].name,
                                                 timing_report(cell_.session(i))));
        }
    }

    const SimOptions& options_;
    StopRequest stop_;
    CycleGuard guard_;
    TrackedOutput output_;
    Cell cell_;
};

}  // namespace

std::optional<std::vector<NodeLine>> requested_nodes(const NetlistOptions& options) {
    std::vector<NodeLine> nodes = nodes_of(options.words, options.ini);
    const std::vector<std::string> names = names_of(nodes);
    if (options.part.empty() ||
        std::find(names.begin(), names.end(), options.part) != names.end()) {
        return nodes;
    }
    Diagnostics found;
    std::string files;
    for (const std::string& word : options.words) {
        append_item(files, word, " ");
    }
    found.error("no-such-node", {}, "'" + files + "' has no node '" + options.part + "'",
                did_you_mean(options.part, names),
                names.empty() ? "it is for one machine: leave --node out"
                              : "its nodes: " + listed(names, 100));
    print_diagnostics(options, found);
    return std::nullopt;
}

int check_cell(const NetlistOptions& options, std::vector<NodeLine> nodes) {
    ShellOptions how = for_check();
    how.notes = true;
    Cell cell(cell_name(options.words), std::move(nodes), offline(), how);
    ErrorsOnly output;
    if (!cell.load(options.words, options.ini, output)) return 1;
    for (const std::string& path : options.words) {
        write_all(STDERR_FILENO, path + ": no errors\n");
    }
    write_all(STDERR_FILENO, fmt::format("nodes: {}\n", listed(names_of(cell.nodes()), 100)));
    for (const NodeTopic& topic : cell.topics()) {
        std::vector<std::string> readers;
        for (std::size_t i = 0; i < cell.size(); ++i) {
            if (topic.read_by(i)) {
                readers.push_back(cell.nodes()[i].name);
            }
        }
        write_all(STDERR_FILENO, fmt::format("  {} -> {}: {}\n", cell.nodes()[topic.from].name,
                                             listed(readers, 100), topic.layout()));
    }
    return 0;
}

int sim_cell(const SimOptions& options, std::vector<NodeLine> nodes) {
    const std::string problem = problem_of(options, nodes);
    if (!problem.empty()) return fail(options, problem);
    export_variables(options, "sim");
    const auto commands = node_commands(options, nodes);
    if (!commands) return 1;
    return CellSimulation(options, std::move(nodes)).run(*commands);
}

int load_node(HostedMachine& machine, const RunOptions& options, std::vector<NodeLine> nodes) {
    ProcessOutput output;
    Cell cell(cell_name(options.words), std::move(nodes), offline(), for_check());
    {
        TextOutput said;  // other messages are printed when the part itself is loaded
        if (!cell.load(options.words, options.ini, said)) {
            write_all(STDERR_FILENO, said.err_text);
            return 1;
        }
    }
    const std::size_t own = cell.find(options.part);
    const auto available = machine.session.host().available_components();
    if (std::find(available.begin(), available.end(), "dds_publish") == available.end() &&
        cell.size() > 1) {
        Diagnostics found;
        found.error("no-dds", {},
                    "the nodes of this netlist exchange signals over DDS, and this Halcyon was "
                    "built without it",
                    "",
                    "sudo apt install libfastrtps-dev, and build again; hal sim runs all nodes in "
                    "one process without it");
        return print_diagnostics(options, found);
    }
    const char* const usual = std::getenv("HALCYON_DDS");
    const auto participant =
        dds_settings(options, options.dds.empty() && usual ? usual : options.dds);
    if (!participant) return 1;
    const NodeLinks links = cell.size() > 1 ? node_links(cell, own, *participant) : NodeLinks{};
    machine.shell.add_latencies(node_latencies(cell, own, false));
    const std::string name = fmt::format("<links of node {}>", options.part);
    const auto netlist = [](const std::string& path) { return path.ends_with(".hal"); };
    // the whole machine is one transaction
    if (options.ini.empty() && std::all_of(options.words.begin(), options.words.end(), netlist)) {
        auto commands = links.before;
        for (const std::string& path : options.words) {
            commands.push_back({"source", path});
        }
        commands.insert(commands.end(), links.after.begin(), links.after.end());
        return machine.shell.execute(commands, output, name);
    }
    int status = machine.shell.execute(links.before, output, name);
    if (status != 0) return status;
    status = machine.load();
    if ((status != 0 && !options.keep_going) || machine.stop.requested()) return status;
    return std::max(status, machine.shell.execute(links.after, output, name));
}

}  // namespace hal::tools
