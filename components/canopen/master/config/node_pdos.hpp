// SPDX-License-Identifier: MIT
// The PDOs of a node: rpdoN and tpdoN, their objects and options. [setup]
#pragma once

#include <map>

#include "node_reader.hpp"

namespace hal::canopen::config {

/// What the keys of one PDO or SRDO request: tpdo1 = OBJECTS, tpdo1.OPTION = VALUE.
struct PdoRequest {
    unsigned number = 0;
    bool to_node = false;
    const Line* objects = nullptr;
    /// by the name of the option, as if each were a key of its own
    std::map<std::string, const Line*, std::less<>> options{};

    const Line* find(std::string_view option) const {
        const auto at = options.find(option);
        return at == options.end() ? nullptr : at->second;
    }
};

/// By direction, those that the node receives last, and by number.
using PdoRequests = std::map<std::pair<bool, unsigned>, PdoRequest>;

/// Collects the keys rWHATn and tWHATn of a node, with numbers up to `max`.
PdoRequests requests_of(const NodeInput&, const char* what, unsigned max);

/// Returns "rpdo1".
std::string pdo_name(bool to_node, unsigned number);

class NodePdos {
public:
    explicit NodePdos(const NodeInput& input)
        : in_(input), report_(input.report), node_(input.node) {}

    /// Reads the keys; switches off the PDOs that a description enables but the file does not name.
    void read();
    /// Adds the writes that configure the PDOs in the node, once their pins are known.
    void configure();

private:
    std::uint16_t communication(bool to_node, unsigned number) const;
    bool is_enabled(bool to_node, unsigned number) const;
    void read_number(bool to_node, unsigned number, const PdoRequest* request, bool any_named);
    void switch_off(bool to_node, unsigned number);
    void pdo(const PdoRequest& request);
    bool read_objects(const PdoRequest& request, Pdo& pdo);
    void objects_of(const Word& list, Pdo& pdo);
    void multiplexed_objects(const Word& value, Pdo& pdo);
    bool multiplexable(const Object& o, const Pdo& pdo);
    bool default_objects(const PdoRequest& request, Pdo& pdo);
    bool is_multiplexed_by_default(const PdoRequest& request, std::uint64_t count);
    Object default_object(std::uint32_t mapping_entry) const;
    std::uint32_t default_identifier(const Pdo& pdo) const;
    void options(const PdoRequest& request, Pdo& pdo);
    void check_multiplexed(const PdoRequest& request, const Pdo& pdo);
    void scanner_list();

    const NodeInput& in_;
    Report& report_;
    Node& node_;
};

/// Adds the writes that configure a PDO whose identifier is known. [setup]
void configure_pdo(NodeSetup&, const Pdo&);

}  // namespace hal::canopen::config
