// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "inspect/stream_options.hpp"
#include "record/recorder.hpp"

namespace hal::tools {

struct RecordOptions : StreamOptions {
    std::uint64_t count = 0;  ///< 0: unlimited
    bool no_samples = false;  ///< ends at once: halsampler -n 0
    bool csv = false;
    bool tag = false;
    Recording values;         ///< without a sampler

    void declare(OptionSet& set) override {
        set.words("FILE NAMES",
                  "file to write (.mcap or .csv), then pins, parameters and signals, or patterns "
                  "like 'x-*'. Or, of a sampler: its number "
                  "(default 0), then the file (default: standard output)",
                  false);
        set.value("-c,--channel", channel, "CHANNEL", "a sampler, by number or by instance name");
        set.flag("--csv", csv,
                 "comma-separated, with the time of each sample and a line of column names first");
        set.value("-n,--count", count, "N", "end after N samples");
        set.flag("-t,--tag", tag, "begin each line with the sample number");
        set.value("-N,--name", name, "NAME", "the instance to read from");
        values.declare(set);
    }
};

/// Runs `hal record`, and halsampler. Returns the exit code.
int run_record(const RecordOptions&);

}  // namespace hal::tools
