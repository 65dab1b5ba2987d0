// SPDX-License-Identifier: MIT
// Reads a configuration: its sections, and which of them make up a node.
#include "config_sections.hpp"
#include "hal/read_file.hpp"
#include "node_reader.hpp"

namespace hal::canopen::config {

namespace {

constexpr bus::SectionKind kinds[] = {
    {"bus", "[bus]", bus::SectionUse::once},
    {"node", "[node ID NAME]", bus::SectionUse::any},
    {"messages", "[messages]", bus::SectionUse::repeated},
};

/// One configuration file.
class File {
public:
    File(std::string_view text, const std::string& path, const ReadFile& read_file)
        : sections_(text, kinds, "[node 5 NAME]", key_report_),
          descriptions_(read_file,
                        path.find('/') == path.npos ? "" : path.substr(0, path.rfind('/') + 1)) {}

    ReadResult read() {
        Section* const bus = sections_.one("bus");
        if (bus == nullptr) {
            report_.error(Topic::line, {1, 1, 0, 0}, "missing section [bus]",
                          "write [bus] and below it link = can:can0 and bitrate = 1M");
        } else {
            out_.config.at = bus->at;
            Keys keys(key_report_);
            keys.add(*bus);
            read_bus(keys, out_.config, report_);
        }
        const auto& nodes = sections_.all("node");
        const auto& messages = sections_.all("messages");
        for (Section* s : nodes) {
            node(*s);
        }
        for (const Section* s : messages) {
            for (const Line& line : s->entries) {
                read_foreign(line, out_.config, report_);
            }
        }
        sections_.warn_unused_types("[node …]");
        if (nodes.empty() && bus != nullptr && messages.empty()) {
            report_.error(Topic::line, bus->at, "the configuration has no node",
                          "write [node 5 NAME] and below it eds = FILE or device = PROFILE");
        }
        assign_identifiers(out_.config, report_);
        for (Node& n : out_.config.nodes) {
            if (n.dated_by_content) {
                date_by_content(n.setup);
            }
        }
        check_network(out_.config, report_);
        finish();
        return std::move(out_);
    }

private:
    void node(Section& s) {
        Node n;
        n.at = s.at;
        if (!read_header(s, n)) return;
        Keys keys(key_report_);
        // errors that follow from an unknown type are not reported
        if (sections_.add_keys(s, keys)) {
            read_node(keys, report_, descriptions_, out_.config, n);
        }
        out_.config.nodes.push_back(std::move(n));
    }

    /// Reads [node ID NAME]. Returns false after reporting an invalid or duplicate ID.
    bool read_header(const Section& s, Node& n) {
        const auto id = s.words.size() >= 2 ? parse_natural(s.words[1].text) : std::nullopt;
        if (!id || *id < 1 || *id > 127 || s.words.size() > 3) {
            report_.error(Topic::line, s.words.size() >= 2 ? s.words[1].at : s.at,
                          "invalid node section: expected a node ID of 1..127 and a name",
                          "write [node 5 NAME]");
            return false;
        }
        n.setup.id = static_cast<std::uint8_t>(*id);
        n.name = s.words.size() == 3 ? dashed(s.words[2].text) : "node-" + std::to_string(*id);
        if (s.words.size() == 3) {
            n.setup.name = n.name;
        }
        for (const Node& other : out_.config.nodes) {
            const std::string first = "first in line " + std::to_string(other.at.line);
            if (other.setup.id == n.setup.id) {
                report_.error(Topic::node, s.words[1].at,
                              "duplicate node ID " + std::to_string(*id), first, "duplicate");
                return false;
            }
            if (other.name == n.name) {
                report_.error(Topic::node, s.words.back().at,
                              "duplicate node name '" + n.name + "'", first, "duplicate");
            }
        }
        if (n.setup.id == out_.config.node_id) {
            report_.error(Topic::node, s.words[1].at,
                          "node ID " + std::to_string(*id) + " belongs to the master",
                          "write another node-id in [bus]");
        }
        return true;
    }

    void finish() {
        out_.messages = std::move(report_.all);
        text::sort(out_.messages);  // a line of a type is read once for each node of it
    }

    Report report_;
    bus::TopicReport<Topic> key_report_{report_};
    bus::SectionFile sections_;
    Descriptions descriptions_;
    ReadResult out_;
};

}  // namespace

unsigned Pdo::bits() const {
    unsigned sum = 0;
    for (const Object& o : objects) {
        sum += o.bits;
    }
    return sum;
}

MasterSetup MasterConfig::setup() const {
    MasterSetup out = master;
    out.id = node_id;
    // we listen before all are there: what a node sends once, when it starts, must not be lost
    out.start_self = false;
    for (const Node& n : nodes) {
        out.nodes.push_back(n.setup);
    }
    return out;
}

bool ReadResult::good() const { return text::good(messages); }

bool read_from_disk(const std::string& path, std::string& bytes) {
    return read_regular_file(path, 16'000'000, bytes);
}

ReadResult read(std::string_view text, const std::string& path, const ReadFile& read_file) {
    return File(text, path, read_file).read();
}

std::string to_string(const ReadResult& reading, const std::string& path) {
    return text::errors_text(reading.messages, path);
}

}  // namespace hal::canopen::config
