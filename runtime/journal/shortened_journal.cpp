// SPDX-License-Identifier: MIT
#include "journal/shortened_journal.hpp"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "journal/journal_copy.hpp"
#include "journal/journal_file.hpp"

namespace hal {
namespace {

constexpr std::size_t batch_bytes = std::size_t{1} << 16;

std::uint64_t first_time(JournalFile& file) {
    std::int64_t begin = INT64_MAX;
    for (auto& [number, thread] : file.threads()) {
        if (thread.record()) {
            begin = std::min(begin, thread.record()->woke_ns);
        }
    }
    const bool has_none = begin == INT64_MAX;
    return has_none ? 0 : static_cast<std::uint64_t>(begin + file.unix_offset_ns());
}

/// Adds the first `count` records, in batches of their own.
void add_first(JournalCopy& copy, JournalFile& file, JournaledThread& thread, std::uint64_t count) {
    CycleEncoder encoder;
    JournaledBatch batch;
    const auto add_batch = [&] {
        batch.count = static_cast<std::uint32_t>(encoder.records());
        if (batch.count == 0) return;
        batch.records = encoder.take();
        copy.add(thread, batch);
        ++batch.sequence;
    };
    for (std::uint64_t i = 0; i < count && thread.record(); ++i, thread.next()) {
        batch.unix_ns =
            static_cast<std::uint64_t>(thread.record()->woke_ns + file.unix_offset_ns());
        encoder.add(*thread.record(), thread.notes());
        if (encoder.bytes() >= batch_bytes) {
            add_batch();
        }
    }
    add_batch();
}

/// Whether a machine without cycles needs it: values are in the state.
bool makes_machine(const ExecutionEntry& entry) {
    if (entry.kind == ExecutionEntry::Kind::opened) return true;
    if (entry.kind == ExecutionEntry::Kind::rejected) return true;  // its memory was allocated, too
    if (entry.kind != ExecutionEntry::Kind::edit) return false;
    return std::ranges::any_of(entry.commands, [](const std::vector<std::string>& words) {
        return words.empty() || (words.front() != "setp" && words.front() != "sets");
    });
}

}  // namespace

std::string write_shortened(const std::string& from, const std::string& to,
                            const JournalProgress& progress) {
    JournalFile file;
    if (!file.open(from)) return file.problem();
    JournalCopy copy(file, to);
    copy.set_time(first_time(file));
    const auto& entries = file.entries();
    std::optional<JournalBegin> begin = file.begin();
    if (begin) {
        begin->next_entry = begin->entries;
        begin->batches.clear();
        for (const auto& [number, thread] : file.threads()) {
            begin->batches[number] = 0;
        }
        copy.add(*begin);
    }
    std::uint32_t sequence = 0;
    for (std::size_t i = 0; i < std::min(progress.entries, entries.size()); ++i) {
        const bool is_kept = entries[i].kind != ExecutionEntry::Kind::sampled &&
                             entries[i].kind != ExecutionEntry::Kind::end;
        if (is_kept) {
            copy.add(entries[i], sequence++);
        }
    }
    copy.add({.kind = ExecutionEntry::Kind::end}, sequence);
    copy.add_setup();
    for (auto& [number, thread] : file.threads()) {
        const auto executed = progress.records.find(number);
        add_first(copy, file, thread, executed == progress.records.end() ? 0 : executed->second);
    }
    return copy.close();
}

std::string write_remaining(JournalFile& file, const std::string& to,
                            const JournalProgress& progress, std::string state) {
    JournalCopy copy(file, to);
    copy.set_time(first_time(file));
    const auto& entries = file.entries();
    std::vector<const ExecutionEntry*> before;
    for (std::size_t i = 0; i < std::min(progress.entries, entries.size()); ++i) {
        if (makes_machine(entries[i])) {
            before.push_back(&entries[i]);
        }
    }
    JournalBegin begin{.entries = static_cast<std::uint32_t>(before.size()),
                       .next_entry = file.sequence_of(progress.entries),
                       .batches = {},
                       .state = std::move(state)};
    for (const auto& [number, thread] : file.threads()) {
        begin.batches[number] = thread.sequence();
    }
    copy.add(begin);
    std::uint32_t sequence = 0;
    for (const ExecutionEntry* const entry : before) {
        copy.add(*entry, sequence++);
    }
    for (std::size_t i = progress.entries; i < entries.size(); ++i) {
        ExecutionEntry entry = entries[i];
        entry.names.clear();  // no recorded values
        copy.add(entry, file.sequence_of(i));
    }
    copy.add_setup();
    for (auto& [number, thread] : file.threads()) {
        for (const JournaledBatch& batch : thread.take_remaining()) {
            copy.add(thread, batch);
        }
    }
    return copy.close();
}

}  // namespace hal
