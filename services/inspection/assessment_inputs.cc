#include "services/inspection/assessment_inputs.h"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include "services/inspection/deviation_messages.h"
#include "services/inspection/measurement_messages.h"
#include "services/inspection/messages.h"
#include "services/inspection/order_checks.h"
#include "services/inspection/section_messages.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_results.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::inspection {
namespace {

// Their patches are all held at once.
constexpr int kMostMapsOfBlank = 8;
constexpr char kKnown[] = "inspections/UUID, deviations/UUID, sections/UUID or measurements/UUID";

std::string CollectionOf(const std::string& name) { return name.substr(0, name.find('/')); }

// A balloon's number may mean something else in another revision.
std::string Revised(const plant::v1::Drawing& drawing) {
  return drawing.name() + "@" + std::to_string(drawing.revision());
}

absl::StatusOr<AssessedResult> FetchResult(const std::string& name, const AssessedStores& stores,
                                           const clients::BladePeers& peers, const runtime::Caller& caller) {
  AssessedResult result;
  const std::string collection = CollectionOf(name);
  if (collection == "measurements") {
    auto measurement = runtime::GetResult<v1::Measurement>(*stores.measurements, caller.deadline, collection, name,
                                                           errors::v1::MEASUREMENT_NOT_FOUND, ToProto);
    if (!measurement.ok()) return measurement.status();
    result.result = *std::move(measurement);
    result.IndexPlaces();
    return result;
  }
  std::string registration;
  const auto take = [&](auto fetched) -> absl::Status {
    if (!fetched.ok()) return fetched.status();
    registration = fetched->registration();
    result.result = *std::move(fetched);
    return absl::OkStatus();
  };
  absl::Status taken;
  if (collection == "inspections")
    taken = take(runtime::GetResult<v1::Inspection>(*stores.inspections, caller.deadline, collection, name,
                                                    errors::v1::INSPECTION_NOT_FOUND, ToProto));
  else if (collection == "deviations")
    taken = take(runtime::GetResult<v1::DeviationMap>(*stores.deviations, caller.deadline, collection, name,
                                                      errors::v1::DEVIATION_MAP_NOT_FOUND, ToProto));
  else
    taken = take(runtime::GetResult<v1::SectionMeasurement>(*stores.sections, caller.deadline, collection, name,
                                                            errors::v1::SECTION_MEASUREMENT_NOT_FOUND, ToProto));
  if (!taken.ok()) return taken;
  auto fetched = peers.registrations.Get(registration, caller.make_context());
  if (!fetched.ok()) return fetched.status();
  result.registration = *std::move(fetched);
  result.IndexPlaces();
  return result;
}

// Of the blade; all of ours measured against the CAD that the first was, all of other instruments by the drawing.
absl::Status CheckResults(const v1::AssessBladeRequest& request, const plant::v1::Drawing& drawing,
                          const std::vector<AssessedResult>& results, int part_revision) {
  runtime::Refusals refusals;
  for (std::size_t i = 0; i < results.size(); ++i) {
    const AssessedResult& result = results[i];
    const std::string field = At("results", static_cast<int>(i));
    const auto* const measurement = std::get_if<v1::Measurement>(&result.result);
    if (result.blade() != request.blade())
      refusals.Add(runtime::Refuse(field, result.name() + " of " + result.blade(), "a result of " + request.blade()));
    else if (measurement != nullptr && measurement->drawing() != Revised(drawing))
      refusals.Add(
          runtime::Refuse(field, result.name() + " by " + measurement->drawing(), "one by " + Revised(drawing)));
    else if (measurement == nullptr && result.registration.part_revision() != part_revision)
      refusals.Add(runtime::Refuse(
          field,
          result.name() + " against " + drawing.part() + "@" + std::to_string(result.registration.part_revision()),
          "one against " + drawing.part() + "@" + std::to_string(part_revision) + ", as the others"));
  }
  return refusals.status();
}

absl::Status CheckDrawing(const plant::v1::Drawing& drawing, const std::string& part, int part_revision) {
  const std::string name = Revised(drawing);
  if (drawing.part() != part) return runtime::Refuse("drawing", name + " of " + drawing.part(), "a drawing of " + part);
  const auto& valid = drawing.part_revisions();
  if (std::find(valid.begin(), valid.end(), part_revision) == valid.end())
    return runtime::Refuse("drawing", name,
                           "one that is valid for " + part + "@" + std::to_string(part_revision) +
                               ", which the results were measured against");
  return absl::OkStatus();
}

// What the results are of: of ours as their registration says, else what the drawing is valid for at last.
struct MeasuredPart {
  std::string part;
  int revision = 0;
};
MeasuredPart PartOf(const std::vector<AssessedResult>& results, const plant::v1::Drawing& drawing) {
  for (const AssessedResult& result : results)
    if (!result.registration.part().empty()) return {result.registration.part(), result.registration.part_revision()};
  const auto& valid = drawing.part_revisions();
  return {std::get<v1::Measurement>(results.front().result).part(), *std::max_element(valid.begin(), valid.end())};
}

}  // namespace

absl::Status CheckAssess(const v1::AssessBladeRequest& request) {
  runtime::Refusals refusals;
  refusals.Add(runtime::IdOf("blade", "blades", request.blade()).status())
      .Add(runtime::RevisedIdOf("drawing", "drawings", request.drawing()).status());
  if (request.results().empty())
    refusals.Add(runtime::Refuse("results", "none", std::string("at least one: ") + kKnown));
  std::set<std::string> before;
  for (int i = 0; i < request.results_size(); ++i) {
    const std::string collection = CollectionOf(request.results(i));
    static const std::set<std::string> kCollections = {"inspections", "deviations", "sections", "measurements"};
    if (kCollections.count(collection) == 0)
      refusals.Add(runtime::Refuse(At("results", i), request.results(i), kKnown));
    else
      refusals.Add(runtime::IdOf(At("results", i), collection, request.results(i)).status());
    if (!before.insert(request.results(i)).second)
      refusals.Add(runtime::Refuse(At("results", i), request.results(i), "each once"));
  }
  const auto is_map = [](const std::string& name) { return CollectionOf(name) == "deviations"; };
  if (request.stage() == v1::ASSESSMENT_STAGE_BEFORE_MACHINING &&
      std::count_if(request.results().begin(), request.results().end(), is_map) > kMostMapsOfBlank)
    refusals.Add(runtime::Refuse("results", "more than 8 deviation maps", "at most 8, of a blank"));
  if (!v1::AssessmentStage_IsValid(request.stage()) || request.stage() == v1::ASSESSMENT_STAGE_UNSPECIFIED)
    refusals.Add(runtime::Refuse("stage", std::to_string(request.stage()),
                                 "ASSESSMENT_STAGE_BEFORE_MACHINING or ASSESSMENT_STAGE_MACHINED"));
  return refusals.status();
}

absl::StatusOr<AssessmentInputs> FetchAssessed(const v1::AssessBladeRequest& request, const AssessedStores& stores,
                                               const clients::BladePeers& peers, const runtime::Caller& caller) {
  AssessmentInputs inputs;
  inputs.stage = request.stage();
  for (const std::string& name : request.results()) {
    auto result = FetchResult(name, stores, peers, caller);
    if (!result.ok()) return result.status();
    inputs.results.push_back(*std::move(result));
  }
  auto drawing = peers.plant.GetDrawing(request.drawing(), caller.make_context());
  if (!drawing.ok()) return drawing.status();
  inputs.drawing = *std::move(drawing);
  const MeasuredPart measured = PartOf(inputs.results, inputs.drawing);
  if (absl::Status same = CheckResults(request, inputs.drawing, inputs.results, measured.revision); !same.ok())
    return same;
  if (absl::Status valid = CheckDrawing(inputs.drawing, measured.part, measured.revision); !valid.ok()) return valid;
  auto part = peers.plant.GetPart(measured.part, measured.revision, caller.make_context());
  if (!part.ok()) return part.status();
  inputs.part = *std::move(part);
  if (request.stage() != v1::ASSESSMENT_STAGE_BEFORE_MACHINING) return inputs;
  for (std::size_t i = 0; i < inputs.results.size(); ++i) {
    if (!std::holds_alternative<v1::DeviationMap>(inputs.results[i].result)) continue;
    auto patches = stores.deviations->Patches(runtime::LastSegment(inputs.results[i].name()), caller.deadline);
    if (!patches.ok()) return patches.status();
    if (patches->has_value()) inputs.patches[static_cast<int>(i)] = **std::move(patches);
  }
  return inputs;
}

}  // namespace sixpoint::inspection
