// SPDX-License-Identifier: MIT
#include "ethercat/esc/frame_interest.hpp"

#include "ethercat/wire/registers.hpp"

namespace hal::ethercat::esc {

namespace {

bool is_to_station(Command command) noexcept {
    return command == Command::fprd || command == Command::fpwr || command == Command::fprw;
}

bool only_reads(Command command) noexcept {
    return command == Command::aprd || command == Command::fprd || command == Command::brd;
}

}  // namespace

void FrameAddresses::read(std::span<const DatagramView> datagrams) noexcept {
    everyone_ = datagrams.size() > max_datagrams;
    latches_ = false;
    first_logical_ = ~std::uint64_t{0};
    end_logical_ = 0;
    station_count_ = 0;
    for (const DatagramView& d : datagrams) {
        if (d.command == Command::nop) continue;
        if (is_logical(d.command)) {
            first_logical_ = std::min<std::uint64_t>(first_logical_, d.address);
            end_logical_ =
                std::max<std::uint64_t>(end_logical_, std::uint64_t{d.address} + d.length);
            continue;
        }
        const unsigned address = d.register_address();
        latches_ |= !only_reads(d.command) && address <= registers::dc_receive_time &&
                    address + d.length > registers::dc_receive_time;
        if (is_to_station(d.command) && station_count_ < stations_.size()) {
            stations_[station_count_++] = d.position();
        } else {
            everyone_ = true;
        }
    }
}

}  // namespace hal::ethercat::esc
