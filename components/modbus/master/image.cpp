// SPDX-License-Identifier: MIT
#include "image.hpp"

#include <new>

namespace hal::modbus {

Image::Image(void* memory, const Bus& bus, const Plan& plan, bool fresh) {
    auto* const bytes = static_cast<std::byte*>(memory);
    const std::size_t slaves = bus.slaves.size();
    const std::size_t telegrams = plan.telegrams.size();
    std::byte* const values = bytes + offset_values(slaves, telegrams);
    const std::size_t count = plan.values.size();
    void* const at[] = {bytes, bytes + sizeof(ImageHeader), bytes + offset_telegrams(slaves),
                        values, values + count * sizeof(std::atomic<std::uint64_t>)};
    if (fresh) {
        new (at[0]) ImageHeader;
        for (std::size_t n = 0; n < slaves; ++n) {
            new (static_cast<SlaveImage*>(at[1]) + n) SlaveImage;
        }
        for (std::size_t n = 0; n < telegrams; ++n) {
            new (static_cast<TelegramImage*>(at[2]) + n) TelegramImage;
        }
        for (std::size_t n = 0; n < count; ++n) {
            new (static_cast<std::atomic<std::uint64_t>*>(at[3]) + n) std::atomic<std::uint64_t>(0);
            new (static_cast<std::atomic<std::int64_t>*>(at[4]) + n) std::atomic<std::int64_t>(0);
        }
    }
    header_ = static_cast<ImageHeader*>(at[0]);
    slaves_ = static_cast<SlaveImage*>(at[1]);
    telegrams_ = static_cast<TelegramImage*>(at[2]);
    values_ = static_cast<std::atomic<std::uint64_t>*>(at[3]);
    value_stamps_ = static_cast<std::atomic<std::int64_t>*>(at[4]);
}

}  // namespace hal::modbus
