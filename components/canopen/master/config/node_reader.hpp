// SPDX-License-Identifier: MIT
// Reads a node from its keys: description, settings, PDOs, writes.
#pragma once

#include <map>
#include <memory>

#include "canopen/eds/eds.hpp"
#include "canopen/protocol/srdo_description.hpp"
#include "config_keys.hpp"
#include "object_catalog.hpp"

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

class NodeReader {
public:
    NodeReader(Keys& keys, Descriptions& descriptions, const MasterConfig& bus, Node& node)
        : keys_(keys),
          report_(keys.report()),
          descriptions_(descriptions),
          bus_(bus),
          node_(node) {}
    void read();

private:
    struct PdoWish {
        unsigned number = 0;
        bool to_node = false;
        const Line* objects = nullptr;
        std::map<std::string, const Line*> options{};
    };
    /// An option of a PDO, such as `transmission`, and what applies its line.
    struct PdoOption {
        std::string_view name;
        void (NodeReader::*apply)(const PdoWish& wish, const Line& line, Pdo& pdo);
    };
    void describe();
    void identity(const char* key, std::uint32_t& to, std::uint64_t described);
    void settings();
    void firmware();
    void writes();
    void values_of_dcf();
    bool dcf_fits(const Word& file);
    void write_one(const Line& line);
    void pdos();
    std::map<std::pair<bool, unsigned>, PdoWish> wishes(const char* what = "pdo",
                                                        unsigned most = 512);
    void pdo(const PdoWish& wish);
    void pdo_options(const PdoWish& wish, Pdo& pdo);
    static const std::vector<PdoOption>& pdo_option_rows();
    void set_transmission(const PdoWish& wish, const Line& line, Pdo& pdo);
    void set_request(const PdoWish& wish, const Line& line, Pdo& pdo);
    void set_inhibit(const PdoWish& wish, const Line& line, Pdo& pdo);
    void set_event_timer(const PdoWish& wish, const Line& line, Pdo& pdo);
    void set_timeout(const PdoWish& wish, const Line& line, Pdo& pdo);
    void set_cob_id(const PdoWish& wish, const Line& line, Pdo& pdo);
    void set_sync_start(const PdoWish& wish, const Line& line, Pdo& pdo);
    /// The time that the line gives; reports one that is wrong or longer.
    std::optional<Time> time_up_to(const Line& line, Time max);
    void objects_of(const Word& list, Pdo& pdo);
    void srdos();
    void srdo(const PdoWish& wish);
    void srdo_options(const PdoWish& wish, Pdo& pdo);
    void configure_srdos();
    bool multiplexable(const Object& o, const Pdo& pdo);
    bool default_objects(const PdoWish& wish, Pdo& pdo);
    bool object(const Word& word, Pdo& pdo, Object& out);
    Object known_object(const Known& known, unsigned bits) const;
    void scanner_list();
    void configure(Pdo& pdo);
    void object_options();
    void option(Object& object, const std::string& property, const Line& line);
    bool set_safe(Object& object, const Line& line);
    void finish_objects();
    void name_feedback();
    void leftover();

    Keys& keys_;
    Report& report_;
    Descriptions& descriptions_;
    const MasterConfig& bus_;
    Node& node_;
    const eds::DeviceDescription* eds_ = nullptr;
    std::unique_ptr<Catalog> catalog_;
    // its description is invalid, which was reported: unknown objects are not
    bool undescribed_ = false;
};

/// Adds the writes that configure a PDO whose identifier is known. [setup]
void configure_pdo(NodeSetup&, const Pdo&);

/// Returns the configuration of an SRDO in the node. [setup]
SrdoDescription node_srdo(const Pdo&);

/// Converts the value of a pin to the bits of its object, limited to the range of the object's
/// type.
std::uint64_t raw_of(const Object&, double pin_value);

}  // namespace hal::canopen::config
