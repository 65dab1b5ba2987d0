// SPDX-License-Identifier: MIT
// halcompile, with LinuxCNC's options: what it does beyond `hal compile` is the C text of a .comp
// file and a manual page as a file.
#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fmt/core.h>
#include <getopt.h>
#include <optional>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "comp/comp.hpp"
#include "comp/compile.hpp"
#include "comp/halcompile.hpp"
#include "comp/toolchain.hpp"
#include "doc/page.hpp"
#include "doc/page_asciidoc.hpp"
#include "machine/load/plugins.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

namespace {

namespace fs = std::filesystem;

constexpr const char* usage =
    "usage: halcompile [MODE] [OPTION…] FILE.comp|FILE.c…\n\n"
    "Modes:\n"
    "  -p, --preprocess   write the C code of a .comp file, NAME.c (the default)\n"
    "  -c, --compile      build NAME.so, or a program NAME, in the current folder\n"
    "  -i, --install      build it and install it for halrun and halcmd\n"
    "  -d, --document     write the manual page, NAME.9\n"
    "      --adoc         write it as AsciiDoc, NAME.adoc\n"
    "      --view-doc     show it, in a terminal with man\n"
    "Options:\n"
    "  -o, --outfile FILE           output file of the C code or the page\n"
    "  -u, --userspace              FILE.c is a program\n"
    "  -P, --personalities N        accepted and ignored: the number of personalities is "
    "unlimited\n"
    "      --extra-compile-args=ARGS, --extra-link-args=ARGS   further arguments for the compiler\n"
    "  -U, --unix                   accepted and ignored\n"
    "  -h, --help                   this\n"
    "`hal compile` is the same compiler with other options; it also takes components in C++.\n";

enum Mode { preprocess, compile, install, document, asciidoc, view };

std::string stem_of(const std::string& path) { return fs::path(path).stem().string(); }

int to_c(const CompileOptions& options, const std::string& path) {
    if (!path.ends_with(".comp")) {
        return fail(options,
                    fmt::format("'{}' is not a .comp file: there is nothing to preprocess", path));
    }
    std::string text;
    if (!read_file(path, text)) {
        return fail(options, fmt::format("{}: {}", path, text));
    }
    Sources sources;
    Diagnostics diagnostics;
    const auto made = comp::translate(sources, sources.add(path, std::move(text)), diagnostics);
    write_all(STDERR_FILENO, render(diagnostics, sources, colours(STDERR_FILENO)));
    if (!made) {
        return fail(options, fmt::format("'{}' has {}; nothing was written", path,
                                         counted(diagnostics.errors(), "error")));
    }
    const std::string problem = write_file(
        options.output.empty() ? fs::path(path).replace_extension(".c").string() : options.output,
        made->c);
    return problem.empty() ? 0 : fail(options, problem);
}

/// Formatted by man in a terminal; as plain text elsewhere, and where there is no man.
int show(const Page& page, const TemporaryFolder& folder) {
    const std::string file = folder.file(page.name + ".9");
    pid_t pid = 0;
    int status = 1;
    if (::isatty(STDOUT_FILENO) && write_file(file, as_man(page)).empty()) {
        const char* const words[] = {"man", "-l", file.c_str(), nullptr};
        if (::posix_spawnp(&pid, words[0], nullptr, nullptr, const_cast<char* const*>(words),
                           environ) == 0) {
            while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
            }
        }
    }
    return exit_code(status == 0 || print(as_text(page)));
}

int to_page(Mode mode, const CompileOptions& options, const std::string& path) {
    const TemporaryFolder temporary;
    if (!temporary.problem().empty()) return fail(options, temporary.problem());
    CompileOptions build = options;
    build.output = temporary.path();
    if (const int status = compile_file(build, path); status != 0) return status;
    Diagnostics diagnostics;
    const Plugins plugins({temporary.path()});
    const std::string name = stem_of(path);
    if (!fs::exists(temporary.file(name + ".so"))) {
        return fail(
            options,
            fmt::format("'{}' is a program: its manual page cannot be made from its declarations",
                        path));
    }
    const auto plugin = plugins.open(name, {}, diagnostics);
    Page page;
    std::string problem = plugin ? "" : "it cannot be opened";
    if (!plugin || !gather(*plugin->component, page, problem)) {
        return fail(options, fmt::format("'{}' has no manual page: {}", path, problem));
    }
    if (mode == view) return show(page, temporary);
    const bool is_adoc = mode == asciidoc;
    const std::string default_output = name + (is_adoc ? ".adoc" : ".9");
    const std::string& output = options.output.empty() ? default_output : options.output;
    problem = write_file(output, is_adoc ? as_asciidoc(page) : as_man(page));
    return problem.empty() ? 0 : fail(options, problem);
}

int carry_out(Mode mode, CompileOptions options, const std::string& path) {
    if (mode == preprocess) return to_c(options, path);
    if (mode == document || mode == asciidoc || mode == view) return to_page(mode, options, path);
    options.output = mode == compile ? "." : "";
    return compile_file(options, path);
}

bool is_count(const char* text) {
    char* end = nullptr;
    const long number = std::strtol(text, &end, 10);
    return *text != '\0' && *end == '\0' && number >= 1;
}

void append_split(std::vector<std::string>& to, const char* text) {
    const auto given = split_words(text);
    to.insert(to.end(), given.begin(), given.end());
}

// Options without a letter, as getopt_long returns them.
enum LongOption { compile_args = 1000, link_args, print_modinc, adoc, view_doc, install_doc };

constexpr const char* short_options = "pcido:uP:Uh";
constexpr option long_options[] = {{"preprocess", no_argument, nullptr, 'p'},
                                   {"compile", no_argument, nullptr, 'c'},
                                   {"install", no_argument, nullptr, 'i'},
                                   {"document", no_argument, nullptr, 'd'},
                                   {"adoc", no_argument, nullptr, adoc},
                                   {"view-doc", no_argument, nullptr, view_doc},
                                   {"install-doc", no_argument, nullptr, install_doc},
                                   {"outfile", required_argument, nullptr, 'o'},
                                   {"userspace", no_argument, nullptr, 'u'},
                                   {"personalities", required_argument, nullptr, 'P'},
                                   {"extra-compile-args", required_argument, nullptr, compile_args},
                                   {"extra-link-args", required_argument, nullptr, link_args},
                                   {"unix", no_argument, nullptr, 'U'},
                                   {"print-modinc", no_argument, nullptr, print_modinc},
                                   {"help", no_argument, nullptr, 'h'},
                                   {nullptr, 0, nullptr, 0}};

/// Returns the mode that an option selects, if it is one of those.
std::optional<Mode> mode_of(int letter) {
    switch (letter) {
    case 'p': return preprocess;
    case 'c': return compile;
    case 'i': return install;
    case 'd': return document;
    case adoc: return asciidoc;
    case view_doc: return view;
    default: return std::nullopt;
    }
}

/// Parses the options before the files; getopt_long leaves the index of the first file in optind.
/// Returns the exit status when nothing remains to be done: after --help and an invalid option.
std::optional<int> parse_options(int argc, char** argv, Mode& mode, CompileOptions& options) {
    for (;;) {
        const int letter = ::getopt_long(argc, argv, short_options, long_options, nullptr);
        if (letter == -1) return std::nullopt;
        if (const std::optional<Mode> selected = mode_of(letter)) {
            mode = *selected;
            continue;
        }
        switch (letter) {
        case 'o': options.output = ::optarg; break;
        case 'u': options.as_program = true; break;
        case 'U': break;
        case 'P':
            if (is_count(::optarg)) break;
            return fail(options,
                        fmt::format("--personalities={}: write a number from 1", ::optarg));
        case compile_args: append_split(options.compile_args, ::optarg); break;
        case link_args: append_split(options.link_args, ::optarg); break;
        case print_modinc:
            return fail(
                options,
                "--print-modinc is for LinuxCNC's makefiles; build with --compile or --install");
        case install_doc:
            return fail(options,
                        "--install-doc is not needed: the page is in the plugin; --install it, "
                        "then type: hal doc NAME");
        case 'h': return exit_code(print(usage));
        default: return 1;  // getopt_long has printed the reason
        }
    }
}

}  // namespace

int halcompile(int argc, char** argv) {
    CompileOptions options;
    options.program = "halcompile";
    options.classic = true;
    Mode mode = preprocess;
    if (const std::optional<int> done = parse_options(argc, argv, mode, options)) return *done;
    options.words.assign(argv + ::optind, argv + argc);
    if (options.words.empty()) {
        return fail(options,
                    "missing file; type: halcompile --install FILE.comp; --help lists the options");
    }
    if (!options.output.empty() && (mode == compile || mode == install || mode == view)) {
        return fail(options,
                    "-o is for --preprocess, --document and --adoc; to build into another folder: "
                    "hal compile --output DIR FILE");
    }
    if (!options.output.empty() && options.words.size() > 1) {
        return fail(options, "-o takes one file");
    }
    int worst = 0;
    for (const std::string& path : options.words) {
        worst = std::max(worst, carry_out(mode, options, path));
    }
    return worst;
}

}  // namespace hal::tools
