// SPDX-License-Identifier: MIT
#include "ethercat/config/igh_conf.hpp"

#include <algorithm>
#include <cctype>

#include "ethercat/config/config.hpp"
#include "text/characters.hpp"
#include "text/folder_entries.hpp"

namespace hal::ethercat::config {

namespace {

bool is_mac(std::string_view text) {
    if (text.size() != 17) return false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (i % 3 == 2 ? text[i] != ':' : std::isxdigit(static_cast<unsigned char>(text[i])) == 0) {
            return false;
        }
    }
    return true;
}

}  // namespace

std::string device_of(std::string_view text, unsigned index, bool backup) {
    const std::string key = "MASTER" + std::to_string(index) + (backup ? "_BACKUP" : "_DEVICE");
    std::string value;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        const std::string_view line = trimmed(text.substr(at, end - at));
        at = end + 1;
        const auto equals = line.find('=');
        if (equals == line.npos || trimmed(line.substr(0, equals)) != key) continue;
        std::string_view given = trimmed(line.substr(equals + 1));
        const char quote = given.empty() ? '\0' : given[0];
        const bool quoted = quote == '"' || quote == '\'';
        if (quoted) {
            given.remove_prefix(1);
        }
        value =
            std::string(given.substr(0, quoted ? given.find(quote) : given.find_first_of(" \t#")));
    }
    return value;
}

std::string link_of_device(std::string_view device, const std::string& interfaces) {
    if (!is_mac(device)) {
        return (device.find(':') == device.npos ? "eth:" : "") + std::string(device);
    }
    for (const auto& path : folder_entries(interfaces)) {
        std::string address;
        if (read_from_disk(path.string() + "/address", address) &&
            same_word(trimmed(address), device)) {
            return "eth:" + path.filename().string();
        }
    }
    return {};
}

IghLinks find_igh_links(const std::string& folder, unsigned index) {
    IghLinks out;
    for (const std::string& file : {folder + "/ethercat.conf", std::string("/etc/ethercat.conf"),
                                    std::string("/etc/sysconfig/ethercat")}) {
        std::string text;
        if (!read_from_disk(file, text)) continue;
        const std::string device = device_of(text, index, false);

        const std::string backup = device_of(text, index, true);
        if (device.empty()) continue;
        out.file = file;
        out.link = link_of_device(device);
        if (!backup.empty()) {
            out.backup = link_of_device(backup);
        }
        if (out.link.empty() || (!backup.empty() && out.backup.empty())) {
            out.problem = "no interface has the address " + (out.link.empty() ? device : backup) +
                          " of master " + std::to_string(index) + " in '" + file + "'";
        }
        return out;
    }
    return out;
}

}  // namespace hal::ethercat::config
