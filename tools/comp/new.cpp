// SPDX-License-Identifier: MIT
// `hal new component NAME`: a component that compiles and has a test, in a folder of its own
// outside of the tree. `hal new machine NAME`: a machine that runs and has a test.
#include "comp/new.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fmt/core.h>
#include <fstream>
#include <sstream>

#include "cli/output.hpp"
#include "comp/new_machine.hpp"
#include "machine/load/plugins.hpp"
#include "netlist/netlist.hpp"
#include "text/characters.hpp"
#include "text/diagnostic.hpp"
#include "text/folder_entries.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

namespace fs = std::filesystem;

// @NAME@ is the component's name, @TYPE@ the same as a type, @PACKAGE@ where find_package looks.
// clang-format off: a template
constexpr std::string_view source_text = R"CPP(// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "hal/component.hpp"

namespace {

struct @TYPE@ : hal::Component {
    using Component::Component;

    hal::In<double> in{*this, "in", "target position of out"};
    hal::In<bool> hold{*this, "hold", "TRUE holds out at its position"};
    hal::Out<double> out{*this, "out", "follows in", {.finite = true}};
    hal::Out<bool> there{*this, "there", "TRUE while out is equal to in"};
    hal::Param<double> max_speed{
        *this, "max-speed", "maximum speed of out", {.initial = 1.0, .unit = "1/s"}};
    hal::Function run{*this, "", &@TYPE@::update, "one step"};

    // Runs in every cycle: it must not allocate, lock, block, log or throw.
    void update(hal::Cycle cycle) noexcept {
        const double distance = in - out;
        const double step = std::fabs(max_speed) * cycle.seconds();
        if (!hold && std::isfinite(distance) && std::isfinite(step)) {
            out = out + std::clamp(distance, -step, step);
        }
        there = out == in;
    }
};

}  // namespace

HAL_COMPONENT(@TYPE@, "@NAME@", "Follows its input at a limited speed", R"(
In each cycle `out` moves towards `in`, by at most `max-speed` times the period. While `in` is not a number `out` stays.

    loadrt @NAME@ names=slow
    addf slow servo
    setp slow.max-speed 5
    net wanted => slow.in
    net moved  <= slow.out
)")
)CPP";
// clang-format on

constexpr std::string_view project = R"CMAKE(# SPDX-License-Identifier: MIT
cmake_minimum_required(VERSION 3.25)
project(@NAME@ CXX)
find_package(Halcyon REQUIRED@PACKAGE@)
add_hal_component(@NAME@ @NAME@.cpp)
)CMAKE";

constexpr std::string_view netlist = R"HAL(# SPDX-License-Identifier: MIT
# hal sim test.hal prints what is in `expected`.
newthread servo 1000000
loadrt    @NAME@ names=it

setp it.max-speed 2
setp it.in        1
addf it servo
start

advance 100 cycles
getp    it.out
getp    it.there
advance 1s
getp    it.out
getp    it.there

setp    it.hold TRUE
setp    it.in   -1
advance 100 cycles
getp    it.out
)HAL";

constexpr std::string_view expected = "0.2\nFALSE\n1\nTRUE\n1\n";

constexpr std::string_view keywords[] = {
    "alignas",  "alignof",  "and",       "and_eq",    "asm",       "auto",      "bitand",
    "bitor",    "bool",     "break",     "case",      "catch",     "char",      "class",
    "compl",    "concept",  "const",     "consteval", "constexpr", "constinit", "continue",
    "decltype", "default",  "delete",    "do",        "double",    "else",      "enum",
    "explicit", "export",   "extern",    "false",     "float",     "for",       "friend",
    "goto",     "if",       "inline",    "int",       "long",      "mutable",   "namespace",
    "new",      "noexcept", "not",       "not_eq",    "nullptr",   "operator",  "or",
    "or_eq",    "private",  "protected", "public",    "register",  "requires",  "return",
    "short",    "signed",   "sizeof",    "static",    "struct",    "switch",    "template",
    "this",     "throw",    "true",      "try",       "typedef",   "typeid",    "typename",
    "union",    "unsigned", "using",     "virtual",   "void",      "volatile",  "while",
    "xor",      "xor_eq"};

/// The nearest name that would do.
std::string repaired(const std::string& name) {
    std::string good;
    for (const char c : name) {
        if (is_letter(c) || (is_digit(c) && !good.empty())) {
            good += c;
        } else if (!good.empty() && good.back() != '-') {
            good += c == '_' ? '_' : '-';
        }
    }
    while (!good.empty() && !is_alphanumeric(good.back())) {
        good.pop_back();
    }
    return good.empty() ? "my-part" : good;
}

/// What is wrong with the spelling of a name; empty: nothing.
std::string problem_of_spelling(const std::string& kind, const std::string& name) {
    const bool plain = std::all_of(name.begin(), name.end(),
                                   [](char c) { return is_name_character(c) && c != '.'; });
    constexpr std::size_t max = 40;
    if (!plain || name.empty() || !is_letter(name.front()) || name.back() == '-' ||
        name.back() == '_') {
        return fmt::format(
            "invalid {0} name '{1}': use a letter, then letters, digits, - and _; try: hal new {0} "
            "{2}",
            kind, name, repaired(name));
    }
    if (name.size() > max) {
        return fmt::format("the name has {} characters; the limit is {}", name.size(), max);
    }
    return {};
}

std::string problem_of_component(const std::string& name) {
    if (std::string why = problem_of_spelling("component", name); !why.empty()) return why;
    std::string underlined = name;
    std::replace(underlined.begin(), underlined.end(), '-', '_');
    if (std::find(std::begin(keywords), std::end(keywords), underlined) != std::end(keywords)) {
        return fmt::format("'{0}' is a C++ keyword; try: hal new component my-{0}", name);
    }
    for (const std::string& there : Plugins().available()) {
        std::string other = there;
        std::replace(other.begin(), other.end(), '-', '_');
        if (other == underlined) {
            return fmt::format(
                "component '{0}' already exists (see: hal doc {0}); choose another name", there);
        }
    }
    return {};
}

/// "my-part" as a type: MyPart.
std::string type_of(const std::string& name) {
    std::string type;
    bool first = true;
    for (const char c : name) {
        if (c == '-' || c == '_') {
            first = true;
            continue;
        }
        type += first ? upper(c) : c;
        first = false;
    }
    return type == "Component" ? "TheComponent" : type;
}

std::string filled(std::string_view text, const std::string& name, const std::string& package) {
    std::string result(text);
    const std::array<std::pair<std::string_view, std::string>, 3> words{
        {{"@NAME@", name}, {"@TYPE@", type_of(name)}, {"@PACKAGE@", package}}};
    for (const auto& [word, value] : words) {
        for (std::size_t at = 0; (at = result.find(word, at)) != std::string::npos;
             at += value.size()) {
            result.replace(at, word.size(), value);
        }
    }
    return result;
}

/// As `hal fmt` has it: the columns depend on the name's length.
std::string formatted(std::string text) {
    Sources sources;
    Diagnostics none;
    const std::uint32_t made = sources.add("test.hal", std::move(text));
    return format(sources, made, none);
}

bool has_package(const fs::path& prefix) {
    std::error_code none;
    if (fs::exists(prefix / "lib/cmake/Halcyon/HalcyonConfig.cmake", none)) return true;
    for (const fs::path& folder : folder_entries(prefix / "lib")) {  // lib/x86_64-linux-gnu
        if (fs::exists(folder / "cmake/Halcyon/HalcyonConfig.cmake", none)) return true;
    }
    return false;
}

/// The path that find_package needs: this program's installation or build tree, unless CMake finds
/// one by itself (in the system's folders, and beside the folders of PATH).
std::string package_hint() {
    std::error_code none;
    std::vector<fs::path> found_anyway{"/usr", "/usr/local"};
    std::istringstream folders(std::getenv("PATH") ? std::getenv("PATH") : "");
    for (std::string folder; std::getline(folders, folder, ':');) {
        if (const fs::path path(folder); path.filename() == "bin" || path.filename() == "sbin") {
            found_anyway.push_back(path.parent_path());
        }
    }
    if (std::any_of(found_anyway.begin(), found_anyway.end(), has_package)) {
        return {};
    }
    const fs::path prefix = fs::read_symlink("/proc/self/exe", none).parent_path().parent_path();
    return has_package(prefix) ? prefix.string() : "";
}

std::string shell_word(const std::string& word) {
    const bool plain = std::all_of(word.begin(), word.end(), [](char c) {
        return is_alphanumeric(c) || std::strchr("-_./+,=:@%", c);
    });
    if (plain) return word;
    std::string quoted = "'";
    for (const char c : word) {
        quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    }
    return quoted + "'";
}

/// Creates the folder and the files. Returns what failed; empty: nothing.
std::string create(const NewOptions& options, const fs::path& folder,
                   const std::vector<NewFile>& files) {
    std::error_code problem;
    const bool there = fs::exists(fs::symlink_status(folder, problem));
    if (there && !(fs::is_directory(folder, problem) && fs::is_empty(folder, problem))) {
        return fmt::format(
            "'{0}' exists already; give the new {1} another folder: hal new {1} {2} "
            "--folder DIR",
            folder.string(), options.words[0], options.words[1]);
    }
    fs::create_directories(folder, problem);
    if (problem) return fmt::format("cannot create '{}': {}", folder.string(), problem.message());
    for (const NewFile& file : files) {
        const bool is_netlist = file.name.ends_with(".hal");
        std::string why = write_file((folder / file.name).string(),
                                     is_netlist ? formatted(file.text) : file.text);
        if (!why.empty()) return why;
    }
    return {};
}

int new_component(const NewOptions& options, const fs::path& folder) {
    const std::string& name = options.words[1];
    if (options.axes != 0 || !options.bus.empty()) {
        return fail(options,
                    fmt::format("--axes and --bus are of a machine; type: hal new component "
                                "{0}, or hal new machine {0} with them",
                                name));
    }
    if (const std::string why = problem_of_component(name); !why.empty()) return fail(options, why);
    const std::string package = package_hint();
    const std::string hint = package.empty() ? "" : fmt::format(" HINTS \"{}\"", package);
    const std::vector<NewFile> files{{name + ".cpp", filled(source_text, name, hint)},
                                     {"CMakeLists.txt", filled(project, name, hint)},
                                     {"test.hal", filled(netlist, name, hint)},
                                     {"expected", filled(expected, name, hint)}};
    if (const std::string why = create(options, folder, files); !why.empty()) {
        return fail(options, why);
    }
    return exit_code(
        print(fmt::format("{0}: {1}.cpp, CMakeLists.txt, test.hal and its expected output\n"
                          "  cd {0}\n"
                          "  cmake -B build && cmake --build build && ctest --test-dir build\n"
                          "To run it: HALCYON_PLUGIN_PATH=build hal sim test.hal; its manual page: "
                          "HALCYON_PLUGIN_PATH=build hal doc {1}; to install it: "
                          "hal compile {1}.cpp\n",
                          shell_word(folder.string()), name)));
}

int new_machine(const NewOptions& options, const fs::path& folder) {
    const std::string& name = options.words[1];
    if (const std::string why = problem_of_spelling("machine", name); !why.empty()) {
        return fail(options, why);
    }
    NewMachine machine{.name = name};
    if (options.axes != 0) {
        machine.axes = options.axes;
    }
    if (!options.bus.empty()) {
        machine.bus = options.bus;
    }
    const auto buses = machine_buses();
    if (std::find(buses.begin(), buses.end(), machine.bus) == buses.end()) {
        std::string names;
        for (const std::string_view bus : buses) {
            append_item(names, bus);
        }
        return fail(options, fmt::format("unknown bus '{}'; type one of {}", options.bus, names));
    }
    const std::vector<NewFile> files = machine_files(machine);
    if (const std::string why = create(options, folder, files); !why.empty()) {
        return fail(options, why);
    }
    std::string names;
    for (const NewFile& file : files) {
        append_item(names, file.name);
    }
    return exit_code(print(fmt::format(
        "{0}: {2}\n  cd {0}\n  hal run --ini {1}.ini {1}.hal\nIts test: hal sim --quiet --ini "
        "{1}.ini test.hal 2>/dev/null | diff expected -\n",
        shell_word(folder.string()), name, names)));
}

struct Kind {
    const char* name;
    int (*create)(const NewOptions& options, const fs::path& folder);
};

constexpr Kind kinds[] = {{"component", new_component}, {"machine", new_machine}};

}  // namespace

int run_new(const NewOptions& options) {
    const auto& words = options.words;
    const auto* const kind = std::find_if(std::begin(kinds), std::end(kinds), [&](const Kind& one) {
        return !words.empty() && words[0] == one.name;
    });
    if (kind == std::end(kinds)) {
        const bool may_be_name =
            words.size() == 1 && problem_of_spelling("component", words[0]).empty();
        const std::string name = may_be_name ? words[0] : "NAME";
        return fail(options, fmt::format("missing kind; type: hal new component {0}, or hal new "
                                         "machine {0}",
                                         name));
    }
    if (words.size() < 2) {
        return fail(options, fmt::format("missing name; type: hal new {} NAME", kind->name));
    }
    if (words.size() > 2) {
        return fail(options,
                    fmt::format("expected one name, not {}; a name contains no blanks: "
                                "hal new {} {}",
                                words.size() - 1, kind->name, repaired(words[1] + "-" + words[2])));
    }
    return kind->create(options, options.folder.empty() ? words[1] : options.folder);
}

}  // namespace hal::tools
