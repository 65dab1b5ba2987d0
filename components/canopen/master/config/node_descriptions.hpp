// SPDX-License-Identifier: MIT
// The files that a configuration names: device descriptions, firmware, domain data. [setup]
#pragma once

#include <map>
#include <memory>

#include "canopen/eds/eds.hpp"
#include "config_lines.hpp"

namespace hal::canopen::config {

/// Device descriptions by their path, each read once.
class Descriptions {
public:
    Descriptions(const ReadFile& read, std::string folder)
        : read_(read), folder_(std::move(folder)) {}
    /// Returns nullptr after reporting an error at the value that names the file.
    const eds::DeviceDescription* get(const Word& file, Report& report);
    /// Reads a file that the configuration names. Returns false after reporting an error.
    bool bytes(const Word& file, std::vector<std::uint8_t>& to, Report& report);
    /// Reads a file that another file names. Returns false and sets `why`.
    bool bytes(const std::string& file, std::vector<std::uint8_t>& to, std::string& why);

private:
    std::string path(const Word& file) const;
    bool read(const Word& file, std::string& bytes, Report& report);

    const ReadFile& read_;
    std::string folder_;
    std::map<std::string, std::unique_ptr<eds::DeviceDescription>> known_;
};

}  // namespace hal::canopen::config
