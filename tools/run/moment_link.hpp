// SPDX-License-Identifier: MIT
// The front's end of the socket to the process that executes a journal.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "journal/journal_file.hpp"
#include "journal/keyframes.hpp"
#include "run/errand.hpp"
#include "run/replay.hpp"
#include "run/what_if.hpp"

namespace hal::tools {

/// [setup]. One errand at a time.
class MomentLink {
public:
    explicit MomentLink(Keyframes& frames) : frames_(frames) {}
    ~MomentLink();
    MomentLink(const MomentLink&) = delete;

    /// Starts the process, which does not return from it. Returns false after printing why that is
    /// not possible. Before the first thread of this process.
    bool start(const ReplayOptions& options, JournalFile& file, const WhatIf& change);
    /// Becomes readable when a packet has arrived.
    int fd() const { return socket_; }
    /// Sends an errand, and the text of a request. Returns false when the process has ended.
    bool send(const Errand& errand, std::string_view request = {});
    struct Received {
        Packet kind;
        std::string text;
    };
    /// Waits for a packet. Returns nothing when there is none in time; ended() states whether there
    /// will be none. A negative time is without limit.
    std::optional<Received> receive(int timeout_ms);
    /// Returns true when the process has ended without an answer.
    bool ended() const { return ended_; }
    /// Asks for the end of the errand, at a cycle between. [any]
    void interrupt(bool on) noexcept { frames_.interrupt(on); }

private:
    void send_packet(const void* bytes, std::size_t size);

    Keyframes& frames_;
    int socket_ = -1;
    bool ended_ = false;
    std::string buffer_;
};

/// What is printed when it has ended().
inline constexpr const char* ended_unexpectedly =
    "the re-execution has ended unexpectedly: a component has crashed, or the process was "
    "terminated";

}  // namespace hal::tools
