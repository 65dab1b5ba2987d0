// SPDX-License-Identifier: MIT
// Writes a `.ethercat` file for slaves found on a bus or described in an ESI.
#include <algorithm>
#include <cstdio>
#include <set>

#include "ethercat/config/pdo_rules.hpp"
#include "ethercat/config/slave_pdos.hpp"

namespace hal::ethercat::config {

namespace {

std::string hex(unsigned value) {
    char out[16];
    std::snprintf(out, sizeof out, "0x%X", value);
    return out;
}

/// Calls `use(pdo)` for each assigned PDO that shares the sync manager of the first one.
template <class Use>
void for_each_assigned(const std::vector<sii::Pdo>& pdos, Use use) {
    unsigned sync_manager = 0xff;
    for (const sii::Pdo& p : pdos) {
        if (p.sync_manager == 0xff || (sync_manager != 0xff && p.sync_manager != sync_manager)) {
            continue;
        }
        sync_manager = p.sync_manager;
        use(p);
    }
}

bool has(const std::vector<sii::Pdo>& pdos, unsigned index) {
    bool found = false;
    for_each_assigned(pdos, [&](const sii::Pdo& p) {
        for (const sii::Entry& e : p.entries) {
            found = found || (e.index == index && e.sub == 0);
        }
    });
    return found;
}

/// Returns the number of drives of CiA 402: each has a control word and a status word, 800h apart
/// from those of the one before.
unsigned axes_of(const Found& s) {
    unsigned axes = 0;
    while (axes < 8 && has(s.rx, 0x6040 + 0x800 * axes) && has(s.tx, 0x6041 + 0x800 * axes)) {
        ++axes;
    }
    return axes;
}

/// A list of objects; consecutive sub-indices of one type become a range.
class ObjectList {
public:
    explicit ObjectList(unsigned axes) : axes_(axes) {}
    void add(const sii::Entry& e) {
        if (e.bits == 0) return;
        const std::string word =
            e.index == 0 || !listed_.insert(e.index << 8 | e.sub).second ? "" : type_of(e);
        if (word.empty()) return append("gap " + std::to_string(e.bits));
        const Known known = axes_ == 0 ? Known{} : profile_object(e.index, e.sub, axes_);
        if (known.bits == e.bits) return append(address(e.index, e.sub));
        if (range_ && e.index == last_.index && e.sub == last_.sub + 1 && word == word_) {
            last_ = e;
            items_.back() =
                address(first_.index, first_.sub) + ".." + sub_text(last_.sub) + " " + word_;
            return;
        }
        append(address(e.index, e.sub) + " " + word);
        range_ = e.sub != 0;
        first_ = last_ = e;
        word_ = word;
    }
    std::string text() const {
        std::string list;
        for (const std::string& item : items_) {
            list += (list.empty() ? "" : ", ") + item;
        }
        return list;
    }

private:
    /// Two digits would mean another sub-index to earlier versions.
    static std::string sub_text(unsigned sub) {
        return sub < 10 ? std::to_string(sub) : bus::hex_text(sub);
    }
    static std::string address(std::uint16_t index, unsigned sub) {
        const std::string object = bus::index_text(index).substr(2);
        return sub == 0 ? object : object + ":" + sub_text(sub);
    }
    /// Returns the type as it is written in the file; empty: one that has no pin.
    static std::string type_of(const sii::Entry& e) {
        if (const bus::TypeName type = bus::parse_esi_type(sii::type_name(e.type));
            type.name != nullptr && type.bits == e.bits) {
            return type.name;
        }
        if (e.bits == 1) return "bit";
        return e.bits == 8 || e.bits == 16 || e.bits == 32 || e.bits == 64
                   ? "u" + std::to_string(e.bits)
                   : "";
    }
    void append(std::string item) {
        items_.push_back(std::move(item));
        range_ = false;
    }

    unsigned axes_;
    std::vector<std::string> items_;
    std::set<unsigned> listed_;
    bool range_ = false;
    sii::Entry first_{};
    sii::Entry last_{};
    std::string word_;
};

/// Returns "KEY = 6040, 607A s32" for the assigned PDOs and adds where they are to `options`; empty
/// if there are none.
std::string objects(const std::string& key, const std::vector<sii::Pdo>& pdos, unsigned axes,
                    std::string& options) {
    ObjectList list(axes);
    const sii::Pdo* first = nullptr;
    for_each_assigned(pdos, [&](const sii::Pdo& p) {
        if (first == nullptr) {
            first = &p;
        }
        for (const sii::Entry& e : p.entries) {
            list.add(e);
        }
    });
    if (list.text().empty()) {
        return {};
    }
    options += key + ".sync-manager = " + std::to_string(first->sync_manager) + "\n" + key +
               ".pdo = " + pdo_text(first->index) + "\n";
    return key + (key == "inputs" ? "  = " : " = ") + list.text() + "\n";
}

/// Returns start-up writes that select a cyclic mode for drives whose process data has none.
std::string modes(const Found& s, unsigned axes) {
    std::string text;
    for (unsigned axis = 0; axis < axes; ++axis) {
        const unsigned offset = 0x800 * axis;
        if (has(s.rx, 0x6060 + offset)) continue;
        const bool velocity = has(s.rx, 0x60ff + offset);
        if (!velocity && !has(s.rx, 0x607a + offset)) continue;
        text += "sdo " + hex(0x6060 + offset).substr(2) + " = " +
                (velocity ? "9  # cyclic synchronous velocity\n"
                          : "8  # cyclic synchronous position\n");
    }
    return text;
}

std::vector<const sii::Pdo*> assigned(const std::vector<sii::Pdo>& pdos) {
    std::vector<const sii::Pdo*> assigned;
    for (const sii::Pdo& p : pdos) {
        if (p.sync_manager != 0xff) {
            assigned.push_back(&p);
        }
    }
    return assigned;
}

/// Returns how many entries each of several assigned PDOs with consecutive numbers has; 0: they
/// differ, or there is at most one.
std::size_t common_entry_count(const std::vector<const sii::Pdo*>& pdos) {
    if (pdos.size() < 2) return 0;
    const std::size_t count = pdos.front()->entries.size();
    for (std::size_t i = 0; i < pdos.size(); ++i) {
        const bool is_consecutive = pdos[i]->index == pdos.front()->index + i;
        if (!is_consecutive || pdos[i]->entries.size() != count) return 0;
    }
    return count;
}

/// Returns the length of the PDOs of a slave with a fixed assignment, which keeps it; 0: it has
/// none, or a PDO of the other direction is longer.
std::size_t fixed_entry_count(const Found& s) {
    const auto rx = assigned(s.rx);
    const auto tx = assigned(s.tx);
    std::size_t longest = 0;
    for (const auto* pdos : {&rx, &tx}) {
        for (const sii::Pdo* const pdo : *pdos) {
            longest = std::max(longest, pdo->entries.size());
        }
    }
    const std::size_t common = std::max(common_entry_count(rx), common_entry_count(tx));
    return common == longest ? common : 0;
}

std::string one_line(const std::string& text) {
    std::string out;
    for (const char c : text) {
        out += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
    }
    return out;
}

std::string cycle_text(std::int64_t cycle_ns) {
    if (cycle_ns % 1'000'000 == 0) return std::to_string(cycle_ns / 1'000'000) + "ms";
    return std::to_string(cycle_ns / 1000) + "us";
}

/// What identifies the slave: the keys that are known.
std::string identity_keys(const Found& s) {
    const bool has_esi = !s.esi.empty();
    std::string text;
    if (has_esi) {
        text += "esi      = " + s.esi + "\n";
    }
    if (!s.order.empty()) {
        text += "device   = " + s.order + "\n";
    }
    if (s.vendor != 0) {
        text += "vendor   = " + hex(s.vendor) + "\n";
    }
    if (s.product != 0) {
        text += "product  = " + hex(s.product) + "\n";
    }
    if (has_esi || s.revision != 0) {
        text += "revision = " + hex(s.revision) + "+  # or a higher one\n";
    }
    return text;
}

/// The process data of a slave without an ESI, from its own memory.
std::string process_data(const Found& s) {
    const unsigned axes = axes_of(s);
    std::string text;
    if (axes != 0) {
        text += "device  = cia402\n";
    }
    if (axes > 1) {
        text += "axes    = " + std::to_string(axes) + "\n";
    }
    std::string options;
    text += objects("outputs", s.rx, axes, options);
    text += objects("inputs", s.tx, axes, options);
    text += options + modes(s, axes);
    if (const std::size_t count = fixed_entry_count(s); count != 0) {
        text += "entries-per-pdo = " + std::to_string(count) + "\n";
    }
    return text;
}

/// Names of slaves: that of the EEPROM, with the position if it is missing or not the first one.
class SlaveNames {
public:
    std::string name_of(const Found& s, std::size_t position) {
        const std::string number = std::to_string(position);
        std::string name = dashed(s.name);
        if (name.empty()) {
            name = "slave-" + number;
        }
        const bool is_first = used_.insert(name).second;
        return is_first ? name : name + "-" + number;
    }

private:
    std::set<std::string> used_;
};

}  // namespace

std::string write(const std::string& link, std::int64_t cycle_ns,
                  const std::vector<Found>& slaves) {
    std::string out = "[bus]\nlink  = " + link + "\ncycle = " + cycle_text(cycle_ns) + "\n";
    SlaveNames names;
    for (std::size_t i = 0; i < slaves.size(); ++i) {
        const Found& s = slaves[i];
        out += "\n[slave " + std::to_string(i) + " " + names.name_of(s, i) + "]";
        if (!s.device.empty()) {
            out += "  # " + one_line(s.device);
        }
        out += "\n" + identity_keys(s);
        if (s.esi.empty()) {
            out += process_data(s);
        }
        if (s.assign_activate != 0) {
            out += "dc = sync0\nassign-activate = " + hex(s.assign_activate) + "\n";
        }
    }
    return out;
}

}  // namespace hal::ethercat::config
