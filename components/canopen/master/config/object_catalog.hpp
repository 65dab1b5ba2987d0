// SPDX-License-Identifier: MIT
// The objects of a device: from its EDS, DCF or XDD, or from its profile.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "canopen/eds/eds.hpp"
#include "master_config.hpp"

namespace hal::canopen::config {

/// One value of a device.
struct Known {
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    bool single = true;            ///< the object has no sub-indices
    std::string name;              ///< as in names of pins
    std::string about;             ///< as in the description
    Type type = Type::none;
    bool to_node = false;
    bool from_node = false;
    bool writable = true;
    bool readable = true;
    /// at power-on, or what a DCF configures; for the node-id asked for
    std::vector<std::uint8_t> value{};
};

class Catalog {
public:
    /// Reads a device description, for the node with this ID.
    Catalog(const eds::DeviceDescription&, unsigned node_id);
    /// Takes the objects of a profile: "cia401", "cia402" with that many axes, "jr3"; none if the
    /// name is empty.
    Catalog(std::string_view profile, unsigned axes);
    static std::vector<std::string> profiles() { return {"cia401", "cia402", "jr3"}; }

    const Known* find(std::uint16_t index, std::uint8_t sub) const;
    const Known* find(std::string_view name) const;
    /// Returns whether the object has any sub-index.
    bool has(std::uint16_t index) const;
    bool empty() const { return all_.empty(); }
    std::uint64_t number(std::uint16_t index, std::uint8_t sub, std::uint64_t otherwise) const;
    /// Returns the names of the objects that a PDO in this direction may carry.
    std::vector<std::string> names(bool to_node) const;
    std::vector<std::string> names() const;

private:
    void finish();

    std::vector<Known> all_;  // by index and sub-index
    std::map<std::string, std::size_t, std::less<>> by_name_;
};

}  // namespace hal::canopen::config
