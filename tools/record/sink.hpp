// SPDX-License-Identifier: MIT
// A file that samples go to.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "control/probe_client.hpp"

namespace hal::mcap {
class Writer;
}

namespace hal::tools {

/// Where a recording comes from.
struct Origin {
    std::string instance, version, netlist, cause;
    std::int64_t unix_offset_ns = 0;  ///< from the machine's clock to Unix time
    std::string profile = {};         ///< of an .mcap: "ros2", or ""
};

class Sink {
public:
    virtual ~Sink() = default;
    /// Begins another layout; called before its first row.
    virtual bool layout(const std::vector<ProbeGroup>& groups) = 0;
    /// Adds a row: `words` has one word per column of the group, docs/protocol.md.
    virtual bool row(std::size_t group, std::uint64_t cycle, std::int64_t time_ns,
                     const std::uint64_t* words) = 0;
    virtual bool event(const ProbeClient::Entry& entry) = 0;
    /// Writes what is waiting.
    virtual bool flush() = 0;
    /// Completes the file. Returns false when something could not be written.
    virtual bool close() = 0;
    virtual std::uint64_t bytes() const = 0;
    virtual int error() const = 0;  ///< errno of the first failure, or 0
    /// Why nothing more is written: a reason without the name of the file; "" when nothing failed.
    virtual std::string problem() const = 0;
    /// What the unfinished file of an earlier recorder is called now; "" when there was none.
    virtual std::string kept() const { return ""; }
    /// After close(): the file that has what was written, "" if nothing was, and its number of
    /// rows.
    virtual std::string where() const = 0;
    virtual std::uint64_t rows() const = 0;
    /// After close(): true when the file had nothing and was removed.
    virtual bool removed() const { return false; }
};

/// The sink for a path, by its ending: .mcap or .csv.
std::unique_ptr<Sink> make_sink(const std::string& path, const std::vector<ProbeColumn>& columns,
                                const Origin& origin);
std::unique_ptr<Sink> make_mcap_sink(const std::string& path,
                                     const std::vector<ProbeColumn>& columns, const Origin& origin);
std::unique_ptr<Sink> make_csv_sink(const std::string& path,
                                    const std::vector<ProbeColumn>& columns);

/// The same into a file that another one writes, too: close() writes only what is waiting. The
/// writer outlives the sink.
std::unique_ptr<Sink> make_mcap_sink(mcap::Writer& writer, const std::vector<ProbeColumn>& columns,
                                     const Origin& origin);

/// Returns why a file cannot have that profile; "" when it can.
std::string unsupported_profile(const std::string& profile, const std::string& path);

/// Returns "cannot write 'FILE': REASON; WHAT REMAINS" for a sink that failed. Closes it.
std::string cannot_write(Sink& sink, const std::string& path);
/// Returns the line that states where the unfinished file of an earlier recorder is now; "" when
/// there was none.
std::string kept_line(const Sink& sink, const std::string& path);

/// Adds the rows of a batch with begin <= time < end, in the order of time. Returns false after a
/// failed write.
bool add_batch(Sink& sink, const ProbeBatch& batch, std::int64_t begin_ns, std::int64_t end_ns,
               std::uint64_t& rows);

}  // namespace hal::tools
