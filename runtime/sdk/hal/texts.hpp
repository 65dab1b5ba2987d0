// SPDX-License-Identifier: MIT
// For components that read a file of the user: finds the file and reports errors in it in the same
// form as errors of the netlist.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

#include "hal/component.hpp"
#include "hal/read_file.hpp"
#include "hal/texts.h"

namespace hal {

/// In a component's constructor only. A host without the extension (`hal doc`) gets no messages.
class Texts {
public:
    explicit Texts(Component&) : texts_(extension<hal_texts>(HAL_TEXTS)) {}
    /// False: the instance is not loaded, only its declarations are read.
    bool offered() const { return texts_ != nullptr; }
    /// Returns the path of `file`: beside the netlist, or else as written. [setup]
    std::string find(const std::string& file) const {
        return texts_ ? texts_->find(detail::creating, file.c_str()) : file;
    }
    /// Returns the content of `file`, the value of `argument`. Throws if it cannot be read or is
    /// longer than 64 KiB. [setup]
    std::string read(const char* argument, const std::string& file) const {
        constexpr std::size_t max_bytes = 65536;
        const std::string path = find(file);
        std::string text;
        if (!read_regular_file(path, 16 * max_bytes, text)) {
            throw ArgumentError(argument, std::string(argument) + "=" + file + ": the file '" +
                                              path + "' cannot be read: " + text);
        }
        if (text.size() > max_bytes) {
            throw ArgumentError(argument, std::string(argument) + "=" + file + ": the file '" +
                                              path +
                                              "' is longer than 64 KiB; is it the right one?");
        }
        return text;
    }
    /// Sets the text to which the next messages refer. [setup]
    void begin(const std::string& name, std::string_view text) const {
        if (texts_) {
            texts_->begin(detail::creating, name.c_str(), text.data(), text.size());
        }
    }
    /// Reports a message about bytes `begin` to `end`. [setup]
    void report(hal_severity severity, const char* code, std::uint32_t begin, std::uint32_t end,
                const std::string& sentence, const std::string& label,
                const std::string& help) const {
        const hal_text_message message{sizeof message,   severity,      code,        begin, end,
                                       sentence.c_str(), label.c_str(), help.c_str()};
        if (texts_) {
            texts_->report(detail::creating, &message);
        }
    }
    /// Reports all problems of a file at their spans and ends the constructor, if there are any.
    /// [setup]
    template <class Problems>
    void reject(const std::string& file, std::string_view text, const char* code,
                const Problems& problems) const {
        if (problems.empty()) return;
        begin(file, text);
        for (const auto& p : problems) {
            report(HAL_SEVERITY_ERROR, code, p.begin, p.end, p.sentence, "", p.help);
        }
        if (offered()) {
            fail();
        }
        throw std::invalid_argument(file + ": " + problems.front().sentence + "; " +
                                    problems.front().help);
    }
    /// Ends the constructor after an error was reported. [setup]
    [[noreturn]] static void fail() { detail::rejected(); }

private:
    const hal_texts* texts_;
};

}  // namespace hal
