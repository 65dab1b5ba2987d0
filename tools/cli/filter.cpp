// SPDX-License-Identifier: MIT
#include "cli/filter.hpp"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <fmt/core.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "cli/output.hpp"

extern char** environ;

namespace hal::tools {

std::string run_filter(const std::vector<const char*>& arguments, std::string_view input,
                       std::string& output, const char* package) {
    output.clear();
    int in[2], out[2];
    if (::pipe2(in, O_CLOEXEC) != 0) return std::strerror(errno);
    if (::pipe2(out, O_CLOEXEC) != 0) {
        const int why = errno;
        ::close(in[0]);
        ::close(in[1]);
        return std::strerror(why);
    }
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_adddup2(&actions, in[0], STDIN_FILENO);
    ::posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
    std::vector<const char*> words = arguments;
    words.push_back(nullptr);
    pid_t process = 0;
    const int problem = ::posix_spawnp(&process, words[0], &actions, nullptr,
                                       const_cast<char* const*>(words.data()), environ);
    ::posix_spawn_file_actions_destroy(&actions);
    ::close(in[0]);
    ::close(out[1]);
    // it writes when it has read all; what goes wrong here is seen in the exit status
    if (problem == 0) {
        write_all(in[1], input);
    }
    ::close(in[1]);
    char block[65536];
    for (ssize_t n = 0; problem == 0 && ((n = ::read(out[0], block, sizeof block)) > 0 ||
                                         (n < 0 && errno == EINTR));) {
        if (n > 0) {
            output.append(block, static_cast<std::size_t>(n));
        }
    }
    ::close(out[0]);
    if (problem == ENOENT) {
        return fmt::format("cannot find the program {}; type: sudo apt install {}", words[0],
                           package);
    }
    if (problem != 0) {
        return fmt::format("cannot run {}: {}", words[0], std::strerror(problem));
    }
    int status = 0;
    while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {
    }
    return status == 0
               ? ""
               : fmt::format("{} failed with status {}", words[0],
                             WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status));
}

}  // namespace hal::tools
