// SPDX-License-Identifier: MIT
#include "classic_streams.hpp"

#include <cstdint>
#include <cstdlib>
#include <fmt/core.h>
#include <getopt.h>

#include "cli/output.hpp"
#include "inspect/play.hpp"
#include "inspect/record.hpp"

namespace hal::tools {
namespace {

/// Reads the options of halsampler or halstreamer: -c and -n are numbers; `take` handles the
/// letters of one of them.
template <class O>
int sampler_or_streamer(int argc, char** argv, const char* program, const char* letters,
                        bool (*take)(int letter, std::uint64_t number, O&), int (*run)(const O&)) {
    O options;
    options.program = program;
    options.classic = true;
    options.line.assign(argv, argv + argc);
    for (int letter; (letter = ::getopt(argc, argv, letters)) != -1;) {
        char* end = nullptr;
        const std::uint64_t number = ::optarg ? std::strtoull(::optarg, &end, 10) : 0;
        if ((letter == 'c' || letter == 'n') &&
            (*::optarg < '0' || *::optarg > '9' || *end != '\0')) {
            return fail(options,
                        fmt::format("-{} {}: not a number", static_cast<char>(letter), ::optarg));
        }
        switch (letter) {
        case 'c': options.channel = ::optarg; break;
        case 'N': options.name_as_component = ::optarg; break;
        default:
            if (!take(letter, number, options)) return 1;
        }
    }
    options.words.assign(argv + ::optind, argv + argc);
    if (options.words.size() > 1) {
        return fail(options, fmt::format("unexpected second file '{}'", options.words[1]));
    }
    return run(options);
}

bool parse_sampler_letter(int letter, std::uint64_t number, RecordOptions& options) {
    switch (letter) {
    case 'n':
        options.count = number;
        options.no_samples = number == 0;
        return true;
    case 't': options.tag = true; return true;
    default: return false;
    }
}

bool parse_streamer_letter(int, std::uint64_t, PlayOptions&) { return false; }

}  // namespace

int halsampler(int argc, char** argv) {
    return sampler_or_streamer(argc, argv, "halsampler", "c:n:tN:", parse_sampler_letter,
                               run_record);
}
int halstreamer(int argc, char** argv) {
    return sampler_or_streamer(argc, argv, "halstreamer", "c:N:", parse_streamer_letter, run_play);
}

}  // namespace hal::tools
