// SPDX-License-Identifier: MIT
#include <cmath>

#include "bus/config/key_table.hpp"
#include "bus/config/section_file.hpp"
#include "demo_bus/config/demo_config.hpp"
#include "demo_bus/wire/frames.hpp"
#include "text/numbers.hpp"

namespace hal::demo {

namespace {

constexpr std::int64_t ms = 1'000'000;

constexpr bus::SectionKind kinds[] = {{"bus", "[bus]", bus::SectionUse::once},
                                      {"device", "[device N NAME]", bus::SectionUse::any}};

const bus::KeyTable<Bus>& bus_keys() {
    static const bus::KeyTable<Bus> table{{
        {"silence", bus::time(&Bus::silence_ns, ms, 60'000 * ms), "`100ms`",
         "A device is offline when it sends no value for this time."},
    }};
    return table;
}

bool parse_scale(Device& device, const bus::Entry& entry) {
    return parse_whole(entry.value.text, device.scale) && std::isfinite(device.scale) &&
           device.scale != 0.0;
}

const bus::KeyTable<Device>& device_keys() {
    static const bus::KeyTable<Device> table{{
        {"scale", bus::own("a number other than 0", "not 0", parse_scale), "`1`",
         "Units per count, of the value and of the set-point."},
    }};
    return table;
}

class Reader {
public:
    explicit Reader(std::string_view text)
        : sections_(text, kinds, "[device 5 pump]", key_report_) {}

    ReadResult read() {
        if (bus::Section* const section = sections_.one("bus")) {
            bus::Keys keys(key_report_);
            keys.add(*section);
            bus_keys().apply(keys, out_.bus, key_report_);
            keys.report_rest("in [bus]", bus_keys().names());
        }
        for (bus::Section* const section : sections_.all("device")) {
            read_device(*section);
        }
        out_.messages = std::move(report_.all);
        text::sort(out_.messages);
        return std::move(out_);
    }

private:
    void read_device(bus::Section& section) {
        Device device;
        const std::vector<text::Word>& words = section.words;
        const auto address = words.size() == 3 ? parse_natural(words[1].text) : std::nullopt;
        if (!address || *address < 1 || *address > max_address || !bus::is_name(words[2].text)) {
            report_.error(Topic::line, section.at,
                          "invalid device section: expected an address of 1..127 and a name",
                          "write [device 5 pump]");
            return;
        }
        device.address = static_cast<std::uint8_t>(*address);
        device.name = words[2].text;
        bus::Keys keys(key_report_);
        if (!sections_.add_keys(section, keys)) return;
        device_keys().apply(keys, device, key_report_);
        keys.report_rest("in [device " + words[1].text + "]", device_keys().names());
        out_.bus.devices.push_back(std::move(device));
    }

    ReadResult out_;
    text::Messages<Topic> report_;
    bus::TopicReport<Topic> key_report_{report_};
    bus::SectionFile sections_;
};

}  // namespace

const char* code_of(Topic topic) { return topic == Topic::line ? "demo-line" : "demo-value"; }
ReadResult read(std::string_view text) { return Reader(text).read(); }
std::string bus_reference() { return bus_keys().reference(); }
std::string device_reference() { return device_keys().reference(); }

}  // namespace hal::demo
