// SPDX-License-Identifier: MIT
#include "vision/capture/camera.hpp"

#include "text/numbers.hpp"
#include "text/quoting.hpp"

#include <algorithm>
#include <cmath>

#ifdef HALCYON_YAML
#include <yaml-cpp/yaml.h>
#endif

namespace hal::vision {
namespace {

/// Offsets in the text; an end of 0: not in the text.
struct Word {
    std::size_t begin = 0;
    std::size_t end = 0;
};

/// Shared by both formats: spans, problems and the result.
class CameraReader {
public:
    explicit CameraReader(std::string_view text) : text_(text) {}
    CameraText finish() {
        if (result_.problems.empty()) {
            report_implausible();
        }
        return std::move(result_);
    }

protected:
    void report(std::size_t begin, std::size_t end, std::string sentence, std::string help) {
        text::add(result_.problems, begin, end, std::move(sentence), std::move(help));
    }
    std::string text_at(Word w) const {
        return std::string(text_.substr(w.begin, std::min<std::size_t>(w.end - w.begin, 60)));
    }

    bool parse_number(Word w, double& to) {
        const std::string token = text_at(w);
        const auto real = parse_real(token);
        to = real.value_or(0.0);
        if (real && std::fabs(to) < 1e12) return true;
        report(w.begin, w.end, "'" + token + "' is not a number",
               "write numbers as in 600.5 or -2e-3");
        return false;
    }
    /// A width or a height.
    bool parse_pixels(Word w, int& to) {
        double value = 0;
        if (!parse_number(w, value)) return false;
        if (value != std::floor(value) || value < 1 || value > 8192) {
            report(w.begin, w.end, "'" + text_at(w) + "' is not a valid image width or height",
                   "write an integer of 1..8192");
            return false;
        }
        to = static_cast<int>(value);
        return true;
    }
    void report_missing(const char* name, const std::string& example) {
        report(0, std::min<std::size_t>(text_.size(), 1), std::string("missing ") + name,
               "write a line: " + example);
    }
    /// Rejects implausible cameras: a file of another kind, or numbers in the wrong order.
    void report_implausible() {
        const Camera& c = result_.camera;
        const auto wrong = [&](Word at, const std::string& sentence, const std::string& help) {
            report(at.begin, std::max(at.end, at.begin + 1), sentence, help);
        };
        if (!(c.fx > 0 && c.fy > 0)) {
            return wrong(focal_, "focal length is not positive",
                         "write it in px, often about the image width");
        }
        if (c.fx > 100.0 * c.width || c.fx < 0.05 * c.width || c.fy > 2 * c.fx || c.fx > 2 * c.fy) {
            wrong(focal_,
                  "implausible focal lengths for an image " + std::to_string(c.width) + " px wide",
                  "write them in px and nearly equal; often about the width");
        }
        if (c.cx < -c.width || c.cx > 2 * c.width || c.cy < -c.height || c.cy > 2 * c.height) {
            wrong(centre_, "the centre is far outside the image",
                  "write it in px, near half the width and half the height");
        }
        if (const double radius = usable_px(c); radius >= 0.0) {
            wrong(distortion_,
                  "invalid distortion: beyond " + std::to_string(std::lround(radius)) +
                      " px from the centre it folds the image over itself or scales it up more "
                      "than four times",
                  "k1 k2 p1 p2 k3 for coordinates divided by the focal length, of the order of "
                  "0.1; calibrate with views that reach into the "
                  "corners of the picture");
        }
    }

    /// The distance from the centre, within the picture, at which the lens model stops being
    /// usable, px; negative: nowhere. The radial part must grow with the radius out to the farthest
    /// corner, at most four times as fast, and the tangential part must not turn it back.
    static double usable_px(const Camera& c) {
        const auto [k1, k2, p1, p2, k3] = c.distortion;
        const double corner = corner_radius(c);
        const double step = corner / 200;
        const double tangential = 6 * std::hypot(p1, p2);
        double distorted = 0;  // the radius at which a ray of the radius r is seen
        // a lens that needs ten times the radius of the corner shows nothing there
        for (int i = 1; i <= 2000 && distorted < corner; ++i) {
            const double r = step * i;
            const double q = r * r;
            const double slope = 1 + q * (3 * k1 + q * (5 * k2 + q * 7 * k3)) - tangential * r;
            if (!(slope > 0 && slope < 4)) return distorted * c.fx;
            distorted = r * (1 + q * (k1 + q * (k2 + q * k3)));
        }
        return distorted < corner ? distorted * c.fx : -1.0;
    }
    /// The distance of the farthest corner from the centre, divided by the focal length.
    static double corner_radius(const Camera& c) {
        double radius = 0;
        for (const double x : {-c.cx / c.fx, (c.width - 1 - c.cx) / c.fx}) {
            for (const double y : {-c.cy / c.fy, (c.height - 1 - c.cy) / c.fy}) {
                radius = std::max(radius, std::hypot(x, y));
            }
        }
        return radius;
    }

    Camera& camera() { return result_.camera; }

    std::string_view text_;
    CameraText result_;
    Word focal_, centre_, distortion_;  ///< where they are given
};

/// Lines KEY NUMBER….
class CameraLines : public CameraReader {
public:
    using CameraReader::CameraReader;
    CameraText read() {
        text::Lines lines(text_);
        while (const auto line = lines.next()) {
            read_line(*line);
        }
        if (result_.problems.empty()) {
            complete();
        }
        return finish();
    }

private:
    /// The name of a key, then its numbers.
    using Words = std::vector<Word>;

    struct Key {
        std::string_view name;
        std::size_t min_numbers;
        std::size_t max_numbers;
        const char* example;
        Word CameraLines::* given;  ///< the line with this key; without an end: none yet
        void (CameraLines::*read)(const Words&);
    };

    static const Key* find_key(std::string_view name) {
        static constexpr Key keys[] = {
            {"size", 2, 2, "size 640 480", &CameraLines::size_, &CameraLines::read_size},
            {"focal", 1, 2, "focal 600 600", &CameraLines::focal_, &CameraLines::read_focal},
            {"centre", 2, 2, "centre 319.5 239.5", &CameraLines::centre_,
             &CameraLines::read_centre},
            {"center", 2, 2, "centre 319.5 239.5", &CameraLines::centre_,
             &CameraLines::read_centre},
            {"distortion", 1, 5, "distortion 0.1 -0.2 0 0 0", &CameraLines::distortion_,
             &CameraLines::read_distortion},
        };
        const auto* const key =
            std::ranges::find_if(keys, [&](const Key& row) { return row.name == name; });
        return key == std::end(keys) ? nullptr : key;
    }

    /// Reads one line. Reports an unknown or repeated key, a wrong number of numbers and invalid
    /// numbers.
    void read_line(const text::Word& line) {
        Words words;
        for (const text::Word& word : text::words_of(line, ",=")) {
            words.push_back({word.at.offset, word.at.offset + word.at.length});
        }
        if (words.empty()) return;
        const Word name = words.front();
        const Key* const key = find_key(text_at(name));
        if (key == nullptr) {
            report(name.begin, name.end, "unknown key '" + text_at(name) + "'",
                   "the keys are size, focal, centre, distortion");
            return;
        }
        const std::size_t count = words.size() - 1;
        if (count < key->min_numbers || count > key->max_numbers) {
            report_count(*key, words);
            return;
        }
        if ((this->*key->given).end != 0) {
            report(name.begin, name.end, "duplicate key '" + text_at(name) + "'",
                   "delete one of them");
            return;
        }
        this->*key->given = {name.begin, words.back().end};
        (this->*key->read)(words);
    }
    void report_count(const Key& key, const Words& words) {
        std::string expected = std::to_string(key.max_numbers);
        if (key.min_numbers != key.max_numbers) {
            expected = std::to_string(key.min_numbers) + " to " + expected;
        }
        report(words.front().begin, words.back().end,
               text_at(words.front()) + " has " + counted(words.size() - 1, "number") +
                   ", expected " + expected,
               std::string("write ") + key.example);
    }

    void read_size(const Words& words) {
        if (!parse_pixels(words[1], camera().width)) {
            size_ = {};  // another line may give the size
        }
        parse_pixels(words[2], camera().height);
    }
    void read_focal(const Words& words) {
        Camera& c = camera();
        if (parse_number(words[1], c.fx)) {
            c.fy = c.fx;
        }
        if (words.size() == 3) {
            parse_number(words[2], c.fy);
        }
    }
    void read_centre(const Words& words) {
        parse_number(words[1], camera().cx);
        parse_number(words[2], camera().cy);
    }
    void read_distortion(const Words& words) {
        for (std::size_t i = 1; i < words.size(); ++i) {
            parse_number(words[i], camera().distortion[i - 1]);
        }
    }

    /// Reports missing keys. Without `centre` the optical axis meets the middle of the image.
    void complete() {
        Camera& c = camera();
        if (size_.end == 0) {
            report_missing("size", "size 640 480");
        }
        if (focal_.end == 0) {
            report_missing("focal", "focal 600 600");
        }
        if (centre_.end == 0) {
            c.cx = (c.width - 1) / 2.0;
            c.cy = (c.height - 1) / 2.0;
        }
    }

    Word size_;
};

#ifdef HALCYON_YAML
/// The YAML that the calibration tools of OpenCV and ROS write.
class CameraYaml : public CameraReader {
public:
    using CameraReader::CameraReader;
    CameraText read() {
        try {
            read(YAML::Load(std::string(text_)));
        } catch (const YAML::Exception& problem) {
            result_.problems.clear();
            const std::size_t at =
                problem.mark.is_null()
                    ? 0
                    : std::min<std::size_t>(static_cast<std::size_t>(problem.mark.pos),
                                            text_.size());
            report(at, std::min(at + 1, text_.size()), "invalid YAML: " + problem.msg,
                   "OpenCV's calibration writes it");
        }
        return finish();
    }

private:
    void read(const YAML::Node& file) {
        if (!file.IsMap()) {
            report_missing_matrix();
            return;
        }
        size(file["image_width"], camera().width);
        size(file["image_height"], camera().height);
        if (result_.problems.empty() && (camera().width == 0 || camera().height == 0)) {
            report_missing("image_width and image_height", "image_width: 640");
        }
        read_camera_matrix(file);
        read_distortion(file);
    }
    void report_missing_matrix() {
        report_missing("camera_matrix", "camera_matrix, as OpenCV's calibration writes it");
    }

    /// Its rows, one after the other, are fx 0 cx, 0 fy cy, 0 0 1.
    void read_camera_matrix(const YAML::Node& file) {
        std::vector<double> k;
        if (!matrix(file, "camera_matrix", k, focal_)) {
            if (result_.problems.empty()) {
                report_missing_matrix();
            }
            return;
        }
        centre_ = focal_;
        if (k.size() != 9) {
            report(focal_.begin, focal_.end,
                   "camera_matrix has " + std::to_string(k.size()) + " numbers, not 9",
                   "it has 3 rows and 3 columns");
            return;
        }
        if (k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1) {
            report(focal_.begin, focal_.end, "invalid camera_matrix",
                   "its rows are fx 0 cx, 0 fy cy, 0 0 1");
            return;
        }
        Camera& c = camera();
        c.fx = k[0];
        c.cx = k[2];
        c.fy = k[4];
        c.cy = k[5];
    }

    /// k1 k2 p1 p2 k3, of which the last may be missing; coefficients of larger models must be 0.
    void read_distortion(const YAML::Node& file) {
        std::vector<double> given;
        if (!matrix(file, "distortion_coefficients", given, distortion_)) return;
        auto& coefficients = camera().distortion;
        const std::size_t count = std::min(given.size(), coefficients.size());
        if (std::any_of(given.begin() + static_cast<std::ptrdiff_t>(count), given.end(),
                        [](double value) { return value != 0; })) {
            report(distortion_.begin, distortion_.end,
                   "the distortion has " + std::to_string(given.size()) + " coefficients",
                   "calibrate with k1 k2 p1 p2 k3 only");
            return;
        }
        std::copy_n(given.begin(), count, coefficients.begin());
    }

    /// Where a scalar is in the text; with quotes, where it begins.
    Word place(const YAML::Node& node) const {
        const YAML::Mark mark = node.Mark();
        const std::size_t at =
            mark.is_null()
                ? 0
                : std::min<std::size_t>(static_cast<std::size_t>(mark.pos), text_.size());
        return {at,
                std::min(at + std::max<std::size_t>(node.IsScalar() ? node.Scalar().size() : 1, 1),
                         text_.size())};
    }
    void size(const YAML::Node& node, int& to) {
        if (node) {
            parse_pixels(place(node), to);
        }
    }
    /// Returns whether the file has the matrix, and its numbers are valid; `at` is its name.
    bool matrix(const YAML::Node& file, const std::string& name, std::vector<double>& to,
                Word& at) {
        const YAML::Node node = file[name];
        if (!node) return false;
        at.begin = std::min(text_.find(name), text_.size());
        at.end = std::min(at.begin + name.size(), text_.size());
        const YAML::Node data = node.IsMap() ? node["data"] : node;
        if (!data || !data.IsSequence() || data.size() > 64) {
            report(at.begin, at.end, name + " has no data",
                   "it is followed by rows:, cols:, dt: and data: [ numbers ]");
            return false;
        }
        for (const YAML::Node& element : data) {
            double value = 0;
            if (!parse_number(place(element), value)) return false;
            to.push_back(value);
        }
        return true;
    }
};
#else
/// This build reads no YAML.
class CameraYaml : public CameraReader {
public:
    using CameraReader::CameraReader;
    CameraText read() {
        report(0, 1, "a calibration in YAML: this build of Halcyon does not read it",
               "sudo apt-get install libyaml-cpp-dev, then build again; or write size, focal, "
               "centre and distortion");
        return std::move(result_);
    }
};
#endif

}  // namespace

CameraText read_camera(std::string_view text) {
    const std::size_t first = text.find_first_not_of(" \t\r\n");
    const bool yaml =
        first != std::string_view::npos &&
        (text.substr(first, 5) == "%YAML" || text.find("camera_matrix:") != std::string_view::npos);
    return yaml ? CameraYaml(text).read() : CameraLines(text).read();
}

}  // namespace hal::vision
