// SPDX-License-Identifier: MIT
#include "boot_channel.hpp"

#include <algorithm>

namespace hal::canopen {

namespace {

/// Returns the size of the longest value that is read from the node.
std::size_t max_value_size(const NodeSetup& setup) {
    std::size_t size = std::max<std::size_t>(64, setup.program.version.size() + 16);
    for (const auto& write : setup.writes) {
        size = std::max(size, write.data.size() + 1);
    }
    return size;
}

}  // namespace

BootChannel::BootChannel(const NodeSetup& node_setup, NodeStatus& node_status,
                         RemoteNode& remote_node, const Time& now, Time sdo_timeout,
                         BootOwner& owner)
    : TaskChannel(task_bytes),
      setup(node_setup),
      status(node_status),
      remote(remote_node),
      now_(now),
      sdo_timeout_(sdo_timeout),
      owner_(owner),
      buffer_(max_value_size(node_setup)) {
    request_.context = this;
    request_.on_done = [](SdoRequest&, void* self) noexcept {
        static_cast<BootChannel*>(self)->on_answer();
    };
    set_sdo_timeout(0);
}

void BootChannel::set_sdo_timeout(Time time) noexcept {
    remote.sdo().settings().timeout = std::max(time, sdo_timeout_);
}

BootChannel::Request BootChannel::submit(std::uint16_t index, std::uint8_t sub) noexcept {
    awaited_ = Awaited::answer;
    request_.index = index;
    request_.sub = sub;
    remote.sdo().submit(request_);
    return {*this};
}
BootChannel::Request BootChannel::read(std::uint16_t index, std::uint8_t sub) noexcept {
    request_.upload = true;
    request_.buffer = buffer_;
    return submit(index, sub);
}
BootChannel::Request BootChannel::write(std::uint16_t index, std::uint8_t sub,
                                        std::span<const std::uint8_t> data) noexcept {
    request_.upload = false;
    request_.data = data;
    return submit(index, sub);
}
BootChannel::Request BootChannel::write(std::uint16_t index, std::uint8_t sub, std::uint32_t value,
                                        unsigned size, Time timeout) noexcept {
    set_sdo_timeout(timeout);
    store(small_.data(), value);
    return write(index, sub, std::span<const std::uint8_t>(small_).first(size));
}

void BootChannel::on_answer() noexcept {
    status.sdo_retries += request_.retries;
    set_sdo_timeout(0);
    answer_.abort = request_.abort;
    answer_.by_server = request_.aborted_by_server;
    answer_.value = request_.upload ? std::span<const std::uint8_t>(buffer_).first(request_.size)
                                    : std::span<const std::uint8_t>();
    if (!answer_.no_response()) {
        owner_.on_response();
    }
    awaited_ = Awaited::nothing;
    resume();
    end();
}

void BootChannel::finish_wait(bool came) noexcept {
    awaited_ = Awaited::nothing;
    came_ = came;
    resume();
    end();
}

void BootChannel::arrive(Awaited what) noexcept {
    if (awaited_ == what) {
        finish_wait(true);
    }
}

void BootChannel::poll() noexcept {
    const bool waits = awaited_ != Awaited::nothing && awaited_ != Awaited::answer;
    if (waits && now_ >= until_) {
        finish_wait(false);
    }
}

void BootChannel::stop() noexcept {
    awaited_ = Awaited::nothing;
    const bool queued = request_.status == SdoRequest::Status::waiting ||
                        request_.status == SdoRequest::Status::active;
    if (queued) {
        const auto on_done = request_.on_done;
        request_.on_done = nullptr;
        remote.sdo().cancel(request_, Abort::timeout);
        request_.on_done = on_done;
    }
    set_sdo_timeout(0);
    TaskChannel::stop();
}

void BootChannel::note_object(std::uint16_t index, std::uint8_t sub, std::uint64_t expected,
                              std::uint64_t found) noexcept {
    status.index = index;
    status.sub = sub;
    status.abort = Abort::none;
    status.expected = expected;
    status.found = found;
    status.write = 0;
}

bool BootChannel::fail(BootResult result, Cause cause) noexcept {
    outcome_ = {result, cause};
    return false;
}

bool BootChannel::fail_transfer(BootResult result) noexcept {
    note_answer(0, 0);
    status.abort = request_.abort;
    if (request_.not_sent) return fail(result, Cause::not_sent);
    if (answer_.no_response()) return fail(result, Cause::no_response);
    if (answer_.object_missing() && result == BootResult::no_program) {
        return fail(result, Cause::no_object);
    }
    return fail(result, Cause::aborted);
}

}  // namespace hal::canopen
