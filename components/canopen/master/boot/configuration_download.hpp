// SPDX-License-Identifier: MIT
// The configuration of a node: objects that differ are written and read back. Objects that are
// written more than once (PDOs: disabled, mapped, enabled) form a group with all objects in
// between; the group is written completely unless the node already has all its final values.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "boot_channel.hpp"
#include "node_supervision.hpp"

namespace hal::canopen {

/// The configuration of one node; see the top of this file.
class ConfigurationDownload {
public:
    /// Lists the objects of the set-up and those of the error control. `master_id`: whose heartbeat
    /// the node monitors. [setup]
    ConfigurationDownload(const NodeSetup&, std::uint8_t master_id, NodeSupervision&);

    enum class Result : std::uint8_t {
        failed,  ///< the boot has failed
        restored,  ///< the default values were restored; they apply after a reset of the node
        done,
    };
    /// CiA 302-2, figure 8: checks the date of the configuration, updates what differs and saves
    /// it. `restored`: the defaults were restored in this boot, which is not done twice. [realtime]
    Task<Result> run(BootChannel&, bool restored) noexcept;

private:
    /// The objects that the master determines itself.
    enum class Own : std::uint8_t {
        none,
        producer,
        no_producer,
        guard_time,
        life_factor,
        consumer,
        date,
        time
    };
    struct Object {
        const ObjectWrite* write = nullptr;  // nullptr: an object of the master, its value in `own`
        std::uint16_t index = 0;
        std::uint8_t sub = 0;
        Own kind = Own::none;
        bool always = false;  // written without comparing
        bool optional = false;
        bool last = true;  // the final write of this object
        bool unreadable = false;
        bool absent = false;
        std::array<std::uint8_t, 4> own{};
        std::uint8_t own_size = 0;
        std::span<const std::uint8_t> value() const noexcept {
            return write != nullptr ? std::span<const std::uint8_t>(write->data)
                                    : std::span(own).first(own_size);
        }
        bool is_date() const noexcept { return kind == Own::date || kind == Own::time; }
    };
    struct Group {
        std::size_t begin = 0;
        std::size_t end = 0;  // of objects_: written completely or not at all
    };
    enum class Date : std::uint8_t { failed, current, different };
    enum class Progress : std::uint8_t {
        failed,
        settled,  // nothing of this group is left to do
        open,
    };

    void add_configured();
    void mark_final_writes_and_group();
    void add_own(Own, std::uint16_t index, std::uint8_t sub, std::uint32_t value, unsigned size,
                 bool optional);
    void add_error_control(std::uint8_t master_id);
    bool is_ours(const ObjectWrite&) const noexcept;
    bool dated() const noexcept {
        return (setup_.configuration_date | setup_.configuration_time) != 0;
    }

    Task<Date> check_date(BootChannel&) noexcept;
    Task<bool> update(BootChannel&) noexcept;
    Task<bool> save(BootChannel&) noexcept;
    Task<bool> download(BootChannel&, const Group&) noexcept;
    Task<Progress> find_consumer(BootChannel&, Object&) noexcept;
    Task<Progress> compare(BootChannel&, const Group&) noexcept;
    Task<Progress> write(BootChannel&, const Group&) noexcept;
    Task<bool> verify(BootChannel&, const Group&) noexcept;

    bool applies(const Object&, const NodeStatus&) const noexcept;
    bool matches(BootChannel&, Object&, const SdoAnswer&) noexcept;
    bool accepts_period(const Object&, const SdoAnswer&) const noexcept;
    bool wants_pre_operational(BootChannel&, const Object&, const SdoAnswer&) const noexcept;
    void use_guarding(BootChannel&) noexcept;
    bool fail(BootChannel&, const Object&, const SdoAnswer&, Cause) noexcept;

    const NodeSetup& setup_;
    NodeSupervision& supervision_;
    std::vector<Object> objects_;
    std::vector<Group> groups_;
    std::size_t own_group_ = 0;  // the first group of the master's own objects
    unsigned state_changes_ = 0;
    bool current_ = false;  // 1020h has the configured date
};

}  // namespace hal::canopen
