// SPDX-License-Identifier: MIT
#include "ethercat/config/pdo_placement.hpp"

#include <algorithm>

#include "ethercat/config/pdo_rules.hpp"

namespace hal::ethercat::config {

namespace {

/// Returns whether a PDO of the description has exactly these entries.
bool has_entries(const esi::Pdo& pdo, const std::vector<master::Entry>& entries) {
    return std::equal(entries.begin(), entries.end(), pdo.entries.begin(), pdo.entries.end(),
                      [](const master::Entry& a, const esi::Entry& b) {
        return a.index == b.index && a.sub == b.sub && a.bits == b.bits;
    });
}

std::vector<std::string> pdo_texts(const std::vector<esi::Pdo>& pdos) {
    std::vector<std::string> texts;
    for (const esi::Pdo& p : pdos) {
        texts.push_back(pdo_text(p.index));
    }
    return texts;
}

}  // namespace

const std::vector<esi::Pdo>& PdoPlacement::described() const {
    static const std::vector<esi::Pdo> none;
    if (device_ == nullptr) return none;
    return output_ ? device_->rx : device_->tx;
}

void PdoPlacement::place(const Line& line, master::SyncManager& sm,
                         std::vector<master::Entry>& entries) {
    output_ = sm.output;
    const auto& pdos = described();
    const auto same = std::find_if(pdos.begin(), pdos.end(),
                                   [&](const esi::Pdo& p) { return has_entries(p, entries); });
    if (same != pdos.end() && sm.pdos.empty()) {  // nothing has to be written
        sm.pdos.push_back({same->index, std::move(entries), false});
        return;
    }
    if (const std::string reason = fixed_reason(); !reason.empty()) {
        const auto names = pdo_texts(pdos);
        return in_.report.error(Topic::object, line.value.at, reason,
                                names.empty()
                                    ? "delete the line"
                                    : "delete the line, or assign PDOs: " + listed(names));
    }
    std::vector<std::uint16_t> free = free_pdos(sm);
    if (!pdos.empty() && free.empty()) {
        return in_.report.error(
            Topic::object, line.value.at,
            "all PDOs of '" + in_.info.type + "' in this direction are fixed",
            "assign one of them, as in " + line.key.text + " = " + pdo_text(pdos[0].index));
    }
    if (choose(line, free)) {
        fill(line, free, sm, entries);
    }
}

/// Returns why the PDOs of the device cannot be mapped, or an empty text.
std::string PdoPlacement::fixed_reason() const {
    if (device_ == nullptr) return {};
    const std::string fixed = "the PDOs of '" + in_.info.type + "' are fixed: ";
    if (!device_->mailbox || !device_->mailbox->has(MailboxType::coe)) {
        return fixed + "it has no CoE mailbox to map objects with";
    }
    return device_->mailbox->pdo_config ? "" : fixed + "its description has no PdoConfig";
}

/// Returns the PDOs that can be mapped together with those that the line names.
std::vector<std::uint16_t> PdoPlacement::free_pdos(const master::SyncManager& sm) const {
    if (device_ == nullptr) return {};
    std::vector<std::uint16_t> free = mappable(*device_, output_);
    const auto excludes = [&](const master::Pdo& assigned, std::uint16_t other) {
        const esi::Pdo* a = device_->find_pdo(assigned.index);
        const esi::Pdo* b = device_->find_pdo(other);
        return assigned.index == other ||
               (a != nullptr && b != nullptr && exclude_each_other(*a, *b));
    };
    std::erase_if(free, [&](std::uint16_t other) {
        return std::any_of(sm.pdos.begin(), sm.pdos.end(),
                           [&](const master::Pdo& p) { return excludes(p, other); });
    });
    return free;
}

/// Reads `outputs.pdo`. Returns false after reporting a PDO that cannot be mapped.
bool PdoPlacement::choose(const Line& line, std::vector<std::uint16_t>& free) {
    const std::string key = line.key.text + ".pdo";
    const Line* chosen = in_.keys.find(key);
    if (chosen == nullptr) return true;
    const auto at = parse_address(chosen->value, in_.report);
    if (!at || at->has_sub) {
        in_.keys.reject(*chosen, "the index of a PDO, as in 1601");
        return false;
    }
    if (device_ != nullptr && std::find(free.begin(), free.end(), at->index) == free.end()) {
        in_.report.error(
            Topic::object, chosen->value.at,
            "PDO " + pdo_text(at->index) + " of '" + in_.info.type + "' cannot be mapped",
            "write " + key + " = " + pdo_text(free[0]) + ", or delete the line");
        return false;
    }
    free.assign(1, at->index);
    return true;
}

/// Returns how many entries a PDO takes; 0: any number.
std::uint64_t PdoPlacement::limit_of(std::uint16_t pdo) const {
    const std::uint64_t described = device_ != nullptr ? max_entries(*device_, pdo) : 0;
    if (described == 0) return max_entries_;
    return max_entries_ == 0 ? described : std::min(max_entries_, described);
}

void PdoPlacement::fill(const Line& line, const std::vector<std::uint16_t>& free,
                        master::SyncManager& sm, std::vector<master::Entry>& entries) {
    const unsigned usual = output_ ? 0x1600 : 0x1a00;
    const unsigned first = free.empty() ? usual : free[0];
    std::string taken;  // of the PDOs, for a message
    std::size_t next = 0;
    for (std::size_t used = 0; next < entries.size(); ++used) {
        if (!described().empty() && used == free.size()) {
            return in_.report.error(
                Topic::object, line.value.at,
                counted(entries.size(), "object") + " do not fit in the PDOs of '" + in_.info.type +
                    "': " + taken,
                "leave out " + std::to_string(entries.size() - next) + " of them" +
                    (max_entries_ != 0 ? ", or raise entries-per-pdo" : ""));
        }
        master::Pdo p;
        p.index = used < free.size() ? free[used] : static_cast<std::uint16_t>(first + used);
        p.write_mapping = true;
        const std::uint64_t limit = limit_of(p.index);
        while (next < entries.size() && (limit == 0 || p.entries.size() < limit)) {
            p.entries.push_back(std::move(entries[next]));
            ++next;
        }
        taken +=
            (taken.empty() ? "" : ", ") + pdo_text(p.index) + " takes " + std::to_string(limit);
        sm.pdos.push_back(std::move(p));
    }
}

}  // namespace hal::ethercat::config
