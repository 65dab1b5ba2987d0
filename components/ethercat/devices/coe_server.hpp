// SPDX-License-Identifier: MIT
// The CoE server of an emulated slave: SDO download and upload (expedited, normal, segmented,
// complete access), SDO information, emergencies.
#pragma once

#include <vector>

#include "ethercat/devices/dictionary.hpp"
#include "ethercat/devices/mailbox_service.hpp"

namespace hal::ethercat::devices {

class CoeServer : public MailboxService {
public:
    /// `most_bytes` is the largest transfer. [setup]
    explicit CoeServer(Dictionary& dictionary, std::size_t most_bytes = 4096)
        : dictionary_(dictionary), buffer_(most_bytes) {}
    MailboxType type() const noexcept override { return MailboxType::coe; }
    void reset() noexcept override {
        transfer_ = Transfer::none;
        list_ = List{};
    }
    void take(const MailboxMessage&, State, Outbox&) noexcept override;
    void pump(Outbox&) noexcept override;
    /// Queues an emergency; it is dropped if the outbox is full. [realtime]
    static void emergency(const coe::Emergency&, Outbox&) noexcept;
    /// Rejects complete access, as small devices do. [setup]
    void without_complete_access() noexcept { complete_access_ = false; }

private:
    enum class Transfer : std::uint8_t { none, upload, download };
    struct List {
        std::size_t at = 0;
        std::size_t count = 0;  ///< objects of the list
        coe::List list{};
        std::uint16_t fragments_left = 0;
        bool active = false;
    };
    void request(std::span<const std::uint8_t> payload, State, Outbox&) noexcept;
    void upload(const coe::Sdo&, State, Outbox&) noexcept;
    void download(const coe::Sdo&, std::span<const std::uint8_t> payload, State, Outbox&) noexcept;
    void upload_segment(std::uint8_t command, Outbox&) noexcept;
    void download_segment(std::uint8_t command, std::span<const std::uint8_t> payload, State,
                          Outbox&) noexcept;
    void finish_download(State, Outbox&, bool segmented, bool toggle) noexcept;
    void abort(std::uint32_t code, Outbox&) noexcept;
    void respond(std::uint8_t command, std::uint32_t value, Outbox&) noexcept;

    void information(std::span<const std::uint8_t> payload, Outbox&) noexcept;
    void information_error(std::uint32_t code, Outbox&) noexcept;
    bool in_list(const DictionaryObject&, coe::List) const noexcept;
    void object(std::uint16_t index, Outbox&) noexcept;
    void entry(std::uint16_t index, std::uint8_t sub, std::uint8_t info, Outbox&) noexcept;

    Dictionary& dictionary_;
    std::vector<std::uint8_t> buffer_;
    std::size_t length_ = 0;
    std::size_t at_ = 0;
    std::uint16_t index_ = 0;
    std::uint8_t sub_ = 0;
    bool complete_ = false;
    bool toggle_ = false;
    bool complete_access_ = true;
    Transfer transfer_ = Transfer::none;
    List list_;
};

}  // namespace hal::ethercat::devices
