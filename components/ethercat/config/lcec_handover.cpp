// SPDX-License-Identifier: MIT
#include "ethercat/config/lcec_handover.hpp"

#include <cerrno>
#include <cstdlib>
#include <filesystem>

#include <signal.h>
#include <unistd.h>

#include "hal/read_file.hpp"
#include "hal/replace_file.hpp"

namespace hal::ethercat::config {

namespace {

/// The folder of the control sockets.
std::string folder() {
    const char* const runtime = std::getenv("XDG_RUNTIME_DIR");
    return runtime != nullptr && runtime[0] == '/' ? std::string(runtime) + "/halcyon"
                                                   : "/tmp/halcyon-" + std::to_string(getuid());
}

std::string file_of(long machine) { return folder() + "/lcec-" + std::to_string(machine); }

}  // namespace

LcecHandover::LcecHandover(long machine, const std::string& path) : file_(file_of(machine)) {
    std::error_code failed;
    const std::string full = std::filesystem::absolute(path, failed).lexically_normal().string();
    if (!failed) {
        problem_ = replace_file(file_, std::to_string(getpid()) + "\n" + full);
    } else {
        problem_ = failed.message();
    }
    if (!problem_.empty()) {
        problem_ = "cannot write '" + file_ + "': " + problem_;
    }
}

LcecHandover::~LcecHandover() {
    std::error_code none;
    std::filesystem::remove(file_, none);
}

std::string lcec_configuration(long machine) {
    std::string text;
    if (!read_regular_file(file_of(machine), 65536, text)) {
        return {};
    }
    char* end = nullptr;
    const long program = std::strtol(text.c_str(), &end, 10);
    const bool lives =
        program > 0 && (::kill(static_cast<pid_t>(program), 0) == 0 || errno == EPERM);
    return lives && *end == '\n' ? text.substr(static_cast<std::size_t>(end - text.c_str()) + 1)
                                 : std::string();
}

}  // namespace hal::ethercat::config
