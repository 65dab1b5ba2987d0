// SPDX-License-Identifier: MIT
#include "linuxcnc/nml_buffers.hpp"

#include <fstream>
#include <iterator>
#include <sstream>

#include "text/numbers.hpp"

namespace hal::tools {

std::vector<NmlBuffer> shared_nml_buffers(const std::string& file) {
    std::vector<NmlBuffer> buffers;
    std::ifstream in(file);
    // B NAME SHMEM HOST SIZE 0 0 NUMBER PROCESSES KEY …
    for (std::string line; std::getline(in, line);) {
        std::istringstream text(line);
        const std::vector<std::string> words{std::istream_iterator<std::string>(text), {}};
        if (words.size() < 10 || words[0] != "B" || words[2] != "SHMEM") continue;
        NmlBuffer& buffer = buffers.emplace_back();
        buffer.name = words[1];
        if (const auto processes = parse_natural(words[8])) {
            buffer.processes = static_cast<std::size_t>(*processes);
        }
        if (const auto key = parse_natural(words[9])) {
            buffer.key = static_cast<key_t>(*key);
        }
    }
    return buffers;
}

}  // namespace hal::tools
