// SPDX-License-Identifier: MIT
#pragma once

#include "inspect/stream_options.hpp"

namespace hal::tools {

struct PlayOptions : StreamOptions {
    void declare(OptionSet& set) override {
        set.words("CHANNEL FILE", "the number of the streamer (default 0), then the file to read (default: standard input)", false);
        set.value("-c,--channel", channel, "CHANNEL", "a streamer by its number or by its instance's name");
        set.value("-N,--name", name, "NAME", "of the instance to feed");
    }
};

/// `hal play`, and halstreamer. Returns the exit code.
int run_play(const PlayOptions&);

}  // namespace hal::tools
