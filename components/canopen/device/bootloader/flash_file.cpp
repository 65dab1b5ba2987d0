// SPDX-License-Identifier: MIT
#include "flash_file.hpp"

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <unistd.h>

#include "hal/replace_file.hpp"

namespace hal::canopen {

namespace {
struct Close {
    void operator()(std::FILE* f) const noexcept { std::fclose(f); }
};
using File = std::unique_ptr<std::FILE, Close>;
std::string problem(const char* what, const std::string& path) {
    return std::string(what) + " '" + path + "': " + std::strerror(errno);
}
}  // namespace

std::string read_flash(const std::string& path, std::size_t max,
                       std::optional<std::vector<std::uint8_t>>& image) {
    image.reset();
    errno = 0;
    const File file(std::fopen(path.c_str(), "rbe"));
    if (!file && errno == ENOENT) {  // created later, with the first image; that needs its folder
        const auto slash = path.rfind('/');
        const auto folder = path.substr(0, slash == std::string::npos ? 0 : slash);
        if (folder.empty() || ::access(folder.c_str(), F_OK) == 0) {
            return {};
        }
        return "cannot create '" + path + "': missing folder; type: mkdir -p " + folder;
    }
    if (!file) return problem("cannot read", path);
    std::vector<std::uint8_t> buffer(max + 1);
    const auto size = std::fread(buffer.data(), 1, buffer.size(), file.get());
    if (std::ferror(file.get()) != 0) return problem("cannot read", path);
    if (size > max) {
        return "'" + path + "' is longer than the flash of " + std::to_string(max) + " bytes";
    }
    buffer.resize(size);
    image = std::move(buffer);
    return {};
}

std::string write_flash(const std::string& path, std::span<const std::uint8_t> image) {
    const std::string why =
        replace_file(path, {reinterpret_cast<const char*>(image.data()), image.size()});
    return why.empty() ? "" : "cannot write '" + path + "': " + why;
}

}  // namespace hal::canopen
