// SPDX-License-Identifier: MIT
// The active process of a re-execution with keyframes: it moves the machine through its cycles, and
// reads it.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "journal/keyframes.hpp"
#include "run/replayed_machine.hpp"
#include "run/stop_rule.hpp"

namespace hal::tools {

/// What the front of a replay shell asks for. Plain memory: it passes from process to process.
struct Errand {
    enum class Kind : std::uint8_t {
        run,  ///< forward until `condition` begins to hold, or to the end
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
    };
    Kind kind = Kind::where;
    std::uint64_t count = 0;
    std::uint64_t limit = 0;
    std::int64_t time_ns = 0;
    int status = 0;  ///< exit status so far
    char thread[256] = "";
    char condition[512] = "";
    char text[2048] = "";
};

/// [setup]
class ReplayedMoment {
public:
    /// `socket`: of the front. All others outlive it.
    ReplayedMoment(const ReplayOptions& options, JournalFile& file, Keyframes& frames,
                   const WhatIf& change, int socket);

    /// Answers the front until it ends. Does not return: a copy has not the threads that a
    /// destructor would wait for.
    [[noreturn]] void serve();

private:
    bool receive(Errand& errand);
    void carry_out(Errand errand);
    void run(const ValueCondition& condition);
    void step(std::uint64_t count, const std::string& thread);
    void seek(std::uint64_t cycles, const std::string& condition = "");
    void search(const Errand& errand);
    void go_to(const Errand& errand);
    void complete(const Errand& errand);
    void check(const ValueCondition& condition);
    void scope(Errand errand);
    void draw(const Errand& errand);
    int execute(const std::string& line);
    bool next();
    void keep();
    void resume(const Errand& errand, std::uint64_t max_cycles);
    KeyframeMark mark() const;
    std::uint64_t cycles() const { return machine_.execution().cycles(); }
    void tell(const std::string& found = "");
    std::string state_text();
    void answer(int status, const std::string& text = "");

    const ReplayOptions& options_;
    Keyframes& frames_;
    const int socket_;
    ReplayedMachine machine_;
    std::uint64_t fastest_number_ = 0;  // newest cycle of the fastest thread
    std::int64_t max_time_ns_ = 0;
    std::chrono::steady_clock::time_point kept_{};
    std::chrono::nanoseconds spacing_;  // of keyframes, in time of execution
    bool resumed_ = false;  // this process continues from a keyframe: it has another errand
    bool interrupted_ = false;
    int status_ = 0;  // of the errand, so far
};

}  // namespace hal::tools
