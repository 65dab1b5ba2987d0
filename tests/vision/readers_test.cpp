// SPDX-License-Identifier: MIT
// What users give: addresses, pictures in a folder, calibrations.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <unistd.h>

#include "vision/capture/camera.hpp"
#include "vision/capture/pnm.hpp"
#include "vision/capture/source.hpp"
#include "vision/detect/homography.hpp"

namespace hal::vision {
namespace {

std::string pnm(const std::string& text, Frame& frame) {
    const auto problem =
        read_pnm(reinterpret_cast<const std::uint8_t*>(text.data()), text.size(), frame);
    return problem ? to_string(problem->kind) + (": " + problem->text) : "";
}

TEST(Pnm, is_read_in_all_its_kinds) {
    Frame f;
    EXPECT_EQ(pnm("P2 # grey\n2 2\n# most\n15\n0 15\n 5 10\n", f), "");
    EXPECT_EQ(f.pixels, (std::vector<std::uint8_t>{0, 255, 85, 170}));
    EXPECT_EQ(pnm(std::string("P5\n2 1\n255\n\x07\xff", 13), f), "");
    EXPECT_EQ(f.pixels, (std::vector<std::uint8_t>{7, 255}));
    EXPECT_EQ(pnm(std::string("P5 1 1 65535 \x80\x01", 15), f), "");
    EXPECT_EQ(f.pixels, (std::vector<std::uint8_t>{128}));
    EXPECT_EQ(pnm("P6\n1 1\n255\nrgb", f), "");
    EXPECT_EQ(f.format, Format::bgr);
    EXPECT_EQ(f.pixels, (std::vector<std::uint8_t>{'b', 'g', 'r'}));
    EXPECT_EQ(pnm("P3 1 1 255 1 2 3", f), "");
    EXPECT_EQ(f.pixels, (std::vector<std::uint8_t>{3, 2, 1}));
}

TEST(Pnm, is_written_as_it_was_read) {
    Frame f, g;
    f.resize(5, 3, Format::bgr);
    for (std::size_t i = 0; i < f.pixels.size(); ++i) {
        f.pixels[i] = static_cast<std::uint8_t>(i * 7);
    }
    EXPECT_EQ(pnm(write_pnm(f), g), "");
    EXPECT_EQ(f.pixels, g.pixels);
    to_grey(f);
    EXPECT_EQ(pnm(write_pnm(f), g), "");
    EXPECT_EQ(f.pixels, g.pixels);
}

TEST(Pnm, that_cannot_be_read_says_why) {
    Frame f;
    EXPECT_EQ(pnm("GIF89a", f),
              "damaged: invalid PGM or PPM: it does not begin with P2, P3, P5 or P6");
    EXPECT_EQ(pnm("P5 640", f),
              "damaged: its header is truncated before width, height and maximum");
    EXPECT_EQ(pnm("P5 0 4 255 ", f),
              "damaged: invalid header: a value is 0, or the maximum exceeds 65535");
    EXPECT_EQ(pnm("P5 4 4 255 abc", f), "damaged: truncated: 3 of 16 bytes");
    EXPECT_EQ(pnm("P2 2 1 9 1 10", f), "damaged: a sample exceeds the maximum given in the header");
    EXPECT_EQ(pnm("P2 2 1 9 1   ", f), "damaged: sample 2 of 2 is not a number");
    EXPECT_EQ(
        pnm("P5 60000 60000 255 ", f),
        "too large: a frame of 60000 x 60000 is larger than 8192 x 8192 or 22 million pixels");
    EXPECT_EQ(pnm("P5 99999999999999999999 1 255 ", f),
              "too large: a frame of more than 65535 x 1 is larger than 8192 x 8192 or 22 million pixels");
}

std::string refusal(const char* address) {
    try {
        make_source(address, {});
        return "";
    } catch (const std::invalid_argument& e) {
        return e.what();
    }
}

TEST(Address, that_is_wrong_says_what_to_type) {
    EXPECT_EQ(refusal("v4l2:/dev/video0?width=1280&height=720&fps=59.94&grey"), "");
    EXPECT_EQ(refusal("frames:shots?loop&fps=10"), "");
    EXPECT_EQ(refusal("camera"),
              "source=camera names no source; write v4l2:/dev/video0, frames:FOLDER or sim:SCENE");
    EXPECT_EQ(refusal("usb:1"),
              "source=usb:1: there is no source 'usb:'; write v4l2:/dev/video0, frames:FOLDER or "
              "sim:SCENE");
    EXPECT_EQ(refusal("frames:a?speed=3"),
              "source=frames:a?speed=3: frames: has no option 'speed'; it has fps, delay-ms, loop");
    EXPECT_EQ(refusal("frames:a?fps=3&fps=4"),
              "source=frames:a?fps=3&fps=4 has 'fps' twice; delete one of them");
    EXPECT_EQ(refusal("frames:a?fps=fast"),
              "source=frames:a?fps=fast: 'fast' is not a number; write fps=30");
    EXPECT_EQ(refusal("v4l2:/dev/video0?width=1"),
              "source=v4l2:/dev/video0?width=1: width=1 is outside 2 to 8192");
    EXPECT_EQ(
        refusal("v4l2:/dev/video0?width=99.5"),
        "source=v4l2:/dev/video0?width=99.5: width=99.5 is not a whole number; write width=640");
    EXPECT_EQ(refusal("frames:a?loop=yes"),
              "source=frames:a?loop=yes: 'loop=yes' is neither 0 nor 1; write loop alone");
    EXPECT_EQ(refusal("frames:?loop"), "source=frames:?loop has no folder; write frames:FOLDER");
}

struct Folder : testing::Test {
    const std::filesystem::path path = std::filesystem::path(testing::TempDir()) /
                                       ("halcyon-frames-" + std::to_string(::getpid()));
    Frame frame;
    Folder() { std::filesystem::create_directories(path); }
    ~Folder() override { std::filesystem::remove_all(path); }

    void put(const char* name, const std::string& text) {
        std::ofstream(path / name, std::ios::binary) << text;
    }
    void three() {
        put("b.pgm", "P2 1 1 255 20");
        put("a.pgm", "P2 1 1 255 10");

        put("c.ppm", "P3 1 1 255 30 30 30");
        put("notes.txt", "nothing");
    }
    std::unique_ptr<Source> source(const std::string& options) {
        return make_source("frames:" + path.string() + options, {});
    }
    /// The first pixel of what comes at each moment, in ms; -1 nothing, -2 bad, -3 lost.
    std::vector<int> at(Source& from, std::initializer_list<int> moments) {
        std::vector<int> all;
        for (const int ms : moments) {
            const Got got = from.next(ms * 1'000'000ll, 0, frame);
            all.push_back(got == Got::frame ? frame.pixels[0] : -static_cast<int>(got));
        }
        return all;
    }
};

TEST_F(Folder, of_frames_is_shown_in_the_order_of_names_at_its_rate) {
    three();
    const auto from = source("?fps=100");
    ASSERT_TRUE(from->open(0));
    EXPECT_EQ(at(*from, {0, 5, 10, 19, 20, 29, 30, 31}),
              (std::vector<int>{10, -1, 20, -1, 30, -1, -3, -1}));
    EXPECT_EQ(from->problem().kind, FrameError::ended);
    EXPECT_EQ(from->problem().text,
              "all frames of " + path.string() +
                  " were shown; to repeat them, write frames:" + path.string() + "?loop");
}

TEST_F(Folder, of_frames_begins_anew_and_skips_what_is_too_old) {
    three();
    const auto from = source("?fps=100&loop&delay-ms=5");
    ASSERT_TRUE(from->open(0));
    EXPECT_EQ(at(*from, {0, 5, 36, 45}), (std::vector<int>{-1, 10, 10, 20}));
    EXPECT_EQ(from->skipped(), 2u);
    EXPECT_EQ(frame.stamp_ns, 40'000'000);
}

TEST_F(Folder, with_a_damaged_file_goes_on_with_the_next) {
    three();
    put("b.pgm", "P5 9 9 255 ");
    const auto from = source("?fps=100");
    ASSERT_TRUE(from->open(0));
    EXPECT_EQ(at(*from, {0, 10, 20}), (std::vector<int>{10, -2, 30}));
    EXPECT_EQ(from->problem().text, path.string() + "/b.pgm: truncated: 0 of 81 bytes");
}

TEST_F(Folder, that_is_not_there_or_empty_is_absent) {
    const auto from = source("");
    EXPECT_FALSE(from->open(0));
    EXPECT_EQ(from->problem().text, "the folder " + path.string() + " has no .pgm or .ppm file");
    std::filesystem::remove_all(path);
    EXPECT_FALSE(from->open(0));
    EXPECT_EQ(from->problem().kind, FrameError::missing);
    std::filesystem::create_directories(path);
    three();
    EXPECT_TRUE(from->open(0));
}

std::string said(const CameraText& text, const std::string& of) {
    std::string all;
    for (const auto& p : text.problems) {
        all += of.substr(p.begin, p.end - p.begin) + "|" + p.sentence + "\n";
    }
    return all;
}

TEST(Camera, is_read_from_a_file_of_our_own) {
    const auto read = read_camera("# room\nsize 640 480\nfocal 600 # both\ndistortion 0.1 -0.2\n");
    ASSERT_TRUE(read.problems.empty());
    EXPECT_EQ(read.camera.fy, 600);
    EXPECT_EQ(read.camera.cx, 319.5);
    EXPECT_EQ(read.camera.distortion[1], -0.2);
}

TEST(Camera, is_read_from_what_opencv_writes) {
    const auto read = read_camera(
        "%YAML:1.0\n---\ncalibration_time: \"x\"\nimage_width: 640\nimage_height: 480\n"
        "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 6.0e+02, 0., "
        "3.2e+02, 0.,\n       601., 240., 0., "
        "0., 1. ]\n"
        "distortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   data: [ "
        "1.e-01, 2.e-02, 0., 0., 3.e-03 ]\n");
    ASSERT_TRUE(read.problems.empty()) << read.problems[0].sentence;
    EXPECT_EQ(read.camera.fx, 600);
    EXPECT_EQ(read.camera.fy, 601);
    EXPECT_EQ(read.camera.cy, 240);
    EXPECT_EQ(read.camera.distortion[4], 0.003);
}

TEST(Camera, is_read_from_what_ros_writes) {
    const auto ros = read_camera(
        "image_width: 640\nimage_height: 480\ncamera_name: narrow\ncamera_matrix:\n  rows: 3\n  "
        "cols: 3\n"
        "  data: [600, 0, 320, 0, 601, 240, 0, 0, 1]\ndistortion_model: "
        "plumb_bob\ndistortion_coefficients:\n  rows: 1\n"
        "  cols: 5\n  data: [0.1, 0.02, 0, 0, 0.003]\n");
    ASSERT_TRUE(ros.problems.empty()) << ros.problems[0].sentence;
    EXPECT_EQ(ros.camera.fy, 601);
    EXPECT_EQ(ros.camera.distortion[4], 0.003);
}

TEST(Camera, that_cannot_be_read_says_where_and_why) {
    const std::string own = "size 640\nfocal x\nzoom 3\n";
    EXPECT_EQ(
        said(read_camera(own), own),
        "size 640|size has 1 number, expected 2\nx|'x' is not a number\nzoom|unknown key 'zoom'\n");
    const std::string millimetres = "size 640 480\nfocal 4.5\n";
    EXPECT_EQ(said(read_camera(millimetres), millimetres),
              "focal 4.5|implausible focal lengths for an image 640 px wide\n");
    const std::string empty;
    EXPECT_EQ(said(read_camera(empty), empty), "|missing size\n|missing focal\n");
    const auto own_refusal = [](const std::string& lines) {
        return read_camera("size 640 480\n" + lines).problems.at(0).sentence;
    };
    EXPECT_EQ(own_refusal("focal 0\n"), "focal length is not positive");
    EXPECT_EQ(own_refusal("focal 600\ncentre 5000 200\n"), "the centre is far outside the image");
    const auto bent = [&](const std::string& distortion) {
        const auto read = read_camera("size 640 480\nfocal 600\ndistortion " + distortion + "\n");
        return read.problems.empty() ? ""
                                     : read.problems[0].sentence.substr(
                                           0, read.problems[0].sentence.find(" it folds"));
    };
    EXPECT_EQ(own_refusal("focal 600\ndistortion 4000\n"),
              "invalid distortion: beyond 14 px from the centre it folds the image over itself or "
              "scales it up more than four times");
    EXPECT_EQ(bent("30 -900"), "invalid distortion: beyond 114 px from the centre");
    EXPECT_EQ(bent("-0.9"), "invalid distortion: beyond 243 px from the centre");
    EXPECT_EQ(bent("0 0 0.4"), "invalid distortion: beyond 250 px from the centre");
    for (const char* real : {"-0.35 0.15 0.001 -0.002", "0.12 -0.25 0 0 0.1", "-0.4 0.2", "0.3"}) {
        EXPECT_EQ(bent(real), "") << real;
    }
    EXPECT_EQ(own_refusal("focal 600\nfocal 600\n"), "duplicate key 'focal'");
    const auto opencv_refusal = [](const std::string& matrix, const std::string& distortion = "") {
        return read_camera("%YAML:1.0\nimage_width: 640\nimage_height: 480\n" + matrix + distortion)
            .problems.at(0)
            .sentence;
    };
    const std::string good =
        "camera_matrix: !!opencv-matrix\n   data: [ 600, 0, 320, 0, 600, 240, 0, 0, 1 ]\n";
    EXPECT_EQ(opencv_refusal(""), "missing camera_matrix");
    EXPECT_EQ(opencv_refusal("camera_matrix: !!opencv-matrix\n   rows: 3\n"),
              "camera_matrix has no data");
    EXPECT_EQ(opencv_refusal(
                  "camera_matrix: !!opencv-matrix\n   data: [ 600, 0, x, 0, 600, 240, 0, 0, 1 ]\n"),
              "'x' is not a number");
    EXPECT_TRUE(opencv_refusal("camera_matrix: [ 1, 2\n").starts_with("invalid YAML: "));
    EXPECT_EQ(
        opencv_refusal(
            "camera_matrix: !!opencv-matrix\n   data: [ 600, 0, 320, 7, 600, 240, 0, 0, 1 ]\n"),
        "invalid camera_matrix");
    EXPECT_EQ(opencv_refusal(good,
                             "distortion_coefficients: !!opencv-matrix\n   data: [ 0, 0, 0, 0, 0, "
                             "0.1, 0.1, 0.1 ]\n"),
              "the distortion has 8 coefficients");
    EXPECT_EQ(read_camera("%YAML:1.0\n" + good).problems.at(0).sentence,
              "missing image_width and image_height");
    const std::string yaml =
        "image_width: 640\nimage_height: -1\ncamera_matrix: !!opencv-matrix\n data: [ 1, 2 ]\n";
    EXPECT_EQ(said(read_camera(yaml), yaml),
              "-1|'-1' is not a valid image width or height\ncamera_matrix|camera_matrix has 2 "
              "numbers, not 9\n");
}

Ground ground(const std::string& text, const std::optional<Camera>& camera = {}) {
    GroundText read = read_ground(text);
    Ground made(read, camera);
    EXPECT_TRUE(read.problems.empty()) << read.problems[0].sentence;
    return made;
}

TEST(Ground, gives_the_place_that_is_seen_at_a_pixel) {
    // a camera 1000 mm above the floor that looks down by 45 degrees, 500 px: u = 500 x / d, v =
    // 500 (h' / d) ...
    const auto pixel = [](double x, double y) {
        const double c = std::sqrt(0.5);
        const double ahead = c * y + c * 1000;
        const double down = -c * y + c * 1000;
        return std::to_string(320 + 500 * x / ahead) + " " +
               std::to_string(240 + 500 * down / ahead);
    };
    std::string text;
    for (const auto& [x, y] :
         {std::pair{-500., 500.}, {500., 500.}, {500., 2000.}, {-500., 2000.}}) {
        text += pixel(x, y) + " " + std::to_string(x) + " " + std::to_string(y) + "\n";
    }
    const Ground made = ground(text);
    EXPECT_LT(made.error(), 1e-3);
    double x = 0;
    double y = 0;
    ASSERT_TRUE(made.map(320, 240, x, y));
    EXPECT_NEAR(x, 0, 0.01);
    EXPECT_NEAR(y, 1000, 0.01);
    EXPECT_FALSE(made.map(320, 240 - 500, x, y)) << "the horizon";
    EXPECT_FALSE(made.map(320, -1000, x, y)) << "the sky";
    EXPECT_FALSE(made.map(NAN, 240, x, y));
    EXPECT_NEAR(y, 1000, 0.01);
}

TEST(Ground, is_straight_behind_a_lens_that_distorts) {
    Camera camera;
    camera.width = 640;
    camera.height = 480;
    camera.fx = camera.fy = 500;
    camera.cx = 320;

    camera.cy = 240;
    camera.distortion = {-0.2, 0.03, 0.001, -0.002, 0};
    const auto pixel = [&](double x, double y) {  // seen straight down from 500 mm: x' = x / 500
        const double a = x / 500;
        const double b = y / 500;
        const double r2 = a * a + b * b;

        const double radial = 1 - 0.2 * r2 + 0.03 * r2 * r2;
        const double u = a * radial + 2 * 0.001 * a * b - 0.002 * (r2 + 2 * a * a);

        const double v = b * radial + 0.001 * (r2 + 2 * b * b) + 2 * -0.002 * a * b;
        return std::pair{320 + 500 * u, 240 + 500 * v};
    };
    std::string text;
    for (const auto& [x, y] :
         {std::pair{-200., -150.}, {200., -150.}, {200., 150.}, {-200., 150.}}) {
        const auto [u, v] = pixel(x, y);
        text += std::to_string(u) + "," + std::to_string(v) + ":" + std::to_string(x) + "," +
                std::to_string(y) + ";";
    }
    const Ground made = ground(text, camera);
    for (const auto& [x, y] : {std::pair{0., 0.}, {100., -120.}, {-190., 10.}}) {
        double gx = 0;
        double gy = 0;
        const auto [u, v] = pixel(x, y);
        ASSERT_TRUE(made.map(u, v, gx, gy));
        EXPECT_NEAR(gx, x, 0.01);
        EXPECT_NEAR(gy, y, 0.01);
    }
}

TEST(Ground, that_four_points_do_not_give_says_why) {
    const auto refusal = [](const char* text) {
        GroundText read = read_ground(text);
        Ground made(read, std::nullopt);
        return read.problems.empty() ? "" : read.problems[0].sentence;
    };
    EXPECT_EQ(refusal("0 0 0 0; 1 0 1 0; 2 0 2 0; 0 1 0 1"),
              "the pixels of these points are collinear or coincide");
    EXPECT_EQ(refusal("0 0 0 0; 1 0 1 0; 1 1 1 0; 0 1 0 1"),
              "these points are collinear or coincide");
    EXPECT_EQ(refusal("0 0 0 0; 1 0 1 0; 1 1 1 1"), "3 points, but a plane needs four");
    EXPECT_EQ(refusal("0 0 0"), "this point has 3 numbers, not 4");
    EXPECT_EQ(refusal("0 0 0 0 0"), "this point has more than 4 numbers");
    EXPECT_EQ(refusal("0 0 0 nan"), "'nan' is not a number");
    EXPECT_EQ(refusal("0 0 0 0; 100 0 1 0; 100 100 0 1; 0 100 1 1"),
              "some of these points are above the horizon");
}

}  // namespace
}  // namespace hal::vision
