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

/// Returns how many entries each of several assigned PDOs with consecutive numbers has; 0: they
/// differ, or there is at most one.
std::size_t entries_each(const std::vector<sii::Pdo>& pdos, std::size_t& max) {
    std::vector<const sii::Pdo*> assigned;
    for (const sii::Pdo& p : pdos) {
        if (p.sync_manager != 0xff) {
            assigned.push_back(&p);
        }
    }
    bool equal = assigned.size() > 1;
    for (std::size_t i = 0; i < assigned.size(); ++i) {
        max = std::max(max, assigned[i]->entries.size());
        equal = equal && assigned[i]->entries.size() == assigned[0]->entries.size() &&
                assigned[i]->index == assigned[0]->index + i;
    }
    return equal ? assigned[0]->entries.size() : 0;
}

std::string one_line(const std::string& text) {
    std::string out;
    for (const char c : text) {
        out += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
    }
    return out;
}

}  // namespace

std::string write(const std::string& link, std::int64_t cycle_ns,
                  const std::vector<Found>& slaves) {
    std::string out = "[bus]\nlink  = " + link + "\ncycle = " +
                      (cycle_ns % 1'000'000 == 0 ? std::to_string(cycle_ns / 1'000'000) + "ms\n"
                                                 : std::to_string(cycle_ns / 1000) + "us\n");
    std::map<std::string, unsigned> names;
    for (std::size_t i = 0; i < slaves.size(); ++i) {
        const Found& s = slaves[i];
        std::string name = dashed(s.name);
        if (name.empty()) {
            name = "slave-" + std::to_string(i);
        }
        if (const unsigned n = names[name]++; n != 0) {
            name += "-" + std::to_string(i);
        }
        out += "\n[slave " + std::to_string(i) + " " + name + "]" +
               (s.device.empty() ? "" : "  # " + one_line(s.device)) + "\n";
        if (!s.esi.empty()) {
            out += "esi      = " + s.esi + "\n";
        }
        if (!s.order.empty()) {
            out += "device   = " + s.order + "\n";
        }
        if (s.vendor != 0) {
            out += "vendor   = " + hex(s.vendor) + "\n";
        }
        const bool described = !s.esi.empty();
        if (s.product != 0) {
            out += "product  = " + hex(s.product) + "\n";
        }
        if (described || s.revision != 0) {
            out += "revision = " + hex(s.revision) + "+  # or a higher one\n";
        }
        if (!described) {
            const unsigned axes = axes_of(s);
            if (axes != 0) {
                out += "device  = cia402\n";
            }
            if (axes > 1) {
                out += "axes    = " + std::to_string(axes) + "\n";
            }
            std::string options;
            const std::string outputs = objects("outputs", s.rx, axes, options);

            const std::string inputs = objects("inputs", s.tx, axes, options);
            out += outputs + inputs + options + modes(s, axes);
            std::size_t max = 0;  // a slave with a fixed assignment keeps it
            const std::size_t each = std::max(entries_each(s.rx, max), entries_each(s.tx, max));
            if (each != 0 && max == each) {
                out += "entries-per-pdo = " + std::to_string(each) + "\n";
            }
        }
        if (s.assign_activate != 0) {
            out += "dc = sync0\nassign-activate = " + hex(s.assign_activate) + "\n";
        }
    }
    return out;
}

}  // namespace hal::ethercat::config
