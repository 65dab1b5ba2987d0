// SPDX-License-Identifier: MIT
#include "shell/files.hpp"

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace hal {
namespace {

constexpr std::size_t most_bytes = std::size_t{1} << 30;  // places in a text are 32-bit numbers

}  // namespace

bool read_text_file(const std::string& path, std::string& text, std::string& problem) {
    const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (file < 0) {
        problem = std::strerror(errno);
        return false;
    }
    struct stat about{};
    fstat(file, &about);
    if (S_ISREG(about.st_mode)) text.reserve(static_cast<std::size_t>(about.st_size));
    std::array<char, 65536> part;
    ssize_t got;
    while ((got = read(file, part.data(), part.size())) > 0 && text.size() <= most_bytes)
        text.append(part.data(), static_cast<std::size_t>(got));
    if (got < 0) problem = std::strerror(errno);
    else if (got > 0) problem = "more than 1 GiB";
    close(file);
    return got == 0;
}

std::string resolve_path(const std::string& path, const std::string& directory) {
    if (path == "~" || path.starts_with("~/")) {
        const char* const home = std::getenv("HOME");
        return (home ? home : "") + path.substr(1);
    }
    return path.starts_with('/') || directory.empty() ? path : directory + "/" + path;
}

std::string canonical_path(const std::string& path) {
    std::error_code problem;
    const auto found = std::filesystem::canonical(path, problem);
    return problem ? path : found.string();
}

std::string folder_of(const std::string& path) {
    const auto slash = path.rfind('/');
    return slash == path.npos ? "" : slash == 0 ? "/" : path.substr(0, slash);
}

}  // namespace hal
