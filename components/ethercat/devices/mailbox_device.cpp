// SPDX-License-Identifier: MIT
#include "ethercat/devices/mailbox_device.hpp"

#include <cstring>
#include <utility>

#include "ethercat/devices/aoe_server.hpp"
#include "ethercat/devices/eoe_host.hpp"
#include "ethercat/devices/foe_server.hpp"
#include "ethercat/devices/soe_server.hpp"
#include "ethercat/devices/voe_echo.hpp"

namespace hal::ethercat::devices {
namespace {

/// Returns its outputs as inputs.
class Loopback : public Behaviour {
public:
    explicit Loopback(std::shared_ptr<Dictionary> d)
        : dictionary_(std::move(d)),
          from_(dictionary_->at(0x7000, 0)),
          to_(dictionary_->at(0x6000, 0)) {}
    void step(Step&) noexcept override { std::memcpy(to_, from_, 8); }

private:
    std::shared_ptr<Dictionary> dictionary_;
    std::uint8_t *from_, *to_;
};

std::vector<std::uint8_t> bytes_of_text(std::string_view text) {
    return {text.begin(), text.end()};
}

template <class T>
Idn idn_of(std::uint16_t number, std::uint32_t attribute, std::string name, std::string unit,
           std::vector<T> values, std::int64_t low = 0, std::int64_t high = 0) {
    Idn i{number,
          {attribute},
          std::move(name),
          std::move(unit),
          {},
          values.size() * sizeof(T),
          low,
          high,
          0};
    i.value.resize(i.length);
    std::memcpy(i.value.data(), values.data(), i.length);
    return i;
}

}  // namespace

Parts make_mailbox_device(const DeviceOptions& o) {
    namespace access = coe::access;
    namespace a = soe::attribute;
    DesignBuilder b("mailbox_device", 0x0b0001);
    b.mailbox(256, true);
    auto& d = b.dictionary();
    d.variable(0x7000, "Outputs", coe::type::u64, access::read_write | access::rx_mappable);
    d.variable(0x6000, "Inputs", coe::type::u64, access::read | access::tx_mappable);
    d.bytes(0x2000, "Block of 2000 bytes", 2000, access::read_write);
    d.variable(0x2001, "Limited value", coe::type::s16, access::read_write);
    d.limit(-100, 100);
    d.record(0x2002, "Record", 3);
    d.sub(1, "Byte", coe::type::u8, access::read_write);

    d.sub(2, "Word", coe::type::u16, access::read_write);
    d.sub(3, "Long word", coe::type::u32, access::read_write);
    b.pdo(true, coe::rx_pdo, "Outputs", {{0x7000, 0, "Outputs"}}, true, 4);
    b.pdo(false, coe::tx_pdo, "Inputs", {{0x6000, 0, "Inputs"}}, true, 4);
    b.dc(false);
    b.design().sii.general.soe_channels = 1;
    auto foe = std::make_unique<FoeServer>();
    foe->add("firmware", bytes_of_text("firmware 1.0"), 0x1234, true);
    foe->add("parameters", bytes_of_text("gain = 1\n"));
    b.service(std::move(foe));
    b.service(std::make_unique<EoeHost>());
    std::vector<Idn> idns;
    idns.push_back(idn_of<std::uint16_t>(1, a::bytes_2 | a::is_unsigned | a::protected_safeop_op,
                                         "Control unit cycle time", "us", {1000}, 62, 65000));
    idns.push_back(idn_of<std::uint16_t>(2, a::bytes_2 | a::is_unsigned | a::protected_safeop_op,
                                         "Communication cycle time", "us", {1000}, 62, 65000));
    idns.push_back(
        idn_of<std::uint16_t>(15, a::bytes_2 | a::is_unsigned, "Telegram type", "", {7}));
    idns.push_back(idn_of<std::uint16_t>(16, a::bytes_2 | a::idn | a::list | a::protected_safeop_op,
                                         "Configuration list of the AT", "", {51, 40}));
    idns.push_back(idn_of<std::uint16_t>(24, a::bytes_2 | a::idn | a::list | a::protected_safeop_op,
                                         "Configuration list of the MDT", "", {36}));
    idns.push_back(idn_of<std::int32_t>(36, a::bytes_4 | a::is_signed, "Velocity command value",
                                        "rpm", {0}, -6000, 6000));
    idns.push_back(idn_of<std::int32_t>(40, a::bytes_4 | a::is_signed | a::read_only,
                                        "Velocity feedback value", "rpm", {0}));
    idns.push_back(idn_of<std::int32_t>(51, a::bytes_4 | a::is_signed | a::read_only,
                                        "Position feedback value", "inc", {0}));
    auto table =
        idn_of<std::uint16_t>(soe::idn(true, 0, 150), a::bytes_2 | a::is_unsigned | a::list,
                              "Table", "", std::vector<std::uint16_t>(500));
    idns.push_back(std::move(table));
    std::vector<std::uint16_t> all{soe::idn_all};
    for (const auto& i : idns) {
        all.push_back(i.number);
    }
    idns.push_back(idn_of<std::uint16_t>(soe::idn_all, a::bytes_2 | a::idn | a::list | a::read_only,
                                         "All IDNs", "", all));
    b.service(std::make_unique<SoeServer>(std::move(idns)));
    b.service(std::make_unique<AoeServer>(b.design().dictionary));
    b.service(std::make_unique<VoeEcho>());
    auto design = b.finish(o.alias, o.serial, 64, 64);
    auto behaviour = std::make_unique<Loopback>(design.dictionary);
    return {std::move(design), std::move(behaviour)};
}

}  // namespace hal::ethercat::devices
