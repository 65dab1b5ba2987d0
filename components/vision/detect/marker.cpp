// SPDX-License-Identifier: MIT
#include "vision/detect/marker.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "hal/rejection.hpp"
#include "text/quoting.hpp"

#if CV_VERSION_MAJOR != 4 || CV_VERSION_MINOR >= 7
#error \
    "from OpenCV 4.7 on markers are in objdetect, with another interface; this is for 4.5 and 4.6"
#endif

namespace hal::vision {
namespace {

struct Named {
    const char* name;
    int number;
};
constexpr Named dictionaries[] = {{"4x4_50", cv::aruco::DICT_4X4_50},
                                  {"4x4_100", cv::aruco::DICT_4X4_100},
                                  {"4x4_250", cv::aruco::DICT_4X4_250},
                                  {"4x4_1000", cv::aruco::DICT_4X4_1000},
                                  {"5x5_50", cv::aruco::DICT_5X5_50},
                                  {"5x5_100", cv::aruco::DICT_5X5_100},
                                  {"5x5_250", cv::aruco::DICT_5X5_250},
                                  {"5x5_1000", cv::aruco::DICT_5X5_1000},
                                  {"6x6_50", cv::aruco::DICT_6X6_50},
                                  {"6x6_100", cv::aruco::DICT_6X6_100},
                                  {"6x6_250", cv::aruco::DICT_6X6_250},
                                  {"6x6_1000", cv::aruco::DICT_6X6_1000},
                                  {"7x7_50", cv::aruco::DICT_7X7_50},
                                  {"7x7_1000", cv::aruco::DICT_7X7_1000},
                                  {"original", cv::aruco::DICT_ARUCO_ORIGINAL},
                                  {"apriltag_36h11", cv::aruco::DICT_APRILTAG_36h11}};

int number_of(const std::string& name) {
    std::string names;
    for (const Named& d : dictionaries) {
        if (name == d.name) return d.number;
        append_item(names, d.name);
    }
    throw hal::ArgumentError("dictionary",
                             "dictionary=" + name + " is unknown; there are " + names);
}

double degrees(double radians) { return radians * 57.29577951308232; }

/// Noise level of a picture: the mean of |Laplacian| over every fourth pixel of every fourth row
/// (J. Immerkaer, 1996).
double noise(const cv::Mat& grey) {
    std::int64_t sum = 0;
    std::int64_t count = 0;
    for (int y = 1; y + 1 < grey.rows; y += 4) {
        const std::uint8_t *const a = grey.ptr(y - 1), *const b = grey.ptr(y),
                                  *const c = grey.ptr(y + 1);
        for (int x = 1; x + 1 < grey.cols; x += 4, ++count) {
            sum += std::abs(a[x - 1] + a[x + 1] + c[x - 1] + c[x + 1] -
                            2 * (a[x] + c[x] + b[x - 1] + b[x + 1]) + 4 * b[x]);
        }
    }
    return count == 0 ? 0.0
                      : std::sqrt(1.5707963267948966) * static_cast<double>(sum) /
                            (6.0 * static_cast<double>(count));
}

/// Both poses that fit the picture of a square, and how far its corners then lie from those seen,
/// root mean square.
struct Candidate {
    cv::Matx33d rotation;
    cv::Vec3d position;
    double error_px = 0;
};
using Candidates = std::array<Candidate, 2>;

/// The corners of a marker in its own axes and in the picture.
struct View {
    std::vector<cv::Point3d> square;
    std::vector<cv::Point2d> seen;
};

/// Angle of the turn between two rotations, rad.
double angle_between(const cv::Matx33d& a, const cv::Matx33d& b) {
    return std::acos(std::clamp((cv::trace(a.t() * b) - 1.0) / 2.0, -1.0, 1.0));
}

/// The two candidates of one marker over its last frames. Corner noise differs from frame to frame,
/// so the sums of their errors, of which older ones count less, distinguish the pose from its
/// mirror image where a single frame does not. A frame counts by the candidates' shares of its
/// squared error, so that a single bad frame does not outweigh the others.
struct Track {
    std::array<cv::Matx33d, 2> rotation;
    std::array<double, 2> shares{};
    std::size_t chosen = 0;
    std::uint64_t last = 0;  ///< the call of find() that saw the marker

    static constexpr double floor_px = 0.05;  ///< errors below this are alike
    /// part of the sum that stays from frame to frame
    static constexpr double memory = 0.8;
    /// the other candidate is chosen when its sum is below this part of the chosen one's
    static constexpr double enough = 0.8;
    static constexpr std::uint64_t gap = 10;  ///< frames without the marker that end the track

    /// Puts the frame's candidates in the order of the track's, adds their errors and chooses.
    void add(Candidates& now, std::uint64_t call) {
        const bool fresh = last == 0 || call - last > gap;
        if (fresh) {
            shares = {};
        } else if (angle_between(rotation[0], now[1].rotation) +
                       angle_between(rotation[1], now[0].rotation) <
                   angle_between(rotation[0], now[0].rotation) +
                       angle_between(rotation[1], now[1].rotation)) {
            std::swap(now[0], now[1]);
        }
        for (std::size_t i = 0; i < 2; ++i) {
            rotation[i] = now[i].rotation;
            const double square = floor_px * floor_px + now[i].error_px * now[i].error_px;
            shares[i] = memory * shares[i] +
                        square / (2 * floor_px * floor_px + now[0].error_px * now[0].error_px +
                                  now[1].error_px * now[1].error_px);
        }
        if (fresh) {
            chosen = shares[1] < shares[0] ? 1 : 0;
        } else if (shares[1 - chosen] < enough * shares[chosen]) {
            chosen = 1 - chosen;
        }
        last = call;
    }
    /// 0: the other candidate does not fit; 1: it fits as well.
    double ambiguity() const {
        const double max = std::max(shares[0], shares[1]);
        return std::isnormal(max) ? std::sqrt(std::min(shares[0], shares[1]) / max) : 1.0;
    }
};
}  // namespace

struct MarkerDetector::Inside {
    cv::Ptr<cv::aruco::Dictionary> dictionary;
    cv::Ptr<cv::aruco::DetectorParameters> parameters = cv::aruco::DetectorParameters::create();
    std::optional<Camera> camera;
    cv::Matx33d k = cv::Matx33d::eye();
    cv::Mat d = cv::Mat::zeros(1, 5, CV_64F);
    Frame grey;
    cv::Mat smooth;
    /// by id: at most as many as the dictionary has
    std::map<int, Track> tracks;
    std::uint64_t calls = 0;

    void refine(const cv::Mat& picture, std::vector<cv::Point2f>& corners) const;
    Candidates candidates(const View& view) const;
    Candidate scored(const View& view, const cv::Mat& r, const cv::Mat& t) const;
    Candidate refined(const View& view, const Candidates& both, std::size_t chosen) const;
    void position(Marker& marker, double size, bool alone);
};

MarkerDetector::MarkerDetector(const std::string& dictionary, std::optional<Camera> camera)
    : inside_(std::make_unique<Inside>()) {
    cv::setNumThreads(1);  // a second one gains nothing, and would be where real-time threads are
    Inside& in = *inside_;
    in.dictionary = cv::aruco::getPredefinedDictionary(number_of(dictionary));
    in.parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_NONE;  // refine() does it
    in.camera = std::move(camera);
    if (const auto& c = in.camera) {
        in.k = cv::Matx33d(c->fx, 0, c->cx, 0, c->fy, c->cy, 0, 0, 1);
        for (int i = 0; i < 5; ++i) {
            in.d.at<double>(i) = c->distortion[static_cast<std::size_t>(i)];
        }
    }
}

MarkerDetector::~MarkerDetector() = default;

int MarkerDetector::count() const { return inside_->dictionary->bytesList.rows; }

std::vector<Marker> MarkerDetector::find(const Frame& frame, int id, double size_mm) {
    Inside& in = *inside_;
    const Frame* grey = &frame;
    if (frame.format != Format::grey) {
        in.grey = frame;
        to_grey(in.grey);
        grey = &in.grey;
    }
    const cv::Mat picture(grey->height, grey->width, CV_8UC1,
                          const_cast<std::uint8_t*>(grey->pixels.data()));
    // Noise floods the search for contours, so the search is in a smoothed picture; the corners are
    // then placed in the one that was taken.
    const bool noisy = noise(picture) > 2.0;
    if (noisy) {
        cv::GaussianBlur(picture, in.smooth, {5, 5}, 1.2);
    }

    std::vector<std::vector<cv::Point2f>> corners;
    std::vector<int> ids;
    cv::aruco::detectMarkers(noisy ? in.smooth : picture, in.dictionary, corners, ids,
                             in.parameters);
    for (auto& four : corners) {
        in.refine(picture, four);
    }
    ++in.calls;
    std::vector<Marker> found;
    for (std::size_t i = 0; i < ids.size(); ++i) {
        if (id >= 0 && ids[i] != id) continue;
        Marker marker;
        marker.id = ids[i];
        for (std::size_t c = 0; c < 4; ++c) {
            marker.corners[c] = {corners[i][c].x, corners[i][c].y};
        }
        if (in.camera && size_mm > 0.0) {
            in.position(marker, size_mm, std::count(ids.begin(), ids.end(), marker.id) == 1);
        }
        found.push_back(marker);
    }
    std::sort(found.begin(), found.end(),
              [](const Marker& a, const Marker& b) { return a.id < b.id; });
    return found;
}

// The window about a corner reaches as far as the black rim is wide, so that it sees two edges and
// no other corner.
void MarkerDetector::Inside::refine(const cv::Mat& picture,
                                    std::vector<cv::Point2f>& corners) const {
    double shortest = 1e9;
    for (std::size_t i = 0; i < 4; ++i) {
        shortest = std::min(shortest, cv::norm(corners[(i + 1) % 4] - corners[i]));
    }
    const double cell = shortest / (dictionary->markerSize + 2);
    const int reach = std::clamp(static_cast<int>(std::lround(0.9 * cell)), 2, 12);
    const int across = 2 * reach + 6;  // margin for cornerSubPix
    if (picture.cols < across || picture.rows < across) return;
    cv::cornerSubPix(picture, corners, {reach, reach}, {-1, -1},
                     {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 40, 0.005});
}

Candidates MarkerDetector::Inside::candidates(const View& view) const {
    std::vector<cv::Mat> rotations, places;
    cv::solvePnPGeneric(view.square, view.seen, k, d, rotations, places, false,
                        cv::SOLVEPNP_IPPE_SQUARE);
    if (rotations.empty()) {
        throw std::runtime_error("invalid marker: its corners are not those of a square");
    }
    Candidates both;
    for (std::size_t i = 0; i < 2; ++i) {
        both[i] = scored(view, rotations[std::min(i, rotations.size() - 1)],
                         places[std::min(i, places.size() - 1)]);
    }
    return both;
}

Candidate MarkerDetector::Inside::scored(const View& view, const cv::Mat& r,
                                         const cv::Mat& t) const {
    std::vector<cv::Point2d> back;
    cv::projectPoints(view.square, r, t, k, d, back);
    double sum = 0;
    for (std::size_t i = 0; i < 4; ++i) {
        sum += (back[i] - view.seen[i]).dot(back[i] - view.seen[i]);
    }
    Candidate c;
    cv::Rodrigues(r, c.rotation);
    c.position = {t.at<double>(0), t.at<double>(1), t.at<double>(2)};
    c.error_px = std::sqrt(sum / 4);
    return c;
}

// Least squares may slide from one candidate into the other: then the pose stays as the closed
// formula has it.
Candidate MarkerDetector::Inside::refined(const View& view, const Candidates& both,
                                          std::size_t chosen) const {
    const Candidate& from = both[chosen];
    cv::Mat r, t(from.position, true);
    cv::Rodrigues(from.rotation, r);
    cv::solvePnPRefineLM(view.square, view.seen, k, d, r, t);
    const Candidate to = scored(view, r, t);
    const bool slid = angle_between(to.rotation, both[1 - chosen].rotation) <
                      angle_between(to.rotation, from.rotation);
    return slid ? from : to;
}

// Two markers of one id in a frame cannot be followed: each is then placed by this frame alone.
void MarkerDetector::Inside::position(Marker& marker, double size, bool alone) {
    const double h = size / 2;
    View view{{{-h, h, 0}, {h, h, 0}, {h, -h, 0}, {-h, -h, 0}}, {}};
    for (const auto& c : marker.corners) {
        view.seen.emplace_back(c[0], c[1]);
    }
    Candidates both = candidates(view);
    Track once;
    Track& track = alone ? tracks[marker.id] : once;
    track.add(both, calls);
    const Candidate of = refined(view, both, track.chosen);
    const auto& m = of.rotation;
    marker.pose.x_mm = of.position[0];
    marker.pose.y_mm = of.position[1];
    marker.pose.z_mm = of.position[2];
    marker.pose.roll_deg = degrees(std::atan2(m(2, 1), m(2, 2)));
    marker.pose.pitch_deg = degrees(std::asin(std::clamp(-m(2, 0), -1.0, 1.0)));
    marker.pose.yaw_deg = degrees(std::atan2(m(1, 0), m(0, 0)));
    marker.error_px = of.error_px;
    marker.ambiguity = track.ambiguity();
}

}  // namespace hal::vision
