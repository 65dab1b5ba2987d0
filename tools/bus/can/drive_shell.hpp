// SPDX-License-Identifier: MIT
// The commands of `hal can drive`: our own words, and those of the robot shell with an axis letter behind the word (`ONA:`).
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/can/drive_axis.hpp"
#include "bus/can/supervision.hpp"
#include "cli/prompt_loop.hpp"

namespace hal::tools {

class DriveShell final : public LineExecutor {
public:
    struct Settings {
        std::uint8_t node = 0;
        unsigned axis = 0;          ///< of commands that begin with none
        bool ends_at_failure = false;
        bool prompt = false;        ///< a person types: what succeeded silently is answered by `ok`
        std::int64_t within_ns = 0; ///< time for a command; 0: the default of each
    };
    DriveShell(const Options&, Station&, Supervision&, const Settings&);

    int execute(std::string_view line) override;
    Completion complete(std::string_view line, std::size_t cursor) override;
    bool collecting() const override { return false; }
    bool over() const override { return over_ || station_.bus.stop.requested(); }
    std::function<void()> meanwhile() override;
    void press() { pressed_.store(true); }  ///< [any] a signal came
    bool left() const { return left_; }     ///< by `quit`: the axes stay as they are
    /// The end of the session. Unless `leave`, every axis that was switched on or moved is stopped and switched off first; an
    /// `expected` end is no failure. Returns the exit status that follows.
    int end(bool leave, const char* why, bool expected = true);

private:
    using Words = std::vector<std::string>;
    struct LetterWord;

    bool run(Words);
    /// `ONA:`, `GB: 1000`: the words of the robot shell. Nothing: it is not one of them.
    std::optional<bool> letter_line(std::string_view line);
    bool letter_command(HandAxis&, const LetterWord&, const std::vector<std::int64_t>&, bool query);
    bool print_line(const std::string& text) const;
    bool wrong(const std::string& sentence) const;
    bool command(HandAxis&, const std::string& verb, Words arguments);
    bool motion(HandAxis&, const std::string& verb, Words arguments, const std::string& usage);
    bool query(HandAxis&, const std::string& name);
    bool set(HandAxis&, const std::string& name, const std::string& value);
    bool status(HandAxis&);
    /// A value of the drive by the name of its row, in units of the user. False after saying why.
    bool fetch(HandAxis&, const std::string& name, double& value);
    bool store(HandAxis&, const std::string& name, double value, double& back);
    HandAxis& axis(unsigned number);
    bool watched(HandAxis&);  ///< it exists, and the drive supervises us as far as it can; before everything that may move it
    HandAxis::Interruption interruption() const;
    static std::string help_text();

    const Options& options_;
    Station& station_;
    Supervision& supervision_;
    const Settings settings_;
    std::array<std::unique_ptr<HandAxis>, canopen::cia402::most_axes> axes_;
    std::atomic<bool> pressed_{false};
    bool over_ = false, left_ = false;
};

// What the sources of the shell share.
bool parse_real(const std::string& text, double& value);
/// `4096/360`, `4096,360`, `4096`.
bool parse_factor(const std::string& text, canopen::cia402::Factor&);
/// Names of settings and factors, in the order of the help; with `reading` those that can only be read, too.
std::vector<std::string> value_names(bool reading);
std::string value_help();

}  // namespace hal::tools
