// SPDX-License-Identifier: MIT
#include "cli/option_set.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fmt/core.h>
#include <type_traits>

#include "base/types.hpp"
#include "text/quoting.hpp"

namespace hal::tools {
namespace {

bool is_whole(std::string_view text) {
    if (text.starts_with('-') || text.starts_with('+')) {
        text.remove_prefix(1);
    }
    return !text.empty() && text.find_first_not_of("0123456789") == text.npos;
}

}  // namespace

void DeclaredOption::in(int min, int max) {
    option_->check(CLI::Range(min, max).description(fmt::format("{}..{}", min, max)));
}
void DeclaredOption::in(double min, double max) { option_->check(CLI::Range(min, max)); }
void DeclaredOption::finite() {
    option_->check([](const std::string& text) {
        char* end = nullptr;
        const double value = std::strtod(text.c_str(), &end);
        const bool is_number = end != text.c_str() && *end == '\0';
        return is_number && !std::isfinite(value) ? fmt::format("{} is not a finite number", text)
                                                  : std::string();
    });
}
void DeclaredOption::quietly_in(int min, int max) {
    option_->check(CLI::Range(min, max).description(""));
}
void DeclaredOption::not_negative() {
    option_->check([](const std::string& text) {
        if (text.starts_with('-')) {
            return fmt::format("{} is negative; use 0 or more", text);
        }
        return std::isnan(std::strtod(text.c_str(), nullptr))
                   ? fmt::format("{} is not a number; use 0 or more", text)
                   : std::string();
    });
}
void DeclaredOption::fits_64_bits() {
    option_->check([](const std::string& text) {
        errno = 0;
        std::strtoull(text.c_str(), nullptr, 0);
        return errno == ERANGE ? fmt::format("{} is too large; use at most {}", text, UINT64_MAX)
                               : std::string();
    });
}

OptionSet::OptionSet(Options& options, const char* name, const char* summary)
    : options_(options), app_(std::make_unique<CLI::App>(summary, fmt::format("hal {}", name))) {
    options.declare(*this);
    app_->set_help_flag("-h,--help", "print this");
    app_->allow_extras();  // the caller formats the message
}

OptionSet::~OptionSet() = default;

void OptionSet::words(const char* name, const std::string& what, bool required) {
    CLI::Option* option = app_->add_option(name, options_.words, what);
    if (required) {
        option->required();
    }
}

void OptionSet::word(const char* name, const std::string& what) {
    app_->add_option(name, options_.words, what)->required()->expected(1)->allow_extra_args(false);
}

void OptionSet::flag(const char* names, bool& to, const char* what) {
    app_->add_flag(names, to, what);
}

void OptionSet::flag(const char* names, const std::function<void()>& given, const char* what) {
    app_->add_flag_callback(names, given, what);
}

template <class T>
DeclaredOption OptionSet::value(const char* names, T& to, const char* type,
                                const std::string& what) {
    DeclaredOption option(app_->add_option(names, to, what)->type_name(type));
    if (std::is_floating_point_v<T>) {
        option.finite();
    }
    if (std::is_unsigned_v<T>) {
        option.not_negative();  // a negative number would wrap around
    }
    if (std::is_same_v<T, std::uint64_t>) {
        option.fits_64_bits();  // a larger number would become the largest one
    }
    return option;
}
template DeclaredOption OptionSet::value(const char*, std::string&, const char*,
                                         const std::string&);
template DeclaredOption OptionSet::value(const char*, double&, const char*, const std::string&);
template DeclaredOption OptionSet::value(const char*, int&, const char*, const std::string&);
template DeclaredOption OptionSet::value(const char*, unsigned&, const char*, const std::string&);
template DeclaredOption OptionSet::value(const char*, std::uint16_t&, const char*,
                                         const std::string&);
template DeclaredOption OptionSet::value(const char*, std::uint64_t&, const char*,
                                         const std::string&);
template DeclaredOption OptionSet::value(const char*, std::int64_t&, const char*,
                                         const std::string&);

void OptionSet::values(const char* names, std::vector<std::string>& to, const char* type,
                       const char* what) {
    app_->add_option(names, to, what)->type_name(type)->allow_extra_args(false);
}

void OptionSet::duration(const char* name, std::int64_t& to, const char* what, std::int64_t min_ns,
                         const char* examples) {
    const auto take = [name, &to, min_ns, examples](const std::string& text) {
        const auto ns = parse_duration_ns(text);
        if (!ns || *ns < min_ns) {
            throw CLI::ValidationError(
                name, fmt::format("invalid duration '{}'; use {}", text, examples));
        }
        to = *ns;
    };
    app_->add_option_function<std::string>(name, take, what)->type_name("TIME");
}

void OptionSet::for_how_long(std::int64_t& to, const char* what) {
    duration("--for", to, what, 0, "10s, 250ms or 2min");
}

void OptionSet::keep_rest() { app_->prefix_command(); }

OptionSet::Reading OptionSet::read(std::vector<std::string> arguments) {
    Reading reading;
    try {
        std::reverse(arguments.begin(), arguments.end());  // CLI11 takes them from the back
        app_->parse(std::move(arguments));
        reading.extra = app_->remaining();
    } catch (const CLI::CallForHelp&) {
        reading.outcome = Outcome::help;
    } catch (const CLI::RequiredError&) {
        reading.outcome = Outcome::missing;
    } catch (const CLI::ParseError& error) {
        reading.outcome = Outcome::bad;
        std::string& what = reading.problem = error.what();
        constexpr std::string_view unread = "Could not convert: ";  // --speed = fast
        if (const auto equals = what.find(" = ");
            what.starts_with(unread) && equals != std::string::npos) {
            what =
                fmt::format("{}: '{}' is {}", what.substr(unread.size(), equals - unread.size()),
                            what.substr(equals + 3),
                            is_whole(std::string_view(what).substr(equals + 3)) ? "out of range"
                                                                                : "not a number");
        }
        std::replace(what.begin(), what.end(), '\n', ' ');
    }
    return reading;
}

namespace {

OptionSet::Row positional_row(const CLI::Option& option) {
    OptionSet::Row row;
    row.positional = true;
    row.names = option.get_name(true);
    row.text = option.get_description();
    return row;
}

OptionSet::Row option_row(const CLI::Option& option) {
    OptionSet::Row row;
    row.text = option.get_description();
    row.long_names = option.get_lnames();
    row.short_names = option.get_snames();
    row.takes_value = option.get_expected_min() > 0 && !option.get_type_name().empty();
    for (const std::string& name : row.short_names) {
        append_item(row.names, "-" + name);
    }
    for (const std::string& name : row.long_names) {
        append_item(row.names, "--" + name);
    }
    if (row.takes_value) {
        row.names += " " + option.get_type_name();
    }
    return row;
}

}  // namespace

std::vector<OptionSet::Row> OptionSet::rows() const {
    const auto options = std::as_const(*app_).get_options();
    std::vector<Row> rows;
    for (const CLI::Option* option : options) {
        if (option->get_positional()) {
            rows.push_back(positional_row(*option));
        }
    }
    for (const CLI::Option* option : options) {
        if (option->nonpositional()) {
            rows.push_back(option_row(*option));
        }
    }
    return rows;
}

std::string OptionSet::help() const {
    std::string text;
    bool in_options = false;
    for (const Row& row : rows()) {
        if (!row.positional && !in_options) {
            text += "\n";
            in_options = true;
        }
        text += row.positional ? fmt::format("\n  {:24} {}", row.names, row.text)
                               : fmt::format("  {:24} {}\n", row.names, row.text);
    }
    return text;
}

std::vector<std::string> OptionSet::names() const {
    std::vector<std::string> names;
    for (const Row& row : rows()) {
        for (const std::string& name : row.long_names) {
            names.push_back("--" + name);
        }
        for (const std::string& name : row.short_names) {
            names.push_back("-" + name);
        }
    }
    return names;
}

}  // namespace hal::tools
