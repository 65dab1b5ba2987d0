// SPDX-License-Identifier: MIT
#include "journal/journal_copy.hpp"

#include <cstring>
#include <utility>

#include "journal/journal_format.hpp"
#include "recording/mcap/bytes.hpp"
#include "recording/mcap/reader.hpp"

namespace hal {

JournalCopy::JournalCopy(const JournalFile& from, const std::string& to)
    : from_(from), writer_(to) {
    writer_.metadata(journal_format::head, from.head());
    entries_ = writer_.add_channel(
        writer_.add_schema("halcyon.JournalEntry", "jsonschema", journal_format::entry_schema),
        journal_format::entries_topic, "json", {});
    setup_ = writer_.add_channel(
        writer_.add_schema(journal_format::setup_type, "ros2msg", journal_format::setup_schema),
        journal_format::setup_topic, "cdr", {});
    cycles_schema_ =
        writer_.add_schema(journal_format::cycles_type, "ros2msg", journal_format::cycles_schema);
}

void JournalCopy::add(const JournalBegin& begin) {
    const auto channel = writer_.add_channel(
        writer_.add_schema(journal_format::state_type, "ros2msg", journal_format::state_schema),
        journal_format::state_topic, "cdr", {});
    writer_.message(channel, 0, unix_ns_, to_cdr(begin));
}

void JournalCopy::add(const ExecutionEntry& entry, std::uint32_t sequence) {
    writer_.message(entries_, sequence, unix_ns_, to_json(entry));
}

void JournalCopy::add_setup() {
    for (const std::string& path : from_.paths()) {
        add_setup_of(path);
    }
}

void JournalCopy::add_setup_of(const std::string& path) {
    std::string ignored;  // the file has been read before
    mcap::Reader reader;
    auto source = mcap::open_file(path, ignored);
    if (!source || !reader.open(std::move(source))) return;
    const auto is_setup = [&reader](const mcap::Message& message) {
        const auto channel = reader.channels().find(message.channel);
        return channel != reader.channels().end() &&
               channel->second.topic == journal_format::setup_topic;
    };
    reader.each([&](const mcap::Message& message) {
        if (is_setup(message)) {
            writer_.message(setup_, setup_count_++, unix_ns_, message.payload);
        }
        return true;
    });
}

std::uint16_t JournalCopy::channel_of(const JournaledThread& thread) {
    const auto [found, is_new] = channels_.try_emplace(thread.number, std::uint16_t{0});
    if (is_new) {
        found->second = writer_.add_channel(
            cycles_schema_,
            std::string(journal_format::cycles_topic) + std::to_string(thread.number), "cdr",
            {{"journaled_thread", thread.name},
             {"number", std::to_string(thread.number)},
             {"journaled_period_ns", std::to_string(thread.period_ns)}});
    }
    return found->second;
}

void JournalCopy::add(const JournaledThread& thread, const JournaledBatch& batch) {
    std::string payload("\0\1\0\0", 4);  // CDR, little-endian
    mcap::put(payload, batch.count);
    mcap::put_text(payload, batch.records);
    writer_.message(channel_of(thread), batch.sequence, batch.unix_ns, payload);
}

std::string JournalCopy::close() {
    writer_.close();
    if (!writer_.problem().empty()) return writer_.problem();
    return writer_.error() == 0 ? "" : std::strerror(writer_.error());
}

}  // namespace hal
