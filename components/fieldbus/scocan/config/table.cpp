// SPDX-License-Identifier: MIT
#include "table.hpp"

#include <algorithm>
#include <cstdio>

#include "link/timing.hpp"
#include "text/find_row.hpp"
#include "text/quoting.hpp"

namespace hal::scocan {

namespace {
constexpr std::uint16_t no_owner = UINT16_MAX;
}

const char* code_of(Topic topic) {
    constexpr const char* codes[] = {"scocan-line", "scocan-value", "scocan-slots"};
    return codes[static_cast<std::size_t>(topic)];
}
const char* to_string(Role role) {
    constexpr const char* words[] = {"node", "sync", "backup", "monitor", "bridge"};
    return words[static_cast<std::size_t>(role)];
}
const char* to_string(Kind kind) {
    constexpr const char* words[] = {"shared", "private", "sync"};
    return words[static_cast<std::size_t>(kind)];
}
const char* to_string(FieldType type) {
    constexpr const char* words[] = {"u8", "s8", "u16", "s16", "u32", "s32", "f32", "f64"};
    return words[static_cast<std::size_t>(type)];
}
std::uint32_t size_of(FieldType type) noexcept {
    constexpr std::uint32_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
    return sizes[static_cast<std::size_t>(type)];
}

Time Table::bits(std::uint32_t count) const noexcept {
    constexpr Time second = 1'000'000'000;
    // saves a division
    return bit_rate == 1'000'000 ? second / 1'000'000 * count
                                 : can::duration_ns({count, 0}, bit_rate);
}
Time Table::frame(std::uint32_t bytes) const noexcept {
    return can::duration_ns(can::worst_case_bits(bytes, false), bit_rate);
}

const Use* Table::use(std::uint32_t number, std::uint32_t slot,
                      std::uint32_t counter) const noexcept {
    const Mode* m = mode(number);
    if (m == nullptr || slot >= m->slots.size()) return nullptr;
    for (const Use& u : m->slots[slot]) {
        if (u.active(counter)) return &u;
    }
    return nullptr;
}

const Use* Table::owner(std::uint32_t number, std::uint32_t id) const noexcept {
    if (!has_mode(number) || id >= identifiers) return nullptr;
    const auto mode = static_cast<std::size_t>(index_[number]);
    const std::uint16_t slot = owner_slots_[mode * identifiers + id];
    if (slot == no_owner) return nullptr;
    for (const Use& u : modes[mode].slots[slot]) {
        if (std::find(u.ids.begin(), u.ids.end(), id) != u.ids.end()) return &u;
    }
    return nullptr;
}

const Message* Table::message(std::uint32_t id) const noexcept {
    return find_row(messages, id, &Message::id);
}

std::optional<std::size_t> Table::find(std::string_view node) const {
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (nodes[i].name == node) return i;
    }
    return {};
}

std::size_t Table::backups() const noexcept {
    return static_cast<std::size_t>(std::count_if(
        nodes.begin(), nodes.end(), [](const Node& n) { return n.role == Role::backup; }));
}

void Table::index() {
    index_.fill(-1);
    owner_slots_.assign(modes.size() * identifiers, no_owner);
    for (std::size_t i = 0; i < modes.size(); ++i) {
        index_[modes[i].number] = static_cast<int>(i);
        for (std::size_t slot = modes[i].slots.size(); slot-- > 0;) {
            for (const Use& u : modes[i].slots[slot]) {
                for (const std::uint32_t id : u.ids) {
                    if (id < identifiers) {
                        owner_slots_[i * identifiers + id] = static_cast<std::uint16_t>(slot);
                    }
                }
            }
        }
    }
}

std::uint16_t crc16(std::string_view text) noexcept {
    std::uint16_t crc = 0xffff;
    for (const char c : text) {
        crc = static_cast<std::uint16_t>(crc ^ static_cast<unsigned char>(c) << 8);
        for (int i = 0; i < 8; ++i) {
            crc = static_cast<std::uint16_t>(crc & 0x8000 ? crc << 1 ^ 0x1021 : crc << 1);
        }
    }
    return crc;
}

std::string names(const Table& table) {
    std::string text;
    for (const Node& n : table.nodes) {
        append_item(text, n.name);
    }
    return text;
}

std::string microseconds(Time t) {
    char text[40];
    std::snprintf(text, sizeof text, "%.12g us", static_cast<double>(t) / 1e3);
    return text;
}

std::string id_text(std::uint32_t id) {
    char text[16];
    std::snprintf(text, sizeof text, "0x%03X", id);
    return text;
}

namespace {

std::string ns(Time time) { return std::to_string(time) + "ns"; }

std::string line_of(const Node& n) {
    std::string line = "node " + n.name + (n.senses ? " A" : " B");
    if (n.role != Role::node) {
        line += std::string(" ") + to_string(n.role);
    }
    if (n.role == Role::backup) {
        line += " " + std::to_string(n.backup);
    }
    return line;
}

std::string line_of(const Use& u, const Table& t) {
    std::string line = to_string(u.kind);
    if (u.kind == Kind::priv) {
        line += " " + t.nodes[u.node].name + (u.ids.empty() ? " any" : " ");
    }
    for (std::size_t i = 0; i < u.ids.size(); ++i) {
        line += (i == 0 ? "" : ",") + id_text(u.ids[i]);
    }
    if (u.every > 1) {
        line += " every " + std::to_string(u.every) + " offset " + std::to_string(u.offset);
    }
    return line;
}

std::string line_of(const Message& m, const Table& t) {
    std::string line = "message " + m.name + " " + id_text(m.id) + " node " + t.nodes[m.node].name +
                       " bytes " + std::to_string(m.bytes);
    if (m.period > 0) {
        line += (m.event ? " event " : " period ") + ns(m.period);
    }
    if (m.deadline > 0) {
        line += " deadline " + ns(m.deadline);
    }
    if (m.jitter > 0) {
        line += " jitter " + ns(m.jitter);
    }
    for (std::size_t i = 0; i < m.fields.size(); ++i) {
        line += (i == 0 ? " fields " : ",") + m.fields[i].name + ":" + to_string(m.fields[i].type);
    }
    return line;
}

}  // namespace

std::string normalised(const Table& t) {
    std::string text = "bitrate " + std::to_string(t.bit_rate) + "\ncycle " + ns(t.cycle) +
                       "\nslots " + std::to_string(t.slots) + "\nguard " + ns(t.guard) + "\nidle " +
                       ns(t.idle) + "\nlost " + std::to_string(t.lost) + "\n";
    for (const Node& n : t.nodes) {
        text += line_of(n) + "\n";
    }
    for (const Mode& m : t.modes) {
        text += "mode " + std::to_string(m.number) + " " + m.name + "\n";
        for (std::size_t slot = 0; slot < m.slots.size(); ++slot) {
            for (const Use& u : m.slots[slot]) {
                text += std::to_string(slot) + " " + line_of(u, t) + "\n";
            }
        }
    }
    for (const Message& m : t.messages) {
        text += line_of(m, t) + "\n";
    }
    return text;
}

}  // namespace hal::scocan
