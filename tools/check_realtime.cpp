// SPDX-License-Identifier: MIT
// The guard is a host of the component interface of its own, in C: it is compiled with the user's compiler, so that nothing has to
// be installed for it, and stands before the C library in a process that may crash or hang.
#include "check_realtime.hpp"

#include <algorithm>
#include <filesystem>
#include <fmt/core.h>
#include <sstream>
#include <sys/wait.h>
#include <unistd.h>

#include "say.hpp"
#include "workshop.hpp"

namespace hal::tools {

int check_realtime(const Options& options, const BuiltPlugin& built, Language language) {
    std::string problem, source;
    const std::string compiler = find_compiler(language, problem);
    if (compiler.empty()) return fail(options, problem);
    const std::vector<std::string> headers = sdk_includes();
    for (const std::string& folder : headers)
        if (std::error_code none; std::filesystem::is_regular_file(folder + "/check/realtime.c", none))
            source = folder + "/check/realtime.c";
    if (source.empty())
        return fail(options, "what --check-rt runs (check/realtime.c) is not installed with Halcyon's headers; install it again");
    const Workshop workshop;
    if (!workshop.problem().empty()) return fail(options, workshop.problem());
    std::vector<std::string> words = split_words(compiler);
    words.insert(words.end(), {"-x", "c", "-std=gnu17", "-O2", "-fno-builtin", "-rdynamic"});
    for (const std::string& folder : headers) words.insert(words.end(), {"-I", folder});
    words.insert(words.end(), {source, "-o", workshop.file("realtime"), "-ldl", "-lm", "-pthread"});
    std::string said;
    if (run_program(words, said) != 0)
        return write_all(STDERR_FILENO, said), fail(options, "the program that checks real time does not compile");

    std::vector<std::string> run{workshop.file("realtime"), std::filesystem::absolute(built.path).string()};
    run.insert(run.end(), options.arguments.begin(), options.arguments.end());
    std::string report;
    const int status = run_program(run, report);
    std::istringstream lines(report);
    std::string line, refused;
    int found = 0;
    for (; std::getline(lines, line);) {
        if (line.starts_with("refused: ")) refused = line.substr(9);
        else if (line.starts_with("function '")) found += fail(options, fmt::format("{}: {}", built.name, line));
        else if (line.ends_with("extreme values")) print(fmt::format("real time: {}, no violation\n", line));
    }
    if (!refused.empty())
        return fail(options, fmt::format("{} cannot be checked without load arguments: {}; put them behind --", built.name, refused));
    if (found == 0 && !(WIFEXITED(status) && WEXITSTATUS(status) == 0))
        return fail(options, fmt::format("{} crashes outside its functions, so nothing is known", built.name));
    return found == 0 ? 0 : 1;
}

}  // namespace hal::tools
