// SPDX-License-Identifier: MIT
#include "cli/output.hpp"

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

#include "cli/standard_streams.hpp"
#include "hal/read_file.hpp"
#include "hal/replace_file.hpp"
#include "text/typed_command.hpp"

namespace hal::tools {
namespace {
bool output_lost = false;
}  // namespace

bool write_all(int descriptor, std::string_view text) {
    return hal::detail::write_whole(descriptor, text);
}

int fail(const Options& options, std::string_view sentence) {
    write_all(STDERR_FILENO, options.program + ": " + as_typed(sentence) + "\n");
    return 1;
}

bool print(std::string_view text) {
    if (write_all(STDOUT_FILENO, text)) return true;
    if (errno != EPIPE && !std::exchange(output_lost, true) && std::ferror(stdout) == 0) {
        write_all(STDERR_FILENO, std::string("hal: cannot write to standard output: ") +
                                     std::strerror(errno) + "\n");
    }
    return false;
}

bool print_failed() { return output_lost; }

void open_standard_streams() {
    for (int file = ::open("/dev/null", O_RDWR); file >= 0; file = ::open("/dev/null", O_RDWR)) {
        if (file > STDERR_FILENO) {
            ::close(file);
            return;
        }
    }
}

bool read_file(const std::string& path, std::string& text) {
    return read_regular_file(path == "-" ? "/dev/stdin" : path, std::size_t{1} << 30, text, true);
}

std::string write_file(const std::string& path, std::string_view text) {
    const std::string why = replace_file(path, text);
    return why.empty() ? "" : "cannot write '" + path + "': " + why;
}

bool colours(int descriptor) {
    const char* no = std::getenv("NO_COLOR");
    const char* term = std::getenv("TERM");
    return (!no || !*no) && ::isatty(descriptor) && term && std::strcmp(term, "dumb") != 0;
}

}  // namespace hal::tools
