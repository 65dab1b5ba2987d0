// SPDX-License-Identifier: MIT
#include "comp/compiler_messages.hpp"

#include <sstream>
#include <string_view>
#include <vector>

namespace hal::tools {

namespace {

constexpr std::string_view failed = ": error: static assertion failed: ";
constexpr std::string_view used_here = ":   required from here";

/// Lines that lead to an error of an instantiated template.
bool leads_in(const std::string& line) {
    for (const std::string_view part :
         {": In instantiation of ", ": In substitution of ", ":   required "}) {
        if (line.find(part) != line.npos) return true;
    }
    return line.starts_with("In file included from ") || line.starts_with("                 from ");
}

/// Lines that repeat the assertion.
bool belongs_to_assertion(const std::string& line) {
    return line.starts_with(' ') || line.find(" evaluates to false") != line.npos;
}

class Condenser {
public:
    void add(const std::string& line) {
        if (dropping_ && belongs_to_assertion(line)) return;
        dropping_ = false;
        if (leads_in(line)) {
            lead_.push_back(line);
            return;
        }
        const auto at = line.find(failed);
        const std::string place = at == line.npos ? "" : place_of_use();
        if (place.empty()) {
            keep_lead();
            kept_ += line + "\n";
            return;
        }
        kept_ += place + ": error: " + line.substr(at + failed.size()) + "\n";
        lead_.clear();
        dropping_ = true;
    }
    std::string text() {
        keep_lead();
        return kept_;
    }

private:
    /// FILE:LINE:COLUMN where the user's file needs the template; empty: none does.
    std::string place_of_use() const {
        for (const std::string& line : lead_) {
            const auto at = line.find(used_here);
            if (at != line.npos) return line.substr(0, at);
        }
        return "";
    }
    void keep_lead() {
        for (const std::string& line : lead_) {
            kept_ += line + "\n";
        }
        lead_.clear();
    }

    std::vector<std::string> lead_;
    std::string kept_;
    bool dropping_ = false;
};

}  // namespace

std::string with_assertions_in_one_line(const std::string& messages) {
    Condenser condenser;
    std::istringstream in(messages);
    for (std::string line; std::getline(in, line);) {
        condenser.add(line);
    }
    return condenser.text();
}

}  // namespace hal::tools
