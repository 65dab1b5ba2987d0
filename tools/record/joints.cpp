// SPDX-License-Identifier: MIT
#include "record/joints.hpp"

#include <algorithm>
#include <bit>
#include <limits>

#include "record/cdr.hpp"

namespace hal::tools {
namespace {

enum Quantity { position, velocity, effort, other };

Quantity quantity_of(const ProbeColumn& column) {
    if (column.type != HAL_TYPE_FLOAT) return other;
    const std::string& unit = column.unit;
    if (unit == "rad" || unit == "m") return position;
    if (unit == "rad/s" || unit == "m/s") return velocity;
    if (unit == "N*m" || unit == "N") return effort;
    return other;
}

}  // namespace

const char* Joints::schema() {
    return "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] "
           "velocity\nfloat64[] effort\n"
           "================================================================================\n"
           "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
           "================================================================================\n"
           "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
}

Joints::Joints(const std::vector<ProbeColumn>& columns) {
    for (std::size_t i = 0; i < columns.size(); ++i) {
        const Quantity quantity = quantity_of(columns[i]);
        if (quantity == other) continue;
        const std::string name = columns[i].name.substr(0, columns[i].name.find_last_of(".-"));
        auto joint = std::find_if(joints_.begin(), joints_.end(),
                                  [&](const Joint& one) { return one.name == name; });
        if (joint == joints_.end()) {
            joint = joints_.insert(joint, Joint{name});
        }
        if (joint->columns[quantity] == none) {
            joint->columns[quantity] = i;
        }
    }
    std::erase_if(joints_, [](const Joint& joint) { return joint.columns[position] == none; });
    for (const Joint& joint : joints_) {
        for (const Quantity quantity : {position, velocity, effort}) {
            any_[quantity] |= joint.columns[quantity] != none;
        }
    }
}

void Joints::write(const std::uint64_t* words, std::int64_t unix_ns, std::string& to) const {
    constexpr std::int64_t second = 1'000'000'000;
    Cdr cdr(to);
    cdr.word(static_cast<std::uint32_t>(unix_ns / second));
    cdr.word(static_cast<std::uint32_t>(unix_ns % second));
    cdr.text("");
    cdr.word(static_cast<std::uint32_t>(joints_.size()));
    for (const Joint& joint : joints_) {
        cdr.text(joint.name);
    }
    for (const Quantity quantity : {position, velocity, effort}) {
        cdr.word(any_[quantity] ? static_cast<std::uint32_t>(joints_.size()) : 0);
        if (!any_[quantity]) continue;
        for (const Joint& joint : joints_) {
            cdr.real(joint.columns[quantity] == none
                         ? std::numeric_limits<double>::quiet_NaN()
                         : std::bit_cast<double>(words[joint.columns[quantity]]));
        }
    }
}

}  // namespace hal::tools
