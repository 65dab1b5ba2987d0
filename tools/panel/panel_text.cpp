// SPDX-License-Identifier: MIT
// The language of .panel files: a line per widget, `row`, `column` and `frame` up to `end`.
#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <map>
#include <memory>
#include <optional>
#include <unistd.h>

#include "base/types.hpp"
#include "cli/output.hpp"
#include "machine/processes/address.hpp"
#include "panel/css_colours.hpp"
#include "panel/panel_errors.hpp"
#include "panel/panel_layout.hpp"
#include "text/characters.hpp"
#include "text/config_text.hpp"
#include "text/numbers.hpp"
#include "text/suggest.hpp"

namespace hal::tools {

using Json = nlohmann::json;
using text::Word;

namespace {

constexpr int max_depth = 30;
constexpr std::size_t max_widgets = 2000;

/// A widget of the language.
struct Kind {
    const char* name;
    const char* widget;  ///< for the page
    const char* type;    ///< of its pin; nullptr: it has none
    bool output;
    const char* keys;    ///< each followed by a blank; besides label, doc, unit
};

constexpr Kind kinds[] = {
    {"gauge", "meter", "float", false, "min max warn alarm of "},
    {"bar", "bar", "float", false, "min max warn alarm of "},
    {"number", "number", "float", false, "digits of "},
    {"integer", "number", "s32", false, "of "},
    {"led", "led", "bit", false, "on off of "},
    {"chart", "chart", "float", false, "min max seconds of "},
    {"button", "button", "bit", true, "safe "},
    {"toggle", "checkbutton", "bit", true, "initial safe "},
    {"slider", "scale", "float", true, "min max step initial safe "},
    {"input", "spinbox", "float", true, "min max step initial safe "},
    {"dial", "dial", "float", true, "min max step initial safe "},
    {"text", "label", nullptr, false, ""},
};

constexpr const char* number_keys[] = {"min", "max", "step", "warn", "alarm", "seconds", "digits"};

/// Splits a line at blanks; "…" keeps blanks together, also behind `key=`. `open`: a quotation mark
/// without its second.
std::vector<Word> words_of_line(const Word& line, bool& open) {
    std::vector<Word> words;
    const std::string& text = line.text;
    for (std::size_t i = 0; i < text.size();) {
        if (text[i] == ' ' || text[i] == '\t') {
            ++i;
            continue;
        }
        Word word = text::part(line, i, i + 1);
        word.text.clear();
        bool quoted = false;
        const std::size_t begin = i;
        for (; i < text.size() && (quoted || (text[i] != ' ' && text[i] != '\t')); ++i) {
            if (text[i] == '"') {
                quoted = !quoted;
            } else {
                word.text += text[i];
            }
        }
        open = quoted;
        word.at.length = static_cast<std::uint32_t>(i - begin);
        words.push_back(std::move(word));
    }
    return words;
}

std::optional<double> number_of(std::string_view text) {
    double value = 0;
    const bool good = parse_whole(text, value) && std::isfinite(value);
    return good ? std::optional(value) : std::nullopt;
}

class Reader {
public:
    PanelLayout read(const std::string& whole, const std::string& name) {
        source_ = errors_.add_file(name, whole);
        layout_.root = {{"widget", "vbox"}, {"children", Json::array()}};
        open_.push_back(&layout_.root);
        for (text::Lines lines(whole, "#"); auto line = lines.next();) {
            bool open = false;
            const auto words = words_of_line(*line, open);
            if (open) {
                error(words.back().at, "this quotation mark has no second one in its line");
            } else if (!words.empty()) {
                this->line(words);
            }
        }
        if (open_.size() > 1) {
            error(opened_.back(), "this container has no end", "add a line: end");
        }
        return std::move(layout_);
    }
    const PanelErrors& errors() const { return errors_; }

private:
    void error(const text::Span& at, const std::string& sentence, const std::string& help = "") {
        errors_.add({source_, at.offset, at.offset + at.length}, sentence, help);
    }

    void line(const std::vector<Word>& words) {
        const std::string& first = words[0].text;
        if (first == "component") return setting(words, layout_.component);
        if (first == "timeout") return timeout(words);
        if (first == "title") {
            setting(words, title_);
            layout_.root["title"] = title_;
            return;
        }
        if (first == "end") {
            if (open_.size() == 1) {
                return error(words[0].at, "'end' without an open row, column or frame");
            }
            open_.pop_back();
            opened_.pop_back();
            return;
        }
        if (first == "row" || first == "column" || first == "frame") return container(words);
        const auto kind = std::find_if(std::begin(kinds), std::end(kinds),
                                       [&](const Kind& k) { return first == k.name; });
        if (kind != std::end(kinds)) return widget(*kind, words);
        std::vector<std::string> names{"component", "timeout", "title", "row",
                                       "column",    "frame",   "end"};
        for (const Kind& k : kinds) {
            names.emplace_back(k.name);
        }
        error(words[0].at, fmt::format("unknown word '{}'", first.substr(0, 60)),
              suggestion(first, names, "the words are"));
    }

    void setting(const std::vector<Word>& words, std::string& to) {
        if (words.size() != 2) {
            return error(words[0].at, fmt::format("'{}' takes one word", words[0].text),
                         "write names with blanks in quotation marks");
        }
        if (!to.empty()) {
            error(words[0].at, fmt::format("a second '{}'", words[0].text), "a panel has one");
        }
        to = words[1].text;
        if (words[0].text == "component" && !good_instance_name(to)) {
            error(words[1].at,
                  fmt::format("'{}' is not a valid name of a component", to.substr(0, 60)));
        }
    }

    void timeout(const std::vector<Word>& words) {
        const auto ns = words.size() == 2 ? parse_duration_ns(words[1].text) : std::nullopt;
        if (!ns || *ns < 100'000'000 || *ns > 60'000'000'000) {
            return error(words.back().at, "the timeout must be 100ms to 60s",
                         "write: timeout 500ms");
        }
        layout_.timeout_ms = *ns / 1'000'000;
    }

    Json& add(Json node) {
        Json& children = (*open_.back())["children"];
        children.push_back(std::move(node));
        return children.back();
    }

    void container(const std::vector<Word>& words) {
        const bool frame = words[0].text == "frame";
        if (words.size() > 2) {
            return error(words[2].at, "a container has at most a title",
                         "write titles with blanks in quotation marks");
        }
        if (open_.size() > max_depth) {
            return error(words[0].at, "containers are nested more than 30 deep");
        }
        Json node{{"widget", words[0].text == "row" ? "hbox" : "vbox"},
                  {"children", Json::array()}};
        if (words.size() == 2 || frame) {
            node["widget"] = "labelframe";
            node["horizontal"] = words[0].text == "row";
            node["options"] = {{"text", words.size() == 2 ? words[1].text : ""}};
        }
        containers_.push_back(std::make_unique<Json>(std::move(node)));
        // The node is filled in place: pointers into the array of its parent do not survive the
        // next widget.
        Json& placed = add(Json());
        placed = {{"index", containers_.size() - 1}};
        open_.push_back(containers_.back().get());
        opened_.push_back(words[0].at);
    }

    void widget(const Kind& kind, const std::vector<Word>& words);
    using Given = std::map<std::string, Word>;  // options by key
    void pin(const Kind& kind, const std::vector<Word>& words, const Given& given, Json& options,
             Json& node);
    bool check_name(const Word& word);
    void set_value(const Kind& kind, const Given& given, const char* key, const PanelPin& pin,
                   Json& to);
    Given given_options(const Kind& kind, const std::vector<Word>& words);
    Json widget_options(const Given& given);
    void set_number(const std::string& key, const Word& word, Json& options);
    void check_colour(const std::string& key, const Word& word);
    void check_numbers(const Json& options, const Given& given);
    std::optional<Json> value_of(const Kind& kind, const Word& word);

public:
    /// Puts the containers where they belong.
    void assemble(Json& node) {
        for (Json& child : node["children"]) {
            if (child.contains("index")) {
                child = std::move(*containers_[child["index"].get<std::size_t>()]);
            }
            if (child.contains("children")) {
                assemble(child);
            }
        }
    }

private:
    PanelErrors errors_{"panel-line"};
    std::uint32_t source_ = 0;
    PanelLayout layout_;
    std::string title_;
    std::vector<Json*> open_;
    std::vector<text::Span> opened_;
    std::vector<std::unique_ptr<Json>> containers_;
    std::size_t widgets_ = 0;
};

std::optional<Json> Reader::value_of(const Kind& kind, const Word& word) {
    if (std::string_view(kind.type) == "bit") {
        if (word.text == "TRUE" || word.text == "1" || word.text == "true") return Json(true);
        if (word.text == "FALSE" || word.text == "0" || word.text == "false") return Json(false);
        error(word.at, fmt::format("'{}' is not a bit", word.text.substr(0, 60)),
              "write TRUE or FALSE");
        return std::nullopt;
    }
    if (const auto number = number_of(word.text)) return Json(*number);
    error(word.at, fmt::format("'{}' is not a number", word.text.substr(0, 60)));
    return std::nullopt;
}

/// Checks the name of a new pin. False after reporting.
bool Reader::check_name(const Word& word) {
    const std::string& name = word.text;
    const bool good =
        !name.empty() && name.size() <= 100 && std::ranges::all_of(name, is_name_character);
    if (!good) {
        error(word.at, fmt::format("'{}' is not a valid name of a pin", name.substr(0, 60)),
              "use letters, digits, '-', '_' and '.'");
        return false;
    }
    if (std::ranges::find(layout_.pins, name, &PanelPin::name) != layout_.pins.end()) {
        error(word.at, fmt::format("duplicate pin '{}'", name),
              "each pin of a panel needs a name of its own");
        return false;
    }
    return true;
}

/// Sets the initial or the safe value of a pin, if it is given.
void Reader::set_value(const Kind& kind, const Given& given, const char* key, const PanelPin& pin,
                       Json& to) {
    const auto at = given.find(key);
    if (at == given.end()) return;
    const Word& word = at->second;
    const auto value = value_of(kind, word);
    if (!value) return;
    const double number = value->is_number() ? value->get<double>() : pin.min;
    if (number < pin.min || number > pin.max) {
        error(word.at, fmt::format("{}={} is outside {:g}..{:g}", key, word.text.substr(0, 60),
                                   pin.min, pin.max));
    }
    to = *value;
}

void Reader::pin(const Kind& kind, const std::vector<Word>& words, const Given& given,
                 Json& options, Json& node) {
    if (!check_name(words[1])) return;
    PanelPin pin;
    pin.name = words[1].text;
    pin.type = kind.type;
    pin.output = kind.output;
    if (kind.output && std::string_view(kind.name) == "button") {
        pin.safe = false;
    }
    if (kind.output) {
        pin.min = options.value("min", pin.min);
        pin.max = options.value("max", pin.max);
    }
    set_value(kind, given, "initial", pin, pin.initial);
    set_value(kind, given, "safe", pin, pin.safe);
    const bool zero_is_outside = pin.min > 0 || pin.max < 0;
    if (kind.output && zero_is_outside && pin.initial.is_null() && pin.safe.is_null()) {
        pin.initial = pin.min > 0 ? pin.min : pin.max;
    }
    if (given.contains("unit")) {
        pin.unit = given.at("unit").text;
    }
    if (given.contains("doc")) {
        pin.doc = given.at("doc").text;
    }
    if (!pin.initial.is_null()) {
        node["initial"] = pin.initial;
    }
    if (!options.contains("text")) {
        options["text"] = pin.name;
    }
    node["pin"] = pin.name;
    layout_.pins.push_back(std::move(pin));
}

/// Parses the options KEY=VALUE of a widget; reports those that it does not have.
Reader::Given Reader::given_options(const Kind& kind, const std::vector<Word>& words) {
    Given given;
    const std::string keys = std::string("label doc unit ") + kind.keys;
    for (std::size_t i = 2; i < words.size(); ++i) {
        const std::size_t equals = words[i].text.find('=');
        const std::string key = words[i].text.substr(0, equals);
        if (equals == std::string::npos ||
            (" " + keys).find(" " + key + " ") == std::string::npos) {
            error(words[i].at,
                  fmt::format("'{}' is not an option of '{}'", key.substr(0, 60), kind.name),
                  fmt::format("the options are: {}", keys.substr(0, keys.size() - 1)));
            continue;
        }
        given[key] = {words[i].text.substr(equals + 1), words[i].at};
    }
    return given;
}

void Reader::set_number(const std::string& key, const Word& word, Json& options) {
    if (const auto number = number_of(word.text)) {
        options[key] = *number;
    } else {
        error(word.at, fmt::format("{} must be a number, not '{}'", key, word.text.substr(0, 60)));
    }
}

void Reader::check_colour(const std::string& key, const Word& word) {
    if (is_css_colour(word.text)) return;
    const std::string similar = did_you_mean(word.text, {css_colours.begin(), css_colours.end()});
    error(word.at, fmt::format("{}: unknown colour '{}'", key, word.text.substr(0, 60)),
          similar.empty() ? "write a name like green, or #rrggbb" : similar);
}

/// The ranges of numeric options.
void Reader::check_numbers(const Json& options, const Given& given) {
    const auto number = [&](const char* key) { return options[key].get<double>(); };
    if (options.contains("min") && options.contains("max") && number("min") >= number("max")) {
        error(given.at("min").at, "min must be less than max");
    }
    for (const char* const key : {"seconds", "step"}) {
        if (options.contains(key) && number(key) <= 0) {
            error(given.at(key).at, fmt::format("{} must be positive", key));
        }
    }
    if (options.contains("digits") && !(number("digits") >= 0 && number("digits") <= 15)) {
        error(given.at("digits").at, "digits must be 0 to 15");
    }
}

Json Reader::widget_options(const Given& given) {
    Json options = Json::object();
    for (const auto& [key, word] : given) {
        if (std::ranges::find(number_keys, key) != std::end(number_keys)) {
            set_number(key, word, options);
        } else if (key == "on" || key == "off") {
            options[key] = word.text;
            check_colour(key, word);
        } else if (key == "unit") {
            options[key] = word.text;
        }
    }
    check_numbers(options, given);
    if (given.contains("label")) {
        options["text"] = given.at("label").text;
    }
    return options;
}

void Reader::widget(const Kind& kind, const std::vector<Word>& words) {
    if (++widgets_ > max_widgets) {
        if (widgets_ == max_widgets + 1) {
            error(words[0].at, "more than 2000 widgets");
        }
        return;
    }
    if (words.size() < 2) {
        return error(words[0].at,
                     fmt::format("missing {} of '{}'", kind.type ? "pin" : "text", kind.name),
                     fmt::format("write: {} NAME", kind.name));
    }
    const Given given = given_options(kind, words);
    Json options = widget_options(given);
    Json node{{"widget", kind.widget}, {"kind", kind.name}};
    if (!kind.type) {
        options["text"] = words[1].text;
    } else if (given.contains("of")) {  // shows a value that exists, without a pin of its own
        node["of"] = given.at("of").text;
        if (!options.contains("text")) {
            options["text"] = words[1].text;
        }
    } else {
        pin(kind, words, given, options, node);
    }
    node["options"] = std::move(options);
    add(std::move(node));
}

}  // namespace

PanelLayout read_panel_text(const std::string& text, const std::string& name, std::string& errors) {
    Reader reader;
    PanelLayout layout = reader.read(text, name);
    errors += reader.errors().text(colours(STDERR_FILENO));
    reader.assemble(layout.root);
    return layout;
}

Diagnostics check_panel_text(const std::string& text) {
    Reader reader;
    reader.read(text, "panel");
    return reader.errors().found();
}

}  // namespace hal::tools
