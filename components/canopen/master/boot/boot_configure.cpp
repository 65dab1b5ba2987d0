// SPDX-License-Identifier: MIT
// The configuration of a node: objects that differ are written and read back. Objects that are
// written more than once (PDOs: disabled, mapped, enabled) form a group with all objects in
// between; the group is written completely unless the node already has all its final values.
#include <algorithm>
#include <map>

#include "boot_node.hpp"

namespace hal::canopen {

namespace {
constexpr std::uint32_t save_signature = 0x65766173;
constexpr std::uint32_t load_signature = 0x64616f6c;
constexpr Time storing = 3 * second;
constexpr unsigned most_state_changes = 3;
}  // namespace

void Master::Node::add_own(Own kind, std::uint16_t index, std::uint8_t sub, std::uint32_t value,
                           unsigned size, bool optional) {
    Object o{.index = index,
             .sub = sub,
             .kind = kind,
             .optional = optional,
             .own_size = static_cast<std::uint8_t>(size)};
    store(o.own.data(), value);
    objects_.push_back(o);
}

void Master::Node::make_groups() {
    const bool heartbeat = setup.heartbeat_ms != 0;
    const bool guard = setup.guard_ms != 0;
    const bool dated = (setup.configuration_date | setup.configuration_time) != 0;
    for (const auto& w : setup.writes) {
        // The master configures error control itself, even if the configuration file contains it.
        const bool ours =
            ((heartbeat || guard) &&
             (w.index == 0x1017 || (guard && (w.index == 0x100c || w.index == 0x100d)))) ||
            (dated && w.index == 0x1020);
        if (ours) continue;
        const bool acts = w.index == 0x1010 || w.index == 0x1011 || w.index == 0x1003;
        objects_.push_back({.write = &w,
                            .index = w.index,
                            .sub = w.sub,
                            .always = w.always || acts,
                            .optional = w.optional});
    }
    const auto theirs = objects_.size();
    std::map<std::uint32_t, std::size_t> latest;
    const auto key = [](const Object& o) { return std::uint32_t{o.index} << 8 | o.sub; };
    for (std::size_t n = 0; n < theirs; ++n) {
        const auto [at, is_new] = latest.try_emplace(key(objects_[n]), n);
        if (!is_new) {
            objects_[at->second].last = false;
            at->second = n;
        }
    }
    for (std::size_t n = 0; n < theirs;) {
        Group g{n, n + 1};
        for (; n < g.end; ++n) {
            g.end = std::max(g.end, latest.at(key(objects_[n])) + 1);
        }
        groups_.push_back(g);
    }
    own_group_ = groups_.size();
    if (heartbeat && !guard) {
        add_own(Own::producer, 0x1017, 0, setup.heartbeat_ms, 2, false);
    }
    if (guard) {
        add_own(Own::no_producer, 0x1017, 0, 0, 2, true);
    }
    if (guard || heartbeat) {
        add_own(Own::guard_time, 0x100c, 0, guard ? setup.guard_ms : setup.heartbeat_ms, 2, true);
        add_own(Own::life_factor, 0x100d, 0, setup.guard_factor, 1, true);
    }
    if (setup.master_limit_ms != 0) {
        add_own(Own::consumer, 0x1016, 0,
                std::uint32_t{master_.setup_.id} << 16 | setup.master_limit_ms, 4, false);
    }
    if (dated) {
        add_own(Own::date, 0x1020, 1, setup.configuration_date, 4, true);
        add_own(Own::time, 0x1020, 2, setup.configuration_time, 4, true);
    }
    for (std::size_t n = theirs; n < objects_.size(); ++n) {
        groups_.push_back({n, n + 1});
    }
}

bool Master::Node::applies(const Object& o) const noexcept {
    switch (o.kind) {
    case Own::none:
    case Own::no_producer:
    case Own::consumer: return true;
    case Own::producer: return !guarding();
    case Own::guard_time:
    case Own::life_factor: return guarding();
    case Own::date:
    case Own::time: return !configuration_current_ && (status.notes & note_no_date) == 0;
    }
    return false;
}

void Master::Node::configure() noexcept {
    if (!setup.configure) return watch();
    enter(Step::configuring);
    start_attempts_ = 0;
    guarded_ = false;
    producer_ms_ = 0;
    for (auto& o : objects_) {
        o.unreadable = o.absent = false;
    }
    if (remote_.heard() &&
        remote_.state() ==
            NmtState::operational) {  // it started itself: many objects are read-only in this state
        master_.send(NmtCommand::enter_pre_operational, setup.id);
    }
    if (!restored_ && (setup.configuration_date | setup.configuration_time) != 0) {
        return read(Task::date, 0x1020, 1);
    }
    configure_anew();
}

void Master::Node::configure_anew() noexcept {
    if (!setup.restore || restored_) return configure_from(0);
    enter(Step::restoring);
    set_sdo_timeout(storing);
    write(Task::restore, 0x1011, 1, load_signature, 4);
}

void Master::Node::configure_from(std::size_t group) noexcept {
    group_ = group;
    next_group();
}

void Master::Node::next_group() noexcept {
    for (; group_ < groups_.size(); ++group_) {
        object_ = groups_[group_].begin;
        const auto& o = objects_[object_];
        if (!applies(o)) continue;
        if (o.kind == Own::consumer) {
            free_ = 0;
            return read(Task::consumer_count, 0x1016, 0);
        }
        return next_compare();
    }
    configured();
}

void Master::Node::next_compare() noexcept {
    const auto& g = groups_[group_];
    for (; object_ < g.end; ++object_) {
        const auto& o = objects_[object_];
        if (o.always) {
            object_ = g.begin;
            return next_write();
        }
        if (o.last) return read(Task::compare, o.index, o.sub);
    }
    ++group_;
    next_group();
}

void Master::Node::compared() noexcept {
    auto& o = objects_[object_];
    ++status.compared;
    bool as_wished =
        ok() && same_value(o.index, o.sub, o.value(), std::span(buffer_).first(request_.size));
    if (no_response()) return fail_write(Cause::no_response);
    if (object_missing() && o.kind == Own::producer) return producer_rejected();
    // the value matches, but no heartbeat arrived: write it again
    if (o.kind == Own::producer && status.result == BootResult::watching) {
        as_wished = false;
    }
    if (object_missing() && o.optional) {
        if (o.kind == Own::date || o.kind == Own::time) {
            status.notes |= note_no_date;
        }
        o.absent = as_wished = true;
    } else if (!ok() && request_.aborted_by_server) {
        o.unreadable = true;
    }
    if (as_wished) {
        if (o.kind == Own::producer) {
            producer_ms_ = setup.heartbeat_ms;
        }
        ++object_;
        return next_compare();
    }
    object_ = groups_[group_].begin;
    next_write();
}

void Master::Node::next_write() noexcept {
    const auto& g = groups_[group_];
    for (; object_ < g.end; ++object_) {
        const auto& o = objects_[object_];
        if (!o.absent) return write(Task::write, o.index, o.sub, o.value());
    }
    object_ = g.begin;
    next_verify();
}

void Master::Node::written() noexcept {
    auto& o = objects_[object_];
    if (!ok()) {
        if (no_response()) return fail_write(Cause::no_response);
        if (object_missing() && o.kind == Own::producer) return producer_rejected();
        if (object_missing() && o.optional) {
            o.absent = true;
        } else {
            const bool wrong_state = remote_.state() == NmtState::operational ||
                                     request_.abort == Abort::device_state ||
                                     request_.abort == Abort::local_control;
            if (wrong_state && start_attempts_ < most_state_changes) {  // it started itself
                ++start_attempts_;
                master_.send(NmtCommand::enter_pre_operational, setup.id);
                return write(Task::write, o.index, o.sub, o.value());
            }
            return fail_write(Cause::aborted);
        }
    } else {
        ++status.written;
    }
    ++object_;
    next_write();
}

void Master::Node::next_verify() noexcept {
    for (; object_ < groups_[group_].end; ++object_) {
        const auto& o = objects_[object_];
        if (o.last && !o.always && !o.absent && !o.unreadable) {
            return read(Task::verify, o.index, o.sub);
        }
    }
    ++group_;
    next_group();
}

void Master::Node::verified() noexcept {
    auto& o = objects_[object_];
    if (no_response()) return fail_write(Cause::no_response);
    if (!ok() && request_.aborted_by_server) {
        o.unreadable = true;
    } else if (o.kind == Own::producer && ok() && number() != 0 &&
               (setup.heartbeat_limit == 0 ||
                static_cast<Time>(number()) * millisecond < setup.heartbeat_limit)) {
        producer_ms_ =
            static_cast<std::uint16_t>(number());  // some nodes support only certain periods
    } else if (!ok() ||
               !same_value(o.index, o.sub, o.value(), std::span(buffer_).first(request_.size))) {
        return fail_write(Cause::not_retained);
    }
    ++object_;
    next_verify();
}

void Master::Node::fail_write(Cause cause) noexcept {
    const auto& o = objects_[object_];
    std::uint64_t expected = 0;
    std::memcpy(&expected, o.value().data(), std::min<std::size_t>(o.value().size(), 8));
    note_request(expected, cause == Cause::not_retained ? number() : 0);
    status.abort = request_.abort;
    if (o.write != nullptr) {
        status.write = static_cast<std::uint16_t>(o.write - setup.writes.data() + 1);
    }
    fail(BootResult::configuration, cause);
}

/// A node without heartbeat producer is supervised by node guarding.
void Master::Node::producer_rejected() noexcept {
    guarded_ = true;
    status.notes |= note_guarded;
    ++group_;
    next_group();
}

/// Finds the entry of 1016h that is or becomes that of the master.
void Master::Node::consumer_answered() noexcept {
    auto& o = objects_[object_];
    const bool count = task_ == Task::consumer_count;
    task_ = Task::none;
    if (no_response()) return fail_write(Cause::no_response);
    if (count) {
        consumers_ = ok() ? static_cast<std::uint8_t>(std::min<std::uint64_t>(number(), 127))
                          : std::uint8_t{0};
        consumer_ = 0;
    } else if (ok()) {
        const auto value = static_cast<std::uint32_t>(number());
        const bool unused = (value >> 16 & 0xff) == 0 || (value & 0xffff) == 0;
        if (!unused && (value >> 16 & 0xff) == master_.setup_.id) {
            ++status.compared;
            o.sub = consumer_;
            if (value != load<std::uint32_t>(o.own.data())) return next_write();
            ++group_;
            return next_group();
        }
        if (unused && free_ == 0) {
            free_ = consumer_;
        }
    }
    if (consumer_ < consumers_) return read(Task::consumer_entry, 0x1016, ++consumer_);
    if (free_ != 0) {
        o.sub = free_;
        return next_write();
    }
    status.notes |= note_no_consumer;
    ++group_;
    next_group();
}

void Master::Node::configured() noexcept {
    if (!setup.save || status.written == 0) return watch();
    enter(Step::saving);
    set_sdo_timeout(storing);
    write(Task::save, 0x1010, 1, save_signature, 4);
}

}  // namespace hal::canopen
