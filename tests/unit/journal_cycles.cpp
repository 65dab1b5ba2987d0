// SPDX-License-Identifier: MIT
// The records of cycles: their ring, their bytes, and the entries of a journal.
#include <cstdint>
#include <cstring>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "execute/cycle_inputs.hpp"
#include "journal/cycle_codec.hpp"
#include "journal/journal_entry.hpp"
#include "journal/setup_record.hpp"
#include "plan/shared_state.hpp"

namespace hal::test {
namespace {

using Words = std::vector<std::uint64_t>;

void record(CycleInputs& inputs, std::uint64_t number, std::uint64_t notes) {
    inputs.begin(CycleRecord::cycle, number, 1000, 1000, 1010, 0);
    inputs.took(0, 7);
    inputs.reads(0);
    for (std::uint64_t i = 0; i < notes; ++i) {
        inputs.note(100 * number + i);
    }
    inputs.end(9, 5);
}

TEST(CycleInputs, Has_the_words_of_each_cycle_in_its_ring) {
    CycleInputs inputs(1024);
    record(inputs, 1, 2);
    record(inputs, 2, 1);
    Words words;
    inputs.take(words);
    ASSERT_EQ(words.size(), 2 * CycleInputs::head_words + 3);
    const CycleRecord first = CycleInputs::record_at(words.data());
    EXPECT_EQ(first.number, 1u);
    EXPECT_EQ(first.writes_before, 7u);
    EXPECT_EQ(first.writes_after, 9u);
    EXPECT_EQ(first.checksum, 5u);
    EXPECT_EQ(first.notes, 2u);
    EXPECT_EQ(words[CycleInputs::head_words + 1], 101u);
    const CycleRecord second = CycleInputs::record_at(&words[CycleInputs::head_words + 2]);
    EXPECT_EQ(second.number, 2u);
    EXPECT_EQ(words.back(), 200u);
}

TEST(CycleInputs, Drops_a_record_that_does_not_fit_and_the_next_one_has_the_number) {
    CycleInputs inputs(64);
    Words words;
    std::uint64_t number = 0;
    for (; inputs.lost() == 0; ++number) {
        record(inputs, number, 0);
    }
    record(inputs, number, 0);
    EXPECT_EQ(inputs.lost(), 2u);
    inputs.take(words);
    EXPECT_EQ(words.size() % CycleInputs::head_words, 0u);
    words.clear();
    for (std::uint64_t more = 0; more < 20; ++more) {  // around the end of the ring
        record(inputs, 1000 + more, 1);
        words.clear();
        inputs.take(words);
        ASSERT_EQ(words.size(), CycleInputs::head_words + 1);
        EXPECT_EQ(CycleInputs::record_at(words.data()).lost, 2u);
        EXPECT_EQ(words.back(), 100 * (1000 + more));
    }
}

TEST(CycleInputs, Drops_a_cycle_that_reads_too_much) {
    CycleInputs inputs(std::size_t{1} << 16);
    record(inputs, 1, CycleInputs::max_notes + 1);
    EXPECT_EQ(inputs.lost(), 1u);
    record(inputs, 2, CycleInputs::max_notes);
    EXPECT_EQ(inputs.lost(), 1u);
}

TEST(CycleInputs, Gives_back_what_was_read_and_compares_the_end) {
    CycleInputs inputs;
    const Words notes{11, 12};
    CycleRecord cycle;
    cycle.checksum = 5;
    cycle.notes = 2;
    const auto execute = [&](int reads, std::uint64_t checksum) {
        inputs.load(cycle, notes);
        inputs.begin(CycleRecord::cycle, 0, 0, 0, 0, 0);
        std::uint64_t sum = 0;
        for (int i = 0; i < reads; ++i) {
            sum += inputs.note(1);
        }
        inputs.end(0, checksum);
        return sum;
    };
    EXPECT_EQ(execute(2, 5), 23u);
    EXPECT_EQ(inputs.match(), CycleInputs::Match::same);
    EXPECT_EQ(execute(2, 6), 23u);
    EXPECT_EQ(inputs.match(), CycleInputs::Match::other_values);
    EXPECT_EQ(execute(1, 5), 11u);
    EXPECT_EQ(inputs.match(), CycleInputs::Match::other_reads);
    EXPECT_EQ(execute(3, 5), 24u);
    EXPECT_EQ(inputs.match(), CycleInputs::Match::other_reads);
    EXPECT_THROW(inputs.load(cycle, {}), std::invalid_argument);
}

/// Records a cycle with results, and returns its words.
template <class Fill>
Words words_of_cycle(Fill fill) {
    CycleInputs inputs(std::size_t{1} << 12);
    inputs.begin(CycleRecord::cycle, 1, 0, 0, 0, 0);
    fill(inputs);
    inputs.end(0, 5);
    Words words;
    inputs.take(words);
    return words;
}

void load(CycleInputs& inputs, const Words& words) {
    const Words notes(words.begin() + CycleInputs::head_words, words.end());
    inputs.load(CycleInputs::record_at(words.data()), notes);
    inputs.begin(CycleRecord::cycle, 1, 0, 0, 0, 0);
}

TEST(CycleInputs, Gives_back_the_bytes_of_results_between_notes) {
    const Words words = words_of_cycle([](CycleInputs& inputs) {
        inputs.note(7);
        inputs.put("abc", 3);
        inputs.note(8);
        inputs.put("0123456789", 10);
    });
    CycleInputs again;
    load(again, words);
    char first[3];
    char second[10];
    EXPECT_EQ(again.note(0), 7u);
    EXPECT_TRUE(again.get(first, sizeof first));
    EXPECT_EQ(again.note(0), 8u);
    EXPECT_TRUE(again.get(second, sizeof second));
    again.end(0, 5);
    EXPECT_EQ(again.match(), CycleInputs::Match::same);
    EXPECT_EQ(std::string(first, 3) + std::string(second, 10), "abc0123456789");
    load(again, words);
    again.note(0);
    again.note(0);
    again.end(0, 5);
    EXPECT_EQ(again.match(), CycleInputs::Match::other_reads) << "no results were asked for";
}

TEST(CycleInputs, Has_zeros_where_more_results_are_asked_for_than_there_are) {
    const Words words = words_of_cycle([](CycleInputs& inputs) { inputs.put("abcdefgh", 8); });
    CycleInputs again;
    load(again, words);
    char bytes[9] = {};
    EXPECT_TRUE(again.get(bytes, 8));
    bytes[0] = 'x';
    EXPECT_FALSE(again.get(bytes, 1));
    EXPECT_EQ(bytes[0], '\0');
    again.end(0, 5);
    EXPECT_EQ(again.match(), CycleInputs::Match::other_reads);
    load(again, words);
    EXPECT_FALSE(again.get(bytes, 9));
}

TEST(CycleInputs, Drops_a_cycle_with_too_many_results) {
    CycleInputs inputs(std::size_t{1} << 16);
    const Words all(CycleInputs::max_notes);
    inputs.begin(CycleRecord::cycle, 1, 0, 0, 0, 0);
    inputs.put(all.data(), all.size() * sizeof(std::uint64_t));
    inputs.end(0, 5);
    EXPECT_EQ(inputs.lost(), 0u);
    inputs.begin(CycleRecord::cycle, 2, 0, 0, 0, 0);
    inputs.put(all.data(), all.size() * sizeof(std::uint64_t));
    inputs.put("a", 1);
    inputs.end(0, 5);
    EXPECT_EQ(inputs.lost(), 1u);
}

struct OrderOfCalls final : FunctionOrder {
    Words waited;
    void wait_for(std::uint64_t, bool) override {}
    void wait_for_call(std::uint64_t ticket) override { waited.push_back(ticket); }
};

TEST(CycleInputs, Waits_for_the_tickets_of_ordered_calls) {
    const Words tickets{1'000'000, 1'000'001, 1'000'003, 1'000'400, 1'000'401, 1'000'657};
    const Words words = words_of_cycle([&tickets](CycleInputs& inputs) {
        for (const std::uint64_t ticket : tickets) {
            inputs.order_call(ticket);
        }
    });
    OrderOfCalls order;
    CycleInputs again(&order);
    load(again, words);
    for (std::size_t i = 0; i < tickets.size(); ++i) {
        again.order_call(0);
    }
    again.end(0, 5);
    EXPECT_EQ(order.waited, tickets);
    EXPECT_EQ(again.match(), CycleInputs::Match::same);
}

TEST(CycleInputs, Names_the_link_that_sends_other_frames) {
    const Words words = words_of_cycle([](CycleInputs&) {});
    CycleInputs again;
    load(again, words);
    again.differs("udp:a");
    again.differs("udp:b");
    again.end(0, 6);
    EXPECT_EQ(again.match(), CycleInputs::Match::other_frames);
    EXPECT_STREQ(again.differing_link(), "udp:a");
    load(again, words);
    again.end(0, 5);
    EXPECT_EQ(again.match(), CycleInputs::Match::same);
    EXPECT_EQ(again.differing_link(), nullptr);
}

TEST(SetupRecord, Is_the_same_after_a_way_through_CDR) {
    const SetupRecord file{.kind = SetupRecord::file,
                           .error = 2,
                           .name = "x.canopen",
                           .hash = "0123456789abcdef",
                           .results = std::string("a\0b", 3),
                           .readings = ""};
    const std::string payload = to_cdr(file);
    const auto again = setup_record(payload);
    ASSERT_TRUE(again);
    EXPECT_EQ(again->kind, file.kind);
    EXPECT_EQ(again->error, file.error);
    EXPECT_EQ(again->name, file.name);
    EXPECT_EQ(again->hash, file.hash);
    EXPECT_EQ(again->results, file.results);
    EXPECT_EQ(again->readings, file.readings);
    for (std::size_t size = 0; size < payload.size(); ++size) {
        EXPECT_FALSE(setup_record(payload.substr(0, size))) << size;
    }
    std::string changed = payload;
    changed[4] = 2;
    EXPECT_FALSE(setup_record(changed));
}

TEST(JournaledSetup, Gives_back_calls_and_files_in_their_order) {
    JournaledSetup setup;
    setup.add({.name = "x start", .results = "1"});
    setup.add({.name = "y start", .results = "2"});
    setup.add({.name = "x start", .results = "3"});
    EXPECT_EQ(setup.next_call("x start")->links, "1");
    EXPECT_EQ(setup.next_call("x start")->links, "3");
    EXPECT_EQ(setup.next_call("x start"), std::nullopt);
    EXPECT_EQ(setup.next_call("y start")->links, "2");
    setup.add({.kind = SetupRecord::file, .name = "f", .hash = "a", .results = "old"});
    setup.add({.kind = SetupRecord::file, .name = "g", .hash = "a"});
    setup.add({.kind = SetupRecord::file, .error = 2, .name = "f"});
    setup.add({.kind = SetupRecord::file, .name = "f", .hash = "b", .results = "new"});
    EXPECT_EQ(setup.next_file("f")->bytes, "old");
    EXPECT_EQ(setup.next_file("f")->error, 2);
    EXPECT_EQ(setup.next_file("f")->bytes, "new");
    EXPECT_EQ(setup.next_file("f")->bytes, "new") << "read once more than then";
    EXPECT_EQ(setup.next_file("g")->bytes, "old") << "the same content";
    EXPECT_EQ(setup.next_file("h"), nullptr);
    setup.add({.kind = SetupRecord::file, .name = "/m/x.eds", .hash = "b"});
    EXPECT_EQ(setup.next_file("x.eds")->bytes, "new") << "beside the netlist";
    EXPECT_EQ(setup.next_file("eds"), nullptr);
}

struct Sample {
    CycleRecord record;
    Words notes;
};

std::vector<Sample> random_samples(std::size_t count) {
    std::mt19937_64 dice(34);
    std::vector<Sample> all;
    for (std::size_t i = 0; i < count; ++i) {
        Sample& one = all.emplace_back();
        one.record.kind = dice() % 2;
        one.record.lost = i / 3;
        one.record.number = i;
        one.record.grid_ns = static_cast<std::int64_t>(dice());
        one.record.due_ns = static_cast<std::int64_t>(1'000'000 * i);
        one.record.woke_ns = one.record.due_ns + static_cast<std::int64_t>(dice() % 1000);
        one.record.missed = dice() % 3;
        one.record.epoch = dice() % 2;
        one.record.writes_before = dice() % 100;
        one.record.writes_after = one.record.writes_before + dice() % 5;
        one.record.observation = dice() % 2;
        one.record.checksum = dice();
        one.notes.resize(dice() % 6);
        for (std::uint64_t& note : one.notes) {
            note = dice() >> (dice() % 64);
        }
        one.record.notes = one.notes.size();
        one.record.data = dice() % (one.notes.size() + 1);
        one.record.imports = dice() % (one.notes.size() - one.record.data + 1);
    }
    return all;
}

std::string encoded(const std::vector<Sample>& samples) {
    CycleEncoder encoder;
    for (const Sample& one : samples) {
        encoder.add(one.record, one.notes);
    }
    EXPECT_EQ(encoder.records(), samples.size());
    return encoder.take();
}

TEST(CycleCodec, Decodes_what_it_has_encoded) {
    const std::vector<Sample> samples = random_samples(500);
    CycleDecoder decoder(encoded(samples));
    CycleRecord record;
    Words notes;
    for (const Sample& one : samples) {
        ASSERT_TRUE(decoder.next(record, notes));
        EXPECT_EQ(std::memcmp(&record, &one.record, sizeof record), 0) << one.record.number;
        EXPECT_EQ(notes, one.notes);
    }
    EXPECT_FALSE(decoder.next(record, notes));
    EXPECT_FALSE(decoder.damaged());
}

TEST(CycleCodec, Ends_where_a_batch_is_cut_off_or_damaged) {
    const std::string bytes = encoded(random_samples(20));
    std::mt19937 dice(1);
    for (std::size_t size = 0; size < bytes.size(); ++size) {
        std::string changed = bytes;
        changed[size] = static_cast<char>(dice());
        for (const std::string& one : {bytes.substr(0, size), changed}) {
            CycleDecoder decoder(one);
            CycleRecord record;
            Words notes;
            std::size_t count = 0;
            while (decoder.next(record, notes)) {
                ASSERT_LE(notes.size(), CycleInputs::max_notes);
                ASSERT_LT(++count, bytes.size());
            }
        }
    }
}

TEST(ExecutionEntry, Is_the_same_after_a_way_through_JSON) {
    ExecutionEntry edit{.kind = ExecutionEntry::Kind::edit, .epoch = 3};
    edit.commands = {{"net", "a b", "\"x\""}, {"setp", "p", "1"}};
    edit.files = {{"pid", "/lib/pid.so", "0123"}};
    const auto again = execution_entry(to_json(edit));
    ASSERT_TRUE(again);
    EXPECT_EQ(again->epoch, 3u);
    EXPECT_EQ(again->commands, edit.commands);
    EXPECT_EQ(again->files.at(0).hash, "0123");
    ExecutionEntry opened{.kind = ExecutionEntry::Kind::opened};
    opened.instance = "canopen.0";
    opened.resources = {"/dev/ttyS0"};
    opened.threads = 1;
    opened.helpers = 2;
    opened.links = 3;
    opened.streams = 4;
    const auto opened_again = execution_entry(to_json(opened));
    ASSERT_TRUE(opened_again);
    EXPECT_EQ(opened_again->resources, opened.resources);
    EXPECT_EQ(opened_again->threads, 1u);
    EXPECT_EQ(opened_again->helpers, 2u);
    EXPECT_EQ(opened_again->links, 3u);
    EXPECT_EQ(opened_again->streams, 4u);
    ExecutionEntry written{.kind = ExecutionEntry::Kind::written};
    written.values = {{"panel.x", 0xffff'ffff'ffff'ffff}};
    EXPECT_EQ(execution_entry(to_json(written))->values, written.values);
}

TEST(ExecutionEntry, Is_nothing_when_it_is_damaged) {
    for (const char* const text :
         {"", "{", "[]", R"({"kind":"other"})", R"({"kind":"edit"})", R"({"kind":1})",
          R"({"kind":"edit","epoch":-1,"commands":[1],"files":[]})"}) {
        EXPECT_FALSE(execution_entry(text)) << text;
    }
}

TEST(SharedState, Copies_the_words_that_have_changed_and_the_outputs_but_no_addresses) {
    std::uint64_t live[] = {1, 2, 3, 0x7f0000001000};
    std::uint64_t again[] = {1, 2, 3, 0x7f0000009000};
    hal_value value{.raw = 5};
    hal_value other{.raw = 6};
    hal_pin output{.slot = &value, .own = {}};
    hal_pin second{.slot = &other, .own = {}};
    plan::SharedState from;
    plan::SharedState to;
    for (std::size_t i = 0; i < 4; ++i) {
        from.add(&live[i]);
        to.add(&again[i]);
    }
    from.add(&output);
    to.add(&second);
    from.complete();
    to.complete();
    from.begin();
    live[1] = 20;
    live[3] = 0x7f0000001008;
    from.look();
    live[1] = 21;
    Words words;
    from.write([&words](std::uint64_t word) { words.push_back(word); });
    EXPECT_EQ(words, (Words{1, 1, 21, 5}));
    again[2] = 9;
    std::size_t at = 0;
    to.read([&] { return words[at++]; });
    EXPECT_EQ(again[0], 1u);
    EXPECT_EQ(again[1], 21u);
    EXPECT_EQ(again[2], 9u);
    EXPECT_EQ(again[3], 0x7f0000009000u);
    EXPECT_EQ(other.raw, 5u);
}

TEST(SharedState, Does_not_trust_the_words_of_a_journal) {
    std::uint64_t word = 1;
    plan::SharedState state;
    state.add(&word);
    state.complete();
    const Words words = {3, 7, 1, UINT64_MAX, 2, 0, 4};
    std::size_t at = 0;
    state.read([&] { return at < words.size() ? words[at++] : 0; });
    EXPECT_EQ(word, 4u);
}

TEST(SharedState, Leaves_out_a_state_that_is_too_large) {
    std::vector<std::uint64_t> memory(plan::SharedState::max_words + 1);
    plan::SharedState state;
    for (std::uint64_t& word : memory) {
        state.add(&word);
    }
    state.complete();
    EXPECT_FALSE(state.covered());
    state.begin();
    memory[0] = 1;
    state.look();
    Words words;
    state.write([&words](std::uint64_t one) { words.push_back(one); });
    EXPECT_EQ(words, Words{0});
}

}  // namespace
}  // namespace hal::test
