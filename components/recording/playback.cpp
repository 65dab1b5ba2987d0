// SPDX-License-Identifier: MIT
#include <algorithm>
#include <bit>
#include <map>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <fnmatch.h>

#include "hal/any_pin.hpp"
#include "hal/edge.hpp"
#include "hal/texts.hpp"
#include "recording/mcap/playback_pin.hpp"
#include "recording/mcap/recording.hpp"

namespace {

struct Playback : hal::Component {
    explicit Playback(const hal_host* host)
        : Component(host),
          file(*this, "file", "", "recording to play: .mcap or .csv, beside the netlist"),
          values(*this, "values", "*", "values to play, as patterns separated by commas"),
          types(*this, "types", "",
                "types of values of a .csv, NAME:TYPE separated by commas; the others are float") {
        read();
        for (Track& track : tracks_) {
            declare(track);
        }
    }

    hal::TextArgument file, values, types;
    hal::In<bool> enable{*this, "enable", "FALSE holds the time and the values", {.initial = true}};
    hal::In<bool> restart{*this, "restart", "a rising edge starts again at the beginning"};
    hal::Param<std::int64_t> begin{*this,
                                   "begin",
                                   "when the recording begins, on the machine's clock; 0: in the "
                                   "first cycle",
                                   {.unit = "ns"}};
    hal::Param<bool> loop{*this, "loop", "TRUE starts again after the end"};
    hal::Out<double> time{
        *this, "time", "time since the beginning of the recording", {.unit = "s"}};
    hal::Out<bool> done{*this, "done", "TRUE: the last row has been played"};
    hal::Function run{*this, "update", &Playback::update,
                      "sets the outputs to the values recorded at this time"};

    void update(hal::Cycle cycle) noexcept {
        const bool again = restart_edge_.rises(restart);
        if (again || (loop && done)) {
            rewind();
        }
        if (!enable) return;
        if (begun_) {
            elapsed_ns_ += cycle.period_ns();
        } else if (begin != 0 && !rewound_) {
            elapsed_ns_ = cycle.start_ns() - begin;
        }
        begun_ = true;
        bool more = false;
        for (Track& track : tracks_) {
            const std::vector<std::int64_t>& times = track.table.times_ns;
            const std::size_t before = track.next;
            while (track.next < times.size() && times[track.next] - begin_ns_ <= elapsed_ns_) {
                ++track.next;
            }
            if (track.next != before) {
                collect(track, track.next - 1);
            }
            more = more || track.next < times.size();
        }
        show();
        time = static_cast<double>(elapsed_ns_) * 1e-9;
        done = !more;
    }

private:
    struct Track {
        hal::mcap::Table table;
        std::size_t next = 0;
        std::vector<std::pair<std::size_t, std::size_t>> pins = {};  // column and number of a pin
    };
    /// What a pin shows next.
    struct Value {
        std::uint64_t word = 0;
        bool fresh = false;
    };

    bool wanted(const std::string& name) const {
        const std::string& all = values.get();
        for (std::size_t at = 0; at <= all.size();) {
            const std::size_t end = std::min(all.find(',', at), all.size());
            if (::fnmatch(all.substr(at, end - at).c_str(), name.c_str(), 0) == 0) return true;
            at = end + 1;
        }
        return false;
    }

    std::map<std::string, hal_type> given_types() const {
        std::map<std::string, hal_type> given;
        const std::string& all = types.get();
        if (!all.empty() && !file.get().ends_with(".csv")) {
            throw hal::ArgumentError(
                "types",
                "types=" + all + ": the recording has types of its own; only a .csv needs them");
        }
        for (std::size_t at = 0; at < all.size();) {
            const std::size_t end = std::min(all.find(',', at), all.size());
            const std::string one = all.substr(at, end - at);
            const std::size_t colon = one.rfind(':');
            const auto type = hal::mcap::type_of_word(
                colon == one.npos ? "" : std::string_view(one).substr(colon + 1));
            if (!type) {
                throw hal::ArgumentError(
                    "types",
                    "types=" + one +
                        ": type NAME:TYPE; the types are bit, float, s32, u32, s64 and u64");
            }
            given[one.substr(0, colon)] = *type;
            at = end + 1;
        }
        return given;
    }

    void read() {
        if (file.get().empty()) return;
        const hal::Texts texts(*this);
        if (!texts.offered()) return;
        hal::mcap::Recording recording;
        std::string problem;
        if (!hal::mcap::load(texts.find(file.get()), recording, problem,
                             {.types = given_types()})) {
            throw hal::ArgumentError("file", "file=" + file.get() + ": " + problem);
        }
        if (recording.tables.empty()) {
            throw hal::ArgumentError("file",
                                     "file=" + file.get() + ": the recording has no rows" +
                                         (recording.unread.empty() ? "" : "; " + recording.unread));
        }
        warn(texts, recording);
        begin_ns_ = recording.begin_ns();
        for (hal::mcap::Table& table : recording.tables) {
            tracks_.push_back({std::move(table)});
        }
    }

    void warn(const hal::Texts& texts, const hal::mcap::Recording& recording) const {
        if (recording.missing.empty()) return;
        texts.begin("", "");
        texts.report(HAL_SEVERITY_WARNING, "incomplete-recording", 0, 0, recording.missing, "",
                     "what it has is played");
    }

    // A value that several tables have, because an edit moved it to another thread, is one pin.
    void declare(Track& track) {
        for (std::size_t c = 0; c < track.table.columns.size(); ++c) {
            const hal::mcap::Column& column = track.table.columns[c];
            if (!wanted(column.name)) continue;
            const std::string name = hal::playback_pin(column.name);
            const auto [at, made] = by_name_.try_emplace(name, values_.size());
            if (made) {
                values_.emplace_back();
                pins_.declare(*this, nullptr, column.type, name, "value of the recording",
                              at->second, {.unit = column.unit.c_str()});
            }
            track.pins.emplace_back(c, at->second);
        }
    }

    void collect(const Track& track, std::size_t row) noexcept {
        for (const auto& [column, pin] : track.pins) {
            values_[pin] = {track.table.word(row, column), true};
        }
    }

    void show() noexcept {
        pins_.each([this]<class T>(hal::Out<T>& pin, std::size_t number) noexcept {
            Value& value = values_[number];
            if (!value.fresh) return;
            value.fresh = false;
            if constexpr (std::is_same_v<T, double>) {
                pin = std::bit_cast<double>(value.word);
            } else {
                pin = static_cast<T>(value.word);
            }
        });
    }

    void rewind() noexcept {
        for (Track& track : tracks_) {
            track.next = 0;
        }
        elapsed_ns_ = 0;
        begun_ = false;
        rewound_ = true;
    }

    std::vector<Track> tracks_;
    hal::AnyOuts<std::size_t> pins_;  // with the number of the pin
    std::vector<Value> values_;
    std::map<std::string, std::size_t> by_name_;
    std::int64_t begin_ns_ = 0;
    std::int64_t elapsed_ns_ = 0;
    bool begun_ = false;
    bool rewound_ = false;  // it no longer begins at `begin`
    hal::RisingEdge restart_edge_;
};

}  // namespace

HAL_COMPONENT(Playback, "playback", "Plays a recording into pins", R"(
The file is one that `hal record` wrote, or another MCAP file with ROS 2 messages: their numbers are
played, texts and arrays of any length are skipped. Each recorded value becomes an output of its own
name and type: `x-pid.error` is `playback.0.x-pid.error`. In each cycle the outputs have the values
that were recorded at that time after the first row; a recording of a thread of the same period is
played row by row. The whole file is read when the component is loaded, at most 1 GiB of values. A
file that was cut off or damaged is played as far as it goes, and a warning states what is missing.

A table (.csv) has no types: its values are float, but for those that `types` names, as in
`types=on:bit,count:s32`.

    loadrt playback file=run.csv values=x-*
    loadrt lowpass names=filter
    addf playback.0.update servo-thread
    addf filter servo-thread
    net x-fb playback.0.x-fb => filter.in

`run.csv`:

    time_s,x-fb,x-cmd
    5.000,0.0,1.0
    5.001,0.1,1.0

`hal replay` does this for a netlist by itself, and compares what it computes with what was
recorded.
)")
