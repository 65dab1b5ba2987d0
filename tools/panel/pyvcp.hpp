// SPDX-License-Identifier: MIT
// The widgets of PyVCP: what each has as options and pins. Facts: LinuxCNC's manual and its
// behaviour.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "panel/panel_layout.hpp"

namespace hal::tools {

/// Declares pins with the names that PyVCP gives them: automatic ones count in document order.
class PyvcpPins {
public:
    explicit PyvcpPins(PanelLayout& layout) : layout_(layout) {}
    std::string prefix;  ///< of included files

    /// Declares the pins of a widget `kind` with these options and adds them to the node. Returns a
    /// sentence when that is impossible.
    std::string declare(std::string_view kind, const nlohmann::json& options, nlohmann::json& node);

private:
    std::string add(const std::string& name, const char* type, bool output,
                    nlohmann::json initial = nullptr);
    std::string base(std::string_view counter, const nlohmann::json& options,
                     std::string_view end = "");
    void parameter(std::string_view kind, unsigned n, const nlohmann::json& options,
                   nlohmann::json& node, bool always);
    nlohmann::json limited(const nlohmann::json& options, double low, double high) const;

    void disable(const std::string& name, const nlohmann::json& options, nlohmann::json& node);
    static std::string name_or(std::string automatic, const nlohmann::json& options);
    /// Counts a widget, also one that is named. Returns its number.
    unsigned count(std::string_view kind) { return counts_[std::string(kind)]++; }

    // A function for each kind of widgets.
    void label(std::string_view kind, const nlohmann::json& options, nlohmann::json& node);
    void multilabel(std::string_view kind, const nlohmann::json& options, nlohmann::json& node);
    void led(std::string_view kind, const nlohmann::json& options, nlohmann::json& node);
    void button(std::string_view kind, const nlohmann::json& options, nlohmann::json& node);
    void checkbutton(std::string_view kind, const nlohmann::json& options, nlohmann::json& node);
    void radiobutton(std::string_view kind, const nlohmann::json& options, nlohmann::json& node);
    void number(std::string_view kind, const nlohmann::json& options, nlohmann::json& node);
    void timer(std::string_view kind, const nlohmann::json& options, nlohmann::json& node);
    void bar(std::string_view kind, const nlohmann::json& options, nlohmann::json& node);
    void meter(std::string_view kind, const nlohmann::json& options, nlohmann::json& node);
    void spinbox(std::string_view kind, const nlohmann::json& options, nlohmann::json& node);
    void scale(std::string_view kind, const nlohmann::json& options, nlohmann::json& node);
    void dial(std::string_view kind, const nlohmann::json& options, nlohmann::json& node);
    void jogwheel(std::string_view kind, const nlohmann::json& options, nlohmann::json& node);

    PanelLayout& layout_;
    std::map<std::string, unsigned, std::less<>> counts_;
    std::string problem_;
};

/// True for the name of a widget with a value or a text.
bool is_pyvcp_widget(std::string_view name);
/// Returns a colour of X11 as one of CSS; empty when the text cannot be one.
std::string css_colour(std::string_view name);

}  // namespace hal::tools
