// SPDX-License-Identifier: MIT
#include "ethercat/devices/foe_server.hpp"

#include <algorithm>
#include <cstring>

namespace hal::ethercat::devices {

void FoeServer::add(std::string name, std::vector<std::uint8_t> content, std::uint32_t password,
                    bool boot_only) {
    File file{std::move(name), std::move(content), 0, password, boot_only};
    file.length = file.bytes.size();
    file.bytes.resize(std::max(file.length, max_bytes_));
    files_.push_back(std::move(file));
}

void FoeServer::accept_new() {
    new_ = files_.size();
    add({}, {});
    files_.back().name.reserve(max_mailbox);
}

FoeServer::File* FoeServer::find(std::string_view name) noexcept {
    const auto found = std::find_if(files_.begin(), files_.end(),
                                    [&](const File& file) { return file.name == name; });
    return found == files_.end() ? nullptr : &*found;
}

FoeServer::File* FoeServer::rename_new(std::string_view name) noexcept {
    if (!new_ || name.empty()) return nullptr;
    File& file = files_[*new_];
    if (name.size() > file.name.capacity()) return nullptr;
    file.name.assign(name);
    file.length = 0;
    return &file;
}

std::span<const std::uint8_t> FoeServer::content(std::string_view name) const noexcept {
    for (const auto& f : files_) {
        if (f.name == name) {
            return {f.bytes.data(), f.length};
        }
    }
    return {};
}

void FoeServer::send(Outbox& out, foe::Opcode opcode, std::uint32_t value) noexcept {
    foe::write_header(out.payload(), opcode, value);
    out.send(MailboxType::foe, foe::header_bytes);
}

void FoeServer::refuse(Outbox& out, foe::Error error) noexcept {
    file_ = nullptr;
    send(out, foe::Opcode::error, static_cast<std::uint32_t>(error));
}

void FoeServer::open(const foe::Message& m, bool write, State state, Outbox& out) noexcept {
    file_ = find(m.text());
    if (file_ == nullptr && write) {
        file_ = rename_new(m.text());
    }
    if (file_ == nullptr) return refuse(out, foe::Error::not_found);
    if (file_->password != 0 && file_->password != m.value) {
        return refuse(out, foe::Error::no_rights);
    }
    if (write && file_->boot_only && state != State::boot) {
        return refuse(out, foe::Error::bootstrap_only);
    }
    writing_ = write;
    at_ = 0;
    busy_ = false;
    packet_ = write ? 0 : 1;
    if (write) {
        send(out, foe::Opcode::ack, 0);
    } else {
        send_packet(out);
    }
}

void FoeServer::send_packet(Outbox& out) noexcept {
    last_ = std::min(foe::packet_capacity(out.mailbox()), file_->length - at_);
    std::uint8_t* to = out.payload();
    foe::write_header(to, foe::Opcode::data, packet_);
    std::memcpy(to + foe::header_bytes, file_->bytes.data() + at_, last_);
    out.send(MailboxType::foe, foe::header_bytes + last_);
}

void FoeServer::take(const MailboxMessage& message, State state, Outbox& out) noexcept {
    const auto m = foe::read(message.payload);
    if (!m) {
        return out.send(MailboxType::error,
                        write_mailbox_error(out.payload(), MailboxError::too_short));
    }
    const bool is_sending = file_ != nullptr && !writing_;
    switch (m->opcode) {
    case foe::Opcode::read: return open(*m, false, state, out);
    case foe::Opcode::write: return open(*m, true, state, out);
    case foe::Opcode::data: return receive_packet(*m, out);
    case foe::Opcode::ack:
        if (is_sending) {
            acknowledge_packet(*m, out);
        }
        return;
    case foe::Opcode::busy:
        if (is_sending) {
            send_packet(out);
        }
        return;
    case foe::Opcode::error: file_ = nullptr; return;
    }
    refuse(out, foe::Error::illegal);
}

/// Appends a packet to the file that is written. A packet shorter than a mailbox is the last one.
void FoeServer::receive_packet(const foe::Message& m, Outbox& out) noexcept {
    if (file_ == nullptr || !writing_) return refuse(out, foe::Error::illegal);
    if (m.value != packet_ + 1) return refuse(out, foe::Error::packet_number);
    const bool is_busy_due = busy_every_ != 0 && m.value % busy_every_ == 0;
    busy_ = is_busy_due && !busy_;
    if (busy_) return send(out, foe::Opcode::busy, 100U << 16);  // the master repeats the packet
    if (m.data.size() > file_->bytes.size() - at_) return refuse(out, foe::Error::disk_full);
    std::copy(m.data.begin(), m.data.end(), file_->bytes.data() + at_);
    at_ += m.data.size();
    packet_ = m.value;
    send(out, foe::Opcode::ack, packet_);
    // both mailboxes have the same size
    if (m.data.size() < foe::packet_capacity(out.mailbox())) {
        file_->length = at_;
        file_ = nullptr;
    }
}

/// Sends the packet behind the acknowledged one, unless that was the last one.
void FoeServer::acknowledge_packet(const foe::Message& m, Outbox& out) noexcept {
    if (m.value != packet_) return refuse(out, foe::Error::packet_number);
    at_ += last_;
    if (last_ < foe::packet_capacity(out.mailbox())) {
        file_ = nullptr;
        return;
    }
    ++packet_;
    send_packet(out);
}

}  // namespace hal::ethercat::devices
