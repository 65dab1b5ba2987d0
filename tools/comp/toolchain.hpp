// SPDX-License-Identifier: MIT
// Running a compiler: a folder for its files, its command line, its output.
#pragma once

#include <string>
#include <string_view>
#include <sys/types.h>
#include <vector>

namespace hal::tools {

/// A new folder, removed with the object.
class TemporaryFolder {
public:
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    /// why there is no folder; empty: there is
    const std::string& problem() const { return problem_; }
    std::string file(std::string_view name) const { return path_ + "/" + std::string(name); }
    const std::string& path() const { return path_; }

private:
    std::string path_, problem_;
};

std::vector<std::string> split_words(const std::string& text);

/// Runs a program; its output and errors together. Returns its wait status, -1 when there is no
/// process.
int run_program(const std::vector<std::string>& words, std::string& output);

/// Takes everything a child writes to `descriptor`, closes that, and waits for the child's end.
/// Returns its wait status.
int finish_program(pid_t child, int descriptor, std::string& output);

}  // namespace hal::tools
