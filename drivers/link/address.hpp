// SPDX-License-Identifier: MIT
// Parsing of `DRIVER:PLACE?key=value&key=value`, for both kinds of bus. [setup]
#pragma once

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>

#include "link/address_form.hpp"

namespace hal::link {

/// Returns the text in single quotes.
inline std::string quoted(std::string_view text) { return "'" + std::string(text) + "'"; }

/// A variable of the environment: while it is set, nothing is opened that other programs or devices
/// see. `hal check --deterministic` sets it for its simulations.
inline constexpr const char* links_inside = "HALCYON_LINKS_INSIDE";

/// Prefix of the problem of an unknown option.
inline constexpr std::string_view no_option = "unknown option ";

/// An address `DRIVER:PLACE?OPTIONS` behind its colon.
struct Target {
    explicit Target(std::string_view text)
        : place(text.substr(0, text.find('?'))),
          options(text.substr(std::min(place.size() + 1, text.size()))) {}

    std::string_view place;
    std::string_view options;  ///< `key=value&key&key=value`
};

/// One option of an address, `key` or `key=value`.
struct AddressOption {
    std::string_view text;
    std::string_view key;
    std::string_view value;  ///< empty without `=`
    bool has_value = false;

    /// Removes the first option from `options`, which is not empty, and returns it.
    static AddressOption pop(std::string_view& options) {
        const std::string_view text = options.substr(0, options.find('&'));
        options.remove_prefix(std::min(text.size() + 1, options.size()));
        const std::size_t equals = std::min(text.find('='), text.size());
        const bool has_value = equals < text.size();
        return {text, text.substr(0, equals), text.substr(equals + has_value), has_value};
    }
};

/// A common option of the addresses of a kind of bus. `apply` sets its value, and returns the
/// problem, or "".
template <class Options>
struct OptionRow {
    std::string_view name;
    std::string (*apply)(const AddressOption&, Options&);
};

/// Applies an option of the table. Returns the problem, or "".
template <class Options>
std::string apply_option(std::span<const OptionRow<Options>> rows, const AddressOption& option,
                         Options& options) {
    std::string names;
    for (const auto& row : rows) {
        if (row.name == option.key) return row.apply(option, options);
        names.append(names.empty() ? "" : ", ").append(row.name);
    }
    return std::string(no_option) + quoted(option.key) +
           (rows.size() == 1 ? "; the option is " : "; options are ") + names;
}

/// Returns "invalid KEY 'VALUE'; write EXAMPLE".
inline std::string invalid_value(const AddressOption& option, const std::string& example) {
    return "invalid " + std::string(option.key) + " " + quoted(option.value) + "; write " + example;
}

/// Applies `key`, `key=0` or `key=1`.
template <auto member, class Options>
std::string set_flag(const AddressOption& option, Options& options) {
    if (option.has_value && option.value != "0" && option.value != "1") {
        return invalid_value(option, "0 or 1");
    }
    options.*member = !option.has_value || option.value == "1";
    return {};
}

/// Applies a whole number from `min` to `max`.
template <auto member, long min, long max, class Options>
std::string set_number(const AddressOption& option, Options& options) {
    long number = 0;
    const auto [end, error] =
        std::from_chars(option.value.data(), option.value.data() + option.value.size(), number);
    const bool is_whole = error == std::errc() && end == option.value.data() + option.value.size();
    if (!is_whole || number < min || number > max) {
        return invalid_value(option,
                             "a number " + std::to_string(min) + ".." + std::to_string(max));
    }
    options.*member = static_cast<std::remove_reference_t<decltype(options.*member)>>(number);
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
        order,  ///< the order of the calls: a bus or queues in memory are executed again
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

/// Returns the driver that an address names; nullptr: none of them.
template <class Driver>
const Driver* driver_of(std::string_view address, std::span<const Driver> drivers) {
    const auto colon = address.find(':');
    if (colon == address.npos) return nullptr;
    const auto found = std::find_if(drivers.begin(), drivers.end(), [&](const Driver& driver) {
        return driver.name() == address.substr(0, colon);
    });
    return found == drivers.end() ? nullptr : &*found;
}

/// Splits what stands behind `DRIVER:` into what the driver itself parses, which is the place with
/// the driver's own options, and the common options, each of which `apply(option)` receives.
/// `apply` returns a problem, which ends it, or "".
template <class Driver, class Apply>
std::string split_target(const Driver& driver, std::string_view text, std::string& own,
                         Apply apply) {
    Target target(text);
    own = target.place;
    const char* separator = "?";
    while (!target.options.empty()) {
        const AddressOption option = AddressOption::pop(target.options);
        if (driver.is_own_option != nullptr && driver.is_own_option(option.key)) {
            own.append(std::exchange(separator, "&")).append(option.text);
            continue;
        }
        std::string problem = apply(option);
        if (!problem.empty()) return problem;
    }
    return {};
}

/// How the links of a driver become journaled ones, per kind of bus. `order` may be nullptr.
template <class Opened>
struct JournaledOpen {
    Opened (*results)(const std::function<Opened()>& open);
    Opened (*order)(std::string_view address, const std::function<Opened()>& open);

    /// Opens a link with the driver, as the journal of the calling program has its links.
    template <class Options, class Description>
    Opened operator()(const Driver<Opened, Options, Description>& driver, const std::string& target,
                      const Options& options) const {
        using Journal = typename Driver<Opened, Options, Description>::Journal;
        const auto open = [&] { return driver.open(target, options); };
        if (driver.journal == Journal::results && results != nullptr) return results(open);
        if (driver.journal == Journal::order && order != nullptr) {
            return order(std::string(driver.name()) + ":" + target, open);
        }
        return open();
    }
};

/// Opens an address with the driver that it names. `kind` completes "'x' is not the address of ".
template <class Opened, class Options, class Description>
Opened open_address(std::string_view address, Options options,
                    std::span<const Driver<Opened, Options, Description>> drivers,
                    std::span<const OptionRow<Options>> rows, std::string_view kind,
                    const JournaledOpen<Opened>& open) {
    const auto* const driver = driver_of(address, drivers);
    if (driver == nullptr) {
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

    const std::string name(driver->name());
    const auto apply_common = [&](const AddressOption& option) {
        std::string problem = apply_option(rows, option, options);
        if (problem.starts_with(no_option) && driver->own_options != nullptr) {
            problem += ", and for " + name + ": " + driver->own_options();
        }
        if (problem.empty() && driver->ignores(option.key)) {
            problem = name + " does not support the option " + quoted(option.key) + "; remove it";
        }
        return problem;
    };
    const auto problem_of = [&](const std::string& problem) {
        return std::string(address) + ": " + problem;
    };
    std::string target;
    const std::string problem =
        split_target(*driver, address.substr(name.size() + 1), target, apply_common);
    if (!problem.empty()) return {nullptr, problem_of(problem)};
    try {
        auto opened = open(*driver, target, options);
        if (!opened) {
            opened.problem = problem_of(opened.problem);
        }
        return opened;
    } catch (const std::exception& e) {
        return {nullptr, problem_of(e.what())};
    }
}

/// Describes what the driver would open, without opening it.
template <class Opened, class Options, class Description>
Description describe_address(std::string_view address,
                             std::span<const Driver<Opened, Options, Description>> drivers) {
    const auto* const driver = driver_of(address, drivers);
    if (driver == nullptr) {
        return Description{.address = std::string(address), .transport = {}};
    }
    std::string target;
    split_target(*driver, address.substr(driver->name().size() + 1), target,
                 [](const AddressOption&) { return std::string(); });
    return driver->describe(target);
}

}  // namespace hal::link
