// SPDX-License-Identifier: MIT
// What setup calls of components got from outside, and the files that they read, as messages of a
// journal.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "execute/setup_results.hpp"

namespace hal {

/// One message.
struct SetupRecord {
    enum Kind : std::uint32_t {
        call,  ///< name, results, readings
        file,  ///< name, error, hash; `results` has the bytes where they are new
    };
    Kind kind = call;
    std::uint32_t error = 0;
    std::string name = {};
    std::string hash = {};
    std::string results = {};
    std::string readings = {};
};

/// Returns the message as CDR. [setup]
std::string to_cdr(const SetupRecord& record);
/// Returns the record of a message; nothing when it is damaged. [setup]
std::optional<SetupRecord> setup_record(std::string_view payload);

/// The records of a journal, given back in the order in which they were added under a name. [setup]
class JournaledSetup {
public:
    void add(SetupRecord record);
    /// Returns the results of the next call of this name; nullopt: there is none.
    std::optional<SetupResults> next_call(const std::string& call);
    /// Returns the file that was read next under this name, the last one again and again; nullptr:
    /// there is none. The journaled machine may have found it beside its netlist: then its path
    /// ends with `path`.
    const SetupFile* next_file(const std::string& path);

private:
    struct Reading {
        std::uint32_t error;
        std::string hash;
    };
    std::deque<Reading>* readings_of(const std::string& path);

    std::map<std::string, std::deque<SetupResults>> calls_;
    std::map<std::string, std::deque<Reading>> files_;
    std::map<std::string, std::string> contents_;  // by hash
    SetupFile given_;
};

}  // namespace hal
