// SPDX-License-Identifier: MIT
// A probe of a running instance, seen from a tool: docs/protocol.md, "probe". One thread at a time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "control/client.hpp"
#include "machine/run/probes.hpp"

namespace hal {

/// Rows of all groups up to one instant.
class ProbeBatch {
public:
    struct Part {
        std::size_t group = 0;
        std::size_t rows = 0;
        std::size_t columns = 0;  ///< columns: of the group
        /// rows that did not fit into the ring since the part before
        std::uint64_t lost = 0;
        std::size_t offset = 0;  ///< in the bytes
    };
    std::uint64_t layout = 0;
    /// all rows of earlier cycles are in this batch or in an earlier one
    std::int64_t until_ns = 0;
    std::vector<Part> parts;

    std::uint64_t cycle(const Part& part, std::size_t row) const { return word(part, row, 0); }
    /// Returns when the row's cycle was due, on the machine's clock.
    std::int64_t time_ns(const Part& part, std::size_t row) const {
        return static_cast<std::int64_t>(word(part, row, 1));
    }
    /// Returns the value of a column of the group: bits of a double, or an integer, sign-extended.
    std::uint64_t raw(const Part& part, std::size_t row, std::size_t column) const {
        return word(part, row, column + 2);
    }
    /// Returns it as a double, whatever its type.
    double real(const Part& part, std::size_t row, std::size_t column, hal_type type) const;

    /// Calls f(part, row) for all rows, the oldest first. Rows of equal time come in the order of
    /// their groups.
    template <class F>
    void in_time_order(F f) const {
        std::vector<std::size_t> next(parts.size());
        for (;;) {
            std::size_t first = parts.size();
            for (std::size_t i = 0; i < parts.size(); ++i) {
                if (next[i] < parts[i].rows &&
                    (first == parts.size() ||
                     time_ns(parts[i], next[i]) < time_ns(parts[first], next[first]))) {
                    first = i;
                }
            }
            if (first == parts.size()) return;
            f(parts[first], next[first]++);
        }
    }

    std::string bytes;

private:
    std::uint64_t word(const Part& part, std::size_t row, std::size_t word) const {
        std::uint64_t value;
        std::memcpy(&value, bytes.data() + part.offset + (row * (part.columns + 2) + word) * 8, 8);
        return value;
    }
};

class ProbeClient {
public:
    struct Options {
        std::uint32_t every = 1;  ///< cycles of each thread from one row to the next
        int batch_ms = 20;
        int buffer_ms = 2000;
        bool journal = false;  ///< entries of the machine's journal as well
    };
    /// Attaches to pins, parameters and signals. Returns nullptr and sets `problem`. Takes all
    /// events of `client`, which must outlive it.
    static std::unique_ptr<ProbeClient> attach(Client& client,
                                               const std::vector<std::string>& names,
                                               const Options& options, std::string& problem);
    ~ProbeClient();  ///< detaches
    ProbeClient(const ProbeClient&) = delete;

    const std::vector<ProbeColumn>& columns() const { return columns_; }
    /// Returns the groups of the newest layout.
    const std::vector<ProbeGroup>& groups() const { return layout_.groups; }
    /// Returns the Unix time of an instant of the machine's clock.
    std::int64_t unix_ns(std::int64_t time_ns) const { return time_ns + unix_offset_ns_; }
    /// Returns how many rows were lost since the probe was attached.
    std::uint64_t lost() const { return lost_; }

    enum class Got {
        batch,
        layout,  ///< groups() has changed; later batches have the new one
        journal,  ///< entry() is new
        nothing,  ///< nothing has come within the time
        disconnected,
    };
    /// Waits for the next of these.
    Got next(ProbeBatch& batch, int timeout_ms);
    struct Entry {
        std::int64_t time_ns = 0;
        std::string kind, text;  ///< kind: fault, edit, command, message
    };
    const Entry& entry() const { return entry_; }

private:
    explicit ProbeClient(Client& client) : client_(client) {}
    bool read_groups(const nlohmann::json& from);
    bool read_batch(const nlohmann::json& event, std::string&& payload, ProbeBatch& batch);

    Client& client_;
    std::uint64_t number_ = 0;
    std::uint64_t lost_ = 0;
    std::vector<ProbeColumn> columns_;
    ProbeLayout layout_;
    std::int64_t unix_offset_ns_ = 0;
    Entry entry_;
};

}  // namespace hal
