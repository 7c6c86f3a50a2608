#include "metrology/calibration/feature_search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "metrology/calibration/hole_search.h"
#include "metrology/calibration/plane_search.h"

namespace sixpoint::metrology {
namespace {

constexpr size_t kSampleCount = 150000;
constexpr size_t kMostFacesInScan = 8;
constexpr double kPlaneBandMm = 0.03;  // consensus band about the upper face
constexpr double kMatchMm = 0.7;       // region's centre against the record's: half a gap off, and tilted
constexpr double kAgreeMm = 0.15;      // a reading on a cone's wall: shear and tilt of the sensor are not known yet

struct Feature {
  std::string name;
  Eigen::Vector2d centre;
  bool slot;
};

struct Match {
  Eigen::Rotation2Dd turn{0};
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  std::vector<int> region;  // of each feature; -1: none
  int count = 0;
  double squares = 0;
};

Match Matched(const std::vector<Feature>& features, const std::vector<Recess>& regions, double angle,
              const Eigen::Vector2d& shift) {
  Match match{Eigen::Rotation2Dd(angle), shift, {}, 0, 0};
  for (const Feature& f : features) {
    const Eigen::Vector2d at = match.turn * f.centre + shift;
    int nearest = -1;
    double best = kMatchMm * kMatchMm;
    for (size_t r = 0; r < regions.size(); ++r) {
      const double d = (regions[r].centre - at).squaredNorm();
      if (regions[r].slot == f.slot && d < best) {
        best = d;
        nearest = static_cast<int>(r);
      }
    }
    match.region.push_back(nearest);
    if (nearest < 0) continue;
    ++match.count;
    match.squares += best;
  }
  return match;
}

// The in-plane rigid fit of the matched pairs, and its matches.
Match Settled(const std::vector<Feature>& features, const std::vector<Recess>& regions, const Match& start) {
  Eigen::Vector2d from = Eigen::Vector2d::Zero(), onto = from;
  for (size_t i = 0; i < features.size(); ++i)
    if (start.region[i] >= 0) {
      from += features[i].centre / start.count;
      onto += regions[start.region[i]].centre / start.count;
    }
  double dot = 0, cross = 0;
  for (size_t i = 0; i < features.size(); ++i)
    if (start.region[i] >= 0) {
      const Eigen::Vector2d f = features[i].centre - from, o = regions[start.region[i]].centre - onto;
      dot += f.dot(o);
      cross += f.x() * o.y() - f.y() * o.x();
    }
  const double angle = std::atan2(cross, dot);
  return Matched(features, regions, angle, onto - Eigen::Rotation2Dd(angle) * from);
}

// A pose of the artefact in a face, judged by the readings themselves.
struct Sighting {
  Eigen::Rotation2Dd turn{0};
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  std::vector<size_t> agreeing;  // readings on each feature that lie where the record has its surface
  std::vector<bool> seen;        // enough of them
  int matched = 0;
  double score = 0;  // readings in features that agree, less those that contradict
};

bool SamePlace(const Sighting& a, const Sighting& b) {
  return std::abs((a.turn.inverse() * b.turn).smallestAngle()) < 0.1 && (a.shift - b.shift).norm() < 1;
}

// The in-plane pose by the cones' walls: a reading at some depth has its distance from the cone's axis. The gate closes, so
// that strays and a hole's missing side lose their pull.
void Settle(const std::vector<FacePoint>& low, const Artefact& artefact, Sighting* s) {
  const double slope = std::tan(artefact.cone_half_angle_rad), c = std::cos(artefact.cone_half_angle_rad);
  for (const double gate : {0.8, 0.8, 0.5, 0.3, 0.2, 0.1, 0.1}) {
    Eigen::Matrix3d normal = 1e-9 * Eigen::Matrix3d::Identity();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    const Eigen::Matrix2d turn = s->turn.toRotationMatrix();
    for (const FacePoint& p : low)
      for (const PlaneFeature& cone : artefact.cones) {
        const Eigen::Vector2d arm = turn * cone.centre_mm, d = p.at - s->shift - arm;
        const double squared = d.squaredNorm(), reach = artefact.cone_top_radius_mm + gate;
        if (squared > reach * reach || squared < 0.01) continue;
        const double r = std::sqrt(squared);
        const double distance = (r - artefact.cone_top_radius_mm + p.depth * slope) * c;
        if (std::abs(distance) > gate || p.depth > artefact.ConeDepth() - 0.05) continue;
        const Eigen::Vector2d out = d / r;
        const Eigen::Vector3d row(-c * out.dot(Eigen::Vector2d(-arm.y(), arm.x())), -c * out.x(), -c * out.y());
        normal += row * row.transpose();
        right -= distance * row;
      }
    const Eigen::Vector3d step = normal.ldlt().solve(right);
    if (!step.allFinite() || step.tail<2>().norm() > 1 || std::abs(step(0)) > 0.2) return;
    s->turn = Eigen::Rotation2Dd(s->turn.angle() + step(0));
    s->shift += step.tail<2>();
  }
}

// Which features the readings bear out, and how well they speak for this pose.
void Judge(const std::vector<FacePoint>& all, const Artefact& artefact, Sighting* s) {
  const double slope = std::tan(artefact.cone_half_angle_rad), c = std::cos(artefact.cone_half_angle_rad);
  const double half = artefact.side_mm / 2, half_slot = artefact.slot_width_mm / 2;
  const Eigen::Matrix2d back = s->turn.toRotationMatrix().transpose();
  const size_t cones = artefact.cones.size();
  s->agreeing.assign(cones + artefact.slots.size(), 0);
  size_t upper = 0, against = 0;
  for (const FacePoint& p : all) {
    const Eigen::Vector2d at = back * (p.at - s->shift);
    if (at.cwiseAbs().maxCoeff() > half || std::abs(p.depth) > 5) continue;
    const bool on_face = std::abs(p.depth) < 0.06;
    bool inside = false;
    for (size_t k = 0; k < cones && !inside; ++k) {
      const double r = (at - artefact.cones[k].centre_mm).norm();
      if (r > artefact.cone_top_radius_mm) continue;
      inside = true;
      if (r > artefact.cone_top_radius_mm - 0.3) continue;
      if (on_face) ++against;
      if (p.depth < artefact.ConeDepth() - 0.05 &&
          std::abs((r - artefact.cone_top_radius_mm + p.depth * slope) * c) < kAgreeMm)
        ++s->agreeing[k];
    }
    for (size_t k = 0; k < artefact.slots.size() && !inside; ++k) {
      const double off = (at - artefact.slots[k].centre_mm).cwiseAbs().maxCoeff();
      if (off > half_slot) continue;
      inside = true;
      if (off > half_slot - 0.3) continue;
      if (on_face) ++against;
      if (std::abs(p.depth - artefact.slot_depth_mm) < 0.08) ++s->agreeing[cones + k];
    }
    if (!inside) upper += on_face;
  }
  // Against what the upper face's own density leads one to expect.
  const double top = artefact.cone_top_radius_mm - 0.3, bottom = artefact.cone_bottom_radius_mm;
  const double cone_area = M_PI * std::max(0.1, top * top - bottom * bottom);
  const double slot_area = 4 * (half_slot - 0.3) * (half_slot - 0.3);
  const double upper_area =
      4 * half * half - static_cast<double>(cones) * M_PI * artefact.cone_top_radius_mm * artefact.cone_top_radius_mm -
      static_cast<double>(artefact.slots.size()) * 4 * half_slot * half_slot;
  const double density = static_cast<double>(upper) / std::max(1.0, upper_area);
  constexpr double kLeastSeenShare = 0.25;
  s->seen.clear();
  s->matched = 0;
  s->score = -static_cast<double>(against);
  for (size_t k = 0; k < s->agreeing.size(); ++k) {
    const double expected = density * (k < cones ? cone_area : slot_area);
    s->seen.push_back(static_cast<double>(s->agreeing[k]) > std::max(15.0, kLeastSeenShare * expected));
    s->matched += s->seen.back();
    s->score += static_cast<double>(s->agreeing[k]);
  }
}

// The best pose in one face, and the next best one elsewhere. Nothing matched: matched is 0.
struct FaceSearch {
  Sighting best, rival;
  int round = 0, square = 0;  // holes seen
};
FaceSearch SearchFace(const std::vector<FacePoint>& seen, const Artefact& artefact) {
  FaceSearch search;
  const std::vector<Recess> regions = HolesBelow(seen, artefact);
  for (const Recess& r : regions) ++(r.slot ? search.square : search.round);
  std::vector<Feature> features;
  for (const PlaneFeature& c : artefact.cones) features.push_back({c.name, c.centre_mm, false});
  for (const PlaneFeature& q : artefact.slots) features.push_back({q.name, q.centre_mm, true});

  // Every pair of regions on every pair of features of the same kinds and distance proposes a pose.
  std::vector<Match> proposals;
  const auto before = [](const Match& a, const Match& b) {
    return a.count != b.count ? a.count > b.count : a.squares < b.squares;
  };
  for (size_t i = 0; i < features.size(); ++i)
    for (size_t j = 0; j < features.size(); ++j)
      for (size_t r = 0; r < regions.size(); ++r)
        for (size_t s = 0; s < regions.size(); ++s) {
          if (i == j || r == s || features[i].slot != regions[r].slot || features[j].slot != regions[s].slot) continue;
          const Eigen::Vector2d f = features[j].centre - features[i].centre, g = regions[s].centre - regions[r].centre;
          if (std::abs(f.norm() - g.norm()) > kMatchMm) continue;
          const double angle = std::atan2(f.x() * g.y() - f.y() * g.x(), f.dot(g));
          const Eigen::Vector2d middle = (features[i].centre + features[j].centre) / 2;
          const Match match =
              Settled(features, regions,
                      Matched(features, regions, angle,
                              (regions[r].centre + regions[s].centre) / 2 - Eigen::Rotation2Dd(angle) * middle));
          if (match.count < 2) continue;
          // One proposal a place, the better one.
          const auto same = std::find_if(proposals.begin(), proposals.end(), [&](const Match& o) {
            return std::abs((o.turn.inverse() * match.turn).smallestAngle()) < 0.1 &&
                   (o.shift - match.shift).norm() < 1;
          });
          if (same == proposals.end())
            proposals.push_back(match);
          else if (before(match, *same))
            *same = match;
        }
  std::stable_sort(proposals.begin(), proposals.end(), before);
  constexpr size_t kMostProposals = 12;
  if (proposals.size() > kMostProposals) proposals.resize(kMostProposals);

  std::vector<FacePoint> low;
  for (const FacePoint& p : seen)
    if (p.depth > kBelowMm && p.depth < artefact.ConeDepth()) low.push_back(p);
  for (const Match& proposal : proposals) {
    Sighting sighting;
    sighting.turn = proposal.turn;
    sighting.shift = proposal.shift;
    Settle(low, artefact, &sighting);
    Judge(seen, artefact, &sighting);
    if (search.best.matched == 0 || sighting.score > search.best.score) {
      if (search.best.matched > 0 && !SamePlace(sighting, search.best)) search.rival = search.best;
      search.best = sighting;
    } else if (!SamePlace(sighting, search.best) && sighting.score > search.rival.score) {
      search.rival = sighting;
    }
  }
  return search;
}

}  // namespace

absl::StatusOr<ArtefactSighting> FindArtefact(const LineScan& scan, const Artefact& artefact) {
  const std::string where = "scan " + scan.id + ": ";
  const Points sample = EvenSample(scan.points_mm, kSampleCount);
  if (sample.size() < 2000)
    return absl::FailedPreconditionError(where + std::to_string(sample.size()) +
                                         " points, want at least 2000 of the artefact");
  const std::vector<Plane> faces = FlatFaces(sample, kPlaneBandMm, kMostFacesInScan);
  if (faces.empty())
    return absl::FailedPreconditionError(where +
                                         "no upper face found: no plane within 30 deg of level holds a thirtieth of "
                                         "the points; scan the artefact's plate");
  // The plate need not be the largest face in view: a fixture's or the bed's may be.
  FaceSearch found;
  const Plane* upper_face = &faces[0];
  std::vector<FacePoint> seen(sample.size());
  for (const Plane& face : faces) {
    const FaceFrame frame(face);
    for (size_t i = 0; i < sample.size(); ++i) seen[i] = frame.See(sample[i]);
    FaceSearch search = SearchFace(seen, artefact);
    const bool better = search.best.matched != found.best.matched ? search.best.matched > found.best.matched
                                                                  : search.best.score > found.best.score;
    if (&face != &faces[0] && !better) {
      if (found.best.matched == 0 && search.round + search.square > found.round + found.square) found = search;
      continue;
    }
    found = std::move(search);
    upper_face = &face;
    if (found.best.matched == static_cast<int>(artefact.cones.size() + artefact.slots.size())) break;
  }
  const Sighting& best = found.best;
  const std::string holes = std::to_string(found.round) + " round and " + std::to_string(found.square) +
                            " square holes seen below the upper face";
  if (best.matched < 3)
    return absl::FailedPreconditionError(where + "the artefact's pattern of cones and slots was not found (" + holes +
                                         ", " + std::to_string(best.matched) + " features of at least 3 where the " +
                                         "record has them); scan this artefact, with all its cones in view");
  std::string missing;
  for (size_t k = 0; k < artefact.cones.size(); ++k)
    if (!best.seen[k]) missing += (missing.empty() ? "" : ", ") + artefact.cones[k].name;
  if (!missing.empty())
    return absl::FailedPreconditionError(where + "cone " + missing + " not found (" + holes +
                                         "); uncover it and scan again with all cones in view");
  constexpr double kClearlyBetter = 0.9;
  if (found.rival.matched >= best.matched && found.rival.score > kClearlyBetter * best.score)
    return absl::FailedPreconditionError(where + "two poses of the artefact fit equally well (" + holes +
                                         "); scan its slots too");
  const FaceFrame frame(*upper_face);
  ArtefactSighting sighting;
  sighting.matched_features = best.matched;
  const Eigen::Vector2d ax = best.turn * Eigen::Vector2d::UnitX(), ay = best.turn * Eigen::Vector2d::UnitY();
  sighting.sensor_from_artefact.linear() << frame.u * ax.x() + frame.v * ax.y(), frame.u * ay.x() + frame.v * ay.y(),
      upper_face->normal;
  sighting.sensor_from_artefact.translation() = upper_face->point + frame.u * best.shift.x() + frame.v * best.shift.y();
  size_t upper = 0;
  for (const Eigen::Vector3d& p : sample) upper += std::abs(upper_face->HeightOf(p)) < kPlaneBandMm;
  sighting.upper_face_fraction = static_cast<double>(upper) / static_cast<double>(sample.size());
  return sighting;
}

}  // namespace sixpoint::metrology
