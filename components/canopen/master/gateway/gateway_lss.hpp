// SPDX-License-Identifier: MIT
// The LSS commands of the gateway, as jobs of an LSS master.
#pragma once

#include <optional>
#include <string>

#include "canopen/protocol/lss_master.hpp"
#include "gateway_command.hpp"

namespace hal::canopen::gateway {

/// Returns what is wrong with the arguments of an LSS command.
Error lss_argument_error(const Command&);
/// One LSS command at work: it waits for its turn at the LSS master of its net, and ends with a
/// response. All functions [setup].
class LssJob {
public:
    /// Continues the command; returns the response once there is one. `in_use`: another job uses
    /// this master.
    struct Response {
        Error error = Error::none;
        std::string text = "OK";
    };
    std::optional<Response> proceed(const Command&, LssMaster&, bool in_use, Time now);
    /// Returns true while it uses the master.
    bool uses_master() const { return started_; }

private:
    bool begin(const Command&, LssMaster&, Time now) const;

    bool started_ = false;
    unsigned part_ = 0;  ///< of lss_inquire_addr
    std::string text_;
};

}  // namespace hal::canopen::gateway
