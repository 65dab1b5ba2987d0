// SPDX-License-Identifier: MIT
// Files of recordings: what was written is read, also when the file was cut off, damaged, or the
// disk was full.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <sys/resource.h>
#include <unistd.h>

#include "recording/mcap/bytes.hpp"
#include "recording/mcap/compression.hpp"
#include "recording/mcap/crc.hpp"
#include "recording/mcap/reader.hpp"
#include "recording/mcap/recording.hpp"
#include "recording/mcap/rows.hpp"
#include "recording/mcap/writer.hpp"

namespace hal::mcap {
namespace {

struct Folder {
    Folder()
        : path(std::filesystem::temp_directory_path() / ("mcap-" + std::to_string(::getpid()))) {
        std::filesystem::create_directories(path);
    }
    ~Folder() { std::filesystem::remove_all(path); }
    std::string file(const std::string& name) const { return (path / name).string(); }
    std::filesystem::path path;
};

const std::vector<Column> columns{{"x.0.pos-cmd", HAL_TYPE_FLOAT, "mm"},
                                  {"on", HAL_TYPE_BIT, ""},
                                  {"count", HAL_TYPE_S32, ""},
                                  {"X-0.pos_cmd", HAL_TYPE_FLOAT, ""},
                                  {"big", HAL_TYPE_U64, ""}};
constexpr std::uint64_t start_ns = 1'700'000'000'000'000'000;
constexpr std::uint64_t period_ns = 1'000'000;

std::vector<std::uint64_t> values(std::uint64_t row) {
    return {std::bit_cast<std::uint64_t>(std::sin(static_cast<double>(row) * 0.01)), row / 100 % 2,
            static_cast<std::uint64_t>(-static_cast<std::int64_t>(row)),
            std::bit_cast<std::uint64_t>(0.5 * static_cast<double>(row)),
            std::uint64_t{1} << 63 | row};
}

/// Writes so many rows; a chunk per second. Returns false when something could not be written.
bool write(const std::string& path, std::uint64_t rows) {
    Writer writer(path);
    RowWriter row(columns);
    const auto schema = writer.add_schema("halcyon_msgs/msg/Servo", "ros2msg", row.schema());
    const auto channel = writer.add_channel(schema, "/hal/servo", "cdr", row.metadata());
    const auto events = writer.add_channel(
        writer.add_schema("halcyon.Event", "jsonschema", "{\"type\":\"object\"}"), "/hal/events",
        "json", {});
    writer.metadata("halcyon", {{"instance", "test"}});
    writer.attachment("netlist.hal", "text/plain", "loadrt and2\n", 1);
    std::string payload;
    for (std::uint64_t i = 0; i < rows; ++i) {
        row.write(values(i).data(), payload);
        writer.message(channel, static_cast<std::uint32_t>(i), start_ns + i * period_ns, payload);
    }
    writer.message(events, 0, start_ns + rows * period_ns,
                   R"({"kind":"fault","text":"it \"stopped\""})");
    return writer.close();
}

std::string content(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

void put_file(const std::string& path, std::string_view bytes) {
    std::ofstream(path, std::ios::binary)
        .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

TEST(Recording, What_is_written_is_read) {
    const Folder folder;
    ASSERT_TRUE(write(folder.file("a.mcap"), 2500));
    EXPECT_FALSE(std::filesystem::exists(folder.file("a.mcap.part")));
    Recording recording;
    std::string problem;
    ASSERT_TRUE(load(folder.file("a.mcap"), recording, problem)) << problem;
    EXPECT_EQ(recording.note, "");
    ASSERT_EQ(recording.tables.size(), 1u);
    const Table& table = recording.tables[0];
    ASSERT_EQ(table.rows(), 2500u);
    ASSERT_EQ(table.columns.size(), columns.size());
    for (std::size_t c = 0; c < columns.size(); ++c) {
        const auto original = std::find_if(columns.begin(), columns.end(), [&](const Column& one) {
            return one.name == table.columns[c].name;
        });
        ASSERT_NE(original, columns.end());
        EXPECT_EQ(table.columns[c].type, original->type);
        EXPECT_EQ(table.columns[c].unit, original->unit);
        for (std::uint64_t row = 0; row < 2500; row += 7) {
            EXPECT_EQ(table.word(row, c),
                      values(row)[static_cast<std::size_t>(original - columns.begin())]);
        }
    }
    EXPECT_EQ(recording.begin_ns(), static_cast<std::int64_t>(start_ns));
    EXPECT_EQ(recording.end_ns(), static_cast<std::int64_t>(start_ns + 2499 * period_ns));
    ASSERT_EQ(recording.events.size(), 1u);
    EXPECT_EQ(recording.events[0].kind, "fault");
    EXPECT_EQ(recording.events[0].text, "it \"stopped\"");
}

TEST(Recording, A_time_window_reads_its_chunks_only) {
    const Folder folder;
    ASSERT_TRUE(write(folder.file("a.mcap"), 20'000));
    Reader reader;
    std::string problem;
    ASSERT_TRUE(reader.open(open_file(folder.file("a.mcap"), problem)));
    ASSERT_GE(reader.chunks().size(), 20u);
    std::uint64_t rows = 0;
    ASSERT_TRUE(reader.each([&](const Message&) {
        ++rows;
        return true;
    }, start_ns + 10'500 * period_ns, start_ns + 10'600 * period_ns));
    EXPECT_EQ(rows, 100u);
    EXPECT_LE(reader.chunks_read(), 2u);
    EXPECT_EQ(reader.metadata("halcyon").at("instance"), "test");
}

TEST(Recording, A_file_without_its_end_is_read_up_to_its_last_chunk) {
    const Folder folder;
    ASSERT_TRUE(write(folder.file("a.mcap"), 5000));
    const std::string whole = content(folder.file("a.mcap"));
    std::size_t last = 0;
    for (const double share : {0.3, 0.6, 0.9, 0.999}) {
        put_file(folder.file("cut.mcap"),
                 std::string_view(whole).substr(
                     0, static_cast<std::size_t>(static_cast<double>(whole.size()) * share)));
        Recording recording;
        std::string problem;
        ASSERT_TRUE(load(folder.file("cut.mcap"), recording, problem)) << problem;
        const std::size_t rows = recording.tables.empty() ? 0 : recording.tables[0].rows();
        std::string last_row = "all rows are missing";
        if (rows != 0) {
            char text[60];
            std::snprintf(text, sizeof text, "rows after %.9g s are missing",
                          static_cast<double>(recording.end_ns() - recording.begin_ns()) * 1e-9);
            last_row = text;
        }
        EXPECT_NE(recording.missing.find("' ends without a summary; " + last_row),
                  std::string::npos)
            << recording.missing;
        EXPECT_GE(rows, last);
        last = rows;
    }
    EXPECT_GT(last, 3000u);
}

/// A recording of 5000 rows with these chunks damaged.
struct DamagedFile : testing::Test {
    void damage(std::initializer_list<std::size_t> chunks) {
        ASSERT_TRUE(write(folder.file("a.mcap"), 5000));
        std::string bytes = content(folder.file("a.mcap"));
        Reader reader;
        ASSERT_TRUE(reader.open(open_file(folder.file("a.mcap"), problem)));
        for (const std::size_t chunk : chunks) {
            const ChunkIndex& index = reader.chunks().at(chunk);
            bytes[index.offset + index.length / 2] ^= 0x40;
        }
        put_file(folder.file("b.mcap"), bytes);
        ASSERT_TRUE(load(folder.file("b.mcap"), recording, problem));
    }
    std::size_t rows() const {
        std::size_t sum = 0;
        for (const Table& table : recording.tables) {
            sum += table.rows();
        }
        return sum;
    }

    const Folder folder;
    std::string problem;
    Recording recording;
};

TEST_F(DamagedFile, Is_read_but_for_the_damaged_chunk) {
    damage({2});
    EXPECT_NE(recording.missing.find("b.mcap': a chunk is damaged: its CRC is wrong; rows from 2 s "
                                     "to 2.999 s are missing, of '"),
              std::string::npos)
        << recording.missing;
    EXPECT_EQ(rows(), 4000u);
    EXPECT_EQ(recording.end_ns() - recording.begin_ns(), 4'999'000'000);
}

TEST_F(DamagedFile, Names_all_damaged_chunks) {
    damage({1, 4});
    EXPECT_NE(recording.missing.find("b.mcap': a chunk is damaged: its CRC is wrong; rows from 1 s "
                                     "to 1.999 s, from 4 s to 4.999 s are missing, of '"),
              std::string::npos)
        << recording.missing;
    EXPECT_EQ(rows(), 3000u);
}

TEST_F(DamagedFile, Counts_time_from_the_first_readable_row) {
    damage({0, 2});
    EXPECT_NE(
        recording.missing.find("; rows before the first readable row, from 1 s to 1.999 s are "
                               "missing, of '"),
        std::string::npos)
        << recording.missing;
    EXPECT_EQ(rows(), 3000u);
}

TEST_F(DamagedFile, Names_three_of_many_damaged_chunks) {
    damage({0, 1, 2, 3});
    EXPECT_NE(recording.missing.find(", in 1 further chunk are missing, of '"), std::string::npos)
        << recording.missing;
    EXPECT_EQ(rows(), 1000u);
}

TEST_F(DamagedFile, Without_an_undamaged_chunk_has_no_rows) {
    damage({0, 1, 2, 3, 4});
    EXPECT_NE(recording.missing.find("; all rows are missing, of '"), std::string::npos)
        << recording.missing;
}

TEST(Recording, On_a_full_disk_the_file_is_complete_up_to_there) {
    const Folder folder;
    ASSERT_TRUE(write(folder.file("whole.mcap"), 20'000));
    const auto size = std::filesystem::file_size(folder.file("whole.mcap"));
    rlimit before{};
    getrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit small{size / 2, before.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
    EXPECT_FALSE(write(folder.file("full.mcap"), 20'000));
    setrlimit(RLIMIT_FSIZE, &before);
    Recording recording;
    std::string problem;
    ASSERT_TRUE(load(folder.file("full.mcap"), recording, problem)) << problem;
    EXPECT_EQ(recording.note, "") << "it has a summary";
    ASSERT_EQ(recording.tables.size(), 1u);
    EXPECT_GT(recording.tables[0].rows(), 5000u);
    EXPECT_LT(recording.tables[0].rows(), 20'000u);
}

TEST(Recording, Names_become_distinct_identifiers) {
    const RowWriter rows({{"x.0.pos-cmd", HAL_TYPE_FLOAT, "mm"},
                          {"X-0.pos_cmd", HAL_TYPE_FLOAT, ""},
                          {"0", HAL_TYPE_BIT, ""},
                          {"--", HAL_TYPE_S32, ""}});
    EXPECT_EQ(rows.schema(), "float64 x_0_pos_cmd\nfloat64 x_0_pos_cmd_2\nint32 v\nbool v_0\n");
    EXPECT_EQ(rows.metadata().at("pin.x_0_pos_cmd_2"), "X-0.pos_cmd");
    EXPECT_EQ(rows.metadata().at("unit.x_0_pos_cmd"), "mm");
}

TEST(Recording, Rows_of_another_writer_are_read_with_their_alignment) {
    RowReader reader;
    ASSERT_TRUE(reader.open(
        {1, "a/msg/B", "ros2msg", "bool on # a comment\nint16 n\nuint8 MOST=5\n\nfloat32 v\n"},
        {1, 1, "/a", "cdr", {}}));
    std::vector<std::uint64_t> row;
    ASSERT_TRUE(reader.read(std::string_view("\0\1\0\0\1\0\xfe\xff\0\0\xc0\x3f", 12), row));
    EXPECT_EQ(row[0], 1u);
    EXPECT_EQ(static_cast<std::int64_t>(row[1]), -2);
    EXPECT_EQ(std::bit_cast<double>(row[2]), 1.5);
    EXPECT_FALSE(reader.read(std::string_view("\0\1\0\0\1", 5), row));
    EXPECT_FALSE(reader.open({1, "a/msg/B", "ros2msg", "float64[] v\n"}, {1, 1, "/a", "cdr", {}}));
    EXPECT_EQ(reader.problem(), "its schema has no number: v (float64[]) is skipped");
    EXPECT_FALSE(reader.open({1, "a/msg/B", "ros2msg", "string v\n"}, {1, 1, "/a", "cdr", {}}));
}

TEST(Recording, What_is_not_a_recording_is_rejected) {
    const Folder folder;
    Recording recording;
    std::string problem;
    EXPECT_FALSE(load(folder.file("nowhere.mcap"), recording, problem));
    EXPECT_NE(problem.find("No such file"), std::string::npos);
    put_file(folder.file("a.mcap"), "hello");
    EXPECT_FALSE(load(folder.file("a.mcap"), recording, problem));
    EXPECT_NE(problem.find("not an MCAP file"), std::string::npos);
    put_file(folder.file("a.csv"), "time_s,a\n0.1,1\n0.2,x\n");
    EXPECT_FALSE(load(folder.file("a.csv"), recording, problem));
    EXPECT_NE(problem.find("line 3"), std::string::npos) << problem;
}

/// An MCAP file of another writer: nothing of it is in a chunk, and it has no summary.
std::string without_chunks(std::string_view encoding, std::string_view schema_encoding,
                           std::string_view schema, std::string_view payload) {
    std::string file(magic), content;
    const auto add = [&](Opcode opcode) {
        put_record(file, opcode, content);
        content.clear();
    };
    put_text(content, "");
    put_text(content, "other");
    add(op_header);
    put(content, std::uint16_t{1});
    for (const std::string_view text : {std::string_view("p/msg/X"), schema_encoding, schema}) {
        put_text(content, text);
    }
    add(op_schema);
    put(content, std::uint16_t{1});
    put(content, std::uint16_t{1});
    for (const std::string_view text : {std::string_view("/t"), encoding, std::string_view()}) {
        put_text(content, text);
    }
    add(op_channel);
    for (std::uint32_t i = 0; i < 100; ++i) {
        put(content, std::uint16_t{1});
        put(content, i);
        put(content, start_ns + i * period_ns);
        put(content, std::uint64_t{0});
        content += payload;
        add(op_message);
    }
    put(content, std::uint32_t{0});
    add(op_data_end);
    content.assign(20, '\0');
    add(op_footer);
    return file + std::string(magic);
}

TEST(Recording, Messages_without_a_chunk_are_read) {
    const Folder folder;
    const std::string whole = without_chunks("cdr", "ros2msg", "float64 a\n",
                                             std::string_view("\0\1\0\0\0\0\0\0\0\0\xf8\x3f", 12));
    put_file(folder.file("a.mcap"), whole);
    Recording recording;
    std::string problem;
    ASSERT_TRUE(load(folder.file("a.mcap"), recording, problem)) << problem;
    EXPECT_EQ(recording.missing, "") << "such a file is whole";
    ASSERT_EQ(recording.tables.size(), 1u);
    ASSERT_EQ(recording.tables[0].rows(), 100u);
    EXPECT_EQ(recording.tables[0].real(99, 0), 1.5);
    EXPECT_EQ(recording.end_ns(), static_cast<std::int64_t>(start_ns + 99 * period_ns));
    put_file(folder.file("cut.mcap"), std::string_view(whole).substr(0, whole.size() - 500));
    Recording cut;
    ASSERT_TRUE(load(folder.file("cut.mcap"), cut, problem)) << problem;
    EXPECT_NE(cut.missing, "");
    ASSERT_EQ(cut.tables.size(), 1u);
    EXPECT_GT(cut.tables[0].rows(), 80u);
    EXPECT_LT(cut.tables[0].rows(), 100u);
}

TEST(Recording, What_cannot_be_read_is_named) {
    const Folder folder;
    const auto unread = [&](const std::string& bytes) {
        put_file(folder.file("a.mcap"), bytes);
        Recording recording;
        std::string problem;
        EXPECT_TRUE(load(folder.file("a.mcap"), recording, problem)) << problem;
        EXPECT_TRUE(recording.tables.empty());
        return recording.unread.substr(0, recording.unread.find(';'));
    };
    EXPECT_EQ(unread(without_chunks("json", "jsonschema", "{}", "{}")),
              "topic '/t' is not read: its messages are 'json'");
    EXPECT_EQ(unread(without_chunks("cdr", "ros2idl", "", "")),
              "topic '/t' is not read: its schema is 'ros2idl'");
    EXPECT_EQ(unread(without_chunks("cdr", "ros2msg", "float64[] a\n", "")),
              "topic '/t' is not read: its schema has no number: a (float64[]) is skipped");
    EXPECT_EQ(unread(without_chunks("cdr", "ros2msg", "", "")),
              "topic '/t' is not read: its schema has no field");
    EXPECT_EQ(unread(without_chunks("cdr", "ros2msg", "float64 a\n", "")),
              "a message of topic '/t' is shorter than its schema, or not plain CDR");
}

/// Files that the Python package mcap has written: 40 rows of a header and a number.
void expect_rows_of_another_writer(const std::string& name) {
    Recording recording;
    std::string problem;
    ASSERT_TRUE(load("tests/fuzz/corpus/recording/" + name, recording, problem)) << problem;
    EXPECT_EQ(recording.note, "");
    EXPECT_EQ(recording.skipped,
              std::vector<std::string>{"topic '/real': not read: header.frame_id (string)"});
    ASSERT_EQ(recording.tables.size(), 1u) << recording.unread;
    const Table& table = recording.tables[0];
    ASSERT_EQ(table.rows(), 40u);
    ASSERT_EQ(table.columns.size(), 3u);
    EXPECT_EQ(table.columns[0].name, "header.stamp.sec");
    EXPECT_EQ(table.columns[2].name, "a");
    EXPECT_EQ(table.real(39, 1), 39);
    EXPECT_EQ(table.real(39, 2), 39.5);
}

TEST(Recording, Chunks_compressed_with_lz4_are_read) {
    expect_rows_of_another_writer("lz4_chunks.mcap");
}

TEST(Recording, A_summary_that_omits_channels_and_schemas_is_completed) {
    expect_rows_of_another_writer("omitted_channels.mcap");
    expect_rows_of_another_writer("bare_summary.mcap");
}

TEST(Recording, A_chunk_that_cannot_be_expanded_is_named) {
    const Folder folder;
    std::string bytes = content("tests/fuzz/corpus/recording/lz4_chunks.mcap");
    for (std::size_t at = bytes.find("lz4"); at != bytes.npos; at = bytes.find("lz4", at)) {
        bytes.replace(at, 3, "lz5");
    }
    // with its index, and without
    for (const std::size_t end : {bytes.size(), bytes.size() * 9 / 10}) {
        put_file(folder.file("a.mcap"), std::string_view(bytes).substr(0, end));
        Recording recording;
        std::string problem;
        ASSERT_TRUE(load(folder.file("a.mcap"), recording, problem)) << problem;
        EXPECT_TRUE(recording.tables.empty());
        EXPECT_EQ(recording.unread, "unsupported compression 'lz5'; supported: zstd, lz4 and none")
            << end;
    }
}

TEST(Recording, Lz4_is_expanded_to_the_size_that_is_announced) {
    // `lz4.frame.compress(b"abcabcabc" * 10)` of the Python package lz4
    const std::string_view frame(
        "\x04\x22\x4d\x18\x68\x40\x5a\x00\x00\x00\x00\x00\x00\x00\xec\x0d\x00\x00\x00\x3f\x61\x62"
        "\x63\x03"
        "\x00\x3f\x50\x62\x63\x61\x62\x63\x00\x00\x00\x00",
        36);
    const std::string expected = [] {
        std::string text;
        for (int i = 0; i < 30; ++i) {
            text += "abc";
        }
        return text;
    }();
    std::string to, problem;
    EXPECT_TRUE(expand("lz4", frame, 90, to, problem)) << problem;
    EXPECT_EQ(to, expected);
    EXPECT_TRUE(expand("lz4", std::string(frame) + std::string(frame), 180, to, problem))
        << "two frames";
    EXPECT_EQ(to, expected + expected);
    for (const std::uint64_t size : {89, 91, 1 << 28}) {
        EXPECT_FALSE(expand("lz4", frame, size, to, problem)) << size;
    }
    for (std::size_t end = 0; end < frame.size(); ++end) {
        EXPECT_FALSE(expand("lz4", frame.substr(0, end), 90, to, problem)) << end;
    }
    std::string damaged(frame);
    damaged[8] ^= 0x10;
    EXPECT_FALSE(expand("lz4", damaged, 90, to, problem));
    EXPECT_EQ(problem, "a chunk does not decompress");
}

TEST(Recording, A_table_has_the_types_that_are_given) {
    const Folder folder;
    put_file(folder.file("a.csv"),
             "time_s,on,n,big\n-0.002,1,-5,9007199254740993\n-0.001,0,2147483648,"
             "18446744073709551615\n");
    Recording recording;
    std::string problem;
    const auto get = [&](std::map<std::string, hal_type> types) {
        recording = {};
        return load(folder.file("a.csv"), recording, problem, {.types = std::move(types)});
    };
    ASSERT_TRUE(get({{"on", HAL_TYPE_BIT}, {"n", HAL_TYPE_S64}, {"big", HAL_TYPE_U64}})) << problem;
    const Table& table = recording.tables[0];
    EXPECT_EQ(recording.begin_ns(), -2'000'000);
    EXPECT_EQ(recording.end_ns(), -1'000'000);
    EXPECT_EQ(table.word(0, 0), 1u);
    EXPECT_EQ(static_cast<std::int64_t>(table.word(0, 1)), -5);
    EXPECT_EQ(table.word(0, 2), 9007199254740993u);
    EXPECT_EQ(table.word(1, 2), UINT64_MAX);
    EXPECT_FALSE(get({{"n", HAL_TYPE_S32}}));
    EXPECT_NE(problem.find("line 3: '2147483648' of 'n' is not a value of type s32"),
              std::string::npos)
        << problem;
    EXPECT_FALSE(get({{"n", HAL_TYPE_BIT}}));
    EXPECT_NE(problem.find("line 2: '-5' of 'n' is not a value of type bit"), std::string::npos)
        << problem;
}

TEST(Recording, Values_of_two_threads_are_two_tables) {
    const Folder folder;
    const std::string path = folder.file("a.csv");
    put_file(path, "time_s,a,b,c\n0.001,1,,2\n0.002,3,,4\n0.002,,5,\n0.003,,,6\n0.003,7,,\n");
    Recording recording;
    std::string problem;
    ASSERT_TRUE(load(path, recording, problem)) << problem;
    ASSERT_EQ(recording.tables.size(), 2u);
    EXPECT_EQ(recording.tables[0].columns.at(1).name, "c");
    EXPECT_EQ(recording.tables[0].rows(), 4u);
    EXPECT_EQ(recording.tables[0].real(3, 0), 7.0);
    EXPECT_EQ(recording.tables[0].real(3, 1), 6.0) << "an empty value is as before";
    EXPECT_EQ(recording.tables[1].columns.at(0).name, "b");
    EXPECT_EQ(recording.tables[1].times_ns, std::vector<std::int64_t>{2'000'000});
    EXPECT_EQ(recording.note, "'" + path + "': 1 row has the time of the row before");
}

TEST(Recording, A_table_that_is_cut_or_ambiguous_is_no_secret) {
    const Folder folder;
    const std::string path = folder.file("a.csv");
    Recording recording;
    std::string problem;
    put_file(path, "time_s,a,b\n0.1,1,2\n0.1,1,3\n0.1,1,4\n0.2,5,-0.03");
    ASSERT_TRUE(load(path, recording, problem)) << problem;
    EXPECT_EQ(recording.notes(),
              (std::vector{"'" + path +
                               "': the last line has no line end; its value of 'b' may be cut, and "
                               "rows after it may be missing",
                           "'" + path + "': 2 rows have the time of the row before"}));
    for (const char* const last : {"0.2,5", "0.2,5,-", "0."}) {
        recording = {};
        put_file(path, std::string("time_s,a,b\n0.1,1,2\n0.15,1,3\n") + last);
        ASSERT_TRUE(load(path, recording, problem)) << problem;
        EXPECT_EQ(recording.missing, "'" + path +
                                         "', line 4: the line is cut off; rows after 0.05 s are "
                                         "missing, of a, b");
        EXPECT_EQ(recording.tables.at(0).rows(), 2u) << last;
    }
    recording = {};
    put_file(path, "time_s,a,b\n0.1,1,2\n");
    ASSERT_TRUE(load(path, recording, problem)) << problem;
    EXPECT_TRUE(recording.notes().empty());
    put_file(path, "time_s,a,b,a\n0.1,1,2,3\n");
    EXPECT_FALSE(load(path, recording, problem));
    EXPECT_EQ(problem, "'" + path + "', line 1: column 'a' occurs twice");
}

TEST(Recording, Crc_is_that_of_zlib) {
    EXPECT_EQ(crc32("123456789"), 0xCBF43926u);
    EXPECT_EQ(crc32("6789", crc32("12345")), 0xCBF43926u);
    EXPECT_EQ(crc32(""), 0u);
}

}  // namespace
}  // namespace hal::mcap
