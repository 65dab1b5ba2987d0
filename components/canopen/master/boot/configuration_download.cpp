// SPDX-License-Identifier: MIT
#include "configuration_download.hpp"

#include <algorithm>
#include <map>

namespace hal::canopen {

namespace {

constexpr std::uint32_t save_signature = 0x65766173;
constexpr std::uint32_t load_signature = 0x64616f6c;
constexpr Time storing = 3 * second;
constexpr unsigned max_state_changes = 3;

}  // namespace

ConfigurationDownload::ConfigurationDownload(const NodeSetup& setup, std::uint8_t master_id,
                                             NodeSupervision& supervision)
    : setup_(setup), supervision_(supervision) {
    add_configured();
    mark_final_writes_and_group();
    own_group_ = groups_.size();
    const std::size_t configured = objects_.size();
    add_error_control(master_id);
    if (dated()) {
        add_own(Own::date, 0x1020, 1, setup_.configuration_date, 4, true);
        add_own(Own::time, 0x1020, 2, setup_.configuration_time, 4, true);
    }
    for (std::size_t n = configured; n < objects_.size(); ++n) {
        groups_.push_back({n, n + 1});
    }
}

/// The master configures error control itself, even if the configuration file contains it.
bool ConfigurationDownload::is_ours(const ObjectWrite& write) const noexcept {
    const bool heartbeat = setup_.heartbeat_ms != 0;
    const bool guard = setup_.guard_ms != 0;
    switch (write.index) {
    case 0x1017: return heartbeat || guard;
    case 0x100c:
    case 0x100d: return guard;
    case 0x1020: return dated();
    default: return false;
    }
}

void ConfigurationDownload::add_configured() {
    for (const auto& w : setup_.writes) {
        if (is_ours(w)) continue;
        const bool acts = w.index == 0x1010 || w.index == 0x1011 || w.index == 0x1003;
        objects_.push_back({.write = &w,
                            .index = w.index,
                            .sub = w.sub,
                            .always = w.always || acts,
                            .optional = w.optional});
    }
}

void ConfigurationDownload::mark_final_writes_and_group() {
    std::map<std::uint32_t, std::size_t> latest;
    const auto key = [](const Object& o) { return std::uint32_t{o.index} << 8 | o.sub; };
    for (std::size_t n = 0; n < objects_.size(); ++n) {
        const auto [at, is_new] = latest.try_emplace(key(objects_[n]), n);
        if (!is_new) {
            objects_[at->second].last = false;
            at->second = n;
        }
    }
    for (std::size_t n = 0; n < objects_.size();) {
        Group g{n, n + 1};
        for (; n < g.end; ++n) {
            g.end = std::max(g.end, latest.at(key(objects_[n])) + 1);
        }
        groups_.push_back(g);
    }
}

void ConfigurationDownload::add_own(Own kind, std::uint16_t index, std::uint8_t sub,
                                    std::uint32_t value, unsigned size, bool optional) {
    Object o{.index = index,
             .sub = sub,
             .kind = kind,
             .optional = optional,
             .own_size = static_cast<std::uint8_t>(size)};
    store(o.own.data(), value);
    objects_.push_back(o);
}

void ConfigurationDownload::add_error_control(std::uint8_t master_id) {
    const bool heartbeat = setup_.heartbeat_ms != 0;
    const bool guard = setup_.guard_ms != 0;
    if (heartbeat && !guard) {
        add_own(Own::producer, 0x1017, 0, setup_.heartbeat_ms, 2, false);
    }
    if (guard) {
        add_own(Own::no_producer, 0x1017, 0, 0, 2, true);
    }
    if (guard || heartbeat) {
        add_own(Own::guard_time, 0x100c, 0, guard ? setup_.guard_ms : setup_.heartbeat_ms, 2, true);
        add_own(Own::life_factor, 0x100d, 0, setup_.guard_factor, 1, true);
    }
    if (setup_.master_limit_ms != 0) {
        add_own(Own::consumer, 0x1016, 0, std::uint32_t{master_id} << 16 | setup_.master_limit_ms,
                4, false);
    }
}

bool ConfigurationDownload::applies(const Object& o, const NodeStatus& status) const noexcept {
    switch (o.kind) {
    case Own::none:
    case Own::no_producer:
    case Own::consumer: return true;
    case Own::producer: return !supervision_.guarding();
    case Own::guard_time:
    case Own::life_factor: return supervision_.guarding();
    case Own::date:
    case Own::time: return !current_ && (status.notes & note_no_date) == 0;
    }
    return false;
}

Task<ConfigurationDownload::Result> ConfigurationDownload::run(BootChannel& node,
                                                               bool restored) noexcept {
    node.enter(Step::configuring);
    state_changes_ = 0;
    current_ = false;
    supervision_.reset();
    for (auto& o : objects_) {
        o.unreadable = o.absent = false;
    }
    // it started itself: many objects are read-only in this state
    if (node.remote.heard() && node.remote.state() == NmtState::operational) {
        node.send(NmtCommand::enter_pre_operational);
    }

    if (dated() && !restored) {
        const Date date = co_await check_date(node);
        if (date == Date::failed) co_return Result::failed;
        current_ = date == Date::current;
    }
    if (setup_.restore && !restored && !current_) {
        node.enter(Step::restoring);
        const SdoAnswer answer = co_await node.write(0x1011, 1, load_signature, 4, storing);
        if (answer.ok()) co_return Result::restored;
        node.fail_transfer(BootResult::configuration);
        co_return Result::failed;
    }

    const bool updated = co_await update(node);
    if (!updated) co_return Result::failed;
    if (!setup_.save || node.status.written == 0) co_return Result::done;
    const bool saved = co_await save(node);
    co_return saved ? Result::done : Result::failed;
}

/// CiA 302-2, figure 8: compares 1020h with 1F26h and 1F27h.
Task<ConfigurationDownload::Date> ConfigurationDownload::check_date(BootChannel& node) noexcept {
    const std::array<std::uint32_t, 2> expected{setup_.configuration_date,
                                                setup_.configuration_time};
    for (std::uint8_t n = 0; n < expected.size(); ++n) {
        const SdoAnswer answer = co_await node.read(0x1020, static_cast<std::uint8_t>(n + 1));
        if (answer.no_response()) {
            node.fail_transfer(BootResult::configuration);
            co_return Date::failed;
        }
        if (!answer.ok()) {
            node.status.notes |= note_no_date;
            co_return Date::different;
        }
        if (answer.number() != expected[n]) co_return Date::different;
    }
    co_return Date::current;
}

/// CiA 302-2, figure 8: updates the configuration. Of one that is current the master checks only
/// its own objects.
Task<bool> ConfigurationDownload::update(BootChannel& node) noexcept {
    for (std::size_t n = current_ ? own_group_ : 0; n < groups_.size(); ++n) {
        const bool good = co_await download(node, groups_[n]);
        if (!good) co_return false;
    }
    co_return true;
}

Task<bool> ConfigurationDownload::save(BootChannel& node) noexcept {
    node.enter(Step::saving);
    const SdoAnswer answer = co_await node.write(0x1010, 1, save_signature, 4, storing);
    if (!answer.ok()) co_return node.fail_transfer(BootResult::configuration);
    co_return true;
}

Task<bool> ConfigurationDownload::download(BootChannel& node, const Group& group) noexcept {
    Object& first = objects_[group.begin];
    if (!applies(first, node.status)) co_return true;
    Progress progress = Progress::open;
    if (first.kind == Own::consumer) {
        progress = co_await find_consumer(node, first);
    } else {
        progress = co_await compare(node, group);
    }
    if (progress != Progress::open) co_return progress == Progress::settled;
    progress = co_await write(node, group);
    if (progress != Progress::open) co_return progress == Progress::settled;
    const bool verified = co_await verify(node, group);
    co_return verified;
}

/// Finds the entry of 1016h that is or becomes that of the master.
Task<ConfigurationDownload::Progress> ConfigurationDownload::find_consumer(BootChannel& node,
                                                                           Object& o) noexcept {
    const auto expected = load<std::uint32_t>(o.own.data());
    const std::uint32_t master_id = expected >> 16;
    SdoAnswer answer = co_await node.read(0x1016, 0);
    if (answer.no_response()) {
        fail(node, o, answer, Cause::no_response);
        co_return Progress::failed;
    }
    const std::uint64_t count = answer.ok() ? std::min<std::uint64_t>(answer.number(), 127) : 0;
    std::uint8_t unused = 0;
    for (std::uint8_t sub = 1; sub <= count; ++sub) {
        answer = co_await node.read(0x1016, sub);
        if (answer.no_response()) {
            fail(node, o, answer, Cause::no_response);
            co_return Progress::failed;
        }
        if (!answer.ok()) continue;
        const auto entry = static_cast<std::uint32_t>(answer.number());
        const std::uint32_t monitored = entry >> 16 & 0xff;
        const bool is_unused = monitored == 0 || (entry & 0xffff) == 0;
        if (is_unused && unused == 0) {
            unused = sub;
        }
        if (!is_unused && monitored == master_id) {
            ++node.status.compared;
            o.sub = sub;
            co_return entry == expected ? Progress::settled : Progress::open;
        }
    }
    if (unused != 0) {
        o.sub = unused;
        co_return Progress::open;
    }
    node.status.notes |= note_no_consumer;
    co_return Progress::settled;
}

/// Reads the final value of each object of the group up to the first that differs.
Task<ConfigurationDownload::Progress> ConfigurationDownload::compare(BootChannel& node,
                                                                     const Group& group) noexcept {
    for (std::size_t n = group.begin; n < group.end; ++n) {
        Object& o = objects_[n];
        if (o.always) co_return Progress::open;
        if (!o.last) continue;
        const SdoAnswer answer = co_await node.read(o.index, o.sub);
        ++node.status.compared;
        if (answer.no_response()) {
            fail(node, o, answer, Cause::no_response);
            co_return Progress::failed;
        }
        if (answer.object_missing() && o.kind == Own::producer) {
            use_guarding(node);
            co_return Progress::settled;
        }
        if (!matches(node, o, answer)) co_return Progress::open;
        if (o.kind == Own::producer) {
            supervision_.set_producer(setup_.heartbeat_ms);
        }
    }
    co_return Progress::settled;
}

/// Returns true if the node needs no write of this object, because it has the value or has no such
/// object.
bool ConfigurationDownload::matches(BootChannel& node, Object& o,
                                    const SdoAnswer& answer) noexcept {
    if (answer.object_missing() && o.optional) {
        if (o.is_date()) {
            node.status.notes |= note_no_date;
        }
        o.absent = true;
        return true;
    }
    if (!answer.ok()) {
        o.unreadable = answer.by_server;
        return false;
    }
    // the value matches, but no heartbeat arrived: write it again
    if (o.kind == Own::producer && node.status.result == BootResult::watching) return false;
    return same_value(o.index, o.sub, o.value(), answer.value);
}

/// Returns true if the node rejected a write because of its NMT state: it started itself.
bool ConfigurationDownload::wants_pre_operational(BootChannel& node, const Object& o,
                                                  const SdoAnswer& answer) const noexcept {
    if (answer.ok() || answer.no_response() || state_changes_ >= max_state_changes) return false;
    if (answer.object_missing() && (o.optional || o.kind == Own::producer)) return false;
    return node.remote.state() == NmtState::operational || answer.abort == Abort::device_state ||
           answer.abort == Abort::local_control;
}

Task<ConfigurationDownload::Progress> ConfigurationDownload::write(BootChannel& node,
                                                                   const Group& group) noexcept {
    for (std::size_t n = group.begin; n < group.end; ++n) {
        Object& o = objects_[n];
        if (o.absent) continue;
        SdoAnswer answer = co_await node.write(o.index, o.sub, o.value());
        while (wants_pre_operational(node, o, answer)) {
            ++state_changes_;
            node.send(NmtCommand::enter_pre_operational);
            answer = co_await node.write(o.index, o.sub, o.value());
        }
        if (answer.ok()) {
            ++node.status.written;
            continue;
        }
        if (answer.object_missing() && o.kind == Own::producer) {
            use_guarding(node);
            co_return Progress::settled;
        }
        if (answer.object_missing() && o.optional) {
            o.absent = true;
            continue;
        }
        fail(node, o, answer, answer.no_response() ? Cause::no_response : Cause::aborted);
        co_return Progress::failed;
    }
    co_return Progress::open;
}

/// Reads what was written.
Task<bool> ConfigurationDownload::verify(BootChannel& node, const Group& group) noexcept {
    for (std::size_t n = group.begin; n < group.end; ++n) {
        Object& o = objects_[n];
        if (!o.last || o.always || o.absent || o.unreadable) continue;
        const SdoAnswer answer = co_await node.read(o.index, o.sub);
        if (answer.no_response()) co_return fail(node, o, answer, Cause::no_response);
        if (!answer.ok() && answer.by_server) {
            o.unreadable = true;
            continue;
        }
        if (accepts_period(o, answer)) {
            supervision_.set_producer(static_cast<std::uint16_t>(answer.number()));
            continue;
        }
        const bool same = answer.ok() && same_value(o.index, o.sub, o.value(), answer.value);
        if (!same) co_return fail(node, o, answer, Cause::not_retained);
    }
    co_return true;
}

/// Returns true for the period of a heartbeat that is short enough: some nodes support only certain
/// periods.
bool ConfigurationDownload::accepts_period(const Object& o,
                                           const SdoAnswer& answer) const noexcept {
    if (o.kind != Own::producer || !answer.ok() || answer.number() == 0) return false;
    return setup_.heartbeat_limit == 0 ||
           static_cast<Time>(answer.number()) * millisecond < setup_.heartbeat_limit;
}

/// A node without heartbeat producer is supervised by node guarding.
void ConfigurationDownload::use_guarding(BootChannel& node) noexcept {
    supervision_.set_no_producer();
    node.status.notes |= note_guarded;
}

bool ConfigurationDownload::fail(BootChannel& node, const Object& o, const SdoAnswer& answer,
                                 Cause cause) noexcept {
    std::uint64_t expected = 0;
    std::memcpy(&expected, o.value().data(), std::min<std::size_t>(o.value().size(), 8));
    node.note_answer(expected, cause == Cause::not_retained ? answer.number() : 0);
    node.status.abort = answer.abort;
    if (o.write != nullptr) {
        node.status.write = static_cast<std::uint16_t>(o.write - setup_.writes.data() + 1);
    }
    return node.fail(BootResult::configuration, cause);
}

}  // namespace hal::canopen
