// SPDX-License-Identifier: MIT
#include "rtcfg_applicant.hpp"

#include <algorithm>
#include <cstdio>

#include "hal/replace_file.hpp"
#include "text/quoting.hpp"

namespace hal::tdma::rtcfg {

namespace {

constexpr std::size_t max_accepted = 1000;  // against a server that never stops changing
// reported ones, against a hostile station
constexpr std::uint32_t max_rejections = 3;
constexpr std::uint32_t max_dead = 100;

/// Returns the first error without control characters: the text is untrusted.
std::string first_error(const config::ReadResult& reading) {
    std::string text = config::to_string(reading, "stage 1");
    text.resize(std::min(text.find('\n'), text.size()));
    std::replace_if(text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    return text;
}

}  // namespace

Applicant::Applicant(hal::LinePrefix prefix, Station& station, Logical own, std::string file,
                     Events& events)
    : path_(std::move(file)),
      station_(station),
      events_(events),
      client_(station, own, *this, !path_.empty()),
      spare_(max_stage_2_size),
      log_(std::move(prefix)) {}

void Applicant::begin() noexcept {
    client_.begin();
    accepted_ = nullptr;
    offered_ = writing_ = server_reported_ = other_reported_ = false;
    file_bytes_ = dead_reported_ = rejections_ = 0;
    Offer offer;
    const Accepted* answer = nullptr;
    File file;
    std::uint32_t bytes = 0;
    while (offers_.pop(offer) || answers_.pop(answer) || files_.pop(file) || written_.pop(bytes)) {
    }
}

void Applicant::on_stage_1(std::span<const std::uint8_t> text, const Address& server) noexcept {
    if (offered_ || text.size() > std::tuple_size_v<decltype(Offer::text)>) return;
    if (accepted_ != nullptr) {
        if (std::equal(text.begin(), text.end(), accepted_->text.begin(), accepted_->text.end())) {
            // the server restarted: announce this station again
            client_.accept(server, accepted_->schedule.heartbeat_ms);
            return;
        }
        const State state = station_.status().state;
        // slots in use do not move
        if (state != State::unconfigured && state != State::listening) {
            ++foreign_;
            if (!other_reported_) {
                other_reported_ = true;
                events_.on_event(Event::other_configuration, server, 0);
            }
            return;
        }
    }
    Offer offer;
    offer.server = server;
    offer.length = static_cast<std::uint16_t>(text.size());
    std::copy(text.begin(), text.end(), offer.text.begin());
    offered_ = offers_.push(offer);
}

void Applicant::on_stage_2(std::vector<std::uint8_t>& file, std::uint32_t length,
                           const Address& server) noexcept {
    if (writing_) return;
    std::swap(file, spare_);
    writing_ = files_.push({server, length});
}

void Applicant::on_dead_station(const Address& who) noexcept {
    if (dead_reported_ < max_dead) {
        ++dead_reported_;
        events_.on_event(Event::reported_dead, who, 0);
    }
}

void Applicant::on_other_server(const Address& who) noexcept {
    if (!server_reported_) {
        server_reported_ = true;
        events_.on_event(Event::other_server, who, 0);
    }
}

bool Applicant::cycle() noexcept {
    if (std::uint32_t bytes = 0; written_.pop(bytes)) {
        writing_ = false;
        file_bytes_ = bytes;
    }
    const Accepted* answer = nullptr;
    if (!answers_.pop(answer)) return false;
    offered_ = false;
    if (answer == nullptr || !station_.reconfigure(answer->setup)) {
        ++foreign_;
        return false;
    }
    accepted_ = answer;
    server_reported_ = other_reported_ = false;
    client_.accept(answer->server, answer->schedule.heartbeat_ms);
    return true;
}

void Applicant::work(std::int64_t now_ns) {
    now_ns_ = now_ns;
    for (Offer offer; offers_.pop(offer);) {
        check(offer);
    }
    for (File file; files_.pop(file);) {
        write(file);
    }
    log_.flush(now_ns);
}

void Applicant::check(const Offer& offer) {
    std::string text(reinterpret_cast<const char*>(offer.text.data()), offer.length);
    if (text == rejected_) {
        answers_.push(nullptr);
        return;
    }
    const std::string server = ethernet::to_string(offer.server);
    config::ReadResult reading = config::read(text);
    const bool one = reading.good() && reading.schedule.stations.size() == 1 &&
                     !reading.schedule.stations[0].slots.empty();
    if (!one || all_.size() >= max_accepted) {
        rejected_ = text;
        if (++rejections_ <= max_rejections) {
            std::string why = "it changed too often";
            if (!reading.good()) {
                why = first_error(reading);
            } else if (!one) {
                why = "it is not the block of one station with a slot";
            }
            const char* const last =
                rejections_ == max_rejections ? " (further rejections are not reported)" : "";
            log("rejected the configuration from " + server + ": " + why + "; waiting for another" +
                last);
        }
        answers_.push(nullptr);
        return;
    }
    rejections_ = 0;
    StationSetup setup = config::setup_of(reading.schedule, 0);
    const auto& entry = reading.schedule.stations[0];
    log("configured by " + server + " as station " + entry.name + ": " +
        counted(setup.slots.size(), "slot") + ", cycle " +
        config::microseconds(reading.schedule.cycle));
    SegmentFaults faults(reading.schedule, setup);
    all_.push_back(std::make_unique<Accepted>(Accepted{offer.server, std::move(text),
                                                       std::move(reading.schedule),
                                                       std::move(setup), std::move(faults)}));
    answers_.push(all_.back().get());
}

/// Replaces the file atomically; a device or a pipe is written in place.
void Applicant::write(const File& file) {
    const std::string server = ethernet::to_string(file.server);
    std::uint32_t written = 0;
    if (file.length == 0) {
        log(server + " has no file (stage 2) for this station; '" + path_ + "' is unchanged");
    } else {
        const std::string why =
            replace_file(path_, {reinterpret_cast<const char*>(spare_.data()), file.length});
        if (!why.empty()) {
            log("cannot write the file from " + server + " to '" + path_ + "': " + why +
                "; correct stage2=");
        } else {
            written = file.length;
            log("received '" + path_ + "' from " + server + " (" + std::to_string(written) +
                " bytes)");
        }
    }
    written_.push(written);
}

void Applicant::finish() {
    work(now_ns_);
    log_.close();
}

void Applicant::log(const std::string& sentence) { log_.print(sentence, now_ns_); }

}  // namespace hal::tdma::rtcfg
