// SPDX-License-Identifier: MIT
#include "ethercat/wire/sii.hpp"

#include <algorithm>
#include <cstdio>

#include "cia301/types.hpp"
#include "ethercat/wire/byte_order.hpp"

namespace hal::ethercat::sii {

namespace {

constexpr std::size_t max_bytes = 128 * 1024;
constexpr std::size_t header_bytes = 4;

constexpr std::size_t categories_at = 2 * word_categories;

/// The basic types of SIIs: up to BIT8.
constexpr std::uint8_t max_type = 0x37;

/// Reads fields up to the end of a category; what lies behind it reads as 0.
class Fields {
public:
    explicit Fields(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
    template <class T>
    T take() noexcept {
        T value{};
        if (bytes_.size() >= sizeof(T)) {
            value = get<T>(bytes_.data());
        }
        bytes_ = bytes_.subspan(std::min(sizeof(T), bytes_.size()));
        return value;
    }
    std::size_t left() const noexcept { return bytes_.size(); }
    std::string text(std::size_t length) {
        length = std::min(length, bytes_.size());
        std::string out(reinterpret_cast<const char*>(bytes_.data()), length);
        bytes_ = bytes_.subspan(length);
        while (!out.empty() && out.back() == '\0') {
            out.pop_back();
        }
        return out;
    }
    void skip(std::size_t bytes) noexcept {
        bytes_ = bytes_.subspan(std::min(bytes, bytes_.size()));
    }

private:
    std::span<const std::uint8_t> bytes_;
};

class Parser {
public:
    explicit Parser(std::span<const std::uint8_t> image) : image_(image) {}

    Contents parse() {
        configuration();
        // Strings first: other categories refer to them, and may come before them.
        each([&](std::uint16_t type, Fields data) {
            if (static_cast<Category>(type) == Category::strings && strings_.empty()) {
                strings(data);
            }
        });
        each([&](std::uint16_t type, Fields data) { category(type, data); });
        if (cut_) {
            out_.problems.push_back("the last category is longer than the image");
        } else if (!ended_ && image_.size() > categories_at) {
            out_.problems.push_back("the categories have no end mark");
        }
        return std::move(out_);
    }

private:
    std::uint16_t word(std::size_t address) const {
        return 2 * address + 2 <= image_.size() ? get<std::uint16_t>(image_.data() + 2 * address)
                                                : std::uint16_t{0};
    }
    std::uint32_t number(std::size_t address) const {
        return word(address) | static_cast<std::uint32_t>(word(address + 1)) << 16;
    }
    Mailboxes mailboxes(std::size_t at) const {
        return {{word(at), word(at + 1)}, {word(at + 2), word(at + 3)}};
    }

    void configuration() {
        if (image_.size() < categories_at) {
            out_.problems.push_back("the image has " + std::to_string(image_.size()) +
                                    " bytes; at least 128 are expected");
        }
        for (std::size_t i = 0; i < 7; ++i) {
            out_.configuration[i] = word(i);
        }
        const std::uint16_t stored = word(word_checksum);
        out_.checksum_valid =
            image_.size() >= 16 && (stored == 0x88a4 || (stored & 0xff) == checksum(image_));
        if (image_.size() >= 16 && !out_.checksum_valid) {
            char text[96];
            std::snprintf(text, sizeof text, "the checksum is 0x%02X; 0x%02X is expected",
                          stored & 0xffU, checksum(image_) + 0U);
            out_.problems.emplace_back(text);
        }
        out_.vendor = number(word_vendor);
        out_.product = number(word_product);
        out_.revision = number(word_revision);
        out_.serial = number(word_serial);
        out_.execution_delay = word(0x10);
        out_.port_delay = {static_cast<std::int16_t>(word(0x11)),
                           static_cast<std::int16_t>(word(0x12))};
        out_.boot = mailboxes(word_boot_mailbox);
        out_.mailboxes = mailboxes(word_mailbox);
        out_.protocols = word(word_protocols);
        out_.eeprom_bytes = (word(word_size) + std::size_t{1}) * 128;
        out_.version = word(word_version);
    }

    template <class F>
    void each(F f) {
        std::size_t at = categories_at;
        while (at + 2 <= image_.size()) {
            const auto type = get<std::uint16_t>(image_.data() + at);
            if (type == static_cast<std::uint16_t>(Category::end)) {
                ended_ = true;
                return;
            }
            if (at + header_bytes > image_.size()) return;
            const std::size_t length = 2 * std::size_t{get<std::uint16_t>(image_.data() + at + 2)};
            at += header_bytes;
            const std::size_t present = std::min(length, image_.size() - at);
            cut_ = present < length;
            f(type, Fields(image_.subspan(at, present)));
            at += present;
        }
    }

    void strings(Fields data) {
        const unsigned count = data.take<std::uint8_t>();
        strings_.resize(1);
        for (unsigned i = 0; i < count && data.left() != 0; ++i) {
            const std::size_t length = data.take<std::uint8_t>();
            strings_.push_back(data.text(length));
        }
    }
    const std::string& name(std::uint8_t index) const {
        static const std::string none;
        return index != 0 && index < strings_.size() ? strings_[index] : none;
    }

    /// Reads a category of the EEPROM (ETG.2010); the strings were read before, and unknown ones
    /// are skipped.
    void category(std::uint16_t type, Fields& data) {
        switch (static_cast<Category>(type)) {
        case Category::strings: return;
        case Category::general: return general(data);
        case Category::fmmu:
            while (data.left() != 0) {
                const auto use = data.take<std::uint8_t>();
                out_.fmmus.push_back(use <= 3 ? static_cast<FmmuUse>(use) : FmmuUse::unused);
            }
            // padding
            while (!out_.fmmus.empty() && out_.fmmus.back() == FmmuUse::unused) {
                out_.fmmus.pop_back();
            }
            return;
        case Category::sync_manager:
            while (data.left() >= 8) {
                SyncManager s{data.take<std::uint16_t>(), data.take<std::uint16_t>(),
                              data.take<std::uint8_t>(),  data.take<std::uint8_t>(),
                              data.take<std::uint8_t>(),  SmType::unused};
                const auto kind = data.take<std::uint8_t>();
                if (kind <= 4) {
                    s.type = static_cast<SmType>(kind);
                }
                out_.sync_managers.push_back(s);
            }
            return;
        case Category::tx_pdo: return pdo(data, out_.tx);
        case Category::rx_pdo: return pdo(data, out_.rx);
        case Category::dc:
            while (data.left() >= 24) {
                dc(data);
            }
            return;
        default: break;
        }
        OtherCategory other{type, {}};
        while (data.left() != 0) {
            other.data.push_back(data.take<std::uint8_t>());
        }
        out_.others.push_back(std::move(other));
    }

    void general(Fields& data) {
        General& g = out_.general;
        out_.has_general = true;
        g.group = name(data.take<std::uint8_t>());
        g.image = name(data.take<std::uint8_t>());
        g.order = name(data.take<std::uint8_t>());
        g.name = name(data.take<std::uint8_t>());
        data.skip(1);
        g.coe_details = data.take<std::uint8_t>();
        g.foe = data.take<std::uint8_t>() != 0;
        g.eoe = data.take<std::uint8_t>() != 0;
        g.soe_channels = data.take<std::uint8_t>();
        g.ds402_channels = data.take<std::uint8_t>();
        data.skip(1);
        g.flags = data.take<std::uint8_t>();
        g.ebus_ma = data.take<std::int16_t>();
        data.skip(2);
        const auto ports = data.take<std::uint16_t>();
        for (unsigned i = 0; i < 4; ++i) {
            g.ports[i] = static_cast<std::uint8_t>(ports >> (4 * i) & 15);
        }
    }

    void pdo(Fields& data, std::vector<Pdo>& to) {
        while (data.left() >= 8) {  // one per category; some images have several
            Pdo p;
            p.index = data.take<std::uint16_t>();
            const unsigned count = data.take<std::uint8_t>();
            p.sync_manager = data.take<std::uint8_t>();
            p.sync = data.take<std::uint8_t>();
            p.name = name(data.take<std::uint8_t>());
            p.flags = data.take<std::uint16_t>();
            if (p.index == 0) {
                break;  // padding
            }
            for (unsigned i = 0; i < count; ++i) {
                if (data.left() < 8) {
                    out_.problems.push_back("a PDO has fewer entries than it states");
                    break;
                }
                Entry e;
                e.index = data.take<std::uint16_t>();
                e.sub = data.take<std::uint8_t>();
                e.name = name(data.take<std::uint8_t>());
                e.type = data.take<std::uint8_t>();
                e.bits = data.take<std::uint8_t>();

                e.flags = data.take<std::uint16_t>();
                p.entries.push_back(std::move(e));
            }
            to.push_back(std::move(p));
        }
    }

    void dc(Fields& data) {
        DcMode m;
        m.sync0_cycle_ns = data.take<std::uint32_t>();
        m.sync0_shift_ns = data.take<std::int32_t>();
        m.sync1_shift_ns = data.take<std::int32_t>();
        m.sync1_factor = data.take<std::int16_t>();
        m.assign_activate = data.take<std::uint16_t>();
        m.sync0_factor = data.take<std::int16_t>();
        m.name = name(data.take<std::uint8_t>());
        m.description = name(data.take<std::uint8_t>());
        data.skip(4);
        out_.dc.push_back(std::move(m));
    }

    std::span<const std::uint8_t> image_;
    Contents out_;
    std::vector<std::string> strings_;
    bool ended_ = false;
    bool cut_ = false;
};

}  // namespace

std::uint8_t checksum(std::span<const std::uint8_t> image) noexcept {
    unsigned crc = 0xff;
    for (const std::uint8_t byte : image.first(std::min<std::size_t>(14, image.size()))) {
        crc ^= byte;
        for (int bit = 0; bit < 8; ++bit) {
            crc = (crc & 0x80) != 0 ? (crc << 1 ^ 0x07) & 0xff : crc << 1;
        }
    }
    return static_cast<std::uint8_t>(crc);
}

std::size_t bytes_needed(std::span<const std::uint8_t> read) noexcept {
    std::size_t at = categories_at;
    while (at + 2 <= read.size() && at < max_bytes) {
        if (get<std::uint16_t>(read.data() + at) == static_cast<std::uint16_t>(Category::end)) {
            return at + 2;
        }
        if (at + header_bytes > read.size()) return at + header_bytes;
        at += header_bytes + 2 * std::size_t{get<std::uint16_t>(read.data() + at + 2)};
    }
    return std::min(at + header_bytes, max_bytes);
}

Contents parse(std::span<const std::uint8_t> image) {
    return Parser(image.first(std::min(image.size(), max_bytes))).parse();
}

std::uint8_t type_number(std::string_view name) noexcept {
    for (std::uint8_t number = 1; number <= max_type; ++number) {
        if (name == type_name(number) && !name.empty()) return number;
    }
    return name == "BIT" ? 0x30 : 0;
}

const char* type_name(std::uint8_t number) noexcept {
    const auto type = static_cast<cia301::Type>(number);
    return cia301::bits_of(type) != 0 ? cia301::iec_name(type) : "";
}

}  // namespace hal::ethercat::sii
