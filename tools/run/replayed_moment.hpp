// SPDX-License-Identifier: MIT
// The active process of a re-execution with keyframes: it moves the machine through its cycles, and
// reads it.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "journal/keyframes.hpp"
#include "run/errand.hpp"
#include "run/replayed_machine.hpp"
#include "run/stop_rule.hpp"

namespace hal::tools {

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
    void carry_out(const Errand& errand);
    void move(Errand errand);
    void run(const ValueCondition& condition);
    void step(std::uint64_t count, const std::string& thread);
    void seek(std::uint64_t cycles, const std::string& condition = "");
    void search(const Errand& errand);
    void go_to(const Errand& errand);
    void complete(const Errand& errand);
    void check(const ValueCondition& condition);
    void scope(Errand errand);
    void draw(const Errand& errand);
    void run_to_fault();
    void request(const Errand& errand);
    void samples(Errand errand);
    void sample(const Errand& errand);
    int execute(const std::string& line);
    bool next();
    void keep();
    void resume(const Errand& errand, std::uint64_t max_cycles);
    KeyframeMark mark() const;
    std::uint64_t cycles() const { return machine_.execution().cycles(); }
    void tell(const std::string& found = "");
    std::uint64_t edits() const;
    std::string position_text() const;
    std::string state_text();
    void send(Packet kind, std::string_view text);
    void say(const std::string& text) { send(Packet::text, text); }
    void send_position(const std::string& text, bool is_moving);
    void send_progress();
    void note_marks(bool goes_on);
    void note_entries(bool is_sent);
    void note_switch(bool is_sent);
    void note_faults(bool is_sent);
    void send_mark(const char* kind, const std::string& text);
    void answer(int status, std::string_view data = "");

    const ReplayOptions& options_;
    const JournalFile& file_;
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
    bool marks_ = false;  // the front has a time line
    std::uint64_t frontier_ =
        0;  // most cycles that were executed, of which the front has the marks
    std::size_t entries_ = 0;  // of the journal, that were looked at
    bool runs_ = false;  // functions did in the newest cycle
    bool has_run_ = false;  // since the begin of the machine
    std::uint64_t fault_count_ = 0;
    std::uint64_t newest_fault_ = 0;  // its number
    std::string fault_text_;  // of the newest
    std::chrono::steady_clock::time_point sent_{};  // the last progress
};

}  // namespace hal::tools
