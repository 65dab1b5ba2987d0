// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

#include "cli/output.hpp"

namespace hal::tools {

/// The history of the shell: a line per command, in the user's state folder, appended to at once,
/// so that several shells share it.
class HistoryFile {
public:
    static constexpr std::size_t max = 2000;

    std::vector<std::string> load() {
        namespace fs = std::filesystem;
        const char* state = std::getenv("XDG_STATE_HOME");
        const char* home = std::getenv("HOME");
        if ((!state || !*state) && (!home || !*home)) {
            return {};
        }
        const fs::path folder =
            (state && *state ? fs::path(state) : fs::path(home) / ".local/state") / "halcyon";
        std::error_code problem;
        fs::create_directories(folder, problem);
        if (problem) {
            return {};
        }
        path_ = folder / "history";
        std::vector<std::string> lines;
        std::ifstream file(path_);
        for (std::string line; std::getline(file, line);) {
            lines.push_back(line);
        }
        if (lines.size() > 2 * max) {
            lines.erase(lines.begin(), lines.end() - static_cast<std::ptrdiff_t>(max));
            std::string all;
            for (const auto& line : lines) {
                all += line + "\n";
            }
            const fs::path fresh = path_.string() + "." + std::to_string(::getpid());
            if (store(fresh, O_TRUNC, all)) {
                fs::rename(fresh, path_, problem);
            }
        }
        return lines;
    }
    void append(const std::string& line) const {
        if (!path_.empty()) {
            store(path_, O_APPEND, line + "\n");
        }
    }

private:
    static bool store(const std::filesystem::path& path, int how, const std::string& text) {
        const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | how, 0600);
        if (descriptor < 0) return false;
        const bool good = write_all(descriptor, text);
        ::close(descriptor);
        return good;
    }
    std::filesystem::path path_;
};

}  // namespace hal::tools
