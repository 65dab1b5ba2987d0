// SPDX-License-Identifier: MIT
// One plugin from one source: found compiler, the flags of cmake/HalcyonComponent.cmake, installed
// by a rename.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace hal::tools {

enum class Language { c, cpp };

struct PluginSource {
    std::string name;                  ///< of the plugin: NAME.so, what loadrt takes
    std::string path;                  ///< the user's file, as typed; messages name it
    /// compiled in place of the file; its #line directives name the original lines
    std::optional<std::string> text;
    Language language = Language::cpp;
    /// folders searched before Halcyon's headers; the folder of `path` is always searched
    std::vector<std::string> includes;
    std::vector<std::string> options;  ///< further words for the compiler
    bool program = false;              ///< an executable outside the machine, not a plugin
    /// a LinuxCNC component in C: compiled with hal.h, rtapi.h … and the sources behind them
    bool linuxcnc = false;
    /// its instances are those of a .comp file; else its rtapi_app_main(), or main(), declares the
    /// pins
    bool comp_instances = false;
};

struct BuiltPlugin;

struct BuildOptions {
    /// where NAME.so goes; empty: user_folder("components"), of a program user_folder("bin")
    std::string folder;
    /// where the compiled text is left for reading (a file); empty: nowhere
    std::string keep;
    /// open it as the runtime does before it is installed; a plugin that does not load is not
    /// installed
    bool load = true;
    /// Called for a plugin that loads, with its temporary path. Returns false, after printing the
    /// reason, to reject its installation.
    std::function<bool(const BuiltPlugin&)> fit = {};
};

struct BuiltPlugin {
    bool good = false;
    std::string path;  ///< of the installed plugin
    /// what loadrt takes: the component's name, which may not be the file's
    std::string name;
    std::string summary;
    std::size_t pins = 0;
    std::size_t functions = 0;  ///< of one instance without load arguments
    std::string function;  ///< the full name of the first function of the first instance
    /// why an instance without load arguments cannot be made; empty: it can
    std::string needs;
    bool starts = false;  ///< it has start() or stop(), which may acquire something
    /// for the author, of what is allowed and seldom meant; empty: nothing
    std::string hint;
    /// of one that is not good: it is a component, and the problem is how it is written
    bool loads = false;
    /// the compiler's output, including warnings; it names the user's file and lines
    std::string messages;
    std::string problem;  ///< our sentence when it is not good
};

/// Compiles, tries, installs. Writes nothing to the terminal.
BuiltPlugin build_plugin(const PluginSource& source, const BuildOptions& options);

/// The folders of Halcyon's headers: those of the tree this program was built in, else the
/// installed ones. Empty: none found.
std::vector<std::string> sdk_includes();

/// Returns a compiler's path: $CXX or $CC, else g++, clang++, c++ (gcc, clang, cc) in $PATH. Empty:
/// none found; sets `problem` to what to install.
std::string find_compiler(Language language, std::string& problem);

}  // namespace hal::tools
