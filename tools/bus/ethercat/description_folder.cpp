// SPDX-License-Identifier: MIT
#include "bus/ethercat/description_folder.hpp"

#include <algorithm>
#include <fmt/format.h>

#include "hal/read_file.hpp"
#include "text/characters.hpp"

namespace hal::tools {

namespace esi = ethercat::esi;

namespace {

constexpr std::size_t max_file = 256'000'000;  // bytes; a maker's largest has about 80 MB

/// Returns how well a match fits; 0: there is no device.
int fit(const esi::Match& match) {
    if (match.device == nullptr) return 0;
    switch (match.revision) {
    case esi::Match::Revision::exact: return 3;
    case esi::Match::Revision::accepted: return 2;
    default: return 1;
    }
}

std::vector<std::filesystem::path> descriptions_in(const std::filesystem::path& folder,
                                                   std::error_code& problem) {
    std::vector<std::filesystem::path> paths;
    for (std::filesystem::directory_iterator entry(folder, problem), end; !problem && entry != end;
         entry.increment(problem)) {
        const std::filesystem::path& path = entry->path();
        if (same_word(path.extension().string(), ".xml")) {
            paths.push_back(path);
        }
    }
    std::sort(paths.begin(), paths.end());
    return paths;
}

}  // namespace

std::string DescriptionFolder::add(const std::filesystem::path& path) {
    std::string bytes;
    if (!read_regular_file(path.string(), max_file, bytes)) {
        return fmt::format("cannot read '{}': {}", path.string(), bytes);
    }
    esi::File file = esi::read(bytes);
    const auto error =
        std::find_if(file.messages.begin(), file.messages.end(),
                     [](const auto& message) { return message.severity == Severity::error; });
    if (error != file.messages.end()) {
        return fmt::format("{}:{}: {}", path.string(), error->at.line, error->sentence);
    }
    files_.push_back({path, std::move(file)});
    return {};
}

std::string DescriptionFolder::open(const std::filesystem::path& path) {
    std::error_code problem;
    if (!std::filesystem::is_directory(path, problem)) return add(path);
    const std::vector<std::filesystem::path> paths = descriptions_in(path, problem);
    if (problem) return fmt::format("cannot read '{}': {}", path.string(), problem.message());
    if (paths.empty()) {
        return fmt::format(
            "'{}' contains no files *.xml; name the folder of the descriptions (ESI)",
            path.string());
    }
    for (const auto& each : paths) {
        if (const std::string skipped = add(each); !skipped.empty()) {
            notes_.push_back(skipped + "; the file is skipped");
        }
    }
    return {};
}

DescriptionFolder::Choice DescriptionFolder::find(std::uint32_t vendor, std::uint32_t product,
                                                  std::uint32_t revision) const {
    Choice best;
    for (const Described& each : files_) {
        const esi::Match match =
            esi::look_up(each.file, {.vendor = vendor, .product = product, .revision = revision});
        if (fit(match) > fit(best.match)) {
            best = {&each.file, each.path, match};
        }
    }
    return best;
}

}  // namespace hal::tools
