// SPDX-License-Identifier: MIT
// The EoE end of an emulated slave: a small IP host.
#pragma once

#include <array>

#include "ethercat/devices/mailbox_service.hpp"
#include "ethercat/wire/eoe.hpp"

namespace hal::ethercat::devices {

/// An IP stack that answers ARP and ping once it has an address; keeps IP settings.
class EoeHost : public MailboxService {
public:
    MailboxType type() const noexcept override { return MailboxType::eoe; }
    void reset() noexcept override {
        splitter_ = {};
        joiner_ = {};
    }
    void take(const MailboxMessage&, State, Outbox&) noexcept override;
    void pump(Outbox&) noexcept override;
    const eoe::Ip& ip() const noexcept { return ip_; }

private:
    // to the frame in frame_; returns its length, 0: none
    std::size_t answer(std::size_t length) noexcept;

    eoe::Joiner joiner_;
    eoe::Splitter splitter_;
    std::array<std::uint8_t, eoe::max_frame> frame_{};
    eoe::Ip ip_;
    unsigned number_ = 0;
};

}  // namespace hal::ethercat::devices
