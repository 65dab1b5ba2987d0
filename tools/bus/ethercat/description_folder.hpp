// SPDX-License-Identifier: MIT
// The descriptions (ESI, ETG.2000) of a folder, searched by the identity of a slave.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "ethercat/esi/lookup.hpp"

namespace hal::tools {

/// Everything here is [setup].
class DescriptionFolder {
public:
    /// The description of a slave.
    struct Choice {
        const ethercat::esi::File* file = nullptr;
        std::filesystem::path path;
        ethercat::esi::Match match;  ///< without a device: no file describes the slave
    };

    /// Reads all files `*.xml` of the folder, of a single file only that one. Returns the problem,
    /// empty for success. A file of a folder that cannot be read is skipped and noted.
    std::string open(const std::filesystem::path& path);
    /// Returns the best description of a slave: one of its revision before one that accepts it, and
    /// this before one of another revision.
    Choice find(std::uint32_t vendor, std::uint32_t product, std::uint32_t revision) const;
    /// Returns a sentence for each file that was skipped.
    const std::vector<std::string>& notes() const noexcept { return notes_; }

private:
    struct Described {
        std::filesystem::path path;
        ethercat::esi::File file;
    };
    /// Returns why the file is left out; empty: it is added.
    std::string add(const std::filesystem::path& path);

    std::vector<Described> files_;
    std::vector<std::string> notes_;
};

}  // namespace hal::tools
