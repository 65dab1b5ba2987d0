// SPDX-License-Identifier: MIT
#include "card_image.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>

#include "mesa/hostmot2/boards.hpp"
#include "mesa/hostmot2/module_kinds.hpp"
#include "mesa/lbp16/spaces.hpp"

namespace hal::mesa {

namespace {

std::string hex(std::uint32_t value, int digits) {
    char text[16];
    std::snprintf(text, sizeof text, "0x%0*X", digits, value);
    return text;
}

/// Returns the characters up to the first that is not printable, for messages.
std::string printable(std::string_view text) {
    std::string result;
    for (const char c : text) {
        if (std::isprint(static_cast<unsigned char>(c)) == 0) break;
        result += c;
    }
    return result;
}

std::string name_of_card(const std::string& card) {
    if (const Board* board = board_of(card)) return std::string(board->name);
    std::string name;
    for (const char c : card) {
        if (std::isalnum(static_cast<unsigned char>(c)) == 0) break;
        name += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    return name.empty() ? "card" : name;
}

std::vector<std::uint8_t> read_bytes(SetupLink& link, std::uint16_t address, std::size_t size) {
    Request request;
    request.read(Space::hostmot2, address, Unit::u32, size / 4);
    const auto bytes = link.exchange(request);
    return {bytes.begin(), bytes.end()};
}

std::string sentence_of(IdromFault fault, const Idrom& idrom) {
    switch (fault) {
    case IdromFault::none: return {};
    case IdromFault::type:
        return "unknown firmware: IDROM type " + std::to_string(idrom.type) +
               "; the driver supports 2 and 3";
    case IdromFault::width:
        return "unknown firmware: " + std::to_string(idrom.ports) + " ports of " +
               std::to_string(idrom.port_width) + " pins, but " + std::to_string(idrom.width) +
               " pins in all";
    case IdromFault::no_pins: return "unknown firmware: it has no pins";
    case IdromFault::many_pins:
        return "unknown firmware: " + std::to_string(idrom.width) +
               " pins; the driver supports up to " + std::to_string(max_pins);
    case IdromFault::clock:
        return "unknown firmware: clocks of " + std::to_string(idrom.clock_low_hz) + " and " +
               std::to_string(idrom.clock_high_hz) + " Hz; at least 1 MHz is expected";
    case IdromFault::descriptors:
        return "unknown firmware: its tables of modules and pins are outside of the registers";
    }
    return {};
}

/// Versions with flags in their upper bits are written as in the sources of the firmware: 0xC2.
std::string version_text(std::uint8_t version) {
    return version < 0x10 ? std::to_string(version) : hex(version, 2);
}

std::string versions_of(const ModuleKind& kind) {
    std::string text;
    for (const std::uint8_t version : kind.versions) {
        text += (text.empty() ? "" : ", ") + version_text(version);
    }
    return text;
}

std::string instances_text(unsigned count) {
    return std::to_string(count) + (count == 1 ? " instance" : " instances");
}

std::string sentence_of(ModuleFault fault, const CardModule& module, const ModuleKind& kind) {
    const std::string name = "module " + std::string(kind.name) + " of the firmware";
    const ModuleDescriptor& d = module.descriptor;
    switch (fault) {
    case ModuleFault::none: return {};
    case ModuleFault::version:
        return name + " has version " + version_text(d.version) + "; the driver supports " +
               versions_of(kind);
    case ModuleFault::registers:
        return name + " has " + std::to_string(d.registers) + " registers; the driver supports " +
               std::to_string(kind.registers);
    case ModuleFault::instance_stride:
        return name + " has an instance stride of " + hex(module.addresses.instance_stride, 2) +
               "; the driver supports " + hex(kind.instance_stride, 2);
    case ModuleFault::per_instance:
        return name + " has the register map " + hex(d.per_instance, 4) + "; the driver supports " +
               hex(kind.per_instance, 4);
    case ModuleFault::outside: return name + " has registers outside of the 64 KiB of the card";
    }
    return {};
}

[[noreturn]] void reject(const CardImage& image, const std::string& sentence) {
    const std::string who =
        image.card.empty() ? image.address : image.address + " (" + image.card + ")";
    throw CardError(who + ": " + sentence);
}

/// The registers of I/O ports and of the enables of PWM have a bit for each pin or instance.
constexpr unsigned max_register_bits = 32;

void read_identity(SetupLink& link, CardImage& image) {
    const auto name = link.read16(Space::card, card::name, 8);
    image.card = printable(text_of({reinterpret_cast<const char*>(name.data()), name.size()}));
    image.name = name_of_card(image.card);
    image.lbp_version = load<std::uint16_t>(link.read16(Space::card, card::lbp_version, 1).data());
    // the numbers of requests are in scratch registers of the space of timers
    if (image.lbp_version < 3) {
        reject(image, "LBP16 version " + std::to_string(image.lbp_version) +
                          "; the driver needs version 3; to write another firmware: mesaflash");
    }
}

std::uint16_t read_firmware(SetupLink& link, const CardImage& image) {
    const std::vector<std::uint8_t> head = read_bytes(link, cookie_address, 16);
    const auto cookie = load<std::uint32_t>(head.data());
    if (cookie != hostmot2_cookie) {
        reject(image, "wrong cookie " + hex(cookie, 8) + " in place of " + hex(hostmot2_cookie, 8) +
                          ": no HostMot2 firmware is running on this device");
    }
    const std::string_view name(reinterpret_cast<const char*>(head.data()) + 4, 8);
    if (name != firmware_name) {
        reject(image, "unknown firmware '" + printable(name) + "'; the driver supports " +
                          std::string(firmware_name));
    }
    return load<std::uint16_t>(head.data() + 12);
}

/// The modules that use the pins of a driver: one descriptor has all their instances.
bool is_same_module(Tag one, Tag other) noexcept {
    const auto kind = [](Tag tag) { return tag == Tag::muxed_encoder ? Tag::encoder : tag; };
    return kind(one) == kind(other);
}

/// Rejects a descriptor of a known module that the driver cannot use.
void check_module(const CardImage& image, const CardModule& module) {
    const ModuleDescriptor& descriptor = module.descriptor;
    const ModuleKind* const kind = kind_of(descriptor.tag);
    if (kind == nullptr) return;
    const ModuleFault fault = fault_of(descriptor, *kind, image.idrom);
    if (fault != ModuleFault::none) {
        reject(image, sentence_of(fault, module, *kind));
    }
    if (descriptor.instances > max_register_bits) {
        reject(image, "module " + std::string(kind->name) + " of the firmware has " +
                          std::to_string(descriptor.instances) +
                          " instances; the driver supports up to 32");
    }
    for (const CardModule& before : image.modules) {
        if (!is_same_module(before.tag(), descriptor.tag)) continue;
        const std::string first(name_of(before.tag()));
        const std::string second(kind->name);
        reject(image, "the firmware has the modules " + first + " and " + second +
                          "; the driver supports one of this kind");
    }
}

void read_modules(SetupLink& link, CardImage& image, std::uint16_t at) {
    for (std::size_t n = 0; n < max_modules; ++n) {
        const auto address = static_cast<std::uint16_t>(at + n * ModuleDescriptor::size);
        const auto descriptor =
            ModuleDescriptor::decode(read_bytes(link, address, ModuleDescriptor::size));
        if (!descriptor || descriptor->tag == Tag::none) return;
        CardModule module;
        module.descriptor = *descriptor;
        module.addresses = ModuleAddresses(*descriptor, image.idrom);
        module.clock_hz = clock_hz(*descriptor, image.idrom);
        check_module(image, module);
        image.modules.push_back(module);
    }
}

void read_pins(SetupLink& link, CardImage& image, std::uint16_t at) {
    constexpr std::size_t at_once = 64;
    for (std::size_t n = 0; n < image.idrom.width; n += at_once) {
        const std::size_t count = std::min<std::size_t>(at_once, image.idrom.width - n);
        const auto bytes = read_bytes(link, static_cast<std::uint16_t>(at + n * 4), count * 4);
        for (std::size_t i = 0; i < count; ++i) {
            const auto pin = PinDescriptor::decode(load<std::uint32_t>(bytes.data() + i * 4));
            if (pin.primary != Tag::ioport) {
                reject(image, "unknown firmware: pin " + std::to_string(n + i) +
                                  " is not an I/O pin (tag " +
                                  hex(static_cast<std::uint8_t>(pin.primary), 2) + ")");
            }
            image.pins.push_back({pin, true});
        }
    }
}

/// Returns the channel of a pin of smart serial.
unsigned serial_channel(const PinDescriptor& pin) noexcept {
    namespace number = pin_number::smart_serial;
    return (pin.number - 1U) % (number::first_enable - number::first_transmit);
}

bool is_serial(Tag tag) noexcept {
    return tag == Tag::smart_serial || tag == Tag::wide_smart_serial;
}

bool is_used(const CardImage& image, const ConfigString& config, const PinDescriptor& pin) {
    if (pin.module == Tag::mux_select) {
        const CardModule* const muxed = image.find(Tag::muxed_encoder);
        return muxed != nullptr && muxed->used > 0;
    }
    const CardModule* const module = image.find(pin.module);
    if (module == nullptr || module->used == 0) return false;
    if (is_serial(pin.module)) {
        if (pin.unit >= module->used) return false;
        return (image.serial_channels(config, pin.unit) >> serial_channel(pin) & 1U) != 0;
    }
    if (pin.unit == PinDescriptor::all_units) return true;
    // the pins of a unit have two encoders, which the multiplexer selects
    if (pin.module == Tag::muxed_encoder) return pin.unit < (module->used + 1) / 2;
    if (pin.module == Tag::ssr || pin.module == Tag::outm || pin.module == Tag::inm ||
        pin.module == Tag::inmux) {
        return pin.unit < module->used;
    }
    if (pin.module == Tag::stepgen && pin.number > config.stepgen_width() &&
        pin.number <= pin_number::stepgen::last_table) {
        return false;
    }
    return pin.unit < module->used;
}

/// What this driver does with a module.
enum class ModuleUse : std::uint8_t {
    driven,
    without_pins,  ///< in LinuxCNC, a component of the user calls C functions for it
    unsupported,
    unknown,
};
ModuleUse use_of(Tag tag) noexcept {
    switch (tag) {
    case Tag::uart_transmit:
    case Tag::uart_receive:
    case Tag::packet_uart_transmit:
    case Tag::packet_uart_receive: return ModuleUse::without_pins;
    case Tag::mux_select: return ModuleUse::driven;  // by the muxed encoders
    default: break;
    }
    if (kind_of(tag) != nullptr) return ModuleUse::driven;
    return name_of(tag) == "?" ? ModuleUse::unknown : ModuleUse::unsupported;
}

CardModule example_module(Tag tag, std::uint16_t base, const ModuleChoice& choice = {}) {
    CardModule module;
    module.descriptor = module_descriptor(tag, base, choice);
    module.addresses = ModuleAddresses(module.descriptor, Idrom{});
    module.clock_hz = clock_hz(module.descriptor, Idrom{});
    return module;
}

}  // namespace

const CardModule* CardImage::find(Tag tag) const noexcept {
    const auto found = std::ranges::find(modules, tag, &CardModule::tag);
    return found == modules.end() ? nullptr : &*found;
}
CardModule* CardImage::find(Tag tag) noexcept {
    const auto found = std::ranges::find(modules, tag, &CardModule::tag);
    return found == modules.end() ? nullptr : &*found;
}

std::uint32_t CardImage::serial_channels(const ConfigString& config, unsigned port) const noexcept {
    std::uint32_t present = 0;
    for (const CardPin& pin : pins) {
        if (is_serial(pin.descriptor.module) && pin.descriptor.unit == port) {
            present |= 1U << serial_channel(pin.descriptor);
        }
    }
    for (unsigned channel = 0; channel < ConfigString::max_channels; ++channel) {
        if (config.serial_mode(port, channel) < 0) {
            present &= ~(1U << channel);
        }
    }
    return present;
}

void CardImage::release_channels(unsigned port, std::uint32_t devices) noexcept {
    for (CardPin& pin : pins) {
        const PinDescriptor& d = pin.descriptor;
        if (!is_serial(d.module) || d.unit != port) continue;
        const bool has_device = (devices >> serial_channel(d) & 1U) != 0;
        pin.is_gpio = pin.is_gpio || !has_device;
    }
}

CardImage probe(SetupLink& link) {
    CardImage image;
    image.address = link.address();
    read_identity(link, image);
    const std::uint16_t at = read_firmware(link, image);
    if (at % 4 != 0) {
        reject(image, "unknown firmware: its IDROM is at " + hex(at, 4));
    }
    const auto idrom = Idrom::decode(read_bytes(link, at, Idrom::size));
    if (!idrom) {
        reject(image, "unknown firmware: its IDROM is too short");
    }
    image.idrom = *idrom;
    if (const IdromFault fault = fault_of(*idrom, at); fault != IdromFault::none) {
        reject(image, sentence_of(fault, *idrom));
    }
    if (idrom->port_width > max_register_bits) {
        reject(image, "unknown firmware: ports of " + std::to_string(idrom->port_width) +
                          " pins; the driver supports up to 32");
    }
    read_modules(link, image, static_cast<std::uint16_t>(at + idrom->modules));
    read_pins(link, image, static_cast<std::uint16_t>(at + idrom->pins));
    const CardModule* const ports = image.find(Tag::ioport);
    if (ports == nullptr || image.find(Tag::watchdog) == nullptr) {
        reject(image, "unknown firmware: it has no I/O ports or no watchdog");
    }
    if (ports->descriptor.instances != idrom->ports) {
        reject(image, "unknown firmware: " + std::to_string(idrom->ports) + " ports, but " +
                          std::to_string(ports->descriptor.instances) + " of their modules");
    }
    return image;
}

std::string apply(const ConfigString& config, CardImage& image) {
    for (CardModule& module : image.modules) {
        const std::string_view item = ConfigString::item_of(module.tag());
        const int asked = item.empty() ? ConfigString::all : config.count(module.tag());
        // the instances of these are counted in outputs, of which each module has many
        const unsigned present = module.tag() == Tag::led ? 4U : module.descriptor.instances;
        if (asked > static_cast<int>(present)) {
            return image.address + " (" + image.card + "): config asks for " + std::string(item) +
                   "=" + std::to_string(asked) + ", but the firmware has " +
                   std::to_string(present) + "; without " + std::string(item) +
                   " all of them are used";
        }
        module.used = asked == ConfigString::all ? present : static_cast<unsigned>(asked);
        if (use_of(module.tag()) != ModuleUse::driven) {
            module.used = 0;  // so its pins are GPIO
        }
    }
    for (const Tag tag : {Tag::encoder, Tag::stepgen, Tag::pwm, Tag::three_phase_pwm, Tag::ssr,
                          Tag::inm, Tag::inmux, Tag::outm, Tag::dpll, Tag::led, Tag::uart_transmit,
                          Tag::packet_uart_transmit}) {
        const bool is_muxed = tag == Tag::encoder && image.find(Tag::muxed_encoder) != nullptr;
        if (is_muxed || image.find(tag) != nullptr || config.count(tag) <= 0) continue;
        return image.address + " (" + image.card + "): config asks for " +
               std::string(ConfigString::item_of(tag)) + "=" + std::to_string(config.count(tag)) +
               ", but the firmware does not have this module";
    }
    for (CardPin& pin : image.pins) {
        pin.is_gpio = !is_used(image, config, pin.descriptor);
    }
    return {};
}

std::vector<std::string> unused_modules(const CardImage& image) {
    std::vector<std::string> texts;
    for (const CardModule& module : image.modules) {
        const ModuleDescriptor& d = module.descriptor;
        const std::string name(name_of(d.tag));
        const std::string details = "tag " + hex(static_cast<std::uint8_t>(d.tag), 2) +
                                    ", version " + version_text(d.version) + ", " +
                                    instances_text(d.instances);
        switch (use_of(d.tag)) {
        case ModuleUse::driven: break;
        case ModuleUse::without_pins:
            texts.push_back("module " + name + " (" + details +
                            ") is not used: UARTs have no pins in HAL; its I/O pins are GPIO");
            break;
        case ModuleUse::unsupported:
            texts.push_back("module " + name + " (" + details +
                            ") is not supported; its I/O pins are GPIO");
            break;
        case ModuleUse::unknown:
            texts.push_back("unknown module (" + details + ") is not used; its I/O pins are GPIO");
            break;
        }
    }
    return texts;
}

CardImage example_card() {
    CardImage image;
    image.address = "sim:card";
    image.card = "7I76E-16";
    image.name = "7i76e";
    image.lbp_version = 3;
    // one port and one instance of each, for short texts
    image.idrom.ports = 1;
    image.idrom.port_width = 17;
    image.idrom.width = 17;
    image.modules = {
        example_module(Tag::ioport, 0x1000),
        example_module(Tag::stepgen, 0x2000, {.version = 2}),
        example_module(Tag::encoder, 0x3000, {.version = 3}),
        example_module(Tag::pwm, 0x4100, {.clock = ClockTag::high}),
        example_module(Tag::watchdog, 0x0c00),
        example_module(Tag::dpll, 0x7000),
        example_module(Tag::led, 0x0200),
    };
    image.pins.resize(image.idrom.width);
    image.pins[0].descriptor = {pin_number::stepgen::direction, true, Tag::stepgen, 0};
    image.pins[1].descriptor = {pin_number::stepgen::step, true, Tag::stepgen, 0};
    image.pins[14].descriptor = {pin_number::encoder::index, false, Tag::encoder, 0};
    image.pins[15].descriptor = {pin_number::encoder::b, false, Tag::encoder, 0};
    image.pins[16].descriptor = {pin_number::encoder::a, false, Tag::encoder, 0};
    return image;
}

}  // namespace hal::mesa
