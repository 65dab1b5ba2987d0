// SPDX-License-Identifier: MIT
// The AoE server of an emulated slave.
#pragma once

#include <memory>
#include <utility>

#include "ethercat/devices/dictionary.hpp"
#include "ethercat/devices/mailbox_service.hpp"
#include "ethercat/wire/aoe.hpp"

namespace hal::ethercat::devices {

/// SDOs over AoE, device information, state.
class AoeServer : public MailboxService {
public:
    explicit AoeServer(std::shared_ptr<Dictionary> d) : dictionary_(std::move(d)) {}
    MailboxType type() const noexcept override { return MailboxType::aoe; }
    void take(const MailboxMessage&, State, Outbox&) noexcept override;

private:
    std::shared_ptr<Dictionary> dictionary_;
};

}  // namespace hal::ethercat::devices
