// SPDX-License-Identifier: MIT
#include "vision/detect/marker.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#if CV_VERSION_MAJOR != 4 || CV_VERSION_MINOR >= 7
#error "from OpenCV 4.7 on markers are in objdetect, with another interface; this is for 4.5 and 4.6"
#endif

namespace hal::vision {
namespace {

struct Named {
    const char* name;
    int         number;
};
constexpr Named dictionaries[] = {{"4x4_50", cv::aruco::DICT_4X4_50},           {"4x4_100", cv::aruco::DICT_4X4_100},
                                  {"4x4_250", cv::aruco::DICT_4X4_250},         {"4x4_1000", cv::aruco::DICT_4X4_1000},
                                  {"5x5_50", cv::aruco::DICT_5X5_50},           {"5x5_100", cv::aruco::DICT_5X5_100},
                                  {"5x5_250", cv::aruco::DICT_5X5_250},         {"5x5_1000", cv::aruco::DICT_5X5_1000},
                                  {"6x6_50", cv::aruco::DICT_6X6_50},           {"6x6_100", cv::aruco::DICT_6X6_100},
                                  {"6x6_250", cv::aruco::DICT_6X6_250},         {"6x6_1000", cv::aruco::DICT_6X6_1000},
                                  {"7x7_50", cv::aruco::DICT_7X7_50},           {"7x7_1000", cv::aruco::DICT_7X7_1000},
                                  {"original", cv::aruco::DICT_ARUCO_ORIGINAL}, {"apriltag_36h11", cv::aruco::DICT_APRILTAG_36h11}};

int number_of(const std::string& name) {
    std::string names;
    for (const Named& d : dictionaries) {
        if (name == d.name) return d.number;
        names += std::string(names.empty() ? "" : ", ") + d.name;
    }
    throw std::invalid_argument("dictionary=" + name + " is unknown; there are " + names);
}

double degrees(double radians) { return radians * 57.29577951308232; }

/// Noise level of a picture: the mean of |Laplacian| over every fourth pixel of every fourth row (J. Immerkaer, 1996).
double noise(const cv::Mat& grey) {
    std::int64_t sum = 0, count = 0;
    for (int y = 1; y + 1 < grey.rows; y += 4) {
        const std::uint8_t *const a = grey.ptr(y - 1), *const b = grey.ptr(y), *const c = grey.ptr(y + 1);
        for (int x = 1; x + 1 < grey.cols; x += 4, ++count)
            sum += std::abs(a[x - 1] + a[x + 1] + c[x - 1] + c[x + 1] - 2 * (a[x] + c[x] + b[x - 1] + b[x + 1]) + 4 * b[x]);
    }
    return count == 0 ? 0.0 : std::sqrt(1.5707963267948966) * static_cast<double>(sum) / (6.0 * static_cast<double>(count));
}
}  // namespace

struct MarkerDetector::Inside {
    cv::Ptr<cv::aruco::Dictionary>         dictionary;
    cv::Ptr<cv::aruco::DetectorParameters> parameters = cv::aruco::DetectorParameters::create();
    std::optional<Camera>                  camera;
    cv::Matx33d                            k = cv::Matx33d::eye();
    cv::Mat                                d = cv::Mat::zeros(1, 5, CV_64F);
    Frame                                  grey;
    cv::Mat                                smooth;

    void refine(const cv::Mat& picture, std::vector<cv::Point2f>& corners) const;
    Pose pose(Marker& marker, double size) const;
};

MarkerDetector::MarkerDetector(const std::string& dictionary, std::optional<Camera> camera) : inside_(std::make_unique<Inside>()) {
    cv::setNumThreads(1);  // a second one gains nothing, and would be where real-time threads are
    Inside& in = *inside_;
    in.dictionary = cv::aruco::getPredefinedDictionary(number_of(dictionary));
    in.parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_NONE;  // refine() does it
    in.camera = std::move(camera);
    if (const auto& c = in.camera) {
        in.k = cv::Matx33d(c->fx, 0, c->cx, 0, c->fy, c->cy, 0, 0, 1);
        for (int i = 0; i < 5; ++i) in.d.at<double>(i) = c->distortion[static_cast<std::size_t>(i)];
    }
}

MarkerDetector::~MarkerDetector() = default;

int MarkerDetector::count() const { return inside_->dictionary->bytesList.rows; }

std::vector<Marker> MarkerDetector::find(const Frame& frame, int id, double size_mm) {
    Inside&      in = *inside_;
    const Frame* grey = &frame;
    if (frame.format != Format::grey) {
        in.grey = frame;
        to_grey(in.grey);
        grey = &in.grey;
    }
    const cv::Mat picture(grey->height, grey->width, CV_8UC1, const_cast<std::uint8_t*>(grey->pixels.data()));
    // Noise floods the search for contours, so the search is in a smoothed picture; the corners are then placed in the one that was taken.
    const bool noisy = noise(picture) > 2.0;
    if (noisy) cv::GaussianBlur(picture, in.smooth, {5, 5}, 1.2);

    std::vector<std::vector<cv::Point2f>> corners;
    std::vector<int>                      ids;
    cv::aruco::detectMarkers(noisy ? in.smooth : picture, in.dictionary, corners, ids, in.parameters);
    for (auto& four : corners) in.refine(picture, four);
    std::vector<Marker> found;
    for (std::size_t i = 0; i < ids.size(); ++i) {
        if (id >= 0 && ids[i] != id) continue;
        Marker marker;
        marker.id = ids[i];
        for (std::size_t c = 0; c < 4; ++c) marker.corners[c] = {corners[i][c].x, corners[i][c].y};
        if (in.camera && size_mm > 0.0) marker.pose = in.pose(marker, size_mm);
        found.push_back(marker);
    }
    std::sort(found.begin(), found.end(), [](const Marker& a, const Marker& b) { return a.id < b.id; });
    return found;
}

// The window about a corner reaches as far as the black rim is wide, so that it sees two edges and no other corner.
void MarkerDetector::Inside::refine(const cv::Mat& picture, std::vector<cv::Point2f>& corners) const {
    double shortest = 1e9;
    for (std::size_t i = 0; i < 4; ++i) shortest = std::min(shortest, cv::norm(corners[(i + 1) % 4] - corners[i]));
    const double cell = shortest / (dictionary->markerSize + 2);
    const int    reach = std::clamp(static_cast<int>(std::lround(0.9 * cell)), 2, 12);
    const int    across = 2 * reach + 6;  // cornerSubPix wants some room
    if (picture.cols < across || picture.rows < across) return;
    cv::cornerSubPix(picture, corners, {reach, reach}, {-1, -1}, {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 40, 0.005});
}

Pose MarkerDetector::Inside::pose(Marker& marker, double size) const {
    const double             h = size / 2;
    std::vector<cv::Point3d> square{{-h, h, 0}, {h, h, 0}, {h, -h, 0}, {-h, -h, 0}};
    std::vector<cv::Point2d> seen;
    for (const auto& c : marker.corners) seen.emplace_back(c[0], c[1]);
    // Two planes give nearly the same picture; the one that fits better comes first.
    std::vector<cv::Mat> rotations, places;
    cv::solvePnPGeneric(square, seen, k, d, rotations, places, false, cv::SOLVEPNP_IPPE_SQUARE);
    if (rotations.empty()) throw std::runtime_error("its corners are those of no square");
    cv::Mat r = rotations[0], t = places[0];
    cv::solvePnPRefineLM(square, seen, k, d, r, t);
    std::vector<cv::Point2d> back;
    cv::projectPoints(square, r, t, k, d, back);
    double sum = 0;
    for (std::size_t i = 0; i < 4; ++i) sum += (back[i] - seen[i]).dot(back[i] - seen[i]);
    marker.error_px = std::sqrt(sum / 4);
    cv::Matx33d m;
    cv::Rodrigues(r, m);
    Pose pose;
    pose.x_mm = t.at<double>(0), pose.y_mm = t.at<double>(1), pose.z_mm = t.at<double>(2);
    pose.roll_deg = degrees(std::atan2(m(2, 1), m(2, 2)));
    pose.pitch_deg = degrees(std::asin(std::clamp(-m(2, 0), -1.0, 1.0)));
    pose.yaw_deg = degrees(std::atan2(m(1, 0), m(0, 0)));
    return pose;
}

}  // namespace hal::vision
