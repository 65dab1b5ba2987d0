// SPDX-License-Identifier: MIT
#include "journal/journal_file.hpp"

#include <charconv>
#include <fmt/core.h>
#include <string_view>
#include <utility>

#include "journal/journal_format.hpp"
#include "recording/mcap/bytes.hpp"
#include "recording/mcap/reader.hpp"

namespace hal {
namespace {

template <class Number>
Number number_in(const std::map<std::string, std::string>& texts, const std::string& key) {
    Number value{};
    if (const auto found = texts.find(key); found != texts.end()) {
        const std::string& text = found->second;
        std::from_chars(text.data(), text.data() + text.size(), value);
    }
    return value;
}

std::string text_in(const std::map<std::string, std::string>& texts, const std::string& key) {
    const auto found = texts.find(key);
    return found == texts.end() ? "" : found->second;
}

/// Returns the records of a message of cycles; nothing when it is damaged.
std::optional<std::string> records_of(std::string_view payload) {
    mcap::Fields fields(payload);
    fields.take(4);  // the representation
    fields.get<std::uint32_t>();
    const std::string_view records = fields.text();
    if (!fields.good()) return std::nullopt;
    return std::string(records);
}

}  // namespace

void JournaledThread::add_batch(std::uint32_t sequence, std::string records) {
    batches_.push_back({sequence, std::move(records)});
}

void JournaledThread::next() {
    const bool had_one = std::exchange(valid_, false);
    if (!gap_.empty()) return;
    const std::uint64_t newest = record_.number;
    const auto after = [&] {
        return had_one || newest != 0 ? fmt::format(" after cycle {}", newest) : std::string();
    };
    for (;;) {
        if (decoder_ && decoder_->next(record_, notes_)) break;
        if (decoder_ && decoder_->damaged()) {
            gap_ = fmt::format("thread '{}': a batch of cycles is damaged{}", name, after());
            return;
        }
        if (batch_ == batches_.size()) return;
        Batch& batch = batches_[batch_];
        if (batch.sequence != batch_) {
            gap_ = fmt::format("thread '{}': cycles are missing in the file{}", name, after());
            return;
        }
        ++batch_;
        decoder_.emplace(std::move(batch.records));
    }
    if (record_.lost != lost_) {
        gap_ = fmt::format(
            "thread '{}': {} cycle{} after cycle {} did not fit the buffer of the "
            "journal",
            name, record_.lost - lost_, record_.lost - lost_ == 1 ? "" : "s", newest);
        return;
    }
    valid_ = true;
}

bool JournalFile::open(const std::string& path) {
    auto source = mcap::open_file(path, problem_);
    if (!source) return false;
    mcap::Reader reader;
    if (!reader.open(std::move(source))) {
        problem_ = reader.problem();
        return false;
    }
    const auto head = reader.metadata(journal_format::head);
    if (head.empty()) {
        problem_ = "it is not a journal: hal run --journal writes one";
        return false;
    }
    if (text_in(head, "format") != journal_format::version) {
        problem_ = fmt::format("journal format {} is unsupported: this version reads format {}",
                               text_in(head, "format"), journal_format::version);
        return false;
    }
    head_ = head;
    version_ = text_in(head, "version") + " " + text_in(head, "commit");
    program_ = text_in(head, "program");
    unix_offset_ns_ = number_in<std::int64_t>(head, "unix_offset_ns");
    std::map<std::uint16_t, std::uint32_t> thread_of;
    std::optional<std::uint16_t> entries;
    std::optional<std::uint16_t> setup;
    for (const auto& [id, channel] : reader.channels()) {
        if (channel.topic == journal_format::entries_topic) {
            entries = id;
        } else if (channel.topic == journal_format::setup_topic) {
            setup = id;
        } else if (channel.topic.starts_with(journal_format::cycles_topic)) {
            const auto number = number_in<std::uint32_t>(channel.metadata, "number");
            thread_of[id] = number;
            JournaledThread& thread = threads_[number];
            thread.number = number;
            thread.name = text_in(channel.metadata, "journaled_thread");
            thread.period_ns = number_in<std::int64_t>(channel.metadata, "journaled_period_ns");
        }
    }
    bool entries_end = false;
    const bool all = reader.each([&](const mcap::Message& message) {
        if (entries == message.channel) {
            auto entry = execution_entry(message.payload);
            entries_end = entries_end || !entry || message.sequence != entries_.size();
            if (!entries_end) {
                entries_.push_back(std::move(*entry));
            }
        } else if (setup == message.channel) {
            if (auto record = setup_record(message.payload)) {
                setup_.add(std::move(*record));
            }
        } else if (const auto thread = thread_of.find(message.channel); thread != thread_of.end()) {
            threads_[thread->second].add_batch(
                message.sequence, records_of(message.payload).value_or(std::string(1, '\x80')));
        }
        return true;
    });
    if (reader.unfinished()) {
        notes_.push_back("the file has no end: it is read up to its last complete chunk");
    }
    if (!all) {
        notes_.push_back(reader.problem() + "; the cycles before the damage are executed");
    }
    if (entries_end) {
        notes_.push_back(fmt::format("an entry of the journal is missing or damaged: entry {}",
                                     entries_.size() + 1));
    }
    for (auto& [number, thread] : threads_) {
        thread.next();
    }
    return true;
}

bool JournalFile::complete() const {
    return !entries_.empty() && entries_.back().kind == ExecutionEntry::Kind::end;
}

}  // namespace hal
