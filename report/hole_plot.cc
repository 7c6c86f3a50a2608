#include <algorithm>
#include <cmath>

#include "report/number_text.h"
#include "report/plots.h"

namespace sixpoint::report {
namespace {

constexpr double kHoleMargin_mm = 9, kHoleFoot_mm = 8;
constexpr std::size_t kMostNames = 40;

// Which of the part's axes go to the right and up.
struct Axes {
  std::size_t right = 0, up = 2;
};

Axes AxesOf(const std::vector<Hole>& holes) {
  std::array<double, 3> extent{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto [least, greatest] = std::minmax_element(
        holes.begin(), holes.end(), [i](const Hole& a, const Hole& b) { return a.nominal_mm[i] < b.nominal_mm[i]; });
    extent[i] = greatest->nominal_mm[i] - least->nominal_mm[i];
  }
  const std::size_t least = static_cast<std::size_t>(std::min_element(extent.begin(), extent.end()) - extent.begin());
  const Axes axes = least == 0 ? Axes{1, 2} : least == 1 ? Axes{0, 2} : Axes{0, 1};
  // A plot is wider than it is high: so the longer axis lies along it.
  return extent[axes.up] > extent[axes.right] ? Axes{axes.up, axes.right} : axes;
}

struct HoleFrame {
  Axes axes;
  double scale = 1, left_mm = 0, top_mm = 0, x0_mm = 0, y1_mm = 0;
  Place At(const std::array<double, 3>& p) const {
    return {left_mm + (p[axes.right] - x0_mm) * scale, top_mm + (y1_mm - p[axes.up]) * scale};
  }
};

HoleFrame FrameFor(const std::vector<Hole>& holes, const PlotSize& size) {
  HoleFrame frame{AxesOf(holes)};
  double x0 = 1e300, x1 = -1e300, y0 = 1e300, y1 = -1e300;
  for (const Hole& hole : holes) {
    const double x = hole.nominal_mm[frame.axes.right], y = hole.nominal_mm[frame.axes.up];
    x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
  }
  const double width = size.width_mm - 2 * kHoleMargin_mm, height = size.height_mm - 2 * kHoleMargin_mm - kHoleFoot_mm;
  const double extent = std::max({x1 - x0, y1 - y0, 1e-3});
  frame.scale = std::min(width / std::max(x1 - x0, extent / 20), height / std::max(y1 - y0, extent / 20));
  frame.x0_mm = x0;
  frame.y1_mm = y1;
  frame.left_mm = (size.width_mm - frame.scale * (x1 - x0)) / 2;
  frame.top_mm = kHoleMargin_mm + (height - frame.scale * (y1 - y0)) / 2;
  return frame;
}

// The median of each hole's way to the nearest other one, on paper; of many holes of the first thousand.
double UsualSpacing(const HoleFrame& frame, const std::vector<Hole>& holes) {
  const std::size_t count = std::min<std::size_t>(holes.size(), 1000);
  std::vector<double> nearest_mm;
  for (std::size_t i = 0; i < count; ++i) {
    double least_mm = 18;
    const Place at = frame.At(holes[i].nominal_mm);
    for (std::size_t k = 0; k < count; ++k) {
      const Place other = frame.At(holes[k].nominal_mm);
      if (k != i) least_mm = std::min(least_mm, std::hypot(at.x_mm - other.x_mm, at.y_mm - other.y_mm));
    }
    nearest_mm.push_back(least_mm);
  }
  std::nth_element(nearest_mm.begin(), nearest_mm.begin() + static_cast<std::ptrdiff_t>(count / 2), nearest_mm.end());
  return nearest_mm[count / 2];
}

double LengthOf(const Hole& hole) {
  const auto& d = hole.displacement_mm;
  return d ? std::sqrt((*d)[0] * (*d)[0] + (*d)[1] * (*d)[1] + (*d)[2] * (*d)[2]) : 0;
}

void DrawHole(const HoleFrame& frame, const Hole& hole, double magnification, bool named, Drawing* drawing) {
  const Place at = frame.At(hole.nominal_mm);
  const Colour colour = ColourOf(hole.judged ? ToneOf(hole.verdict) : Tone::kPlain);
  const double paper = magnification * frame.scale;
  if (hole.position_limit_mm)
    drawing->shapes.emplace_back(
        Disc{at, *hole.position_limit_mm * paper, Pen{{120, 160, 134}, 0.13, 0.7}, Colour{240, 247, 242}});
  drawing->shapes.emplace_back(Disc{at, 0.45, std::nullopt, kInk});
  double below_mm = hole.position_limit_mm ? *hole.position_limit_mm * paper : 0;
  if (hole.displacement_mm) {
    std::array<double, 3> moved{};
    for (std::size_t i = 0; i < 3; ++i) moved[i] = hole.nominal_mm[i] + magnification * (*hole.displacement_mm)[i];
    const Place tip = frame.At(moved);
    if (hole.position_expanded_uncertainty_mm)
      drawing->shapes.emplace_back(
          Disc{tip, *hole.position_expanded_uncertainty_mm * paper, Pen{colour, 0.13}, std::nullopt});
    drawing->Arrow(at, tip, Pen{colour, hole.verdict == Verdict::kNotConform ? 0.5 : 0.28}, 1.6);
    below_mm = std::max(below_mm, tip.y_mm - at.y_mm);
  } else {
    const Pen cross{kMissingInk, 0.3};
    drawing->Line({at.x_mm - 1.1, at.y_mm - 1.1}, {at.x_mm + 1.1, at.y_mm + 1.1}, cross);
    drawing->Line({at.x_mm - 1.1, at.y_mm + 1.1}, {at.x_mm + 1.1, at.y_mm - 1.1}, cross);
    below_mm = std::max(below_mm, 1.1);
  }
  if (named)
    drawing->Text({at.x_mm, at.y_mm + below_mm + 2.8}, Told(hole.id), 2.1,
                  hole.verdict == Verdict::kConform ? kQuietInk : colour, Anchor::kMiddle,
                  hole.verdict == Verdict::kNotConform);
}

}  // namespace

HolePlot PlotHoles(const std::vector<Hole>& holes, const PlotSize& size, double magnification) {
  HolePlot plot{{size.width_mm, size.height_mm, {}}, 1, "", holes.size() <= kMostNames};
  if (holes.empty()) return plot;
  const HoleFrame frame = FrameFor(holes, size);
  double greatest_mm = 1e-6;
  for (const Hole& hole : holes)
    greatest_mm = std::max({greatest_mm, LengthOf(hole), hole.position_limit_mm.value_or(0)});
  if (!(magnification > 0)) {
    // Half of the way to the next hole, as most have it; 1 to 9 mm.
    const double own_mm = std::clamp(0.5 * UsualSpacing(frame, holes), 1.0, 9.0);
    magnification = RoundMagnification(own_mm / (greatest_mm * frame.scale));
  }
  plot.magnification = std::max(1.0, magnification);
  static constexpr const char* kNames[] = {"x", "y", "z"};
  plot.axes = std::string(kNames[frame.axes.right]) + " to the right, " + kNames[frame.axes.up] + " up";
  for (const Hole& hole : holes)
    DrawHole(frame, hole, plot.magnification, plot.labelled || hole.verdict == Verdict::kNotConform, &plot.drawing);
  DrawScaleBar(&plot.drawing, {4, size.height_mm - 3}, 16, frame.scale);
  const double length_mm = RoundLength(10 / (plot.magnification * frame.scale));
  const double drawn_mm = length_mm * plot.magnification * frame.scale, x = 34, y = size.height_mm - 3;
  plot.drawing.Arrow({x, y}, {x + drawn_mm, y}, Pen{kInk, 0.28}, 1.6);
  plot.drawing.Text({x + drawn_mm + 1.4, y + 0.8}, "off by " + Shortest(1000 * length_mm) + " \u00b5m", 2.3, kInk);
  return plot;
}

Figure HoleFigure(const std::vector<Hole>& holes, const PlotSize& size) {
  HolePlot plot = PlotHoles(holes, size);
  Figure figure{std::move(plot.drawing), "", ""};
  figure.caption =
      "Where the holes are off their nominal places, \u00d7 " + Shortest(plot.magnification) + "; " + plot.axes;
  figure.alt = figure.caption +
               ". Circles are limits about nominal places and uncertainties about arrow heads; a cross: not measured.";
  return figure;
}

}  // namespace sixpoint::report
