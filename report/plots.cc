#include "report/plots.h"

#include <algorithm>
#include <cmath>

#include "report/number_text.h"

namespace sixpoint::report {
namespace {

constexpr double kGap_mm = 5, kLegend_mm = 10, kName_mm = 4.5;

void DrawStrip(const DeviationPicture& picture, Place corner, double width_mm, Drawing* drawing) {
  constexpr int kSteps = 96;
  constexpr double kReach = 1.125, kHeight_mm = 3;
  const double step_mm = width_mm / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const double um = ((2 * (i + 0.5)) / kSteps - 1) * kReach * picture.scale_um;
    // A little wider than it is, so that no paper shines between neighbours.
    drawing->Box({corner.x_mm + i * step_mm, corner.y_mm}, step_mm * (i + 1 < kSteps ? 1.15 : 1), kHeight_mm,
                 std::nullopt, DeviationColour(um, picture.scale_um, picture.band_um));
  }
  drawing->Box(corner, width_mm, kHeight_mm, Pen{kQuietInk, 0.12}, std::nullopt);
  const auto tick = [&](double um) {
    const double x = corner.x_mm + width_mm * (0.5 + um / (2 * kReach * picture.scale_um));
    drawing->Line({x, corner.y_mm + kHeight_mm}, {x, corner.y_mm + kHeight_mm + 0.9}, Pen{kQuietInk, 0.15});
    drawing->Text({x, corner.y_mm + kHeight_mm + 3.4}, Signed(um, um == std::round(um) ? 0 : 1), 2.3, kInk,
                  Anchor::kMiddle);
  };
  for (const double part : {-1.0, -0.5, 0.0, 0.5, 1.0}) tick(part * picture.scale_um);
}

void DrawNotSeen(Place corner, Drawing* drawing) {
  constexpr double kSide_mm = 3;
  drawing->Box(corner, 2 * kSide_mm, kSide_mm, std::nullopt, kNotSeen);
  for (int i = 0; i < 6; ++i) {
    const double x = corner.x_mm + 0.9 * i;
    drawing->Line({x + 0.3, corner.y_mm + kSide_mm}, {x + 1.2, corner.y_mm}, Pen{kNotSeenHatch, 0.3});
  }
  drawing->Text({corner.x_mm + 2 * kSide_mm + 1.5, corner.y_mm + 2.4}, "not seen", 2.3, kInk);
}

}  // namespace

Colour ColourOf(Tone tone) {
  switch (tone) {
    case Tone::kGood:
      return kGoodInk;
    case Tone::kBad:
      return kBadInk;
    case Tone::kOpen:
      return kOpenInk;
    case Tone::kMissing:
      return kMissingInk;
    case Tone::kQuiet:
      return kQuietInk;
    case Tone::kPlain:
      break;
  }
  return kInk;
}

bool StaysOnOneLine(const std::string& text, Align align) {
  constexpr std::size_t kShort = 16, kNumbers = 36;
  return text != kNotMeasuredText && text.size() <= (align == Align::kRight ? kNumbers : kShort);
}

Tone ToneOf(Verdict verdict) {
  switch (verdict) {
    case Verdict::kConform:
      return Tone::kGood;
    case Verdict::kNotConform:
      return Tone::kBad;
    case Verdict::kUndecidable:
      return Tone::kOpen;
    case Verdict::kNotMeasured:
      break;
  }
  return Tone::kMissing;
}

Drawing PlotDeviation(const DeviationPicture& picture, double width_mm, double greatest_height_mm) {
  int across_px = 0, down_px = 1;
  for (const auto& view : picture.views) {
    across_px += view->width_px;
    down_px = std::max(down_px, view->height_px);
  }
  const double gaps_mm = kGap_mm * static_cast<double>(picture.views.size() - 1);
  const double px_mm =
      std::min((width_mm - gaps_mm) / std::max(1, across_px), (greatest_height_mm - kLegend_mm - kName_mm) / down_px);
  const double views_mm = down_px * px_mm;
  Drawing drawing{width_mm, views_mm + kLegend_mm + kName_mm, {}};
  // What is left over goes between the views.
  const double spare_mm = (width_mm - gaps_mm - across_px * px_mm) / static_cast<double>(picture.views.size());
  double x = spare_mm / 2;
  for (const auto& view : picture.views) {
    const double w = view->width_px * px_mm, h = view->height_px * px_mm;
    drawing.shapes.emplace_back(Raster{{x, views_mm - h}, w, h, view});
    drawing.Text({x + w / 2, views_mm + 3.2}, Told(view->name), 2.5, kQuietInk, Anchor::kMiddle);
    x += w + kGap_mm + spare_mm;
  }
  const double y = views_mm + kName_mm + 1.5, strip_mm = std::min(96.0, width_mm / 2), left = (width_mm - strip_mm) / 2;
  DrawStrip(picture, {left, y}, strip_mm, &drawing);
  drawing.Text({left - 2, y + 2.4}, "\u00b5m, inside", 2.3, kInk, Anchor::kEnd);
  drawing.Text({left + strip_mm + 2, y + 2.4}, "outside", 2.3, kInk);
  DrawNotSeen({left + strip_mm + 17, y}, &drawing);
  DrawScaleBar(&drawing, {0.5, y + 1.6}, 16, px_mm / picture.mm_per_px);
  return drawing;
}

std::optional<double> ShareOfTolerance(const Characteristic& c) {
  if (!c.value) return std::nullopt;
  if (c.lower && c.upper && *c.upper > *c.lower)
    return std::abs(*c.value - (*c.lower + *c.upper) / 2) / ((*c.upper - *c.lower) / 2);
  if (c.upper && !c.lower && *c.upper > 0) return *c.value / *c.upper;
  return std::nullopt;
}

std::optional<Drawing> PlotWithinLimits(const Characteristic& c, double width_mm, double height_mm) {
  if (!ShareOfTolerance(c)) return std::nullopt;
  constexpr double kReach = 1.25;  // of the tolerance: what is beyond ends in an arrow
  const double middle_mm = height_mm / 2;
  const bool both = c.lower.has_value();
  const double zero = both ? (*c.lower + *c.upper) / 2 : 0, half = *c.upper - zero;
  const auto x_of = [&](double value) {
    const double share = (value - zero) / half, least = both ? -kReach : -0.05;
    return 1 + (width_mm - 2) * (std::clamp(share, least, kReach) - least) / (kReach - least);
  };
  Drawing drawing{width_mm, height_mm, {}};
  const double left = x_of(both ? *c.lower : 0), right = x_of(*c.upper);
  drawing.Line({0, middle_mm}, {width_mm, middle_mm}, Pen{kRule, 0.15});
  drawing.Box({left, middle_mm - 0.75}, right - left, 1.5, std::nullopt, Colour{226, 239, 230});
  for (const double x : {left, right})
    drawing.Line({x, middle_mm - 1.1}, {x, middle_mm + 1.1}, Pen{kQuietInk, x == left && !both ? 0.12 : 0.25});
  const Colour colour = ColourOf(ToneOf(c.verdict));
  const double at = x_of(*c.value);
  if (c.expanded_uncertainty) {
    const double from = x_of(*c.value - *c.expanded_uncertainty), to = x_of(*c.value + *c.expanded_uncertainty);
    drawing.Line({from, middle_mm}, {to, middle_mm}, Pen{colour, 0.3});
    for (const double x : {from, to}) drawing.Line({x, middle_mm - 0.6}, {x, middle_mm + 0.6}, Pen{colour, 0.2});
  }
  const double part = (*c.value - zero) / half;
  if (std::abs(part) > kReach) {
    const double outward = part > 0 ? 1 : -1;
    drawing.Arrow({at - 1.6 * outward, middle_mm}, {at + 0.9 * outward, middle_mm}, Pen{colour, 0.4}, 2);
  } else {
    drawing.shapes.emplace_back(Disc{{at, middle_mm}, 0.75, std::nullopt, colour});
  }
  return drawing;
}

}  // namespace sixpoint::report
