// SPDX-License-Identifier: MIT
// Parsing of `DRIVER:PLACE?key=value&key=value`, for both kinds of bus. [setup]
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "link/address_form.hpp"

namespace hal::link {

/// Returns the text in single quotes.
inline std::string quoted(std::string_view text) { return "'" + std::string(text) + "'"; }

/// A variable of the environment: while it is set, nothing is opened that other programs or devices
/// see. `hal check --deterministic` sets it for its simulations.
inline constexpr const char* links_inside = "HALCYON_LINKS_INSIDE";

/// Prefix of the problem that `apply` below returns for an unknown key.
inline constexpr std::string_view no_option = "unknown option ";

/// Parses `key`, `key=0` or `key=1`. Returns the problem, or "".
inline std::string to_flag(std::string_view key, std::string_view value, bool has_value,
                           bool& flag) {
    if (has_value && value != "0" && value != "1") {
        return "invalid " + std::string(key) + " " + quoted(value) + "; write 0 or 1";
    }
    flag = !has_value || value == "1";
    return {};
}

/// A driver. Its own options stay behind the place, for the driver itself to parse.
template <class Opened, class Options, class Description>
struct Driver {
    AddressForm form;
    Opened (*open)(const std::string& target, const Options&);
    Description (*describe)(const std::string& target);
    bool (*is_own_option)(std::string_view key) = nullptr;
    std::string (*own_options)() = nullptr;  ///< their names, for a message
    /// common options it does not support, separated by blanks
    std::string_view without = {};
    /// how its links are in the journal of a machine
    enum class Journal : std::uint8_t {
        results,  ///< what they give their user
        order,  ///< the order of the calls: a bus in memory is executed again
        carrier,  ///< not at all: their frames travel on another link, which is in the journal
    } journal = Journal::results;

    /// The prefix of its addresses.
    std::string_view name() const { return form.example.substr(0, form.example.find(':')); }

    /// Returns true for a common option that the driver does not support.
    bool ignores(std::string_view key) const {
        const auto at = without.find(key);
        if (key.empty() || at == without.npos) return false;
        const auto end = at + key.size();
        return (at == 0 || without[at - 1] == ' ') &&
               (end == without.size() || without[end] == ' ');
    }
};

/// Writes `can:can0 for an interface of this machine, sim:NAME for a bus in memory or ...`.
template <class Opened, class Options, class Description>
std::string address_forms(std::span<const Driver<Opened, Options, Description>> drivers) {
    std::string text;
    for (const auto& driver : drivers) {
        if (&driver == &drivers.back()) {
            text += " or ";
        } else if (!text.empty()) {
            text += ", ";
        }
        text.append(driver.form.example).append(" for ").append(driver.form.purpose);
    }
    return text;
}

/// Opens an address with the driver that it names. `apply(key, value, has_value, options)` applies
/// an option and returns the problem, or ""; `kind` completes "'x' is not the address of ".
/// `open(driver, target, options)` calls the driver.
template <class Opened, class Options, class Description, class Apply, class Open>
Opened open_address(std::string_view address, Options options,
                    std::span<const Driver<Opened, Options, Description>> drivers, Apply apply,
                    std::string_view kind, Open open) {
    const auto colon = address.find(':');
    const auto driver = std::find_if(drivers.begin(), drivers.end(), [&](const auto& d) {
        return d.name() == address.substr(0, colon);
    });
    if (colon == address.npos || driver == drivers.end()) {
        return {nullptr, quoted(address) + " is not the address of " + std::string(kind) +
                             "; write " + address_forms(drivers)};
    }

    const bool is_carried =
        driver->journal == Driver<Opened, Options, Description>::Journal::carrier;
    if (driver->form.reach == Reach::bus && !is_carried && std::getenv(links_inside) != nullptr) {
        return {nullptr, quoted(address) +
                             " leads to other programs or devices, which a check "
                             "must not operate; write sim:NAME"};
    }

    const auto target = address.substr(colon + 1);
    const auto question = std::min(target.find('?'), target.size());
    auto rest = target.substr(std::min(question + 1, target.size()));
    std::string where(target.substr(0, question));
    const char* separator = "?";
    while (!rest.empty()) {
        const auto end = std::min(rest.find('&'), rest.size());
        const auto item = rest.substr(0, end);
        rest.remove_prefix(std::min(end + 1, rest.size()));
        const auto equals = std::min(item.find('='), item.size());
        const auto key = item.substr(0, equals);
        const bool has_value = equals < item.size();
        if (driver->is_own_option != nullptr && driver->is_own_option(key)) {
            where.append(std::exchange(separator, "&")).append(item);
            continue;
        }
        std::string problem = apply(key, has_value ? item.substr(equals + 1) : std::string_view{},
                                    has_value, options);
        if (problem.starts_with(no_option) && driver->own_options != nullptr) {
            problem += ", and for " + std::string(driver->name()) + ": " + driver->own_options();
        }
        if (problem.empty() && driver->ignores(key)) {
            problem = std::string(driver->name()) + " does not support the option " + quoted(key) +
                      "; remove it";
        }
        if (!problem.empty()) {
            return {nullptr, std::string(address) + ": " + problem};
        }
    }
    try {
        auto opened = open(*driver, where, options);
        if (!opened) {
            opened.problem = std::string(address) + ": " + opened.problem;
        }
        return opened;
    } catch (const std::exception& e) {
        return {nullptr, std::string(address) + ": " + e.what()};
    }
}

/// Describes what the driver would open, without opening it. The driver's own options stay behind
/// the place.
template <class Opened, class Options, class Description>
Description describe_address(std::string_view address,
                             std::span<const Driver<Opened, Options, Description>> drivers) {
    const auto colon = address.find(':');
    const auto driver = std::find_if(drivers.begin(), drivers.end(), [&](const auto& d) {
        return d.name() == address.substr(0, colon);
    });
    if (colon == address.npos || driver == drivers.end()) {
        return Description{.address = std::string(address), .transport = {}};
    }
    const auto target = address.substr(colon + 1);
    const auto question = std::min(target.find('?'), target.size());
    std::string where(target.substr(0, question));
    const char* separator = "?";
    for (auto rest = target.substr(std::min(question + 1, target.size())); !rest.empty();) {
        const auto item = rest.substr(0, rest.find('&'));
        rest.remove_prefix(std::min(item.size() + 1, rest.size()));
        if (driver->is_own_option != nullptr &&
            driver->is_own_option(item.substr(0, item.find('=')))) {
            where.append(std::exchange(separator, "&")).append(item);
        }
    }
    return driver->describe(where);
}

}  // namespace hal::link
