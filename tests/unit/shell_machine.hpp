// SPDX-License-Identifier: MIT
// A session with its shell for tests, on the virtual clock: lines and texts in, what the user reads
// out.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include <unistd.h>

#include "commands/shell.hpp"
#include "machine/session.hpp"

namespace hal::test {

/// A folder of its own for one test; gone with it.
class Folder {
public:
    Folder() {
        std::string name =
            (std::filesystem::temp_directory_path() / "halcyon-test-XXXXXX").string();
        path = mkdtemp(name.data());
    }
    ~Folder() {
        std::error_code ignored;
        std::filesystem::remove_all(path, ignored);
    }
    Folder(const Folder&) = delete;
    std::string write(const std::string& name, const std::string& text) const {
        std::ofstream(path + "/" + name, std::ios::binary) << text;
        return path + "/" + name;
    }
    std::string read(const std::string& name) const {
        std::ifstream file(path + "/" + name, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }
    std::string path;
};

inline SessionOptions shell_session(const std::string& name = "test", bool virtual_clock = true,
                                    bool check_only = false) {
    SessionOptions options;
    options.name = name;
    options.virtual_clock = virtual_clock;
    options.check_only = check_only;
    return options;
}

class ShellMachine {
public:
    explicit ShellMachine(ShellOptions options = {},
                          SessionOptions session_options = shell_session())
        : session(std::move(session_options)), shell(session, std::move(options)) {}

    /// Executes one line as typed. Returns its status; its output is in out and err.
    int line(const std::string& text) {
        return keep([&](Output& output) { return shell.execute(text, output); });
    }
    int file(const std::string& text, const std::string& name = "test.hal") {
        return keep([&](Output& output) { return shell.run_text(name, text, output); });
    }
    int path(const std::string& path) {
        return keep([&](Output& output) { return shell.run_file(path, output); });
    }
    void must(const std::string& text) { ASSERT_EQ(file(text), 0) << err; }
    /// What a line prints on stdout.
    std::string says(const std::string& text) {
        EXPECT_EQ(line(text), 0) << text << "\n" << err;
        return out;
    }

    Session session;
    Shell shell;
    std::string out, err;

private:
    template <class Action>
    int keep(Action&& action) {
        TextOutput output;
        const int status = action(output);
        out = std::move(output.out_text);
        err = std::move(output.err_text);
        return status;
    }
};

}  // namespace hal::test
