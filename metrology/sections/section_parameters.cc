#include "metrology/sections/section_parameters.h"

#include <cmath>
#include <limits>
#include <vector>

#include "metrology/sections/chords.h"
#include "metrology/sections/edge_circle.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;
using P = SectionParameter;

constexpr double kPeakReach = 0.04;  // of the outline's half: what a peak's parabola goes through

double AngleOf(const Vector2d& along) { return std::atan2(along.y(), along.x()); }

// From the leading to the trailing end.
Vector2d Downstream(const Camber& camber) {
  const Vector2d from = camber.leading.place ? camber.leading.tip_mm : camber.leading.last_mm;
  const Vector2d to = camber.trailing.place ? camber.trailing.tip_mm : camber.trailing.last_mm;
  return (to - from).normalized();
}

NotMeasured EndFault(const Camber& camber) {
  if (!camber.leading.place) return NotMeasured::kLeadingEndNotSeen;
  return camber.trailing.place ? NotMeasured::kMeasured : NotMeasured::kTrailingEndNotSeen;
}

void SetChord(const FoundChord& found, const Vector2d& downstream, P length, P angle, SectionValues* values) {
  if (!found.chord) {
    const NotMeasured reason =
        found.fault == ChordFault::kNoDoubleTangent ? NotMeasured::kNoDoubleTangent : NotMeasured::kContactNotSeen;
    values->Unset(length, reason);
    values->Unset(angle, reason);
    return;
  }
  values->Set(length, found.chord->length_mm);
  values->Set(angle,
              AngleOf(found.chord->along.dot(downstream) < 0 ? Vector2d(-found.chord->along) : found.chord->along));
}

// From side to side through the circle's centre, across the camber line; absent where an end or a gap stands there.
std::optional<double> AcrossAt(const Outline& outline, const InscribedCircle& circle) {
  const Vector2d across = (circle.normal - circle.other_normal).normalized();
  double ahead = std::numeric_limits<double>::infinity(), behind = ahead;
  bool gap = false;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vector2d one = outline.nodes()[i].point_mm - circle.centre_mm;
    const Vector2d next = outline.nodes()[outline.Next(i)].point_mm - circle.centre_mm;
    const double first = Cross(across, one), last = Cross(across, next);
    if ((first < 0) == (last < 0)) continue;
    double low = first / (first - last);
    if (outline.JoinAfter(i) == Join::kSmooth) {
      const auto off = [&](double part) { return Cross(across, outline.PointAt({i, part}) - circle.centre_mm); };
      for (int k = 0; k < 4; ++k) {  // Newton by the cubic's own slope
        constexpr double kStep = 1e-4;
        const double at = off(low), slope = (off(low + kStep) - off(low - kStep)) / (2 * kStep);
        if (std::abs(slope) > 1e-12) low -= at / slope;
      }
    }
    const double along = across.dot(outline.PointAt({i, low}) - circle.centre_mm);
    double* const side = along > 0 ? &ahead : &behind;
    if (std::abs(along) >= *side) continue;
    *side = std::abs(along);
    gap = gap || outline.JoinAfter(i) == Join::kGap;
  }
  if (gap || !std::isfinite(ahead + behind)) return std::nullopt;
  return ahead + behind;
}

void SetThickness(const Outline& outline, const Camber& camber, SectionValues* values) {
  const Vector2d along = Downstream(camber);
  const Vector2d from = camber.leading.place ? camber.leading.tip_mm : camber.leading.last_mm;
  const double reach_mm = kPeakReach * outline.length_mm() / 2;
  std::vector<Peak> circles, lines, xs, ys;
  for (const InscribedCircle& circle : camber.circles) {
    const double at = (circle.centre_mm - from).dot(along);
    circles.push_back({at, 2 * circle.radius_mm});
    // Only near the greatest circle can a line be the longest.
    if (circle.radius_mm < 0.97 * camber.greatest.radius_mm) continue;
    if (const auto length = AcrossAt(outline, circle)) lines.push_back({at, *length});
  }
  const Peak thick = PeakOf(circles, reach_mm);
  const EndKind kinds[] = {camber.leading.kind, camber.trailing.kind};
  const double chord_mm = kinds[0] != EndKind::kNotSeen && kinds[1] != EndKind::kNotSeen
                              ? (camber.trailing.tip_mm - camber.leading.tip_mm).norm()
                              : 0;
  const auto set_place = [&](P place, double at) {
    if (chord_mm > 0)
      values->Set(place, at / chord_mm);
    else
      values->Unset(place, EndFault(camber));
  };
  values->Set(P::kThicknessInscribed, thick.y);
  set_place(P::kThicknessInscribedPlace, thick.x);
  // The centre lies on the camber line, whose distance from the chord there is nearly a line.
  double off = 0, nearest = std::numeric_limits<double>::infinity();
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Vector2d right = Vector2d::Zero();
  for (const InscribedCircle& circle : camber.circles) {
    const double x = (circle.centre_mm - from).dot(along) - thick.x, y = Cross(along, circle.centre_mm - from);
    if (std::abs(x) < nearest) nearest = std::abs(x), off = y;
    if (std::abs(x) > reach_mm / 4) continue;
    normal += Vector2d(1, x) * Vector2d(1, x).transpose();
    right += y * Vector2d(1, x);
  }
  if (normal(0, 0) > 3 && normal.determinant() > 1e-12) off = (normal.inverse() * right)[0];
  const Vector2d centre = from + thick.x * along + off * LeftOf(along);
  values->Set(P::kInscribedX, centre.x());
  values->Set(P::kInscribedY, centre.y());
  if (lines.empty()) {
    values->Unset(P::kThicknessTwoPoint, NotMeasured::kContactNotSeen);
    values->Unset(P::kThicknessTwoPointPlace, NotMeasured::kContactNotSeen);
    return;
  }
  const Peak long_line = PeakOf(lines, reach_mm);
  values->Set(P::kThicknessTwoPoint, long_line.y);
  set_place(P::kThicknessTwoPointPlace, long_line.x);
}

void SetEdge(const Outline& outline, const SectionEnd& end, NotMeasured not_seen, P radius, P form,
             SectionValues* values) {
  NotMeasured reason = not_seen;
  if (end.kind == EndKind::kSquare) reason = NotMeasured::kEndIsSquare;
  if (end.kind == EndKind::kSharp) reason = NotMeasured::kEndIsSharp;
  if (end.kind == EndKind::kRound) reason = NotMeasured::kEndPartlySeen;
  values->Unset(radius, reason);
  values->Unset(form, reason);
  if (const auto circle = EdgeCircleOf(outline, end)) {
    values->Set(radius, circle->radius_mm);
    values->Set(form, circle->form_mm);
  }
}

void SetNoseTail(const Outline& outline, const Camber& camber, SectionValues* values) {
  if (camber.leading.place) {
    values->Set(P::kLeadingX, camber.leading.tip_mm.x());
    values->Set(P::kLeadingY, camber.leading.tip_mm.y());
  }
  if (camber.trailing.place) {
    values->Set(P::kTrailingX, camber.trailing.tip_mm.x());
    values->Set(P::kTrailingY, camber.trailing.tip_mm.y());
  }
  for (const P p : {P::kLeadingX, P::kLeadingY})
    if (!(*values)[p]) values->Unset(p, NotMeasured::kLeadingEndNotSeen);
  for (const P p : {P::kTrailingX, P::kTrailingY})
    if (!(*values)[p]) values->Unset(p, NotMeasured::kTrailingEndNotSeen);
  if (EndFault(camber) != NotMeasured::kMeasured) {
    for (const P p : {P::kChordNoseTail, P::kStaggerNoseTail, P::kCamberHeight, P::kCamberHeightPlace})
      values->Unset(p, EndFault(camber));
    return;
  }
  const Vector2d chord = camber.trailing.tip_mm - camber.leading.tip_mm;
  values->Set(P::kChordNoseTail, chord.norm());
  values->Set(P::kStaggerNoseTail, AngleOf(chord));
  std::vector<Peak> heights;
  for (const InscribedCircle& circle : camber.circles) {
    const Vector2d off = circle.centre_mm - camber.leading.tip_mm;
    heights.push_back({off.dot(chord) / chord.norm(), (camber.bow_mm > 0 ? 1 : -1) * Cross(chord, off) / chord.norm()});
  }
  const Peak height = PeakOf(heights, kPeakReach * outline.length_mm() / 2);
  values->Set(P::kCamberHeight, height.y);
  values->Set(P::kCamberHeightPlace, height.x / chord.norm());
}

}  // namespace

void SectionValues::Set(P p, double value) {
  values[static_cast<std::size_t>(p)] = value;
  reasons[static_cast<std::size_t>(p)] = NotMeasured::kMeasured;
}

void SectionValues::Unset(P p, NotMeasured reason) {
  values[static_cast<std::size_t>(p)].reset();
  reasons[static_cast<std::size_t>(p)] = reason;
}

SectionValues ValuesOf(const Outline& outline, const std::optional<Camber>& camber) {
  SectionValues values;
  values.reasons.fill(NotMeasured::kNotTwoSided);
  if (!camber) return values;
  values.leading = camber->leading.kind;
  values.trailing = camber->trailing.kind;
  const Vector2d downstream = Downstream(*camber);
  SetNoseTail(outline, *camber, &values);
  SetChord(CaliperChord(outline), downstream, P::kChordCaliper, P::kStaggerCaliper, &values);
  SetChord(TangentChord(outline, *camber), downstream, P::kChordTangent, P::kStaggerTangent, &values);
  SetThickness(outline, *camber, &values);
  SetEdge(outline, camber->leading, NotMeasured::kLeadingEndNotSeen, P::kLeadingRadius, P::kLeadingForm, &values);
  SetEdge(outline, camber->trailing, NotMeasured::kTrailingEndNotSeen, P::kTrailingRadius, P::kTrailingForm, &values);
  return values;
}

std::string NameOf(P parameter) {
  static constexpr const char* kNames[] = {"chord NOSE_TAIL",
                                           "chord CALIPER",
                                           "chord TANGENT",
                                           "stagger NOSE_TAIL",
                                           "stagger CALIPER",
                                           "stagger TANGENT",
                                           "thickness INSCRIBED_CIRCLE",
                                           "thickness INSCRIBED_CIRCLE place",
                                           "thickness TWO_POINT",
                                           "thickness TWO_POINT place",
                                           "inscribed circle x",
                                           "inscribed circle y",
                                           "leading edge radius",
                                           "leading edge form",
                                           "trailing edge radius",
                                           "trailing edge form",
                                           "camber height",
                                           "camber height place",
                                           "leading tip x",
                                           "leading tip y",
                                           "trailing tip x",
                                           "trailing tip y"};
  static_assert(sizeof(kNames) / sizeof(kNames[0]) == kSectionParameterCount);
  return kNames[static_cast<std::size_t>(parameter)];
}

std::string ReasonOf(NotMeasured reason) {
  switch (reason) {
    case NotMeasured::kMeasured:
      return "measured";
    case NotMeasured::kLeadingEndNotSeen:
      return "the leading end was not seen";
    case NotMeasured::kTrailingEndNotSeen:
      return "the trailing end was not seen";
    case NotMeasured::kEndIsSquare:
      return "the end is square or truncated";
    case NotMeasured::kEndIsSharp:
      return "the end is sharp";
    case NotMeasured::kEndPartlySeen:
      return "a part of the end was not seen";
    case NotMeasured::kNoDoubleTangent:
      return "no line touches the pressure side at two places";
    case NotMeasured::kContactNotSeen:
      return "where it would touch was not seen";
    case NotMeasured::kNotTwoSided:
      return "no circle touches both sides";
  }
  return "";
}

}  // namespace sixpoint::metrology
