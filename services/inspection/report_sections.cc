#include "services/inspection/report_sections.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "services/inspection/report_words.h"

namespace sixpoint::inspection {
namespace {

using report::OutlinePiece;
using report::OutlinePoint;

constexpr std::size_t kMostDrawnPoints = 6000;  // of one outline: more would not be seen on paper

std::vector<OutlinePoint> PointsOf(const google::protobuf::RepeatedField<double>& xy_mm) {
  std::vector<OutlinePoint> points(static_cast<std::size_t>(xy_mm.size() / 2));
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].x_mm = xy_mm.Get(static_cast<int>(2 * i));
    points[i].y_mm = xy_mm.Get(static_cast<int>(2 * i + 1));
  }
  return points;
}

// Of a closed outline, counter-clockwise about the solid.
void SetNormals(std::vector<OutlinePoint>* points) {
  const std::size_t count = points->size();
  for (std::size_t i = 0; i < count; ++i) {
    const OutlinePoint &before = (*points)[(i + count - 1) % count], &after = (*points)[(i + 1) % count];
    const double x = after.x_mm - before.x_mm, y = after.y_mm - before.y_mm, length = std::hypot(x, y);
    if (!(length > 0)) continue;
    (*points)[i].normal_x = y / length;
    (*points)[i].normal_y = -x / length;
  }
}

// Each takes the normal of the nominal point nearest to it. Both run around the same way: after the first one the next is looked for near by,
// so that a thin edge's other side is not taken for this one.
void TakeNormals(const std::vector<OutlinePoint>& nominal, std::vector<OutlinePoint>* measured) {
  const std::size_t count = nominal.size(), reach = count / 16 + 8;
  std::optional<std::size_t> last;
  for (OutlinePoint& point : *measured) {
    const std::size_t first = last ? *last + count - std::min(reach, count) : 0;
    const std::size_t looked = last ? std::min(2 * reach + 1, count) : count;
    double nearest_mm = std::numeric_limits<double>::infinity();
    for (std::size_t i = first; i < first + looked; ++i) {
      const OutlinePoint& candidate = nominal[i % count];
      const double away_mm = std::hypot(candidate.x_mm - point.x_mm, candidate.y_mm - point.y_mm);
      if (!(away_mm < nearest_mm)) continue;
      nearest_mm = away_mm;
      last = i % count;
    }
    point.normal_x = nominal[last.value_or(0)].normal_x;
    point.normal_y = nominal[last.value_or(0)].normal_y;
  }
}

// Every so many of them, and the last.
OutlinePiece Thinned(const std::vector<OutlinePoint>& points, std::size_t step, bool closed) {
  OutlinePiece piece;
  piece.closed = closed;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (i % step == 0 || i + 1 == points.size()) piece.points.push_back(points[i]);
  return piece;
}

std::size_t StepOf(std::size_t count) { return (count + kMostDrawnPoints - 1) / kMostDrawnPoints; }

// Between gaps. What of it is a single point cannot be drawn as a line.
std::vector<OutlinePiece> PiecesOf(const std::vector<OutlinePoint>& points,
                                   const google::protobuf::RepeatedField<std::int32_t>& gaps_before) {
  const std::size_t count = points.size();
  std::vector<OutlinePiece> pieces;
  if (count < 2) return pieces;
  if (gaps_before.empty()) {
    pieces.push_back(Thinned(points, StepOf(count), true));
    return pieces;
  }
  for (int g = 0; g < gaps_before.size(); ++g) {
    const auto first = static_cast<std::size_t>(gaps_before.Get(g));
    auto end = static_cast<std::size_t>(gaps_before.Get((g + 1) % gaps_before.size()));
    if (end <= first) end += count;  // around the start
    std::vector<OutlinePoint> piece;
    for (std::size_t i = first; i < end; ++i) piece.push_back(points[i % count]);
    if (piece.size() > 1) pieces.push_back(Thinned(piece, StepOf(count), false));
  }
  return pieces;
}

std::optional<double> MeasuredOf(const v1::Section& section, v1::SectionParameter parameter) {
  for (const v1::SectionValue& value : section.values())
    if (value.parameter() == parameter && value.has_value()) return value.value();
  return std::nullopt;
}

void AddConstruction(const v1::Section& section, report::SectionOutlines* outlines) {
  const auto of = [&](v1::SectionParameter parameter) { return MeasuredOf(section, parameter); };
  const auto leading_x = of(v1::SECTION_PARAMETER_LEADING_X), leading_y = of(v1::SECTION_PARAMETER_LEADING_Y),
             trailing_x = of(v1::SECTION_PARAMETER_TRAILING_X), trailing_y = of(v1::SECTION_PARAMETER_TRAILING_Y);
  if (leading_x && leading_y && trailing_x && trailing_y)
    outlines->chord_mm = {{{*leading_x, *leading_y}, {*trailing_x, *trailing_y}}};
  const auto x = of(v1::SECTION_PARAMETER_INSCRIBED_X), y = of(v1::SECTION_PARAMETER_INSCRIBED_Y),
             diameter = of(v1::SECTION_PARAMETER_THICKNESS_INSCRIBED);
  if (x && y && diameter) outlines->greatest_circle = report::PlaneCircle{*x, *y, *diameter / 2};
}

report::Characteristic ParameterOf(const v1::SectionValue& value) {
  report::Characteristic parameter;
  parameter.id = WordsOf(v1::SectionParameter_Name(value.parameter()), "SECTION_PARAMETER_");
  parameter.unit = UnitOf(value.unit());
  parameter.judged = false;
  if (value.has_nominal()) parameter.nominal = value.nominal();
  if (value.has_value()) parameter.value = value.value();
  if (value.has_value() && value.has_expanded_uncertainty())
    parameter.expanded_uncertainty = value.expanded_uncertainty();
  parameter.reason = value.reason();
  return parameter;
}

}  // namespace

report::Section SectionOf(const v1::Section& section, const v1::SectionOutline& outline) {
  report::Section out;
  out.name = section.plane().section();
  out.height_mm = section.plane().origin_in_part_mm().z_mm();
  for (const v1::SectionValue& value : section.values()) {
    out.parameters.push_back(ParameterOf(value));
    if (!section.reason().empty()) out.parameters.back().reason = section.reason();
  }
  std::vector<OutlinePoint> nominal = PointsOf(outline.nominal_mm());
  if (nominal.size() < 2) return out;
  SetNormals(&nominal);
  std::vector<OutlinePoint> measured = PointsOf(outline.measured_mm());
  TakeNormals(nominal, &measured);
  for (std::size_t i = 0; i < measured.size() && static_cast<int>(i) < outline.deviations_um_size(); ++i)
    measured[i].deviation_mm = outline.deviations_um(static_cast<int>(i)) / 1e3;
  out.outlines.nominal = {Thinned(nominal, StepOf(nominal.size()), true)};
  out.outlines.measured = PiecesOf(measured, outline.gaps_before());
  AddConstruction(section, &out.outlines);
  return out;
}

}  // namespace sixpoint::inspection
