// SPDX-License-Identifier: MIT
#include "module.hpp"

#include <algorithm>

#include "module_kinds.hpp"

namespace hal::mesa {

namespace {

/// Modules without a driver here.
struct OtherModule {
    std::uint8_t tag;
    std::string_view name;
};
constexpr OtherModule other_modules[] = {
    {0x07, "SPI"},
    {0x08, "SSI"},
    {0x0b, "translation RAM"},
    {0x0d, "encoder multiplexer"},
    {0x0e, "buffered SPI"},
    {0x0f, "decoded buffered SPI"},
    {0x10, "old DPLL"},
    {0x11, "muxed encoder with index mask"},
    {0x14, "waveform generator"},
    {0x15, "data acquisition FIFO"},
    {0x16, "binary oscillator"},
    {0x17, "demand-mode DMA"},
    {0x18, "BiSS"},
    {0x19, "Fanuc encoder"},
    {0x2a, "data painter"},
    {0x2b, "XY2-100 galvo"},
    {0x2c, "RC PWM"},
    {0x40, "long I/O port"},
    {0xc0, "resolver"},
    {0xc2, "twiddler"},
    {0xc7, "one-shot"},
    {0xc8, "period meter"},
};

}  // namespace

std::array<std::uint8_t, ModuleDescriptor::size> ModuleDescriptor::encode() const noexcept {
    std::array<std::uint8_t, size> bytes{};
    bytes[0] = static_cast<std::uint8_t>(tag);
    bytes[1] = version;
    bytes[2] = static_cast<std::uint8_t>(clock);
    bytes[3] = instances;
    store(bytes.data() + 4, base);
    bytes[6] = registers;
    bytes[7] = strides;
    store(bytes.data() + 8, per_instance);
    return bytes;
}

std::optional<ModuleDescriptor> ModuleDescriptor::decode(
    std::span<const std::uint8_t> bytes) noexcept {
    if (bytes.size() < size) return {};
    ModuleDescriptor module;
    module.tag = static_cast<Tag>(bytes[0]);
    module.version = bytes[1];
    module.clock = static_cast<ClockTag>(bytes[2]);
    module.instances = bytes[3];
    module.base = load<std::uint16_t>(bytes.data() + 4);
    module.registers = bytes[6];
    module.strides = bytes[7];
    module.per_instance = load<std::uint32_t>(bytes.data() + 8);
    return module;
}

ModuleAddresses::ModuleAddresses(const ModuleDescriptor& module, const Idrom& idrom) noexcept
    : base(module.base),
      register_stride(static_cast<std::uint16_t>(idrom.register_strides[module.strides & 1U])),
      instance_stride(
          static_cast<std::uint16_t>(idrom.instance_strides[module.strides >> 4 & 1U])) {}

const ModuleKind* kind_of(Tag tag) noexcept {
    const auto* const found = std::ranges::find(module_kinds, tag, &ModuleKind::tag);
    return found == std::end(module_kinds) ? nullptr : found;
}

std::string_view name_of(Tag tag) noexcept {
    if (const ModuleKind* kind = kind_of(tag)) return kind->name;
    const auto* const other =
        std::ranges::find(other_modules, static_cast<std::uint8_t>(tag), &OtherModule::tag);
    return other == std::end(other_modules) ? "?" : other->name;
}

ModuleFault fault_of(const ModuleDescriptor& module, const ModuleKind& kind,
                     const Idrom& idrom) noexcept {
    const bool known_version =
        kind.versions.empty() || std::find(kind.versions.begin(), kind.versions.end(),
                                           module.version) != kind.versions.end();
    if (!known_version) return ModuleFault::version;
    if (kind.is_checked) {
        const ModuleAddresses addresses(module, idrom);
        if (module.registers != kind.registers) return ModuleFault::registers;
        if (addresses.instance_stride != kind.instance_stride) {
            return ModuleFault::instance_stride;
        }
        if (module.per_instance != kind.per_instance) return ModuleFault::per_instance;
    }
    const std::uint64_t last_register = module.registers == 0 ? 0 : module.registers - 1U;
    const std::uint64_t last_instance = module.instances == 0 ? 0 : module.instances - 1U;
    const std::uint64_t last = module.base +
                               last_register * idrom.register_strides[module.strides & 1U] +
                               last_instance * idrom.instance_strides[module.strides >> 4 & 1U];
    return last + 4 > 0x10000 ? ModuleFault::outside : ModuleFault::none;
}

}  // namespace hal::mesa
