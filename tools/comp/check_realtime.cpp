// SPDX-License-Identifier: MIT
// The guard is a host of the component interface of its own, in C: it is compiled with the user's
// compiler, so that nothing has to be installed for it, and stands before the C library in a
// process that may crash or hang.
#include "comp/check_realtime.hpp"

#include <algorithm>
#include <filesystem>
#include <fmt/core.h>
#include <sstream>
#include <sys/wait.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "comp/toolchain.hpp"

namespace hal::tools {

int check_realtime(const Options& options, const BuiltPlugin& built, Language language) {
    std::string problem, source;
    const std::string compiler = find_compiler(language, problem);
    if (compiler.empty()) return fail(options, problem);
    const std::vector<std::string> headers = sdk_includes();
    for (const std::string& folder : headers) {
        if (std::error_code none;
            std::filesystem::is_regular_file(folder + "/check/realtime.c", none)) {
            source = folder + "/check/realtime.c";
        }
    }
    if (source.empty()) {
        return fail(options,
                    "missing check/realtime.c beside Halcyon's headers; reinstall Halcyon");
    }
    const TemporaryFolder temporary;
    if (!temporary.problem().empty()) return fail(options, temporary.problem());
    std::vector<std::string> words = split_words(compiler);
    words.insert(words.end(), {"-x", "c", "-std=gnu17", "-O2", "-fno-builtin", "-rdynamic"});
    for (const std::string& folder : headers) {
        words.insert(words.end(), {"-I", folder});
    }
    words.insert(words.end(),
                 {source, "-o", temporary.file("realtime"), "-ldl", "-lm", "-pthread"});
    std::string said;
    if (run_program(words, said) != 0) {
        write_all(STDERR_FILENO, said);

        return fail(options, "the real-time check program does not compile");
    }

    std::vector<std::string> run{temporary.file("realtime"),
                                 std::filesystem::absolute(built.path).string()};
    run.insert(run.end(), options.arguments.begin(), options.arguments.end());
    std::string report;
    const int status = run_program(run, report);
    std::istringstream lines(report);
    std::string line, rejected, start;
    int found = 0;
    for (; std::getline(lines, line);) {
        if (line.starts_with("rejected: ")) {
            rejected = line.substr(10);
        } else if (line.starts_with("start fails: ")) {
            start = line.substr(13);
        } else if (line.starts_with("outside: ")) {
            found += fail(options, fmt::format("{}: {}", built.name, line.substr(9)));
        } else if (line.starts_with("function '")) {
            found += fail(options, fmt::format("{}: {}", built.name, line));
        } else if (line.ends_with("extreme values")) {
            print(fmt::format("real time: {}, no violation\n", line));
        }
    }
    if (!start.empty()) {
        return fail(options,
                    fmt::format("{}: start() failed, so its functions were not checked: {}",
                                built.name, start));
    }
    if (!rejected.empty()) {
        return fail(
            options,
            fmt::format(
                "{} cannot be checked: its constructor fails: {}; load arguments go behind --",
                built.name, rejected));
    }
    if (found == 0 && !(WIFEXITED(status) && WEXITSTATUS(status) == 0)) {
        return fail(options,
                    WIFSIGNALED(status)
                        ? fmt::format("{} cannot be checked: the check was terminated by signal {}",
                                      built.name, WTERMSIG(status))
                        : fmt::format("{} cannot be checked: the check ended with status {}",
                                      built.name, WEXITSTATUS(status)));
    }
    return exit_code(found == 0);
}

}  // namespace hal::tools
