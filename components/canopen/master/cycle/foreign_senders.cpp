// SPDX-License-Identifier: MIT
#include "foreign_senders.hpp"

#include <algorithm>

namespace hal::canopen {

std::optional<ForeignFrames> ForeignSenders::count(const can::Frame& f, Time now) noexcept {
    const bool is_data = !f.extended && !f.error && !f.remote;
    if (!is_data || f.id >= identifiers || !ours_[f.id] || now < from_) return {};
    Count& count = counts_[f.id];
    const bool begins = count.last == 0 || now - count.last > second;
    count.frames = begins ? 1 : count.frames + 1;
    count.last = now;
    if (!begins && now - count.reported < second) return {};
    ForeignFrames report{
        .id = static_cast<std::uint16_t>(f.id), .frames = count.frames, .begins = begins};
    std::copy_n(f.data.begin(), 2, report.data.begin());
    report.sync = f.id == sync_;
    report.rpdo = rpdos_[f.id];
    count.reported = now;
    count.frames = 0;
    return report;
}

}  // namespace hal::canopen
