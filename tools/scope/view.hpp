// SPDX-License-Identifier: MIT
// What the scope's keys change: scales, cursors, trigger, time window. Knows no terminal: tests
// give it keys and read its lines.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cli/keys.hpp"
#include "scope/acquisition.hpp"

namespace hal::tools {

constexpr int divisions_x = 10;
constexpr int divisions_y = 8;

/// How a channel is drawn.
struct ChannelView {
    double per_division = 1;  ///< of the channel's unit
    double centre = 0;  ///< the value in the middle of the picture
    bool shown = true;
};

class ScopeView {
public:
    /// Changes the acquisition by its keys. `unicode`, `colour`: of the picture.
    ScopeView(Acquisition& acquisition, bool unicode, bool colour);

    enum class Action { none, quit, save };
    Action key(const Key& key);
    /// Returns the lines of a ScopePicture, after fitting the first record. `lost`: samples.
    std::vector<std::string> frame(std::size_t columns, std::size_t rows, std::uint64_t lost = 0);
    /// Shows a sentence below the picture until the next key.
    void say(std::string sentence) { message_ = std::move(sentence); }

    /// Fits all channels into lanes, one above the other.
    void fit_all();
    /// Fits a channel into the whole height.
    void fit(std::size_t channel);

    const std::vector<ChannelView>& traces() const { return traces_; }
    std::size_t selected() const { return selected_; }
    /// Returns the record that is drawn: the newest one of a trigger, or the newest samples before
    /// the first record and in roll mode.
    Record shown() const;
    struct Cursors {
        bool on = false;
        int active = 0;
        std::int64_t at_ns[2] = {0, 0};  ///< relative to the trigger
    };
    const Cursors& cursors() const { return cursors_; }
    bool measures() const { return measures_; }
    bool help() const { return help_; }
    const std::string& message() const { return message_; }

private:
    Action letter(char c);
    void toggle_run();
    void trigger_on_selected();
    void zoom(bool out);
    void change_time(bool longer);
    void move_trigger(int divisions);
    void next_cursor();
    void arrow(const Key& key);
    void next_edge();
    void move_level(double divisions);
    void move_cursor(int samples);
    void change_window(std::int64_t total_ns, std::int64_t pre_ns);
    void fit_lane(std::size_t channel, double lane_divisions, double above_centre);
    void select(std::size_t channel);
    void fit_first_record();

    Acquisition& acquisition_;
    bool unicode_, colour_;
    std::vector<ChannelView> traces_;
    std::size_t selected_ = 0;
    Cursors cursors_;
    bool measures_ = true;
    bool help_ = false;
    bool fitted_ = false;
    std::string message_;
};

/// Returns the next larger (`up`) or smaller value of the series 1, 2, 5, 10 …; `value` > 0.
double next_step(double value, bool up);

}  // namespace hal::tools
