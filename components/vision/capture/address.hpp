// SPDX-License-Identifier: MIT
// Where frames come from, as a user writes it: DRIVER:PLACE?OPTION=VALUE&OPTION
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hal::vision {

/// "v4l2:/dev/video0?width=640&fps=30" in its parts. Every reader of an option marks it as known; what is left over is refused.
class Address {
public:
    /// Throws std::invalid_argument, with what is wrong and what to type. [setup]
    explicit Address(std::string_view text);

    const std::string& text() const { return text_; }
    const std::string& driver() const { return driver_; }  ///< "v4l2", "frames", "sim"
    const std::string& place() const { return place_; }

    bool has(const char* name) const;  ///< the option is written
    /// The option's number, `fallback` without it. Throws when it is no number or outside of the limits. [setup]
    double number(const char* name, double fallback, double least, double most);
    /// The same, a whole number.
    int whole(const char* name, int fallback, int least, int most);
    /// `?loop` and `?loop=1` are true, `?loop=0` is not.
    bool flag(const char* name);
    /// A word; `fallback` without it.
    std::string word(const char* name, const char* fallback);
    /// After all options were asked for: throws when there is another one, and names those that there are. [setup]
    void finish() const;

private:
    struct Option {
        std::string name, value;
        bool        has_value = false, asked = false;
    };
    Option*                  find(const char* name);
    std::string              text_, driver_, place_;
    std::vector<Option>      options_;
    std::vector<std::string> known_;
};

}  // namespace hal::vision
