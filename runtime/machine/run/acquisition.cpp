// SPDX-License-Identifier: MIT
#include "machine/run/acquisition.hpp"

#include <cstdlib>
#include <filesystem>
#include <system_error>

#include <sys/socket.h>

#include "machine/report/journaled_calls.hpp"

namespace hal {
namespace {

std::map<std::string, std::string> open_files() {
    std::map<std::string, std::string> found;
    std::error_code failed;
    for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", failed)) {
        const std::filesystem::path target = std::filesystem::read_symlink(entry.path(), failed);
        if (failed) continue;  // the one that reads this folder
        found[entry.path().filename().string()] = target.string();
    }
    return found;
}

/// A client of the control socket may connect at any time; the kernel's own files are for threads,
/// which are counted.
bool is_of_the_process(const std::string& number, const std::string& target) {
    if (target.starts_with("/proc/") || target.starts_with("anon_inode:")) return true;
    int domain = 0;
    socklen_t size = sizeof domain;
    const int descriptor = std::atoi(number.c_str());
    return target.starts_with("socket:") &&
           ::getsockopt(descriptor, SOL_SOCKET, SO_DOMAIN, &domain, &size) == 0 &&
           domain == AF_UNIX;
}

}  // namespace

Acquisition::Acquisition() : files_(open_files()), threads_(threads_of_components()) {}

OutsideWorld Acquisition::result() const {
    OutsideWorld found;
    for (const auto& [number, target] : open_files()) {
        const auto before = files_.find(number);
        const bool is_new = before == files_.end() || before->second != target;
        if (is_new && !is_of_the_process(number, target)) {
            found.files.push_back(target);
        }
    }
    found.threads = threads_of_components() - threads_;
    return found;
}

}  // namespace hal
