// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "inspect/stream_options.hpp"

namespace hal::tools {

struct RecordOptions : StreamOptions {
    std::uint64_t count = 0;  ///< 0: unlimited
    bool csv = false, tag = false;

    void declare(OptionSet& set) override {
        set.words("CHANNEL FILE", "number of the sampler (default 0), then the file to write (default: standard output)", false);
        set.value("-c,--channel", channel, "CHANNEL", "a sampler, by number or by instance name");
        set.flag("--csv", csv, "comma-separated, with the time of each sample and a line of column names first");
        set.value("-n,--count", count, "N", "end after N samples");
        set.flag("-t,--tag", tag, "begin each line with the sample number");
        set.value("-N,--name", name, "NAME", "the instance to read from");
    }
};

/// Runs `hal record`, and halsampler. Returns the exit code.
int run_record(const RecordOptions&);

}  // namespace hal::tools
