// SPDX-License-Identifier: MIT
// A device with every mailbox protocol, and the protocols other than CoE.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "ethercat/devices/io_devices.hpp"
#include "ethercat/wire/aoe.hpp"
#include "ethercat/wire/eoe.hpp"
#include "ethercat/wire/foe.hpp"
#include "ethercat/wire/soe.hpp"

namespace hal::ethercat::devices {

/// Files in memory of fixed capacity. A file may need a password, or BOOT.
class FoeServer : public MailboxService {
public:
    explicit FoeServer(std::size_t most_bytes = 256 * 1024) : most_bytes_(most_bytes) {}
    /// Adds a file. [setup]
    void add(std::string name, std::vector<std::uint8_t> content, std::uint32_t password = 0,
             bool boot_only = false);
    /// Answers each n-th data packet with BUSY first; 0: never. [setup]
    void busy_every(unsigned n) noexcept { busy_every_ = n; }
    /// Returns the present content of a file; empty for an unknown name. [setup]
    std::span<const std::uint8_t> content(std::string_view name) const noexcept;
    MailboxType type() const noexcept override { return MailboxType::foe; }
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
    void open(const foe::Message&, bool write, State, Outbox&) noexcept;
    void send_packet(Outbox&) noexcept;
    static void send(Outbox&, foe::Opcode, std::uint32_t value) noexcept;
    void refuse(Outbox&, foe::Error) noexcept;

    std::vector<File> files_;
    File* file_ = nullptr;
    std::size_t at_ = 0, most_bytes_, last_ = 0;
    std::uint32_t packet_ = 0;
    unsigned busy_every_ = 0;
    bool writing_ = false;
    bool busy_ = false;
};

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
    std::array<std::uint8_t, eoe::largest_frame> frame_{};
    eoe::Ip ip_;
    unsigned number_ = 0;
};

/// An IDN of the SoE server. Lists hold their elements only, without the two lengths.
struct Idn {
    std::uint16_t number = 0;
    soe::Attribute attribute;
    std::string name, unit;
    std::vector<std::uint8_t> value;   ///< its size is the capacity
    std::size_t length = 0;
    std::int64_t low = 0;
    std::int64_t high = 0;    ///< equal: no limits
};
/// Parameters of one drive.
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
    Idn* find(std::uint16_t number) noexcept;

    std::vector<Idn> idns_;
    std::array<std::uint8_t, 4096> buffer_{};
    std::size_t left_ = 0;
    std::size_t at_ = 0;
    std::size_t written_ = 0;
    soe::Header answer_;
};

/// SDOs over AoE, device information, state.
class AoeServer : public MailboxService {
public:
    explicit AoeServer(std::shared_ptr<Dictionary> d) : dictionary_(std::move(d)) {}
    MailboxType type() const noexcept override { return MailboxType::aoe; }
    void take(const MailboxMessage&, State, Outbox&) noexcept override;

private:
    std::shared_ptr<Dictionary> dictionary_;
};

/// Returns VoE messages as they are.
class VoeEcho : public MailboxService {
public:
    MailboxType type() const noexcept override { return MailboxType::voe; }
    void take(const MailboxMessage&, State, Outbox&) noexcept override;
};

/// Makes a device with all mailbox protocols, BOOT, and 8 bytes of process data that it returns.
Parts make_mailbox_device(const DeviceOptions&);  ///< [setup]

}  // namespace hal::ethercat::devices
