// SPDX-License-Identifier: MIT
// The VoE end of an emulated slave.
#pragma once

#include "ethercat/devices/mailbox_service.hpp"

namespace hal::ethercat::devices {

/// Returns VoE messages as they are.
class VoeEcho : public MailboxService {
public:
    MailboxType type() const noexcept override { return MailboxType::voe; }
    void take(const MailboxMessage&, State, Outbox&) noexcept override;
};

}  // namespace hal::ethercat::devices
