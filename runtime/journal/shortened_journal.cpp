// SPDX-License-Identifier: MIT
#include "journal/shortened_journal.hpp"

#include <algorithm>
#include <cstring>

#include "journal/journal_file.hpp"
#include "journal/journal_format.hpp"
#include "recording/mcap/bytes.hpp"
#include "recording/mcap/writer.hpp"

namespace hal {
namespace {

constexpr std::size_t batch_bytes = std::size_t{1} << 16;

class ShortenedJournal {
public:
    ShortenedJournal(JournalFile& file, const std::string& to) : file_(file), writer_(to) {}

    std::string write(const JournalProgress& progress) {
        writer_.metadata(journal_format::head, file_.head());
        const auto schema = writer_.add_schema(journal_format::cycles_type, "ros2msg",
                                               journal_format::cycles_schema);
        write_entries(progress.entries);
        for (auto& [number, thread] : file_.threads()) {
            const auto executed = progress.records.find(number);
            write_cycles(schema, thread, executed == progress.records.end() ? 0 : executed->second);
        }
        writer_.close();
        if (!writer_.problem().empty()) return writer_.problem();
        return writer_.error() == 0 ? "" : std::strerror(writer_.error());
    }

private:
    void write_entries(std::size_t count) {
        const auto channel = writer_.add_channel(
            writer_.add_schema("halcyon.JournalEntry", "jsonschema", journal_format::entry_schema),
            journal_format::entries_topic, "json", {});
        std::uint32_t sequence = 0;
        const auto add = [&](const ExecutionEntry& entry) {
            writer_.message(channel, sequence++, begin_ns(), to_json(entry));
        };
        const auto& entries = file_.entries();
        for (std::size_t i = 0; i < std::min(count, entries.size()); ++i) {
            const bool is_kept = entries[i].kind != ExecutionEntry::Kind::sampled &&
                                 entries[i].kind != ExecutionEntry::Kind::end;
            if (is_kept) {
                add(entries[i]);
            }
        }
        add({.kind = ExecutionEntry::Kind::end});
    }

    void write_cycles(std::uint16_t schema, JournaledThread& thread, std::uint64_t count) {
        const auto channel = writer_.add_channel(
            schema, std::string(journal_format::cycles_topic) + std::to_string(thread.number),
            "cdr",
            {{"journaled_thread", thread.name},
             {"number", std::to_string(thread.number)},
             {"journaled_period_ns", std::to_string(thread.period_ns)}});
        CycleEncoder encoder;
        std::uint32_t batches = 0;
        std::int64_t newest_ns = 0;
        const auto write_batch = [&] {
            if (encoder.records() == 0) return;
            std::string payload("\0\1\0\0", 4);  // CDR, little-endian
            mcap::put(payload, static_cast<std::uint32_t>(encoder.records()));
            mcap::put_text(payload, encoder.take());
            writer_.message(channel, batches++,
                            static_cast<std::uint64_t>(newest_ns + file_.unix_offset_ns()),
                            payload);
        };
        for (std::uint64_t i = 0; i < count && thread.record(); ++i, thread.next()) {
            newest_ns = thread.record()->woke_ns;
            encoder.add(*thread.record(), thread.notes());
            if (encoder.bytes() >= batch_bytes) {
                write_batch();
            }
        }
        write_batch();
    }

    std::uint64_t begin_ns() {
        std::int64_t begin = INT64_MAX;
        for (auto& [number, thread] : file_.threads()) {
            if (thread.record()) {
                begin = std::min(begin, thread.record()->woke_ns);
            }
        }
        const bool has_none = begin == INT64_MAX;
        return has_none ? 0 : static_cast<std::uint64_t>(begin + file_.unix_offset_ns());
    }

    JournalFile& file_;
    mcap::Writer writer_;
};

}  // namespace

std::string write_shortened(const std::string& from, const std::string& to,
                            const JournalProgress& progress) {
    JournalFile file;
    if (!file.open(from)) return file.problem();
    return ShortenedJournal(file, to).write(progress);
}

}  // namespace hal
