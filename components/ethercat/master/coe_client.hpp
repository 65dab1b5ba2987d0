// SPDX-License-Identifier: MIT
// CANopen over EtherCAT as the master uses it: SDO transfers and emergencies (ETG.1000.6, clause
// 5.6). SDO information is in object_information.hpp.
#pragma once

#include <cstdint>
#include <span>

#include "ethercat/master/aoe_client.hpp"
#include "ethercat/master/eoe_client.hpp"
#include "ethercat/master/mailbox.hpp"
#include "ethercat/master/soe_client.hpp"
#include "ethercat/wire/coe.hpp"
#include "hal/queue.hpp"

namespace hal::ethercat::master {

/// An emergency and its sender.
struct EmergencyEvent {
    std::uint16_t slave = 0;  ///< BusSlave::number
    coe::Emergency emergency;
};

/// Emergencies of all slaves, from the cycle to one other thread.
class EmergencyQueue final : public MailboxSink {
public:
    explicit EmergencyQueue(std::size_t capacity = 64) : queue_(capacity) {}
    /// Registers at all mailboxes. [setup]
    void attach(Mailboxes& mailboxes) noexcept {
        for (std::size_t i = 0; i < mailboxes.size(); ++i) {
            mailboxes.at(i).set_sink(MailboxType::coe, this);
        }
    }
    bool take(const BusSlave&, const MailboxMessage&) noexcept override;
    /// Removes the oldest emergency; false: none. [any] one reader
    bool pop(EmergencyEvent& event) noexcept { return queue_.pop(event); }
    /// Returns the number of emergencies that found the queue full.
    std::uint32_t lost() const noexcept { return lost_; }

private:
    Queue<EmergencyEvent> queue_;
    std::uint32_t lost_ = 0;
};

/// See the top of this file. All functions [realtime].
class CoeClient final : public CoeAccess {
public:
    explicit CoeClient(Mailboxes& mailboxes) noexcept : mailboxes_(mailboxes) {}

    Task<SdoResult> upload(Channel&, BusSlave&, std::uint16_t index, std::uint8_t sub,
                           bool complete, std::span<std::uint8_t> to) noexcept override;
    Task<SdoResult> download(Channel&, BusSlave&, std::uint16_t index, std::uint8_t sub,
                             bool complete, std::span<const std::uint8_t> from) noexcept override;
    /// An IDN by SoE, an object by AoE.
    Task<SdoResult> write_other(Channel&, BusSlave&, const StartupWrite&) noexcept override;
    Task<SdoResult> set_ip(Channel& channel, BusSlave& slave, const eoe::Ip& ip) noexcept override {
        return eoe_.set_ip(channel, slave, ip);
    }
    void reset_mailbox(const BusSlave&) noexcept override;

private:
    Task<SdoResult> upload_segments(Channel&, BusSlave&, SlaveMailbox&, std::uint16_t index,
                                    std::uint8_t sub, std::size_t size, std::size_t first,
                                    std::span<std::uint8_t> to) noexcept;
    Task<SdoResult> download_segments(Channel&, BusSlave&, SlaveMailbox&, std::uint16_t index,
                                      std::uint8_t sub,
                                      std::span<const std::uint8_t> rest) noexcept;
    Task<> send_abort(Channel&, BusSlave&, SlaveMailbox&, std::uint16_t index, std::uint8_t sub,
                      std::uint32_t code) noexcept;

    Mailboxes& mailboxes_;
    SoeClient soe_{mailboxes_};
    AoeClient aoe_{mailboxes_};
    EoeClient eoe_{mailboxes_};
};

}  // namespace hal::ethercat::master
