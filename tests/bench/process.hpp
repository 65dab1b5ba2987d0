// SPDX-License-Identifier: MIT
// Other programs: run to the end, or talked to.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <sys/types.h>
#include <vector>

namespace hal::bench {

/// Its path, looked for in PATH and in /usr/sbin; empty when it is not installed.
std::string find_program(const std::string& name);

struct Start {
    std::vector<std::string> arguments;          ///< the program first
    std::vector<std::string> environment = {};   ///< "NAME=value", in addition to this process's
    uid_t user = static_cast<uid_t>(-1);         ///< run as that user; -1: as this process's
    bool everywhere = false;  ///< on all CPUs, also the one the bench stays off
};

struct Finished {
    /// exit status; 128 + signal; -1: it could not be started or was stopped after `max_ms`
    int status = -1;
    double ms = 0;  ///< wall time
    std::string out;  ///< its standard output
};

/// Runs a program to its end. Its standard error is thrown away.
Finished run(const Start& start, double max_ms = 60'000);

/// A program that runs beside us; ended with its owner.
class Child {
public:
    /// With `talk` its standard input and output are pipes to us, else /dev/null.
    explicit Child(const Start& start, bool talk = false);
    ~Child();
    Child(const Child&) = delete;
    bool alive();
    pid_t pid() const { return pid_; }
    void write(const std::string& text);
    /// The next line of its output without its end, or nothing after `max_ms`.
    std::optional<std::string> line(int max_ms = 2000);
    /// SIGTERM, and SIGKILL two seconds later.
    void end();

private:
    pid_t pid_ = -1;
    int in_ = -1;
    int out_ = -1;
    std::string read_;
};

/// A Python with these packages, as in "can, canopen": the one that HALCYON_PYTHON names, else
/// python3, else the one in build/peers, where `./hal test` installs them; empty when it has not.
std::string find_python(const std::string& packages);

/// A folder below the system's temporary one that everybody may enter, removed with its owner.
class TemporaryFolder {
public:
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    const std::string& path() const { return path_; }
    /// Writes a file into it and returns the file's path.
    std::string file(const std::string& name, const std::string& text) const;

private:
    std::string path_;
};

}  // namespace hal::bench
