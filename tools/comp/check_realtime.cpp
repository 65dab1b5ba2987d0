// SPDX-License-Identifier: MIT
// The guard is a host of the component interface of its own, in C: it is compiled with the user's
// compiler, so that nothing has to be installed for it, and stands before the C library in a
// process that may crash or hang.
#include "comp/check_realtime.hpp"

#include <filesystem>
#include <fmt/core.h>
#include <sstream>
#include <string_view>
#include <sys/wait.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "comp/toolchain.hpp"

namespace hal::tools {

namespace {

/// Compiles the guard into `program`. Returns why that failed, "" when it did not.
std::string compile_guard(Language language, const std::string& program) {
    std::string problem;
    const std::string compiler = find_compiler(language, problem);
    if (compiler.empty()) return problem;
    std::string source;
    const std::vector<std::string> headers = sdk_includes();
    for (const std::string& folder : headers) {
        std::error_code none;
        if (std::filesystem::is_regular_file(folder + "/check/realtime.c", none)) {
            source = folder + "/check/realtime.c";
        }
    }
    if (source.empty()) {
        return "missing check/realtime.c beside Halcyon's headers; reinstall Halcyon";
    }
    std::vector<std::string> words = split_words(compiler);
    words.insert(words.end(), {"-x", "c", "-std=gnu17", "-O2", "-fno-builtin", "-rdynamic"});
    for (const std::string& folder : headers) {
        words.insert(words.end(), {"-I", folder});
    }
    words.insert(words.end(), {source, "-o", program, "-ldl", "-lm", "-pthread"});
    std::string said;
    if (run_program(words, said) == 0) return "";
    write_all(STDERR_FILENO, said);
    return "the real-time check program does not compile";
}

std::string after(const std::string& line, std::string_view prefix) {
    return line.substr(prefix.size());
}

/// Returns " (FILE:LINE)", the innermost line of the user's file among the addresses in a plugin;
/// empty when its file is not among them, or addr2line is missing.
std::string place_of(const std::string& addresses, const std::string& plugin,
                     const std::string& file) {
    std::vector<std::string> words{"addr2line", "--inlines", "--exe", plugin};
    for (std::string& address : split_words(addresses)) {
        words.push_back(std::move(address));
    }
    std::string found;
    if (run_program(words, found) != 0) return "";
    std::istringstream lines(found);
    for (std::string line; std::getline(lines, line);) {
        const auto colon = line.rfind(':');
        std::error_code none;
        if (colon == line.npos || !std::filesystem::equivalent(line.substr(0, colon), file, none)) {
            continue;
        }
        const std::string number = line.substr(colon + 1);
        return fmt::format(" ({}:{})", file, number.substr(0, number.find(' ')));
    }
    return "";
}

/// How a guard ended that named no violation; "" when it ended in order.
std::string end_of_guard(int status) {
    if (WIFSIGNALED(status)) {
        return fmt::format("the check was terminated by signal {}", WTERMSIG(status));
    }
    const int code = WEXITSTATUS(status);
    return code == 0 ? "" : fmt::format("the check ended with status {}", code);
}

}  // namespace

RealtimeReport check_realtime(const Options& options, const BuiltPlugin& built,
                              const PluginSource& source) {
    constexpr std::string_view rejected = "rejected: ";
    constexpr std::string_view start_fails = "start fails: ";
    constexpr std::string_view outside = "outside: ";
    constexpr std::string_view callers = "callers:";
    RealtimeReport report;
    const TemporaryFolder temporary;
    report.unchecked = temporary.problem();
    if (!report.unchecked.empty()) return report;
    const std::string program = temporary.file("realtime");
    report.unchecked = compile_guard(source.language, program);
    if (!report.unchecked.empty()) return report;

    std::vector<std::string> run{program, std::filesystem::absolute(built.path).string()};
    run.insert(run.end(), options.arguments.begin(), options.arguments.end());
    std::string printed;
    const int status = run_program(run, printed);
    std::istringstream lines(printed);
    for (std::string line; std::getline(lines, line);) {
        if (line.starts_with(rejected)) {
            report.unchecked = fmt::format(
                "{} cannot be checked: its constructor fails: {}; load arguments go "
                "behind --",
                built.name, after(line, rejected));
        } else if (line.starts_with(start_fails)) {
            report.unchecked =
                fmt::format("{}: start() failed, so its functions were not checked: {}", built.name,
                            after(line, start_fails));
        } else if (line.starts_with(outside)) {
            report.violations.push_back(fmt::format("{}: {}", built.name, after(line, outside)));
        } else if (line.starts_with("function '")) {
            report.violations.push_back(fmt::format("{}: {}", built.name, line));
        } else if (line.starts_with(callers) && !report.violations.empty()) {
            report.violations.back() += place_of(after(line, callers), built.path, source.path);
        } else if (line.ends_with("extreme values")) {
            report.summary = line;
        }
    }
    if (!report.good()) return report;
    if (const std::string end = end_of_guard(status); !end.empty()) {
        report.unchecked = fmt::format("{} cannot be checked: {}", built.name, end);
    }
    return report;
}

}  // namespace hal::tools
