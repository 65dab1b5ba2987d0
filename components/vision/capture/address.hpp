// SPDX-License-Identifier: MIT
// Parses the address of a frame source: DRIVER:PLACE?OPTION=VALUE&OPTION
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hal::vision {

/// Parsed address such as "v4l2:/dev/video0?width=640&fps=30". Reading an option marks it as known;
/// finish() rejects unknown ones.
class Address {
public:
    /// Throws std::invalid_argument with the reason and a correction. [setup]
    explicit Address(std::string_view text);

    const std::string& text() const { return text_; }
    const std::string& driver() const { return driver_; }  ///< "v4l2", "frames", "sim"
    const std::string& place() const { return place_; }

    bool has(const char* name) const;  ///< the option is present
    /// Returns the option's number, or `fallback` without it. Throws if it is not a number or out
    /// of range. [setup]
    double number(const char* name, double fallback, double min, double max);
    /// Returns an integer option, like number().
    int whole(const char* name, int fallback, int min, int max);
    /// `?loop` and `?loop=1` are true, `?loop=0` is not.
    bool flag(const char* name);
    /// Returns the option's text, or `fallback` without it.
    std::string word(const char* name, const char* fallback);
    /// Call after reading all options: throws if an unknown one is present, and lists the known
    /// ones. [setup]
    void finish() const;

private:
    struct Option {
        std::string name, value;
        bool has_value = false;
        bool asked = false;
    };
    Option* find(const char* name);
    std::string text_, driver_, place_;
    std::vector<Option> options_;
    std::vector<std::string> known_;
};

}  // namespace hal::vision
