// SPDX-License-Identifier: MIT
// Why an instance cannot be created or started, as a typed exception (hal_rejection in hal/abi.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>

#include "hal/abi.h"

namespace hal {

/// A reason why an instance cannot be created or started, with its cause. `text` is one sentence
/// without a final full stop. Any other exception works as well and is reported for the instance as
/// a whole.
class Rejection : public std::invalid_argument {
public:
    Rejection(hal_subject subject, std::string name, const std::string& text, std::string help = "")
        : std::invalid_argument(text),
          subject_(subject),
          name_(std::move(name)),
          help_(std::move(help)) {}
    /// Limits the rejection to the bytes `begin` to `end` of the argument's value.
    Rejection&& at(std::size_t begin, std::size_t end) && {
        begin_ = static_cast<std::uint32_t>(begin);
        end_ = static_cast<std::uint32_t>(end);
        return std::move(*this);
    }
    /// Passes the rejection to the host; to one without hal_host::reject only the text. [setup]
    void report(const hal_host* host) const {
        const hal_rejection rejection{
            sizeof rejection, subject_, name_.c_str(), begin_, end_, "", what(), help_.c_str()};
        if (host->size > HAL_HOST_SIZE_1_1 && host->reject != nullptr) {
            host->reject(host, &rejection);
        } else {
            host->fail(host, what());
        }
    }

private:
    hal_subject subject_;
    std::string name_, help_;
    std::uint32_t begin_ = 0;
    std::uint32_t end_ = 0;
};

/// An invalid load argument: `throw hal::ArgumentError("window", "window=4 is even; use 5")` is
/// shown at that argument of the loadrt line.
class ArgumentError : public Rejection {
public:
    ArgumentError(std::string argument, const std::string& text, std::string help = "")
        : Rejection(HAL_SUBJECT_ARGUMENT, std::move(argument), text, std::move(help)) {}
};

}  // namespace hal
