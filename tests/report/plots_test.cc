#include "report/plots.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/report/sample_report.h"

namespace sixpoint::report {
namespace {

// A ring of 10 mm, measured with one deviation, half of it not seen.
SectionOutlines Ring(double deviation_mm) {
  SectionOutlines outlines;
  OutlinePiece nominal, measured;
  nominal.closed = true;
  for (int i = 0; i < 360; ++i) {
    const double c = std::cos(i * M_PI / 180), s = std::sin(i * M_PI / 180);
    nominal.points.push_back({10 * c, 10 * s, c, s, 0});
    const double r = 10 + deviation_mm;
    if (i < 180) measured.points.push_back({r * c, r * s, c, s, deviation_mm});
  }
  outlines.nominal = {nominal};
  outlines.measured = {measured};
  return outlines;
}

std::vector<const Path*> Lines(const Drawing& drawing, double width_mm) {
  std::vector<const Path*> lines;
  for (const Shape& shape : drawing.shapes)
    if (const Path* path = std::get_if<Path>(&shape))
      if (path->pen && path->pen->width_mm == width_mm && path->places.size() > 100) lines.push_back(path);
  return lines;
}

double Width(const Path& path) {
  double least = 1e9, greatest = -1e9;
  for (const Place& p : path.places) least = std::min(least, p.x_mm), greatest = std::max(greatest, p.x_mm);
  return greatest - least;
}

TEST(SectionPlot, MagnifiesDeviationsAndLeavesGapsOpen) {
  const SectionPlot plot = PlotSection(Ring(0.02), {86, 58}, 50);
  const auto nominal = Lines(plot.drawing, 0.18), measured = Lines(plot.drawing, 0.22);
  ASSERT_EQ(nominal.size(), 1u);
  ASSERT_EQ(measured.size(), 1u);
  EXPECT_TRUE(nominal[0]->closed);
  EXPECT_FALSE(measured[0]->closed);
  EXPECT_EQ(measured[0]->places.size(), 180u);
  // 20 um times 50 are 1 mm of 10.
  EXPECT_NEAR(Width(*measured[0]) / Width(*nominal[0]), 1.1, 2e-3);
}

TEST(SectionPlot, StatesARoundMagnificationThatFitsThePaper) {
  for (const double deviation_mm : {1e-6, 0.0004, 0.02, 0.3, 4.0}) {
    const SectionPlot plot = PlotSection(Ring(deviation_mm), {86, 58});
    EXPECT_GE(plot.magnification, 1);
    if (plot.magnification == 1) continue;
    for (const Shape& shape : plot.drawing.shapes)
      if (const Path* path = std::get_if<Path>(&shape))
        for (const Place& p : path->places) {
          EXPECT_GE(p.x_mm, 0);
          EXPECT_LE(p.x_mm, 86);
          EXPECT_GE(p.y_mm, 0);
          EXPECT_LE(p.y_mm, 58);
        }
  }
}

TEST(SectionPlot, DrawsThickWhatIsBeyondTheTolerance) {
  SectionOutlines outlines = Ring(0.02);
  outlines.lower_mm = -0.01, outlines.upper_mm = 0.01;
  EXPECT_EQ(Lines(PlotSection(outlines, {}).drawing, 0.6).size(), 1u);
  outlines.upper_mm = 0.03;
  EXPECT_TRUE(Lines(PlotSection(outlines, {}).drawing, 0.6).empty());
}

TEST(HolePlot, ArrowsAreAsLongAsStated) {
  std::vector<Hole> holes(2);
  holes[0].id = "A", holes[1].id = "B";
  holes[1].nominal_mm = {40, 0, 20};
  holes[0].displacement_mm = {0.1, 0, 0};
  holes[0].verdict = Verdict::kConform;
  const HolePlot plot = PlotHoles(holes, {86, 58}, 30);
  EXPECT_EQ(plot.axes, "x to the right, z up");
  // From the disc of the nominal place to the tip: 0.1 mm * 30 in the scale in which 40 mm lie between the holes.
  std::vector<Place> places;
  double tip_x = 0;
  for (const Shape& shape : plot.drawing.shapes) {
    if (const Disc* disc = std::get_if<Disc>(&shape)) places.push_back(disc->centre);
    if (const Path* path = std::get_if<Path>(&shape))
      if (path->closed && path->places.size() == 3 && tip_x == 0) tip_x = path->places[0].x_mm;
  }
  ASSERT_EQ(places.size(), 2u);
  const double scale = (places[1].x_mm - places[0].x_mm) / 40;
  EXPECT_NEAR(tip_x - places[0].x_mm, 0.1 * 30 * scale, 1e-9);
}

TEST(HolePlot, CrossesOutWhatWasNotMeasuredAndNamesFewOfMany) {
  std::vector<Hole> holes(1000);
  for (std::size_t i = 0; i < holes.size(); ++i)
    holes[i].nominal_mm = {static_cast<double>(i % 40), 0, static_cast<double>(i / 40)};
  const HolePlot plot = PlotHoles(holes, {});
  EXPECT_FALSE(plot.labelled);
  EXPECT_TRUE(PlotHoles({}, {}).drawing.shapes.empty());
  std::size_t lines = 0;
  for (const Shape& shape : plot.drawing.shapes)
    if (const Path* path = std::get_if<Path>(&shape)) lines += path->places.size() == 2;
  EXPECT_GE(lines, 2000u);
}

TEST(Share, IsOneAtALimit) {
  Characteristic c;
  EXPECT_FALSE(ShareOfTolerance(c));
  c.value = 0.1, c.upper = 0.1;
  EXPECT_NEAR(*ShareOfTolerance(c), 1, 1e-12);
  c.lower = -0.3;
  EXPECT_NEAR(*ShareOfTolerance(c), 1, 1e-12);
  c.value = -0.1;
  EXPECT_NEAR(*ShareOfTolerance(c), 0, 1e-12);
  EXPECT_TRUE(PlotWithinLimits(c, 30, 3));
  c.value.reset();
  EXPECT_FALSE(PlotWithinLimits(c, 30, 3));
}

}  // namespace
}  // namespace sixpoint::report
