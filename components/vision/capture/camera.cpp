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

struct Word {
    std::size_t begin = 0;
    std::size_t end = 0;
};

/// Shared by both formats: spans, problems and the result.
class Text {
public:
    explicit Text(std::string_view text) : text_(text) {}
    CameraText finish() {
        if (found_.problems.empty()) {
            check();
        }
        return std::move(found_);
    }

protected:
    void report(std::size_t begin, std::size_t end, std::string sentence, std::string help) {
        text::add(found_.problems, begin, end, std::move(sentence), std::move(help));
    }
    std::string of(Word w) const {
        return std::string(text_.substr(w.begin, std::min<std::size_t>(w.end - w.begin, 60)));
    }

    bool number(Word w, double& to) {
        const std::string token = of(w);
        const auto real = parse_real(token);
        to = real.value_or(0.0);
        if (real && std::fabs(to) < 1e12) return true;
        report(w.begin, w.end, "'" + token + "' is not a number",
               "write numbers as in 600.5 or -2e-3");
        return false;
    }
    bool whole(Word w, int& to) {
        double value = 0;
        if (!number(w, value)) return false;
        if (value != std::floor(value) || value < 1 || value > 8192) {
            report(w.begin, w.end, "'" + of(w) + "' is not a valid image width or height",
                   "write an integer of 1..8192");
            return false;
        }
        to = static_cast<int>(value);
        return true;
    }
    void missing(const char* name, const std::string& example) {
        report(0, std::min<std::size_t>(text_.size(), 1), std::string("missing ") + name,
               "write a line: " + example);
    }
    /// Rejects implausible cameras: a file of another kind, or numbers in the wrong order.
    void check() {
        const Camera& c = found_.camera;
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
        double corner = 0;
        for (const double x : {-c.cx / c.fx, (c.width - 1 - c.cx) / c.fx}) {
            for (const double y : {-c.cy / c.fy, (c.height - 1 - c.cy) / c.fy}) {
                corner = std::max(corner, std::hypot(x, y));
            }
        }
        const double step = corner / 200;
        const double tangential = 6 * std::hypot(p1, p2);
        double seen = 0;
        // a lens that needs ten times the radius of the corner shows nothing there
        for (int i = 1; i <= 2000 && seen < corner; ++i) {
            const double q = step * i * step * i;
            const double slope =
                1 + q * (3 * k1 + q * (5 * k2 + q * 7 * k3)) - tangential * step * i;
            if (!(slope > 0 && slope < 4)) return seen * c.fx;
            seen = step * i * (1 + q * (k1 + q * (k2 + q * k3)));
        }
        return seen < corner ? seen * c.fx : -1.0;
    }

    std::string_view text_;
    CameraText found_;
    Word focal_, centre_, distortion_;
};

class OwnText : public Text {
public:
    using Text::Text;
    CameraText read() {
        text::Lines lines(text_);
        while (const auto line = lines.next()) {
            one(*line);
        }
        Camera& c = found_.camera;
        if (found_.problems.empty()) {
            if (c.width == 0) {
                missing("size", "size 640 480");
            }
            if (c.fx == 0 && focal_.end == 0) {
                missing("focal", "focal 600 600");
            }
            if (centre_.end == 0) {
                c.cx = (c.width - 1) / 2.0;
                c.cy = (c.height - 1) / 2.0;
            }
        }
        return finish();
    }

private:
    /// Reads a line KEY VALUES…, and reports an unknown or repeated key and invalid values.
    void one(const text::Word& line) {
        std::vector<Word> words;
        for (const text::Word& word : text::words_of(line, ",=")) {
            words.push_back({word.at.offset, word.at.offset + word.at.length});
        }
        if (words.empty()) return;
        Camera& c = found_.camera;
        const std::string name = of(words[0]);
        const Word all{words[0].begin, words.back().end};
        if (name == "size") {
            if (counted(words, name, 2, 2, "size 640 480") && once(c.width != 0, words[0])) {
                whole(words[1], c.width);
                whole(words[2], c.height);
            }
        } else if (name == "focal") {
            if (!counted(words, name, 1, 2, "focal 600 600") || !once(focal_.end != 0, words[0])) {
                return;
            }
            focal_ = all;
            if (number(words[1], c.fx)) {
                c.fy = c.fx;
            }
            if (words.size() == 3) {
                number(words[2], c.fy);
            }
        } else if (name == "centre" || name == "center") {
            if (!counted(words, name, 2, 2, "centre 319.5 239.5") ||
                !once(centre_.end != 0, words[0])) {
                return;
            }
            centre_ = all;
            number(words[1], c.cx);
            number(words[2], c.cy);
        } else if (name == "distortion") {
            if (!counted(words, name, 1, 5, "distortion 0.1 -0.2 0 0 0") ||
                !once(distortion_.end != 0, words[0])) {
                return;
            }
            distortion_ = all;
            for (std::size_t i = 1; i < words.size(); ++i) {
                number(words[i], c.distortion[i - 1]);
            }
        } else {
            report(words[0].begin, words[0].end, "unknown key '" + name + "'",
                   "the keys are size, focal, centre, distortion");
        }
    }
    bool counted(const std::vector<Word>& words, const std::string& name, std::size_t min,
                 std::size_t max, const char* example) {
        const std::size_t count = words.size() - 1;
        if (count >= min && count <= max) return true;
        const std::string wants =
            min == max ? std::to_string(max) : std::to_string(min) + " to " + std::to_string(max);
        report(words[0].begin, words.back().end,
               name + " has " + hal::counted(count, "number") + ", expected " + wants,
               std::string("write ") + example);
        return false;
    }
    bool once(bool twice, Word name) {
        if (twice) {
            report(name.begin, name.end, "duplicate key '" + of(name) + "'", "delete one of them");
        }
        return !twice;
    }
};

#ifdef HALCYON_YAML
/// The YAML that the calibration tools of OpenCV and ROS write.
class YamlText : public Text {
public:
    using Text::Text;
    CameraText read() {
        try {
            read(YAML::Load(std::string(text_)));
        } catch (const YAML::Exception& problem) {
            found_.problems.clear();
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
            return missing("camera_matrix", "camera_matrix, as OpenCV's calibration writes it");
        }
        Camera& c = found_.camera;
        size(file["image_width"], c.width);
        size(file["image_height"], c.height);
        if (found_.problems.empty() && (c.width == 0 || c.height == 0)) {
            missing("image_width and image_height", "image_width: 640");
        }
        std::vector<double> k, d;
        if (matrix(file, "camera_matrix", k, focal_)) {
            if (k.size() == 9 && (k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1)) {
                report(focal_.begin, focal_.end, "invalid camera_matrix",
                       "its rows are fx 0 cx, 0 fy cy, 0 0 1");
            } else if (k.size() == 9) {
                c.fx = k[0];
                c.cx = k[2];
                c.fy = k[4];
                c.cy = k[5];
            } else {
                report(focal_.begin, focal_.end,
                       "camera_matrix has " + std::to_string(k.size()) + " numbers, not 9",
                       "it has 3 rows and 3 columns");
            }
            centre_ = focal_;
        } else if (found_.problems.empty()) {
            missing("camera_matrix", "camera_matrix, as OpenCV's calibration writes it");
        }
        bool plain = matrix(file, "distortion_coefficients", d, distortion_);
        if (plain && d.size() > 5 &&
            std::any_of(d.begin() + 5, d.end(), [](double v) { return v != 0; })) {
            report(distortion_.begin, distortion_.end,
                   "the distortion has " + std::to_string(d.size()) + " coefficients",
                   "calibrate with k1 k2 p1 p2 k3 only");
            plain = false;
        }
        for (std::size_t i = 0; plain && i < std::min<std::size_t>(d.size(), 5); ++i) {
            c.distortion[i] = d[i];
        }
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
            whole(place(node), to);
        }
    }
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
            if (!number(place(element), value)) return false;
            to.push_back(value);
        }
        return true;
    }
};
#else
/// This build reads no YAML.
class YamlText : public Text {
public:
    using Text::Text;
    CameraText read() {
        report(0, 1, "a calibration in YAML: this build of Halcyon does not read it",
               "sudo apt-get install libyaml-cpp-dev, then build again; or write size, focal, "
               "centre and distortion");
        return std::move(found_);
    }
};
#endif

}  // namespace

CameraText read_camera(std::string_view text) {
    const std::size_t first = text.find_first_not_of(" \t\r\n");
    const bool yaml =
        first != std::string_view::npos &&
        (text.substr(first, 5) == "%YAML" || text.find("camera_matrix:") != std::string_view::npos);
    return yaml ? YamlText(text).read() : OwnText(text).read();
}

}  // namespace hal::vision
