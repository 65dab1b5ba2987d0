// SPDX-License-Identifier: MIT
#include "node_descriptions.hpp"

#include "canopen/eds/xdd.hpp"

namespace hal::canopen::config {

std::string Descriptions::path(const Word& file) const {
    return file.text.front() == '/' ? file.text : folder_ + file.text;
}

bool Descriptions::read(const Word& file, std::string& bytes, Report& report) {
    const bool whole = file.text.front() == '/';
    if (read_(path(file), bytes)) return true;
    report.error(Topic::value, file.at, "cannot read '" + file.text + "': " + bytes,
                 whole ? "" : "a relative path starts at the folder of this file");
    return false;
}

const eds::DeviceDescription* Descriptions::get(const Word& file, Report& report) {
    if (const auto at = known_.find(file.text); at != known_.end()) return at->second.get();
    auto& description = known_[file.text];
    std::string text;
    if (!read(file, text, report)) return nullptr;
    eds::ReadResult reading = eds::read_description(text);
    if (!reading.description) {
        std::string why = "not a device description";
        for (const auto& m : reading.messages) {
            if (m.severity == eds::Severity::error) {
                why = "line " + std::to_string(m.at.line) + ": " + m.sentence;
            }
        }
        report.error(Topic::value, file.at,
                     "cannot use device description '" + file.text + "': " + why,
                     "see: hal can eds check " + path(file));
        return nullptr;
    }
    const std::vector<eds::Message> doubts = reading.doubts();
    if (!doubts.empty()) {
        const bool dcf = reading.description->commissioning.has_value();
        const std::string sentence =
            (dcf ? "unreliable DCF '" : "unreliable EDS '") + file.text + "': line " +
            std::to_string(doubts[0].at.line) + ": " + doubts[0].sentence +
            (doubts.size() > 1 ? ", and " + counted(doubts.size() - 1, "more problem") : "");
        const std::string help = "list them with hal can eds check " + path(file);
        if (dcf) {
            report.error(Topic::value, file.at, sentence, help);
            return nullptr;
        }
        report.warning(Topic::value, file.at, sentence, help);
    } else if (const std::size_t warnings = reading.count(eds::Severity::warning); warnings != 0) {
        report.note(Topic::value, file.at,
                    "'" + file.text + "' has " + counted(warnings, "warning"),
                    "list them with hal can eds check " + path(file) +
                        "; those about objects used here matter");
    }
    std::vector<eds::Message> ignored;
    eds::connect_modules(*reading.description, ignored);
    description = std::make_unique<eds::DeviceDescription>(std::move(*reading.description));
    return description.get();
}

bool Descriptions::bytes(const std::string& file, std::vector<std::uint8_t>& to, std::string& why) {
    std::string text;
    if (read_(path({file, {}}), text)) {
        to.assign(text.begin(), text.end());
        return true;
    }
    why = text;
    return false;
}

bool Descriptions::bytes(const Word& file, std::vector<std::uint8_t>& to, Report& report) {
    std::string text;
    if (!read(file, text, report)) return false;
    to.assign(text.begin(), text.end());
    return true;
}

}  // namespace hal::canopen::config
