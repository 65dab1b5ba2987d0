// SPDX-License-Identifier: MIT
#include "bootloader.hpp"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

namespace hal::canopen {

namespace {

constexpr std::array<std::uint32_t, 256> crc_table = [] {
    std::array<std::uint32_t, 256> table{};
    for (std::uint32_t byte = 0; byte < 256; ++byte) {
        std::uint32_t crc = byte;
        for (int bit = 0; bit < 8; ++bit) {
            crc = (crc & 1) != 0 ? crc >> 1 ^ 0xedb88320 : crc >> 1;
        }
        table[byte] = crc;
    }
    return table;
}();

enum Control : std::uint8_t { stop = 0, start = 1, reset = 2, clear = 3 };

constexpr const char* words[] = {"no error",
                                 "no valid program",
                                 "unknown program format",
                                 "program damaged",
                                 "not cleared before writing",
                                 "write error",
                                 "program too long",
                                 "secured"};

}  // namespace

std::uint32_t crc32(std::span<const std::uint8_t> data) noexcept {
    std::uint32_t crc = 0xffffffff;
    for (const auto byte : data) {
        crc = crc >> 8 ^ crc_table[(crc ^ byte) & 0xff];
    }
    return ~crc;
}

std::vector<std::uint8_t> program_image(std::uint32_t product, std::uint32_t version,
                                        std::size_t length) {
    std::vector<std::uint8_t> program(length), image;
    std::uint32_t random = version * 2654435761U + 1;
    for (auto& byte : program) {
        random = random * 1664525 + 1013904223;
        byte = static_cast<std::uint8_t>(random >> 24);
    }
    for (const std::uint32_t field : {ProgramHeader::signature, product, version,
                                      static_cast<std::uint32_t>(length), crc32(program)}) {
        for (unsigned bit = 0; bit < 32; bit += 8) {
            image.push_back(static_cast<std::uint8_t>(field >> bit));
        }
    }
    image.insert(image.end(), program.begin(), program.end());
    return image;
}

Bootloader::Bootloader(BootloaderSettings settings)
    : settings_(std::move(settings)), flash_(settings_.flash) {
    auto image = settings_.image.value_or(std::vector<std::uint8_t>{});
    if (!settings_.image && settings_.version != 0) {
        image = program_image(settings_.product, settings_.version, 4096);
    }
    if (image.size() > flash_.size()) {
        throw std::invalid_argument("the image is longer than the flash of " +
                                    std::to_string(flash_.size()) + " bytes");
    }
    std::copy(image.begin(), image.end(), flash_.begin());
    used_ = image.size();
    examine();
    running_ = valid();
}

Description Bootloader::description() const {
    Description d = basic_device({.device_type = 0,
                                  .vendor = example_vendor,
                                  .product = settings_.product,
                                  .revision = 0,
                                  .serial = settings_.serial,
                                  .name = "Halcyon bootloader",
                                  .heartbeat_ms = settings_.heartbeat_ms});
    d.add_text(0x100a, 0, Access::constant, "bootloader", 16, "Manufacturer software version");
    using enum Access;
    d.add(0x1f50, 0, Type::unsigned8, constant, 1, "Highest sub-index");
    d.add_domain(0x1f50, 1, write_only, static_cast<std::uint32_t>(settings_.flash), "Program 1");
    d.add(0x1f51, 0, Type::unsigned8, constant, 1, "Highest sub-index");
    d.add(0x1f51, 1, Type::unsigned8, read_write, 0, "Program 1");
    d.add(0x1f56, 0, Type::unsigned8, constant, 1, "Highest sub-index");
    d.add(0x1f56, 1, Type::unsigned32, read_only, 0, "Program 1");
    d.add(0x1f57, 0, Type::unsigned8, constant, 1, "Highest sub-index");
    d.add(0x1f57, 1, Type::unsigned32, read_only, 0, "Program 1");
    d.add(0x2000, 0, Type::unsigned32, read_only, 0, "Counter of the program").sent();
    add_tpdo(d, 1, {.transmission = 1, .mapping = {map_entry(0x2000, 0, 32)}});
    return d;
}

void Bootloader::attach(Device& device) {
    Program::attach(device);
    device.dictionary().stream(0x1f50, 1, stream_);
    for (const int index : {0x1f51, 0x1f56, 0x1f57}) {
        watch(static_cast<std::uint16_t>(index));
    }
    show();
}

void Bootloader::boot(Time now) noexcept {
    now_ = now;
    Program::boot(now);
}

/// Examines the flash and sets header_, identification_ and error_.
void Bootloader::examine() noexcept {
    header_ = {};
    identification_ = 0;
    if (used_ == 0) return void(error_ = FlashError::no_program);
    const auto* at = flash_.data();
    const auto field = [&](std::size_t n) { return load<std::uint32_t>(at + 4 * n); };
    if (used_ < ProgramHeader::size || field(0) != ProgramHeader::signature) {
        return void(error_ = FlashError::unknown_format);
    }
    const ProgramHeader h{field(1), field(2), field(3), field(4)};
    if (h.product != settings_.product) return void(error_ = FlashError::unknown_format);
    if (h.length != used_ - ProgramHeader::size ||
        h.crc != crc32({at + ProgramHeader::size, h.length})) {
        return void(error_ = FlashError::wrong_data);
    }
    error_ = FlashError::none;
    header_ = h;
    identification_ = crc32({at, used_});
}

/// Shows identity and version of what runs now in the object dictionary.
void Bootloader::show() noexcept {
    auto& dictionary = device_->dictionary();
    dictionary.set(0x1018, 3, running_ ? header_.version : std::uint32_t{0});
    if (auto* e = dictionary.find(0x100a, 0); e != nullptr) {
        char text[16] = "bootloader";
        if (running_) {
            std::snprintf(text, sizeof text, "%u.%u", header_.version >> 16 & 0xffff,
                          header_.version & 0xffff);
        }
        e->size = static_cast<std::uint32_t>(
            std::min<std::size_t>(std::char_traits<char>::length(text), e->capacity));
        std::copy_n(text, e->size, e->data);
    }
    dictionary.set(0x1f51, 1, static_cast<std::uint8_t>(running_ ? start : stop));
}

void Bootloader::on_reset(bool application) noexcept {
    // power-on and NMT reset start a valid program
    if (application && !wants_reset_) {
        running_ = valid();
    }
    wants_reset_ = false;
    if (!running_) {
        writing_ = erasing_ = false;
    }
    show();
}

void Bootloader::step(Time now) noexcept {
    now_ = now;
    if (erasing_ && now >= erased_at_) {
        erasing_ = false;
        ++changes_;
    }
    if (running_ && online()) {
        auto& dictionary = device_->dictionary();
        dictionary.set(0x2000, 0, dictionary.get<std::uint32_t>(0x2000, 0) + 1);
    }
    // send the response to the command first
    if (!wants_reset_ || device_->out().size() != 0) return;
    running_ = starts_;
    device_->command(NmtCommand::reset_node, now);
}

Abort Bootloader::reading(Entry& e) noexcept {
    if (e.sub != 1) return Abort::none;
    if (e.index == 0x1f56) {
        store(e.data, identification_);
    } else if (e.index == 0x1f57) {
        store(e.data, static_cast<std::uint32_t>(error_) << 1 | (busy() ? 1U : 0U));
    }
    return Abort::none;
}

Abort Bootloader::writing(Entry& e, std::span<const std::uint8_t> value) noexcept {
    if (e.index != 0x1f51 || e.sub != 1) return Abort::none;
    if (value[0] > clear) return Abort::value;
    if (busy()) return Abort::device_state;
    if (value[0] == start && !running_ && !valid()) return Abort::device_state;
    if (value[0] == clear && running_) {
        return Abort::device_state;  // stop it first
    }
    return Abort::none;
}

void Bootloader::written(Entry& e) noexcept {
    if (e.index != 0x1f51) return;
    const auto command = *e.data;
    *e.data = running_ ? start : stop;  // what is read is the state
    switch (command) {
    case stop:
    case start:
        if (running_ != (command == start)) {
            wants_reset_ = true;
            starts_ = command == start;
        }
        break;
    case reset:
        wants_reset_ = true;
        starts_ = running_;
        break;
    default:
        used_ = 0;
        examine();
        erasing_ = true;
        erased_at_ = now_ + settings_.erase;
        break;
    }
}

Abort Bootloader::Flash::open_write(Entry&, std::uint32_t size) noexcept {
    auto& d = device_;
    if (d.running_ || d.erasing_) return Abort::device_state;
    if (d.used_ != 0 && !d.broken_off_) {
        d.error_ = FlashError::not_cleared;
        return Abort::device_state;
    }
    if (size > d.flash_.size()) {
        d.error_ = FlashError::address;
        return Abort::too_long;
    }
    d.used_ = 0;
    d.writing_ = true;
    return Abort::none;
}

Abort Bootloader::Flash::write(Entry&, std::uint32_t offset,
                               std::span<const std::uint8_t> bytes) noexcept {
    auto& d = device_;
    if (offset > d.flash_.size() || bytes.size() > d.flash_.size() - offset) {
        d.error_ = FlashError::address;
        return Abort::too_long;
    }
    std::copy(bytes.begin(), bytes.end(), d.flash_.begin() + offset);
    d.used_ = offset + bytes.size();
    return Abort::none;
}

Abort Bootloader::Flash::close(Entry&, bool writing, bool whole) noexcept {
    auto& d = device_;
    if (!writing) return Abort::none;
    d.writing_ = false;
    d.broken_off_ = !whole;
    ++d.changes_;
    if (!whole) {  // an incomplete program is invalid
        d.header_ = {};
        d.identification_ = 0;
        if (d.error_ != FlashError::address) {
            d.error_ = d.used_ == 0 ? FlashError::no_program : FlashError::wrong_data;
        }
        return Abort::none;
    }
    d.examine();
    return d.error_ == FlashError::none ? Abort::none : Abort::cannot_store;
}

std::string Bootloader::summary() const {
    if (!running_) {
        return std::string("bootloader; flash: ") + words[static_cast<std::size_t>(error_)];
    }
    return "program " + std::to_string(header_.version >> 16) + "." +
           std::to_string(header_.version & 0xffff) + " runs";
}

}  // namespace hal::canopen
