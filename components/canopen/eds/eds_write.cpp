// SPDX-License-Identifier: MIT
// The text of a description, in the order CiA 306 shows: what was read and written reads back
// equal.
#include <algorithm>

#include "eds_reader.hpp"

namespace hal::canopen::eds {

namespace {

class Writer {
public:
    explicit Writer(const DeviceDescription& d) : d_(d) {}

    std::string write() {
        for (const std::string& line : d_.preamble) {
            comment(line);
        }
        file_info();
        device_info();
        if (d_.commissioning) {
            commissioning(*d_.commissioning);
        }
        if (!d_.dummies.empty() || has_other("DummyUsage")) {
            section("DummyUsage");
            for (const auto& [type, used] : d_.dummies) {
                key("Dummy" + label(type), used ? "1" : "0");
            }
            other("DummyUsage");
        }
        comments("Comments", d_.comments);
        if (!d_.connected_modules.empty()) {
            section("ConnectedModules");
            key("NrOfEntries", std::to_string(d_.connected_modules.size()));
            for (std::size_t i = 0; i < d_.connected_modules.size(); ++i) {
                key(std::to_string(i + 1), std::to_string(d_.connected_modules[i]));
            }
        }
        if (!d_.dynamic_channels.empty()) {
            dynamic_channels();
        }
        list("MandatoryObjects", Category::mandatory);
        list("OptionalObjects", Category::optional);
        list("ManufacturerObjects", Category::manufacturer);
        if (!d_.modules.empty()) {
            modules();
        }
        for (const OtherSection& one : d_.others) {
            if (written_.count(lower(one.name)) == 0) {
                section(one.name);
                extras(one.entries);
            }
        }
        return std::move(out_);
    }

private:
    static std::string flag(bool on) { return on ? "1" : "0"; }

    void line(std::string_view text) {
        for (const char c : text) {
            if (c != '\r' && c != '\0') {
                out_ += c == '\n' ? ' ' : c;
            }
        }
        out_ += "\r\n";
    }
    void comment(std::string_view text) {
        line(text.empty() || (text[0] != ';' && text[0] != '#') ? "; " + std::string(text)
                                                                : std::string(text));
    }
    void section(const std::string& name) {
        written_[lower(name)] = true;
        if (!out_.empty()) {
            out_ += "\r\n";
        }
        line("[" + name + "]");
    }
    void key(const std::string& name, std::string_view value) {
        line(name + "=" + std::string(value));
    }
    void given(const std::string& name, std::string_view value) {
        if (!value.empty()) {
            key(name, value);
        }
    }
    void extras(const Extras& all) {
        for (const auto& [name, value] : all) {
            if (name.empty()) {
                comment(value);
            } else {
                key(name, value);
            }
        }
    }
    bool has_other(std::string_view name) const {
        return std::any_of(d_.others.begin(), d_.others.end(),
                           [&](const OtherSection& s) { return same_word(s.name, name); });
    }
    void other(std::string_view name) {
        for (const OtherSection& one : d_.others) {
            if (same_word(one.name, name)) {
                extras(one.entries);
            }
        }
    }

    void file_info() {
        const FileInfo& f = d_.file;
        section("FileInfo");
        key("FileName", f.file_name);
        key("FileVersion", std::to_string(f.version));
        key("FileRevision", std::to_string(f.revision));
        if (!f.last_eds.empty()) {
            key("LastEDS", f.last_eds);
        }
        key("EDSVersion", f.eds_version);
        key("Description", f.description);
        key("CreationTime", f.creation_time);
        key("CreationDate", f.creation_date);
        key("CreatedBy", f.created_by);
        key("ModificationTime", f.modification_time);
        key("ModificationDate", f.modification_date);
        key("ModifiedBy", f.modified_by);
        extras(f.extras);
    }

    void device_info() {
        const DeviceInfo& d = d_.device;
        section("DeviceInfo");
        key("VendorName", d.vendor_name);
        key("VendorNumber", d.vendor_number ? hex(*d.vendor_number, 8) : "");
        key("ProductName", d.product_name);
        key("ProductNumber", d.product_number ? hex(*d.product_number, 8) : "");
        key("RevisionNumber", d.revision_number ? hex(*d.revision_number, 8) : "");
        key("OrderCode", d.order_code);
        for (std::size_t i = 0; i < baud_rates.size(); ++i) {
            if (baud_rates[i] != 100 || d.supports[i]) {
                key("BaudRate_" + std::to_string(baud_rates[i]), flag(d.supports[i]));
            }
        }
        key("SimpleBootUpMaster", flag(d.boot_up_master));
        key("SimpleBootUpSlave", flag(d.boot_up_slave));
        key("Granularity", std::to_string(d.granularity));
        key("DynamicChannelsSupported", flag(d.dynamic_channels));
        key("CompactPDO", hex(d.compact_pdo, 2));
        key("GroupMessaging", flag(d.group_messaging));
        key("NrOfRXPDO", std::to_string(d.rx_pdos));
        key("NrOfTXPDO", std::to_string(d.tx_pdos));
        key("LSS_Supported", flag(d.lss));
        extras(d.extras);
    }

    void commissioning(const Commissioning& c) {
        section("DeviceComissioning");
        key("NodeID", c.node_id == 0 ? "" : std::to_string(c.node_id));
        key("NodeName", c.node_name);
        given("NodeRefd", c.node_reference);
        key("Baudrate", std::to_string(c.baud_rate));
        key("NetNumber", std::to_string(c.network));
        key("NetworkName", c.network_name);
        given("NetRefd", c.network_reference);
        key("CANopenManager", flag(c.manager));
        key("LSS_SerialNumber", hex(c.lss_serial_number, 8));
        extras(c.extras);
    }

    void comments(const std::string& name, const std::vector<std::string>& lines) {
        if (lines.empty() && !has_other(name)) return;
        section(name);
        key("Lines", std::to_string(lines.size()));
        for (std::size_t i = 0; i < lines.size(); ++i) {
            key("Line" + std::to_string(i + 1), lines[i]);
        }
        other(name);
    }

    void dynamic_channels() {
        section("DynamicChannels");
        key("NrOfSeg", std::to_string(d_.dynamic_channels.size()));
        for (std::size_t i = 0; i < d_.dynamic_channels.size(); ++i) {
            const DynamicSegment& one = d_.dynamic_channels[i];
            const std::string n = std::to_string(i + 1);
            key("Type" + n, hex(one.type));
            key("Dir" + n, name_of(one.access));
            key("Range" + n, one.range);
            key("PPOffset" + n, std::to_string(one.image_offset));
        }
        other("DynamicChannels");
    }

    void list(const std::string& name, Category category) {
        section(name);
        std::vector<const Object*> members;
        for (const Object& object : d_.objects) {
            if (object.category == category) {
                members.push_back(&object);
            }
        }
        key("SupportedObjects", std::to_string(members.size()));
        for (std::size_t i = 0; i < members.size(); ++i) {
            key(std::to_string(i + 1), hex(members[i]->index));
        }
        other(name);
        for (const Object* one : members) {
            object(*one, "");
        }
    }

    void values(const Entry& entry) {
        given("LowLimit", entry.low_limit);
        given("HighLimit", entry.high_limit);
        key("AccessType", name_of(entry.access));
        given("DefaultValue", entry.default_value);
        key("PDOMapping", flag(entry.pdo_mapping));
    }
    void configured(const Entry& entry) {
        given("Denotation", entry.denotation);
        given("ParameterValue", entry.parameter_value);
        given("UploadFile", entry.upload_file);
        given("DownloadFile", entry.download_file);
    }
    void flags(std::uint32_t bits) {
        if (bits != 0) {
            key("ObjFlags", hex(bits, 1));
        }
    }
    void described(const Entry& entry) {
        key("ParameterName", entry.name);
        key("ObjectType", hex(static_cast<unsigned>(entry.type), 1));
        if (entry.data_type != 0) {
            key("DataType", hex(entry.data_type));
        }
        values(entry);
        configured(entry);
        flags(entry.flags);
    }

    void spread(const Object& o, const std::string& name, std::string Entry::* field,
                const std::vector<std::string>& usual) {
        std::vector<std::pair<unsigned, const std::string*>> different;
        for (const Entry& entry : o.entries) {
            if (entry.*field != usual[entry.sub] && !(entry.*field).empty()) {
                different.emplace_back(entry.sub, &(entry.*field));
            }
        }
        if (different.empty()) return;
        section(name);
        key("NrOfEntries", std::to_string(different.size()));
        for (const auto& [sub, text] : different) {
            key(std::to_string(sub), *text);
        }
    }

    /// Writes the sections of an object and of its sub-indices (CiA 306-1). Keys that are not given
    /// are left out.
    void object(const Object& o, const std::string& prefix) {
        section(prefix + label(o.index));
        key("ParameterName", o.name);
        key("ObjectType", hex(static_cast<unsigned>(o.type), 1));
        given("Denotation", o.denotation);
        flags(o.flags);
        if (o.single() && !o.entries.empty()) {
            const Entry& only = o.entries[0];
            if (only.data_type != 0) {
                key("DataType", hex(only.data_type));
            }
            values(only);
            Entry rest = only;
            rest.denotation.clear();
            configured(rest);
            extras(o.extras);
            extras(only.extras);
        } else if (compactable(o)) {
            const Entry& one = o.entries[1];
            if (one.data_type != 0) {
                key("DataType", hex(one.data_type));
            }
            values(one);
            key("CompactSubObj", std::to_string(o.compact));
            extras(o.extras);
            const std::vector<std::string> none(256);
            std::vector<std::string> names(256);
            for (unsigned i = 1; i <= o.compact; ++i) {
                names[i] = o.name + std::to_string(i);
            }
            names[0] = o.entries[0].name;
            spread(o, prefix + label(o.index) + "Name", &Entry::name, names);
            spread(o, prefix + label(o.index) + "Value", &Entry::parameter_value, none);
            spread(o, prefix + label(o.index) + "Denotation", &Entry::denotation, none);
        } else {
            if (o.data_type != 0) {
                key("DataType", hex(o.data_type));
            }
            key("SubNumber", hex(o.entries.size(), 1));
            extras(o.extras);
            for (const Entry& entry : o.entries) {
                section(prefix + label(o.index, entry.sub));
                described(entry);
                extras(entry.extras);
            }
        }
        if (o.links.empty()) return;
        section(prefix + label(o.index) + "ObjectLinks");
        key("ObjectLinks", std::to_string(o.links.size()));
        for (std::size_t i = 0; i < o.links.size(); ++i) {
            key(std::to_string(i + 1), hex(o.links[i]));
        }
    }

    void modules() {
        section("SupportedModules");
        unsigned highest = 0;
        for (const Module& one : d_.modules) {
            highest = std::max(highest, one.number);
        }
        key("NrOfEntries", std::to_string(highest));
        for (const Module& one : d_.modules) {
            const std::string prefix = "M" + std::to_string(one.number);
            section(prefix + "ModuleInfo");
            key("ProductName", one.product_name);
            key("ProductVersion", one.version);
            key("ProductRevision", one.revision);
            key("OrderCode", one.order_code);
            extras(one.extras);
            comments(prefix + "Comments", one.comments);
            section(prefix + "FixedObjects");
            key("NrOfEntries", std::to_string(one.fixed.size()));
            for (std::size_t i = 0; i < one.fixed.size(); ++i) {
                key(std::to_string(i + 1), hex(one.fixed[i].index));
            }
            for (const Object& fixed : one.fixed) {
                object(fixed, prefix);
            }
            if (one.extensions.empty()) continue;
            section(prefix + "SubExtends");
            key("NrOfEntries", std::to_string(one.extensions.size()));
            for (std::size_t i = 0; i < one.extensions.size(); ++i) {
                key(std::to_string(i + 1), hex(one.extensions[i].object.index));
            }
            for (const SubExtension& extension : one.extensions) {
                const Entry& entry = extension.object.entries.at(0);
                section(prefix + "SubExt" + label(extension.object.index));
                described(entry);
                key("Count", extension.count);
                key("ObjExtend", extension.object_extend);
                extras(entry.extras);
            }
        }
    }

    const DeviceDescription& d_;
    std::string out_;
    std::map<std::string, bool> written_;
};

}  // namespace

std::string write_eds(const DeviceDescription& description) { return Writer(description).write(); }

}  // namespace hal::canopen::eds
