// SPDX-License-Identifier: MIT
// Compression of chunks: zstd and lz4, each where the build has its library. Only zstd is written.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace hal::mcap {

/// Compresses with a context that is made once.
class Compressor {
public:
    Compressor();
    ~Compressor();
    Compressor(const Compressor&) = delete;

    /// Returns the format's name for what compress() makes: "zstd", or "" when it leaves the bytes
    /// as they are.
    static const char* name();
    /// Replaces `to` by the compressed bytes.
    void compress(std::string_view bytes, std::string& to);

private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Expands bytes to exactly `size` bytes. Returns false and sets `problem` when the format is
/// unknown or the bytes are damaged.
bool expand(std::string_view compression, std::string_view bytes, std::uint64_t size,
            std::string& to, std::string& problem);

}  // namespace hal::mcap
