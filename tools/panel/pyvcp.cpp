// SPDX-License-Identifier: MIT
// Reads a PyVCP file into a tree of widgets.
#include "panel/pyvcp.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fmt/core.h>
#include <fstream>
#include <map>
#include <pugixml.hpp>
#include <unistd.h>
#include <utility>

#include "cli/output.hpp"
#include "panel/panel_errors.hpp"
#include "panel/python_literal.hpp"
#include "text/config_text.hpp"
#include "text/numbers.hpp"
#include "text/suggest.hpp"

namespace hal::tools {

using Json = nlohmann::json;

namespace {

constexpr std::array<std::string_view, 4> containers{"vbox", "hbox", "labelframe", "tabs"};
constexpr std::array<std::string_view, 3> invisible{"title", "option", "axisoptions"};
constexpr std::array<std::string_view, 14> colour_options{"fg",
                                                          "bg",
                                                          "foreground",
                                                          "background",
                                                          "activebackground",
                                                          "activeforeground",
                                                          "on_color",
                                                          "off_color",
                                                          "disabled_color",
                                                          "fillcolor",
                                                          "bgcolor",
                                                          "dialcolor",
                                                          "edgecolor",
                                                          "dotcolor"};
constexpr int deepest = 60;
constexpr std::size_t max_widgets = 5000;

template <class Names>
bool one_of(std::string_view name, const Names& names) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

/// An attribute is Python only when it begins like a tuple, list, dict or string; else a number or
/// a text.
Json attribute_value(std::string_view text) {
    if (!text.empty() && std::string_view("{[(\"'").find(text[0]) != std::string_view::npos) {
        if (auto value = python_literal(text)) return *value;
    }
    double number = 0;
    if (parse_whole(text, number)) {
        return text.find_first_of(".eE") == text.npos ? Json(static_cast<std::int64_t>(number))
                                                      : Json(number);
    }
    return std::string(text);
}

bool read_bytes(const std::string& path, std::size_t max, std::string& bytes) {
    std::ifstream file(path, std::ios::binary);
    bytes.resize(max + 1);
    file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    bytes.resize(static_cast<std::size_t>(file.gcount()));
    return !bytes.empty() && bytes.size() <= max;
}

std::string base64(std::string_view bytes) {
    constexpr std::string_view digits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        unsigned bits = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            bits =
                bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
        }
        for (std::size_t k = 0; k < 4; ++k) {
            text += i + k > bytes.size() ? '=' : digits[bits >> (18 - 6 * k) & 63];
        }
    }
    return text;
}

void to_css(Json& options) {
    for (auto& [key, value] : options.items()) {
        if (value.is_string() && one_of(key, colour_options)) {
            value = css_colour(value.get<std::string>());
        }
        const bool range = key.starts_with("range") || key.starts_with("region");
        if (range && value.is_array() && value.size() == 3 && value[2].is_string()) {
            value[2] = css_colour(value[2].get<std::string>());
        }
    }
}

class Reader {
public:
    explicit Reader(PanelLayout& layout) : layout_(layout), pins_(layout) {}

    std::string errors() const { return errors_.text(colours(STDERR_FILENO)); }

    Json file(const std::string& text, const std::string& name) {
        const std::string outer_name = std::exchange(name_, name);
        const std::uint32_t outer_source = std::exchange(source_, errors_.add_file(name, text));
        const std::size_t outer_size = std::exchange(size_, text.size());
        Json root{{"widget", "vbox"}, {"children", Json::array()}};
        pugi::xml_document document;
        const pugi::xml_parse_result result = document.load_buffer(text.data(), text.size());
        if (!result) {
            error(result.offset, 1, fmt::format("invalid XML: {}", result.description()),
                  "check the tags and quotation marks here");
        } else if (const pugi::xml_node top = document.child("pyvcp")) {
            children(top, root, true);
        } else {
            error(0, 1, "missing element <pyvcp>", "a PyVCP file begins with <pyvcp>");
        }
        name_ = outer_name;
        source_ = outer_source;
        size_ = outer_size;
        return root;
    }

private:
    /// `length`: of what is marked from that byte on.
    void error(std::ptrdiff_t offset, std::size_t length, const std::string& sentence,
               const std::string& help = "") {
        const std::size_t at =
            std::min(static_cast<std::size_t>(std::max<std::ptrdiff_t>(offset, 0)), size_);
        errors_.add({source_, static_cast<std::uint32_t>(at),
                     static_cast<std::uint32_t>(std::min(at + length, size_))},
                    sentence, help);
    }
    void error(pugi::xml_node element, const std::string& sentence, const std::string& help = "") {
        error(element.offset_debug(), std::string_view(element.name()).size(), sentence, help);
    }

    void attributes(pugi::xml_node element, Json& options) {
        for (const pugi::xml_attribute attribute : element.attributes()) {
            options[attribute.name()] = attribute_value(attribute.value());
        }
    }

    /// Children that are neither widgets nor containers are options, whose text is Python.
    void option(pugi::xml_node child, std::string_view owner, Json& options) {
        const bool nested =
            child.find_child([](pugi::xml_node node) { return node.type() == pugi::node_element; });
        if (nested) {
            return error(child, fmt::format("unknown element <{}> in <{}>", child.name(), owner),
                         suggestion(child.name()));
        }
        const auto value = python_literal(child.text().get());
        if (!value) {
            return error(child,
                         fmt::format("invalid value of option '{}': '{}'", child.name(),
                                     std::string_view(child.text().get()).substr(0, 60)),
                         "use a string in quotation marks, a number, a list or a constant of Tk");
        }
        options[child.name()] = *value;
    }

    static std::string suggestion(std::string_view name) {
        static const std::vector<std::string> known{
            "vbox",        "hbox",        "labelframe", "table",     "tabs",
            "label",       "multilabel",  "led",        "rectled",   "button",
            "checkbutton", "radiobutton", "number",     "u32",       "s32",
            "timer",       "bar",         "meter",      "spinbox",   "scale",
            "dial",        "jogwheel",    "include",    "image_bit", "image_u32"};
        return did_you_mean(std::string(name), known);
    }

    /// How the next widget is placed in its container.
    struct Layout {
        Json pack;                    ///< in a box
        Json cell = Json::object();   ///< in a table: of the next widget only
        std::string sticky = "ne";    ///< in a table
    };

    /// Reads an element that changes the layout of the widgets behind it. Returns false for another
    /// element.
    static bool change_layout(pugi::xml_node element, Layout& layout) {
        const std::string_view name = element.name();
        if (name == "boxfill") {
            layout.pack["fill"] = element.attribute("fill").as_string("none");
        } else if (name == "boxanchor") {
            layout.pack["anchor"] = element.attribute("anchor").as_string("center");
        } else if (name == "boxexpand") {
            layout.pack["expand"] =
                std::string_view(element.attribute("expand").as_string("yes")) == "yes";
        } else if (name == "tablespan") {
            layout.cell = {{"rows", element.attribute("rows").as_int(1)},
                           {"columns", element.attribute("columns").as_int(1)}};
        } else if (name == "tablesticky") {
            layout.sticky = element.attribute("sticky").as_string("ne");
        } else {
            return false;
        }
        return true;
    }

    /// Reads the widgets in a container, and what changes the layout of those that follow.
    void children(pugi::xml_node element, Json& node, bool top) {
        if (++depth_ > deepest) {
            --depth_;
            return error(element, "elements are nested more than 60 deep");
        }
        const std::string_view owner = element.name();
        const char* const fill = owner == "hbox" ? "y" : "x";
        Layout layout;
        layout.pack = {{"fill", top ? "both" : fill}, {"expand", true}, {"anchor", "center"}};
        Json options = Json::object();
        if (!top) {
            attributes(element, options);
        }
        for (const pugi::xml_node child : element.children()) {
            if (child.type() != pugi::node_element) continue;
            const std::string_view name = child.name();
            if (change_layout(child, layout)) continue;
            if (name == "tablerow") {
                node["children"].push_back({{"widget", "tablerow"}});
            } else if (name == "image") {
                picture(child);
            } else if (one_of(name, invisible)) {
                continue;
            } else if (is_pyvcp_widget(name) || one_of(name, containers) || name == "table" ||
                       name == "include") {
                Json one = name == "include" ? include(child) : widget(child);
                if (one.is_null()) continue;
                if (owner == "table") {
                    one["span"] = std::exchange(layout.cell, Json::object());
                    one["sticky"] = layout.sticky;
                } else {
                    one["pack"] = layout.pack;
                }
                node["children"].push_back(std::move(one));
            } else if (top) {
                continue;  // as in PyVCP, which uses it as an option of the window
            } else {
                option(child, owner, options);
            }
        }
        to_css(options);
        if (!options.empty()) {
            node["options"] = std::move(options);
        }
        --depth_;
    }

    Json widget(pugi::xml_node element) {
        if (++widgets_ > max_widgets) {
            if (widgets_ == max_widgets + 1) {
                error(element, "more than 5000 widgets");
            }
            return {};
        }
        const std::string name = element.name();
        Json node{{"widget", name}};
        if (!is_pyvcp_widget(name)) {
            node["children"] = Json::array();
            children(element, node, false);
            return node;
        }
        Json options = Json::object();
        attributes(element, options);
        for (const pugi::xml_node child : element.children()) {
            if (child.type() == pugi::node_element) {
                option(child, name, options);
            }
        }
        if (const std::string problem = pins_.declare(name, options, node); !problem.empty()) {
            error(element, problem, "each pin of a panel needs a name of its own");
        }
        if (name.starts_with("image_")) {
            pictures(options, node);
        }
        to_css(options);
        node["options"] = std::move(options);
        return node;
    }

    /// Reads an image of the file for the page: its name and data URI.
    void picture(pugi::xml_node element) {
        constexpr std::size_t max = 200'000;
        const std::string file = element.attribute("file").as_string();

        const std::string name = element.attribute("name").as_string();
        std::string bytes;
        if (!read_bytes((std::filesystem::path(name_).parent_path() / file).string(), max, bytes) ||
            images_.size() >= 100) {
            return error(
                element,
                fmt::format("cannot read the image '{}' (at most 100 images of 200 kB)", file));
        }
        std::string kind = bytes.starts_with("GIF8") ? "gif" : "";
        if (bytes.starts_with("\x89PNG")) {
            kind = "png";
        }
        if (kind.empty()) {
            return error(element, fmt::format("the image '{}' is neither GIF nor PNG", file));
        }
        images_[name] = "data:image/" + kind + ";base64," + base64(bytes);
    }

    /// `images` is a list of names, or one text with blanks between them.
    void pictures(const Json& options, Json& node) {
        const Json given = options.value("images", Json());
        Json names = Json::array();
        if (given.is_array()) {
            names = given;
        } else if (given.is_string()) {
            for (const text::Word& word : text::words_of({given.get<std::string>(), {}})) {
                names.push_back(word.text);
            }
        }
        for (const Json& name : names) {
            const auto at =
                name.is_string() ? images_.find(name.get<std::string>()) : images_.end();
            node["sources"].push_back(at == images_.end() ? "" : at->second);
        }
        node["names"] = std::move(names);
    }

    Json include(pugi::xml_node element) {
        const std::string source = element.attribute("src").as_string();
        const std::string path = (std::filesystem::path(name_).parent_path() / source).string();
        std::string text;
        if (++includes_ > 20) {
            error(element, "more than 20 included files");
            return {};
        }
        if (source.empty() || !read_file(path, text)) {
            error(element, fmt::format("cannot read the included file '{}'{}{}", source,
                                       text.empty() ? "" : ": ", text));
            return {};
        }
        const std::string outer = pins_.prefix;
        if (const auto prefix = element.attribute("prefix")) {
            pins_.prefix = outer + prefix.as_string() + std::string(".");
        }
        Json node = file(text, path);
        pins_.prefix = outer;
        return node;
    }

    PanelLayout& layout_;
    PanelErrors errors_{"panel-element"};
    PyvcpPins pins_;
    std::string name_;
    std::uint32_t source_ = 0;
    std::size_t size_ = 0;
    int depth_ = 0;
    std::size_t widgets_ = 0;
    std::size_t includes_ = 0;
    std::map<std::string, std::string> images_;
};

}  // namespace

PanelLayout read_pyvcp(const std::string& text, const std::string& name, std::string& errors) {
    PanelLayout layout;
    Reader reader(layout);
    layout.root = reader.file(text, name);
    errors += reader.errors();
    layout.root["pyvcp"] = true;
    return layout;
}

}  // namespace hal::tools
