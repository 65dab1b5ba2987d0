// SPDX-License-Identifier: MIT
#include "dds/status.hpp"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <sstream>
#include <stdexcept>

namespace hal::dds {

TopicType status_topic() { return {"halcyon/status", "halcyon::Status", max_status_size + 16}; }
Quality status_quality() { return {.reliable = true, .last_value = true, .depth = 1}; }

namespace {

class StatusBeacon final : public Beacon, private Served {
public:
    StatusBeacon(std::shared_ptr<Participant> participant, const hal_status* host)
        : participant_(std::move(participant)), host_(host), buffer_(max_status_size) {
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
            const std::size_t length =
                host_ != nullptr ? host_->text(host_, buffer_.data(), buffer_.size()) : 0;
            if (length != 0) {
                last_.assign(buffer_.data(), length);
            }
            // still loading: the status needs the instance's name
            if (host_ != nullptr && last_.empty()) {
                next_ = 0;
                return now + 10'000'000;
            }
            std::string text = last_;
            for (const auto& [owner, lines] : added_) {
                text += lines;
            }
            writer_->write(status_bytes(text));
            return now + 50'000'000;
        } catch (const std::exception&) {
            return now + status_period_ns;
        }
    }

    const std::shared_ptr<Participant> participant_;
    const hal_status* const host_;
    std::unique_ptr<Writer> writer_;
    std::mutex mutex_;
    std::map<const void*, std::string> added_;
    std::vector<char> buffer_;
    std::string last_;
    std::int64_t next_ = 0;
    bool soon_ = false;
};

struct Beacons {
    std::mutex mutex;
    std::map<const Participant*, std::weak_ptr<Beacon>> all;
};
Beacons& beacons() {
    static Beacons one;
    return one;
}

/// Receives the status of all instances, for hal top.
class StatusReader final : public Listener {
public:
    StatusReader(const Settings& settings, void (*heard)(void*, const char*, std::size_t),
                 void* user)
        : heard_(heard), user_(user), participant_(open(settings)) {
        Quality quality = status_quality();
        quality.depth = 64;
        reader_ = participant_->reader(status_topic(), quality, this);
    }
    void on_sample(const Sample& sample) noexcept override {
        if (const std::string_view text = status_text(sample.bytes); !text.empty()) {
            heard_(user_, text.data(), text.size());
        }
    }

private:
    void (*const heard_)(void*, const char*, std::size_t);
    void* const user_;
    std::shared_ptr<Participant> participant_;
    std::unique_ptr<Reader> reader_;
};

Settings settings_of(const char* words) {
    Settings settings;
    std::stringstream from(words);
    settings.name = "hal top";
    for (std::string word; from >> word;) {
        const auto equals = std::min(word.find('='), word.size());
        const std::string key = word.substr(0, equals);

        const std::string value = word.substr(std::min(equals + 1, word.size()));
        if (key == "domain") {
            const auto [end, error] =
                std::from_chars(value.data(), value.data() + value.size(), settings.domain);
            if (error != std::errc{} || end != value.data() + value.size()) {
                throw std::invalid_argument("'" + word + "': write domain=NUMBER, 0..232");
            }
        } else if (key == "shared_memory" && (value == "0" || value == "1")) {
            settings.shared_memory = value == "1";
        } else if (key == "interfaces") {
            settings.interfaces = list_of(value);
        } else if (key == "peers") {
            settings.peers = list_of(value);
        } else if (key == "server") {
            settings.servers = list_of(value);
        } else if (key == "profile") {
            settings.profile = value;
        } else if (key == "security") {
            settings.security = value;
        } else {
            throw std::invalid_argument(
                "invalid setting '" + word +
                "'; the settings are domain= interfaces= peers= server= shared_memory=0 or 1, "
                "profile= security=");
        }
    }
    return settings;
}

}  // namespace

std::shared_ptr<Beacon> beacon(const std::shared_ptr<Participant>& participant,
                               const hal_status* host) {
    const std::lock_guard lock(beacons().mutex);
    std::weak_ptr<Beacon>& known = beacons().all[participant.get()];
    std::shared_ptr<Beacon> one = known.lock();
    if (!one) {
        known = one = std::make_shared<StatusBeacon>(participant, host);
    }
    return one;
}

}  // namespace hal::dds

void* halcyon_status_open(const char* settings, void (*heard)(void*, const char*, std::size_t),
                          void* user, char* problem) {
    try {
        return new hal::dds::StatusReader(hal::dds::settings_of(settings), heard, user);
    } catch (const std::exception& why) {
        std::strncpy(problem, why.what(), 255);
        problem[255] = 0;
        return nullptr;
    }
}
void halcyon_status_close(void* reader) { delete static_cast<hal::dds::StatusReader*>(reader); }
