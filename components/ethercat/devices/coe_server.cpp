// SPDX-License-Identifier: MIT
#include "ethercat/devices/coe_server.hpp"

#include <algorithm>
#include <cstring>

namespace hal::ethercat::devices {

namespace sdo = coe::command;

namespace {

void refuse(MailboxError error, Outbox& out) noexcept {
    out.send(MailboxType::error, write_mailbox_error(out.payload(), error));
}

}  // namespace

void CoeServer::take(const MailboxMessage& message, State state, Outbox& out) noexcept {
    if (message.payload.size() < coe::header_bytes) return refuse(MailboxError::too_short, out);
    switch (coe::service_of(message.payload.data())) {
    case coe::Service::sdo_request: return request(message.payload, state, out);
    case coe::Service::sdo_information: return information_.take(message.payload, out);
    default: return refuse(MailboxError::service_not_supported, out);
    }
}

void CoeServer::respond(std::uint8_t command, std::uint32_t value, Outbox& out) noexcept {
    out.send(MailboxType::coe, coe::write_sdo(out.payload(), coe::Service::sdo_response,
                                              {command, index_, sub_, value}));
}

void CoeServer::respond_to_segment(bool toggle, Outbox& out) noexcept {
    std::uint8_t* to = out.payload();
    std::memset(to, 0, coe::sdo_bytes);
    coe::write_header(to, coe::Service::sdo_response);
    to[2] = static_cast<std::uint8_t>(sdo::download_segment_response | (toggle ? sdo::toggle : 0));
    out.send(MailboxType::coe, coe::sdo_bytes);
}

void CoeServer::abort(coe::Abort why, Outbox& out) noexcept {
    transfer_ = Transfer::none;
    out.send(MailboxType::coe, coe::write_sdo(out.payload(), coe::Service::sdo_request,
                                              {sdo::abort, index_, sub_, cia301::code_of(why)}));
}

void CoeServer::request(std::span<const std::uint8_t> payload, State state, Outbox& out) noexcept {
    if (payload.size() < coe::segment_data) return refuse(MailboxError::too_short, out);
    const std::uint8_t command = payload[2];
    const std::uint8_t specifier = command & sdo::specifier;
    if (specifier == sdo::download_segment) return download_segment(command, payload, state, out);
    if (specifier == sdo::upload_segment) return upload_segment(command, out);
    const auto r = coe::read_sdo(payload);
    if (!r) return refuse(MailboxError::too_short, out);
    transfer_ = Transfer::none;  // a new request ends one that was given up
    if (specifier == sdo::abort) return;
    index_ = r->index;
    sub_ = r->sub;
    complete_ = r->complete();
    if (complete_ && !complete_access_) return abort(coe::Abort::no_complete_access, out);
    switch (specifier) {
    case sdo::upload: return upload(*r, state, out);
    case sdo::download: return download(*r, payload, state, out);
    default: return abort(coe::Abort::command, out);
    }
}

void CoeServer::upload(const coe::Sdo& r, State state, Outbox& out) noexcept {
    const auto code = dictionary_.read(r.index, r.sub, complete_, state, buffer_, length_);
    if (code != coe::Abort::none) return abort(code, out);
    const std::uint8_t bit = complete_ ? sdo::complete : 0;
    if (length_ >= 1 && length_ <= 4) {
        std::uint32_t value = 0;
        std::memcpy(&value, buffer_.data(), length_);
        const auto command = coe::expedited_command(sdo::upload_response, length_);
        return respond(static_cast<std::uint8_t>(command | bit), value, out);
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
    if (transfer_ != Transfer::upload) return abort(coe::Abort::command, out);
    if (((command & sdo::toggle) != 0) != toggle_) return abort(coe::Abort::toggle, out);
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
    // ETG.1000.6, "SDO download normal response": as in the request
    const auto accepted =
        static_cast<std::uint8_t>(sdo::download_response | (complete_ ? sdo::complete : 0));
    if (r.expedited()) {
        length_ = at_ = r.expedited_bytes();
        std::memcpy(buffer_.data(), &r.value, 4);
        const auto* e = dictionary_.find(index_, sub_);
        if ((r.command & sdo::size_given) == 0 && e != nullptr && !complete_) {
            length_ = at_ = std::min<std::size_t>(4, e->bytes());
        }
        if (finish_download(state, out)) {
            respond(accepted, 0, out);
        }
        return;
    }
    length_ = r.value;
    if (length_ > buffer_.size()) return abort(coe::Abort::memory, out);
    const auto code = dictionary_.check_write(index_, sub_, complete_, state, length_);
    if (code != coe::Abort::none) return abort(code, out);
    const auto data = payload.subspan(coe::sdo_bytes);
    at_ = std::min(data.size(), length_);
    std::memcpy(buffer_.data(), data.data(), at_);
    if (at_ < length_) {
        transfer_ = Transfer::download;
        return respond(accepted, 0, out);
    }
    if (finish_download(state, out)) {
        respond(accepted, 0, out);
    }
}

void CoeServer::download_segment(std::uint8_t command, std::span<const std::uint8_t> payload,
                                 State state, Outbox& out) noexcept {
    if (transfer_ != Transfer::download) return abort(coe::Abort::command, out);
    const bool toggle = (command & sdo::toggle) != 0;
    if (toggle != toggle_) return abort(coe::Abort::toggle, out);
    const auto data = coe::segment_of(payload);
    if (data.size() > length_ - at_) return abort(coe::Abort::too_long, out);
    if (!data.empty()) {
        std::memcpy(buffer_.data() + at_, data.data(), data.size());
    }
    at_ += data.size();
    toggle_ = !toggle_;
    const bool last = (command & sdo::last_segment) != 0;
    if (!last || finish_download(state, out)) {
        respond_to_segment(toggle, out);
    }
}

bool CoeServer::finish_download(State state, Outbox& out) noexcept {
    transfer_ = Transfer::none;
    auto code = coe::Abort::length;
    if (at_ == length_) {
        code = dictionary_.write(index_, sub_, complete_, state, {buffer_.data(), length_});
    }
    if (code == coe::Abort::none) return true;
    abort(code, out);
    return false;
}

}  // namespace hal::ethercat::devices
