// SPDX-License-Identifier: MIT
// The SoE server of an emulated slave: the parameters of a drive.
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "ethercat/devices/mailbox_service.hpp"
#include "ethercat/wire/soe.hpp"

namespace hal::ethercat::devices {

/// An IDN of the SoE server. Lists hold their elements only, without the two lengths.
struct Idn {
    std::uint16_t number = 0;
    soe::Attribute attribute;
    std::string name, unit;
    std::vector<std::uint8_t> value;   ///< its size is the capacity
    std::size_t length = 0;
    std::int64_t low = 0;
    std::int64_t high = 0;    ///< equal: no limits
    std::uint8_t drive = 0;   ///< 0..7
};
/// Parameters of one or several drives.
class SoeServer : public MailboxService {
public:
    explicit SoeServer(std::vector<Idn> idns) : idns_(std::move(idns)) {}
    MailboxType type() const noexcept override { return MailboxType::soe; }
    void reset() noexcept override {
        left_ = 0;
        written_ = 0;
    }
    void take(const MailboxMessage&, State, Outbox&) noexcept override;
    void pump(Outbox&) noexcept override;

private:
    void read(const soe::Header&, Outbox&) noexcept;
    void write(const soe::Header&, std::span<const std::uint8_t> data, State, Outbox&) noexcept;
    void refuse(const soe::Header&, std::uint16_t code, Outbox&) noexcept;
    Idn* find(std::uint8_t drive, std::uint16_t number) noexcept;
    bool has_drive(std::uint8_t drive) const noexcept;

    std::vector<Idn> idns_;
    std::array<std::uint8_t, 4096> buffer_{};
    std::size_t left_ = 0;
    std::size_t at_ = 0;
    std::size_t written_ = 0;
    soe::Header answer_;
};

}  // namespace hal::ethercat::devices
