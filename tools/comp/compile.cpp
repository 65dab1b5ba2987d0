// SPDX-License-Identifier: MIT
// `hal compile FILE…`: a plugin from one source file, installed where the runtime looks. A kind of
// file is a row of the table.
#include "comp/compile.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fmt/core.h>
#include <optional>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

#include "cli/output.hpp"
#include "comp/build_plugin.hpp"
#include "comp/check_realtime.hpp"
#include "comp/comp.hpp"
#include "hal/read_file.hpp"
#include "machine/load/plugins.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

namespace fs = std::filesystem;

/// Determines what to compile. Returns false after printing the error.
using Prepare = bool (*)(const Options& options, const std::string& path, PluginSource& source);

bool prepare_cpp(const Options&, const std::string&, PluginSource& source) {
    source.language = Language::cpp;
    return true;
}

bool prepare_c(const Options& options, const std::string& path, PluginSource& source) {
    std::string text;
    if (!read_file(path, text)) {
        fail(options, fmt::format("{}: {}", path, text));
        return false;
    }
    source.language = Language::c;
    source.linuxcnc = true;
    source.program = comp::is_program(text);
    return true;
}

bool prepare_comp(const Options& options, const std::string& path, PluginSource& source) {
    std::string text;
    if (!read_file(path, text)) {
        fail(options, fmt::format("{}: {}", path, text));
        return false;
    }
    Sources sources;
    Diagnostics diagnostics;
    auto made = comp::translate(sources, sources.add(path, std::move(text)), diagnostics);
    write_all(STDERR_FILENO, render(diagnostics, sources, colours(STDERR_FILENO)));
    if (!made) {
        fail(options, fmt::format("'{}' has {}; it was not installed", path,
                                  counted(diagnostics.errors(), "error")));

        return false;
    }
    source.name = made->name;
    source.text = std::move(made->c);
    source.language = Language::c;
    source.linuxcnc = true;
    source.options = made->compile_args;
    source.program = made->program;
    source.comp_instances = made->program || !made->own_main;
    source.options.insert(source.options.end(), made->link_args.begin(), made->link_args.end());
    return true;
}

struct Kind {
    const char* extension;
    Prepare prepare;
};
constexpr Kind kinds[] = {{".cpp", prepare_cpp},
                          {".cc", prepare_cpp},
                          {".cxx", prepare_cpp},
                          {".c", prepare_c},
                          {".comp", prepare_comp}};

/// The runtime looks into `folder` for plugins.
bool searched(const std::string& folder) {
    std::error_code none;
    const auto wanted = fs::weakly_canonical(folder, none);
    const Plugins plugins;
    return std::any_of(plugins.path().begin(), plugins.path().end(), [&](const std::string& one) {
        return fs::weakly_canonical(one, none) == wanted;
    });
}

std::string tilde(const std::string& path) {
    const char* home = std::getenv("HOME");
    return home && *home && path.starts_with(std::string(home) + "/")
               ? "~" + path.substr(std::string(home).size())
               : path;
}

void announce(const BuiltPlugin& built, bool program, bool elsewhere) {
    const std::string folder = fs::path(built.path).parent_path().string();
    if (program) {
        print(fmt::format(
            "{0}: a program; installed as {1}\nnext: in a netlist: loadusr -Wn {0} {2}\n",
            built.name, tilde(built.path), elsewhere ? built.path : built.name));
        return;
    }
    std::string text = fmt::format("{}: ", built.name);
    if (built.needs.empty()) {
        text += fmt::format("{}, {}; ", counted(built.pins, "pin"),
                            counted(built.functions, "function"));
    }
    text += fmt::format("installed as {}\n", tilde(built.path));
    const std::string path = searched(folder) ? "" : fmt::format("HALCYON_PLUGIN_PATH={} ", folder);
    text += fmt::format("next: {}hal doc {}", path, built.name);
    if (!built.needs.empty()) {
        text += fmt::format("; it needs load arguments: {}", built.needs);
    } else if (!built.function.empty()) {
        text += fmt::format(", or in a netlist: loadrt {}, then addf {} THREAD", built.name,
                            built.function);
    }
    print(text + "\n");
}

void print_note(const CompileOptions& options, const std::string& note) {
    write_all(STDERR_FILENO, fmt::format("{}: note: {}\n", options.program, note));
}

/// --check-rt: what cannot be checked fails.
bool passes_check(const CompileOptions& options, const BuiltPlugin& built,
                  const PluginSource& source) {
    const RealtimeReport report = check_realtime(options, built, source);
    for (const std::string& violation : report.violations) {
        fail(options, violation);
    }
    if (!report.unchecked.empty()) {
        fail(options, report.unchecked);
    }
    if (!report.good()) return false;
    print(fmt::format("real time: {}, no violation\n", report.summary));
    return true;
}

/// Without options: checks what acquires nothing and needs no load arguments, prints violations
/// only.
bool passes_default_check(const CompileOptions& options, const BuiltPlugin& built,
                          const PluginSource& source, const std::string& path) {
    if (source.linuxcnc || options.classic || !built.needs.empty()) return true;
    if (built.starts) {
        print_note(options, fmt::format("{}: real time was not checked, because it has start(), "
                                        "which may open a device; type: hal compile --check-rt {}",
                                        built.name, path));
        return true;
    }
    const RealtimeReport report = check_realtime(options, built, source);
    for (const std::string& violation : report.violations) {
        fail(options, violation);
    }
    if (!report.violations.empty()) {
        print_note(options, fmt::format("to install it all the same, type: hal compile "
                                        "--no-check-rt {}",
                                        path));
        return false;
    }
    if (!report.unchecked.empty()) {
        print_note(options, "real time was not checked: " + report.unchecked);
    }
    return true;
}

/// Returns the kind of a file that can be read, or nullptr after printing what is wrong.
const Kind* kind_of(const CompileOptions& options, const std::string& path) {
    const std::string extension = fs::path(path).extension().string();
    const Kind* const kind = std::ranges::find(kinds, extension, &Kind::extension);
    if (kind == std::end(kinds)) {
        fail(options, fmt::format("unknown file type of '{}'; use .cpp, .c or .comp", path));
        return nullptr;
    }
    if (::access(path.c_str(), R_OK) != 0) {
        fail(options, fmt::format("{}: {}", path, std::strerror(errno)));
        return nullptr;
    }
    struct stat about{};
    if (::stat(path.c_str(), &about) == 0 && !S_ISREG(about.st_mode)) {
        // a compiler would wait for the other end of a FIFO
        fail(options,
             fmt::format("'{}' cannot be compiled: {}", path, special_kind(about.st_mode)));
        return nullptr;
    }
    return kind;
}

/// What is to be compiled, with the arguments of the command line. Nothing after printing the
/// reason.
std::optional<PluginSource> source_of(const CompileOptions& options, const std::string& path) {
    const Kind* const kind = kind_of(options, path);
    if (kind == nullptr) return std::nullopt;
    PluginSource source;
    source.name = fs::path(path).stem().string();
    source.path = path;
    if (!kind->prepare(options, path, source)) return std::nullopt;
    source.program = source.program || (options.as_program && source.language == Language::c);
    for (const auto* arguments : {&options.compile_args, &options.link_args}) {
        source.options.insert(source.options.end(), arguments->begin(), arguments->end());
    }
    if (options.keep && !source.text) {
        fail(options,
             fmt::format("--keep applies to .comp files only; '{}' is compiled directly", path));
        return std::nullopt;
    }
    return source;
}

}  // namespace

int compile_file(const CompileOptions& options, const std::string& path) {
    const std::optional<PluginSource> source = source_of(options, path);
    if (!source) return 1;
    BuildOptions build;
    build.folder = options.output;
    if (options.keep) {
        build.keep = source->name + (source->language == Language::cpp ? ".cpp" : ".c");
    }
    // the messages of the compiler go before those of the check
    bool printed = false;
    const auto print_messages = [&](const BuiltPlugin& built) {
        if (!std::exchange(printed, true)) {
            write_all(STDERR_FILENO, built.messages);
        }
    };
    if (!options.no_check_rt) {
        build.fit = [&](const BuiltPlugin& built) {
            print_messages(built);
            return options.check_rt ? passes_check(options, built, *source)
                                    : passes_default_check(options, built, *source, path);
        };
    }
    const BuiltPlugin built = build_plugin(*source, build);
    print_messages(built);
    if (!built.good) return fail(options, built.problem);
    if (!built.hint.empty()) {
        print_note(options, built.hint);
    }
    if (!options.classic) {
        announce(built, source->program, !options.output.empty());
    }
    return 0;
}

int run_compile(const CompileOptions& options) {
    if (options.check_rt && options.no_check_rt) {
        return fail(options, "--check-rt and --no-check-rt exclude each other");
    }
    int worst = 0;
    for (const std::string& path : options.words) {
        worst = std::max(worst, compile_file(options, path));
    }
    return worst;
}

}  // namespace hal::tools
