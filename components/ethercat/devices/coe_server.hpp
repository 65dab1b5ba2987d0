// SPDX-License-Identifier: MIT
// The CoE server of an emulated slave: SDO download and upload (expedited, normal, segmented,
// complete access). SDO information is in sdo_information.hpp.
#pragma once

#include <vector>

#include "ethercat/devices/dictionary.hpp"
#include "ethercat/devices/mailbox_service.hpp"
#include "ethercat/devices/sdo_information.hpp"

namespace hal::ethercat::devices {

class CoeServer : public MailboxService {
public:
    /// `max_bytes` is the largest transfer. [setup]
    explicit CoeServer(Dictionary& dictionary, std::size_t max_bytes = 4096)
        : dictionary_(dictionary), information_(dictionary), buffer_(max_bytes) {}
    MailboxType type() const noexcept override { return MailboxType::coe; }
    void reset() noexcept override {
        transfer_ = Transfer::none;
        information_.reset();
    }
    void take(const MailboxMessage&, State, Outbox&) noexcept override;
    void pump(Outbox& out) noexcept override { information_.pump(out); }
    /// Rejects complete access, as small devices do. [setup]
    void without_complete_access() noexcept { complete_access_ = false; }

private:
    enum class Transfer : std::uint8_t { none, upload, download };
    void request(std::span<const std::uint8_t> payload, State, Outbox&) noexcept;
    void upload(const coe::Sdo&, State, Outbox&) noexcept;
    void download(const coe::Sdo&, std::span<const std::uint8_t> payload, State, Outbox&) noexcept;
    void upload_segment(std::uint8_t command, Outbox&) noexcept;
    void download_segment(std::uint8_t command, std::span<const std::uint8_t> payload, State,
                          Outbox&) noexcept;
    /// Writes the object. Returns whether it was accepted; else the abort is sent.
    bool finish_download(State, Outbox&) noexcept;
    void abort(coe::Abort, Outbox&) noexcept;
    void respond(std::uint8_t command, std::uint32_t value, Outbox&) noexcept;
    void respond_to_segment(bool toggle, Outbox&) noexcept;

    Dictionary& dictionary_;
    SdoInformation information_;
    std::vector<std::uint8_t> buffer_;
    std::size_t length_ = 0;
    std::size_t at_ = 0;
    std::uint16_t index_ = 0;
    std::uint8_t sub_ = 0;
    bool complete_ = false;
    bool toggle_ = false;
    bool complete_access_ = true;
    Transfer transfer_ = Transfer::none;
};

}  // namespace hal::ethercat::devices
