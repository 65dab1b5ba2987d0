// SPDX-License-Identifier: MIT
#include "say.hpp"

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace hal::tools {

bool write_all(int descriptor, std::string_view text) {
    while (!text.empty()) {
        const ssize_t n = ::write(descriptor, text.data(), text.size());
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) return false;
        text.remove_prefix(static_cast<std::size_t>(n));
    }
    return true;
}

int fail(const Options& options, std::string_view sentence) {
    write_all(STDERR_FILENO, options.program + ": " + std::string(sentence) + "\n");
    return 1;
}

bool print(std::string_view text) {
    if (write_all(STDOUT_FILENO, text)) return true;
    static bool said = false;
    if (errno != EPIPE && !said)
        write_all(STDERR_FILENO, std::string("hal: cannot write to standard output: ") + std::strerror(errno) + "\n");
    said = true;
    return false;
}

bool read_file(const std::string& path, std::string& text) {
    const bool standard = path == "-";
    const int descriptor = standard ? STDIN_FILENO : ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    struct stat about{};
    int problem = 0;
    if (descriptor < 0 || ::fstat(descriptor, &about) != 0) problem = errno;
    else if (S_ISDIR(about.st_mode)) problem = EISDIR;
    text.clear();
    char block[65536];
    while (problem == 0) {
        const ssize_t n = ::read(descriptor, block, sizeof block);
        if (n == 0) break;
        if (n > 0) text.append(block, static_cast<std::size_t>(n));
        else if (errno != EINTR) problem = errno;
    }
    if (descriptor >= 0 && !standard) ::close(descriptor);
    if (problem == 0) return true;
    text = std::strerror(problem);
    return false;
}

std::string write_file(const std::string& path, std::string_view text) {
    const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    const bool good = descriptor >= 0 && write_all(descriptor, text);
    const int why = errno;
    if (descriptor >= 0) ::close(descriptor);
    return good ? "" : "cannot write '" + path + "': " + std::strerror(why);
}

bool colours(int descriptor) {
    const char* no = std::getenv("NO_COLOR");
    const char* term = std::getenv("TERM");
    return (!no || !*no) && ::isatty(descriptor) && term && std::strcmp(term, "dumb") != 0;
}

}  // namespace hal::tools
