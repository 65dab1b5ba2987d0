// SPDX-License-Identifier: MIT
// `hal graph FILE [-o OUT]`: the netlist as a drawing.
#include "inspect/graph.hpp"

#include <algorithm>
#include <fmt/core.h>
#include <unistd.h>

#include "cli/filter.hpp"
#include "cli/output.hpp"
#include "inspect/graph_dot.hpp"
#include "run/cell_netlists.hpp"
#include "run/offline.hpp"

namespace hal::tools {

namespace {

/// Returns false after printing the error.
bool parse_request(const GraphOptions& options, GraphRequest& request) {
    static constexpr std::pair<std::string_view, Cluster> kinds[] = {
        {"none", Cluster::none},
        {"component", Cluster::component},
        {"file", Cluster::file},
        {"thread", Cluster::thread}};
    const auto* const kind = std::find_if(std::begin(kinds), std::end(kinds), [&](const auto& one) {
        return one.first == options.cluster;
    });
    if (kind == std::end(kinds)) {
        fail(options,
             fmt::format("invalid --cluster '{}'; type: --cluster component, file, thread or none",
                         options.cluster));
        return false;
    }
    if (!options.pins.empty() && options.pins != "all" && options.pins != "linked") {
        fail(options,
             fmt::format("invalid --pins '{}'; type: --pins all or --pins linked", options.pins));
        return false;
    }
    if (options.depth >= 0 && options.around.empty()) {
        fail(options,
             fmt::format("--depth needs a name to start from; type: --around NAME --depth {}",
                         options.depth));
        return false;
    }
    request.cluster = kind->second;
    if (!options.pins.empty()) {
        request.all_pins = options.pins == "all";
    }
    request.around = options.around;
    if (options.depth >= 0) {
        request.depth = static_cast<std::size_t>(options.depth);
    }
    return true;
}

}  // namespace

int run_graph(const GraphOptions& options) {
    const bool svg = options.output.ends_with(".svg");
    if (!options.output.empty() && !svg && !options.output.ends_with(".dot") &&
        !options.output.ends_with(".gv")) {
        return fail(options, fmt::format("'{}' is neither .svg nor .dot; type: -o {}.svg",
                                         options.output, options.words.front()));
    }
    GraphRequest request;
    if (!parse_request(options, request)) return 1;
    auto nodes = requested_nodes(options);
    if (!nodes) return 1;
    Session session(offline());
    ShellOptions how;
    how.check = true;
    how.color = colours(STDERR_FILENO);
    Shell shell(session, how);
    TextOutput output;
    Cell cell(cell_name(options.words),
              options.part.empty() ? std::vector<NodeLine>{} : std::move(*nodes), offline(), how);
    const bool good = options.part.empty() ? load_offline(shell, options, output) == 0
                                           : cell.load(options.words, options.ini, output);
    if (!good) {
        write_all(STDERR_FILENO, output.err_text);
        return 1;
    }
    const Session& drawn = options.part.empty() ? session : cell.session(cell.find(options.part));
    const GraphView view(drawn.model(), drawn.sources, request);
    if (!view.problem().empty()) return fail(options, view.problem());
    const std::string dot = as_dot(drawn.model(), view, options.words.front());
    if (options.output.empty()) return exit_code(print(dot));
    std::string drawing;
    if (svg) {
        if (const std::string why = run_filter({"dot", "-Tsvg"}, dot, drawing, "graphviz");
            !why.empty()) {
            return fail(options,
                        fmt::format("cannot draw '{}': {} (or write a .dot file: -o netlist.dot)",
                                    options.output, why));
        }
    }
    const std::string why = write_file(options.output, svg ? drawing : dot);
    return why.empty() ? 0 : fail(options, why);
}

}  // namespace hal::tools
