// SPDX-License-Identifier: MIT
#pragma once

#include "inspect/stream_options.hpp"

namespace hal::tools {

struct PlayOptions : StreamOptions {
    void declare(OptionSet& set) override {
        set.words(
            "CHANNEL FILE",
            "number of the streamer (default 0), then the file to read (default: standard input)",
            false);
        set.value("-c,--channel", channel, "CHANNEL", "a streamer, by number or by instance name");
        set.value("-N,--name", name, "NAME", "the instance to feed");
    }
};

/// Runs `hal play`, and halstreamer. Returns the exit code.
int run_play(const PlayOptions&);

}  // namespace hal::tools
