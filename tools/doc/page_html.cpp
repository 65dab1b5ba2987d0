// SPDX-License-Identifier: MIT
// A component's page, and the index of all, as HTML that needs nothing else: no script but the
// search box's, no other file.
#include <cctype>
#include <fmt/core.h>
#include <string>
#include <string_view>
#include <utility>

#include "base/types.hpp"
#include "cli/xml_escape.hpp"
#include "doc/markdown.hpp"
#include "doc/page.hpp"
#include "doc/page_walk.hpp"

namespace hal::tools {

namespace {

constexpr std::string_view style = R"CSS(
:root { color-scheme: light dark; --line: #8884; --link: #06c; --faint: #777; }
@media (prefers-color-scheme: dark) { :root { --link: #6af; --faint: #999; } }
body { font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 0 auto; padding: 1rem; }
a { color: var(--link); text-decoration: none; } a:hover { text-decoration: underline; }
h1 { margin: .5rem 0 0; } h2 { margin: 1.6rem 0 .4rem; font-size: 1.15rem; border-bottom: 1px solid var(--line); }
.summary { font-size: 1.1rem; margin: 0 0 1rem; }
pre, code { font: .92em/1.45 ui-monospace, monospace; } pre { border: 1px solid var(--line); padding: .6rem; overflow-x: auto; }
table { border-collapse: collapse; } td, th { padding: .2rem .7rem .2rem 0; text-align: left; vertical-align: top; border-bottom: 1px solid var(--line); }
td:first-child { white-space: nowrap; } .type { color: var(--faint); white-space: nowrap; }
input { font: inherit; width: 100%; box-sizing: border-box; padding: .4rem; }
footer { margin-top: 2rem; color: var(--faint); font-size: .9rem; }
)CSS";

std::string head(std::string_view title) {
    return fmt::format(
        "<!DOCTYPE html>\n<!-- SPDX-License-Identifier: MIT -->\n<html lang=\"en\">\n<head>\n<meta "
        "charset=\"utf-8\">\n"
        "<meta name=\"viewport\" "
        "content=\"width=device-width\">\n<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n",
        xml_escape(title), style);
}

struct HtmlWriter : PageWriter {
    explicit HtmlWriter(std::string head) { text = std::move(head); }
    void heading(std::string_view title) override {
        std::string id;
        for (const char c : title) {
            id += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
        }
        text += fmt::format("<h2 id=\"{}\">{}</h2>\n", id, title);
    }
    void code(const std::string& line) override { text += "<pre>" + xml_escape(line) + "</pre>\n"; }
    void prose(const std::string& sentence) override {
        text += "<p>" + xml_escape(sentence) + "</p>\n";
    }
    void table(const std::vector<std::vector<std::string>>& rows) override {
        text += "<table>\n";
        if (rows.front().size() > 2) {
            text += "<tr><th>name</th><th>type</th><th>direction</th><th></th></tr>\n";
        }
        for (const auto& row : rows) {
            for (std::size_t i = 0; i < row.size(); ++i) {
                const bool last = i + 1 == row.size();
                text += i == 0 ? fmt::format("<tr id=\"{0}\"><td><code>{0}</code></td>",
                                             xml_escape(row[i]))
                               : fmt::format("<td{}>{}</td>", last ? "" : " class=\"type\"",
                                             xml_escape(row[i]));
            }
            text += "</tr>\n";
        }
        text += "</table>\n";
    }
    void markdown(const std::string& doc) override {
        text += markdown_as_html(doc).value_or("<pre>" + xml_escape(doc) + "</pre>\n");
    }
};

}  // namespace

std::string as_html(const Page& page, std::string_view home) {
    HtmlWriter writer(head(page.name + " · Halcyon"));
    if (!home.empty()) {
        writer.text +=
            fmt::format("<nav><a href=\"{}\">all components</a></nav>\n", xml_escape(home));
    }
    writer.text += fmt::format("<h1>{}</h1>\n<p class=\"summary\">{}</p>\n", xml_escape(page.name),
                               xml_escape(page.summary));
    walk(page, writer);
    writer.text += fmt::format(
        "<footer>Made from the component's declarations; <code>hal doc {}</code> prints the "
        "same.</footer>\n</body>\n</html>\n",
        xml_escape(page.name));
    return writer.text;
}

namespace {

/// Returns the heading of a group of components: the name of its folder with a capital letter, or
/// as the field spells it.
std::string heading_of(const std::string& group) {
    static constexpr std::pair<std::string_view, std::string_view> spellings[] = {
        {"canopen", "CANopen"},
        {"dds", "DDS"},
        {"ethercat", "EtherCAT"},
        {"io", "I/O"},
        {"sim", "Simulation"}};
    for (const auto& [name, spelling] : spellings) {
        if (group == name) return std::string(spelling);
    }
    std::string title = group;
    title[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(title[0])));
    return title;
}

}  // namespace

std::string as_html_index(const std::vector<IndexGroup>& groups) {
    std::string text = head("Components · Halcyon") +
                       "<h1>Components</h1>\n<p><input id=\"search\" type=\"search\" "
                       "placeholder=\"search\" autofocus></p>\n";
    for (const IndexGroup& group : groups) {
        text += fmt::format("<section>\n<h2 id=\"{}\">{}</h2>\n<table>\n", xml_escape(group.name),
                            xml_escape(heading_of(group.name)));
        for (const Page* const page : group.pages) {
            text += fmt::format("<tr><td><a href=\"{0}.html\">{0}</a></td><td>{1}</td></tr>\n",
                                xml_escape(page->name), xml_escape(page->summary));
        }
        text += "</table>\n</section>\n";
    }
    return text + R"HTML(<footer>Made from the components' declarations.</footer>
<script>
const box = document.getElementById("search");
box.addEventListener("input", () => {
    const words = box.value.toLowerCase().split(/\s+/);
    for (const section of document.querySelectorAll("section")) {
        let any = false;
        for (const row of section.querySelectorAll("tr")) {
            const text = row.textContent.toLowerCase();
            row.hidden = !words.every(word => text.includes(word));
            any = any || !row.hidden;
        }
        section.hidden = !any;
    }
});
</script>
</body>
</html>
)HTML";
}

}  // namespace hal::tools
