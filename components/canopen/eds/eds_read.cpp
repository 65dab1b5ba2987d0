// SPDX-License-Identifier: MIT
// The sections other than those of objects: file and device information, lists of objects,
// commissioning.
#include <algorithm>
#include <charconv>
#include <iterator>

#include "eds_reader.hpp"
#include "text/find_row.hpp"
#include "text/numbers.hpp"

namespace hal::canopen::eds {

namespace {

class File {
public:
    File(Ini& ini, std::vector<Message>& messages) : ini_(ini), keys_(messages) {}

    DeviceDescription read() {
        out_.preamble = ini_.preamble();
        file_info();
        device_info();
        commissioning();
        dummies();
        read_comments(keys_, ini_.find("Comments"), out_.comments, out_.others);
        out_.objects = ObjectReader(ini_, keys_, "").read();
        lists();
        add_compact_pdos(out_);
        read_modules(ini_, keys_, out_);
        dynamic_channels();
        for (IniSection& section : ini_.sections()) {
            if (section.used) continue;
            out_.others.push_back({section.name, keys_.rest(section)});
        }
        return std::move(out_);
    }

private:
    void missing(const char* section, Severity severity) {
        keys_.report(severity, Topic::missing, {1, 1, 0, 0},
                     "missing section [" + std::string(section) + "]");
    }

    void date(IniSection& section, const char* key, std::string& out) {
        out = keys_.text(section, key);
        IniKey* at = section.find(key);
        if (out.empty() || at == nullptr) return;
        // mm-dd-yyyy
        const auto number = [&](std::size_t from, std::size_t n) {
            int value = -1;
            parse_whole(std::string_view(out).substr(from, n), value);
            return value;
        };
        const bool shape = out.size() == 10 && out[2] == '-' && out[5] == '-';
        if (shape && number(0, 2) >= 1 && number(0, 2) <= 12 && number(3, 2) >= 1 &&
            number(3, 2) <= 31 && number(6, 4) >= 0) {
            return;
        }
        keys_.report(Severity::note, Topic::value, at->value_at,
                     "invalid date '" + out.substr(0, 40) + "'", "write it as mm-dd-yyyy");
    }

    void file_info() {
        IniSection* section = ini_.find("FileInfo");
        if (section == nullptr) return missing("FileInfo", Severity::note);
        FileInfo& f = out_.file;
        f.file_name = keys_.text(*section, "FileName");
        f.eds_version = keys_.text(*section, "EDSVersion");
        f.description = keys_.text(*section, "Description");
        f.creation_time = keys_.text(*section, "CreationTime");
        date(*section, "CreationDate", f.creation_date);
        f.created_by = keys_.text(*section, "CreatedBy");
        f.modification_time = keys_.text(*section, "ModificationTime");
        date(*section, "ModificationDate", f.modification_date);
        f.modified_by = keys_.text(*section, "ModifiedBy");
        f.last_eds = keys_.text(*section, "LastEDS");
        f.version = static_cast<std::uint8_t>(loose(*section, "FileVersion"));
        f.revision = static_cast<std::uint8_t>(loose(*section, "FileRevision"));
        f.extras =
            keys_.rest(*section, {"FileName", "FileVersion", "FileRevision", "EDSVersion",
                                  "Description", "CreationTime", "CreationDate", "CreatedBy",
                                  "ModificationTime", "ModificationDate", "ModifiedBy", "LastEDS"});
    }

    /// FileVersion=1.2 occurs in files: the digits before the point are the value, the whole text
    /// is kept.
    std::uint64_t loose(IniSection& section, const char* name) {
        IniKey* key = section.find(name);
        if (key == nullptr || key->value.empty() || parse_number(key->value)) {
            return keys_.number(section, name, 0xFF).value_or(0);
        }
        unsigned value = 0;
        const auto [end, error] =
            std::from_chars(key->value.data(), key->value.data() + key->value.size(), value);
        keys_.report(
            Severity::note, Topic::value, key->value_at,
            "'" + key->name + "' is a number of 0..255, not '" + key->value.substr(0, 40) + "'",
            error == std::errc() && value <= 0xFF ? "read as " + std::to_string(value)
                                                  : "read as 0");
        return error == std::errc() && value <= 0xFF ? value : 0;
    }

    std::optional<std::uint32_t> identity(IniSection& section, const char* key) {
        const auto number = keys_.number(section, key, 0xFFFFFFFF);
        return number ? std::optional<std::uint32_t>(static_cast<std::uint32_t>(*number))
                      : std::nullopt;
    }

    void device_info() {
        IniSection* section = ini_.find("DeviceInfo");
        if (section == nullptr) return missing("DeviceInfo", Severity::warning);
        DeviceInfo& d = out_.device;
        d.vendor_name = keys_.text(*section, "VendorName");
        d.vendor_number = identity(*section, "VendorNumber");
        d.product_name = keys_.text(*section, "ProductName");
        d.product_number = identity(*section, "ProductNumber");
        d.revision_number = identity(*section, "RevisionNumber");
        d.order_code = keys_.text(*section, "OrderCode");
        bool any = false;
        for (std::size_t i = 0; i < baud_rates.size(); ++i) {
            const std::string key = "BaudRate_" + std::to_string(baud_rates[i]);
            any = any || section->find(key) != nullptr;
            d.supports[i] = keys_.flag(*section, key);
        }
        if (!any) {
            keys_.report(Severity::note, Topic::missing, section->at, "no bit rate in [DeviceInfo]",
                         "write BaudRate_1000=1 for a device that supports 1 Mbit/s");
        }
        d.boot_up_master = keys_.flag(*section, "SimpleBootUpMaster");
        d.boot_up_slave = keys_.flag(*section, "SimpleBootUpSlave");
        d.granularity =
            static_cast<std::uint8_t>(keys_.number(*section, "Granularity", 0xFF).value_or(0));
        if (d.granularity > 64) {
            keys_.report(Severity::note, Topic::value, section->find("Granularity")->value_at,
                         "invalid granularity of " + std::to_string(d.granularity) + " bits",
                         "the range is 0..64");
        }
        d.dynamic_channels =
            keys_.number(*section, "DynamicChannelsSupported", 0xFFFF).value_or(0) != 0;
        d.group_messaging = keys_.flag(*section, "GroupMessaging");
        d.lss = keys_.flag(*section, "LSS_Supported");
        d.compact_pdo =
            static_cast<std::uint8_t>(keys_.number(*section, "CompactPDO", 0xFF).value_or(0));
        d.rx_pdos =
            static_cast<std::uint16_t>(keys_.number(*section, "NrOfRXPDO", 512).value_or(0));
        d.tx_pdos =
            static_cast<std::uint16_t>(keys_.number(*section, "NrOfTXPDO", 512).value_or(0));
        const auto place = [&](const char* key) {
            const auto* found = section->find(key);
            return found != nullptr ? found->value_at : section->at;
        };
        d.rx_pdos_at = place("NrOfRXPDO");
        d.tx_pdos_at = place("NrOfTXPDO");
        d.extras =
            keys_.rest(*section, {"VendorName", "VendorNumber", "ProductName", "ProductNumber",
                                  "RevisionNumber", "OrderCode", "SimpleBootUpMaster",
                                  "SimpleBootUpSlave", "Granularity", "DynamicChannelsSupported",
                                  "GroupMessaging", "LSS_Supported", "NrOfRXPDO", "NrOfTXPDO"});
    }

    void commissioning() {
        IniSection* section = ini_.find("DeviceComissioning");  // the spelling of CiA 306
        if (section == nullptr) {
            section = ini_.find("DeviceCommissioning");
        }
        if (section == nullptr) return;
        Commissioning c;
        const auto id = keys_.number(*section, "NodeID", 0xFF);
        c.node_id = static_cast<std::uint8_t>(id.value_or(0));
        if (!id || *id < 1 || *id > 127) {
            IniKey* key = section->find("NodeID");
            keys_.report(Severity::warning, key == nullptr ? Topic::missing : Topic::value,
                         key == nullptr ? section->at : key->value_at,
                         key == nullptr ? "missing 'NodeID' in [" + section->name + "]"
                                        : "invalid node ID '" + key->value + "'",
                         "the range is 1..127");
            c.node_id = 0;
        }
        c.node_name = keys_.text(*section, "NodeName");
        c.node_reference = keys_.text(*section, "NodeRefd");
        c.baud_rate =
            static_cast<std::uint16_t>(keys_.number(*section, "Baudrate", 0xFFFF).value_or(0));
        if (c.baud_rate != 0 &&
            std::find(baud_rates.begin(), baud_rates.end(), c.baud_rate) == baud_rates.end()) {
            keys_.report(Severity::warning, Topic::value, section->find("Baudrate")->value_at,
                         std::to_string(c.baud_rate) + " kbit/s is not a bit rate of CiA 301",
                         "the rates are 10, 20, 50, 125, 250, 500, 800 and 1000");
        }
        c.network =
            static_cast<std::uint32_t>(keys_.number(*section, "NetNumber", 0xFFFFFFFF).value_or(0));
        c.network_name = keys_.text(*section, "NetworkName");
        c.network_reference = keys_.text(*section, "NetRefd");
        c.manager = keys_.flag(*section, "CANopenManager");
        c.lss_serial_number = static_cast<std::uint32_t>(
            keys_.number(*section, "LSS_SerialNumber", 0xFFFFFFFF).value_or(0));
        c.extras =
            keys_.rest(*section, {"NodeID", "NodeName", "NodeRefd", "Baudrate", "NetNumber",
                                  "NetworkName", "NetRefd", "CANopenManager", "LSS_SerialNumber"});
        out_.commissioning = std::move(c);
    }

    void dummies() {
        IniSection* section = ini_.find("DummyUsage");
        if (section == nullptr) return;
        constexpr std::string_view word = "Dummy";
        for (IniKey& key : section->keys) {
            if (key.name.size() != word.size() + 4 ||
                !same_word(std::string_view(key.name).substr(0, word.size()), word)) {
                continue;
            }
            const auto code = parse_number("0x" + key.name.substr(word.size()));
            if (!code) continue;
            const std::string name = key.name;
            out_.dummies.emplace_back(static_cast<std::uint16_t>(code->magnitude),
                                      keys_.flag(*section, name));
            key.used = true;
        }
        std::sort(out_.dummies.begin(), out_.dummies.end());
        if (const Extras more = keys_.rest(*section, {"Dummy0001"}); !more.empty()) {
            out_.others.push_back({section->name, more});
        }
    }

    /// The keys of the lists that name an object, by its index.
    using ListedObjects = std::map<unsigned, const IniKey*>;

    /// Reads the lists of objects, which give each its category. Reports objects that are listed and
    /// not described, or described and not listed, and mandatory ones that are missing.
    void lists() {
        ListedObjects listed;
        bool any = false;
        for (const Category category :
             {Category::mandatory, Category::optional, Category::manufacturer}) {
            const std::string name(list_of(category));
            if (IniSection* section = ini_.find(name)) {
                any = true;
                read_list(*section, category, listed);
            } else if (category == Category::mandatory) {
                missing(name.c_str(), Severity::warning);
            }
        }
        for (Object& object : out_.objects) {
            if (!listed.contains(object.index)) {
                categorise_unlisted(object, any);
            }
        }
        constexpr std::uint16_t mandatory[] = {0x1000, 0x1001, 0x1018};
        for (const std::uint16_t index : mandatory) {
            if (out_.find(index) == nullptr && any) {
                keys_.report(Severity::warning, Topic::missing, {1, 1, 0, 0},
                             "missing mandatory object " + label(index));
            }
        }
    }

    void read_list(IniSection& section, Category category, ListedObjects& listed) {
        for (const auto& [number, key] : keys_.list(section, "SupportedObjects")) {
            const auto parsed = keys_.parse(section, *key, 0xFFFF);
            if (!parsed) continue;
            const auto index = static_cast<std::uint16_t>(*parsed);
            const auto [at, fresh] = listed.emplace(index, key);
            if (!fresh) {
                keys_.report(Severity::warning, Topic::count, key->value_at,
                             "object " + label(index) + " is listed twice",
                             "first in line " + std::to_string(at->second->at.line));
                continue;
            }
            Object* object = out_.find(index);
            if (object == nullptr) {
                keys_.report(Severity::warning, Topic::undescribed, key->value_at,
                             "object " + label(index) + " is listed but not described",
                             "missing section [" + label(index) + "]");
                continue;
            }
            object->category = category;
            const bool is_manufacturers = category_of(index) == Category::manufacturer;
            if (is_manufacturers != (category == Category::manufacturer)) {
                keys_.report(
                    Severity::note, Topic::count, key->value_at,
                    "object " + label(index) + " does not belong in [" + section.name + "]",
                    "manufacturer-specific objects are 2000..5FFF");
            }
        }
        if (const Extras more = keys_.rest(section); !more.empty()) {
            out_.others.push_back({section.name, more});
        }
    }

    /// `has_lists`: the file has a list in which the object is missing.
    void categorise_unlisted(Object& object, bool has_lists) {
        object.category = category_of(object.index);
        if (has_lists && object.index >= 0x1000) {
            keys_.report(Severity::warning, Topic::count, object.at,
                         "object " + label(object.index) + " is described but not listed",
                         "it was read all the same; add it to [" +
                             std::string(list_of(object.category)) + "]");
        }
    }

    static std::string_view list_of(Category category) {
        if (category == Category::mandatory) return "MandatoryObjects";
        if (category == Category::optional) return "OptionalObjects";
        return "ManufacturerObjects";
    }

    void dynamic_channels() {
        IniSection* section = ini_.find("DynamicChannels");
        if (section == nullptr) return;
        const auto count = keys_.number(*section, "NrOfSeg", 0xFF).value_or(0);
        for (unsigned n = 1; n <= count; ++n) {
            const std::string i = std::to_string(n);
            if (section->find("Type" + i) == nullptr && section->find("Range" + i) == nullptr) {
                keys_.report(Severity::warning, Topic::count, section->at,
                             "segment " + i + " of [DynamicChannels] is counted and not described");
                continue;
            }
            DynamicSegment one;
            one.type =
                static_cast<std::uint16_t>(keys_.number(*section, "Type" + i, 0xFFFF).value_or(0));
            const std::string dir = lower(keys_.bare(*section, "Dir" + i));
            if (dir == "ro") {
                one.access = Access::ro;
            } else if (dir == "wo") {
                one.access = Access::wo;
            } else if (dir == "rwr") {
                one.access = Access::rwr;
            } else if (dir == "rww") {
                one.access = Access::rww;
            } else {
                one.access = Access::rw;
            }
            one.range = keys_.bare(*section, "Range" + i);
            one.image_offset = static_cast<std::uint32_t>(
                keys_.number(*section, "PPOffset" + i, 0xFFFFFFFF).value_or(0));
            out_.dynamic_channels.push_back(std::move(one));
        }
        if (const Extras more = keys_.rest(*section); !more.empty()) {
            out_.others.push_back({section->name, more});
        }
    }

    Ini& ini_;
    Keys keys_;
    DeviceDescription out_;
};

}  // namespace

std::size_t ReadResult::count(Severity severity) const {
    return static_cast<std::size_t>(
        std::count_if(messages.begin(), messages.end(),
                      [&](const Message& m) { return m.severity == severity; }));
}

std::vector<Message> ReadResult::doubts() const {
    std::vector<Message> out;
    std::copy_if(messages.begin(), messages.end(), std::back_inserter(out),
                 [](const Message& m) { return unreliable(m.topic); });
    return out;
}

ReadResult read_eds(std::string_view bytes) {
    ReadResult out;
    if (!decode(bytes, out.text, out.messages)) return out;
    const std::size_t of_decoding = out.messages.size();
    Ini ini;
    ini.parse(out.text, out.messages);
    const auto refuse = [&](std::string sentence, std::string help) {
        out.messages.erase(out.messages.begin() + static_cast<std::ptrdiff_t>(of_decoding),
                           out.messages.end());  // messages about a file of another kind
        out.messages.push_back({Severity::error,
                                Topic::unreadable,
                                {1, 1, 0, 0},
                                std::move(sentence),
                                std::move(help)});
        return std::move(out);
    };
    if (trimmed(out.text).empty()) return refuse("the file is empty", "");
    if (trimmed(out.text)[0] == '<') {
        return refuse("the file is XML", "device descriptions in XML are named .xdd or .xdc");
    }
    const bool objects = std::any_of(
        ini.sections().begin(), ini.sections().end(),
        [](const IniSection& s) { return section_name(s.name).what == SectionName::What::object; });
    if (!objects && ini.find("DeviceInfo") == nullptr) {
        return refuse(
            "the file describes neither a device nor an object",
            "an EDS has [FileInfo], [DeviceInfo] and a section for each object, as in [1000]");
    }
    out.description = File(ini, out.messages).read();
    check_objects(*out.description, out.messages);
    std::stable_sort(out.messages.begin(), out.messages.end(),
                     [](const Message& a, const Message& b) { return a.at.offset < b.at.offset; });
    return out;
}

const Entry* Object::find(std::uint8_t sub) const { return find_row(entries, sub, &Entry::sub); }
Entry* Object::find(std::uint8_t sub) { return const_cast<Entry*>(std::as_const(*this).find(sub)); }

const Object* DeviceDescription::find(std::uint16_t index) const {
    const auto found =
        std::lower_bound(objects.begin(), objects.end(), index,
                         [](const Object& o, std::uint16_t i) { return o.index < i; });
    return found == objects.end() || found->index != index ? nullptr : &*found;
}
Object* DeviceDescription::find(std::uint16_t index) {
    return const_cast<Object*>(std::as_const(*this).find(index));
}

const Entry* DeviceDescription::find(std::uint16_t index, std::uint8_t sub) const {
    const Object* object = find(index);
    return object == nullptr ? nullptr : object->find(sub);
}

std::size_t DeviceDescription::entries() const {
    std::size_t count = 0;
    for (const Object& object : objects) {
        count += object.entries.size();
    }
    return count;
}

unsigned DeviceDescription::node_id(unsigned otherwise) const {
    return commissioning && commissioning->node_id != 0 ? commissioning->node_id : otherwise;
}

}  // namespace hal::canopen::eds
