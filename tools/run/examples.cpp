// SPDX-License-Identifier: MIT
// `hal examples`: the machines to start from, and a short way to run one.
#include "run/examples.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <map>
#include <sstream>
#include <tuple>
#include <unistd.h>

#include "cli/output.hpp"
#include "hal/privilege.hpp"
#include "machine/load/plugins.hpp"
#include "machine/load/source_tree.hpp"
#include "paths.hpp"
#include "text/diagnostic.hpp"

namespace hal::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view topic_mark = "# Topic: ";

fs::path program() { return fs::read_symlink("/proc/self/exe"); }

/// The folder of the machines: of the source tree that this program was built in, of its
/// installation, or of its Debian package. Empty when it is in none of them.
fs::path machines() {
    std::error_code ignored;
    const fs::path folder = program().parent_path();
    const fs::path built(paths::build_machines);
    const bool is_built_here = folder.string().starts_with(built.parent_path().string() + "/");
    if (is_built_here && fs::is_directory(built, ignored)) return built;
    for (const std::string_view place :
         {paths::machines_from_programs, std::string_view("../share/halcyon/halfiles")}) {
        const fs::path installed = (folder / place).lexically_normal();
        if (fs::is_directory(installed, ignored)) return installed;
    }
    return fs::is_directory(built, ignored) ? built : fs::path{};
}

std::string first_sentence(std::string_view comment) {
    const auto stop = comment.find(". ");
    if (stop != comment.npos) comment = comment.substr(0, stop);
    if (comment.ends_with('.')) comment.remove_suffix(1);
    return std::string(comment);
}

/// Reads the header of a netlist. The topic is empty when it is not an example.
Example read_header(const fs::path& folder, const fs::path& netlist) {
    Example example;
    example.path = netlist.string();
    example.name = fs::path(netlist).replace_extension().lexically_relative(folder).string();
    std::ifstream file(netlist);
    for (std::string line; std::getline(file, line) && line.starts_with("# ");) {
        if (line.starts_with(topic_mark)) {
            example.topic = line.substr(topic_mark.size());
        } else if (!line.starts_with("# SPDX") && example.summary.empty()) {
            example.summary = first_sentence(line.substr(2));
        }
    }
    return example;
}

/// Adds the components that a netlist loads, and those of the netlists that it sources. A reader of
/// the lines of examples: it expects one command per line and no variables in names.
void add_components(const fs::path& netlist, std::set<std::string>& names,
                    std::set<fs::path>& seen) {
    if (!seen.insert(netlist.lexically_normal()).second) return;
    std::ifstream file(netlist);
    for (std::string line; std::getline(file, line);) {
        std::istringstream words(line);
        std::string command, name;
        words >> command >> name;
        if (command == "source") add_components(netlist.parent_path() / name, names, seen);
        if (command == "loadrt") names.insert(name);
    }
}

/// The Debian packages of components that the netlist loads and that have no plugin. None when
/// components are built on demand.
std::set<std::string> missing_packages(const fs::path& netlist, const Plugins& plugins,
                                       const std::map<std::string, ComponentSummary>& listed) {
    std::set<std::string> components, packages;
    if (std::getenv("HALCYON_BUILD")) return packages;
    std::set<fs::path> seen;
    add_components(netlist, components, seen);
    for (const std::string& name : components) {
        const auto about = listed.find(name);
        if (about == listed.end() || !plugins.find(name).empty()) continue;
        const std::string package = debian_package(about->second.group);
        if (!package.empty()) packages.insert(package);
    }
    return packages;
}

const Example* find(const std::vector<Example>& examples, std::string_view name) {
    const auto found = std::find_if(examples.begin(), examples.end(),
                                    [&](const Example& e) { return e.name == name; });
    return found == examples.end() ? nullptr : &*found;
}

/// Whether a file can be read and is an INI file with netlists of its own.
bool names_netlists(const std::string& path) {
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
        if (line.starts_with("HALFILE")) return true;
    }
    return false;
}

int no_such_example(const Options& options, const std::vector<Example>& examples,
                    const std::string& name) {
    std::vector<std::string> names;
    for (const Example& example : examples)
        names.push_back(example.name);
    const std::string configuration = (machines() / (name + ".ini")).string();
    if (names_netlists(configuration)) {
        return fail(options,
                    fmt::format("'{}' is a configuration of LinuxCNC; type: hal linuxcnc {}", name,
                                privilege::shell_word(configuration)));
    }
    const std::string hint = did_you_mean(name, names);
    return fail(options, fmt::format("unknown example '{}'; {}", name,
                                     hint.empty() ? "type: hal examples" : hint));
}

/// Becomes `hal run NETLIST OPTION...`, after printing it.
int become_run(const Options& options, const Example& example,
               const std::vector<std::string>& further) {
    std::vector<std::string> words{"hal", "run", example.path};
    const fs::path ini = fs::path(example.path).replace_extension(".ini");
    std::error_code ignored;
    if (fs::is_regular_file(ini, ignored)) {
        words.insert(words.end(), {"--ini", ini.string()});
    }
    words.insert(words.end(), further.begin(), further.end());
    std::string line;
    for (const std::string& word : words) {
        append_item(line, privilege::shell_word(word), " ");
    }
    if (!print(line + "\n")) return 1;
    std::vector<char*> arguments;
    for (std::string& word : words)
        arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const std::string self = program().string();
    ::execv(self.c_str(), arguments.data());
    return fail(options, fmt::format("cannot start {}: {}", self, std::strerror(errno)));
}

}  // namespace

std::vector<Example> find_examples() {
    std::vector<Example> examples;
    const fs::path folder = machines();
    const Plugins plugins;
    const auto listed = listed_components(plugins.path());
    std::error_code ignored;
    for (const auto& entry : fs::recursive_directory_iterator(folder, ignored)) {
        if (entry.path().extension() != ".hal") continue;
        Example example = read_header(folder, entry.path());
        if (example.topic.empty()) continue;
        example.missing = missing_packages(entry.path(), plugins, listed);
        examples.push_back(std::move(example));
    }
    std::sort(examples.begin(), examples.end(), [](const Example& a, const Example& b) {
        return std::tie(a.topic, a.name) < std::tie(b.topic, b.name);
    });
    return examples;
}

std::string example_meant_by(const std::string& path) {
    constexpr std::string_view folder = "halfiles/";
    std::error_code ignored;
    if (!path.starts_with(folder) || fs::exists(path, ignored)) return {};
    const std::string name = fs::path(path.substr(folder.size())).replace_extension().string();
    return find(find_examples(), name) != nullptr ? name : "";
}

std::string list_of(const std::vector<Example>& examples) {
    std::size_t width = 0;
    for (const Example& example : examples)
        width = std::max(width, example.name.size());
    std::string text, topic;
    std::set<std::string> missing;
    for (const Example& example : examples) {
        if (example.topic != topic) text += fmt::format("\n{}\n", example.topic);
        topic = example.topic;
        text += fmt::format("  {:{}}  {}", example.name, width, example.summary);
        if (!example.missing.empty()) {
            text += fmt::format(" (needs {})", fmt::join(example.missing, ", "));
        }
        text += "\n";
        missing.insert(example.missing.begin(), example.missing.end());
    }
    if (!missing.empty()) {
        text += fmt::format("\nPackages that are not installed: sudo apt install {}\n",
                            fmt::join(missing, " "));
    }
    return text;
}

int run_examples(const ExamplesOptions& options) {
    const std::vector<Example> examples = find_examples();
    if (examples.empty()) {
        return fail(options,
                    fmt::format("the machines are missing: this program expects them in {}; "
                                "reinstall Halcyon, or start it in its source tree",
                                paths::build_machines));
    }
    if (options.words.empty()) {
        const std::string list = "Machines to start from. None needs hardware.\n" +
                                 list_of(examples) +
                                 "\nTo run one: hal examples NAME [OPTION of hal run]\n";
        return exit_code(print(list));
    }
    const std::string& name = options.words.front();
    const Example* const example = find(examples, name);
    if (example == nullptr) return no_such_example(options, examples, name);
    return become_run(options, *example, {options.words.begin() + 1, options.words.end()});
}

}  // namespace hal::tools
