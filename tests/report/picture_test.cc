#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <regex>

#include "report/colour_scale.h"
#include "report/deviation_picture.h"
#include "tests/report/sample_report.h"

namespace sixpoint::report {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

// A square plate of 10 mm across y, at y_mm: what is seen from the front.
void AddPlate(float y_mm, float deviation_um, DeviationSurface* surface, float side_mm = 10) {
  const auto first = static_cast<std::uint32_t>(surface->vertices_mm.size());
  const float h = side_mm / 2;
  surface->vertices_mm.insert(surface->vertices_mm.end(), {{-h, y_mm, -h}, {h, y_mm, -h}, {h, y_mm, h}, {-h, y_mm, h}});
  surface->triangles.push_back({first, first + 1, first + 2});
  surface->triangles.push_back({first, first + 2, first + 3});
  surface->deviations_um.insert(surface->deviations_um.end(), 2, deviation_um);
}

Colour At(const Picture& picture, int x, int y) {
  const std::size_t i =
      3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width_px) + static_cast<std::size_t>(x));
  return {picture.rgb[i], picture.rgb[i + 1], picture.rgb[i + 2]};
}

Colour Middle(const Picture& picture) { return At(picture, picture.width_px / 2 + 7, picture.height_px / 2); }

PictureOptions From(std::vector<Side> sides) {
  PictureOptions options;
  options.sides = std::move(sides);
  options.longest_px = 100;
  return options;
}

TEST(Picture, APlateThatFacesTheViewerHasTheScalesColourItself) {
  for (const float um : {-80.f, -50.f, -30.f, -10.f, 0.f, 9.f, 12.f, 30.f, 50.f, 51.f}) {
    DeviationSurface surface;
    AddPlate(0, um, &surface);
    const auto picture = DrawDeviation(surface, From({Side::kFront, Side::kBack}));
    ASSERT_TRUE(picture.ok()) << picture.status();
    for (const auto& view : picture->views) {
      EXPECT_EQ(Middle(*view), DeviationColour(um, 50, 10)) << um;
      EXPECT_EQ(At(*view, 0, 0), (Colour{255, 255, 255}));
    }
  }
}

TEST(Picture, NearestHidesWhatIsBehindItFromEachSide) {
  DeviationSurface surface;
  AddPlate(-1, 30, &surface);  // nearer to who looks from the front
  AddPlate(1, -30, &surface);
  const auto picture = DrawDeviation(surface, From({Side::kFront, Side::kBack})).value();
  EXPECT_EQ(Middle(*picture.views[0]), DeviationColour(30, 50, 10));
  EXPECT_EQ(Middle(*picture.views[1]), DeviationColour(-30, 50, 10));
}

TEST(Picture, WhatWasNotSeenIsDarkAndHatchedAndNeverGreyLikeZero) {
  DeviationSurface surface;
  AddPlate(0, kNaN, &surface);
  const auto picture = DrawDeviation(surface, From({Side::kFront})).value();
  int plain = 0, hatch = 0, other = 0;
  const Picture& view = *picture.views[0];
  for (int y = 10; y < view.height_px - 10; ++y)
    for (int x = 10; x < view.width_px - 10; ++x)
      ++(At(view, x, y) == kNotSeen ? plain : At(view, x, y) == kNotSeenHatch ? hatch : other);
  EXPECT_EQ(other, 0);
  EXPECT_GT(plain, 1000);
  EXPECT_GT(hatch, 1000);
}

TEST(Picture, ALargeMeshHasNoOpenSeams) {
  // Nothing of white shows within a plate of many small triangles.
  DeviationSurface surface;
  constexpr int kSteps = 150;
  for (int j = 0; j <= kSteps; ++j)
    for (int i = 0; i <= kSteps; ++i)
      surface.vertices_mm.push_back({0.0731f * i, 0.01f * std::sin(0.3f * i), 0.0689f * j});
  for (std::uint32_t j = 0; j < kSteps; ++j)
    for (std::uint32_t i = 0; i < kSteps; ++i) {
      const std::uint32_t a = j * (kSteps + 1) + i, b = a + 1, c = a + kSteps + 1, d = c + 1;
      surface.triangles.insert(surface.triangles.end(), {{a, b, d}, {a, d, c}});
    }
  surface.deviations_um.assign(surface.triangles.size(), 30);
  const auto picture = DrawDeviation(surface, From({Side::kFront})).value();
  const Picture& view = *picture.views[0];
  for (int y = 6; y < view.height_px - 6; ++y)
    for (int x = 6; x < view.width_px - 6; ++x) ASSERT_LT(At(view, x, y).b, 120) << x << " " << y;
}

TEST(Picture, PatchesGiveTheirDeviationToTheirTriangles) {
  DeviationSurface surface;
  AddPlate(0, 0, &surface);
  surface.deviations_um = {-30, 40};
  surface.deviation_of = {1, 1};
  EXPECT_EQ(Middle(*DrawDeviation(surface, From({Side::kFront}))->views[0]), DeviationColour(40, 50, 10));
}

TEST(Picture, RefusesWhatCannotBeDrawnByField) {
  const auto refusal = [](const DeviationSurface& surface, const PictureOptions& options) {
    return std::string(DrawDeviation(surface, options).status().message());
  };
  DeviationSurface good;
  AddPlate(0, 1, &good);
  EXPECT_THAT(refusal({}, {}), ::testing::HasSubstr("triangles"));
  DeviationSurface bad = good;
  bad.triangles[0][1] = 99;
  EXPECT_THAT(refusal(bad, {}), ::testing::HasSubstr("triangles[0]"));
  bad = good;
  bad.vertices_mm[2][0] = std::numeric_limits<float>::infinity();
  EXPECT_THAT(refusal(bad, {}), ::testing::HasSubstr("vertices_mm[2]"));
  bad = good;
  bad.deviations_um.pop_back();
  EXPECT_THAT(refusal(bad, {}), ::testing::HasSubstr("deviations_um"));
  bad = good;
  bad.deviation_of = {0, 7};
  EXPECT_THAT(refusal(bad, {}), ::testing::HasSubstr("deviation_of[1]"));
  PictureOptions options;
  options.longest_px = 100000;
  EXPECT_THAT(refusal(good, options), ::testing::HasSubstr("longest_px"));
  options = {};
  options.band_um = 60;
  EXPECT_THAT(refusal(good, options), ::testing::HasSubstr("band_um"));
}

TEST(Picture, AMillionTrianglesFromFourSidesInTwoSecondsAndTheSamePoints) {
  const DeviationSurface surface = VaneSurface(1000, 500);
  ASSERT_EQ(surface.triangles.size(), 1'000'000u);
  const auto begin = std::chrono::steady_clock::now();
  const std::clock_t processor = std::clock();
  const auto picture = DrawDeviation(surface, {}).value();
  RecordProperty("seconds",
                 std::to_string(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count()));
  // Of the processor: a loaded machine makes it wait.
  EXPECT_LT(static_cast<double>(std::clock() - processor) / CLOCKS_PER_SEC, 2);
  const auto again = DrawDeviation(surface, {}).value();
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(picture.views[i]->rgb, again.views[i]->rgb);
  EXPECT_EQ(ToPng(*picture.views[0]).value(), ToPng(*again.views[0]).value());
}

TEST(Picture, PngHasItsSignatureAndWrongSizesAreRefused) {
  Picture picture{"", 2, 1, {255, 0, 0, 0, 255, 0}};
  EXPECT_EQ(ToPng(picture)->substr(0, 8), "\x89PNG\r\n\x1a\n");
  picture.rgb.pop_back();
  EXPECT_THAT(std::string(ToPng(picture).status().message()), ::testing::HasSubstr("rgb"));
  EXPECT_FALSE(ToPng({"", 100000, 1, {}}).ok());
}

// The page's file is the other place of these numbers.
TEST(ColourScale, IsThePagesOwn) {
  std::ifstream file(std::string(std::getenv("SIXPOINT_SOURCE_DIR")) + "/web/src/scene/colours.ts");
  const std::string page(std::istreambuf_iterator<char>(file), {});
  const auto has = [&](const std::string& name, const std::vector<Colour>& colours) {
    std::string numbers;
    for (const Colour& c : colours)
      numbers += "\\[" + std::to_string(c.r) + ", " + std::to_string(c.g) + ", " + std::to_string(c.b) + "\\](, )?";
    EXPECT_TRUE(std::regex_search(page, std::regex(name + "[^=]*= \\[?" + numbers))) << name;
  };
  has("kGrey", {DeviationColour(0, 50, 10)});
  has("kBelow", {DeviationColour(-60, 50, 10)});
  has("kAbove", {DeviationColour(60, 50, 10)});
  has("kBlue", {DeviationColour(-10.0000001, 50, 10), DeviationColour(-30, 50, 10), DeviationColour(-50, 50, 10)});
  has("kRed", {DeviationColour(10.0000001, 50, 10), DeviationColour(30, 50, 10), DeviationColour(50, 50, 10)});
}

TEST(ColourScale, RoundsUpToOneTwoFive) {
  EXPECT_NEAR(RoundScale(0), 0.1, 1e-12);
  EXPECT_EQ(RoundScale(42), 50);
  EXPECT_EQ(RoundScale(50), 50);
  EXPECT_EQ(RoundScale(101), 200);
}

}  // namespace
}  // namespace sixpoint::report
