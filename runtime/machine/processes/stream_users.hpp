// SPDX-License-Identifier: MIT
// Who reads and who feeds the FIFO of a sampler, a streamer or a program. Each end is one process's:
// two readers would take each other's records, two feeders would interleave theirs.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

namespace hal {

/// The users of the streams of a session. All members need the session's lock. [setup]
class StreamUsers {
public:
    enum class End { reads, feeds };

    /// Makes a connection the user of one end of a stream until release(), and returns an empty
    /// string; or why it cannot be: another living process is. Connections of one process share an
    /// end.
    std::string claim(std::string_view stream, End end, std::uint64_t owner, pid_t process);
    /// A connection has ended. Its process keeps an end that another connection of it uses.
    void release(std::uint64_t owner);

private:
    struct User {
        std::string stream;
        End end = End::reads;
        std::vector<std::uint64_t> owners;  ///< connections of `process`
        pid_t process = 0;  ///< 0 or less: unknown
    };

    std::vector<User> users_;
};

}  // namespace hal
