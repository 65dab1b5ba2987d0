// SPDX-License-Identifier: MIT
// What the front of a replay asks of the process that executes its journal, and its answers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

namespace hal::tools {

/// What the front of a replay asks for. Plain memory: it passes from process to process.
struct Errand {
    enum class Kind : std::uint8_t {
        run,  ///< forward until `condition` begins to hold, or to the end
        run_to_fault,  ///< forward until a further fault is recorded, or to the end
        step,  ///< forward by `count` cycles, of `thread` only unless it is empty
        seek,  ///< to where `count` cycles have been executed
        search,  ///< back to the `count`-th last cycle before the cycle `limit` in which
        ///< `condition` begins to hold; without one, of `thread`
        back,  ///< the same, before the present cycle
        position,  ///< to `text`: a cycle or a time
        where,  ///< print the position
        check,  ///< report a missing name in `condition`
        command,  ///< execute `text` in the shell
        scope,  ///< draw the values of `text` around the present cycle
        draw,  ///< the same around `time_ns`, and go to where `limit` cycles have been executed
        complete,  ///< answer the candidates for `text` at byte `count`
        request,  ///< answer a request of the control protocol: `count` bytes in further packets
        samples,  ///< answer rows of the values of `text` around the present cycle
        sample,  ///< the same around `time_ns`, and go to where `limit` cycles have been executed
    };
    Kind kind = Kind::where;
    std::uint64_t count = 0;
    std::uint64_t limit = 0;
    std::int64_t time_ns = 0;
    std::int64_t before_ns = 0;  ///< of `samples` and `sample`
    std::int64_t after_ns = 0;
    std::uint64_t frontier = 0;  ///< cycles of which the front has all marks
    int status = 0;  ///< exit status so far
    bool json = false;  ///< of a request: the client has chosen --json
    bool marks = false;  ///< the front has a time line
    char thread[256] = "";
    char condition[512] = "";
    char text[2048] = "";
};

/// Returns false when the text does not fit.
template <std::size_t size>
bool store(char (&to)[size], const std::string& text) {
    if (text.size() >= size) return false;
    std::memcpy(to, text.c_str(), text.size() + 1);
    return true;
}

/// The first byte of a packet to the front.
enum class Packet : char {
    text = 't',  ///< to be printed
    data = 'd',  ///< a part of the answer
    now = 'n',  ///< where the machine is, as JSON
    mark = 'm',  ///< what happened in a cycle that was executed for the first time, as JSON
    end = 'e',  ///< the errand is done; the exit status follows
};

inline constexpr std::size_t max_packet = std::size_t{1} << 16;

}  // namespace hal::tools
