// SPDX-License-Identifier: MIT
// A user panel as data: the pins of its component, and a tree of widgets that the page draws.
#pragma once

#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "text/diagnostic.hpp"

namespace hal::tools {

struct PanelPin {
    std::string name;          ///< without the component
    std::string type;          ///< bit, float, s32, u32
    bool output = false;       ///< set by the page
    nlohmann::json initial;    ///< null: 0
    /// value of an output without a page, and before the first one; null: keeps its value
    nlohmann::json safe;
    /// what a page may set
    double min = -std::numeric_limits<double>::infinity();

    double max = std::numeric_limits<double>::infinity();
    std::string unit, doc;
};

struct PanelLayout {
    std::string component;
    std::int64_t timeout_ms = 500;  ///< from the loss of the page to the safe values
    std::vector<PanelPin> pins;
    nlohmann::json root;            ///< {"widget":"vbox","children":[…]}
};

/// Reads a `.panel` text or, when it begins with `<`, a PyVCP file; files that it includes are
/// relative to its folder.
/// `component`: the name of the component; empty: by the file. Appends errors as they are printed
/// to `errors`.
PanelLayout read_panel_file(const std::string& path, const std::string& component,
                            std::string& errors);
/// The same for a text. `name` is the file in messages.
PanelLayout read_panel_text(const std::string& text, const std::string& name, std::string& errors);
/// Returns the errors of a `.panel` text: each span is of source 1.
Diagnostics check_panel_text(const std::string& text);
PanelLayout read_pyvcp(const std::string& text, const std::string& name, std::string& errors);

}  // namespace hal::tools
