// SPDX-License-Identifier: MIT
#include "comp/build_plugin.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fmt/core.h>
#include <fstream>
#include <sstream>
#include <sys/wait.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "comp/toolchain.hpp"
#include "comp/try_plugin.hpp"
#include "machine/plugins.hpp"
#include "paths.hpp"

namespace hal::tools {

namespace {

namespace fs = std::filesystem;

bool executable(const std::string& path) {
    return ::access(path.c_str(), X_OK) == 0 && !fs::is_directory(path);
}

std::string in_path(const std::string& name) {
    if (name.find('/') != std::string::npos) return executable(name) ? name : "";
    const char* path = std::getenv("PATH");
    std::istringstream folders(path ? path : "/usr/bin:/bin");
    for (std::string folder; std::getline(folders, folder, ':');) {
        if (std::string file = (folder.empty() ? "." : folder) + "/" + name; executable(file)) {
            return file;
        }
    }
    return {};
}

/// A user's further flags, as every build tool takes them.
void add_from_environment(const char* variable, std::vector<std::string>& words) {
    if (const char* const text = std::getenv(variable)) {
        for (std::string& word : split_words(text)) {
            words.push_back(std::move(word));
        }
    }
}

/// Replaces the plugin atomically; a running instance keeps the old file.
std::string install(const std::string& from, const std::string& folder, const std::string& file) {
    std::error_code error;
    fs::create_directories(folder, error);
    const std::string target = fmt::format("{}/{}", folder, file);

    const std::string fresh = fmt::format("{}/.{}.{}", folder, file, ::getpid());
    if (!error) {
        fs::copy_file(from, fresh, fs::copy_options::overwrite_existing, error);
    }
    if (!error) {
        fs::rename(fresh, target, error);
    }
    if (!error) {
        return {};
    }
    std::error_code ignored;
    fs::remove(fresh, ignored);
    return fmt::format("{} cannot be written: {}", target, error.message());
}

/// Flags of cmake/HalcyonComponent.cmake and cmake/HalcyonBuild.cmake.
std::vector<std::string> flags(Language language, bool clang, bool program) {
    std::vector<std::string> all{
        "-O2",
        program ? "-fPIE" : "-fPIC",
        program ? "-pie" : "-shared",
        "-fvisibility=hidden",
        "-fno-plt",
        "-ffp-contract=off",
        "-Wall",
        colours(STDERR_FILENO) ? "-fdiagnostics-color=always" : "-fdiagnostics-color=never"};
    if (language == Language::cpp) {
        all.insert(all.end(), {"-std=c++20", "-fvisibility-inlines-hidden", "-Wextra"});
    } else {
        all.push_back("-std=gnu17");
    }
    // a unique symbol would keep the library loaded for ever
    if (!clang) {
        all.push_back("-fno-gnu-unique");
    }
    return all;
}

/// A source in runtime/sdk/linuxcnc, and which components are compiled with it.
struct LinuxcncSource {
    const char* file;
    bool (*needed)(const PluginSource&);
};
constexpr bool always(const PluginSource&) { return true; }
constexpr bool plugin(const PluginSource& source) { return !source.program; }
constexpr bool program(const PluginSource& source) { return source.program; }
constexpr bool plugin_from_c(const PluginSource& source) {
    return !source.program && !source.comp_instances;
}
constexpr bool plugin_from_comp(const PluginSource& source) {
    return !source.program && source.comp_instances;
}
constexpr bool program_from_comp(const PluginSource& source) {
    return source.program && source.comp_instances;
}
constexpr LinuxcncSource linuxcnc_sources[] = {
    {"declare.c", always},
    {"rtapi.c", always},
    {"streams.c", always},
    {"plugin.c", plugin},
    {"arguments.c", plugin},
    {"ports.c", plugin},
    {"component.c", plugin_from_c},
    {"restore.c", plugin_from_c},
    {"comp_component.c", plugin_from_comp},
    {"program.c", program},
    {"program_exchange.c", program},
    {"program_protocol.c", program},
    {"program_ports.c", program},
    {"comp_program.c", program_from_comp},
};

std::string linuxcnc_folder() {
    for (const std::string& folder : sdk_includes()) {
        if (std::error_code none; fs::is_regular_file(folder + "/linuxcnc/component.c", none)) {
            return folder + "/linuxcnc";
        }
    }
    return {};
}

}  // namespace

std::vector<std::string> sdk_includes() {
    const auto complete = [](const std::vector<std::string>& folders) {
        const auto has = [&](const char* header) {
            std::error_code none;
            return std::any_of(folders.begin(), folders.end(), [&](const std::string& folder) {
                return fs::is_regular_file(folder + "/" + header, none);
            });
        };
        return has("hal/abi.h") && has("hal/component.hpp");
    };
    std::vector<std::vector<std::string>> places;
    const auto add = [&](std::string_view text) {
        std::vector<std::string> folders;
        std::istringstream parts{std::string(text)};
        for (std::string folder; std::getline(parts, folder, ':');) {
            folders.push_back(folder);
        }
        places.push_back(std::move(folders));
    };
    // beside the program first, so that an installation that was moved finds its own headers, not
    // another version's
    std::error_code none;
    const fs::path program = fs::read_symlink("/proc/self/exe", none).parent_path();
    if (!none) {
        add(fs::weakly_canonical(program / paths::includes_from_programs, none).string());
    }
    const bool in_build_tree = !none && fs::weakly_canonical(program / "../components", none) ==
                                            fs::path(paths::build_components);
    add(in_build_tree ? paths::build_includes : paths::install_includes);
    add(in_build_tree ? paths::install_includes : paths::build_includes);
    for (const auto& folders : places) {
        if (complete(folders)) return folders;
    }
    return {};
}

std::string find_compiler(Language language, std::string& problem) {
    const bool cpp = language == Language::cpp;
    const char* const variable = cpp ? "CXX" : "CC";
    if (const char* wanted = std::getenv(variable); wanted && *wanted) {
        const auto words = split_words(wanted);
        if (!words.empty() && !in_path(words.front()).empty()) return wanted;
        problem =
            fmt::format("{}={} is not an executable program; unset it, or set it to a {} compiler",
                        variable, wanted, cpp ? "C++20" : "C");
        return {};
    }
    const std::vector<const char*> cpp_names{"g++", "clang++", "c++"},
        c_names{"gcc", "clang", "cc"};
    for (const char* name : cpp ? cpp_names : c_names) {
        if (const std::string path = in_path(name); !path.empty()) return path;
    }
    problem = fmt::format("no {} compiler found; install one: sudo apt install {}",
                          cpp ? "C++" : "C", cpp ? "g++" : "gcc");
    return {};
}

BuiltPlugin build_plugin(const PluginSource& source, const BuildOptions& options) {
    BuiltPlugin built;
    const auto fail = [&](std::string why) {
        built.problem = std::move(why);
        return built;
    };
    const std::string folder = options.folder.empty()
                                   ? user_folder(source.program ? "bin" : "components")
                                   : options.folder;
    if (folder.empty()) {
        return fail(
            "no folder to install in: neither XDG_DATA_HOME nor HOME is set; use --output DIR");
    }
    const std::string compiler = find_compiler(source.language, built.problem);
    if (compiler.empty()) return built;
    const std::vector<std::string> headers = sdk_includes();
    if (headers.empty()) {
        return fail(
            fmt::format("Halcyon's headers are neither in {} nor beside the program; install them: "
                        "cmake --install",
                        paths::install_includes));
    }
    const TemporaryFolder temporary;
    if (!temporary.problem().empty()) return fail(temporary.problem());

    std::string file = source.path;
    if (source.text) {
        file = temporary.file(source.name + (source.language == Language::cpp ? ".cpp" : ".c"));
        if (const std::string why = write_file(file, *source.text); !why.empty()) return fail(why);
        if (const std::string why =
                options.keep.empty() ? "" : write_file(options.keep, *source.text);
            !why.empty()) {
            return fail(why);
        }
    }
    const std::string map = temporary.file("plugin.map");

    const std::string library =
        temporary.file(source.program ? source.name + ".program" : source.name + ".so");
    if (const std::string why = write_file(map, "{ global: hal_plugin; local: *; };\n");
        !why.empty()) {
        return fail(why);
    }

    std::vector<std::string> words = split_words(compiler);
    std::string version;
    std::vector<std::string> ask = words;
    ask.push_back("--version");
    run_program(ask, version);
    const bool clang = version.find("clang") != std::string::npos;
    for (std::string& flag : flags(source.language, clang, source.program)) {
        words.push_back(std::move(flag));
    }
    for (const std::string& include : source.includes) {
        words.insert(words.end(), {"-I", include});
    }
    const std::string own = fs::path(source.path).parent_path().string();
    words.insert(words.end(), {"-I", own.empty() ? "." : own});
    for (const std::string& include : headers) {
        words.insert(words.end(), {"-I", include});
    }
    std::vector<std::string> behind;
    if (source.linuxcnc) {
        const std::string shim = linuxcnc_folder();
        if (shim.empty()) {
            return fail(
                "the headers for LinuxCNC components (linuxcnc/hal.h) are not installed with "
                "Halcyon's others; install it again");
        }
        words.insert(words.end(), {"-I", shim, source.program ? "-DULAPI=1" : "-DRTAPI=1",
                                   fmt::format("-DHALCYON_COMPONENT=\"{}\"", source.name)});
        if (source.program) {
            words.push_back("-DHALCYON_PROGRAM=1");
        }
        for (const LinuxcncSource& part : linuxcnc_sources) {
            if (part.needed(source)) {
                behind.push_back(shim + "/" + part.file);
            }
        }
    }
    add_from_environment(source.language == Language::cpp ? "CXXFLAGS" : "CFLAGS", words);
    words.push_back(file);
    words.insert(words.end(), behind.begin(), behind.end());
    words.insert(words.end(), source.options.begin(), source.options.end());
    add_from_environment("LDFLAGS", words);
    words.insert(words.end(), {"-o", library, "-pthread", "-lm"});
    if (!source.program) {
        words.insert(words.end(), {"-Wl,--version-script=" + map, "-Wl,-z,defs"});
    }

    const int status = run_program(words, built.messages);
    if (source.language == Language::cpp && status != 0) {
        built.messages = without_false_hint(built.messages, source);
    }
    if (status == -1) {
        return fail(fmt::format("{} cannot be run: {}", words.front(), std::strerror(errno)));
    }
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
        return fail(
            built.messages.empty()
                ? fmt::format("{} failed with status {} and no message", words.front(), status)
                : fmt::format("'{}' does not compile; nothing was installed", source.path));
    }
    built.name = source.name;
    if (options.load && !source.program &&
        !try_plugin(temporary.path(), source.name, source, built)) {
        return fail(
            built.loads
                ? fmt::format("{}; nothing was installed", built.problem)
                : fmt::format("'{}' compiles, but is not a component: {}; nothing was installed",
                              source.path, built.problem));
    }
    if (built.name.empty() || built.name.find('/') != std::string::npos) {
        return fail(fmt::format(
            "'{}' names its component '{}', which cannot be a file's name; nothing was installed",
            source.path, built.name));
    }
    built.path = library;
    if (options.fit && !source.program && !options.fit(built)) {
        return fail(fmt::format("'{}' was not installed", source.path));
    }
    if (const std::string problem =
            install(library, folder, built.name + (source.program ? "" : ".so"));
        !problem.empty()) {
        return fail(problem);
    }
    built.path = folder + "/" + built.name + (source.program ? "" : ".so");
    built.good = true;
    return built;
}

}  // namespace hal::tools
