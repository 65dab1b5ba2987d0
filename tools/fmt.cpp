// SPDX-License-Identifier: MIT
// `hal fmt`: netlists with aligned columns, in place.
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/diagnostic.hpp"
#include "netlist/netlist.hpp"
#include "options.hpp"
#include "say.hpp"

namespace hal::tools {

namespace {

/// Replaces a file's text at once or not at all, with the same permissions. The reason of a failure, or empty.
std::string replace_file(const std::string& path, std::string_view text) {
    std::error_code problem;
    const std::string target = std::filesystem::canonical(path, problem).string();  // a link stays a link
    if (problem) return problem.message();
    struct stat about{};
    if (::stat(target.c_str(), &about) != 0) return std::strerror(errno);
    std::string fresh = target + ".XXXXXX";
    const int descriptor = ::mkostemp(fresh.data(), O_CLOEXEC);
    if (descriptor < 0) return std::strerror(errno);
    const bool good = write_all(descriptor, text) && ::fchmod(descriptor, about.st_mode & 07777) == 0 && ::fsync(descriptor) == 0 &&
                      std::rename(fresh.c_str(), target.c_str()) == 0;
    const int why = errno;
    ::close(descriptor);
    if (good) return {};
    ::unlink(fresh.c_str());
    return std::strerror(why);
}

}  // namespace

int run_fmt(const Options& options) {
    int status = 0;
    for (const std::string& path : options.words) {
        std::string text;
        if (!read_file(path, text)) {
            status = fail(options, fmt::format("cannot read '{}': {}", path, text));
            continue;
        }
        Sources sources;
        Diagnostics diagnostics;
        const std::uint32_t source = sources.add(path == "-" ? "<stdin>" : path, text);
        const std::string formatted = format(sources, source, diagnostics);
        if (diagnostics.failed()) {
            write_all(STDERR_FILENO, render(diagnostics, sources, colours(STDERR_FILENO)));
            status = 1;
        } else if (options.check) {
            if (formatted != text) status = fail(options, fmt::format("'{0}' is not formatted; type: hal fmt {0}", path));
        } else if (path == "-") {
            if (!print(formatted)) status = 1;
        } else if (formatted != text) {
            if (const std::string why = replace_file(path, formatted); !why.empty())
                status = fail(options, fmt::format("cannot write '{}': {}", path, why));
        }
    }
    return status;
}

}  // namespace hal::tools
