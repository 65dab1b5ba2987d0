// SPDX-License-Identifier: MIT
#include "ethercat/esi/lookup.hpp"

#include <algorithm>
#include <cstdio>

#include "text/characters.hpp"
#include "text/numbers.hpp"

namespace hal::ethercat::esi {

namespace {

using Candidates = std::vector<const Device*>;

template <class Belongs>
Candidates filtered(const Candidates& from, Belongs belongs) {
    Candidates out;
    std::copy_if(from.begin(), from.end(), std::back_inserter(out),
                 [&](const Device* d) { return belongs(*d); });
    return out;
}

Candidates named(const Candidates& all, std::string_view name) {
    Candidates out = filtered(all, [&](const Device& d) { return same_word(d.order, name); });
    if (!out.empty()) return out;
    out = filtered(all, [&](const Device& d) { return same_word(d.name, name); });
    if (!out.empty()) return out;
    const auto product = parse_natural(name);
    if (!product) return {};
    return filtered(all, [&](const Device& d) { return d.product == *product; });
}

bool is_same_type(const Device& a, const Device& b) {
    return a.product == b.product && same_word(a.order, b.order);
}

bool is_one_type(const Candidates& devices) {
    return std::all_of(devices.begin(), devices.end(),
                       [&](const Device* d) { return is_same_type(*d, *devices.front()); });
}

/// A description without a rule is valid for its own revision and higher ones.
bool accepts_revision(const Device& d, std::uint32_t revision) {
    return accepts(d.check_revision.value_or(RevisionRule::equal_or_higher), d.revision, revision);
}

const Device* newest(const Candidates& devices) {
    return *std::max_element(devices.begin(), devices.end(), [](const Device* a, const Device* b) {
        return a->revision < b->revision;
    });
}

void add_once(std::vector<std::string>& to, const std::string& text) {
    if (!text.empty() && std::find(to.begin(), to.end(), text) == to.end()) {
        to.push_back(text);
    }
}

/// Returns what distinguishes the devices: their order codes, or their product codes if those are
/// the same.
std::vector<std::string> choices_of(const Candidates& devices) {
    std::vector<std::string> orders;
    std::vector<std::string> products;
    for (const Device* d : devices) {
        add_once(orders, d->order);
        add_once(products, number_text(d->product));
    }
    return orders.size() > 1 ? orders : products;
}

std::vector<std::string> orders_of(const Candidates& devices) {
    std::vector<std::string> orders;
    for (const Device* d : devices) {
        add_once(orders, d->order.empty() ? number_text(d->product) : d->order);
    }
    return orders;
}

Match no_match(std::string problem, std::vector<std::string> choices = {}) {
    Match match;
    match.problem = std::move(problem);
    match.choices = std::move(choices);
    return match;
}

Match several(const Candidates& devices, const Wanted& wanted) {
    std::string problem = "describes several devices";
    if (!wanted.name.empty()) {
        problem += " '" + std::string(wanted.name) + "'";
    } else if (wanted.product) {
        problem += " with the product code " + number_text(*wanted.product);
    }
    return no_match(problem, choices_of(devices));
}

/// Chooses among devices of one type.
Match revision_of(const Candidates& devices, const Wanted& wanted) {
    if (!wanted.revision) return {newest(devices), Match::Revision::newest};
    const std::uint32_t revision = *wanted.revision;
    const auto exact = filtered(devices, [&](const Device& d) { return d.revision == revision; });
    if (!exact.empty()) return {exact.front(), Match::Revision::exact};
    const auto accepting =
        filtered(devices, [&](const Device& d) { return accepts_revision(d, revision); });
    if (!accepting.empty()) return {newest(accepting), Match::Revision::accepted};
    return {newest(devices), Match::Revision::other};
}

/// Leaves the types that the wanted revision selects.
Candidates of_revision(const Candidates& devices, std::uint32_t revision) {
    const auto exact = filtered(devices, [&](const Device& d) { return d.revision == revision; });
    if (!exact.empty()) return exact;
    const auto by_rule = filtered(devices, [&](const Device& d) {
        return d.check_revision && accepts_revision(d, revision);
    });
    return by_rule.empty() ? devices : by_rule;
}

}  // namespace

Match look_up(const File& file, const Wanted& wanted) {
    Candidates devices;
    for (const Device& d : file.devices) {
        devices.push_back(&d);
    }
    if (devices.empty()) return no_match("describes no device");
    const Candidates all = devices;
    if (!wanted.name.empty()) {
        devices = named(devices, wanted.name);
        if (devices.empty()) {
            return no_match("does not describe a device '" + std::string(wanted.name) + "'",
                            orders_of(all));
        }
    }
    if (wanted.product) {
        devices = filtered(devices, [&](const Device& d) { return d.product == *wanted.product; });
        if (devices.empty()) {
            return no_match("does not describe a product " + number_text(*wanted.product),
                            orders_of(all));
        }
    }
    if (wanted.vendor != 0) {
        const std::uint32_t found = devices.front()->vendor;
        devices = filtered(
            devices, [&](const Device& d) { return d.vendor == 0 || d.vendor == wanted.vendor; });
        if (devices.empty()) {
            return no_match("describes devices of vendor " + number_text(found) + ", not of " +
                            number_text(wanted.vendor));
        }
    }
    if (!is_one_type(devices) && wanted.revision) {
        devices = of_revision(devices, *wanted.revision);
    }
    if (!is_one_type(devices)) return several(devices, wanted);
    return revision_of(devices, wanted);
}

std::string number_text(std::uint32_t number) {
    char text[16];
    std::snprintf(text, sizeof text, "0x%08x", number);
    return text;
}

std::vector<std::string> revisions_of(const File& file, const Device& device) {
    std::vector<std::string> out;
    for (const Device& d : file.devices) {
        if (is_same_type(d, device)) {
            add_once(out, number_text(d.revision));
        }
    }
    return out;
}

}  // namespace hal::ethercat::esi
