// SPDX-License-Identifier: MIT
// The process data of a slave in a `.ethercat` file: which objects are in which PDO, and what their
// pins are. Everything here is [setup].
#pragma once

#include <set>

#include "ethercat/config/config_text.hpp"

namespace hal::ethercat::config {

/// What is known of an object.
struct Known {
    std::string name;  ///< may be empty
    master::Type type = master::Type::u32;
    unsigned bits = 0;
};
/// Returns an object of CiA 402, ETG.1020 or the sync parameters; bits 0: unknown. Objects of axis
/// n are 800h higher for each axis.
Known profile_object(std::uint16_t index, std::uint8_t sub, unsigned axes);

class SlavePdos {
public:
    SlavePdos(SlaveInput in, const esi::Device* device, std::uint64_t entries_per_pdo)
        : in_(in), device_(device), limit_(entries_per_pdo) {}
    void read();
    /// Finds an object in the description, or else in the profile.
    Known known(std::uint16_t index, std::uint8_t sub) const;

private:
    void direction(bool output);
    void list(const Line&, master::SyncManager&);
    /// `6000:1..10 bit` as single objects; an error: none
    std::vector<Word> range(const Word&);
    bool entry(const Word&, master::SyncManager&, master::Entry&);
    void place(const Line&, master::SyncManager&, std::vector<master::Entry>&);
    const std::vector<esi::Pdo>& described(bool output) const;
    void assign(const esi::Pdo&, master::SyncManager&);
    void name_pins();
    void pin_options();
    void option(const Line&);

    SlaveInput in_;
    const esi::Device* device_;
    std::uint64_t limit_;
};

}  // namespace hal::ethercat::config
