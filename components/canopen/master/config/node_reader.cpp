// SPDX-License-Identifier: MIT
#include "node_reader.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <utility>

#include "node_objects.hpp"
#include "node_pdos.hpp"
#include "node_safety.hpp"
#include "node_writes.hpp"

namespace hal::canopen::config {

namespace {

constexpr bus::Choice<Reaction> reactions[] = {{"nothing", Reaction::nothing},
                                               {"restart", Reaction::restart},
                                               {"stop-all", Reaction::stop_all},
                                               {"reset-all", Reaction::reset_all}};

/// "2026-03-01", "2026-03-01 14:30", "2026-03-01 14:30:05" as 1020h has it: days since 1984-01-01,
/// and ms since midnight.
std::optional<std::pair<std::uint32_t, std::uint32_t>> since_1984(const std::string& text) {
    using namespace std::chrono;
    int read = 0;
    int hour = 0;
    int minute = 0;
    int second = 0;
    int y = 0;
    unsigned m = 0;
    unsigned d = 0;
    if (std::sscanf(text.c_str(), "%4d-%2u-%2u%n", &y, &m, &d, &read) != 3) {
        return {};
    }
    int more = 0;
    if (std::sscanf(text.c_str() + read, " %2d:%2d%n", &hour, &minute, &more) == 2) {
        read += std::exchange(more, 0);
        std::sscanf(text.c_str() + read, ":%2d%n", &second, &more);
        read += more;
    }
    const year_month_day date{year(y), month(m), day(d)};
    if (static_cast<std::size_t>(read) != text.size() || !date.ok() || hour < 0 || hour > 23 ||
        minute < 0 || minute > 59 || second < 0 || second > 59) {
        return {};
    }
    const auto days = (sys_days(date) - sys_days(year(1984) / 1 / 1)).count();
    if (days < 1 || days > 0xffff) {
        return {};
    }
    return std::pair(static_cast<std::uint32_t>(days),
                     static_cast<std::uint32_t>(((hour * 60 + minute) * 60 + second) * 1000));
}

/// What the settings of a node are read into.
struct Settings {
    Node& node;
    Descriptions& descriptions;
    Report& report;
};

template <class T>
auto of_setup(T NodeSetup::* member) {
    return [member](Settings& to) -> T& { return to.node.setup.*member; };
}
template <class T>
auto of_program(T NodeProgram::* member) {
    return [member](Settings& to) -> T& { return to.node.setup.program.*member; };
}

/// A number of the identity; `any` is 0.
auto identity(std::uint32_t NodeSetup::* member) {
    return bus::own("a number, decimal or with 0x, or any", "a number, any",
                    [member](Settings& to, const Line& line) {
        const bool is_any = same_word(line.value.text, "any");
        const auto value = is_any ? 0 : parse_natural(line.value.text);
        if (!value || *value > 0xffffffff) return false;
        to.node.setup.*member = static_cast<std::uint32_t>(*value);
        return true;
    });
}

bool read_configured(Settings& to, const Line& line) {
    const std::string text = lower(line.value.text);
    to.node.dated_by_content = text == "by-content";
    if (text == "by-content" || text == "no") return true;
    const auto date = since_1984(text);
    if (!date) return false;
    to.node.setup.configuration_date = date->first;
    to.node.setup.configuration_time = date->second;
    return true;
}

bool read_silence(Settings& to, const Line& line) {
    Time limit = 0;
    const auto get = [&](Settings&) -> Time& { return limit; };
    if (!bus::time(get, millisecond, 600 * second).or_none().parse(to, line)) return false;
    to.node.setup.heartbeat_limit = limit == 0 ? -1 : limit;
    return true;
}

/// Reads `100ms x 3`.
bool read_guarding(Settings& to, const Line& line) {
    NodeSetup& s = to.node.setup;
    if (same_word(line.value.text, "no")) {
        s.guard_ms = 0;
        return true;
    }
    const auto words = words_of(line.value);
    if (words.size() != 3 || words[1].text != "x") return false;
    const auto period = duration(words[0].text);
    const auto factor = parse_natural(words[2].text);
    if (!period || *period < millisecond || *period > 65535 * millisecond) return false;
    if (!factor || *factor < 1 || *factor > 255) return false;
    s.guard_ms = static_cast<std::uint16_t>(*period / millisecond);
    s.guard_factor = static_cast<std::uint8_t>(*factor);
    s.heartbeat_ms = 0;
    return true;
}

bool read_firmware(Settings& to, const Line& line) {
    NodeProgram& program = to.node.setup.program;
    program.update = to.descriptions.bytes(line.value, program.image, to.report);
    return true;
}

const bus::KeyTable<Settings>& node_keys() {
    using S = NodeSetup;
    static const bus::KeyTable<Settings> table{{
        {"type", "a name", "", "name of the `[type …]` section that applies to this node"},
        {"eds", "a path", "",
         "device description: an EDS, DCF, XDD or XDC file, relative to this file. The values of a "
         "DCF are written to the node, and the files it names (`DownloadFile`) to its domain "
         "objects. A DCF made for another node ID or bit rate is an error; a `ParameterValue` in "
         "an EDS is not written, with a note"},
        {"device", "cia401, cia402, jr3", "",
         "profile for a node without a description, whose objects are then those of the profile"},
        {"axes", "1..8", "`1`", "number of axes of a node with `device = cia402`"},
        {"device-type", identity(&S::device_type), "from the EDS",
         "expected device type (1000h); a node with another identity is not started. `any`: not "
         "checked"},
        {"vendor", identity(&S::vendor), "from the EDS", "expected vendor (1018h:1)"},
        {"product", identity(&S::product), "from the EDS", "expected product (1018h:2)"},
        {"revision", identity(&S::revision), "`any`", "expected revision (1018h:3)"},
        {"serial", identity(&S::serial), "`any`", "expected serial number (1018h:4)"},
        {"mandatory", bus::flag(of_setup(&S::mandatory)), "`yes`",
         "the network is not operational without this node"},
        {"configure", bus::flag(of_setup(&S::configure)), "`yes`",
         "`no`: the node is only monitored and started"},
        {"keep-alive", bus::flag(of_setup(&S::keep_alive)), "`no`",
         "`yes`: a node that is already operational is neither reset nor configured"},
        {"start", bus::flag(of_setup(&S::start)), "`yes`", "`no`: another device starts the node"},
        {"start-order", bus::number(of_setup(&S::start_order), 0, 127), "`0`",
         "the node is started once all nodes with lower numbers are operational"},
        {"restore", bus::flag(of_setup(&S::restore)), "`no`",
         "restores the factory settings before the configuration"},
        {"save", bus::flag(of_setup(&S::save)), "`no`",
         "stores the written configuration in the node"},
        {"configured",
         bus::own("by-content, a date such as 2026-03-01 14:30, or no", "by-content, a date, no",
                  &read_configured),
         "`no`",
         "skips reading and writing the objects of a node whose object 1020h shows that it already "
         "has this configuration. `by-content`: 1020h is a number derived from everything that is "
         "written, so any change counts; or a date, such as `2026-03-01 14:30`, which you change "
         "by hand. Together with `save = yes`, a network of many nodes starts much faster"},
        {"sdo-timeout", bus::time(of_setup(&S::sdo_timeout), millisecond, 60 * second),
         "that of the bus", "SDO response timeout of this node, for one that is slower"},
        {"sdo-retries", bus::number(of_setup(&S::sdo_resends), 0, 20), "that of the bus",
         "number of SDO retries of this node"},
        {"firmware", bus::own("", "a path", &read_firmware), "",
         "image for object 1F50h, which is loaded into a node with another program"},
        {"firmware-number", bus::number(of_program(&NodeProgram::number), 1, 254), "`1`",
         "program number: the sub-index of 1F50h"},
        {"firmware-id", bus::number(of_program(&NodeProgram::id), 1, 0xffffffff), "",
         "expected program (1F56h)"},
        {"firmware-version", bus::text_value(of_program(&NodeProgram::version)), "",
         "expected software version (100Ah)"},
        {"firmware-time", bus::time(of_program(&NodeProgram::limit), second, 3600 * second),
         "`60s`", "timeout of erasing, of flashing and of the restart, each"},
        {"heartbeat",
         bus::time(of_setup(&S::heartbeat_ms), millisecond, 65535 * millisecond)
             .or_none()
             .in(millisecond),
         "`100ms`", "heartbeat producer time of the node"},
        {"silence",
         bus::own("none, or a time of 1ms..600s, as in 10ms or 0.5s", "none, 1ms..600s",
                  &read_silence),
         "2.5 heartbeats", "heartbeat timeout after which the node is lost; `none`: not monitored"},
        {"guarding",
         bus::own("a guard time and a life time factor, as in 100ms x 3", "no, 100ms x 3",
                  &read_guarding),
         "`no`", "node guarding instead of heartbeat: guard time and life time factor"},
        {"watch-master",
         bus::time(of_setup(&S::master_limit_ms), millisecond, 65535 * millisecond)
             .or_none()
             .in(millisecond),
         "2.5 heartbeats of the master",
         "timeout of the master's heartbeat in the node, which then reacts as its object 1029h "
         "defines"},
        {"on-loss", bus::choice(of_setup(&S::on_loss), reactions), "`restart`",
         "reaction when the node is lost; `restart` boots this node alone, until it succeeds"},
        {"on-failure", bus::choice(of_setup(&S::on_failure), reactions), "`restart`",
         "reaction when the node does not boot"},
        {"boot-time", bus::time(of_setup(&S::boot_limit), millisecond, 3600 * second), "`10s`",
         "boot timeout of a mandatory node, after which a fault is raised"},
        {"retry", bus::time(of_setup(&S::retry), millisecond, 3600 * second), "`1s`",
         "initial interval between boot attempts. It doubles while they fail, and returns to this "
         "value once the node has been operational for this time"},
        {"retry-most", bus::time(of_setup(&S::retry_max), millisecond, 3600 * second), "`10s`",
         "maximum interval between boot attempts"},
        {"tpdoN", "objects, default, none", "from the EDS", "[TPDO](#pdos) N of the node"},
        {"rpdoN", "objects, default, none", "from the EDS", "[RPDO](#pdos) N of the node"},
        {"tsrdoN", "pairs of objects", "",
         "[SRDO](#safety-related-data-objects) N, which the node sends"},
        {"rsrdoN", "pairs of objects", "",
         "[SRDO](#safety-related-data-objects) N, which the node receives"},
        {"write OBJECT", "a value", "", "an object written before the node is started, see below"},
        {"command OBJECT", "a value", "", "an object that acts when it is written, see below"},
    }};
    return table;
}

/// Reads a node: its description first, then the settings, then what needs both.
class NodeReader {
public:
    NodeReader(Keys& keys, Report& report, Descriptions& descriptions, const MasterConfig& bus,
               Node& node)
        : keys_(keys),
          report_(report),
          key_report_(report),
          descriptions_(descriptions),
          bus_(bus),
          node_(node) {}

    void read() {
        describe();
        settings();
        const NodeInput input{keys_, report_, bus_, node_, *catalog_, eds_, undescribed_};
        NodePdos pdos(input);
        NodeSrdos srdos(input);
        NodeObjects objects(input);
        pdos.read();
        srdos.read();
        NodeWrites(input, descriptions_).read();
        objects.read();
        keys_.report_rest("of a node", node_keys().names());
        pdos.configure();
        srdos.configure();
    }

private:
    void describe() {
        const Line* file = keys_.find("eds");
        const Line* profile = keys_.find("device");
        unsigned axes = 1;
        const auto get_axes = [&](Node&) -> unsigned& { return axes; };
        keys_.read("axes", bus::number(get_axes, 1, 8), node_);
        if (file != nullptr) {
            eds_ = descriptions_.get(file->value, report_);
            undescribed_ = eds_ == nullptr;
        }
        if (eds_ != nullptr) {
            catalog_ = std::make_unique<Catalog>(*eds_, node_.setup.id);
        } else if (profile != nullptr && file == nullptr) {
            catalog_ = std::make_unique<Catalog>(lower(profile->value.text), axes);
            undescribed_ = catalog_->empty();
            if (undescribed_) {
                keys_.reject(*profile, listed(Catalog::profiles()) +
                                           "; or name the EDS of the device: eds = FILE");
            }
        } else {
            catalog_ = std::make_unique<Catalog>("", 1);
        }
    }

    /// Returns a number of the device description.
    std::uint32_t described(std::uint16_t index, std::uint8_t sub,
                            std::optional<std::uint32_t> otherwise) const {
        if (eds_ == nullptr) return 0;
        return static_cast<std::uint32_t>(catalog_->number(index, sub, otherwise.value_or(0)));
    }

    void settings() {
        NodeSetup& s = node_.setup;
        const eds::DeviceInfo info = eds_ != nullptr ? eds_->device : eds::DeviceInfo{};
        s.device_type = described(0x1000, 0, {});
        s.vendor = described(0x1018, 1, info.vendor_number);
        s.product = described(0x1018, 2, info.product_number);
        const Time watch = Time{bus_.heartbeat_ms} * millisecond * 5 / 2;
        s.master_limit_ms = static_cast<std::uint16_t>(std::min<Time>(watch / millisecond, 65535));
        keys_.find("type");
        Settings to{node_, descriptions_, report_};
        node_keys().apply(keys_, to, key_report_);
        s.retry_max = std::max(s.retry, s.retry_max);
        check_silence();
        check_watch();
    }

    void check_silence() {
        const NodeSetup& s = node_.setup;
        if (s.heartbeat_limit <= 0) return;
        const Span at = keys_.find("silence")->value.at;
        const Time life_time = Time{s.guard_ms} * s.guard_factor * millisecond;
        if (s.heartbeat_limit < life_time) {
            report_.error(Topic::node, at,
                          "silence is shorter than guard time x life time factor",
                          "with guarding the node is lost after " +
                              std::to_string(life_time / millisecond) +
                              "ms; write at least that, or delete silence");
            return;
        }
        if (s.heartbeat_limit >= Time{s.heartbeat_ms} * millisecond) return;
        report_.error(
            Topic::node, at,
            "silence is shorter than the heartbeat: the node would be lost before its next "
            "heartbeat",
            "the heartbeat is " + std::to_string(s.heartbeat_ms) + "ms; write at least twice that");
    }

    void check_watch() {
        NodeSetup& s = node_.setup;
        if (bus_.heartbeat_ms != 0) return;
        const Line* line = keys_.find("watch-master");
        if (line != nullptr && s.master_limit_ms != 0) {
            report_.error(Topic::node, line->value.at,
                          "the node cannot watch the master: the master produces no heartbeat",
                          "write heartbeat = 100ms in [bus]");
        }
        s.master_limit_ms = 0;
    }

    Keys& keys_;
    Report& report_;
    bus::TopicReport<Topic> key_report_;
    Descriptions& descriptions_;
    const MasterConfig& bus_;
    Node& node_;
    const eds::DeviceDescription* eds_ = nullptr;
    std::unique_ptr<Catalog> catalog_;
    bool undescribed_ = false;
};

}  // namespace

std::string node_reference() { return node_keys().reference(); }

void read_node(Keys& keys, Report& report, Descriptions& descriptions, const MasterConfig& bus,
               Node& node) {
    NodeReader(keys, report, descriptions, bus, node).read();
}

}  // namespace hal::canopen::config
