// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "control/client.hpp"
#include "control/probe_client.hpp"
#include "scope/samples.hpp"

namespace hal::tools {

/// Samples of a running instance as they arrive.
class Input {
public:
    /// Connects to an instance ("": the one that is wanted). Returns false and sets `problem`.
    bool connect(const std::string& instance, std::string& problem);
    /// Returns the words with patterns replaced by the names of pins, parameters and signals that
    /// match. Sets `problem` when one matches nothing.
    std::vector<std::string> expand(const std::vector<std::string>& words, std::string& problem);
    /// Attaches a probe to the names, each once. Returns false and sets `problem`.
    bool attach(const std::vector<std::string>& names, int every, std::string& problem);

    using Take = std::function<void(std::size_t channel, Sample sample)>;
    struct Batch {
        std::int64_t until_ns = 0;  ///< no sample from before this time will come
        bool lost = false;  ///< samples are missing before those of this batch
    };
    /// Takes what has come, and waits for it up to `timeout_ms`; `begin` and `done` are called for
    /// each batch. Returns false when the connection is lost.
    bool take(int timeout_ms, const Take& take, const std::function<void(const Batch&)>& begin = {},
              const std::function<void(const Batch&)>& done = {});

    const std::vector<Channel>& channels() const { return channels_; }
    int fd() const { return client_->fd(); }
    std::uint64_t lost() const { return probe_->lost(); }
    std::uint64_t rows() const { return rows_; }
    /// Returns the reason for the end of the connection.
    std::string end_reason() const;

private:
    std::unique_ptr<Client> client_;
    std::unique_ptr<ProbeClient> probe_;
    ProbeBatch batch_;
    std::vector<Channel> channels_;
    std::uint64_t rows_ = 0;
};

}  // namespace hal::tools
