// SPDX-License-Identifier: MIT
#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <fmt/core.h>
#include <unistd.h>

#include "link/record_file.hpp"
#include "record/csv_field.hpp"
#include "record/sink.hpp"
#include "recording/mcap/held_file.hpp"

namespace hal::tools {
namespace {

/// A line per row: the time, then all values; those of other threads are empty. Events have no
/// place in it.
class CsvSink final : public Sink {
public:
    ~CsvSink() override { close(); }
    CsvSink(const std::string& path, const std::vector<ProbeColumn>& columns)
        : columns_(columns), path_(path), held_(mcap::hold_file(path)), file_(held_.file) {
        if (held_.file < 0) return;
        std::string line = "time_s";
        for (const ProbeColumn& column : columns_) {
            line += "," + csv_field(column.name);
        }
        put(line + "\n");
    }

    bool layout(const std::vector<ProbeGroup>& groups) override {
        groups_ = groups;
        return error() == 0;
    }

    bool row(std::size_t group, std::uint64_t, std::int64_t time_ns,
             const std::uint64_t* words) override {
        cells_.assign(columns_.size(), "");
        for (const std::size_t i : groups_[group].columns) {
            cells_[i] = text(columns_[i].type, *words++);
        }
        std::string line =
            fmt::format("{}.{:09}", time_ns / 1'000'000'000, time_ns % 1'000'000'000);
        for (const std::string& cell : cells_) {
            (line += ',') += cell;
        }
        return put(line + "\n");
    }

    bool event(const ProbeClient::Entry&) override { return true; }
    bool flush() override { return error() == 0 && file_.flush(); }
    bool close() override {
        file_.close();
        if (held_.file >= 0 && ::close(held_.file) != 0 && closing_ == 0) {
            closing_ = errno;
        }
        held_.file = -1;
        return error() == 0;
    }
    std::uint64_t bytes() const override { return bytes_; }
    int error() const override {
        if (held_.error != 0) return held_.error;
        if (file_.error() != 0) return file_.error();
        return closing_;
    }
    std::string problem() const override {
        if (!held_.problem.empty()) return held_.problem;
        if (error() != 0) return std::strerror(error());
        return "";
    }
    std::string where() const override { return held_.error == 0 ? path_ : ""; }
    std::uint64_t rows() const override { return file_.records() == 0 ? 0 : file_.records() - 1; }

private:
    static std::string text(hal_type type, std::uint64_t word) {
        // reads as the same value
        if (type == HAL_TYPE_FLOAT) {
            return fmt::format("{}", std::bit_cast<double>(word));
        }
        if (type == HAL_TYPE_S32 || type == HAL_TYPE_S64) {
            return std::to_string(static_cast<std::int64_t>(word));
        }
        return std::to_string(word);
    }
    bool put(const std::string& line) {
        if (error() != 0) return false;
        bytes_ += line.size();
        return file_.put(line);
    }

    const std::vector<ProbeColumn> columns_;
    std::vector<ProbeGroup> groups_;
    std::vector<std::string> cells_;
    std::uint64_t bytes_ = 0;
    const std::string path_;
    mcap::HeldFile held_;
    RecordFile file_;
    int closing_ = 0;
};

}  // namespace

std::unique_ptr<Sink> make_csv_sink(const std::string& path,
                                    const std::vector<ProbeColumn>& columns) {
    return std::make_unique<CsvSink>(path, columns);
}

std::string unsupported_profile(const std::string& profile, const std::string& path) {
    if (profile.empty()) return "";
    if (profile != "ros2") return "unknown --profile '" + profile + "'; supported: ros2";
    return path.ends_with(".mcap") ? "" : "--profile is for a recording that ends in .mcap";
}

std::unique_ptr<Sink> make_sink(const std::string& path, const std::vector<ProbeColumn>& columns,
                                const Origin& origin) {
    return path.ends_with(".csv") ? make_csv_sink(path, columns)
                                  : make_mcap_sink(path, columns, origin);
}

namespace {

/// After close(): where the rows are that were written, or that there are none.
std::string what_remains(const Sink& sink, const std::string& path) {
    const std::string where = sink.where();
    if (sink.removed()) return "; no row was written, and the file was removed";
    if (where.empty()) return "";
    if (sink.rows() == 0) return "; no row was written: '" + where + "' has none";
    if (where == path) return "; the file is complete up to there";
    return "; what was recorded is in '" + where + "'";
}

}  // namespace

std::string cannot_write(Sink& sink, const std::string& path) {
    const std::string problem = sink.problem();
    sink.close();
    return fmt::format("cannot write '{}': {}{}", path, problem, what_remains(sink, path));
}

std::string kept_line(const Sink& sink, const std::string& path) {
    if (sink.kept().empty()) return "";
    return fmt::format("'{}.part' was left by a recorder that was killed; it is now '{}'\n", path,
                       sink.kept());
}

bool add_batch(Sink& sink, const ProbeBatch& batch, std::int64_t begin_ns, std::int64_t end_ns,
               std::uint64_t& rows) {
    bool good = true;
    std::vector<std::uint64_t> words;
    batch.in_time_order([&](const ProbeBatch::Part& part, std::size_t row) {
        const std::int64_t time_ns = batch.time_ns(part, row);
        if (!good || time_ns < begin_ns || time_ns >= end_ns) return;
        words.clear();
        for (std::size_t c = 0; c < part.columns; ++c) {
            words.push_back(batch.raw(part, row, c));
        }
        good = sink.row(part.group, batch.cycle(part, row), time_ns, words.data());
        rows += good ? 1 : 0;
    });
    return good;
}

}  // namespace hal::tools
