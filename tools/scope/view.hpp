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
    /// The scale grows with the signal, until a key sets it.
    bool automatic = true;
    double lane_divisions = divisions_y;  ///< height of its part of the picture
    double lane_centre = 0;  ///< middle of that part, in divisions above that of the picture
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

    /// Fits all channels into lanes, one above the other. In automatic and roll mode their scales
    /// grow with the signals from then on.
    void fit_all();
    /// Fits a channel into the whole height; its scale is automatic again.
    void fit(std::size_t channel);

    const std::vector<ChannelView>& traces() const { return traces_; }
    std::size_t selected() const { return selected_; }
    /// Returns the record that is drawn: the newest one of a trigger, or the newest samples before
    /// the first record, in roll mode, and in automatic mode with a long window while no trigger
    /// comes.
    Record shown() const;
    /// Returns true while the newest samples move through the picture.
    bool rolls() const;
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
    void roll();
    void leave_roll(Mode mode);
    void fit_lane(std::size_t channel);
    void set_lane(std::size_t channel, double divisions, double centre);
    void grow_scales();
    void move_by(double divisions);
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
    /// The window before it was made longer for roll mode; total 0: it was not.
    struct Window {
        std::int64_t total_ns = 0;
        std::int64_t pre_ns = 0;
    };
    Window before_roll_;
    std::string message_;
};

/// Returns the next larger (`up`) or smaller value of the series 1, 2, 5, 10 …; `value` > 0.
double next_step(double value, bool up);

}  // namespace hal::tools
