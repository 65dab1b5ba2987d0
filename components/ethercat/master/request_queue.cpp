// SPDX-License-Identifier: MIT
#include "ethercat/master/request_queue.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <thread>

namespace hal::ethercat::master {
namespace {

using Stage = MailboxRequest::Stage;
constexpr std::int64_t eoe_poll_interval_ns = 10'000'000;
constexpr MailboxResult nobody{MailboxResult::Outcome::lost, 0, 0};

// Type, 1 for CoE: the reply to a request of the gateway, never an unrequested message.
bool accepts_reply(const Expected& expected, std::span<const std::uint8_t> payload) noexcept {
    if (expected.first != static_cast<std::uint32_t>(MailboxType::coe)) return true;
    if (payload.size() < coe::header_bytes) return false;
    const auto service = coe::service_of(payload.data());
    return service != coe::Service::emergency && service != coe::Service::tx_pdo;
}

}  // namespace

bool RequestPort::submit(MailboxRequest& request) noexcept {
    if (closed_) return false;
    request.next = nullptr;
    request.stage = Stage::queued;
    if (queue_.push(&request)) return true;
    request.stage = Stage::idle;
    return false;
}

bool RequestPort::finished(MailboxRequest& request) const noexcept {
    const Stage stage = request.stage;
    if ((stage == Stage::queued || stage == Stage::withdrawn) && closed_) {
        request.result = nobody;
        return true;
    }
    return stage == Stage::finished;
}

void RequestPort::wait(MailboxRequest& request) const noexcept {
    while (!finished(request)) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
}

RequestServer::RequestServer(Mailboxes& mailboxes, Find find, std::size_t workers)
    : mailboxes_(mailboxes), find_(std::move(find)), slots_(mailboxes.size()) {
    for (std::size_t i = 0; i < std::max<std::size_t>(workers, 1); ++i) {
        workers_.push_back(std::make_unique<Worker>());
    }
}

RequestServer::~RequestServer() { stop(); }

RequestPort& RequestServer::open(std::size_t capacity) {
    return *ports_.emplace_back(std::make_unique<RequestPort>(capacity));
}

void RequestServer::finish(MailboxRequest& request, const MailboxResult& result) noexcept {
    request.result = result;
    request.stage = Stage::finished;  // the owner may destroy it from here on
}

void RequestServer::finish(Worker& worker) noexcept {
    if (worker.request != nullptr) {
        finish(*std::exchange(worker.request, nullptr), nobody);
    }
    slots_[worker.slave].busy = false;
}

void RequestServer::collect() noexcept {
    for (const auto& port : ports_) {
        MailboxRequest* request = nullptr;
        while (port->queue_.pop(request)) {
            if (request->slave >= slots_.size()) {
                finish(*request, nobody);
                continue;
            }
            Slot& slot = slots_[request->slave];
            (slot.last != nullptr ? slot.last->next : slot.first) = request;
            slot.last = request;
            ++waiting_;
        }
    }
}

void RequestServer::step(std::int64_t now_ns) noexcept {
    collect();
    if (slots_.empty()) return;
    constexpr std::size_t looked_at = 16;  // slots in a cycle while nothing is requested
    const std::size_t count = waiting_ != 0 ? slots_.size() : std::min(slots_.size(), looked_at);
    std::size_t at = 0;
    for (const auto& worker : workers_) {
        if (worker->channel.busy()) continue;
        bool started = false;
        for (; at < count && !started; ++at) {
            const std::size_t number = (next_slot_ + at) % slots_.size();
            started = start(*worker, static_cast<std::uint16_t>(number), now_ns);
        }
    }
    next_slot_ = (next_slot_ + at) % slots_.size();
}

/// Returns what a slave needs that nobody requested.
RequestServer::Unrequested RequestServer::unrequested(const BusSlave& slave, const Slot& slot,
                                                      std::int64_t now_ns) const noexcept {
    const bool reported = slave.mailbox_status != nullptr;
    // what it sent comes first: it may wait for that
    if (reported && (*slave.mailbox_status & 0x08) != 0) return Unrequested::poll;
    if (switch_ != nullptr && switch_->pending(slave)) return Unrequested::frames;
    std::int64_t interval = poll_interval_ns_;
    if (switch_ != nullptr && switch_->has(slave)) {
        interval = std::min(interval, eoe_poll_interval_ns);
    }
    const bool due =
        !reported && poll_interval_ns_ != 0 && slave.present && now_ns - slot.polled_ns >= interval;
    return due ? Unrequested::poll : Unrequested::nothing;
}

/// Removes the first request of a slot.
MailboxRequest* RequestServer::take_next(Slot& slot) noexcept {
    MailboxRequest* const request = std::exchange(slot.first, slot.first->next);
    --waiting_;
    if (slot.first == nullptr) {
        slot.last = nullptr;
    }
    return request;
}

/// Finishes all requests of a slot.
void RequestServer::refuse_all(Slot& slot, const MailboxResult& result) noexcept {
    while (slot.first != nullptr) {
        finish(*take_next(slot), result);
    }
}

/// Finishes the requests that were withdrawn, up to the first that was not: that one runs from here
/// on.
void RequestServer::drop_withdrawn(Slot& slot) noexcept {
    while (slot.first != nullptr) {
        Stage stage = Stage::queued;
        if (slot.first->stage.compare_exchange_strong(stage, Stage::running)) return;
        if (stage == Stage::running) return;
        finish(*take_next(slot), nobody);
    }
}

/// Starts what a slave needs on an idle worker. Returns whether it needs something.
bool RequestServer::start(Worker& worker, std::uint16_t number, std::int64_t now_ns) noexcept {
    Slot& slot = slots_[number];
    if (slot.busy) return false;
    BusSlave* slave = find_(number);
    if (slave == nullptr || mailboxes_.find(*slave) == nullptr) {
        refuse_all(slot, slave == nullptr ? nobody : refused());
        return false;
    }
    drop_withdrawn(slot);
    const Unrequested other = unrequested(*slave, slot, now_ns);
    if (slot.first == nullptr) {
        if (other == Unrequested::nothing) return false;
        // its holder reads the mailbox
        if (mailboxes_.at(number).held()) return false;
    }
    slot.busy = true;
    slot.polled_ns = now_ns;
    worker.slave = number;
    worker.channel.set_now(now_ns);
    if (slot.first == nullptr) {
        const bool frames = other == Unrequested::frames;
        worker.channel.start(
            [&] { return serve_unrequested(worker.channel, worker, *slave, frames); });
        return true;
    }
    worker.request = take_next(slot);
    worker.channel.start([&] { return serve(worker.channel, worker, *slave); });
    return true;
}

void RequestServer::stop() noexcept {
    for (const auto& port : ports_) {
        port->closed_ = true;
    }
    for (const auto& worker : workers_) {
        if (!worker->channel.busy()) continue;
        worker->channel.stop();
        finish(*worker);
    }
    collect();
    for (auto& slot : slots_) {
        while (slot.first != nullptr) {
            finish(*std::exchange(slot.first, slot.first->next), nobody);
        }
        slot.last = nullptr;
    }
    waiting_ = 0;
}

Task<> RequestServer::serve(Channel& channel, Worker& worker, BusSlave& slave) noexcept {
    FoeProgress& progress =
        worker.request->progress != nullptr ? *worker.request->progress : worker.progress;
    const MailboxResult result = co_await execute(channel, slave, *worker.request, progress);
    slots_[worker.slave].busy = false;
    finish(*std::exchange(worker.request, nullptr), result);
}

Task<> RequestServer::serve_unrequested(Channel& channel, Worker& worker, BusSlave& slave,
                                        bool frames) noexcept {
    if (frames) {
        co_await switch_->serve(channel, slave);
    } else {
        SlaveMailbox& mailbox = mailboxes_.at(slave.number);
        const SlaveMailbox::Hold hold = co_await mailbox.hold(channel);
        co_await mailbox.poll(channel, slave);
    }
    slots_[worker.slave].busy = false;
}

Task<MailboxResult> RequestServer::execute(Channel& channel, BusSlave& slave, MailboxRequest& r,
                                           FoeProgress& progress) noexcept {
    using Kind = MailboxRequest::Kind;
    const std::span<char> name{reinterpret_cast<char*>(r.data.data()), r.data.size()};
    MailboxResult result = refused();
    switch (r.kind) {
    case Kind::sdo_upload:
        result = co_await coe_.upload(channel, slave, r.index, r.sub, r.complete, r.data);
        break;
    case Kind::sdo_download:
        result = co_await coe_.download(channel, slave, r.index, r.sub, r.complete, r.data);
        break;
    case Kind::object_list:
        result = co_await objects_.list(channel, slave, static_cast<coe::List>(r.index), r.data);
        break;
    case Kind::object:
        result = co_await objects_.object(channel, slave, r.index, r.object, name);
        break;
    case Kind::entry:
        result = co_await objects_.entry(channel, slave, r.index, r.sub, r.entry, name);
        break;
    case Kind::foe_read:
        result = co_await foe_.read(channel, slave, r.name, r.foe, r.data, progress);
        break;
    case Kind::foe_write:
        result = co_await foe_.write(channel, slave, r.name, r.foe, r.data, progress);
        break;
    case Kind::soe_read:
        result = co_await soe_.read(channel, slave, r.sub, r.index, r.elements, r.data);
        break;
    case Kind::soe_write:
        result = co_await soe_.write(channel, slave, r.sub, r.index, r.elements, r.data);
        break;
    case Kind::aoe_read:
        result = co_await aoe_.read(channel, slave, r.aoe, r.group, r.offset, r.data);
        break;
    case Kind::aoe_write:
        result = co_await aoe_.write(channel, slave, r.aoe, r.group, r.offset, r.data);
        break;
    case Kind::voe_send: result = co_await voe_.send(channel, slave, r.voe, r.data); break;
    case Kind::set_ip: result = co_await eoe_.set_ip(channel, slave, r.ip); break;
    case Kind::get_ip: result = co_await eoe_.get_ip(channel, slave, r.ip); break;
    case Kind::message: result = co_await pass(channel, slave, r); break;
    }
    co_return result;
}

Task<MailboxResult> RequestServer::pass(Channel& channel, BusSlave& slave,
                                        MailboxRequest& r) noexcept {
    const auto request = read_mailbox(r.data.first(std::min(r.length, r.data.size())));
    if (!request) co_return refused();
    SlaveMailbox& mailbox = mailboxes_.at(slave.number);
    const SlaveMailbox::Hold hold = co_await mailbox.hold(channel);
    const auto body = mailbox.body(slave);
    const std::size_t length = request->payload.size();
    if (length > body.size()) co_return refused(0, length);
    if (length != 0) {
        std::memcpy(body.data(), request->payload.data(), length);
    }
    const Expected expected{accepts_reply, static_cast<std::uint32_t>(request->type)};
    const MailboxResult result =
        co_await mailbox.exchange(channel, slave, request->type, length, expected);
    // is a reply, too
    const bool fault = result.outcome == MailboxResult::Outcome::refused && result.abort != 0;
    if (!result && !fault) co_return result;
    const MailboxMessage& reply = mailbox.reply();
    const std::size_t bytes = mailbox_header_bytes + reply.payload.size();
    if (bytes > r.data.size()) co_return refused(0, bytes);
    write_mailbox_header(r.data.data(), reply.payload.size(), request->station, reply.type,
                         reply.counter);
    if (!reply.payload.empty()) {
        std::memcpy(r.data.data() + mailbox_header_bytes, reply.payload.data(),
                    reply.payload.size());
    }
    co_return succeeded(bytes);
}

}  // namespace hal::ethercat::master
