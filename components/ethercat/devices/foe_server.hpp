// SPDX-License-Identifier: MIT
// The FoE server of an emulated slave: files.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "ethercat/devices/mailbox_service.hpp"
#include "ethercat/wire/foe.hpp"

namespace hal::ethercat::devices {

/// Files in memory of fixed capacity. A file may need a password, or BOOT.
class FoeServer : public MailboxService {
public:
    explicit FoeServer(std::size_t max_bytes = 256 * 1024) : max_bytes_(max_bytes) {}
    /// Adds a file. [setup]
    void add(std::string name, std::vector<std::uint8_t> content, std::uint32_t password = 0,
             bool boot_only = false);
    /// Keeps the file of an unknown name that is written, instead of the one kept before. [setup]
    void accept_new();
    /// Answers each n-th data packet with BUSY first; 0: never. [setup]
    void busy_every(unsigned n) noexcept { busy_every_ = n; }
    /// Returns the present content of a file; empty for an unknown name. [setup]
    std::span<const std::uint8_t> content(std::string_view name) const noexcept;
    MailboxType type() const noexcept override { return MailboxType::foe; }
    bool in_boot() const noexcept override { return true; }
    void reset() noexcept override { file_ = nullptr; }
    void take(const MailboxMessage&, State, Outbox&) noexcept override;

private:
    struct File {
        std::string name;
        std::vector<std::uint8_t> bytes;  ///< of full capacity
        std::size_t length = 0;
        std::uint32_t password = 0;
        bool boot_only = false;
    };
    File* find(std::string_view name) noexcept;
    File* rename_new(std::string_view name) noexcept;
    void open(const foe::Message&, bool write, State, Outbox&) noexcept;
    void receive_packet(const foe::Message&, Outbox&) noexcept;
    void acknowledge_packet(const foe::Message&, Outbox&) noexcept;
    void send_packet(Outbox&) noexcept;
    static void send(Outbox&, foe::Opcode, std::uint32_t value) noexcept;
    void refuse(Outbox&, foe::Error) noexcept;

    std::vector<File> files_;
    std::optional<std::size_t> new_;  ///< index of the file for unknown names
    File* file_ = nullptr;
    std::size_t at_ = 0;
    std::size_t max_bytes_;
    std::size_t last_ = 0;
    std::uint32_t packet_ = 0;
    unsigned busy_every_ = 0;
    bool writing_ = false;
    bool busy_ = false;
};

}  // namespace hal::ethercat::devices
