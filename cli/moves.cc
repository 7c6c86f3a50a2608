#include "cli/moves.h"

#include <algorithm>

#include "services/runtime/geometry_proto.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"

namespace sixpoint::cli {

using registration::v1::Registration;

absl::StatusOr<double> GreatestMove_um(const Registration& before, const Registration& after,
                                       const geometry::v1::Point& minimum_mm, const geometry::v1::Point& maximum_mm) {
  const auto was = runtime::FromProto("before.zero_from_part", before.zero_from_part());
  const auto is = runtime::FromProto("after.zero_from_part", after.zero_from_part());
  if (!was.ok()) return was.status();
  if (!is.ok()) return is.status();
  double greatest_mm = 0;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner_mm((i & 1 ? maximum_mm : minimum_mm).x_mm(), (i & 2 ? maximum_mm : minimum_mm).y_mm(),
                                    (i & 4 ? maximum_mm : minimum_mm).z_mm());
    greatest_mm = std::max(greatest_mm, (*was * corner_mm - *is * corner_mm).norm());
  }
  return 1e3 * greatest_mm;
}

absl::StatusOr<std::optional<double>> Moves::Greatest_um(int index, const Registration& after) {
  if (!before(index).has_zero_from_part() || !after.has_zero_from_part()) return std::nullopt;
  plant::v1::GetPartRequest get;
  get.set_name(after.part() + "@" + std::to_string(after.part_revision()));
  const auto [part, is_new] = parts_.try_emplace(get.name());
  if (is_new)
    if (absl::Status status = session_->Call<plant::v1::PlantService>("plant", &plant::v1::PlantService::Stub::GetPart,
                                                                      get, &part->second);
        !status.ok())
      return status;
  const auto moved_um =
      GreatestMove_um(before(index), after, part->second.surface().minimum_mm(), part->second.surface().maximum_mm());
  if (!moved_um.ok()) return moved_um.status();
  return *moved_um;
}

}  // namespace sixpoint::cli
