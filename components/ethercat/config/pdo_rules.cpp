// SPDX-License-Identifier: MIT
#include "ethercat/config/pdo_rules.hpp"

#include <algorithm>

namespace hal::ethercat::config {

namespace {

const std::vector<esi::Pdo>& described(const esi::Device& device, bool output) {
    return output ? device.rx : device.tx;
}

bool names(const esi::Pdo& p, std::uint16_t other) {
    return std::find(p.exclude.begin(), p.exclude.end(), other) != p.exclude.end();
}

bool is_assigned(const std::vector<master::SyncManager>& managers, std::uint16_t pdo) {
    return std::any_of(managers.begin(), managers.end(), [&](const master::SyncManager& sm) {
        return std::any_of(sm.pdos.begin(), sm.pdos.end(),
                           [&](const master::Pdo& p) { return p.index == pdo; });
    });
}

std::vector<std::uint16_t> assigned_by_default(const PdoContext& context, bool output,
                                               unsigned manager) {
    std::vector<std::uint16_t> out;
    if (context.mode != nullptr && context.mode->samples() != 0) {
        for (const esi::OpMode::Assigned& one : context.mode->assigned) {
            if (one.sync_manager == manager) {
                out.push_back(one.pdo);
            }
        }
        return out;
    }
    for (const esi::Pdo& p : described(context.device, output)) {
        if (p.sync_manager == manager) {
            out.push_back(p.index);
        }
    }
    return out;
}

std::string texts(const std::vector<std::uint16_t>& pdos) {
    std::string out;
    for (const std::uint16_t p : pdos) {
        out += (out.empty() ? "" : " ") + pdo_text(p);
    }
    return out;
}

/// Returns what is wrong with the length of a sync manager, or an empty text.
std::string too_long(const PdoContext& context, const master::SyncManager& sm) {
    const esi::Device& device = context.device;
    if (sm.number >= device.sync_managers.size() || device.sync_managers[sm.number].max_size == 0) {
        return {};
    }
    unsigned bits = 0;
    for (const auto& p : sm.pdos) {
        const esi::Pdo* const d = device.find_pdo(p.index);
        const unsigned samples = d != nullptr && d->oversampling ? context.samples : 1;
        for (const auto& e : p.entries) {
            bits += samples * e.bits;
        }
    }
    const unsigned bytes = (bits + 7) / 8;
    const unsigned max = device.sync_managers[sm.number].max_size;
    if (bytes <= max) {
        return {};
    }
    return "the objects have " + std::to_string(bytes) + " bytes; sync manager " +
           std::to_string(sm.number) + " of '" + context.type + "' takes " + std::to_string(max);
}

/// The rules for the PDOs that a configuration assigns to one direction of a slave.
class PdoCheck {
public:
    PdoCheck(const PdoContext& context, const std::vector<master::SyncManager>& managers,
             bool output, const std::string& key, Span at, Report& report)
        : context_(context),
          managers_(managers),
          output_(output),
          key_(key),
          at_(at),
          report_(report) {}

    void run() {
        check_exclusions();
        check_mandatory();
        for (const master::SyncManager& sm : managers_) {
            check_length(sm);
            check_assignment(sm);
            check_entries(sm);
        }
    }

private:
    void error(std::string sentence, std::string help) {
        report_.error(Topic::object, at_, std::move(sentence), std::move(help));
    }

    std::vector<const esi::Pdo*> assigned() const {
        std::vector<const esi::Pdo*> pdos;
        for (const master::SyncManager& sm : managers_) {
            for (const master::Pdo& p : sm.pdos) {
                if (const esi::Pdo* const described = context_.device.find_pdo(p.index)) {
                    pdos.push_back(described);
                }
            }
        }
        return pdos;
    }

    void check_exclusions() {
        const std::vector<const esi::Pdo*> pdos = assigned();
        for (std::size_t i = 0; i < pdos.size(); ++i) {
            for (std::size_t k = i + 1; k < pdos.size(); ++k) {
                if (!exclude_each_other(*pdos[i], *pdos[k])) continue;
                error("PDOs " + pdo_text(pdos[i]->index) + " and " + pdo_text(pdos[k]->index) +
                          " of '" + context_.type + "' exclude each other",
                      "assign only one of them");
            }
        }
    }

    void check_mandatory() {
        for (const esi::Pdo& p : described(context_.device, output_)) {
            if (!p.mandatory || is_assigned(managers_, p.index)) continue;
            error("PDO " + pdo_text(p.index) + " of '" + context_.type + "' must be assigned",
                  "write it as well: " + key_ + " = " + pdo_text(p.index));
        }
    }

    void check_length(const master::SyncManager& sm) {
        const std::string sentence = too_long(context_, sm);
        if (sentence.empty()) return;
        error(sentence,
              context_.samples > 1 ? "write a smaller number of samples" : "leave out objects");
    }

    /// ETG.2000: only a device with CoE and PdoAssign has an assignment that can be changed.
    void check_assignment(const master::SyncManager& sm) {
        const auto& mailbox = context_.device.mailbox;
        if (mailbox && mailbox->has(MailboxType::coe) && mailbox->pdo_assign) return;
        std::vector<std::uint16_t> wanted;
        for (const master::Pdo& p : sm.pdos) {
            wanted.push_back(p.index);
        }
        const auto fixed = assigned_by_default(context_, output_, sm.number);
        if (wanted == fixed) return;
        error("the assignment of sync manager " + std::to_string(sm.number) + " of '" +
                  context_.type + "' is fixed: " + (fixed.empty() ? "no PDO" : texts(fixed)),
              "write " + key_ + " = default");
    }

    /// Terminals have PDOs with entries longer than their objects.
    void check_entries(const master::SyncManager& sm) {
        for (const master::Pdo& p : sm.pdos) {
            const esi::Pdo* const described = context_.device.find_pdo(p.index);
            if (described == nullptr || p.write_mapping) continue;
            const std::string sentence = esi::longer_entry(context_.device, *described);
            if (sentence.empty()) continue;
            report_.warning(Topic::object, at_, sentence,
                            "the bits of the PDO are exchanged; if its mapping is rejected, "
                            "list the objects");
        }
    }

    const PdoContext& context_;
    const std::vector<master::SyncManager>& managers_;
    bool output_;
    const std::string& key_;
    Span at_;
    Report& report_;
};

}  // namespace

std::string pdo_text(std::uint16_t index) { return bus::index_text(index).substr(2); }

bool exclude_each_other(const esi::Pdo& a, const esi::Pdo& b) {
    return names(a, b.index) || names(b, a.index);
}

unsigned max_entries(const esi::Device& device, std::uint16_t pdo) {
    const esi::Object* object = device.find(pdo);
    if (object == nullptr) return 0;
    unsigned highest = 0;
    for (const esi::Value& v : object->values) {
        highest = std::max<unsigned>(highest, v.sub);
    }
    return highest;
}

std::vector<std::uint16_t> mappable(const esi::Device& device, bool output) {
    std::vector<const esi::Pdo*> together;  // mandatory ones that are fixed are assigned as well
    std::vector<std::uint16_t> out;
    const auto& pdos = described(device, output);
    for (const esi::Pdo& p : pdos) {
        if (p.fixed && p.mandatory) {
            together.push_back(&p);
        }
    }
    const auto take = [&](auto belongs) {
        for (const esi::Pdo& p : pdos) {
            const bool excluded =
                std::any_of(together.begin(), together.end(),
                            [&](const esi::Pdo* other) { return exclude_each_other(p, *other); });
            if (p.fixed || excluded || !belongs(p) ||
                std::find(out.begin(), out.end(), p.index) != out.end()) {
                continue;
            }
            together.push_back(&p);
            out.push_back(p.index);
        }
    };
    take([](const esi::Pdo& p) { return p.mandatory; });
    take([](const esi::Pdo& p) { return p.sync_manager.has_value(); });
    take([](const esi::Pdo&) { return true; });
    return out;
}

void check_pdos(const PdoContext& context, const std::vector<master::SyncManager>& managers,
                bool output, const std::string& key, Span at, Report& report) {
    PdoCheck(context, managers, output, key, at, report).run();
}

}  // namespace hal::ethercat::config
