// SPDX-License-Identifier: MIT
// Where the readers of configuration files report: the messages of any bus. [setup]
#pragma once

#include <string>
#include <utility>

#include "text/config_text.hpp"

namespace hal::bus {

/// What a message of a reader is about. Each bus has a diagnostic code for both.
enum class Subject : std::uint8_t {
    line,   ///< an invalid line, section or key
    value,  ///< an invalid value
};

/// Receives the messages about lines, keys and values.
class KeyReport {
public:
    virtual void error(Subject subject, text::Span at, std::string sentence, std::string help = {},
                       std::string label = {}) = 0;
    virtual void warning(Subject subject, text::Span at, std::string sentence,
                         std::string help = {}) = 0;

protected:
    ~KeyReport() = default;
};

/// Adds the messages to those of a bus, whose topics include `line` and `value`.
template <class Topic>
class TopicReport final : public KeyReport {
public:
    explicit TopicReport(text::Messages<Topic>& messages) : messages_(messages) {}
    void error(Subject subject, text::Span at, std::string sentence, std::string help = {},
               std::string label = {}) override {
        messages_.error(topic(subject), at, std::move(sentence), std::move(help), std::move(label));
    }
    void warning(Subject subject, text::Span at, std::string sentence,
                 std::string help = {}) override {
        messages_.warning(topic(subject), at, std::move(sentence), std::move(help));
    }

private:
    static Topic topic(Subject subject) {
        return subject == Subject::line ? Topic::line : Topic::value;
    }

    text::Messages<Topic>& messages_;
};

}  // namespace hal::bus
