// SPDX-License-Identifier: MIT
// The options of one command: names, help, and what reading a command line does. Only the source of
// this header includes CLI11, which is slow to compile.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "cli/options.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace hal::tools {

/// An option that was just declared, for limits on its value.
class DeclaredOption {
public:
    explicit DeclaredOption(CLI::Option* option) : option_(option) {}
    void in(int min, int max);  ///< the help shows the range
    void in(double min, double max);
    void quietly_in(int min, int max);  ///< the help does not show it
    void not_negative();
    void fits_64_bits();
    void finite();

private:
    CLI::Option* option_;
};

class OptionSet {
public:
    /// Calls options.declare(). `options` must outlive the set.
    OptionSet(Options& options, const char* name, const char* summary);
    ~OptionSet();
    OptionSet(const OptionSet&) = delete;

    /// Declares the positional arguments, under the name that the help shows.
    void words(const char* name, const std::string& what, bool required = true);
    /// Declares one required positional argument.
    void word(const char* name, const std::string& what);
    void flag(const char* names, bool& to, const char* what);
    /// Declares a flag that calls `given` when it is typed.
    void flag(const char* names, const std::function<void()>& given, const char* what);
    /// Declares an option with a value; `type` is the word for it in the help. Defined for strings
    /// and the number types in use.
    template <class T>
    DeclaredOption value(const char* names, T& to, const char* type, const std::string& what);
    /// Declares an option that takes one value and may be repeated.
    void values(const char* names, std::vector<std::string>& to, const char* type,
                const char* what);
    /// Declares an option that takes a duration in ns, at least `min_ns`. A message about an
    /// invalid one ends with `examples`.
    void duration(const char* name, std::int64_t& to, const char* what, std::int64_t min_ns = 0,
                  const char* examples = "10ms, 1s or 500us");
    /// Declares --for TIME.
    void for_how_long(std::int64_t& to, const char* what);
    /// Treats everything from the first positional argument on as words, including options.
    void keep_rest();

    enum class Outcome { good, help, missing, bad };
    struct Reading {
        Outcome outcome = Outcome::good;
        std::string problem;  ///< of `bad`
        std::vector<std::string> extra;  ///< arguments that match no declaration
    };
    /// Fills the members of the options.
    Reading read(std::vector<std::string> arguments);
    /// A line of the help.
    struct Row {
        bool positional = false;
        std::string names;  ///< as it is typed: `-N, --name NAME`
        std::string text;
        std::vector<std::string> long_names, short_names;  ///< without dashes
        bool takes_value = false;
    };
    /// Returns the positional arguments, then the options.
    std::vector<Row> rows() const;
    /// Returns the help: a line for each of rows().
    std::string help() const;
    /// Returns the options as they are typed: --name, -n.
    std::vector<std::string> names() const;

private:
    Options& options_;
    std::unique_ptr<CLI::App> app_;
};

}  // namespace hal::tools
