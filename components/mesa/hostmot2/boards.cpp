// SPDX-License-Identifier: MIT
#include "boards.hpp"

namespace hal::mesa {

namespace {

// T and EU are the newer layouts of a card, with the same connectors and names of pins.
constexpr Board known[] = {
    {"7I92", true, "7i92", 2, 17},  {"7I76E", true, "7i76e", 3, 17},
    {"7I96", false, "7i96", 3, 17}, {"7I96S", false, "7i96s", 3, 17},
    {"7I95", false, "7i95", 2, 29}, {"7I95T", false, "7i95", 2, 29},
    {"7I97", false, "7i97", 3, 17}, {"7I97T", false, "7i97", 3, 17},
};

bool fits(const Board& board, std::string_view card) {
    return board.is_prefix ? card.starts_with(board.card) : card == board.card;
}

}  // namespace

std::span<const Board> boards() noexcept { return known; }

const Board* board_of(std::string_view card) noexcept {
    const Board* found = nullptr;
    for (const Board& board : known) {
        if (!fits(board, card)) continue;
        if (found == nullptr || board.card.size() > found->card.size()) {
            found = &board;
        }
    }
    return found;
}

}  // namespace hal::mesa
