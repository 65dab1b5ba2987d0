// SPDX-License-Identifier: MIT
// What a guardian did after the end of its machine, for the next start. [setup]
#pragma once

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <system_error>

#include "hal/read_file.hpp"
#include "link/system.hpp"

namespace hal::bus {

/// Returns the file in which a guardian of a link leaves what it did; empty: there is no folder for
/// it. Creates the folder.
inline std::string report_file(const std::string& link) {
    namespace fs = std::filesystem;
    const char* const state = std::getenv("XDG_STATE_HOME");
    const char* const home = std::getenv("HOME");
    fs::path folder;
    if (state != nullptr && state[0] == '/') {
        folder = state;
    } else if (home != nullptr && home[0] == '/') {
        folder = fs::path(home) / ".local/state";
    } else {
        return {};
    }
    folder /= "halcyon";
    std::error_code none;
    fs::create_directories(folder, none);
    std::string name = "guardian-" + link;
    std::replace_if(name.begin(), name.end(),
                    [](char c) { return c == '/' || c == ':' || c == '?' || c == '&'; }, '-');
    return (folder / name).string();
}

/// Returns the content of the file and deletes it.
inline std::string take_report(const std::string& file) {
    std::string text;
    if (file.empty() || !read_regular_file(file, 4096, text)) return {};
    ::unlink(file.c_str());
    while (!text.empty() && text.back() == '\n') {
        text.pop_back();
    }
    return text;
}

/// Writes the file; an empty name: nothing.
inline void keep_report(const char* file, const std::string& text) {
    if (file[0] == '\0') return;
    const link::Descriptor fd(
        ::open(file, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600));
    if (fd) {
        dprintf(fd.get(), "%s\n", text.c_str());
    }
}

/// Returns "2026-11-28 12:00:00, ".
inline std::string report_time() {
    char text[32];
    const time_t seconds = time(nullptr);
    tm local{};
    localtime_r(&seconds, &local);
    strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S, ", &local);
    return text;
}

}  // namespace hal::bus
