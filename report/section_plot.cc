#include <algorithm>
#include <cmath>

#include "report/number_text.h"
#include "report/plots.h"

namespace sixpoint::report {
namespace {

constexpr double kSectionMargin_mm = 4, kSectionFoot_mm = 6;
constexpr int kColourSteps = 24;  // of the scale: neighbours in one step are one shape

// Paper from section frame: x to the right, y up.
struct SectionFrame {
  double scale = 1, left_mm = 0, top_mm = 0, x0_mm = 0, y1_mm = 0;
  Place At(double x_mm, double y_mm) const {
    return {left_mm + (x_mm - x0_mm) * scale, top_mm + (y1_mm - y_mm) * scale};
  }
};

// Moved along the normal: of a measured point to its place on the nominal (-deviation), or magnified.
Place Shifted(const SectionFrame& frame, const OutlinePoint& p, double by_mm) {
  return frame.At(p.x_mm + by_mm * p.normal_x, p.y_mm + by_mm * p.normal_y);
}

SectionFrame FrameFor(const SectionOutlines& outlines, const PlotSize& size, double room_mm) {
  double x0 = 1e300, x1 = -1e300, y0 = 1e300, y1 = -1e300;
  for (const auto* pieces : {&outlines.nominal, &outlines.measured})
    for (const OutlinePiece& piece : *pieces)
      for (const OutlinePoint& p : piece.points) {
        x0 = std::min(x0, p.x_mm), x1 = std::max(x1, p.x_mm);
        y0 = std::min(y0, p.y_mm), y1 = std::max(y1, p.y_mm);
      }
  const double width = size.width_mm - 2 * (kSectionMargin_mm + room_mm);
  const double height = size.height_mm - 2 * (kSectionMargin_mm + room_mm) - kSectionFoot_mm;
  SectionFrame frame;
  frame.scale = std::min(width / std::max(1e-6, x1 - x0), height / std::max(1e-6, y1 - y0));
  frame.x0_mm = x0;
  frame.y1_mm = y1;
  frame.left_mm = (size.width_mm - frame.scale * (x1 - x0)) / 2;
  frame.top_mm = kSectionMargin_mm + room_mm + (height - frame.scale * (y1 - y0)) / 2;
  return frame;
}

double GreatestDeviation(const SectionOutlines& outlines) {
  double greatest = 0;
  for (const OutlinePiece& piece : outlines.measured)
    for (const OutlinePoint& p : piece.points) greatest = std::max(greatest, std::abs(p.deviation_mm));
  return greatest;
}

Path Outline(const SectionFrame& frame, const OutlinePiece& piece, double by_mm, const Pen& pen) {
  Path path{{}, piece.closed, pen, std::nullopt};
  path.places.reserve(piece.points.size());
  for (const OutlinePoint& p : piece.points) path.places.push_back(Shifted(frame, p, by_mm));
  return path;
}

void DrawBand(const SectionFrame& frame, const SectionOutlines& outlines, double magnification, Drawing* drawing) {
  if (!outlines.lower_mm && !outlines.upper_mm) return;
  const double lower = magnification * outlines.lower_mm.value_or(0),
               upper = magnification * outlines.upper_mm.value_or(0);
  const Pen edge{{120, 160, 134}, 0.13, 0.9};
  for (const OutlinePiece& piece : outlines.nominal) {
    const std::size_t count = piece.points.size(), last = piece.closed ? count : count - 1;
    Path band{{}, true, std::nullopt, Colour{232, 243, 235}};
    for (std::size_t i = 0; i <= last; ++i) band.places.push_back(Shifted(frame, piece.points[i % count], upper));
    for (std::size_t i = last + 1; i-- > 0;) band.places.push_back(Shifted(frame, piece.points[i % count], lower));
    drawing->shapes.emplace_back(std::move(band));
    for (const double limit : {lower, upper})
      if (limit != 0) drawing->shapes.emplace_back(Outline(frame, piece, limit, edge));
  }
}

// Between nominal and measured, in the colour of the deviation.
void DrawDeviations(const SectionFrame& frame, const SectionOutlines& outlines, double scale_um, double magnification,
                    Drawing* drawing) {
  const auto step_of = [&](const OutlinePoint& p, const OutlinePoint& q) {
    return std::lround(500 * (p.deviation_mm + q.deviation_mm) * kColourSteps / scale_um);
  };
  for (const OutlinePiece& piece : outlines.measured) {
    const std::size_t count = piece.points.size(), sides = piece.closed ? count : count - 1;
    for (std::size_t i = 0; i < sides;) {
      const auto point = [&](std::size_t k) -> const OutlinePoint& { return piece.points[k % count]; };
      const long step = step_of(point(i), point(i + 1));
      std::size_t end = i + 1;
      while (end < sides && step_of(point(end), point(end + 1)) == step) ++end;
      Path area{{},
                true,
                std::nullopt,
                DeviationColour(static_cast<double>(step) * scale_um / kColourSteps, scale_um, scale_um / 5)};
      for (std::size_t k = i; k <= end; ++k)
        area.places.push_back(Shifted(frame, point(k), (magnification - 1) * point(k).deviation_mm));
      for (std::size_t k = end + 1; k-- > i;) area.places.push_back(Shifted(frame, point(k), -point(k).deviation_mm));
      drawing->shapes.emplace_back(std::move(area));
      i = end;
    }
  }
}

void DrawMeasured(const SectionFrame& frame, const SectionOutlines& outlines, double magnification, Drawing* drawing) {
  const auto out = [&](const OutlinePoint& p) {
    return (outlines.lower_mm && p.deviation_mm < *outlines.lower_mm) ||
           (outlines.upper_mm && p.deviation_mm > *outlines.upper_mm);
  };
  for (const OutlinePiece& piece : outlines.measured) {
    Path line{{}, piece.closed, Pen{{36, 62, 92}, 0.22}, std::nullopt},
        beyond{{}, false, Pen{kBadInk, 0.6}, std::nullopt};
    const auto end_beyond = [&] {
      if (beyond.places.size() > 1) drawing->shapes.emplace_back(beyond);
      beyond.places.clear();
    };
    for (const OutlinePoint& p : piece.points) {
      line.places.push_back(Shifted(frame, p, (magnification - 1) * p.deviation_mm));
      if (out(p))
        beyond.places.push_back(line.places.back());
      else
        end_beyond();
    }
    drawing->shapes.emplace_back(std::move(line));
    end_beyond();
  }
}

void DrawConstruction(const SectionFrame& frame, const SectionOutlines& outlines, Drawing* drawing) {
  const Pen thin{kQuietInk, 0.15};
  for (const auto& circle : {outlines.greatest_circle, outlines.leading_circle, outlines.trailing_circle}) {
    if (!circle) continue;
    const Place centre = frame.At(circle->x_mm, circle->y_mm);
    drawing->shapes.emplace_back(Disc{centre, circle->radius_mm * frame.scale, thin, std::nullopt});
    if (circle->radius_mm * frame.scale < 2) continue;
    drawing->Line({centre.x_mm - 0.8, centre.y_mm}, {centre.x_mm + 0.8, centre.y_mm}, thin);
    drawing->Line({centre.x_mm, centre.y_mm - 0.8}, {centre.x_mm, centre.y_mm + 0.8}, thin);
  }
  if (!outlines.chord_mm) return;
  const auto& [leading, trailing] = *outlines.chord_mm;
  drawing->Line(frame.At(leading[0], leading[1]), frame.At(trailing[0], trailing[1]), Pen{kQuietInk, 0.15, 1.2});
}

void DrawKey(const PlotSize& size, bool banded, Drawing* drawing) {
  double x = kSectionMargin_mm + 30;
  const double y = size.height_mm - 2.2;
  const auto item = [&](const Pen& pen, const std::string& text, double room_mm) {
    drawing->Line({x, y - 0.8}, {x + 4, y - 0.8}, pen);
    drawing->Text({x + 5, y}, text, 2.3, kQuietInk);
    x += room_mm;
  };
  item({kInk, 0.18}, "nominal", 17);
  item({{36, 62, 92}, 0.3}, "measured", 19);
  if (banded) item({{120, 160, 134}, 0.2, 0.9}, "tolerance", 18);
}

}  // namespace

SectionPlot PlotSection(const SectionOutlines& outlines, const PlotSize& size, double magnification) {
  const double deviation_mm = GreatestDeviation(outlines);
  const double tolerance_mm =
      std::max(std::abs(outlines.lower_mm.value_or(0)), std::abs(outlines.upper_mm.value_or(0)));
  const double shown_mm = std::max({deviation_mm, tolerance_mm, 1e-6});
  const double room_mm = std::min(size.width_mm, size.height_mm) / 15;
  if (!(magnification > 0))
    magnification = RoundMagnification(room_mm / (shown_mm * FrameFor(outlines, size, room_mm).scale));
  magnification = std::max(1.0, magnification);
  const double scale_um = RoundScale(1000 * (tolerance_mm > 0 ? tolerance_mm : deviation_mm));
  SectionFrame frame = FrameFor(outlines, size, room_mm);
  SectionPlot plot{{size.width_mm, size.height_mm, {}}, magnification};
  DrawBand(frame, outlines, magnification, &plot.drawing);
  DrawDeviations(frame, outlines, scale_um, magnification, &plot.drawing);
  DrawConstruction(frame, outlines, &plot.drawing);
  for (const OutlinePiece& piece : outlines.nominal)
    plot.drawing.shapes.emplace_back(Outline(frame, piece, 0, Pen{kInk, 0.18}));
  DrawMeasured(frame, outlines, magnification, &plot.drawing);
  DrawScaleBar(&plot.drawing, {kSectionMargin_mm, size.height_mm - 3}, 16, frame.scale);
  DrawKey(size, tolerance_mm > 0, &plot.drawing);
  return plot;
}

Figure SectionFigure(const Section& section, const PlotSize& size) {
  SectionPlot plot = PlotSection(section.outlines, size);
  const std::string name = ToldOr(section.name, "Section"), times = Shortest(plot.magnification);
  const double greatest_um = 1000 * GreatestDeviation(section.outlines);
  std::string seen = section.outlines.measured.empty() ? std::string(kNotMeasuredText)
                                                       : "greatest deviation " + Fixed(greatest_um, 1) + " \u00b5m";
  if (section.outlines.measured.size() > 1) seen += ", gaps not seen";
  Figure figure{std::move(plot.drawing), "", ""};
  figure.caption = name + " at " + Fixed(section.height_mm, 3) + " mm" +
                   (section.outlines.measured.empty() ? "" : ", deviations \u00d7 " + times) + "; " + seen;
  figure.alt = "Outline of " + figure.caption + ".";
  return figure;
}

}  // namespace sixpoint::report
