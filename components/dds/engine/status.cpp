// SPDX-License-Identifier: MIT
#include "dds/status.hpp"

#include <algorithm>
#include <cstring>
#include <sstream>
#include <stdexcept>

namespace hal::dds {

TopicType status_topic() { return {"halcyon/status", "halcyon::Status", largest_status + 16}; }
Quality   status_quality() { return {.reliable = true, .last_value = true, .depth = 1}; }

std::vector<std::uint8_t> status_bytes(std::string_view text) {
    text = text.substr(0, largest_status);
    std::vector<std::uint8_t> bytes{0, 1, 0, 0};
    const auto                length = static_cast<std::uint32_t>(text.size() + 1);
    for (unsigned shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<std::uint8_t>(length >> shift));
    bytes.insert(bytes.end(), text.begin(), text.end());
    bytes.push_back(0);
    return bytes;
}

std::string_view status_text(std::span<const std::uint8_t> bytes) noexcept {
    if (bytes.size() < 9 || bytes[0] != 0 || bytes[1] != 1) return {};
    std::uint32_t length = 0;
    for (unsigned i = 0; i < 4; ++i) length |= static_cast<std::uint32_t>(bytes[4 + i]) << (8 * i);
    if (length < 1 || length > bytes.size() - 8) return {};
    return {reinterpret_cast<const char*>(bytes.data() + 8), length - 1};
}

std::vector<std::string> values_of(std::string_view text, std::string_view key) {
    std::vector<std::string> values;
    while (!text.empty()) {
        const std::size_t      end = std::min(text.find('\n'), text.size());
        const std::string_view line = text.substr(0, end);
        if (line.starts_with(key) && line.size() > key.size() && line[key.size()] == ' ') values.emplace_back(line.substr(key.size() + 1));
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return values;
}

namespace {

class StatusBeacon final : public Beacon, private Served {
public:
    StatusBeacon(std::shared_ptr<Participant> participant, const hal_status* host)
        : participant_(std::move(participant)), host_(host), buffer_(largest_status) {
        Quality quality = status_quality();
        quality.depth = 1;
        writer_ = participant_->writer(status_topic(), quality, nullptr);
        dds::serve(*this);
    }
    ~StatusBeacon() override { withdraw(*this); }

    void add(const void* owner, const std::string& lines) override {
        const std::lock_guard lock(mutex_);
        added_[owner] = lines;
        soon_ = true;
    }

private:
    std::int64_t serve(std::int64_t now) noexcept override {
        try {
            const std::lock_guard lock(mutex_);
            if (now < next_ && !soon_) return std::min(next_, now + 50'000'000);
            soon_ = false;
            next_ = now + status_period_ns;
            const std::size_t length = host_ != nullptr ? host_->text(host_, buffer_.data(), buffer_.size()) : 0;
            if (length != 0) last_.assign(buffer_.data(), length);
            if (host_ != nullptr && last_.empty()) {  // being loaded: nobody is to hear of it without its name
                next_ = 0;
                return now + 10'000'000;
            }
            std::string text = last_;
            for (const auto& [owner, lines] : added_) text += lines;
            writer_->write(status_bytes(text));
            return now + 50'000'000;
        } catch (const std::exception&) { return now + status_period_ns; }
    }

    const std::shared_ptr<Participant> participant_;
    const hal_status* const            host_;
    std::unique_ptr<Writer>            writer_;
    std::mutex                         mutex_;
    std::map<const void*, std::string> added_;
    std::vector<char>                  buffer_;
    std::string                        last_;
    std::int64_t                       next_ = 0;
    bool                               soon_ = false;
};

struct Beacons {
    std::mutex                                          mutex;
    std::map<const Participant*, std::weak_ptr<Beacon>> all;
};
Beacons& beacons() {
    static Beacons one;
    return one;
}

/// hal top's ear.
class Ear final : public Listener {
public:
    Ear(const Settings& settings, void (*heard)(void*, const char*, std::size_t), void* user)
        : heard_(heard), user_(user), participant_(open(settings)) {
        Quality quality = status_quality();
        quality.depth = 64;
        reader_ = participant_->reader(status_topic(), quality, this);
    }
    void on_sample(const Sample& sample) noexcept override {
        if (const std::string_view text = status_text(sample.bytes); !text.empty()) heard_(user_, text.data(), text.size());
    }

private:
    void (*const heard_)(void*, const char*, std::size_t);
    void* const                  user_;
    std::shared_ptr<Participant> participant_;
    std::unique_ptr<Reader>      reader_;
};

std::vector<std::string> list(const std::string& text) {
    std::vector<std::string> all;
    std::stringstream        from(text);
    for (std::string one; std::getline(from, one, ',');) all.push_back(one);
    return all;
}

Settings settings_of(const char* words) {
    Settings          settings;
    std::stringstream from(words);
    settings.name = "hal top";
    for (std::string word; from >> word;) {
        const auto        equals = word.find('=');
        const std::string key = word.substr(0, equals), value = equals == word.npos ? "" : word.substr(equals + 1);
        if (key == "domain") settings.domain = std::stoi(value);
        else if (key == "interfaces") settings.interfaces = list(value);
        else if (key == "peers") settings.peers = list(value);
        else if (key == "server") settings.servers = list(value);
        else throw std::invalid_argument("there is no setting '" + key + "'; the settings are domain= interfaces= peers= server=");
    }
    return settings;
}

}  // namespace

std::shared_ptr<Beacon> beacon(const std::shared_ptr<Participant>& participant, const hal_status* host) {
    const std::lock_guard   lock(beacons().mutex);
    std::weak_ptr<Beacon>&  known = beacons().all[participant.get()];
    std::shared_ptr<Beacon> one = known.lock();
    if (!one) known = one = std::make_shared<StatusBeacon>(participant, host);
    return one;
}

}  // namespace hal::dds

void* halcyon_status_open(const char* settings, void (*heard)(void*, const char*, std::size_t), void* user, char* problem) {
    try {
        return new hal::dds::Ear(hal::dds::settings_of(settings), heard, user);
    } catch (const std::exception& why) {
        std::strncpy(problem, why.what(), 255);
        problem[255] = 0;
        return nullptr;
    }
}
void halcyon_status_close(void* ear) { delete static_cast<hal::dds::Ear*>(ear); }
