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
#include "comp/compiler_messages.hpp"
#include "comp/toolchain.hpp"
#include "comp/try_plugin.hpp"
#include "machine/load/plugins.hpp"
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
        "-g1",  // lines, for the message of check_realtime()
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

/// A source in runtime/linuxcnc/source, and which components are compiled with it.
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
    problem = cpp ? "no C++ compiler found; install one: sudo apt install g++"
                  : "no C compiler found; install one: sudo apt install gcc";
    return {};
}

namespace {

/// One build, step by step. A step that fails sets the problem and returns false.
class PluginBuild {
public:
    PluginBuild(const PluginSource& source, const BuildOptions& options)
        : source_(source), options_(options) {}

    BuiltPlugin run() {
        built_.good = find_tools() && write_sources() && compile() && try_out() && install_it();
        return std::move(built_);
    }

private:
    bool fail(std::string why) {
        built_.problem = std::move(why);
        return false;
    }

    bool find_tools() {
        folder_ = options_.folder;
        if (folder_.empty()) {
            folder_ = user_folder(source_.program ? "bin" : "components");
        }
        if (folder_.empty()) {
            return fail(
                "no folder to install in: neither XDG_DATA_HOME nor HOME is set; use --output DIR");
        }
        compiler_ = find_compiler(source_.language, built_.problem);
        if (compiler_.empty()) return false;
        headers_ = sdk_includes();
        if (headers_.empty()) {
            return fail(fmt::format(
                "Halcyon's headers are neither in {} nor beside the program; with Halcyon's Debian "
                "packages, type: sudo apt install halcyon-dev; else install it again: cmake "
                "--install",
                paths::install_includes));
        }
        return temporary_.problem().empty() || fail(temporary_.problem());
    }

    bool write(const std::string& path, const std::string& text) {
        const std::string why = write_file(path, text);
        return why.empty() || fail(why);
    }

    bool write_sources() {
        file_ = source_.path;
        map_ = temporary_.file("plugin.map");
        library_ = temporary_.file(source_.name + (source_.program ? ".program" : ".so"));
        if (source_.text) {
            const char* const ending = source_.language == Language::cpp ? ".cpp" : ".c";
            file_ = temporary_.file(source_.name + ending);
            if (!write(file_, *source_.text)) return false;
            if (!options_.keep.empty() && !write(options_.keep, *source_.text)) return false;
        }
        return write(map_, "{ global: hal_plugin; local: *; };\n");
    }

    bool is_clang() const {
        std::vector<std::string> ask = split_words(compiler_);
        ask.push_back("--version");
        std::string version;
        run_program(ask, version);
        return version.find("clang") != std::string::npos;
    }

    static void add_include(std::vector<std::string>& words, const std::string& folder) {
        words.insert(words.end(), {"-I", folder});
    }

    /// The words for a LinuxCNC component; `sources` receives the files compiled with it.
    bool add_linuxcnc(std::vector<std::string>& words, std::vector<std::string>& sources) {
        const std::string shim = linuxcnc_folder();
        if (shim.empty()) {
            return fail(
                "the headers for LinuxCNC components (linuxcnc/hal.h) are not installed with "
                "Halcyon's others; install it again");
        }
        add_include(words, shim);
        words.push_back(source_.program ? "-DULAPI=1" : "-DRTAPI=1");
        words.push_back(fmt::format("-DHALCYON_COMPONENT=\"{}\"", source_.name));
        if (source_.program) {
            words.push_back("-DHALCYON_PROGRAM=1");
        }
        for (const LinuxcncSource& part : linuxcnc_sources) {
            if (part.needed(source_)) {
                sources.push_back(shim + "/" + part.file);
            }
        }
        return true;
    }

    /// The compiler's command line; empty: it failed.
    std::vector<std::string> command_line() {
        std::vector<std::string> words = split_words(compiler_);
        for (std::string& flag : flags(source_.language, is_clang(), source_.program)) {
            words.push_back(std::move(flag));
        }
        for (const std::string& include : source_.includes) {
            add_include(words, include);
        }
        const std::string own = fs::path(source_.path).parent_path().string();
        add_include(words, own.empty() ? "." : own);
        for (const std::string& include : headers_) {
            add_include(words, include);
        }
        std::vector<std::string> sources{file_};
        if (source_.linuxcnc && !add_linuxcnc(words, sources)) return {};
        add_from_environment(source_.language == Language::cpp ? "CXXFLAGS" : "CFLAGS", words);
        words.insert(words.end(), sources.begin(), sources.end());
        words.insert(words.end(), source_.options.begin(), source_.options.end());
        add_from_environment("LDFLAGS", words);
        words.insert(words.end(), {"-o", library_, "-pthread", "-lm"});
        if (!source_.program) {
            words.insert(words.end(), {"-Wl,--version-script=" + map_, "-Wl,-z,defs"});
        }
        return words;
    }

    bool compile() {
        const std::vector<std::string> words = command_line();
        if (words.empty()) return false;
        const int status = run_program(words, built_.messages);
        if (status == -1) {
            return fail(fmt::format("{} cannot be run: {}", words.front(), std::strerror(errno)));
        }
        if (source_.language == Language::cpp && status != 0) {
            built_.messages =
                with_assertions_in_one_line(without_false_hint(built_.messages, source_));
        }
        if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return true;
        if (built_.messages.empty()) {
            return fail(
                fmt::format("{} failed with status {} and no message", words.front(), status));
        }
        return fail(fmt::format("'{}' does not compile; it was not installed", source_.path));
    }

    bool try_out() {
        built_.name = source_.name;
        const bool is_loaded = options_.load && !source_.program;
        if (is_loaded && !try_plugin(temporary_.path(), source_.name, source_, built_)) {
            if (built_.loads) {
                return fail(fmt::format("{}; it was not installed", built_.problem));
            }
            return fail(
                fmt::format("'{}' compiles, but is not a component: {}; it was not installed",
                            source_.path, built_.problem));
        }
        if (built_.name.empty() || built_.name.find('/') != std::string::npos) {
            return fail(
                fmt::format("'{}' names its component '{}', which cannot be a file's name; "
                            "it was not installed",
                            source_.path, built_.name));
        }
        built_.path = library_;
        if (options_.fit && !source_.program && !options_.fit(built_)) {
            return fail(fmt::format("'{}' was not installed", source_.path));
        }
        return true;
    }

    bool install_it() {
        const std::string file = built_.name + (source_.program ? "" : ".so");
        if (const std::string problem = install(library_, folder_, file); !problem.empty()) {
            return fail(problem);
        }
        built_.path = folder_ + "/" + file;
        return true;
    }

    const PluginSource& source_;
    const BuildOptions& options_;
    const TemporaryFolder temporary_;
    BuiltPlugin built_;
    std::string folder_;  ///< where the plugin is installed
    std::string compiler_;
    std::vector<std::string> headers_;
    std::string file_;  ///< what is compiled
    std::string map_;  ///< the linker's version script
    std::string library_;  ///< what is made, before it is installed
};

}  // namespace

BuiltPlugin build_plugin(const PluginSource& source, const BuildOptions& options) {
    return PluginBuild(source, options).run();
}

}  // namespace hal::tools
