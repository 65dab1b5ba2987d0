// SPDX-License-Identifier: MIT
// The process data of a slave in a `.ethercat` file: which objects and PDOs it has. Everything here
// is [setup].
#pragma once

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

/// Returns the object of the profile with this name; nullopt: unknown.
std::optional<ObjectAddress> profile_address(std::string_view name, unsigned axes);

class SlavePdos {
public:
    /// `mode` is the operation mode of the description; nullptr: none.
    SlavePdos(SlaveInput in, const esi::Device* device, const esi::OpMode* mode,
              std::uint64_t entries_per_pdo)
        : in_(in), device_(device), mode_(mode), limit_(entries_per_pdo) {}
    void read();
    /// Returns the keys of the process data, for messages.
    static std::vector<std::string> key_names();
    /// Finds an object in the description, or else in the profile.
    Known known(std::uint16_t index, std::uint8_t sub) const;
    /// Finds an object by the name of its pin, in the description or in the profile.
    std::optional<ObjectAddress> find(std::string_view name) const;

private:
    void correct_sign(std::uint16_t index, std::uint8_t sub, unsigned bits, master::Type&) const;
    std::uint8_t manager_number(bool output);
    master::SyncManager manager(bool output);
    master::SyncManager further_manager(const master::SyncManager& first, unsigned number) const;
    void direction(bool output);
    void assign_default(std::vector<master::SyncManager>& managers);
    master::SyncManager& manager_with(unsigned number,
                                      std::vector<master::SyncManager>& managers) const;
    /// An object, a range of them, a PDO or a gap, as `outputs` and `inputs` list them.
    struct Item {
        Word object;
        Word type;  ///< or the bits of a gap; empty: none
    };
    /// Splits a list at commas or blanks; a type or a number of bits follows its object.
    static std::vector<Item> items_of(const Word& value);
    void list(const Line&, master::SyncManager&);
    /// Returns the objects of `6040` or of `6000:1..8`; none after reporting an error.
    std::vector<ObjectAddress> addresses_of(const Word& item);
    void add_gap(const Item&, std::vector<master::Entry>&);
    static bool is_mapped(const ObjectAddress&, const master::SyncManager&);
    /// Adds an object. Returns false after reporting that it cannot be in a PDO.
    bool add_entry(const Item&, const ObjectAddress&, const master::SyncManager&,
                   std::vector<master::Entry>&);
    void assign(std::uint16_t pdo, const Word& item, master::SyncManager&);
    const std::vector<esi::Pdo>& described(bool output) const;
    bool is_commanded(const esi::Pdo&) const;
    void assign(const esi::Pdo&, master::SyncManager&);

    SlaveInput in_;
    const esi::Device* device_;
    const esi::OpMode* mode_;
    std::uint64_t limit_;
};

}  // namespace hal::ethercat::config
