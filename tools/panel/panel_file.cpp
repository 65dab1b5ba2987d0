// SPDX-License-Identifier: MIT
// A file of a user panel, in either language.
#include <filesystem>
#include <fmt/core.h>

#include "cli/output.hpp"
#include "machine/processes/address.hpp"
#include "panel/panel_layout.hpp"

namespace hal::tools {

PanelLayout read_panel_file(const std::string& path, const std::string& component,
                            std::string& errors) {
    std::string text;
    if (!read_file(path, text)) {
        errors += fmt::format("cannot read '{}': {}\n", path, text);
        return {};
    }
    const std::size_t begin = text.find_first_not_of(" \t\r\n");
    const bool xml = begin != std::string::npos &&
                     (text[begin] == '<' || static_cast<unsigned char>(text[begin]) == 0xEF);
    PanelLayout layout = xml ? read_pyvcp(text, path, errors) : read_panel_text(text, path, errors);
    if (!component.empty()) {
        layout.component = component;
    } else if (layout.component.empty()) {
        layout.component = xml ? "pyvcp" : std::filesystem::path(path).stem().string();
    }
    if (!good_instance_name(layout.component)) {
        errors +=
            fmt::format("'{}' is not a valid name of a component; choose one: --component NAME\n",
                        layout.component);
    }
    return layout;
}

}  // namespace hal::tools
