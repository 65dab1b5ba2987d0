// SPDX-License-Identifier: MIT
// A component's page as AsciiDoc, in the form of a manual page (`asciidoctor -b manpage`).
#include <algorithm>
#include <fmt/core.h>

#include "doc/page_asciidoc.hpp"
#include "doc/page_walk.hpp"

namespace hal::tools {

namespace {

struct AsciidocWriter : PageWriter {
    explicit AsciidocWriter(std::string head) { text = std::move(head); }
    void heading(std::string_view title) override {
        text += "\n== ";
        for (const char c : title) {
            text += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
        }
        text += "\n\n";
    }
    void code(const std::string& line) override { text += "....\n" + line + "\n....\n"; }
    void prose(const std::string& sentence) override { text += "\n" + sentence + "\n"; }
    void table(const std::vector<std::vector<std::string>>& rows) override {
        for (const auto& row : rows) {
            text += fmt::format("`+{}+`{}::\n  {}\n", row[0],
                                row.size() > 2 ? fmt::format(" {} {}", row[1], row[2]) : "",
                                row.back().empty() ? "{empty}" : row.back());
        }
    }
    // Headings, code and tables are written otherwise in AsciiDoc; lists, emphasis and words
    // between backquotes are the same.
    void markdown(const std::string& doc) override {
        bool fenced = false;
        bool in_table = false;
        for (std::size_t from = 0; from < doc.size();) {
            const std::size_t end = std::min(doc.find('\n', from), doc.size());
            const std::string line = doc.substr(from, end - from);
            from = end + 1;
            if (line.starts_with("```")) {
                fenced = !fenced;
                text += "....\n";
                continue;
            }
            if (fenced) {
                text += line + "\n";
                continue;
            }
            if (line.starts_with('|') != in_table) {
                in_table = !in_table;
                text += "|===\n";
            }
            const std::size_t title = line.find_first_not_of('#');
            if (in_table) {
                if (line.find_first_not_of("|-: ") != line.npos) {
                    text += row_of(line);
                }
            } else if (title != 0 && title != line.npos && line[title] == ' ') {
                text += "=== " + line.substr(title + 1) + "\n";
            } else {
                text += line + "\n";
            }
        }
        if (fenced) {
            text += "....\n";
        }
        if (in_table) {
            text += "|===\n";
        }
    }

private:
    /// "| a | b |" without the last bar, which would begin a cell.
    static std::string row_of(std::string line) {
        while (!line.empty() && (line.back() == ' ' || line.back() == '|')) {
            line.pop_back();
        }
        return line + "\n";
    }
};

}  // namespace

std::string as_asciidoc(const Page& page) {
    AsciidocWriter writer(fmt::format("= {0}(9)\n:doctype: manpage\n\n== NAME\n\n{0} - {1}\n",
                                      page.name, page.summary));
    walk(page, writer);
    return writer.text;
}

}  // namespace hal::tools
