// SPDX-License-Identifier: MIT
#include "device.hpp"

#include <utility>

namespace hal::canopen {

namespace {
/// The objects that a sub-index of 1010h or 1011h covers (CiA 301).
constexpr std::pair<std::uint16_t, std::uint16_t> objects_of(std::uint8_t sub) noexcept {
    if (sub == 1) {
        return std::pair<std::uint16_t, std::uint16_t>{0x1000, 0xffff};
    }
    if (sub == 2) {
        return std::pair<std::uint16_t, std::uint16_t>{0x1000, 0x1fff};
    }
    if (sub == 3) {
        return std::pair<std::uint16_t, std::uint16_t>{0x6000, 0x9fff};
    }
    return std::pair<std::uint16_t, std::uint16_t>{0x2000, 0x5fff};
}
constexpr std::uint32_t save = 0x65766173;
constexpr std::uint32_t load_defaults = 0x64616f6c;
constexpr bool usable(std::uint8_t id) noexcept { return id >= 1 && id <= 127; }
}  // namespace

Device::Device(const Description& description, const DeviceSettings& settings, DeviceEvents& events)
    : settings_(settings),
      events_(events),
      out_(settings.queue),
      dictionary_(description, settings.node_id),
      emcy_(dictionary_, out_),
      emcy_consumer_(dictionary_),
      sync_(dictionary_, out_, emcy_),
      time_(dictionary_, out_),
      error_control_(dictionary_, out_),
      pdos_(dictionary_, out_, emcy_, events, settings.pdo),
      srdos_(dictionary_, out_, emcy_),
      lss_(out_, events),
      node_id_(usable(settings.node_id) ? settings.node_id : unconfigured) {
    dictionary_.handle(0x1010, *this);
    dictionary_.handle(0x1011, *this);
    for (unsigned n = 0; n < 128; ++n) {
        const auto server = static_cast<std::uint16_t>(0x1200 + n);

        const auto client = static_cast<std::uint16_t>(0x1280 + n);
        if (dictionary_.handle(server, *this) || n == 0) {
            servers_.push_back(
                {server, std::make_unique<SdoServer>(dictionary_, out_, settings.sdo)});
        }
        if (dictionary_.handle(client, *this)) {
            clients_.push_back({client, std::make_unique<SdoClient>(out_, settings.sdo_client)});
        }
    }
    Identity identity{};
    for (unsigned n = 0; n < 4; ++n) {
        identity[n] = dictionary_.get<std::uint32_t>(0x1018, static_cast<std::uint8_t>(n + 1), 0);
    }
    lss_.configure(identity, node_id_);
}

void Device::start(Time now) noexcept {
    started_ = true;
    now_ = now;
    emcy_.reset(true);
    reset_communication(now);
}

void Device::reset_communication(Time now) noexcept {
    state_ = NmtState::initialising;
    emcy_.set_active(false);
    sync_.set_active(false);
    pdos_.set_operational(false, now);
    srdos_.set_operational(false, now);
    emcy_.clear(0x8150);
    emcy_.reset(false);
    emcy_consumer_.reset();
    sync_.reset();
    time_.reset();
    error_control_.reset(node_id_);
    pdos_.reset(node_id_);
    srdos_.reset(node_id_);
    for (auto& s : servers_) {
        configure_channel(s.index);
    }
    for (auto& c : clients_) {
        configure_channel(c.index);
    }
    if (!usable(node_id_)) return;
    error_control_.boot(now);
    enter(NmtState::pre_operational, now);
    if (settings_.auto_start) {
        enter(NmtState::operational, now);
    }
}

void Device::configure_channel(std::uint16_t index) noexcept {
    const auto request =
        dictionary_.get<std::uint32_t>(index, 1, index == 0x1200 ? 0x600U + node_id_ : cob_invalid);
    const auto answer =
        dictionary_.get<std::uint32_t>(index, 2, index == 0x1200 ? 0x580U + node_id_ : cob_invalid);
    for (auto& s : servers_) {
        // CiA 301 fixes the COB-IDs of the first channel, whatever the description contains.
        if (s.index == index) {
            s.server->configure(index == 0x1200 ? 0x600U + node_id_ : request,
                                index == 0x1200 ? 0x580U + node_id_ : answer);
        }
    }
    for (auto& c : clients_) {
        if (c.index == index) {
            c.client->configure(request, answer);
        }
    }
}

void Device::enter(NmtState state, Time now) noexcept {
    if (state == state_ || !usable(node_id_)) return;
    state_ = state;
    const bool communicating = state != NmtState::stopped;
    emcy_.set_active(communicating);
    sync_.set_active(communicating);
    error_control_.set_state(state);
    pdos_.set_operational(state == NmtState::operational, now);
    srdos_.set_operational(state == NmtState::operational, now);
    if (!communicating) {
        for (auto& s : servers_) {
            s.server->reset();
        }
        for (auto& c : clients_) {
            c.client->cancel_all(Abort::device_state);
        }
    }
    events_.on_state(state);
}

void Device::command(NmtCommand command, Time now) noexcept {
    if (!started_) return;
    now_ = now;
    switch (command) {
    case NmtCommand::start: return enter(NmtState::operational, now);
    case NmtCommand::stop: return enter(NmtState::stopped, now);
    case NmtCommand::enter_pre_operational: return enter(NmtState::pre_operational, now);
    case NmtCommand::reset_node:
    case NmtCommand::reset_communication: {
        const bool application = command == NmtCommand::reset_node;
        node_id_ = lss_.pending_id();
        lss_.activate_pending_id();
        dictionary_.set_node_id(node_id_);
        if (application) {
            dictionary_.reset(0x2000, 0xffff);
        }
        dictionary_.reset(0x1000, 0x1fff);
        emcy_.reset(application);
        events_.on_reset(application);
        return reset_communication(now);
    }
    }
}

void Device::communication_error(std::uint16_t code, std::uint8_t node, Time now) noexcept {
    emcy_.raise(code, error_communication, {node});
    events_.on_communication_error(now);
    switch (dictionary_.get<std::uint8_t>(0x1029, 1, 0)) {
    case 0:
        if (state_ == NmtState::operational) {
            enter(NmtState::pre_operational, now);
        }
        break;
    case 2: enter(NmtState::stopped, now); break;
    default: break;
    }
}

void Device::take_sync(Time now) noexcept {
    pdos_.on_sync(now, sync_.window());
    events_.on_sync(sync_.counter(), now);
    pdos_.send_synchronous(sync_.counter(), sync_.counter() != 0, now);
}

bool Device::produce_sync(Time now) noexcept {
    now_ = now;
    if (!sync_.produce(now)) return false;
    take_sync(now);
    return true;
}

void Device::handle(const Frame& f, Time now) noexcept {
    if (!started_ || f.error || f.fd) return;
    now_ = now;
    if (f.id == 0 && !f.extended) return handle_nmt(f, now);
    if (settings_.lss && lss_.handle(f)) {
        if (lss_.wants_reset()) {
            command(NmtCommand::reset_communication, now);
        }
        return;
    }
    if (!usable(node_id_)) return;
    if (error_control_.handle(f, now, events_)) {
        if (error_control_.collided()) {
            emcy_.raise(0x8150, error_communication, {node_id_});
        }
        return;
    }
    if (state_ != NmtState::stopped) {
        handle_service(f, now);
    }
}

void Device::handle_nmt(const Frame& f, Time now) noexcept {
    if (f.remote || f.length != 2 || !settings_.nmt_slave || !usable(node_id_)) return;
    if (f.data[1] == 0 || f.data[1] == node_id_) {
        command(static_cast<NmtCommand>(f.data[0]), now);
    }
}

/// The services of a node that is not stopped.
void Device::handle_service(const Frame& f, Time now) noexcept {
    if (sync_.handle(f, now)) return take_sync(now);
    if (srdos_.handle(f, now)) return;
    for (auto& s : servers_) {
        if (s.server->listens_to(f)) return s.server->handle(f, now);
    }
    if (pdos_.handle(f, now)) return;
    for (auto& c : clients_) {
        if (c.client->listens_to(f)) return c.client->handle(f, now);
    }
    TimeOfDay time;
    if (time_.handle(f, time)) return events_.on_time(time, now);
    emcy_consumer_.handle(f, now, events_);
}

void Device::poll(Time now) noexcept {
    if (!started_) return;
    now_ = now;
    lss_.poll();
    if (!usable(node_id_)) return;
    const auto change = error_control_.poll(now, events_);
    if (change.lost) {
        communication_error(0x8130, change.node, now);
    } else if (change.recovered) {
        emcy_.clear(0x8130);
    }
    if (state_ == NmtState::stopped) return;
    if (sync_.poll(now)) {
        take_sync(now);
    }
    if (sync_.lost(now)) {
        events_.on_sync_lost(now);
    }
    pdos_.poll(now);
    srdos_.poll(now);
    for (auto& s : servers_) {
        s.server->poll(now);
    }
    for (auto& c : clients_) {
        c.client->poll(now);
    }
    emcy_.poll(now);
}

Abort Device::reading(Entry& e) noexcept {
    // "on command"
    if ((e.index == 0x1010 || e.index == 0x1011) && e.sub != 0) {
        store(e.data, std::uint32_t{1});
    }
    return Abort::none;
}

Abort Device::writing(Entry& e, std::span<const std::uint8_t> value) noexcept {
    if (e.sub == 0) return Abort::none;
    if (e.index == 0x1010 || e.index == 0x1011) {
        const bool restore = e.index == 0x1011;
        if (load<std::uint32_t>(value.data()) != (restore ? load_defaults : save)) {
            return Abort::cannot_store;
        }
        const auto [first, last] = objects_of(e.sub);
        dictionary_.keep(first, last, restore);
        return restore ? events_.on_restore(e.sub) : events_.on_store(e.sub);
    }
    if (e.sub > 2) return Abort::none;
    const auto cob = load<std::uint32_t>(value.data());
    const auto was = load<std::uint32_t>(e.data);
    if ((cob & cob_invalid) != 0) return Abort::none;
    const bool moved = (was & cob_invalid) == 0 && cob != was;
    const bool taken = has_restricted_id(cob) && !is_sdo_id(cob_id(cob));
    return abort_if(moved || taken, Abort::value);
}

void Device::written(Entry& e) noexcept {
    if (e.index > 0x1200 && e.index <= 0x12ff) {
        configure_channel(e.index);
    } else if (e.index == 0x1010 || e.index == 0x1011) {
        store(e.data, std::uint32_t{1});
    }
}

}  // namespace hal::canopen
