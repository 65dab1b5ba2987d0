// SPDX-License-Identifier: MIT
#include "node_reader.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <utility>

#include "canopen/eds/concise_dcf.hpp"
#include "link/can.hpp"

namespace hal::canopen::config {

namespace {

constexpr Choice<Reaction> reactions[] = {{"nothing", Reaction::nothing},
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

}  // namespace

void NodeReader::read() {
    describe();
    settings();
    firmware();
    pdos();
    srdos();
    writes();
    object_options();
    finish_objects();
    leftover();
    scanner_list();
    for (Pdo& pdo : node_.pdos) {
        if (!pdo.safety) {
            configure(pdo);
        }
    }
    configure_srdos();
}

void NodeReader::describe() {
    const Line* file = keys_.find("eds");
    const Line* profile = keys_.find("device");
    unsigned axes = 1;
    keys_.take_small("axes", axes, 1, 8);
    if (file != nullptr) {
        eds_ = descriptions_.get(file->value, report_);
    }
    if (eds_ != nullptr) {
        catalog_ = std::make_unique<Catalog>(*eds_, node_.setup.id);
    } else if (profile != nullptr && file == nullptr) {
        catalog_ = std::make_unique<Catalog>(lower(profile->value.text), axes);
        if (catalog_->empty()) {
            keys_.reject(*profile, listed(Catalog::profiles()) +
                                       "; or name the EDS of the device: eds = FILE");
        }
    }
    undescribed_ = (file != nullptr && eds_ == nullptr) ||
                   (profile != nullptr && file == nullptr && catalog_->empty());
    if (!catalog_) {
        catalog_ = std::make_unique<Catalog>("", 1);
    }
}

void NodeReader::identity(const char* key, std::uint32_t& to, std::uint64_t described) {
    to = static_cast<std::uint32_t>(described);
    const Line* line = keys_.find(key);
    if (line == nullptr) return;
    if (lower(line->value.text) == "any") {
        to = 0;
    } else if (const auto value = parse_natural(line->value.text); value && *value <= 0xffffffff) {
        to = static_cast<std::uint32_t>(*value);
    } else {
        keys_.reject(*line, "a number, decimal or with 0x, or any");
    }
}

void NodeReader::settings() {
    NodeSetup& s = node_.setup;
    const auto described = [&](std::uint16_t index, std::uint8_t sub,
                               std::optional<std::uint32_t> otherwise) {
        return eds_ == nullptr ? 0 : catalog_->number(index, sub, otherwise.value_or(0));
    };
    const eds::DeviceInfo none{}, &info = eds_ != nullptr ? eds_->device : none;
    identity("device-type", s.device_type, described(0x1000, 0, {}));
    identity("vendor", s.vendor, described(0x1018, 1, info.vendor_number));
    identity("product", s.product, described(0x1018, 2, info.product_number));
    identity("revision", s.revision, 0);
    identity("serial", s.serial, 0);
    keys_.take_flag("mandatory", s.mandatory);
    keys_.take_flag("configure", s.configure);
    keys_.take_flag("keep-alive", s.keep_alive);
    keys_.take_flag("start", s.start);
    keys_.take_flag("restore", s.restore);
    keys_.take_flag("save", s.save);
    keys_.take_small("start-order", s.start_order, 0, 127);
    keys_.take_time("sdo-timeout", s.sdo_timeout, millisecond, 60 * second);
    keys_.take_small("sdo-retries", s.sdo_resends, 0, 20);
    if (const Line* line = keys_.find("configured")) {
        const std::string text = lower(line->value.text);
        const auto date = since_1984(text);
        node_.dated_by_content = text == "by-content";
        if (date) {
            s.configuration_date = date->first;
            s.configuration_time = date->second;
        } else if (!node_.dated_by_content && text != "no") {
            keys_.reject(*line, "by-content, a date such as 2026-03-01 14:30, or no");
        }
    }
    keys_.take_time("boot-time", s.boot_limit, millisecond, 3600 * second);
    keys_.take_time("retry", s.retry, millisecond, 3600 * second);
    keys_.take_time("retry-most", s.retry_most, millisecond, 3600 * second);
    s.retry_most = std::max(s.retry, s.retry_most);
    keys_.take_choice("on-failure", s.on_failure, reactions);
    keys_.take_choice("on-loss", s.on_loss, reactions);

    Time heartbeat = Time{s.heartbeat_ms} * millisecond;

    Time watch = Time{bus_.heartbeat_ms} * millisecond * 5 / 2;
    if (keys_.take_time("heartbeat", heartbeat, millisecond, 65535 * millisecond, true)) {
        s.heartbeat_ms = static_cast<std::uint16_t>(heartbeat / millisecond);
    }
    if (Time limit = 0; keys_.take_time("silence", limit, millisecond, 600 * second, true)) {
        s.heartbeat_limit = limit == 0 ? -1 : limit;
    }
    if (s.heartbeat_limit > 0 && s.heartbeat_limit < heartbeat) {
        report_.error(
            Topic::node, keys_.find("silence")->value.at,
            "silence is shorter than the heartbeat: the node would be lost before its next "
            "heartbeat",
            "the heartbeat is " + std::to_string(s.heartbeat_ms) + "ms; write at least twice that");
    }
    if (const Line* line = keys_.find("guarding")) {
        const auto words = words_of(line->value);
        const auto period = words.empty() ? std::nullopt : duration(words[0].text);
        const auto factor =
            words.size() == 3 && words[1].text == "x" ? parse_natural(words[2].text) : std::nullopt;
        if (lower(line->value.text) == "no") {
            s.guard_ms = 0;
        } else if (!period || *period < millisecond || *period > 65535 * millisecond || !factor ||
                   *factor < 1 || *factor > 255) {
            keys_.reject(*line, "a guard time and a life time factor, as in 100ms x 3");
        } else {
            s.guard_ms = static_cast<std::uint16_t>(*period / millisecond);

            s.guard_factor = static_cast<std::uint8_t>(*factor);
            s.heartbeat_ms = 0;
        }
    }
    keys_.take_time("watch-master", watch, millisecond, 65535 * millisecond, true);
    s.master_limit_ms =
        bus_.heartbeat_ms == 0
            ? std::uint16_t{0}
            : static_cast<std::uint16_t>(std::min<Time>(watch / millisecond, 65535));
    if (const Line* line = keys_.find("watch-master");
        line != nullptr && bus_.heartbeat_ms == 0 && watch != 0) {
        report_.error(Topic::node, line->value.at,
                      "the node cannot watch the master: the master produces no heartbeat",
                      "write heartbeat = 100ms in [bus]");
    }
    keys_.find("type");
}

void NodeReader::firmware() {
    NodeProgram& p = node_.setup.program;
    if (const Line* line = keys_.find("firmware")) {
        p.update = descriptions_.bytes(line->value, p.image, report_);
    }
    keys_.take_small("firmware-number", p.number, 1, 254);
    keys_.take_small("firmware-id", p.id, 1, 0xffffffff);
    keys_.take_text("firmware-version", p.version);
    keys_.take_time("firmware-time", p.limit, second, 3600 * second);
}

// What is written to the node before it starts.

void NodeReader::writes() {
    // SYNC settings that all nodes must share; a node without the object is skipped.
    const auto agree = [&](std::uint16_t index, auto value) {
        node_.setup.writes.push_back(object_write(index, 0, value));
        node_.setup.writes.back().optional = true;
    };
    if (bus_.sync_counter != 0) {
        agree(0x1019, bus_.sync_counter);
    }
    if (bus_.sync_window != 0) {
        agree(0x1007, static_cast<std::uint32_t>(bus_.sync_window / microsecond));
    }
    if (bus_.sync_cob != 0x80) {
        agree(0x1005, bus_.sync_cob);
    }
    if (eds_ != nullptr && (eds_->commissioning || eds::parameter_values(*eds_) != 0)) {
        values_of_dcf();
    }
    std::vector<Line*> lines = keys_.all_of("write "), commands = keys_.all_of("command ");
    lines.insert(lines.end(), commands.begin(), commands.end());
    std::sort(lines.begin(), lines.end(),
              [](const Line* a, const Line* b) { return a->key.at.offset < b->key.at.offset; });
    for (Line* line : lines) {
        write_one(*line);
    }
}

/// Reports a DCF that was made for another node or bit rate, and parameter values in an EDS.
/// Returns false when the values are not to be written.
bool NodeReader::dcf_fits(const Word& file) {
    if (!eds_->commissioning) {
        const std::size_t values = eds::parameter_values(*eds_);
        report_.note(Topic::value, file.at,
                     "'" + file.text + "' has " + counted(values, "parameter value") +
                         " that the master does not write: it is an EDS",
                     "add [DeviceComissioning] with NodeID=" + std::to_string(node_.setup.id) +
                         " to make it a DCF, or write lines here: write 0x6083 = 1000");
        return false;
    }
    const bool has_rate = can::describe(bus_.link).has_bit_rate;
    const std::string problem = eds::misfit(*eds_, node_.setup.id, has_rate ? bus_.bit_rate : 0);
    if (problem.empty()) return true;
    report_.error(Topic::node, file.at, "DCF '" + file.text + "' does not fit: " + problem,
                  "its parameter values are for that device; name the DCF or the EDS of this one");
    return false;
}

/// Values that a DCF configures, except PDOs and error control, which this file configures.
void NodeReader::values_of_dcf() {
    const Word& file = keys_.find("eds")->value;
    if (!dcf_fits(file)) return;
    const auto configuration = eds::configuration_of(*eds_, node_.setup.id);
    for (const auto& m : configuration.messages) {
        const std::string sentence =
            "line " + std::to_string(m.at.line) + " of '" + file.text + "': " + m.sentence;
        if (m.severity == eds::Severity::error) {
            report_.error(Topic::value, file.at, sentence, m.help);
        } else {
            report_.warning(Topic::value, file.at, sentence, m.help);
        }
    }
    for (const auto& w : configuration.writes) {
        if ((w.index < 0x1400 || w.index > 0x1bff) && w.index != 0x1016 && w.index != 0x1017) {
            node_.setup.writes.push_back({w, {}});
        }
    }
    const std::size_t slash = file.text.rfind('/');
    for (const eds::Object& o : eds_->objects) {
        for (const eds::Entry& e : o.entries) {
            if (e.download_file.empty()) continue;
            if (o.index == 0x1f50) {
                report_.warning(
                    Topic::value, file.at,
                    "program '" + e.download_file + "' of '" + file.text + "' is not downloaded",
                    "write firmware = " + e.download_file +
                        " and its firmware-id or firmware-version");
                continue;
            }
            const bool whole = e.download_file.front() == '/' || slash == file.text.npos;
            ObjectWrite write{{o.index, e.sub, {}}, e.name.empty() ? o.name : e.name};
            std::string why;
            if (!descriptions_.bytes(
                    whole ? e.download_file : file.text.substr(0, slash + 1) + e.download_file,
                    write.data, why)) {
                report_.error(Topic::value, file.at,
                              "cannot read '" + e.download_file + "', which '" + file.text +
                                  "' names for object " + object_label(o.index, e.sub) + ": " + why,
                              "put it beside that file, or delete its line DownloadFile=");
            } else if (write.data.empty()) {
                report_.warning(Topic::value, file.at,
                                "the file '" + e.download_file + "' for object " +
                                    object_label(o.index, e.sub) + " is empty and is not written");
            } else {
                node_.setup.writes.push_back(std::move(write));
            }
        }
    }
}

void NodeReader::write_one(const Line& line) {
    const_cast<Line&>(line).used = true;
    auto words = words_of(line.key);
    const std::string verb = words[0].text;
    words.erase(words.begin());
    const auto reject = [&](std::string sentence, std::string help) {
        report_.error(Topic::object, line.key.at, std::move(sentence), std::move(help));
    };
    if (words.empty() || words.size() > 2) {
        return reject("missing object",
                      "write " + verb + " OBJECT = VALUE, as in: " + verb + " 0x6083 = 1000");
    }
    bool has_sub = false;
    const auto place = address(words[0].text, has_sub);
    const Known* known =
        place ? catalog_->find(place->first, place->second) : catalog_->find(words[0].text);
    std::optional<Type> type = words.size() == 2 ? type_named(words[1].text) : std::nullopt;
    if (words.size() == 2 && !type) {
        return reject("unknown type '" + words[1].text + "'",
                      std::string("write ") + type_words + " or text");
    }
    if (known == nullptr && !(place && type)) {
        if (undescribed_) return;
        if (!place) {
            return reject("unknown object '" + words[0].text + "'",
                          did_you_mean(words[0].text, catalog_->names()));
        }
        return reject(
            "the device description has no object " + object_label(place->first, place->second),
            "state its type: " + verb + " " + words[0].text + " u16 = " + line.value.text);
    }
    const std::uint16_t index = known != nullptr ? known->index : place->first;
    const std::uint8_t sub = known != nullptr ? known->sub : place->second;
    if (!type) {
        type = known->type;
    }
    if (known != nullptr && !known->writable) {
        return reject("object " + object_label(index, sub, known->single) + " (" + known->about +
                          ") is read only",
                      "delete the line");
    }
    const eds::Encoded value =
        eds::encode_strictly(line.value.text, static_cast<std::uint16_t>(*type), node_.setup.id);
    if (!value || value.bytes.empty()) {
        const std::string wanted = to_string(*type);

        const std::string problem = value ? "missing value" : value.error;
        report_.error(
            Topic::value, line.value.at, problem,
            problem.find(wanted) == std::string::npos ? "the object is of type " + wanted : "");
        return;
    }
    node_.setup.writes.push_back(
        {{index, sub, value.bytes}, known != nullptr ? known->about : std::string()});
    node_.setup.writes.back().always = verb == "command";
}

}  // namespace hal::canopen::config
