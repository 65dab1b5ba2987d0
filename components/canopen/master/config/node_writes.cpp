// SPDX-License-Identifier: MIT
#include "node_writes.hpp"

#include <algorithm>

#include "canopen/eds/concise_dcf.hpp"
#include "link/can.hpp"

namespace hal::canopen::config {

void NodeWrites::read() {
    share_sync_settings();
    if (in_.eds != nullptr && (in_.eds->commissioning || eds::parameter_values(*in_.eds) != 0)) {
        values_of_dcf();
    }
    std::vector<Line*> lines = keys_.all_of("write ");
    const std::vector<Line*> commands = keys_.all_of("command ");
    lines.insert(lines.end(), commands.begin(), commands.end());
    std::sort(lines.begin(), lines.end(),
              [](const Line* a, const Line* b) { return a->key.at.offset < b->key.at.offset; });
    for (Line* line : lines) {
        write_one(*line);
    }
}

/// SYNC settings that all nodes must share; a node without the object is skipped.
void NodeWrites::share_sync_settings() {
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
}

/// Reports a DCF that was made for another node or bit rate, and parameter values in an EDS.
/// Returns false when the values are not to be written.
bool NodeWrites::dcf_fits(const Word& file) {
    if (!in_.eds->commissioning) {
        const std::size_t values = eds::parameter_values(*in_.eds);
        report_.note(Topic::value, file.at,
                     "'" + file.text + "' has " + counted(values, "parameter value") +
                         " that the master does not write: it is an EDS",
                     "add [DeviceComissioning] with NodeID=" + std::to_string(node_.setup.id) +
                         " to make it a DCF, or write lines here: write 0x6083 = 1000");
        return false;
    }
    const bool has_rate = can::describe(bus_.link).has_bit_rate;
    const std::string problem = eds::misfit(*in_.eds, node_.setup.id, has_rate ? bus_.bit_rate : 0);
    if (problem.empty()) return true;
    report_.error(Topic::node, file.at, "DCF '" + file.text + "' does not fit: " + problem,
                  "its parameter values are for that device; name the DCF or the EDS of this one");
    return false;
}

/// Values that a DCF configures, except PDOs and error control, which this file configures.
void NodeWrites::values_of_dcf() {
    const Word& file = keys_.find("eds")->value;
    if (!dcf_fits(file)) return;
    const auto configuration = eds::configuration_of(*in_.eds, node_.setup.id);
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
    download_files(file);
}

void NodeWrites::download_files(const Word& file) {
    for (const eds::Object& o : in_.eds->objects) {
        for (const eds::Entry& e : o.entries) {
            if (e.download_file.empty()) continue;
            if (o.index != 0x1f50) {
                download(file, o.index, e, e.name.empty() ? o.name : e.name);
                continue;
            }
            report_.warning(
                Topic::value, file.at,
                "program '" + e.download_file + "' of '" + file.text + "' is not downloaded",
                "write firmware = " + e.download_file + " and its firmware-id or firmware-version");
        }
    }
}

void NodeWrites::download(const Word& file, std::uint16_t index, const eds::Entry& entry,
                          std::string about) {
    const std::size_t slash = file.text.rfind('/');
    const bool whole = entry.download_file.front() == '/' || slash == file.text.npos;
    const std::string path =
        whole ? entry.download_file : file.text.substr(0, slash + 1) + entry.download_file;
    const std::string object = object_text(index, entry.sub);
    ObjectWrite write{{index, entry.sub, {}}, std::move(about)};
    std::string why;
    if (!descriptions_.bytes(path, write.data, why)) {
        report_.error(Topic::value, file.at,
                      "cannot read '" + entry.download_file + "', which '" + file.text +
                          "' names for object " + object + ": " + why,
                      "put it beside that file, or delete its line DownloadFile=");
    } else if (write.data.empty()) {
        report_.warning(Topic::value, file.at,
                        "the file '" + entry.download_file + "' for object " + object +
                            " is empty and is not written");
    } else {
        node_.setup.writes.push_back(std::move(write));
    }
}

void NodeWrites::write_one(Line& line) {
    line.used = true;
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
    const NamedObject object = in_.objects().find(words[0]);
    const auto& address = object.address;
    const Known* const known = object.known;
    std::optional<Type> type = words.size() == 2 ? parse_type(words[1], report_) : std::nullopt;
    if (words.size() == 2 && !type) {
        return reject("unknown type '" + words[1].text + "'",
                      std::string("write ") + value_type_names + ", or text");
    }
    if (known == nullptr && !(address && type)) {
        if (in_.undescribed) return;
        if (!address) {
            return reject("unknown object '" + words[0].text + "'",
                          did_you_mean(words[0].text, in_.catalog.names()));
        }
        return reject(
            "the device description has no object " + object_text(address->index, address->sub),
            "state its type: " + verb + " " + words[0].text + " u16 = " + line.value.text);
    }
    if (known == nullptr) return encode(line, *address, *type, {}, verb == "command");
    if (!known->writable) {
        const std::string label =
            known->single ? index_text(known->index) : object_text(known->index, known->sub);
        return reject("object " + label + " (" + known->about + ") is read only",
                      "delete the line");
    }
    encode(line, {known->index, known->sub}, type.value_or(known->type), known->about,
           verb == "command");
}

void NodeWrites::encode(const Line& line, const ObjectAddress& object, Type type, std::string about,
                        bool always) {
    const eds::Encoded value =
        eds::encode_strictly(line.value.text, static_cast<std::uint16_t>(type), node_.setup.id);
    if (!value || value.bytes.empty()) {
        const std::string wanted = to_string(type);
        const std::string problem = value ? "missing value" : value.error;
        const bool is_named = problem.find(wanted) != std::string::npos;
        return report_.error(Topic::value, line.value.at, problem,
                             is_named ? "" : "the object is of type " + wanted);
    }
    node_.setup.writes.push_back({{object.index, object.sub, value.bytes}, std::move(about)});
    node_.setup.writes.back().always = always;
}

}  // namespace hal::canopen::config
