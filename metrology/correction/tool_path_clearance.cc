#include "metrology/correction/tool_path_clearance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <tuple>
#include <utility>

#include "metrology/correction/mouth.h"
#include "metrology/correction/path_motion.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;
constexpr double kTold_mm = 0.01;  // where it fails, what is nearer by less than that is not looked for

absl::Status Check(const NominalToolPath& path, const CorrectedToolPath& corrected, const PathTool& tool,
                   const PathClearanceLimits& limits) {
  Refusals refusals;
  for (const auto& [field, value] : {std::pair("tool.diameter_mm", tool.diameter_mm),
                                     {"tool.length_mm", tool.length_mm},
                                     {"limits.mouth_mm", limits.mouth_mm}})
    if (!(value > 0 && std::isfinite(value))) refusals.Add(Refuse(field, value, "> 0"));
  for (const auto& [field, value, most] : {std::tuple("tool.diameter_mm", tool.diameter_mm, kGreatestPathTool_mm),
                                           {"limits.mouth_mm", limits.mouth_mm, kGreatestMouth_mm}})
    if (value > most && std::isfinite(value)) refusals.Add(Refuse(field, value, "at most " + Rounded(most)));
  if (!(limits.clearance_mm >= 0 && limits.clearance_mm < limits.mouth_mm))
    refusals.Add(Refuse("limits.clearance_mm", limits.clearance_mm, "0 or more, and less than limits.mouth_mm"));
  const std::string prefix = "paths[" + path.name + "].";
  refusals.Add(CheckPoseCount(path));
  if (corrected.poses.size() != path.poses.size())
    refusals.Add(Refuse(prefix + "poses", std::to_string(corrected.poses.size()) + " corrected",
                        std::to_string(path.poses.size())));
  return refusals.status();
}

// Of the way, and of the tool's length; what is looked at is its middle.
struct PathPiece {
  double from_share, to_share, low_mm, high_mm;
  double here_mm = 0, along_mm = 0,
         up_mm = 0;  // clearance in the middle, and by what the tool moves from there at most
  int number = 0;
  double AtLeastMm() const { return here_mm - along_mm - up_mm; }
  double Share() const { return (from_share + to_share) / 2; }
  double HeightMm() const { return (low_mm + high_mm) / 2; }
  // Of a heap: what may be nearest comes first, and of two alike the older one.
  bool operator<(const PathPiece& other) const {
    return std::pair(AtLeastMm(), number) > std::pair(other.AtLeastMm(), other.number);
  }
};

class PathClearances {
 public:
  // outside: the part beside the mouth; null where nothing of it is within the tool's reach.
  PathClearances(const Eigen::Affine3d& part_from_zero, const PathTool& tool, double clearance_mm,
                 const Surface* outside, const std::function<bool()>& keep_going)
      : part_from_zero_(part_from_zero),
        tool_(tool),
        clearance_mm_(clearance_mm),
        outside_(outside),
        keep_going_(keep_going) {}

  absl::StatusOr<PathClearance> Of(const PathMotion& motion, int from) {
    constexpr int kMostLooksAtPath = 20'000;
    PathClearance least{from, std::numeric_limits<double>::infinity(), 0, 0};
    std::vector<PathPiece> pieces;  // a heap
    int looks = 0;
    const auto look = [&](PathPiece piece) {
      Look(motion, &piece);
      piece.number = looks++;
      if (piece.here_mm < least.clearance_mm) least = {from, piece.here_mm, piece.Share(), piece.HeightMm()};
      pieces.push_back(piece);
      std::push_heap(pieces.begin(), pieces.end());
    };
    const std::vector<double>& bends = motion.bends();
    for (std::size_t i = 1; outside_ != nullptr && i < bends.size(); ++i)
      look({bends[i - 1], bends[i], 0, tool_.length_mm});
    while (!pieces.empty()) {
      if (looks % 256 < 2 && keep_going_ && !keep_going_())
        return absl::CancelledError("clearance of a path: the caller went away");
      std::pop_heap(pieces.begin(), pieces.end());
      const PathPiece piece = pieces.back();
      pieces.pop_back();
      const bool fails = least.clearance_mm < clearance_mm_;
      if (piece.AtLeastMm() >= (fails ? least.clearance_mm - kTold_mm : clearance_mm_)) break;
      if (looks >= kMostLooksAtPath) {
        if (!fails) least = {from, piece.AtLeastMm(), piece.Share(), piece.HeightMm()};
        break;
      }
      PathPiece first = piece, second = piece;
      if (piece.up_mm >= piece.along_mm)
        first.high_mm = second.low_mm = piece.HeightMm();
      else
        first.to_share = second.from_share = piece.Share();
      look(first);
      look(second);
    }
    return least;
  }

  Vector3d InPart(const PathMotion& motion, double share, double height_mm) const {
    const PathMotion::Place place = motion.At(share);
    return part_from_zero_ * (place.tip_in_zero_mm + height_mm * place.axis_in_zero);
  }

 private:
  void Look(const PathMotion& motion, PathPiece* piece) const {
    constexpr double kWarmth = 1.001;  // a mm of zero is so much of the part's at most
    const double speed_mm = std::fmax(motion.RatesBetween(piece->from_share, piece->to_share, piece->low_mm).speed_mm,
                                      motion.RatesBetween(piece->from_share, piece->to_share, piece->high_mm).speed_mm);
    piece->along_mm = kWarmth * (piece->to_share - piece->from_share) / 2 * speed_mm;
    piece->up_mm = kWarmth * (piece->high_mm - piece->low_mm) / 2;
    const Vector3d middle_mm = InPart(motion, piece->Share(), piece->HeightMm());
    piece->here_mm = std::abs(outside_->Closest(middle_mm).signed_distance_mm) - tool_.diameter_mm / 2;
  }

  const Eigen::Affine3d part_from_zero_;
  const PathTool tool_;
  const double clearance_mm_;
  const Surface* outside_;
  const std::function<bool()>& keep_going_;
};

// The part that the tool can come near to, without the mouth; null where there is none.
absl::StatusOr<std::shared_ptr<const Surface>> Outside(const NominalToolPath& path, const PathTool& tool,
                                                       const PathClearanceLimits& limits, const Surface& surface,
                                                       const std::function<bool()>& keep_going) {
  Points tips_mm;
  for (const ToolPose& at : path.poses) tips_mm.push_back(at.tip_in_part_mm);
  const TipLine line(std::move(tips_mm));
  // From the line between two poses the tip is off by far less than a millimetre and their distance.
  const double near_mm = tool.length_mm + tool.diameter_mm + limits.clearance_mm + limits.mouth_mm + 1 +
                         line.bounds_mm().diagonal().norm();
  const Eigen::AlignedBox3d box_mm(line.bounds_mm().min() - Vector3d::Constant(near_mm),
                                   line.bounds_mm().max() + Vector3d::Constant(near_mm));
  const double piece_mm = std::clamp((limits.mouth_mm - limits.clearance_mm) / 8, 0.005, 0.05);
  auto mesh = WithoutMouth(surface.mesh(), line, tool.diameter_mm / 2 + limits.mouth_mm, piece_mm, box_mm, keep_going);
  if (!mesh.ok()) return Under("paths[" + path.name + "].", mesh.status());
  if (mesh->triangles.empty()) return std::shared_ptr<const Surface>();
  return Surface::Prepare(*std::move(mesh));
}

}  // namespace

absl::StatusOr<std::vector<PathClearance>> MeasurePathClearances(
    const NominalToolPath& path, const CorrectedToolPath& corrected, const RegisteredPose& pose, const RotaryAxes& axes,
    const Drilling& drilling, const PathTool& tool, const PathClearanceLimits& limits, const Surface& surface,
    const std::function<bool()>& keep_going) {
  if (absl::Status status = Check(path, corrected, tool, limits); !status.ok()) return status;
  const auto outside = Outside(path, tool, limits, surface, keep_going);
  if (!outside.ok()) return outside.status();
  const Eigen::Affine3d part_from_zero = pose.zero_from_part.inverse() * axes.Growth(drilling.stretch).inverse();
  PathClearances clearances(part_from_zero, tool, limits.clearance_mm, outside->get(), keep_going);
  std::vector<PathClearance> found;
  const std::size_t steps = std::max<std::size_t>(1, corrected.poses.size() - 1);
  for (std::size_t i = 0; i < steps; ++i) {
    const CorrectedToolPose& to = corrected.poses[std::min(i + 1, corrected.poses.size() - 1)];
    const PathMotion motion(corrected.poses[i], to, axes, pose.positioning);
    auto least = clearances.Of(motion, static_cast<int>(i));
    if (!least.ok()) return least.status();
    // Within a closed part nothing of its surface need be near.
    for (const double share : {0.0, 1.0}) {
      if (!surface.mesh().closed) continue;
      const double holder_mm =
          surface.Closest(clearances.InPart(motion, share, tool.length_mm)).signed_distance_mm - tool.diameter_mm / 2;
      if (holder_mm < -tool.diameter_mm / 2 && holder_mm < least->clearance_mm)
        *least = {static_cast<int>(i), holder_mm, share, tool.length_mm};
    }
    found.push_back(*least);
  }
  return found;
}

}  // namespace sixpoint::metrology
