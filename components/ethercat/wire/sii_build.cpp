// SPDX-License-Identifier: MIT
// Makes an SII image.
#include <algorithm>
#include <map>

#include "ethercat/wire/byte_order.hpp"
#include "ethercat/wire/sii.hpp"

namespace hal::ethercat::sii {

namespace {

constexpr std::size_t max_string = 255;
constexpr std::size_t max_strings = 255;

class Builder {
public:
    /// With `names` below the number of PDOs and entries, only that many of them keep their names.
    Builder(const Contents& from, std::size_t names) : from_(from), names_(names) {}

    std::vector<std::uint8_t> build() {
        // The other categories first: they collect the strings.
        std::vector<std::uint8_t> rest;
        std::swap(out_, rest);
        if (from_.has_general) {
            general();
        }
        fmmus();
        sync_managers();
        for (const Pdo& p : from_.tx) {
            pdo(p, Category::tx_pdo);
        }
        for (const Pdo& p : from_.rx) {
            pdo(p, Category::rx_pdo);
        }
        dc();
        for (const OtherCategory& o : from_.others) {
            begin(o.type);
            out_.insert(out_.end(), o.data.begin(), o.data.end());
            end();
        }
        std::swap(out_, rest);
        head();
        strings();
        out_.insert(out_.end(), rest.begin(), rest.end());
        add<std::uint16_t>(0xffff);
        return std::move(out_);
    }

private:
    template <class T>
    void add(T value) {
        const std::size_t at = out_.size();
        out_.resize(at + sizeof value);
        put(out_.data() + at, value);
    }
    void begin(std::uint16_t type) {
        add(type);
        add<std::uint16_t>(0);
        start_ = out_.size();
    }
    void end(std::uint8_t padding = 0) {
        if ((out_.size() - start_) % 2 != 0) {
            out_.push_back(padding);
        }
        put(out_.data() + start_ - 2, static_cast<std::uint16_t>((out_.size() - start_) / 2));
    }
    std::uint8_t string(const std::string& text) {
        if (text.empty()) return 0;
        const auto known = numbers_.find(text);
        if (known != numbers_.end()) return known->second;
        if (strings_.size() == max_strings) return 0;
        strings_.push_back(text.substr(0, max_string));
        return numbers_[text] = static_cast<std::uint8_t>(strings_.size());
    }
    std::uint8_t name(const std::string& text) {
        if (names_ == 0) return 0;
        --names_;
        return string(text);
    }

    void mailboxes(const Mailboxes& m) {
        add(m.receive.start);
        add(m.receive.size);
        add(m.send.start);
        add(m.send.size);
    }
    void head() {
        for (const std::uint16_t w : from_.configuration) {
            add(w);
        }
        add<std::uint16_t>(checksum(out_));
        add(from_.vendor);
        add(from_.product);
        add(from_.revision);
        add(from_.serial);
        add(from_.execution_delay), add(from_.port_delay[0]), add(from_.port_delay[1]),
            add<std::uint16_t>(0);
        mailboxes(from_.boot);
        mailboxes(from_.mailboxes);
        add(from_.protocols);
        out_.resize(2 * word_size, 0);
        add<std::uint16_t>(0);  // the size, set when it is known
        add(from_.version);
    }
    void strings() {
        if (strings_.empty()) return;
        begin(static_cast<std::uint16_t>(Category::strings));
        add(static_cast<std::uint8_t>(strings_.size()));
        for (const std::string& s : strings_) {
            add(static_cast<std::uint8_t>(s.size()));
            out_.insert(out_.end(), s.begin(), s.end());
        }
        end();
    }
    void general() {
        const General& g = from_.general;
        begin(static_cast<std::uint16_t>(Category::general));
        // the first string, which SOEM shows as the name
        const std::uint8_t order = string(g.order);
        const std::uint8_t group = string(g.group);
        add(group);
        add(string(g.image));
        add(order);
        add(string(g.name));
        add<std::uint8_t>(0);
        add(g.coe_details), add<std::uint8_t>(g.foe), add<std::uint8_t>(g.eoe), add(g.soe_channels),
            add(g.ds402_channels);
        add<std::uint8_t>(0);
        add(g.flags), add(g.ebus_ma), add(group), add<std::uint8_t>(0);
        unsigned ports = 0;
        for (unsigned i = 0; i < 4; ++i) {
            ports |= (g.ports[i] & 15U) << (4 * i);
        }
        add(static_cast<std::uint16_t>(ports));
        out_.resize(start_ + 32, 0);
        end();
    }
    void fmmus() {
        if (from_.fmmus.empty()) return;
        begin(static_cast<std::uint16_t>(Category::fmmu));
        for (const FmmuUse use : from_.fmmus) {
            add(static_cast<std::uint8_t>(use));
        }
        end(0xff);
    }
    void sync_managers() {
        if (from_.sync_managers.empty()) return;
        begin(static_cast<std::uint16_t>(Category::sync_manager));
        for (const SyncManager& s : from_.sync_managers) {
            add(s.start);
            add(s.length);
            add(s.control);
            add(s.status);
            add(s.enable);

            add(static_cast<std::uint8_t>(s.type));
        }
        end();
    }
    void pdo(const Pdo& p, Category category) {
        const std::size_t count = std::min<std::size_t>(p.entries.size(), 255);
        begin(static_cast<std::uint16_t>(category));
        add(p.index);
        add(static_cast<std::uint8_t>(count));
        add(p.sync_manager);
        add(p.sync);

        add(name(p.name));
        add(p.flags);
        for (std::size_t i = 0; i < count; ++i) {
            const Entry& e = p.entries[i];
            add(e.index);
            add(e.sub);
            add(name(e.name));
            add(e.type);
            add(e.bits);
            add(e.flags);
        }
        end();
    }
    void dc() {
        if (from_.dc.empty()) return;
        begin(static_cast<std::uint16_t>(Category::dc));
        for (const DcMode& m : from_.dc) {
            add(m.sync0_cycle_ns);
            add(m.sync0_shift_ns);
            add(m.sync1_shift_ns);

            add(m.sync1_factor);
            add(m.assign_activate);
            add(m.sync0_factor), add(string(m.name)), add(string(m.description)),
                add<std::uint32_t>(0);
        }
        end();
    }

    const Contents& from_;
    std::size_t names_;
    std::vector<std::uint8_t> out_;
    std::vector<std::string> strings_;
    std::map<std::string, std::uint8_t> numbers_;
    std::size_t start_ = 0;
};

}  // namespace

std::vector<std::uint8_t> build(const Contents& from) {
    std::size_t names = 0;
    for (const auto* pdos : {&from.tx, &from.rx}) {
        for (const Pdo& p : *pdos) {
            names += 1 + p.entries.size();
        }
    }
    auto image = Builder(from, names).build();
    // as many names as fit, at least none
    if (from.eeprom_bytes != 0 && image.size() > from.eeprom_bytes) {
        std::size_t fit = 0;
        for (std::size_t step = names; step != 0; step /= 2) {
            while (fit + step <= names &&
                   Builder(from, fit + step).build().size() <= from.eeprom_bytes) {
                fit += step;
            }
        }
        image = Builder(from, fit).build();
    }
    const std::size_t size =
        std::max((image.size() + 127) / 128 * 128, from.eeprom_bytes / 128 * 128);
    put(image.data() + 2 * word_size, static_cast<std::uint16_t>(size / 128 - 1));
    image.resize(size, 0xff);
    return image;
}

}  // namespace hal::ethercat::sii
