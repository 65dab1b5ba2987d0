// SPDX-License-Identifier: MIT
#include "journal/keyframes.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <fcntl.h>
#include <limits>
#include <new>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <system_error>
#include <unistd.h>

#include "machine/report/crash.hpp"

namespace hal {

struct Keyframes::Slot {
    pid_t process = 0;  // 0: free
    KeyframeMark mark;
};

struct Keyframes::Shared {
    std::atomic<pid_t> active{0};  // the process that has to answer the front
    std::atomic<bool> interrupted{false};
    Slot slots[capacity];
    alignas(std::max_align_t) unsigned char errand[errand_bytes] = {};
};

namespace {

void make_pipe(int (&ends)[2]) {
    if (::pipe2(ends, O_CLOEXEC) != 0) {
        throw std::system_error(errno, std::generic_category(), "pipe");
    }
}

void close_end(int& descriptor) {
    if (descriptor >= 0) {
        ::close(descriptor);
    }
    descriptor = -1;
}

}  // namespace

Keyframes::Keyframes() : wakeups_(capacity), front_(::getpid()) {
    void* const memory =
        ::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) {
        throw std::system_error(errno, std::generic_category(), "mmap");
    }
    shared_ = new (memory) Shared;
    make_pipe(life_);
    for (Wakeup& wakeup : wakeups_) {
        make_pipe(wakeup.ends);
    }
}

Keyframes::~Keyframes() {
    if (::getpid() == front_) {
        close_end(life_[1]);
        for (const Slot& slot : shared_->slots) {
            if (slot.process != 0) {
                ::kill(slot.process, SIGKILL);
            }
        }
        if (const pid_t active = shared_->active.load(); active > 0) {
            ::kill(active, SIGKILL);
        }
        while (::waitpid(-1, nullptr, 0) > 0 || errno == EINTR) {
        }
    }
    close_end(life_[0]);
    close_end(life_[1]);
    for (Wakeup& wakeup : wakeups_) {
        close_end(wakeup.ends[0]);
        close_end(wakeup.ends[1]);
    }
    ::munmap(shared_, sizeof(Shared));
}

void* Keyframes::errand_memory() noexcept { return shared_->errand; }

pid_t Keyframes::start() {
    // what a process leaves behind becomes a child of the front, which waits for it at the end
    ::prctl(PR_SET_CHILD_SUBREAPER, 1);
    const pid_t child = ::fork();
    if (child == 0) {
        close_end(life_[1]);
        shared_->active = ::getpid();
        ::setpgid(0, 0);  // Ctrl-C is for the front
        return 0;
    }
    if (child > 0) {
        shared_->active = child;
    }
    return child;
}

bool Keyframes::alive() {
    while (::waitpid(-1, nullptr, WNOHANG) > 0) {
    }
    const pid_t active = shared_->active.load();
    // the one that hands over names its successor before it ends
    return ::kill(active, 0) == 0 || shared_->active.load() != active;
}

void Keyframes::interrupt(bool on) noexcept { shared_->interrupted = on; }

bool Keyframes::interrupted() const noexcept {
    return shared_->interrupted.load(std::memory_order_relaxed);
}

bool Keyframes::front_lives() const {
    pollfd life{life_[0], POLLIN, 0};
    return ::poll(&life, 1, 0) == 0;
}

/// Drops the keyframe whose absence costs least: the gap that it would leave, in relation to its
/// distance from the present. The first one stays.
std::size_t Keyframes::free_slot(std::uint64_t cycles) {
    Slot* const slots = shared_->slots;
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < capacity; ++i) {
        if (slots[i].process == 0) return i;
        order.push_back(i);
    }
    std::ranges::sort(order, {}, [slots](std::size_t i) { return slots[i].mark.cycles; });
    std::size_t chosen = order.back();
    double min = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i + 1 < order.size(); ++i) {
        const auto at = static_cast<double>(slots[order[i]].mark.cycles);
        const auto gap =
            static_cast<double>(slots[order[i + 1]].mark.cycles - slots[order[i - 1]].mark.cycles);
        const double distance = std::abs(static_cast<double>(cycles) - at) + 1;
        if (gap / distance < min) {
            min = gap / distance;
            chosen = order[i];
        }
    }
    drop(slots[chosen]);
    return chosen;
}

void Keyframes::drop(Slot& slot) {
    ::kill(slot.process, SIGKILL);
    dropped_.push_back(slot.process);
    slot.process = 0;
}

void Keyframes::reap() {
    // those of another process are waited for there
    std::erase_if(dropped_,
                  [](pid_t process) { return ::waitpid(process, nullptr, WNOHANG) != 0; });
}

bool Keyframes::keep(const KeyframeMark& mark) {
    reap();
    const bool has_one = std::ranges::any_of(shared_->slots, [&mark](const Slot& slot) {
        return slot.process != 0 && slot.mark.cycles == mark.cycles;
    });
    if (has_one) return false;
    const std::size_t index = free_slot(mark.cycles);
    const pid_t copy = ::fork();
    if (copy == 0) return wait_in(index);
    if (copy > 0) {  // otherwise going back costs more
        shared_->slots[index].mark = mark;
        shared_->slots[index].process = copy;
    }
    return false;
}

/// Returns true in a process that continues.
bool Keyframes::wait_in(std::size_t slot) {
    dropped_.clear();
    const auto before = std::signal(SIGCHLD, SIG_IGN);  // who continues is not waited for
    pollfd events[] = {{wakeups_[slot].ends[0], POLLIN, 0}, {life_[0], POLLIN, 0}};
    for (;;) {
        if (::poll(events, 2, -1) < 0) continue;
        char byte = 0;
        if (events[1].revents != 0) end_process(0);
        if (::read(wakeups_[slot].ends[0], &byte, 1) != 1) continue;
        const pid_t copy = ::fork();
        if (copy > 0) continue;
        if (copy < 0) {
            shared_->slots[slot].process = 0;  // the keyframe itself continues
        }
        shared_->active = ::getpid();
        std::signal(SIGCHLD, before);
        return true;
    }
}

const Keyframes::Slot* Keyframes::find(
    const std::function<bool(const KeyframeMark&)>& suits) const {
    const Slot* found = nullptr;
    for (const Slot& slot : shared_->slots) {
        if (slot.process == 0 || !suits(slot.mark)) continue;
        if (!found || slot.mark.cycles > found->mark.cycles) {
            found = &slot;
        }
    }
    return found;
}

std::optional<std::uint64_t> Keyframes::newest(
    const std::function<bool(const KeyframeMark&)>& suits) const {
    const Slot* const slot = find(suits);
    if (!slot) return std::nullopt;
    return slot->mark.cycles;
}

void Keyframes::resume(const std::function<bool(const KeyframeMark&)>& suits) {
    const Slot* const slot = find(suits);
    if (!slot) return;
    const char byte = 1;
    shared_->active = slot->process;
    if (::write(wakeups_[static_cast<std::size_t>(slot - shared_->slots)].ends[1], &byte, 1) != 1) {
        shared_->active = ::getpid();
        return;
    }
    end_process(0);
}

}  // namespace hal
