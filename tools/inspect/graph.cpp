// SPDX-License-Identifier: MIT
// `hal graph FILE [-o OUT]`: the netlist as a drawing.
#include "inspect/graph.hpp"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <fmt/core.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "inspect/graph_dot.hpp"
#include "run/cell_netlists.hpp"
#include "run/offline.hpp"

extern char** environ;

namespace hal::tools {

namespace {

/// Draws it with Graphviz. Returns the reason of a failure, or an empty string.
std::string render_svg(const std::string& dot, const std::string& path) {
    int in[2], out[2];
    if (::pipe2(in, O_CLOEXEC) != 0) return std::strerror(errno);
    if (::pipe2(out, O_CLOEXEC) != 0) {
        const int why = errno;
        ::close(in[0]);
        ::close(in[1]);
        return std::strerror(why);
    }
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_adddup2(&actions, in[0], STDIN_FILENO);
    ::posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
    const char* const arguments[] = {"dot", "-Tsvg", nullptr};
    pid_t process = 0;
    const int problem = ::posix_spawnp(&process, "dot", &actions, nullptr, const_cast<char* const*>(arguments), environ);
    ::posix_spawn_file_actions_destroy(&actions);
    ::close(in[0]);
    ::close(out[1]);
    if (problem == 0) write_all(in[1], dot);  // it draws when it has read all; what goes wrong here is seen in the exit status
    ::close(in[1]);
    std::string drawing;
    char block[65536];
    for (ssize_t n = 0; problem == 0 && ((n = ::read(out[0], block, sizeof block)) > 0 || (n < 0 && errno == EINTR));)
        if (n > 0) drawing.append(block, static_cast<std::size_t>(n));
    ::close(out[0]);
    if (problem == ENOENT) return "SVG needs Graphviz; type: sudo apt install graphviz (or write a .dot file: -o netlist.dot)";
    if (problem != 0) return fmt::format("cannot run dot: {}", std::strerror(problem));
    int status = 0;
    while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {}
    return status == 0 ? write_file(path, drawing) : fmt::format("dot could not draw '{}'", path);
}

}  // namespace

int run_graph(const GraphOptions& options) {
    const bool svg = options.output.ends_with(".svg");
    if (!options.output.empty() && !svg && !options.output.ends_with(".dot") && !options.output.ends_with(".gv"))
        return fail(options, fmt::format("'{}' is neither .svg nor .dot; type: -o {}.svg", options.output, options.words.front()));
    auto nodes = requested_nodes(options);
    if (!nodes) return 1;
    Session session(offline());
    ShellOptions how;
    how.check = true;
    how.color = colours(STDERR_FILENO);
    Shell shell(session, how);
    TextOutput output;
    Cell cell(cell_name(options.words), options.part.empty() ? std::vector<NodeLine>{} : std::move(*nodes), offline(), how);
    const bool good = options.part.empty() ? load_offline(shell, options, output) == 0 : cell.load(options.words, options.ini, output);
    if (!good) {
        write_all(STDERR_FILENO, output.err_text);
        return 1;
    }
    const Session& drawn = options.part.empty() ? session : cell.session(cell.find(options.part));
    const std::string dot = as_dot(drawn.model(), options.words.front());
    if (options.output.empty()) return print(dot) ? 0 : 1;
    const std::string why = svg ? render_svg(dot, options.output) : write_file(options.output, dot);
    return why.empty() ? 0 : fail(options, why);
}

}  // namespace hal::tools
