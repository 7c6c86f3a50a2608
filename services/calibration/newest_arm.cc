#include "services/calibration/newest_arm.h"

#include "services/calibration/study_messages.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::calibration {

absl::StatusOr<std::optional<clients::FetchedArmStudy>> NewestArm(const storage::StudyStore& studies,
                                                                  const std::string& machine,
                                                                  storage::Deadline deadline) {
  storage::StudyFilter newest;
  newest.machine_id = runtime::LastSegment(machine);
  newest.kind = KindText(v1::STUDY_KIND_ARM);
  const auto found = studies.List(newest, 0, 1, deadline);
  if (!found.ok()) return found.status();
  if (found->empty()) return std::nullopt;
  const absl::StatusOr<v1::Study> study = ToProto(found->front());
  if (!study.ok()) return study.status();
  auto arm = clients::ArmOf(*study);
  if (!arm.ok()) return arm.status();
  return *std::move(arm);
}

}  // namespace sixpoint::calibration
