// SPDX-License-Identifier: MIT
// The newest states of a plant for a simulated camera, written in the cycle and read by renderers.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace hal::vision::scene {

enum class Kind { furuta, floor, markers };

/// Constants of a scene. Lengths in m, angles in rad.
struct Settings {
    Kind kind = Kind::furuta;
    int width = 320;
    int height = 240;
    /// px; the optical axis passes through the centre of the picture
    double focal = 280.0;
    double fps = 100.0;
    std::uint64_t seed = 1;
    bool grey = false;
    double distance = 1.2;     ///< furuta: from the motor's axis; markers: unused
    double camera_height = 0.3;  ///< furuta: above the arm; floor: above the floor
    double pitch = 0.6;        ///< floor: downward tilt of the camera
    int objects = 0;        ///< floor: bottles and cans
    int markers = 0;        ///< markers, floor
};

/// Indices of the values in a state. Poses begin at `poses`.
namespace at {
constexpr std::size_t light = 0;
constexpr std::size_t noise = 1;
constexpr std::size_t blur = 2;
constexpr std::size_t covered = 3;
constexpr std::size_t frozen = 4;
constexpr std::size_t unplugged = 5;

constexpr std::size_t exposure = 6;
constexpr std::size_t delay = 7;
constexpr std::size_t poses = 8;
constexpr std::size_t smooth = 3;  // poses that move and do not jump: they lie between two states
// furuta
constexpr std::size_t arm = poses;
constexpr std::size_t pendulum = poses + 1;
// floor: the robot with the camera
constexpr std::size_t x = poses;
constexpr std::size_t y = poses + 1;
constexpr std::size_t heading = poses + 2;
constexpr std::size_t line_width = poses + 3;
constexpr std::size_t line_amplitude = poses + 4;
constexpr std::size_t line_length = poses + 5;

constexpr std::size_t line_dark = poses + 6;
constexpr std::size_t line_gap = poses + 7;
// floor: kind (0 none, 1 bottle, 2 can), x, y
constexpr std::size_t objects = poses + 8;
constexpr std::size_t of_object = 3;
// markers: id size x y z roll pitch yaw
constexpr std::size_t markers = poses + smooth;
constexpr std::size_t of_marker = 8;
}  // namespace at

constexpr std::size_t max_values = 72;
constexpr std::size_t max_objects = 16;
constexpr std::size_t max_markers = 8;

/// The state of the scene at a moment of the runtime's clock.
struct State {
    std::int64_t stamp_ns = 0;
    std::array<double, max_values> values{};

    double operator[](std::size_t i) const noexcept { return values[i]; }
};

/// Buffers the newest states for one writer and any number of readers.
///
/// Each slot is a sequence lock: (1) the writer makes its number odd, (2) writes, (3) makes it
/// even. A reader discards its copy if the number was odd, or changed while it copied. All words
/// are atomic, so there is no data race.
class Stage {
public:
    explicit Stage(const Settings& settings) : settings_(settings) {}
    const Settings& settings() const noexcept { return settings_; }

    /// Writes a state, not older than the previous one. [realtime] one writer
    void put(std::int64_t stamp_ns, std::span<const double> values) noexcept;
    /// Reads the newest state. Returns false before the first state. [any]
    bool newest(State& to) const noexcept;
    /// Reads the state at `stamp_ns`, interpolated linearly between its two neighbours; outside the
    /// known states, the oldest or the newest. Only the first poses (at::smooth) are interpolated;
    /// all other values are those of the earlier neighbour. Returns false before the first state.
    /// [any]
    bool when(std::int64_t stamp_ns, State& to) const noexcept;

private:
    static constexpr std::size_t kept = 512;
    struct Slot {
        std::atomic<std::uint64_t> number{0};
        std::atomic<std::int64_t> stamp{0};
        std::array<std::atomic<double>, max_values> values{};
    };
    bool read(std::uint64_t n, State& to) const noexcept;

    const Settings settings_;
    std::unique_ptr<std::array<Slot, kept>> slots_ = std::make_unique<std::array<Slot, kept>>();
    std::atomic<std::uint64_t> count_{0};  // states so far; written by put()
};

/// Registers the stage as sim:NAME. Throws std::invalid_argument if the name is in use. [setup]
void open(const std::string& name, std::shared_ptr<Stage> stage);
/// Removes the stage sim:NAME. [setup]
void close(const std::string& name) noexcept;
/// Returns the stage, or null if the name is unknown. [setup] and helper threads
std::shared_ptr<const Stage> find(const std::string& name);

}  // namespace hal::vision::scene
