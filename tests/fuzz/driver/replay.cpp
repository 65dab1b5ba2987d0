// SPDX-License-Identifier: MIT
// Runs a fuzz target over its corpus without libFuzzer: every file as it is, cut short at each of
// up to 64 places, and with single bytes changed, so that any compiler and any sanitizer can repeat
// what a fuzzer once found.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

constexpr std::size_t places_per_file = 64;
constexpr std::uint8_t replacements[] = {0x00, '\n', '"', '[', '$', '{', 0x80, 0xff};

// Input in a buffer of exactly its size, so that the address sanitizer sees a read beyond its end.
void run(const std::vector<std::uint8_t>& input) {
    const std::vector<std::uint8_t> exact(input.begin(), input.end());
    LLVMFuzzerTestOneInput(exact.data(), exact.size());
}

void replay(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    std::vector<std::uint8_t> input{std::istreambuf_iterator<char>(in), {}};
    run(input);
    const std::size_t step = input.size() / places_per_file + 1;
    for (std::size_t at = 0; at < input.size(); at += step) {
        run({input.begin(), input.begin() + static_cast<std::ptrdiff_t>(at)});
        const std::uint8_t kept = input[at];
        for (const std::uint8_t other : replacements) {
            input[at] = other;
            run(input);
        }
        input[at] = kept;
    }
}

}  // namespace

int main(int argc, char** argv) {
    std::size_t files = 0;
    for (int i = 1; i < argc; ++i) {
        // an option of libFuzzer: the same command line starts either program
        if (argv[i][0] == '-') continue;
        if (std::filesystem::is_directory(argv[i])) {
            for (const auto& entry : std::filesystem::recursive_directory_iterator(argv[i])) {
                if (!entry.is_regular_file()) continue;
                replay(entry.path());
                ++files;
            }
        } else {
            replay(argv[i]);
            ++files;
        }
    }
    std::printf("%zu files replayed\n", files);
    return files == 0 ? 1 : 0;  // an empty corpus tests nothing
}
