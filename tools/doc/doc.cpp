// SPDX-License-Identifier: MIT
// `hal doc [COMPONENT]`: the manual page of a component, derived from its declarations; without a
// name, all components. `hal doc --all --output DIR`: the pages of all of them, with an index.
#include "doc/doc.hpp"

#include <algorithm>
#include <filesystem>
#include <fmt/core.h>
#include <map>
#include <nlohmann/json.hpp>

#include "cli/output.hpp"
#include "doc/page.hpp"
#include "machine/load/plugins.hpp"
#include "machine/load/source_tree.hpp"

namespace hal::tools {

namespace {

namespace fs = std::filesystem;

constexpr const char* built_in = "threads";

/// Returns the error of `open` in one line.
std::string reason(const Diagnostics& diagnostics) {
    if (diagnostics.all().empty()) return "it cannot be opened";
    const Diagnostic& first = diagnostics.all().front();
    std::string text = first.message;
    for (const Label& label : first.labels) {
        if (!label.text.empty()) {
            text += "; " + label.text;
        }
    }
    for (const std::string& help : first.help) {
        text += "; " + help;
    }
    return text;
}

int list(const Plugins& plugins, const DocOptions& options) {
    std::vector<std::pair<std::string, std::string>> rows;
    bool good = true;
    const auto listed = listed_components(plugins.path());
    for (const std::string& name : plugins.available()) {
        Diagnostics diagnostics;
        std::string summary;
        if (name == built_in) {
            summary = threads_page().summary;
        } else if (const auto unbuilt = listed.find(name);
                   unbuilt != listed.end() && plugins.find(name).empty()) {
            summary = unbuilt->second.summary;
        } else if (const auto plugin = plugins.open(name, {}, diagnostics)) {
            summary = plugin->component->summary;
        } else {
            fail(options, reason(diagnostics));
            good = false;
            continue;
        }
        rows.emplace_back(name, std::move(summary));
    }
    std::size_t width = 0;
    for (const auto& [name, summary] : rows) {
        width = std::max(width, name.size());
    }
    std::string text;
    if (options.json) {
        nlohmann::ordered_json json = nlohmann::ordered_json::array();
        for (const auto& [name, summary] : rows) {
            json.push_back({{"name", name}, {"summary", summary}});
        }
        text = json.dump(2) + "\n";
    } else {
        for (const auto& [name, summary] : rows) {
            text += fmt::format("{:{}}  {}\n", name, width, summary);
        }
    }
    return exit_code(print(text) && good);
}

/// Makes the page of one component. Returns false after printing the error.
bool page_of(const Plugins& plugins, const std::string& name, const DocOptions& options,
             Page& page) {
    if (name == built_in) {
        page = threads_page();
        return true;
    }
    Diagnostics diagnostics;
    const auto plugin = plugins.open(name, {}, diagnostics);
    if (!plugin) {
        fail(options, reason(diagnostics));
        return false;
    }
    if (std::string problem; !gather(*plugin->component, page, problem)) {
        fail(options, fmt::format("component '{}' cannot be constructed: {}", name, problem));
        return false;
    }
    return true;
}

struct Form {
    bool DocOptions::* chosen;
    const char* before;  ///< of the file's name
    const char* after;
    std::string (*write)(const Page& page, bool alone);
};

/// Man pages are named hal-NAME, so that they can be installed beside LinuxCNC's.
constexpr Form forms[] = {
    {&DocOptions::markdown, "", ".md", [](const Page& page, bool) { return as_markdown(page); }},
    {&DocOptions::json, "", ".json", [](const Page& page, bool) { return as_json(page); }},
    {&DocOptions::man, "hal-", ".9", [](const Page& page, bool) { return as_man(page); }},
    {&DocOptions::html, "", ".html",
     [](const Page& page, bool alone) { return as_html(page, alone ? "" : "index.html"); }},
};

bool write_page(const fs::path& path, const std::string& text, const DocOptions& options) {
    const std::string why = write_file(path.string(), text);
    return why.empty() || (fail(options, why), false);
}

int write_all_pages(const std::vector<Page>& pages, const Plugins& plugins, const Form& form,
                    const DocOptions& options) {
    const fs::path folder(options.output);
    std::error_code problem;
    fs::create_directories(folder, problem);
    if (problem) {
        return fail(options,
                    fmt::format("cannot create '{}': {}", folder.string(), problem.message()));
    }
    for (const Page& page : pages) {
        if (!write_page(folder / (form.before + page.name + form.after),
                        form.write(page, !options.all), options)) {
            return 1;
        }
    }
    if (form.chosen != &DocOptions::html || !options.all) return 0;
    const auto listed = listed_components(plugins.path());
    std::map<std::string, std::vector<const Page*>> by_group;
    for (const Page& page : pages) {
        std::string name = page.name;
        std::replace(name.begin(), name.end(), '-', '_');
        auto found = listed.find(page.name);
        if (found == listed.end()) {
            found = listed.find(name);
        }
        const std::string group = found == listed.end() ? "other" : found->second.group;
        by_group[page.built_in ? "runtime" : group].push_back(&page);
    }
    std::vector<IndexGroup> groups;
    for (auto& [name, members] : by_group) {
        groups.push_back({name, std::move(members)});
    }
    return exit_code(write_page(folder / "index.html", as_html_index(groups), options));
}

}  // namespace

int run_doc(const DocOptions& given) {
    DocOptions options = given;
    if (options.markdown + options.json + options.man + options.html > 1) {
        return fail(options, "--markdown, --json, --man and --html exclude each other; give one");
    }
    if (options.all && !options.words.empty()) {
        return fail(options, "--all and component names exclude each other; leave one out");
    }
    const Plugins plugins;
    if (options.words.empty() && !options.all) return list(plugins, options);
    if (options.all) {
        if (options.output.empty()) {
            return fail(options, "--all needs a folder; type: hal doc --all --output DIR");
        }
        options.words = plugins.available();
    }
    if (!options.output.empty() && !(options.markdown || options.json || options.man)) {
        options.html = true;
    }
    const auto* const form = std::find_if(std::begin(forms), std::end(forms),
                                          [&](const Form& one) { return options.*one.chosen; });
    std::vector<Page> pages;
    int status = 0;
    for (const std::string& name : options.words) {
        Page page;
        if (page_of(plugins, name, options, page)) {
            pages.push_back(std::move(page));
        } else if (options.all) {
            status = 1;  // one that cannot be read does not keep the others back
        } else {
            return 1;
        }
    }
    if (!options.output.empty()) {
        return write_all_pages(pages, plugins, *form, options) == 0 ? status : 1;
    }
    for (const Page& page : pages) {
        if (!print(form == std::end(forms) ? as_text(page) : form->write(page, true))) return 1;
    }
    return status;
}

}  // namespace hal::tools
