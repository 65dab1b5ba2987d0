// SPDX-License-Identifier: MIT
#include "participant.hpp"

#include <algorithm>
#include <memory>
#include <mutex>
#include <vector>

#include "participant_impl.hpp"

namespace hal::dds {
namespace {

/// The open participants. Never destroyed, see pump.cpp.
struct Participants {
    std::mutex mutex;
    std::vector<std::weak_ptr<engine::ParticipantImpl>> all;
};
Participants& participants() {
    static Participants& one = *new Participants;
    return one;
}

}  // namespace

std::shared_ptr<Participant> open(const Settings& s) {
    Participants& known = participants();
    const std::lock_guard lock(known.mutex);
    prepare_library();
    std::erase_if(known.all, [](const auto& w) { return w.expired(); });
    const auto same = [&s](const Settings& x) {
        Settings wanted = s;
        wanted.name = x.name;
        return wanted == x;
    };
    for (const auto& w : known.all) {
        if (auto p = w.lock(); p && same(p->settings())) return p;
    }
    auto p = std::make_shared<engine::ParticipantImpl>(s);
    known.all.push_back(p);
    return p;
}

bool announce_anew() noexcept {
    std::vector<std::shared_ptr<engine::ParticipantImpl>> all;  // destroyed without the lock
    {
        const std::lock_guard lock(participants().mutex);
        for (const auto& w : participants().all) {
            if (auto p = w.lock()) {
                all.push_back(std::move(p));
            }
        }
    }
    bool good = true;
    for (const auto& p : all) {
        good = p->renew() && good;
    }
    return good;
}

}  // namespace hal::dds
