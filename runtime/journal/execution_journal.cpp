// SPDX-License-Identifier: MIT
#include "journal/execution_journal.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <ctime>

#include <sys/resource.h>
#include <unistd.h>

#include "hal/clock.hpp"
#include "journal/file_hash.hpp"
#include "journal/journal_format.hpp"
#include "journal/journal_join.hpp"
#include "model/model.hpp"
#include "recording/mcap/bytes.hpp"

namespace hal {
namespace {

constexpr auto drain_every = std::chrono::milliseconds(20);
constexpr std::int64_t batch_ns = 200'000'000;  // of cycles in a batch
constexpr std::size_t batch_bytes = std::size_t{1} << 16;
constexpr std::int64_t flush_every_ns = 1'000'000'000;

std::int64_t offset_to_unix_ns() {
    timespec real{};
    clock_gettime(CLOCK_REALTIME, &real);
    return std::int64_t{real.tv_sec} * 1'000'000'000 + real.tv_nsec - monotonic_ns();
}

/// Two seconds of cycles that read little, one of those that receive a full Ethernet frame each.
std::size_t ring_words(std::int64_t period_ns) {
    constexpr std::int64_t seconds_ns = 2'000'000'000;
    constexpr std::int64_t words_per_cycle = 32;
    constexpr std::int64_t min_words = std::int64_t{1} << 18;
    constexpr std::int64_t max_words = std::int64_t{1} << 22;
    const std::int64_t words = seconds_ns / std::max<std::int64_t>(period_ns, 1) * words_per_cycle;
    return static_cast<std::size_t>(std::clamp(words, min_words, max_words));
}

}  // namespace

ExecutionJournal::ExecutionJournal(const std::string& path, const JournalOrigin& origin)
    : origin_(origin), unix_offset_ns_(offset_to_unix_ns()) {
    open(path);
    if (writer_->error() != 0) return;
    worker_ = std::thread([this] { work(); });
}

void ExecutionJournal::open(const std::string& path) {
    writer_ = std::make_unique<mcap::Writer>(path);
    if (writer_->error() != 0) return;
    writer_->metadata("halcyon", {{"instance", origin_.instance},
                                  {"version", origin_.version},
                                  {"unix_offset_ns", std::to_string(unix_offset_ns_)}});
    writer_->metadata(journal_format::head, {{"format", std::string(journal_format::version)},
                                             {"version", origin_.version},
                                             {"commit", origin_.commit},
                                             {"program", file_hash("/proc/self/exe")},
                                             {"unix_offset_ns", std::to_string(unix_offset_ns_)}});
    entries_ = writer_->add_channel(
        writer_->add_schema("halcyon.JournalEntry", "jsonschema", journal_format::entry_schema),
        journal_format::entries_topic, "json", {});
    setup_ = writer_->add_channel(
        writer_->add_schema(journal_format::setup_type, "ros2msg", journal_format::setup_schema),
        journal_format::setup_topic, "cdr", {});
    cycles_schema_ =
        writer_->add_schema(journal_format::cycles_type, "ros2msg", journal_format::cycles_schema);
    for (const auto& thread : threads_) {
        declare(*thread);
    }
}

void ExecutionJournal::declare(Thread& thread) {
    thread.channel = writer_->add_channel(
        cycles_schema_, std::string(journal_format::cycles_topic) + std::to_string(thread.id),
        "cdr",
        {{"journaled_thread", thread.name},
         {"number", std::to_string(thread.id)},
         {"journaled_period_ns", std::to_string(thread.period_ns)}});
}

ExecutionJournal::FastestThread ExecutionJournal::continue_in(const std::string& path) {
    const std::scoped_lock own(mutex_);
    FastestThread fastest;
    for (const auto& thread : threads_) {
        write_batch(*thread);
        if (fastest.period_ns == 0 || thread->period_ns < fastest.period_ns) {
            fastest = {thread->period_ns, thread->newest};
        }
    }
    writer_->close();
    if (writer_->error() == 0) {
        open(path);
    }
    return fastest;
}

void ExecutionJournal::flush() {
    const std::scoped_lock own(mutex_);
    note_halt();
    for (const auto& thread : threads_) {
        thread->inputs->take(thread->words);
        encode(*thread);
        write_batch(*thread);
    }
    writer_->flush();
}

ExecutionJournal::~ExecutionJournal() { close(); }

std::uint64_t ExecutionJournal::unix_ns(std::int64_t monotonic_ns) const {
    return static_cast<std::uint64_t>(monotonic_ns + unix_offset_ns_);
}

CycleInputs* ExecutionJournal::thread_made(const std::string& name, std::int64_t period_ns,
                                           std::uint32_t id) {
    const std::scoped_lock own(mutex_);
    auto thread = std::make_unique<Thread>();
    thread->name = name;
    thread->id = id;
    thread->period_ns = period_ns;
    thread->inputs = std::make_unique<CycleInputs>(ring_words(period_ns));
    declare(*thread);
    threads_.push_back(std::move(thread));
    return threads_.back()->inputs.get();
}

void ExecutionJournal::add(ExecutionEntry entry) {
    const std::scoped_lock own(mutex_);
    note_halt();
    write(entry);
}

/// A halt is noted before the next entry, and at the latest with the next cycles.
void ExecutionJournal::note_halt() {
    if (is_halt_unnoted_.exchange(false)) {
        write({.kind = ExecutionEntry::Kind::stop});
    }
}

void ExecutionJournal::write(const ExecutionEntry& entry) {
    writer_->message(entries_, entry_count_++, unix_ns(monotonic_ns()), to_json(entry));
}

namespace {

ExecutionEntry entry_of(ExecutionEntry::Kind kind, JournaledTransaction transaction) {
    ExecutionEntry entry{.kind = kind, .epoch = transaction.epoch};
    entry.commands = std::move(transaction.commands);
    entry.starts = transaction.starts;
    entry.calls = std::move(transaction.calls);
    return entry;
}

}  // namespace

void ExecutionJournal::edited(JournaledTransaction transaction, const Model& model) {
    ExecutionEntry entry = entry_of(ExecutionEntry::Kind::edit, std::move(transaction));
    const auto loads = [](const std::vector<std::string>& words) {
        const std::string& name = words.front();
        return name == "loadrt" || name == "reload" || name == "newinst" || name == "loadusr";
    };
    if (std::ranges::any_of(entry.commands, loads)) {
        for (const auto& component : model.components) {
            if (component->path.empty()) continue;
            const std::string hash = file_hash(component->path);
            if (files_.insert({component->path, hash}).second) {
                entry.files.push_back({component->name, component->path, hash});
            }
        }
    }
    add(std::move(entry));
}

void ExecutionJournal::withdrawn(JournaledTransaction transaction) {
    add(entry_of(ExecutionEntry::Kind::withdrawn, std::move(transaction)));
}

void ExecutionJournal::rejected(JournaledTransaction transaction) {
    add(entry_of(ExecutionEntry::Kind::rejected, std::move(transaction)));
}

void ExecutionJournal::written(std::vector<std::pair<std::string, std::uint64_t>> values) {
    if (values.empty()) return;
    ExecutionEntry entry{.kind = ExecutionEntry::Kind::written};
    entry.values = std::move(values);
    add(std::move(entry));
}

void ExecutionJournal::switched(bool running) {
    add({.kind = running ? ExecutionEntry::Kind::start : ExecutionEntry::Kind::stop});
}

void ExecutionJournal::add(const SetupRecord& record) {
    const std::scoped_lock own(mutex_);
    writer_->message(setup_, setup_count_++, unix_ns(monotonic_ns()), to_cdr(record));
}

void ExecutionJournal::called(const SetupResults& results) {
    add({.kind = SetupRecord::call,
         .name = results.call,
         .results = results.links,
         .readings = results.readings});
}

void ExecutionJournal::file_read(const SetupFile& file) {
    SetupRecord record{.kind = SetupRecord::file};
    record.error = static_cast<std::uint32_t>(file.error);
    record.name = file.path;
    if (file.error == 0) {
        record.hash = text_hash(file.bytes);
    }
    if (contents_.insert(record.hash).second) {
        record.results = file.bytes;
    }
    add(record);
}

void ExecutionJournal::opened(const std::string& instance, const std::string& component,
                              const OutsideWorld& outside) {
    ExecutionEntry entry{.kind = ExecutionEntry::Kind::opened};
    entry.instance = instance;
    entry.component = component;
    entry.resources = outside.files;
    entry.threads = outside.threads;
    entry.helpers = outside.helpers;
    entry.links = outside.links;
    entry.streams = outside.streams;
    add(std::move(entry));
}

std::string ExecutionJournal::save(const std::string& path) {
    std::function<std::string(const std::string& path)> call;
    {
        const std::scoped_lock own(mutex_);
        call = save_;
    }
    if (call) return call(path);
    const std::scoped_lock one_at_a_time(saving_);
    flush();
    return join_journals({where()}, path);
}

void ExecutionJournal::sampled(std::vector<std::string> names) {
    ExecutionEntry entry{.kind = ExecutionEntry::Kind::sampled};
    entry.names = std::move(names);
    add(std::move(entry));
}

void ExecutionJournal::attach(const std::string& name, const std::string& text) {
    const std::scoped_lock own(mutex_);
    writer_->attachment(name, "text/plain", text, unix_ns(monotonic_ns()));
}

void ExecutionJournal::work() {
    // other programs must not make it late, so that a buffer overflows; where that is not allowed,
    // it goes on without
    ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), -10);
    std::unique_lock own(mutex_);
    while (!ends_) {
        wake_.wait_for(own, drain_every);
        drain();
        report_failure();
    }
}

void ExecutionJournal::report_failure() {
    if (!failed_) return;
    const std::string why = reason();
    if (why.empty()) return;
    failed_(why);
    failed_ = nullptr;
}

void ExecutionJournal::drain() {
    note_halt();
    const std::int64_t now_ns = monotonic_ns();
    for (const auto& thread : threads_) {
        thread->inputs->take(thread->words);
        encode(*thread);
        const bool is_old =
            thread->encoder.records() > 0 && now_ns - thread->batch_begin_ns > batch_ns;
        if (ends_ || is_old) {
            write_batch(*thread);
        }
    }
    if (now_ns - flushed_ns_ > flush_every_ns) {
        flushed_ns_ = now_ns;
        writer_->flush();
    }
}

void ExecutionJournal::encode(Thread& thread) {
    const std::vector<std::uint64_t>& words = thread.words;
    for (std::size_t at = 0; at < words.size();) {
        const CycleRecord record = CycleInputs::record_at(&words[at]);
        at += CycleInputs::head_words;
        if (thread.encoder.records() == 0) {
            thread.batch_begin_ns = record.woke_ns;
        }
        thread.newest_ns = record.woke_ns;
        thread.newest = record.number;
        thread.encoder.add(record, std::span(words).subspan(at, record.notes));
        at += record.notes;
        ++cycles_;
        if (thread.encoder.bytes() >= batch_bytes) {
            write_batch(thread);
        }
    }
    thread.words.clear();
}

void ExecutionJournal::write_batch(Thread& thread) {
    if (thread.encoder.records() == 0) return;
    std::string payload("\0\1\0\0", 4);  // CDR, little-endian
    mcap::put(payload, static_cast<std::uint32_t>(thread.encoder.records()));
    mcap::put_text(payload, thread.encoder.take());
    writer_->message(thread.channel, thread.batches++, unix_ns(thread.newest_ns), payload);
}

bool ExecutionJournal::close() {
    if (worker_.joinable()) {
        {
            const std::scoped_lock own(mutex_);
            ends_ = true;
        }
        wake_.notify_one();
        worker_.join();
        add({.kind = ExecutionEntry::Kind::end});
    }
    const std::scoped_lock own(mutex_);
    if (!closed_) {
        closed_ = true;
        writer_->close();
    }
    return writer_->error() == 0;
}

std::string ExecutionJournal::problem() const {
    const std::scoped_lock own(mutex_);
    return reason();
}

std::string ExecutionJournal::reason() const {
    if (!writer_->problem().empty()) return writer_->problem();
    if (writer_->error() != 0) return std::strerror(writer_->error());
    return "";
}

std::vector<std::pair<std::string, std::uint64_t>> ExecutionJournal::lost() const {
    const std::scoped_lock own(mutex_);
    std::vector<std::pair<std::string, std::uint64_t>> found;
    for (const auto& thread : threads_) {
        if (const std::uint64_t lost = thread->inputs->lost(); lost > 0) {
            found.emplace_back(thread->name, lost);
        }
    }
    return found;
}

}  // namespace hal
