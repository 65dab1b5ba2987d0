// SPDX-License-Identifier: MIT
// A component's page as text, Markdown, JSON and troff.
#include <algorithm>
#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "base/types.hpp"
#include "doc/markdown.hpp"
#include "doc/page.hpp"
#include "doc/page_walk.hpp"
#include "doc/troff.hpp"

namespace hal::tools {

namespace {

using nlohmann::ordered_json;

std::size_t width(const std::string& text) {  // in characters
    return static_cast<std::size_t>(
        std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}
std::string padded(const std::string& text, std::size_t to) {
    return text + std::string(to > width(text) ? to - width(text) : 0, ' ');
}

struct TextWriter : PageWriter {
    explicit TextWriter(std::string head) { text = std::move(head); }
    void heading(std::string_view title) override {
        text += "\n";
        for (const char c : title) {
            text += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
        }
        text += "\n";
    }
    void code(const std::string& line) override { text += "    " + line + "\n"; }
    void prose(const std::string& sentence) override { text += "    " + sentence + "\n"; }
    void table(const std::vector<std::vector<std::string>>& rows) override {
        std::vector<std::size_t> widths(rows.front().size(), 0);
        for (const auto& row : rows) {
            for (std::size_t i = 0; i < row.size(); ++i) {
                widths[i] = std::max(widths[i], width(row[i]));
            }
        }
        for (const auto& row : rows) {
            std::string line = "   ";
            for (std::size_t i = 0; i < row.size(); ++i) {
                line += " " + (i + 1 < row.size() ? padded(row[i], widths[i] + (i == 0)) : row[i]);
            }
            text += line + "\n";
        }
    }
    void markdown(const std::string& doc) override {
        for (std::size_t from = 0; from < doc.size();) {
            const std::size_t end = std::min(doc.find('\n', from), doc.size());
            const std::string line = doc.substr(from, end - from);
            const std::size_t title = line.find_first_not_of('#');
            // man's .SS
            if (title != 0 && title != line.npos && line[title] == ' ') {
                text += "  " + line.substr(title + 1) + "\n";
            } else {
                text += line.empty() ? "\n" : "    " + line + "\n";
            }
            from = end + 1;
        }
    }
};

struct MarkdownWriter : PageWriter {
    explicit MarkdownWriter(std::string head) { text = std::move(head); }
    void heading(std::string_view title) override { text += fmt::format("\n## {}\n\n", title); }
    void code(const std::string& line) override { text += "    " + line + "\n"; }
    void prose(const std::string& sentence) override { text += "\n" + sentence + "\n"; }
    void table(const std::vector<std::vector<std::string>>& rows) override {
        text += rows.front().size() == 2
                    ? "| name | |\n| --- | --- |\n"
                    : "| name | type | direction | |\n| --- | --- | --- | --- |\n";
        for (const auto& row : rows) {
            for (std::size_t i = 0; i < row.size(); ++i) {
                text += i == 0 ? "| `" : " | ";
                for (const char c : row[i]) {
                    text += c == '|' ? std::string("\\|") : std::string(1, c);
                }
                if (i == 0) {
                    text += '`';
                }
            }
            text += " |\n";
        }
    }
    void markdown(const std::string& doc) override {
        text += doc + (doc.ends_with('\n') ? "" : "\n");
    }
};

struct ManWriter : PageWriter {
    explicit ManWriter(std::string head) { text = std::move(head); }
    void heading(std::string_view title) override {
        text += ".SH ";
        for (const char c : title) {
            text += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
        }
        text += "\n";
    }
    void code(const std::string& line) override { text += ".nf\n" + troff(line) + "\n.fi\n"; }
    void prose(const std::string& sentence) override { text += ".PP\n" + troff(sentence) + "\n"; }
    void table(const std::vector<std::vector<std::string>>& rows) override {
        for (const auto& row : rows) {
            text += fmt::format(".TP\n\\fB{}\\fR{}\n{}\n", troff(row[0]),
                                row.size() > 2 ? fmt::format(" {} {}", row[1], row[2]) : "",
                                row.back().empty() ? "\\&" : troff(row.back()));
        }
    }
    void markdown(const std::string& doc) override {
        if (const auto rendered = markdown_as_man(doc)) {
            text += *rendered;
            return;
        }
        bool code = false;
        for (std::size_t from = 0; from < doc.size();) {
            const std::size_t end = std::min(doc.find('\n', from), doc.size());
            const std::string line = doc.substr(from, end - from);
            from = end + 1;
            if (line.starts_with("```") ||
                (line.starts_with("    ") != code && !line.starts_with("```") &&
                 (line.starts_with("    ") || code))) {
                code = !code;
                text += code ? ".nf\n" : ".fi\n";
                if (line.starts_with("```")) continue;
            }
            text += line.empty() && !code ? std::string(".PP\n") : troff(line) + "\n";
        }
        if (code) {
            text += ".fi\n";
        }
    }
};

ordered_json value_of(hal_type type, const hal_value& value) {
    if (type == HAL_TYPE_PORT) return nullptr;
    return visit(type, value, [](const auto& v) -> ordered_json { return v; });
}

}  // namespace

std::string as_text(const Page& page) {
    TextWriter writer(fmt::format("NAME\n    {}: {}\n", page.name, page.summary));
    walk(page, writer);
    return writer.text;
}

std::string as_markdown(const Page& page) {
    MarkdownWriter writer(fmt::format("# {}\n\n{}\n", page.name, page.summary));
    walk(page, writer);
    return writer.text;
}

std::string as_man(const Page& page) {
    ManWriter writer(fmt::format(
        "'\\\" t\n.TH \"{}\" 9 \"\" \"Halcyon\" \"HAL component\"\n.SH NAME\n{} \\- {}\n",
        troff(page.name), troff(page.name), troff(page.summary)));
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
    for (const auto& a : page.arguments) {
        json["arguments"].push_back({{"name", a.name},
                                     {"doc", a.doc},
                                     {"default", a.fallback},
                                     {"per_instance", a.per_instance}});
    }
    for (const auto& f : page.functions) {
        json["functions"].push_back({{"name", f.name}, {"doc", f.doc}, {"shared", f.shared}});
    }
    for (const auto& p : page.pins) {
        ordered_json pin{{"name", p.name},
                         {"type", name(p.type)},
                         {"dir", direction(p)},
                         {"doc", p.doc},
                         {"initial", value_of(p.type, p.initial)}};
        if (!p.unit.empty()) {
            pin["unit"] = p.unit;
        }
        if (!p.function.empty()) {
            pin["function"] = p.function;
        }
        if (p.has_safe) {
            pin["safe"] = value_of(p.type, p.safe);
        }
        if (p.finite) {
            pin["finite"] = true;
        }
        json["pins"].push_back(std::move(pin));
    }
    return json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace hal::tools
