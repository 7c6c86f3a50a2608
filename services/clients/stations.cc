#include "services/clients/stations.h"

#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"

namespace sixpoint::clients {
namespace {

absl::StatusOr<Eigen::Isometry3d> PoseOf(const plant::v1::Station& station) {
  return runtime::FromProto("part.stations." + station.station() + ".zero_from_part_nominal",
                            station.zero_from_part_nominal());
}

}  // namespace

absl::Status CheckStation(const std::string& field, const std::string& station, const plant::v1::Part& part) {
  if (part.stations().empty())
    return station.empty() ? absl::OkStatus()
                           : runtime::Refuse(field, station, "none: " + part.name() + " has no stations");
  std::string known;
  for (const plant::v1::Station& one : part.stations()) {
    if (one.station() == station) return absl::OkStatus();
    known += (known.empty() ? "" : ", ") + one.station();
  }
  return runtime::Refuse(field, station, "a station of " + part.name() + " (" + known + ")");
}

absl::StatusOr<Eigen::Isometry3d> NominalPoseAt(const std::string& field, const std::string& station,
                                                const plant::v1::Part& part) {
  if (absl::Status known = CheckStation(field, station, part); !known.ok()) return known;
  for (const plant::v1::Station& one : part.stations())
    if (one.station() == station) return PoseOf(one);
  return runtime::FromProto("part.zero_from_part_nominal", part.zero_from_part_nominal());
}

absl::StatusOr<std::vector<Eigen::Isometry3d>> NeighboursOf(const std::string& station, const plant::v1::Part& part) {
  std::vector<Eigen::Isometry3d> neighbours;
  for (const plant::v1::Station& one : part.stations()) {
    if (one.station() == station) continue;
    const auto pose = PoseOf(one);
    if (!pose.ok()) return pose.status();
    neighbours.push_back(*pose);
  }
  return neighbours;
}

}  // namespace sixpoint::clients
