// SPDX-License-Identifier: MIT
// Which PDOs of a slave take the objects that a line lists. Everything here is [setup].
#pragma once

#include "ethercat/config/config_text.hpp"

namespace hal::ethercat::config {

class PdoPlacement {
public:
    /// `device`: the description, or nullptr; `max_entries`: of a PDO, 0: unlimited.
    PdoPlacement(SlaveInput in, const esi::Device* device, std::uint64_t max_entries)
        : in_(in), device_(device), max_entries_(max_entries) {}

    /// Adds PDOs with the entries to a sync manager, or reports that none can take them.
    void place(const Line& line, master::SyncManager& sm, std::vector<master::Entry>& entries);

private:
    const std::vector<esi::Pdo>& described() const;
    std::string fixed_reason() const;
    std::vector<std::uint16_t> free_pdos(const master::SyncManager& sm) const;
    bool choose(const Line& line, std::vector<std::uint16_t>& free);
    std::uint64_t limit_of(std::uint16_t pdo) const;
    void fill(const Line& line, const std::vector<std::uint16_t>& free, master::SyncManager& sm,
              std::vector<master::Entry>& entries);

    SlaveInput in_;
    const esi::Device* device_;
    std::uint64_t max_entries_;
    bool output_ = false;
};

}  // namespace hal::ethercat::config
