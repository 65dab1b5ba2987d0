// SPDX-License-Identifier: MIT
#include "machine/run/setup_journal.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <utility>

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "execute/core.hpp"
#include "machine/load/setup_call.hpp"
#include "machine/run/execution_sink.hpp"
#include "model/model.hpp"

namespace hal {
namespace {

std::atomic<SetupJournal*> journal_of_process{nullptr};  // written in setup
std::atomic<std::uint64_t> next_call_ticket{0};

/// A re-execution reads larger files again: they are hardly configurations.
constexpr off_t max_file_bytes = off_t{64} << 20;

}  // namespace

SetupJournal::SetupJournal(CycleSchedule* schedule) : schedule_(schedule) {
    next_call_ticket = 0;
    journal_of_process = this;
    set_setup_reader(this);
}

SetupJournal::~SetupJournal() {
    SetupJournal* own = this;
    if (journal_of_process.compare_exchange_strong(own, nullptr)) {
        set_setup_reader(nullptr);
    }
}

SetupJournal* SetupJournal::current() noexcept {
    SetupJournal* const journal = journal_of_process.load(std::memory_order_acquire);
    return journal && !Core::current() && SetupCall::is_mine() ? journal : nullptr;
}

bool SetupJournal::begin_call() {
    const SetupCallNow& now = SetupCall::now;
    const std::int64_t since_ns = now.since_ns.load();
    if (std::exchange(call_since_ns_, since_ns) == since_ns) return has_results_;
    std::string call = std::string(now.instance) + " " + now.what.load();
    links_at_ = 0;
    readings_at_ = 0;
    has_results_ = true;
    if (!schedule_) {
        calls_.push_back({std::move(call), {}, {}});
        return true;
    }
    std::optional<SetupResults> found = schedule_->results_of(call);
    has_results_ = found.has_value();
    results_ = std::move(found).value_or(SetupResults{});
    return has_results_;
}

void SetupJournal::put(const void* bytes, std::size_t size) {
    begin_call();
    calls_.back().links.append(static_cast<const char*>(bytes), size);
}

bool SetupJournal::get(void* bytes, std::size_t size) {
    begin_call();
    if (size > results_.links.size() - links_at_) {
        links_at_ = results_.links.size();
        std::memset(bytes, 0, size);
        return false;
    }
    std::memcpy(bytes, results_.links.data() + links_at_, size);
    links_at_ += size;
    return true;
}

void SetupJournal::order_call(std::uint64_t ticket) {
    if (!schedule_) {
        ordered_.push_back(ticket);
        return put(&ticket, sizeof ticket);
    }
    if (get(&ticket, sizeof ticket)) {
        schedule_->wait_for_setup_call(ticket);
    }
}

bool SetupJournal::hide_readings(bool hidden) { return std::exchange(hidden_, hidden); }

void SetupJournal::begin_link() {
    before_link_.emplace();
    streams_before_link_ = starting_ ? starting_->streams.size() : 0;
}

void SetupJournal::end_link() {
    if (!before_link_) return;
    OutsideWorld found = before_link_->result();
    before_link_.reset();
    acquired_.threads += found.threads;
    ++acquired_.links;
    if (starting_) {
        acquired_.streams += starting_->streams.size() - streams_before_link_;
    }
    std::ranges::move(found.files, std::back_inserter(acquired_.files));
}

void SetupJournal::flush(ExecutionSink& sink) {
    for (const SetupFile& file : files_) {
        sink.file_read(file);
    }
    for (const SetupResults& results : calls_) {
        sink.called(results);
    }
    forget();
}

void SetupJournal::forget() {
    ordered_.clear();
    calls_.clear();
    files_.clear();
    call_since_ns_ = 0;
}

std::int64_t SetupJournal::reading(std::int64_t value) {
    if (hidden_ || Core::current()) return value;
    begin_call();
    if (!schedule_) {
        calls_.back().readings.append(reinterpret_cast<const char*>(&value), sizeof value);
        return value;
    }
    if (results_.readings.size() - readings_at_ < sizeof value) return value;
    std::memcpy(&value, results_.readings.data() + readings_at_, sizeof value);
    readings_at_ += sizeof value;
    return value;
}

int SetupJournal::opened(const char* path, int (*open_now)(const char*, int), int flags) {
    if (hidden_) return open_now(path, flags);
    if (!schedule_) return record_file(path, open_now(path, flags));
    const SetupFile* const file = schedule_->file_of(path);
    return file ? descriptor_of(*file) : open_now(path, flags);
}

/// Returns the descriptor; errno is that of the failure.
int SetupJournal::record_file(const char* path, int descriptor) {
    const int error = errno;
    if (descriptor < 0) {
        files_.push_back({path, error});
        errno = error;
        return descriptor;
    }
    struct stat about{};
    if (::fstat(descriptor, &about) != 0 || !S_ISREG(about.st_mode) ||
        about.st_size > max_file_bytes) {
        return descriptor;
    }
    SetupFile file{path, 0, std::string(static_cast<std::size_t>(about.st_size), '\0')};
    const ssize_t got = ::pread(descriptor, file.bytes.data(), file.bytes.size(), 0);
    if (got == about.st_size) {
        files_.push_back(std::move(file));
    }
    return descriptor;
}

int SetupJournal::descriptor_of(const SetupFile& file) {
    if (file.error != 0) {
        errno = file.error;
        return -1;
    }
    const int descriptor = ::memfd_create("journaled", MFD_CLOEXEC);
    if (descriptor < 0) return -1;
    const char* at = file.bytes.data();
    for (std::size_t left = file.bytes.size(); left > 0;) {
        const ssize_t written = ::write(descriptor, at, left);
        if (written <= 0) {
            ::close(descriptor);
            errno = ENOSPC;
            return -1;
        }
        at += written;
        left -= static_cast<std::size_t>(written);
    }
    ::lseek(descriptor, 0, SEEK_SET);
    return descriptor;
}

}  // namespace hal

// --- what drivers call: drivers/link/call_journal.hpp ---

namespace {

enum Mode : int { not_journaled, records, executes_again };

hal::CycleInputs* results_of_cycle() noexcept {
    hal::Core* const core = hal::Core::current();
    return core ? core->results() : nullptr;
}

}  // namespace

extern "C" {

[[gnu::visibility("default")]] int hal_journal_mode() noexcept {
    if (const hal::CycleInputs* const inputs = results_of_cycle()) {
        return inputs->replays() ? executes_again : records;
    }
    const hal::SetupJournal* const setup = hal::SetupJournal::current();
    if (!setup) return not_journaled;
    return setup->replays() ? executes_again : records;
}

[[gnu::visibility("default")]] void hal_journal_put(const void* bytes, std::size_t size) noexcept {
    if (hal::CycleInputs* const inputs = results_of_cycle()) {
        inputs->put(bytes, size);
    } else if (hal::SetupJournal* const setup = hal::SetupJournal::current()) {
        setup->put(bytes, size);
    }
}

[[gnu::visibility("default")]] int hal_journal_get(void* bytes, std::size_t size) noexcept {
    if (hal::CycleInputs* const inputs = results_of_cycle()) return inputs->get(bytes, size);
    hal::SetupJournal* const setup = hal::SetupJournal::current();
    return setup && setup->get(bytes, size) ? 1 : 0;
}

[[gnu::visibility("default")]] void hal_journal_differs(const char* link) noexcept {
    if (hal::CycleInputs* const inputs = results_of_cycle()) {
        inputs->differs(link);
    }
}

[[gnu::visibility("default")]] int hal_journal_hide(int hidden) noexcept {
    if (hal::Core* const core = hal::Core::current()) return core->hide_readings(hidden != 0);
    hal::SetupJournal* const setup = hal::SetupJournal::current();
    return setup && setup->hide_readings(hidden != 0) ? 1 : 0;
}

[[gnu::visibility("default")]] void hal_journal_order() noexcept {
    const auto ticket = [](bool replays) noexcept {
        return replays ? std::uint64_t{0} : hal::next_call_ticket.fetch_add(1);
    };
    if (hal::CycleInputs* const inputs = results_of_cycle()) {
        inputs->order_call(ticket(inputs->replays()));
    } else if (hal::SetupJournal* const setup = hal::SetupJournal::current()) {
        setup->order_call(ticket(setup->replays()));
    }
}

[[gnu::visibility("default")]] unsigned hal_journal_thread() noexcept {
    const hal::Core* const core = hal::Core::current();
    return core ? core->id() + 1 : 0;
}

[[gnu::visibility("default")]] void hal_journal_link(int begins) noexcept {
    hal::SetupJournal* const setup = hal::SetupJournal::current();
    if (!setup) return;
    if (begins != 0) {
        setup->begin_link();
    } else {
        setup->end_link();
    }
}

}  // extern "C"
