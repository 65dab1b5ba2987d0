// SPDX-License-Identifier: MIT
#include "recording/mcap/compression.hpp"

#ifdef HALCYON_ZSTD
#include <zstd.h>
#endif
#ifdef HALCYON_LZ4
#include <lz4frame.h>
#endif

namespace hal::mcap {

#ifdef HALCYON_ZSTD
struct Compressor::State {
    ZSTD_CCtx* context = ZSTD_createCCtx();
    ~State() { ZSTD_freeCCtx(context); }
};
#else
struct Compressor::State {};
#endif

Compressor::Compressor() : state_(std::make_unique<State>()) {}
Compressor::~Compressor() = default;

#ifdef HALCYON_ZSTD
const char* Compressor::name() { return "zstd"; }

void Compressor::compress(std::string_view bytes, std::string& to) {
    constexpr int level = 1;  // 250 MB/s; level 3 is a tenth smaller at half the speed
    to.resize(ZSTD_compressBound(bytes.size()));
    const std::size_t size =
        ZSTD_compressCCtx(state_->context, to.data(), to.size(), bytes.data(), bytes.size(), level);
    to.resize(ZSTD_isError(size) ? 0 : size);
}
#else
const char* Compressor::name() { return ""; }
void Compressor::compress(std::string_view bytes, std::string& to) { to = bytes; }
#endif

namespace {

#ifdef HALCYON_ZSTD
bool expand_zstd(std::string_view bytes, std::uint64_t size, std::string& to) {
    const auto known = ZSTD_getFrameContentSize(bytes.data(), bytes.size());
    const bool single = ZSTD_findFrameCompressedSize(bytes.data(), bytes.size()) == bytes.size();
    if (single && known != ZSTD_CONTENTSIZE_UNKNOWN && known != size) return false;
    to.resize(static_cast<std::size_t>(size));
    const std::size_t got = ZSTD_decompress(to.data(), to.size(), bytes.data(), bytes.size());
    return !ZSTD_isError(got) && got == size;
}
#endif

#ifdef HALCYON_LZ4
// Frames of the LZ4 frame format, one or several.
bool expand_lz4(std::string_view bytes, std::uint64_t size, std::string& to) {
    // of the format: a larger claim is not worth its memory
    constexpr std::uint64_t max_ratio = 255;
    if (size > max_ratio * (bytes.size() + 1)) return false;
    LZ4F_dctx* made = nullptr;
    if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION))) return false;
    const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
        made, LZ4F_freeDecompressionContext);
    to.resize(static_cast<std::size_t>(size));
    std::size_t done = 0;
    std::size_t expected = 1;  // bytes that the frame still needs; 0 at its end
    while (!bytes.empty()) {
        std::size_t produced = to.size() - done;
        std::size_t consumed = bytes.size();
        expected = LZ4F_decompress(context.get(), to.data() + done, &produced, bytes.data(),
                                   &consumed, nullptr);
        if (LZ4F_isError(expected)) return false;
        // more output than the header of the chunk has announced
        if (consumed == 0 && produced == 0) return false;
        done += produced;
        bytes.remove_prefix(consumed);
    }
    return done == size && (expected == 0 || size == 0);
}
#endif

std::string unsupported(std::string_view compression) {
    std::string name(compression.substr(0, 20));
    if (compression == "zstd" || compression == "lz4") {
        return "unsupported compression '" + name + "': this program was built without lib" + name +
               "-dev";
    }
    return "unsupported compression '" + name + "'; supported: zstd, lz4 and none";
}

}  // namespace

bool expand(std::string_view compression, std::string_view bytes, std::uint64_t size,
            std::string& to, std::string& problem) {
    if (compression.empty()) {
        to = bytes;
        problem = "a chunk and its header disagree on the size";
        return bytes.size() == size;
    }
    problem = "a chunk does not decompress";
#ifdef HALCYON_ZSTD
    if (compression == "zstd") return expand_zstd(bytes, size, to);
#endif
#ifdef HALCYON_LZ4
    if (compression == "lz4") return expand_lz4(bytes, size, to);
#endif
    problem = unsupported(compression);
    return false;
}

}  // namespace hal::mcap
