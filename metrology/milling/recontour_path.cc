#include "metrology/milling/recontour_path.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "metrology/frames/angles.h"
#include "metrology/milling/point_cells.h"
#include "metrology/parallel/loops.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMostAngle_deg = 75;
// Between two places, as kPlaceSpacing_mm: a ball of 3 mm on a straight way cuts 0.2 um and 0.4 um deeper.
constexpr double kPlaceTurn_rad = 0.02;
constexpr double kMostParts = 1000;
constexpr double kHollowReserve = 0.9;  // of the hollow side's radius of curvature, that a mill may have
constexpr double kHollowStretch_mm = 1.5;
constexpr double kMostLayers = 100;
constexpr double kGuardSpacing_mm = 0.1;  // in height: a ball of 3 mm goes 0.4 um deeper between two
constexpr double kTargetTolerance_mm =
    2e-4;  // into the target: less than this rounding and chords make of a ball that touches it

absl::Status Check(const std::vector<TargetSection>& target, const PathOptions& options) {
  Refusals refusals;
  const auto positive = [&](const char* field, double value, double most) {
    if (!(value > 0 && value <= most)) refusals.Add(Refuse(field, value, "above 0, at most " + NumberText(most)));
  };
  positive("mill.radius_mm", options.mill.radius_mm, 50);
  positive("mill.length_mm", options.mill.length_mm, 500);
  positive("smooth_mm", options.smooth_mm, 10);
  positive("depth_of_cut_mm", options.depth_of_cut_mm, 50);
  positive("finish_allowance_mm", options.finish_allowance_mm, 10);
  positive("roughing_step_mm", options.roughing_step_mm, 2 * options.mill.radius_mm);
  const auto angle = [&](const char* field, double value) {
    if (!(std::abs(value) <= kMostAngle_deg * kRadPerDeg))
      refusals.Add(Refuse(field, value, "within " + Rounded(kMostAngle_deg * kRadPerDeg) + " (75 deg) of 0"));
  };
  angle("lead_rad", options.lead_rad);
  angle("tilt_rad", options.tilt_rad);
  if (target.size() < 2) refusals.Add(Refuse("target", std::to_string(target.size()) + " sections", "at least 2"));
  for (std::size_t k = 1; k < target.size(); ++k) {
    const std::string name = "target[" + std::to_string(k) + "]";
    if (target[k].outline.size() != target[0].outline.size())
      refusals.Add(Refuse(name + ".outline", std::to_string(target[k].outline.size()) + " nodes",
                          std::to_string(target[0].outline.size()) + ", as the first"));
    const double step_mm = target[k].z_mm - target[k - 1].z_mm;
    if (!(step_mm > 0 && step_mm < 2 * options.mill.radius_mm))
      refusals.Add(Refuse(name + ".z_mm", target[k].z_mm, "above the one before, by less than the mill's diameter"));
  }
  return refusals.status();
}

absl::Status CheckStockAndGuard(double stock_mm, const GuardedSurface& guard, const PathOptions& options) {
  Refusals refusals;
  if (!(stock_mm >= 0 && stock_mm <= 100)) return Refuse("stock_mm", stock_mm, "0 to 100");
  if (!(stock_mm <= kMostLayers * options.depth_of_cut_mm))
    refusals.Add(Refuse("depth_of_cut_mm", options.depth_of_cut_mm,
                        "at least " + Rounded(stock_mm / kMostLayers) + ": no more than 100 layers"));
  if (guard.margin_mm.size() != guard.points_mm.size())
    return Refuse("guard.margin_mm", std::to_string(guard.margin_mm.size()) + " margins",
                  std::to_string(guard.points_mm.size()) + ", one for each point");
  for (std::size_t q = 0; q < guard.points_mm.size(); ++q) {
    const std::string at = "[" + std::to_string(q) + "]";
    if (!guard.points_mm[q].allFinite()) refusals.Add(Refuse("guard.points_mm" + at, "not finite", "finite"));
    if (!(guard.margin_mm[q] >= 0 && guard.margin_mm[q] <= options.mill.radius_mm))
      refusals.Add(Refuse("guard.margin_mm" + at, guard.margin_mm[q], "0 to the mill's radius"));
  }
  return refusals.status();
}

// Places of a pass on one contour, in its plane.
struct ContourPlace {
  Vector2d point_mm, normal;
};

std::vector<ContourPlace> PlacesOf(const Outline& outline) {
  std::vector<ContourPlace> places;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const OutlineNode &node = outline.nodes()[i], &next = outline.nodes()[outline.Next(i)];
    const double turn_rad = std::acos(std::clamp(node.normal.dot(next.normal), -1.0, 1.0));
    const double wanted =
        std::max((next.point_mm - node.point_mm).norm() / kPlaceSpacing_mm, turn_rad / kPlaceTurn_rad);
    const double parts = std::clamp(std::ceil(wanted), 1.0, kMostParts);
    for (double part = 0; part < parts; ++part) {
      const OutlinePlace place{i, part / parts};
      places.push_back({outline.PointAt(place), outline.NormalAt(place)});
    }
  }
  return places;
}

// The published normals: across the secant through both neighbours, then averaged along the contour.
std::vector<Vector3d> PublishedNormals(const std::vector<ContourPlace>& places, double smooth_mm) {
  const std::size_t count = places.size();
  std::vector<Vector2d> across;
  for (std::size_t i = 0; i < count; ++i) {
    const Vector2d feed = places[(i + 1) % count].point_mm - places[(i + count - 1) % count].point_mm;
    across.push_back(-LeftOf(feed).normalized());
  }
  std::vector<Vector3d> normals;
  for (std::size_t i = 0; i < count; ++i) {
    Vector2d sum = across[i];
    for (const bool ahead : {true, false}) {
      double way_mm = 0;
      std::size_t from = i;
      for (std::size_t k = 1; k < count / 4; ++k) {
        const std::size_t to = ahead ? (i + k) % count : (i + count - k) % count;
        way_mm += (places[to].point_mm - places[from].point_mm).norm();
        if (way_mm > 3 * smooth_mm) break;
        sum += std::exp(-way_mm * way_mm / (2 * smooth_mm * smooth_mm)) * across[to];
        from = to;
      }
    }
    normals.emplace_back(sum.normalized().x(), sum.normalized().y(), 0);
  }
  return normals;
}

// Leaning as the contours below and above lie outward or inward of the place.
std::vector<Vector3d> SurfaceNormals(const std::vector<ContourPlace>& contour, const std::vector<TargetSection>& target,
                                     std::size_t k) {
  const std::size_t below = k == 0 ? 0 : k - 1, above = std::min(k + 1, target.size() - 1);
  const double rise_mm = target[above].z_mm - target[below].z_mm;
  std::vector<Vector3d> normals;
  for (const auto& [point_mm, normal] : contour) {
    const Outline &lower = target[below].outline, &upper = target[above].outline;
    const double lean =
        normal.dot(upper.PointAt(upper.Nearest(point_mm)) - lower.PointAt(lower.Nearest(point_mm))) / rise_mm;
    normals.push_back(Vector3d(normal.x(), normal.y(), -lean).normalized());
  }
  return normals;
}

// The least radius with which the target is hollow over a stretch of its contour: over less, waves of a micrometre would count.
double LeastHollow_mm(const std::vector<TargetSection>& target) {
  double least_mm = std::numeric_limits<double>::infinity();
  for (const TargetSection& section : target) {
    const auto& nodes = section.outline.nodes();
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      std::size_t k = section.outline.Next(i);
      while ((nodes[k].point_mm - nodes[i].point_mm).norm() < kHollowStretch_mm && k != i) k = section.outline.Next(k);
      const Vector2d along = LeftOf(nodes[i].normal);
      const double length_mm = (nodes[k].point_mm - nodes[i].point_mm).norm();
      const double turn = along.dot(nodes[k].normal);  // positive where the contour is convex
      if (turn < 0) least_mm = std::min(least_mm, length_mm / -turn);
    }
  }
  return least_mm;
}

// How far along its normal a ball must go so that no guarded point that it reaches into lies nearer to its centre than radius and margin.
double LiftOf(const PointCells& cells, const GuardedSurface& guard, const Vector3d& centre_mm, const Vector3d& normal,
              double radius_mm, double greatest_margin_mm) {
  double lift_mm = 0;
  cells.Near(centre_mm, radius_mm + greatest_margin_mm, [&](std::size_t q) {
    const double keep_mm = radius_mm + guard.margin_mm[q];
    const Vector3d off = guard.points_mm[q] - centre_mm;
    if (off.squaredNorm() >= keep_mm * keep_mm) return;
    const double along = off.dot(normal), across2 = off.squaredNorm() - along * along;
    lift_mm = std::max(lift_mm, along + std::sqrt(std::max(0.0, keep_mm * keep_mm - across2)));
  });
  return lift_mm;
}

// Along its normal, until it reaches into nothing guarded: where it was lifted to it may reach into something else.
void Lift(const PointCells& cells, const GuardedSurface& guard, double radius_mm, double greatest_margin_mm,
          ToolPlace* place) {
  constexpr int kMostTurns = 50;
  constexpr double kSettled_mm = 1e-9;
  for (int turn = 0; turn < kMostTurns; ++turn) {
    const double lift_mm = LiftOf(cells, guard, place->centre_mm, place->normal, radius_mm, greatest_margin_mm);
    if (lift_mm <= kSettled_mm) return;
    place->lifted_mm += lift_mm;
    place->centre_mm += lift_mm * place->normal;
  }
}

// And half way to the next place, where the ball comes by on a straight line: both are lifted then.
void LiftWays(const PointCells& cells, const GuardedSurface& guard, double radius_mm, double greatest_margin_mm,
              RecontourPass* pass) {
  constexpr int kTurns = 4;
  std::vector<ToolPlace>& places = pass->places;
  for (int turn = 0; turn < kTurns; ++turn)
    for (std::size_t i = 0; i < places.size(); ++i) {
      ToolPlace &one = places[i], &next = places[(i + 1) % places.size()];
      ToolPlace between;
      between.centre_mm = (one.centre_mm + next.centre_mm) / 2;
      between.normal = (one.normal + next.normal).normalized();
      Lift(cells, guard, radius_mm, greatest_margin_mm, &between);
      for (ToolPlace* place : {&one, &next}) {
        place->lifted_mm += between.lifted_mm;
        place->centre_mm += between.lifted_mm * place->normal;
      }
    }
}

RecontourPass PassOf(const std::vector<ContourPlace>& contour, const std::vector<Vector3d>& normals, double z_mm,
                     double allowance_mm, const Vector2d& origin_mm, const PathOptions& options) {
  RecontourPass pass;
  pass.z_mm = z_mm;
  pass.allowance_mm = allowance_mm;
  const std::size_t count = contour.size();
  for (std::size_t i = 0; i < count; ++i) {
    ToolPlace place;
    const Vector2d feed = contour[(i + 1) % count].point_mm - contour[(i + count - 1) % count].point_mm;
    place.contact_mm << contour[i].point_mm + origin_mm, z_mm;
    place.normal = normals[i];
    place.centre_mm = place.contact_mm + (options.mill.radius_mm + allowance_mm) * place.normal;
    place.axis = ToolAxis(Vector3d(feed.x(), feed.y(), 0), place.normal, options.lead_rad, options.tilt_rad);
    pass.places.push_back(place);
  }
  return pass;
}

}  // namespace

Vector3d ToolAxis(const Vector3d& feed, const Vector3d& normal, double lead_rad, double tilt_rad) {
  const double lead = std::tan(lead_rad), tilt = std::tan(tilt_rad);
  const double t_y = 1 / std::sqrt(1 + lead * lead + tilt * tilt);
  const Vector3d along = (feed - normal * normal.dot(feed)).normalized();
  return t_y * lead * along + t_y * normal + t_y * tilt * normal.cross(along);
}

std::optional<double> ScallopOf(double step_over_mm, double radius_mm) {
  if (!(step_over_mm >= 0 && step_over_mm <= 2 * radius_mm)) return std::nullopt;
  return radius_mm - std::sqrt(radius_mm * radius_mm - step_over_mm * step_over_mm / 4);
}

std::optional<double> StepOverFor(double scallop_mm, double radius_mm) {
  if (!(scallop_mm > 0 && scallop_mm < radius_mm)) return std::nullopt;
  return 2 * std::sqrt(scallop_mm * (2 * radius_mm - scallop_mm));
}

std::vector<double> PassHeights(double cutoff_mm, double target_mm, double step_over_mm) {
  const double count = std::max(1.0, std::ceil((target_mm - cutoff_mm) / step_over_mm - 1e-9));
  std::vector<double> z_mm;
  for (double k = 0; k <= count; ++k) z_mm.push_back(cutoff_mm + (target_mm - cutoff_mm) * k / count);
  return z_mm;
}

GuardedSurface GuardBelow(const std::vector<BladeSection>& measured, const TargetSection& at_line,
                          const Vector2d& origin_mm, double reach_mm, double margin_mm) {
  GuardedSurface guard;
  const double top_mm = measured.back().z_mm;
  for (std::size_t k = 0; k < measured.size(); ++k) {
    if (measured[k].z_mm < top_mm - reach_mm) continue;
    const bool last = k + 1 == measured.size();
    const Outline &lower = measured[k].outline, &upper = last ? at_line.outline : measured[k + 1].outline;
    const double rise_mm = std::max(0.0, (last ? at_line.z_mm : measured[k + 1].z_mm) - measured[k].z_mm);
    const int steps = std::max(1, static_cast<int>(std::ceil(rise_mm / kGuardSpacing_mm)));
    const int layers = last && rise_mm > 0 ? steps + 1 : steps;  // the line itself is no other's lowest
    for (const auto& [one, normal] : PlacesOf(lower)) {
      // Where the surface is on the same normal one section higher.
      const double out_mm = normal.dot(upper.PointAt(upper.Nearest(one)) - one);
      for (int layer = 0; layer < layers; ++layer) {
        const double part = static_cast<double>(layer) / steps;
        const Vector2d point = one + part * out_mm * normal + origin_mm;
        guard.points_mm.emplace_back(point.x(), point.y(), measured[k].z_mm + part * rise_mm);
        guard.margin_mm.push_back(margin_mm);
        guard.normals.emplace_back(normal.x(), normal.y(), 0);
      }
    }
  }
  return guard;
}

WeldStock WeldStockOf(const std::vector<TargetSection>& target, const Vector2d& origin_mm,
                      const Points& weld_points_mm) {
  constexpr double kSeen_mm = 1;
  WeldStock stock;
  std::vector<std::vector<bool>> seen;
  for (const TargetSection& section : target)
    seen.emplace_back(static_cast<std::size_t>(std::ceil(section.outline.length_mm() / kSeen_mm)), false);
  // Outside one contour, along its normal.
  const auto outside_mm = [&](const TargetSection& section, const Vector2d& flat, OutlinePlace* place) {
    *place = section.outline.Nearest(flat);
    return (flat - section.outline.PointAt(*place)).dot(section.outline.NormalAt(*place));
  };
  for (const Vector3d& point : weld_points_mm) {
    const auto above = std::lower_bound(target.begin(), target.end(), point.z(),
                                        [](const TargetSection& section, double z) { return section.z_mm < z; });
    if (above == target.end() || (above == target.begin() && point.z() < target.front().z_mm)) continue;
    const auto below = above == target.begin() ? above : above - 1;
    const double rise_mm = above->z_mm - below->z_mm;
    const double part = rise_mm > 0 ? (point.z() - below->z_mm) / rise_mm : 0;
    const Vector2d flat = point.head<2>() - origin_mm;
    OutlinePlace low, high;
    const double low_mm = outside_mm(*below, flat, &low), high_mm = outside_mm(*above, flat, &high);
    stock.greatest_mm = std::max(stock.greatest_mm, (1 - part) * low_mm + part * high_mm);
    const auto nearest = part < 0.5 ? below : above;
    auto& pieces = seen[static_cast<std::size_t>(nearest - target.begin())];
    const double along_mm = nearest->outline.At(part < 0.5 ? low : high);
    pieces[std::min(pieces.size() - 1, static_cast<std::size_t>(along_mm / kSeen_mm))] = true;
  }
  std::size_t seen_count = 0, count = 0;
  for (const auto& pieces : seen) {
    seen_count += static_cast<std::size_t>(std::count(pieces.begin(), pieces.end(), true));
    count += pieces.size();
  }
  stock.seen_part = count == 0 ? 0 : static_cast<double>(seen_count) / static_cast<double>(count);
  return stock;
}

absl::StatusOr<RecontourPath> PlanPath(const std::vector<TargetSection>& target, const Vector2d& origin_mm,
                                       double stock_mm, const GuardedSurface& guard, const PathOptions& options,
                                       int thread_count) {
  if (const absl::Status status = Check(target, options); !status.ok()) return status;
  if (const absl::Status status = CheckStockAndGuard(stock_mm, guard, options); !status.ok()) return status;
  const double hollow_mm = LeastHollow_mm(target);
  if (options.mill.radius_mm > kHollowReserve * hollow_mm)
    return Refuse(
        "mill.radius_mm", options.mill.radius_mm,
        "at most " + Rounded(kHollowReserve * hollow_mm) + ": nine tenths of the target's least hollow radius");
  std::vector<std::vector<ContourPlace>> contours;
  for (const TargetSection& section : target) contours.push_back(PlacesOf(section.outline));
  RecontourPath path;
  const double rough_mm = std::max(0.0, stock_mm - options.finish_allowance_mm);
  path.roughing_layers = static_cast<std::size_t>(std::ceil(rough_mm / options.depth_of_cut_mm - 1e-9));
  const double step_mm = target[1].z_mm - target[0].z_mm;
  const auto every = std::max<std::size_t>(1, static_cast<std::size_t>(options.roughing_step_mm / step_mm + 1e-9));
  struct Planned {
    std::size_t section = 0;
    double allowance_mm = 0;
  };
  std::vector<Planned> planned;
  for (std::size_t layer = path.roughing_layers + 1; layer-- > 0;) {
    // The last layer, 0, finishes; the others lie a depth of cut above each other.
    const double allowance_mm = layer == 0
                                    ? 0
                                    : options.finish_allowance_mm + rough_mm * (static_cast<double>(layer) - 1) /
                                                                        static_cast<double>(path.roughing_layers);
    for (std::size_t k = target.size(); k-- > 0;)
      if (layer == 0 || k % every == 0 || k + 1 == target.size()) planned.push_back({k, allowance_mm});
  }
  // A ball that reaches a place may reach another place of the target too: in a hollow that is too small for it. Then rest is left.
  GuardedSurface guarded = guard;
  for (std::size_t k = 0; k < target.size(); ++k)
    for (const ContourPlace& place : contours[k]) {
      guarded.points_mm.emplace_back(place.point_mm.x() + origin_mm.x(), place.point_mm.y() + origin_mm.y(),
                                     target[k].z_mm);
      guarded.margin_mm.push_back(-kTargetTolerance_mm);
    }
  const PointCells cells(guarded.points_mm, options.mill.radius_mm / 4);
  double greatest_margin_mm = 0;
  for (const double margin_mm : guarded.margin_mm) greatest_margin_mm = std::max(greatest_margin_mm, margin_mm);
  path.passes.resize(planned.size());
  ForEach(planned.size(), thread_count, [&](std::size_t p) {
    const std::size_t k = planned[p].section;
    const auto normals = options.normals == NormalMethod::kPublished ? PublishedNormals(contours[k], options.smooth_mm)
                                                                     : SurfaceNormals(contours[k], target, k);
    path.passes[p] = PassOf(contours[k], normals, target[k].z_mm, planned[p].allowance_mm, origin_mm, options);
    for (ToolPlace& place : path.passes[p].places)
      Lift(cells, guarded, options.mill.radius_mm, greatest_margin_mm, &place);
    LiftWays(cells, guarded, options.mill.radius_mm, greatest_margin_mm, &path.passes[p]);
  });
  // What folds over itself, or has a hollow that no ball stands in.
  for (std::size_t p = 0; p < planned.size(); ++p)
    for (const ToolPlace& place : path.passes[p].places)
      if (place.lifted_mm > options.mill.radius_mm)
        return Refuse("target[" + std::to_string(planned[p].section) + "].outline",
                      "a place that a ball stands clear of by " + Rounded(place.lifted_mm),
                      "places within the mill's radius of what is guarded");
  for (std::size_t k = 1; k < target.size(); ++k)
    path.scallop_mm =
        std::max(path.scallop_mm, ScallopOf(target[k].z_mm - target[k - 1].z_mm, options.mill.radius_mm).value_or(0));
  return path;
}

}  // namespace sixpoint::metrology
