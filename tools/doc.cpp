// SPDX-License-Identifier: MIT
// `hal doc [COMPONENT]`: the manual page of a component, made from its declarations; without a name, all components.
#include <algorithm>
#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "options.hpp"
#include "page.hpp"
#include "say.hpp"
#include "session/plugins.hpp"

namespace hal::tools {

namespace {

constexpr const char* built_in = "threads";

/// What `open` had to say, in one line.
std::string reason(const Diagnostics& diagnostics) {
    if (diagnostics.all().empty()) return "it cannot be opened";
    const Diagnostic& first = diagnostics.all().front();
    std::string text = first.message;
    for (const Label& label : first.labels)
        if (!label.text.empty()) text += "; " + label.text;
    for (const std::string& help : first.help) text += "; " + help;
    return text;
}

int list(const Plugins& plugins, const Options& options) {
    std::vector<std::pair<std::string, std::string>> rows;
    bool good = true;
    for (const std::string& name : plugins.available()) {
        Diagnostics diagnostics;
        std::string summary;
        if (name == built_in) summary = threads_page().summary;
        else if (const auto plugin = plugins.open(name, {}, diagnostics)) summary = plugin->component->summary;
        else {
            fail(options, reason(diagnostics));
            good = false;
            continue;
        }
        rows.emplace_back(name, std::move(summary));
    }
    std::size_t width = 0;
    for (const auto& [name, summary] : rows) width = std::max(width, name.size());
    std::string text;
    if (options.json) {
        nlohmann::ordered_json json = nlohmann::ordered_json::array();
        for (const auto& [name, summary] : rows) json.push_back({{"name", name}, {"summary", summary}});
        text = json.dump(2) + "\n";
    } else
        for (const auto& [name, summary] : rows) text += fmt::format("{:{}}  {}\n", name, width, summary);
    return print(text) && good ? 0 : 1;
}

}  // namespace

int run_doc(const Options& options) {
    if (options.markdown + options.json + options.man > 1)
        return fail(options, "--markdown, --json and --man exclude each other; give one");
    const Plugins plugins;
    if (options.words.empty()) return list(plugins, options);
    for (const std::string& name : options.words) {
        Page page;
        if (name == built_in) page = threads_page();
        else {
            Diagnostics diagnostics;
            const auto plugin = plugins.open(name, {}, diagnostics);
            if (!plugin) return fail(options, reason(diagnostics));
            if (std::string problem; !gather(*plugin->component, page, problem))
                return fail(options, fmt::format("component '{}' cannot be constructed: {}", name, problem));
        }
        if (!print(options.markdown ? as_markdown(page) : options.json ? as_json(page) : options.man ? as_man(page) : as_text(page)))
            return 1;
    }
    return 0;
}

}  // namespace hal::tools
