// SPDX-License-Identifier: MIT
// User panels: .panel files, PyVCP files, the values in them; host names and requests of a page.
#include <cstdint>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "tests/fuzz/driver/require.hpp"
#include "tools/panel/guard.hpp"
#include "tools/panel/panel_layout.hpp"
#include "tools/panel/python_literal.hpp"
#include "tools/panel/pyvcp.hpp"
#include "tools/panel/requests.hpp"

namespace {

using hal::fuzz::require;
using hal::tools::PanelLayout;
using Json = nlohmann::json;

/// Counts the widgets with a pin and checks that the pins exist.
void check_tree(const Json& node, const std::set<std::string>& pins, int depth) {
    require(depth < 100, "the tree is bounded");
    require(node.contains("widget"), "each node is a widget");
    if (node.contains("pin")) {
        require(pins.contains(node["pin"].get<std::string>()), "the pin of a widget is declared");
    }
    if (node.contains("children")) {
        for (const Json& child : node["children"]) {
            check_tree(child, pins, depth + 1);
        }
    }
}

void check_layout(const PanelLayout& layout, const std::string& errors) {
    std::set<std::string> pins;
    for (const auto& pin : layout.pins) {
        require(pins.insert(pin.name).second || !errors.empty(), "pins have different names");
    }
    if (errors.empty()) {
        check_tree(layout.root, pins, 0);
    }
    require(!layout.root.dump(-1, ' ', false, Json::error_handler_t::replace).empty(),
            "the layout is sent as JSON");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string input(reinterpret_cast<const char*>(data), size);
    std::string errors;
    const PanelLayout text = hal::tools::read_panel_text(input, "input.panel", errors);
    check_layout(text, errors);
    errors.clear();
    const PanelLayout xml = hal::tools::read_pyvcp(input, "/nowhere/input.xml", errors);
    check_layout(xml, errors);

    if (const auto value = hal::tools::python_literal(input)) {
        require(!value->is_discarded(), "a literal is a value");
    }
    for (const char c : hal::tools::css_colour(input)) {
        require(c != ';' && c != '{' && c != '"' && c != '<', "a colour is only a colour");
    }
    const hal::tools::Access access{{"localhost"}, false, {}, "token", true, false};
    if (hal::tools::host_allowed(access, input)) {
        require(input.size() >= 9 && input.size() <= 15, "only localhost with a port is allowed");
    }
    Json request = Json::parse(input, nullptr, false);
    if (request.is_object()) {
        std::string problem;
        const bool rejected =
            hal::tools::check_request(request, problem) == hal::tools::RequestKind::rejected;
        require(rejected == !problem.empty(), "a request that is rejected has a reason");
        if (!rejected) {
            require(!request.contains("stop") && !request.contains("script") &&
                        !request.contains("component"),
                    "only listed verbs pass");
        }
    }
    return 0;
}
