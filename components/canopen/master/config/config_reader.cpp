// SPDX-License-Identifier: MIT
// Reads a configuration: its sections, and which of them make up a node.
#include <map>
#include <set>

#include "config_sections.hpp"
#include "hal/read_file.hpp"
#include "node_reader.hpp"

namespace hal::canopen::config {

namespace {

/// One configuration file.
class File {
public:
    File(std::string_view text, const std::string& path, const ReadFile& read_file)
        : sections_(split(text, report_)),
          descriptions_(read_file,
                        path.find('/') == path.npos ? "" : path.substr(0, path.rfind('/') + 1)) {}

    Reading read() {
        for (Section& s : sections_) {
            sort(s);
        }
        if (bus_ == nullptr) {
            report_.error(Topic::line, {1, 1, 0, 0}, "missing section [bus]",
                          "write [bus] and below it link = can:can0 and bitrate = 1M");
        }
        if (bus_ != nullptr) {
            out_.config.at = bus_->at;
            Keys keys(report_);
            keys.take(*bus_);
            read_bus(keys, out_.config);
        }
        for (Section* s : nodes_) {
            node(*s);
        }
        for (Section* s : foreign_) {
            for (const Line& line : s->lines) {
                read_foreign(line, out_.config, report_);
            }
        }
        for (const auto& [name, s] : types_) {
            if (!used_types_.contains(name)) {
                report_.warning(
                    Topic::line, s->at, "unused type '" + name + "'",
                    "write type = " + name + " below a [node …], or delete the section");
            }
        }
        if (nodes_.empty() && bus_ != nullptr && foreign_.empty()) {
            report_.error(Topic::line, bus_->at, "the configuration has no node",
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
    void sort(Section& s) {
        const std::string kind = s.words.empty() ? "" : lower(s.words[0].text);
        const auto expect = [&](std::size_t words, const char* form) {
            if (s.words.size() == words) return true;
            report_.error(Topic::line, s.at, "invalid section name: expected " + std::string(form));
            return false;
        };
        const auto once = [&](Section*& to, const char* form) {
            if (!expect(1, form)) return;
            if (to != nullptr) {
                report_.error(Topic::line, s.at, "duplicate section " + std::string(form),
                              "first in line " + std::to_string(to->at.line), "duplicate");
            } else {
                to = &s;
            }
        };
        if (kind == "bus") {
            once(bus_, "[bus]");
        } else if (kind == "defaults") {
            once(defaults_, "[defaults]");
        } else if (kind == "type") {
            if (expect(2, "[type NAME]") && !types_.emplace(s.words[1].text, &s).second) {
                report_.error(Topic::line, s.words[1].at,
                              "duplicate type '" + s.words[1].text + "'",
                              "rename or delete one of them", "duplicate");
            }
        } else if (kind == "node") {
            nodes_.push_back(&s);
        } else if (kind == "messages") {
            if (expect(1, "[messages]")) {
                foreign_.push_back(&s);
            }
        } else {
            std::string near = did_you_mean(kind, {"bus", "defaults", "type", "node", "messages"});
            report_.error(
                Topic::line, s.at,
                "unknown section '" + (s.words.empty() ? "" : s.words[0].text) + "'",
                near.empty()
                    ? "the sections are [bus], [defaults], [type NAME], [node ID NAME], [messages]"
                    : near);
        }
    }

    void node(Section& s) {
        Node n;
        n.at = s.at;
        const auto id = s.words.size() >= 2 ? parse_natural(s.words[1].text) : std::nullopt;
        if (!id || *id < 1 || *id > 127 || s.words.size() > 3) {
            return report_.error(Topic::line, s.words.size() >= 2 ? s.words[1].at : s.at,
                                 "invalid node section: expected a node ID of 1..127 and a name",
                                 "write [node 5 NAME]");
        }
        n.setup.id = static_cast<std::uint8_t>(*id);
        n.name = s.words.size() == 3 ? dashed(s.words[2].text) : "node-" + std::to_string(*id);
        if (s.words.size() == 3) {
            n.setup.name = n.name;
        }
        for (const Node& other : out_.config.nodes) {
            if (other.setup.id == n.setup.id) {
                return report_.error(Topic::node, s.words[1].at,
                                     "duplicate node ID " + std::to_string(*id),
                                     "first in line " + std::to_string(other.at.line), "duplicate");
            }
            if (other.name == n.name) {
                report_.error(Topic::node, s.words[2].at, "duplicate node name '" + n.name + "'",
                              "first in line " + std::to_string(other.at.line), "duplicate");
            }
        }
        if (n.setup.id == out_.config.node_id) {
            report_.error(Topic::node, s.words[1].at,
                          "node ID " + std::to_string(*id) + " belongs to the master",
                          "write another node-id in [bus]");
        }
        Keys keys(report_);
        Keys own(report_);
        own.take(s);
        if (defaults_ != nullptr) {
            keys.take(*defaults_);
        }
        const Line* type = own.find("type");
        if (type != nullptr) {
            const auto at = types_.find(type->value.text);
            if (at != types_.end()) {
                used_types_.insert(at->first);
                keys.take(*at->second);
            } else {
                std::vector<std::string> names;
                for (const auto& t : types_) {
                    names.push_back(t.first);
                }
                const std::string near = did_you_mean(type->value.text, names);
                report_.error(Topic::line, type->value.at,
                              "unknown type '" + type->value.text + "'",
                              !near.empty()   ? near
                              : names.empty() ? "write [type " + type->value.text + "]"
                                              : "the types are: " + listed(names));
            }
        }
        keys.take(s);
        for (Section* shared : {defaults_, type != nullptr && types_.contains(type->value.text)
                                               ? types_[type->value.text]
                                               : nullptr}) {
            if (shared != nullptr) {
                for (Line& line : shared->lines) {
                    line.used = false;
                }
            }
        }
        // errors that follow from it are not reported
        if (type != nullptr && !types_.contains(type->value.text)) {
            out_.config.nodes.push_back(std::move(n));
            return;
        }
        NodeReader(keys, descriptions_, out_.config, n).read();
        out_.config.nodes.push_back(std::move(n));
    }

    void finish() {
        out_.messages = std::move(report_.all);
        text::sort(out_.messages);  // a line of a type is read once for each node of it
    }

    Report report_;
    std::vector<Section> sections_;
    Descriptions descriptions_;
    Section *bus_ = nullptr, *defaults_ = nullptr;
    std::map<std::string, Section*> types_;
    std::set<std::string> used_types_;
    std::vector<Section*> nodes_, foreign_;
    Reading out_;
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

bool Reading::good() const { return text::good(messages); }

bool read_from_disk(const std::string& path, std::string& bytes) {
    return read_regular_file(path, 16'000'000, bytes);
}

Reading read(std::string_view text, const std::string& path, const ReadFile& read_file) {
    return File(text, path, read_file).read();
}

std::string to_string(const Reading& reading, const std::string& path) {
    return text::errors_text(reading.messages, path);
}

}  // namespace hal::canopen::config
