// SPDX-License-Identifier: MIT
#include "ethercat/devices/coe_server.hpp"

#include <algorithm>
#include <cstring>

namespace hal::ethercat::devices {

namespace sdo = coe::command;

void CoeServer::take(const MailboxMessage& message, State state, Outbox& out) noexcept {
    if (message.payload.size() < coe::header_bytes) {
        out.send(MailboxType::error, write_mailbox_error(out.payload(), MailboxError::too_short));
        return;
    }
    switch (coe::service_of(message.payload.data())) {
    case coe::Service::sdo_request: request(message.payload, state, out); break;
    case coe::Service::sdo_information: information(message.payload, out); break;
    default:
        out.send(MailboxType::error,
                 write_mailbox_error(out.payload(), MailboxError::service_not_supported));
        break;
    }
}

void CoeServer::emergency(const coe::Emergency& e, Outbox& out) noexcept {
    if (!out.full()) {
        out.send(MailboxType::coe, coe::write_emergency(out.payload(), e));
    }
}

void CoeServer::respond(std::uint8_t command, std::uint32_t value, Outbox& out) noexcept {
    out.send(MailboxType::coe, coe::write_sdo(out.payload(), coe::Service::sdo_response,
                                              {command, index_, sub_, value}));
}

void CoeServer::abort(std::uint32_t code, Outbox& out) noexcept {
    transfer_ = Transfer::none;
    out.send(MailboxType::coe, coe::write_sdo(out.payload(), coe::Service::sdo_request,
                                              {sdo::abort, index_, sub_, code}));
}

void CoeServer::request(std::span<const std::uint8_t> payload, State state, Outbox& out) noexcept {
    if (payload.size() < 3) {
        return out.send(MailboxType::error,
                        write_mailbox_error(out.payload(), MailboxError::too_short));
    }
    const std::uint8_t command = payload[2];
    const std::uint8_t specifier = command & sdo::specifier;
    if (specifier == sdo::download_segment) return download_segment(command, payload, state, out);
    if (specifier == sdo::upload_segment) return upload_segment(command, out);
    const auto r = coe::read_sdo(payload);
    if (!r) {
        return out.send(MailboxType::error,
                        write_mailbox_error(out.payload(), MailboxError::too_short));
    }
    transfer_ = Transfer::none;  // a new request ends one that was given up
    if (specifier == sdo::abort) return;
    index_ = r->index;
    sub_ = r->sub;
    complete_ = r->complete();
    if (complete_ && !complete_access_) return abort(coe::abort::no_complete_access, out);
    if (specifier == sdo::upload) {
        upload(*r, state, out);
    } else if (specifier == sdo::download) {
        download(*r, payload, state, out);
    } else {
        abort(coe::abort::command, out);
    }
}

void CoeServer::upload(const coe::Sdo& r, State state, Outbox& out) noexcept {
    if (const auto code = dictionary_.read(r.index, r.sub, complete_, state, buffer_, length_)) {
        return abort(code, out);
    }
    const std::uint8_t bit = complete_ ? sdo::complete : 0;
    if (length_ >= 1 && length_ <= 4) {
        std::uint32_t value = 0;
        std::memcpy(&value, buffer_.data(), length_);
        return respond(
            static_cast<std::uint8_t>(coe::expedited_command(sdo::upload_response, length_) | bit),
            value, out);
    }
    const std::size_t first = std::min(length_, coe::normal_capacity(out.mailbox()));
    std::uint8_t* to = out.payload();
    const auto command = static_cast<std::uint8_t>(sdo::upload_response | sdo::size_given | bit);
    coe::write_sdo(to, coe::Service::sdo_response,
                   {command, index_, sub_, static_cast<std::uint32_t>(length_)});
    std::memcpy(to + coe::sdo_bytes, buffer_.data(), first);
    out.send(MailboxType::coe, coe::sdo_bytes + first);
    at_ = first;
    toggle_ = false;
    transfer_ = at_ < length_ ? Transfer::upload : Transfer::none;
}

void CoeServer::upload_segment(std::uint8_t command, Outbox& out) noexcept {
    if (transfer_ != Transfer::upload) return abort(coe::abort::command, out);
    if (((command & sdo::toggle) != 0) != toggle_) return abort(coe::abort::toggle, out);
    const std::size_t n = std::min(length_ - at_, coe::segment_capacity(out.mailbox()));
    const bool last = at_ + n == length_;
    const std::span<const std::uint8_t> data(buffer_.data() + at_, n);
    out.send(MailboxType::coe,
             coe::write_segment(out.payload(), coe::Service::sdo_response,
                                sdo::upload_segment_response, toggle_, last, data));
    at_ += n;
    toggle_ = !toggle_;
    if (last) {
        transfer_ = Transfer::none;
    }
}

void CoeServer::download(const coe::Sdo& r, std::span<const std::uint8_t> payload, State state,
                         Outbox& out) noexcept {
    toggle_ = false;
    if (r.expedited()) {
        length_ = at_ = r.expedited_bytes();
        std::memcpy(buffer_.data(), &r.value, 4);
        const auto* e = dictionary_.find(index_, sub_);
        if ((r.command & sdo::size_given) == 0 && e != nullptr && !complete_) {
            length_ = at_ = std::min<std::size_t>(4, e->bytes());
        }
        return finish_download(state, out, false, false);
    }
    length_ = r.value;
    if (length_ > buffer_.size()) return abort(coe::abort::memory, out);
    if (const auto code = dictionary_.check_write(index_, sub_, complete_, state, length_)) {
        return abort(code, out);
    }
    const auto data = payload.subspan(coe::sdo_bytes);
    at_ = std::min(data.size(), length_);
    std::memcpy(buffer_.data(), data.data(), at_);
    if (at_ == length_) return finish_download(state, out, false, false);
    transfer_ = Transfer::download;
    respond(sdo::download_response, 0, out);
}

void CoeServer::download_segment(std::uint8_t command, std::span<const std::uint8_t> payload,
                                 State state, Outbox& out) noexcept {
    if (transfer_ != Transfer::download) return abort(coe::abort::command, out);
    const bool toggle = (command & sdo::toggle) != 0;
    if (toggle != toggle_) return abort(coe::abort::toggle, out);
    const auto data = coe::segment_of(payload);
    if (data.size() > length_ - at_) return abort(coe::abort::too_long, out);
    if (!data.empty()) {
        std::memcpy(buffer_.data() + at_, data.data(), data.size());
    }
    at_ += data.size();
    toggle_ = !toggle_;
    if ((command & sdo::last_segment) != 0) return finish_download(state, out, true, toggle);
    const auto response =
        static_cast<std::uint8_t>(sdo::download_segment_response | (toggle ? sdo::toggle : 0));
    std::uint8_t* to = out.payload();
    std::memset(to, 0, coe::sdo_bytes);
    coe::write_header(to, coe::Service::sdo_response);
    to[2] = response;
    out.send(MailboxType::coe, coe::sdo_bytes);
}

void CoeServer::finish_download(State state, Outbox& out, bool segmented, bool toggle) noexcept {
    transfer_ = Transfer::none;
    if (at_ != length_) return abort(coe::abort::length, out);
    if (const auto code =
            dictionary_.write(index_, sub_, complete_, state, {buffer_.data(), length_})) {
        return abort(code, out);
    }
    if (!segmented) {
        return respond(
            static_cast<std::uint8_t>(sdo::download_response | (complete_ ? sdo::complete : 0)), 0,
            out);
    }
    std::uint8_t* to = out.payload();
    std::memset(to, 0, coe::sdo_bytes);
    coe::write_header(to, coe::Service::sdo_response);
    to[2] = static_cast<std::uint8_t>(sdo::download_segment_response | (toggle ? sdo::toggle : 0));
    out.send(MailboxType::coe, coe::sdo_bytes);
}

}  // namespace hal::ethercat::devices
