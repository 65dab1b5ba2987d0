// SPDX-License-Identifier: MIT
// The base of the groups of pins that LinuxCNC's lcec computes from the process data of a slave.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <string>

#include "cia301/values.hpp"
#include "ethercat/config/lcec_channel.hpp"
#include "hal/component.hpp"
#include "hal/pin_codec.hpp"

namespace hal::ethercat {

namespace master {
class RequestPort;
}

/// The process data of a bus in one cycle, as a slave sees it.
struct SlaveImage {
    std::span<const std::span<std::uint8_t>> areas;
    bool operational = false;
    std::int64_t period_ns = 0;
    bool reachable = false;  ///< by SDO: in PRE-OP or higher
    std::uint16_t slave = 0;  ///< its number on the bus, for requests
    master::RequestPort* mailbox = nullptr;  ///< of the thread of the cycle
};

/// Where an object is in the process data.
struct ImageField {
    std::size_t area = 0;
    std::size_t at = 0;  ///< bits from the beginning of the area
    unsigned bits = 0;   ///< 0: the slave does not have this object

    bool present() const noexcept { return bits != 0; }
    /// [realtime]
    std::uint64_t read(const SlaveImage& image) const noexcept {
        return present() ? read_bits(image.areas[area], at, bits) : 0;
    }
    /// [realtime]
    bool read_bit(const SlaveImage& image) const noexcept { return (read(image) & 1) != 0; }
    /// Returns the value with its sign. [realtime]
    std::int64_t read_signed(const SlaveImage& image) const noexcept {
        return present() ? cia301::sign_extended(read(image), bits) : 0;
    }
    /// Writes the low bits of a value. [realtime]
    void write(const SlaveImage& image, std::uint64_t value) const noexcept {
        if (present()) {
            write_bits(image.areas[area], at, bits, value);
        }
    }
    /// Writes a number, limited to the signed range of the field. NaN leaves the field. [realtime]
    std::int64_t write_limited(const SlaveImage& image, double value) const noexcept {
        if (!std::isfinite(value)) return read_signed(image);
        const double limit = std::ldexp(1.0, static_cast<int>(bits == 0 ? 32 : bits) - 1) - 1.0;
        const double limited = std::fmin(std::fmax(value, -limit), limit);
        const auto number = static_cast<std::int64_t>(limited);
        write(image, static_cast<std::uint64_t>(number));
        return number;
    }
};

/// What a group of pins needs in its constructor. [setup]
class ChannelPlan {
public:
    using Find = ImageField (*)(const void* context, const config::ChannelObject&);

    /// `read` and `write` are the functions of the component in which the channel is read and
    /// written; `find` gets `context`.
    ChannelPlan(hal::Component& owner, const hal::Function& read, const hal::Function& write,
                std::string slave, const config::Channel& of_slave, Find find, const void* context)
        : component(owner),
          reads(read),
          writes(write),
          channel(of_slave),
          slave_(std::move(slave)),
          find_(find),
          context_(context) {}

    /// Returns the field with this role; an absent one for a role without an object.
    ImageField field(const char* role) const {
        const config::ChannelObject* const object = channel.object(role);
        return object == nullptr ? ImageField{} : find_(context_, *object);
    }
    /// Returns the full name of a pin: SLAVE.CHANNEL-SUFFIX.
    std::string pin(const std::string& suffix) const {
        if (suffix.empty()) return slave_ + "." + channel.name;
        if (channel.name.empty()) return slave_ + "." + suffix;
        const bool joined = channel.name.back() == '.';
        return slave_ + "." + channel.name + (joined ? "" : "-") + suffix;
    }

    /// Returns the full name of a pin whose number is the name of the channel:
    /// SLAVE.PREFIX-CHANNEL.
    std::string numbered_pin(const std::string& prefix) const {
        return slave_ + "." + prefix + "-" + channel.name;
    }

    hal::Component& component;
    const hal::Function& reads;
    const hal::Function& writes;
    const config::Channel& channel;

private:
    std::string slave_;
    Find find_;
    const void* context_;
};

/// A group of pins of a slave. Its constructor declares them.
class Channel {
public:
    virtual ~Channel() = default;
    Channel(const Channel&) = delete;
    Channel& operator=(const Channel&) = delete;

    /// Copies the inputs of the slave to pins. [realtime]
    virtual void read(const SlaveImage&) noexcept {}
    /// Copies pins to the outputs of the slave. [realtime]
    virtual void write(const SlaveImage&) noexcept {}
    /// The master starts again. [setup]
    virtual void restart() noexcept {}

protected:
    Channel() = default;
};

/// Replaces a scale by which no number can be divided with 1, and returns it. [realtime]
inline double usable_scale(double scale) noexcept {
    const bool usable = std::isfinite(scale) && std::fabs(scale) >= 1e-20;
    return usable ? scale : 1.0;
}

}  // namespace hal::ethercat
