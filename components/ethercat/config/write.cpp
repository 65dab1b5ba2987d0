// SPDX-License-Identifier: MIT
// Writes a `.ethercat` file for slaves found on a bus or described in an ESI.
#include <algorithm>
#include <cstdio>

#include "ethercat/config/config_text.hpp"

namespace hal::ethercat::config {

namespace {

std::string hex(unsigned value) {
    char out[16];
    std::snprintf(out, sizeof out, "0x%X", value);
    return out;
}

/// Returns "KEY = 6040 u16, 607A s32" for the assigned PDOs; empty if there are none.
std::string objects(const std::string& key, const std::vector<sii::Pdo>& pdos, bool with_types, std::string& options) {
    std::string list;
    unsigned sync_manager = 0xff, index = 0;
    for (const sii::Pdo& p : pdos) {
        if (p.sync_manager == 0xff || (sync_manager != 0xff && p.sync_manager != sync_manager)) continue;
        if (sync_manager == 0xff) sync_manager = p.sync_manager, index = p.index;
        for (const sii::Entry& e : p.entries) {
            if (e.bits == 0) continue;
            const TypeWord* type = type_named(sii::type_name(e.type));
            std::string item = address_text(e.index, e.sub);
            if (e.index == 0) item = "gap " + std::to_string(e.bits);
            else if (type != nullptr && type->bits == e.bits) item += with_types ? std::string(" ") + type->word : "";
            else if (e.bits == 1 || e.bits == 8 || e.bits == 16 || e.bits == 32 || e.bits == 64) item += e.bits == 1 ? " bit" : " u" +
                std::to_string(e.bits);
            else item = "gap " + std::to_string(e.bits);
            if (e.index != 0 && list.find(address_text(e.index, e.sub)) != std::string::npos) item = "gap " + std::to_string(e.bits);
            list += (list.empty() ? "" : ", ") + item;
        }
    }
    if (list.empty()) return {};
    options += key + ".sync-manager = " + std::to_string(sync_manager) + "\n" + key + ".pdo = " +
        address_text(static_cast<std::uint16_t>(index), 0).substr(0, 4) + "\n";
    return key + " = " + list + "\n";
}

/// Returns how many entries each of several assigned PDOs with consecutive numbers has; 0: they differ, or there is at most one.
std::size_t entries_each(const std::vector<sii::Pdo>& pdos, std::size_t& most) {
    std::vector<const sii::Pdo*> assigned;
    for (const sii::Pdo& p : pdos)
        if (p.sync_manager != 0xff) assigned.push_back(&p);
    bool equal = assigned.size() > 1;
    for (std::size_t i = 0; i < assigned.size(); ++i) {
        most = std::max(most, assigned[i]->entries.size());
        equal = equal && assigned[i]->entries.size() == assigned[0]->entries.size() && assigned[i]->index == assigned[0]->index + i;
    }
    return equal ? assigned[0]->entries.size() : 0;
}

std::string one_line(const std::string& text) {
    std::string out;
    for (const char c : text) out += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
    return out;
}

}  // namespace

std::string write(const std::string& link, std::int64_t cycle_ns, const std::vector<Found>& slaves) {
    std::string out = "[bus]\nlink  = " + link + "\ncycle = " + std::to_string(cycle_ns / 1000) + "us\n";
    std::map<std::string, unsigned> names;
    for (std::size_t i = 0; i < slaves.size(); ++i) {
        const Found& s = slaves[i];
        std::string name = dashed(s.name);
        if (name.empty()) name = "slave-" + std::to_string(i);
        if (const unsigned n = names[name]++; n != 0) name += "-" + std::to_string(i);
        out += "\n[slave " + std::to_string(i) + " " + name + "]" + (s.device.empty() ? "" : "  # " + one_line(s.device)) + "\n";
        if (!s.esi.empty()) out += "esi = " + s.esi + "\n";
        if (s.vendor != 0) out += "vendor   = " + hex(s.vendor) + "\n";
        if (s.product != 0) out += "product  = " + hex(s.product) + "\n";
        if (s.revision != 0) out += "revision = " + hex(s.revision) + "+  # or a higher one\n";
        std::string options;
        const bool with_types = s.esi.empty();
        if (with_types) {
            const std::string outputs = objects("outputs", s.rx, with_types, options), inputs = objects("inputs", s.tx, with_types,
                options);
            out += outputs + inputs + options;
            std::size_t most = 0;  // a slave with a fixed assignment keeps it
            const std::size_t each = std::max(entries_each(s.rx, most), entries_each(s.tx, most));
            if (each != 0 && most == each) out += "entries-per-pdo = " + std::to_string(each) + "\n";
        }
        if (s.assign_activate != 0) out += "dc = sync0\nassign-activate = " + hex(s.assign_activate) + "\n";
    }
    return out;
}

}  // namespace hal::ethercat::config
