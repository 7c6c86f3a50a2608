#include "services/inspection/efficacy_service.h"

#include <string>
#include <utility>

#include "services/inspection/efficacy.h"
#include "services/inspection/efficacy_messages.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/list_filters.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::inspection {
namespace {

constexpr int kUsualBlades = 100, kMostBlades = 200, kMostPeriods = 20;
constexpr int kUsualLeast = 5, kLeastLeast = 3, kMostLeast = 1000;

struct WantedEfficacy {
  storage::OutcomeFilter filter;
  int most_blades = kUsualBlades;
  metrology::EfficacyOptions options;
};

absl::StatusOr<WantedEfficacy> Read(const v1::ComputeEfficacyRequest& request, const grpc::ServerContext& context) {
  WantedEfficacy wanted;
  runtime::Refusals refusals;
  const auto take = [&](absl::StatusOr<std::string> read, std::string* id) {
    refusals.Add(read.status());
    if (read.ok()) *id = *std::move(read);
  };
  take(runtime::IdOf("machine", "machines", request.machine()), &wanted.filter.machine_id);
  take(runtime::FilterIdOf("part", "parts", request.part()), &wanted.filter.part_id);
  take(runtime::FilterIdOf("calibration", "calibrations", request.calibration()), &wanted.filter.calibration_id);
  refusals.Add(runtime::CheckUuid("calibration", wanted.filter.calibration_id));
  const absl::StatusOr<storage::TimeSpan> corrected = runtime::SpanOf("corrected", request.corrected());
  refusals.Add(corrected.status());
  if (corrected.ok()) wanted.filter.corrected = *corrected;
  wanted.options.least_blades = request.least_blades() == 0 ? kUsualLeast : request.least_blades();
  if (wanted.options.least_blades < kLeastLeast || wanted.options.least_blades > kMostLeast)
    refusals.Add(runtime::Refuse("least_blades", request.least_blades(), "3 to 1000, or 0: 5"));
  if (request.most_blades() != 0) wanted.most_blades = request.most_blades();
  if (wanted.most_blades < 1 || wanted.most_blades > kMostBlades)
    refusals.Add(runtime::Refuse("most_blades", request.most_blades(), "1 to 200, or 0: 100"));
  if (!refusals.status().ok()) return refusals.status();
  wanted.filter.reader = runtime::ReaderOf(context);
  return wanted;
}

absl::StatusOr<v1::Efficacy> Compute(const WantedEfficacy& wanted, const storage::Outcomes& outcomes) {
  absl::StatusOr<SortedOutcomes> sorted = SortOutcomes(outcomes);
  if (!sorted.ok()) return sorted.status();
  v1::Efficacy answer;
  answer.set_machine(runtime::NameOf("machines", wanted.filter.machine_id));
  answer.set_rule(kEfficacyRule);
  answer.set_truncated(outcomes.is_cut_off || sorted->periods.size() > kMostPeriods);
  ToProto(sorted->left_out, answer.mutable_left_out());
  for (const PeriodOutcomes& period : sorted->periods) {
    if (answer.periods_size() == kMostPeriods) break;
    const auto efficacy = metrology::AssessEfficacy(period.blades, period.axes, wanted.options);
    if (!efficacy.ok()) return efficacy.status();
    ToProto(wanted.filter.machine_id, period, *efficacy, answer.add_periods());
  }
  return answer;
}

}  // namespace

grpc::Status EfficacyService::ComputeEfficacy(grpc::ServerContext* context, const v1::ComputeEfficacyRequest* request,
                                              v1::Efficacy* response) {
  const absl::StatusOr<WantedEfficacy> wanted = Read(*request, *context);
  if (!wanted.ok()) return runtime::ToGrpc(wanted.status());
  const auto slot = running_.Enter(runtime::DeadlineOf(*context), runtime::KeepGoing(*context));
  if (!slot.ok()) return runtime::ToGrpc(slot.status());
  const auto outcomes = outcomes_->Read(wanted->filter, wanted->most_blades, runtime::DeadlineOf(*context));
  if (!outcomes.ok()) return runtime::ToGrpc(outcomes.status());
  return runtime::Answer(Compute(*wanted, *outcomes), response);
}

}  // namespace sixpoint::inspection
