// SPDX-License-Identifier: MIT
// A component's page as text, Markdown, JSON and troff.
#include <algorithm>
#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "base/types.hpp"
#include "page.hpp"

namespace hal::tools {

namespace {

using nlohmann::ordered_json;

const char* direction(hal_dir dir) {
    static constexpr const char* names[] = {"in", "out", "io", "rw"};
    return names[static_cast<std::size_t>(dir)];
}

/// "V; initial 1; safe 0; used by encoder.update-counters"
std::string remarks(const Page::Pin& pin, bool several_functions) {
    std::string text;
    const auto add = [&](const std::string& remark) { text += (text.empty() ? "" : "; ") + remark; };
    if (!pin.unit.empty()) add(pin.unit);
    if (pin.type != HAL_TYPE_PORT && pin.initial.raw != 0) add("initial " + format_value(pin.type, pin.initial));
    if (pin.has_safe) add("safe " + format_value(pin.type, pin.safe));
    if (pin.finite) add("finite");
    if (several_functions && !pin.function.empty()) add("used by " + pin.function);
    return text;
}

/// A row of the pin table: one pin, or a run of numbered ones that differ in nothing else.
struct Row {
    std::string name;
    const Page::Pin* pin;
};

/// The two names differ in one number only, and the second's is one more.
bool follows(const Page::Pin& a, const Page::Pin& b) {
    if (a.type != b.type || a.dir != b.dir || a.doc != b.doc || a.unit != b.unit || a.function != b.function ||
        a.initial.raw != b.initial.raw)
        return false;
    const auto digit = [](char c) { return c >= '0' && c <= '9'; };
    std::size_t from = 0;
    while (from < a.name.size() && from < b.name.size() && a.name[from] == b.name[from]) ++from;
    while (from > 0 && digit(a.name[from - 1])) --from;
    std::size_t a_end = from, b_end = from;
    while (a_end < a.name.size() && digit(a.name[a_end])) ++a_end;
    while (b_end < b.name.size() && digit(b.name[b_end])) ++b_end;
    constexpr std::size_t longest = 9;
    if (a_end == from || b_end == from || a_end - from > longest || b_end - from > longest || a.name.substr(a_end) != b.name.substr(b_end))
        return false;
    return std::stoul(a.name.substr(from, a_end - from)) + 1 == std::stoul(b.name.substr(from, b_end - from));
}

std::vector<Row> rows_of(const Page& page, bool parameters) {
    std::vector<const Page::Pin*> pins;
    for (const Page::Pin& pin : page.pins)
        if ((pin.dir == HAL_DIR_PARAM) == parameters) pins.push_back(&pin);
    std::vector<Row> rows;
    for (std::size_t i = 0; i < pins.size();) {
        std::size_t last = i;
        while (last + 1 < pins.size() && follows(*pins[last], *pins[last + 1])) ++last;
        const std::string name = page.instance() + "." + pins[i]->name;
        if (last >= i + 2) {
            rows.push_back({name + " … " + pins[last]->name, pins[i]});
            i = last + 1;
        } else {
            rows.push_back({name, pins[i]});
            ++i;
        }
    }
    return rows;
}

std::size_t width(const std::string& text) {  // in characters
    return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}
std::string padded(const std::string& text, std::size_t to) { return text + std::string(to > width(text) ? to - width(text) : 0, ' '); }

bool several(const Page& page) { return page.functions.size() > 1; }

std::string synopsis(const Page& page) {
    std::string line = "loadrt " + page.name;
    if (!page.singleton) line += " [count=N | names=NAME,…]";
    for (const auto& argument : page.arguments) line += fmt::format(" [{}={}]", argument.name, argument.per_instance ? "VALUE,…" : "VALUE");
    return line;
}

std::string described(const Page::Argument& argument) {
    std::string text = argument.doc;
    if (argument.per_instance) text += ", one per instance";
    return argument.fallback.empty() ? text : fmt::format("{} (default {})", text, argument.fallback);
}

constexpr const char* times_sentence = "Each function also has .time, .tmax (ns) and .tmax-increased.";

/// The parts every form has, in order; `heading`, `entry` and `prose` write them.
template <class Writer>
void walk(const Page& page, Writer& to) {
    to.heading("Synopsis");
    to.code(synopsis(page));
    const auto table = [&](const char* title, const std::vector<std::vector<std::string>>& rows) {
        if (rows.empty()) return;
        to.heading(title);
        to.table(rows);
    };
    std::vector<std::vector<std::string>> rows;
    for (const auto& argument : page.arguments) rows.push_back({argument.name + "=", described(argument)});
    table("Arguments", rows);
    rows.clear();
    for (const auto& function : page.functions)
        rows.push_back({page.full_name(function), function.doc + (function.shared ? " (one for all instances)" : "")});
    table("Functions", rows);
    if (!rows.empty()) to.prose(times_sentence);
    for (const bool parameters : {false, true}) {
        rows.clear();
        for (const Row& row : rows_of(page, parameters)) {
            const std::string more = remarks(*row.pin, several(page));
            rows.push_back(
                {row.name, name(row.pin->type), direction(row.pin->dir), row.pin->doc + (more.empty() ? "" : " (" + more + ")")});
        }
        table(parameters ? "Parameters" : "Pins", rows);
    }
    if (!page.doc.empty()) {
        to.heading("Description");
        to.markdown(page.doc);
    }
}

struct TextWriter {
    std::string text;
    void heading(std::string_view title) {
        text += "\n";
        for (const char c : title) text += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
        text += "\n";
    }
    void code(const std::string& line) { text += "    " + line + "\n"; }
    void prose(const std::string& sentence) { text += "    " + sentence + "\n"; }
    void table(const std::vector<std::vector<std::string>>& rows) {
        std::vector<std::size_t> widths(rows.front().size(), 0);
        for (const auto& row : rows)
            for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], width(row[i]));
        for (const auto& row : rows) {
            std::string line = "   ";
            for (std::size_t i = 0; i < row.size(); ++i) line += " " + (i + 1 < row.size() ? padded(row[i], widths[i] + (i == 0)) : row[i]);
            text += line + "\n";
        }
    }
    void markdown(const std::string& doc) {
        for (std::size_t from = 0; from < doc.size();) {
            const std::size_t end = std::min(doc.find('\n', from), doc.size());
            text += end == from ? "\n" : "    " + doc.substr(from, end - from) + "\n";
            from = end + 1;
        }
    }
};

struct MarkdownWriter {
    std::string text;
    void heading(std::string_view title) { text += fmt::format("\n## {}\n\n", title); }
    void code(const std::string& line) { text += "    " + line + "\n"; }
    void prose(const std::string& sentence) { text += "\n" + sentence + "\n"; }
    void table(const std::vector<std::vector<std::string>>& rows) {
        text += rows.front().size() == 2 ? "| name | |\n| --- | --- |\n" : "| name | type | direction | |\n| --- | --- | --- | --- |\n";
        for (const auto& row : rows) {
            for (std::size_t i = 0; i < row.size(); ++i) {
                text += i == 0 ? "| `" : " | ";
                for (const char c : row[i]) text += c == '|' ? std::string("\\|") : std::string(1, c);
                if (i == 0) text += '`';
            }
            text += " |\n";
        }
    }
    void markdown(const std::string& doc) { text += doc + (doc.ends_with('\n') ? "" : "\n"); }
};

std::string troff(const std::string& line) {
    std::string text = line.starts_with('.') || line.starts_with('\'') ? "\\&" : "";
    for (const char c : line) text += c == '\\' ? std::string("\\e") : c == '-' ? std::string("\\-") : std::string(1, c);
    return text;
}

struct ManWriter {
    std::string text;
    void heading(std::string_view title) {
        text += ".SH ";
        for (const char c : title) text += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
        text += "\n";
    }
    void code(const std::string& line) { text += ".nf\n" + troff(line) + "\n.fi\n"; }
    void prose(const std::string& sentence) { text += ".PP\n" + troff(sentence) + "\n"; }
    void table(const std::vector<std::vector<std::string>>& rows) {
        for (const auto& row : rows)
            text += fmt::format(".TP\n\\fB{}\\fR{}\n{}\n", troff(row[0]), row.size() > 2 ? fmt::format(" {} {}", row[1], row[2]) : "",
                                row.back().empty() ? "\\&" : troff(row.back()));
    }
    void markdown(const std::string& doc) {
        bool code = false;
        for (std::size_t from = 0; from < doc.size();) {
            const std::size_t end = std::min(doc.find('\n', from), doc.size());
            const std::string line = doc.substr(from, end - from);
            from = end + 1;
            if (line.starts_with("```") ||
                (line.starts_with("    ") != code && !line.starts_with("```") && (line.starts_with("    ") || code))) {
                code = !code;
                text += code ? ".nf\n" : ".fi\n";
                if (line.starts_with("```")) continue;
            }
            text += line.empty() && !code ? std::string(".PP\n") : troff(line) + "\n";
        }
        if (code) text += ".fi\n";
    }
};

ordered_json value_of(hal_type type, const hal_value& value) {
    if (type == HAL_TYPE_PORT) return nullptr;
    return visit(type, value, [](const auto& v) -> ordered_json { return v; });
}

}  // namespace

std::string as_text(const Page& page) {
    TextWriter writer{fmt::format("NAME\n    {}: {}\n", page.name, page.summary)};
    walk(page, writer);
    return writer.text;
}

std::string as_markdown(const Page& page) {
    MarkdownWriter writer{fmt::format("# {}\n\n{}\n", page.name, page.summary)};
    walk(page, writer);
    return writer.text;
}

std::string as_man(const Page& page) {
    ManWriter writer{fmt::format(".TH \"{}\" 9 \"\" \"Halcyon\" \"HAL component\"\n.SH NAME\n{} \\- {}\n", troff(page.name),
                                 troff(page.name), troff(page.summary))};
    walk(page, writer);
    return writer.text;
}

std::string as_json(const Page& page) {
    ordered_json json{{"name", page.name},
                      {"summary", page.summary},
                      {"doc", page.doc},
                      {"singleton", page.singleton},
                      {"default_count", page.default_count}};
    json["arguments"] = json["functions"] = json["pins"] = ordered_json::array();
    for (const auto& a : page.arguments)
        json["arguments"].push_back({{"name", a.name}, {"doc", a.doc}, {"default", a.fallback}, {"per_instance", a.per_instance}});
    for (const auto& f : page.functions) json["functions"].push_back({{"name", f.name}, {"doc", f.doc}, {"shared", f.shared}});
    for (const auto& p : page.pins) {
        ordered_json pin{
            {"name", p.name}, {"type", name(p.type)}, {"dir", direction(p.dir)}, {"doc", p.doc}, {"initial", value_of(p.type, p.initial)}};
        if (!p.unit.empty()) pin["unit"] = p.unit;
        if (!p.function.empty()) pin["function"] = p.function;
        if (p.has_safe) pin["safe"] = value_of(p.type, p.safe);
        if (p.finite) pin["finite"] = true;
        json["pins"].push_back(std::move(pin));
    }
    return json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace hal::tools
