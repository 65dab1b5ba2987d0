// SPDX-License-Identifier: MIT
#include "rtcfg_applicant.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace hal::tdma::rtcfg {

namespace {

constexpr std::size_t   most_accepted = 1000;  // a server that changes its mind for ever
constexpr std::uint32_t most_refusals = 3, most_dead = 100;  // that are said; a hostile station could go on and on

/// The first error, without what a terminal would take as a command: the text is a stranger's.
std::string first_error(const config::Reading& reading) {
    std::string text = config::to_string(reading, "stage 1");
    text.resize(std::min(text.find('\n'), text.size()));
    std::replace_if(text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    return text;
}

}  // namespace

Applicant::Applicant(std::string instance, Station& station, Logical own, std::string file, Events& events)
    : instance_(std::move(instance)),
      path_(std::move(file)),
      station_(station),
      events_(events),
      client_(station, own, *this, !path_.empty()),
      spare_(largest_stage_2) {}

void Applicant::begin() noexcept {
    client_.begin();
    accepted_ = nullptr;
    offered_ = writing_ = told_server_ = told_other_ = false;
    file_bytes_ = dead_told_ = refusals_ = 0;
    Offer           offer;
    const Accepted* answer = nullptr;
    File            file;
    std::uint32_t   bytes = 0;
    while (offers_.pop(offer) || answers_.pop(answer) || files_.pop(file) || written_.pop(bytes)) {}
}

void Applicant::on_stage_1(std::span<const std::uint8_t> text, const Address& server) noexcept {
    if (offered_ || text.size() > std::tuple_size_v<decltype(Offer::text)>) return;
    if (accepted_ != nullptr) {
        if (std::equal(text.begin(), text.end(), accepted_->text.begin(), accepted_->text.end())) {
            client_.accept(server, accepted_->schedule.heartbeat_ms);  // the server began anew: it is told again who is there
            return;
        }
        const State state = station_.status().state;
        if (state != State::unconfigured && state != State::listening) {  // slots in use do not move
            ++foreign_;
            if (!told_other_) told_other_ = true, events_.on_event(Event::other_configuration, server, 0);
            return;
        }
    }
    Offer offer;
    offer.server = server;
    offer.length = static_cast<std::uint16_t>(text.size());
    std::copy(text.begin(), text.end(), offer.text.begin());
    offered_ = offers_.push(offer);
}

void Applicant::on_stage_2(std::vector<std::uint8_t>& file, std::uint32_t length, const Address& server) noexcept {
    if (writing_) return;
    std::swap(file, spare_);
    writing_ = files_.push({server, length});
}

void Applicant::on_dead_station(const Address& who) noexcept {
    if (dead_told_ < most_dead) ++dead_told_, events_.on_event(Event::reported_dead, who, 0);
}

void Applicant::on_other_server(const Address& who) noexcept {
    if (!told_server_) told_server_ = true, events_.on_event(Event::other_server, who, 0);
}

bool Applicant::cycle() noexcept {
    if (std::uint32_t bytes = 0; written_.pop(bytes)) writing_ = false, file_bytes_ = bytes;
    const Accepted* answer = nullptr;
    if (!answers_.pop(answer)) return false;
    offered_ = false;
    if (answer == nullptr || !station_.reconfigure(answer->setup)) {
        ++foreign_;
        return false;
    }
    accepted_ = answer;
    told_server_ = told_other_ = false;
    client_.accept(answer->server, answer->schedule.heartbeat_ms);
    return true;
}

void Applicant::work() {
    for (Offer offer; offers_.pop(offer);) judge(offer);
    for (File file; files_.pop(file);) write(file);
}

void Applicant::judge(const Offer& offer) {
    std::string text(reinterpret_cast<const char*>(offer.text.data()), offer.length);
    if (text == refused_) {
        answers_.push(nullptr);
        return;
    }
    const std::string server = ethernet::to_string(offer.server);
    config::Reading   reading = config::read(text);
    const bool        one = reading.good() && reading.schedule.stations.size() == 1 && !reading.schedule.stations[0].slots.empty();
    if (!one || all_.size() >= most_accepted) {
        refused_ = text;
        if (++refusals_ <= most_refusals)
            say("what " + server + " sent as this station's configuration cannot be used" +
                (reading.good() ? one ? ", it was changed too often" : ": it is not the block of one station, with a slot"
                                : "; " + first_error(reading)) +
                "; this station waits for another" + (refusals_ == most_refusals ? ", and says no more of such" : ""));
        answers_.push(nullptr);
        return;
    }
    refusals_ = 0;
    StationSetup setup = config::setup_of(reading.schedule, 0);
    const auto&  entry = reading.schedule.stations[0];
    const auto   count = std::to_string(setup.slots.size()) + (setup.slots.size() == 1 ? " slot" : " slots");
    say("configured by " + server + ": it is station " + entry.name + " with " + count + ", the cycle is " +
        config::microseconds(reading.schedule.cycle));
    FaultWords words(setup);
    all_.push_back(std::make_unique<Accepted>(
        Accepted{offer.server, std::move(text), std::move(reading.schedule), std::move(setup), std::move(words)}));
    answers_.push(all_.back().get());
}

/// Whole or not at all: written beside it and renamed; what is no file (a device, a pipe) is written as it is.
void Applicant::write(const File& file) {
    const std::string server = ethernet::to_string(file.server);
    std::uint32_t     written = 0;
    if (file.length == 0) {
        say(server + " has no file (stage 2) for this station; '" + path_ + "' is not written");
    } else {
        std::error_code   ignored;
        const auto        kind = std::filesystem::symlink_status(path_, ignored).type();
        const bool        plain = kind == std::filesystem::file_type::not_found || kind == std::filesystem::file_type::regular;
        const std::string into = plain ? path_ + ".part" : path_;
        errno = 0;
        std::ofstream out(into, std::ios::binary | (plain ? std::ios::trunc : std::ios::app));
        out.write(reinterpret_cast<const char*>(spare_.data()), file.length);
        out.close();
        if (!out || (plain && std::rename(into.c_str(), path_.c_str()) != 0)) {
            say("the file from " + server + " cannot be written to '" + path_ + "': " + std::strerror(errno) + "; mend stage2=");
            if (plain) std::remove(into.c_str());
        } else {
            written = file.length;
            say("the file from " + server + ", " + std::to_string(written) + " bytes, is in '" + path_ + "'");
        }
    }
    written_.push(written);
}

void Applicant::say(const std::string& sentence) const { std::fputs((instance_ + ": " + sentence + "\n").c_str(), stderr); }

}  // namespace hal::tdma::rtcfg
