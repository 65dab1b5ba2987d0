// SPDX-License-Identifier: MIT
// The process "boot NMT slave" of CiA 302-2 (figure 4) for one node: from reset to error control.
//
//     reset ----> identify ----> check state ---- operational ---------+
//     figure 6    figure 5  |    figure 6, B         |                 v
//                           |                        v            error control ----> good, L
//                           +-----------------> prepare --------> figure 11, D
//                                               figure 8, C
//
// Without keep-alive the path goes from identify to prepare. A program that was replaced, or
// defaults that were restored, lead back to identify. The letters B, C and D are the connectors
// between the figures.
#pragma once

#include <optional>

#include "boot_channel.hpp"
#include "configuration_download.hpp"
#include "node_supervision.hpp"

namespace hal::canopen {

/// How a boot begins.
enum class BootStart : std::uint8_t {
    reset,  ///< reset the node's communication first
    was_reset,  ///< all nodes were reset by one command
    in_unknown_state,  ///< without reset; its state is unknown
    booted,  ///< after its own boot-up message
};

/// See the top of this file. All functions [realtime] unless tagged otherwise.
class BootSlave {
public:
    /// Allocates all memory; channel and supervision outlive it. [setup]
    BootSlave(BootChannel&, NodeSupervision&, std::uint8_t master_id);

    /// Boots the node from the beginning; the end comes by BootOwner::on_boot_end().
    void begin(BootStart) noexcept;
    /// Continues with the identification, because the node has rebooted by itself.
    void begin_again() noexcept;
    /// Two devices respond to one request differently.
    struct Contradiction {
        BootResult letter;
        std::uint16_t index;
        std::uint8_t sub;
        std::uint64_t first;
        std::uint64_t second;
    };
    /// Looks at an SDO response before the client gets it. Returns what contradicts an earlier
    /// response.
    std::optional<Contradiction> on_sdo_frame(const Frame&) noexcept;

private:
    enum class Identity : std::uint8_t { expected, failed, no_response };
    enum class State : std::uint8_t { failed, operational, other };
    enum class Prepared : std::uint8_t { failed, restarting, done };

    Task<> boot(BootChannel&, BootStart) noexcept;
    Task<> boot_from_identity(BootChannel&) noexcept;
    Task<> reset(BootChannel&, NmtCommand, bool already_sent) noexcept;
    Task<bool> identify(BootChannel&) noexcept;
    Task<Identity> read_identity(BootChannel&) noexcept;
    Task<State> check_state(BootChannel&) noexcept;
    Task<bool> read_producer(BootChannel&, BootResult letter) noexcept;
    Task<Prepared> prepare(BootChannel&) noexcept;
    Task<> start_error_control(BootChannel&, bool kept) noexcept;
    Task<bool> await_first_heartbeat(BootChannel&, bool kept) noexcept;

    BootChannel& channel_;
    NodeSupervision& supervision_;
    ConfigurationDownload configuration_;
    // of this boot
    bool state_known_ = false;
    bool downloaded_ = false;  // its program
    bool restored_ = false;  // its default values
    Time answer_by_ = 0;  // the node restarts and may not respond until then
    // responses to the identity objects, to recognise a second device
    std::array<std::uint32_t, 5> answers_{};
    unsigned answered_ = 0;
};

}  // namespace hal::canopen
