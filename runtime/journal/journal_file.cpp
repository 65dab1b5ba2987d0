// SPDX-License-Identifier: MIT
#include "journal/journal_file.hpp"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fmt/core.h>
#include <string_view>
#include <system_error>
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

JournaledBatch batch_of(const mcap::Message& message) {
    mcap::Fields fields(message.payload);
    fields.take(4);  // the representation
    JournaledBatch batch{.sequence = message.sequence,
                         .count = fields.get<std::uint32_t>(),
                         .unix_ns = message.log_time,
                         .records = std::string(fields.text())};
    if (!fields.good()) {
        batch.records = '\x80';  // damaged
    }
    return batch;
}

}  // namespace

std::optional<JournaledThread::Extent> JournaledThread::remaining() const {
    if (!valid_) return std::nullopt;
    Extent extent{record_.woke_ns, record_.woke_ns};
    const bool has_further = batch_ < batches_.size();
    CycleDecoder last = has_further ? CycleDecoder(batches_.back().records) : *decoder_;
    CycleRecord record;
    std::vector<std::uint64_t> notes;
    while (last.next(record, notes)) {
        if (record.kind == CycleRecord::cycle) {
            extent.last_ns = record.woke_ns;
        }
    }
    return extent;
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
        JournaledBatch& batch = batches_[batch_];
        if (batch.sequence != first_sequence_ + batch_) {
            gap_ = fmt::format("thread '{}': cycles are missing in the file{}", name, after());
            return;
        }
        ++batch_;
        decoder_.emplace(std::move(batch.records));
    }
    if (is_cut_ && !had_one && newest == 0) {
        lost_ = record_.lost;
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

std::vector<JournaledBatch> JournaledThread::take_remaining() {
    std::vector<JournaledBatch> remaining;
    if (valid_) {
        JournaledBatch& rest = remaining.emplace_back();
        rest.sequence = sequence();
        rest.unix_ns = batches_[batch_ - 1].unix_ns;
        CycleEncoder encoder;
        do {
            encoder.add(record_, notes_);
            ++rest.count;
        } while (decoder_->next(record_, notes_));
        rest.records = encoder.take();
    }
    valid_ = false;
    for (; batch_ < batches_.size(); ++batch_) {
        remaining.push_back(std::move(batches_[batch_]));
    }
    return remaining;
}

bool JournalFile::open(const std::string& path) {
    std::error_code ignored;
    if (!std::filesystem::is_directory(path, ignored)) return open(std::vector{path});
    std::vector<std::string> paths;
    for (const auto& entry : std::filesystem::directory_iterator(path, ignored)) {
        const std::string name = entry.path().filename().string();
        const bool is_part = name.find_first_not_of("0123456789") == name.find(".mcap");
        if (is_part && name.front() != '.') {
            paths.push_back(entry.path().string());
        }
    }
    std::ranges::sort(paths);  // their names have their numbers
    if (paths.empty()) {
        problem_ = "the folder has no journal";
        return false;
    }
    return open(paths);
}

bool JournalFile::open(const std::vector<std::string>& paths) {
    paths_ = paths;
    for (const std::string& path : paths) {
        if (!add(path)) return false;
    }
    if (entries_end_) {
        notes_.push_back(fmt::format("an entry of the journal is missing or damaged: entry {}",
                                     entries_.size() + 1));
    }
    for (auto& [number, thread] : threads_) {
        if (begin_ && begin_->batches.contains(number)) {
            thread.begin_with(begin_->batches[number]);
        }
        thread.next();
    }
    return true;
}

bool JournalFile::add_head(mcap::Reader& reader) {
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
    if (!head_.empty()) return true;
    head_ = head;
    version_ = text_in(head, "version") + " " + text_in(head, "commit");
    program_ = text_in(head, "program");
    unix_offset_ns_ = number_in<std::int64_t>(head, "unix_offset_ns");
    return true;
}

void JournalFile::add_entry(std::uint32_t sequence, std::string_view payload) {
    auto entry = execution_entry(payload);
    entries_end_ = entries_end_ || !entry || sequence != sequence_of(entries_.size());
    if (!entries_end_) {
        entries_.push_back(std::move(*entry));
    }
}

JournalFile::Channels JournalFile::add_channels(const mcap::Reader& reader) {
    Channels found;
    for (const auto& [id, channel] : reader.channels()) {
        if (channel.topic == journal_format::entries_topic) {
            found.entries = id;
        } else if (channel.topic == journal_format::setup_topic) {
            found.setup = id;
        } else if (channel.topic == journal_format::state_topic) {
            found.state = id;
        } else if (channel.topic.starts_with(journal_format::cycles_topic)) {
            const auto number = number_in<std::uint32_t>(channel.metadata, "number");
            found.threads[id] = number;
            JournaledThread& thread = threads_[number];
            thread.number = number;
            thread.name = text_in(channel.metadata, "journaled_thread");
            thread.period_ns = number_in<std::int64_t>(channel.metadata, "journaled_period_ns");
        }
    }
    return found;
}

/// A file that has the state needs none before it.
void JournalFile::forget_earlier() {
    entries_.clear();
    entries_end_ = false;
    setup_ = {};
    for (auto& [number, thread] : threads_) {
        thread.forget();
    }
}

void JournalFile::add_message(const Channels& channels, const mcap::Message& message) {
    if (channels.entries == message.channel) {
        add_entry(message.sequence, message.payload);
    } else if (channels.setup == message.channel) {
        if (auto record = setup_record(message.payload)) {
            setup_.add(std::move(*record));
        }
    } else if (channels.state == message.channel) {
        begin_ = journal_begin(message.payload);
    } else if (const auto thread = channels.threads.find(message.channel);
               thread != channels.threads.end()) {
        threads_[thread->second].add(batch_of(message));
    }
}

bool JournalFile::add(const std::string& path) {
    auto source = mcap::open_file(path, problem_);
    if (!source) return false;
    mcap::Reader reader;
    if (!reader.open(std::move(source))) {
        problem_ = reader.problem();
        return false;
    }
    if (!add_head(reader)) return false;
    const Channels channels = add_channels(reader);
    if (channels.state) {
        forget_earlier();
    }
    const bool all = reader.each([&](const mcap::Message& message) {
        add_message(channels, message);
        return true;
    });
    if (channels.state && !begin_) {
        problem_ = "the state that it begins with is missing or damaged";
        return false;
    }
    if (reader.unfinished()) {
        notes_.push_back("the file has no end: it is read up to its last complete chunk");
    }
    if (!all) {
        notes_.push_back(reader.problem() + "; the cycles before the damage are executed");
    }
    return true;
}

bool JournalFile::complete() const {
    return !entries_.empty() && entries_.back().kind == ExecutionEntry::Kind::end;
}

}  // namespace hal
