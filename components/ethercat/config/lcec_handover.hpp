// SPDX-License-Identifier: MIT
// How the program lcec_conf gives the path of its file to the component lcec: in a file of the
// machine's process, which the program removes at its end.
#pragma once

#include <string>

namespace hal::ethercat::config {

/// Gives the path of a configuration to the machine with this process ID, as long as this object
/// lives. [setup]
class LcecHandover {
public:
    LcecHandover(long machine, const std::string& path);
    ~LcecHandover();
    LcecHandover(const LcecHandover&) = delete;
    /// Returns why the file could not be written, or an empty text.
    const std::string& problem() const { return problem_; }

private:
    std::string file_, problem_;
};

/// Returns the path that a living lcec_conf has given to this machine, or an empty text. [setup]
std::string lcec_configuration(long machine);

}  // namespace hal::ethercat::config
