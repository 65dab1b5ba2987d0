// SPDX-License-Identifier: MIT
#include "axis_binding.hpp"

#include "cia301/error_register.hpp"
#include "cia402/drive/axis_objects.hpp"

namespace hal::canopen {

using namespace cia402;

AxisBinding::AxisBinding(unsigned number, const AxisSettings& settings)
    : number_(number), axis_(settings) {
    axis_.connect(*this);
}

void AxisBinding::attach(Device& device) {
    device_ = &device;
    each_object(axis_.values(), [&](const ObjectRow& row, auto& value) {
        const auto index = of_axis(row.index, number_);
        device.dictionary().bind(index, row.sub, value);
        device.dictionary().handle(index, *this);
    });
}

Abort AxisBinding::writing(Entry& entry, std::span<const std::uint8_t> value) noexcept {
    switch (axis_.check(of_first_axis(entry.index), value)) {
    case WriteCheck::accepted: return Abort::none;
    case WriteCheck::invalid_value: return Abort::value;
    case WriteCheck::wrong_state: return Abort::device_state;
    case WriteCheck::buffer_full: return Abort::no_resource;
    }
    return Abort::none;
}

void AxisBinding::written(Entry& entry) noexcept {
    axis_.written(of_first_axis(entry.index), entry.sub);
}

/// An EMCY has the axis in byte 3, then the detail.
void AxisBinding::raise(std::uint16_t code, std::int32_t detail) noexcept {
    if (device_ == nullptr) return;
    Emcy::Bytes bytes{static_cast<std::uint8_t>(number_)};
    store(bytes.data() + 1, detail);
    device_->emcy().raise(code, cia301::register_bit_of(code), bytes,
                          static_cast<std::uint8_t>(number_ + 1));
}

void AxisBinding::clear(std::uint16_t code) noexcept {
    if (device_ == nullptr) return;
    device_->emcy().clear(code, static_cast<std::uint8_t>(number_ + 1));
}

bool AxisBinding::master_alive() const noexcept {
    return device_ == nullptr || device_->error_control().all_alive();
}

}  // namespace hal::canopen
