#include "services/inspection/report_fetch.h"

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "services/inspection/assessment_messages.h"
#include "services/inspection/deviation_drawing.h"
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

constexpr std::size_t kMostReportedResults = 64;
constexpr char kKinds[] = "inspections/, deviations/ or sections/ and a UUID, or one of assessments/";

bool IsInCollection(const std::string& name, const char* collection) { return name.rfind(collection, 0) == 0; }

// Appends them, each once.
class Names {
 public:
  void Add(const std::string& name) {
    if (!name.empty() && seen_.insert(name).second) all_.push_back(name);
  }
  const std::vector<std::string>& all() const { return all_; }

 private:
  std::set<std::string> seen_;
  std::vector<std::string> all_;
};

class Fetch {
 public:
  Fetch(const ReportSources& sources, const clients::BladePeers& peers, const runtime::Caller& caller,
        ReportInputs* inputs)
      : sources_(sources), peers_(peers), caller_(caller), inputs_(*inputs) {}

  absl::Status Results(const ResultNames& results) {
    for (std::size_t i = 0; i < results.size(); ++i)
      if (absl::Status status = Result(At("results", static_cast<int>(i)), results[i]); !status.ok()) return status;
    std::size_t section_count = 0;
    for (const v1::SectionMeasurement& measurement : inputs_.sections)
      section_count += static_cast<std::size_t>(measurement.sections_size());
    if (section_count <= report::kMostSections) return absl::OkStatus();
    return runtime::Refuse("results", std::to_string(section_count) + " sections",
                           std::to_string(report::kMostSections) + " at most");
  }

  absl::Status Registrations() {
    for (const ResultHead& head : HeadsOf(inputs_)) {
      registrations_.Add(head.registration);
      for (const std::string& scan : head.scans) scans_.Add(scan);
    }
    for (const std::string& name : registrations_.all()) {
      auto registration = peers_.registrations.Get(name, caller_.make_context());
      if (!registration.ok()) return registration.status();
      Take(*registration);
      inputs_.registrations.push_back(*std::move(registration));
    }
    return OnePart();
  }

  absl::Status Equipment() {
    for (const auto& [name, revision] : machines_) {
      auto machine = peers_.plant.GetMachine(name, revision, caller_.make_context());
      if (!machine.ok()) return machine.status();
      inputs_.machines.push_back(*std::move(machine));
    }
    for (const std::string& name : calibrations_.all()) {
      auto calibration = peers_.calibrations.Get(name, caller_.make_context());
      if (!calibration.ok()) return calibration.status();
      inputs_.calibrations.push_back(*std::move(calibration));
    }
    for (const std::string& name : scans_.all()) {
      auto scan = peers_.scans.Get(name, caller_.make_context());
      if (!scan.ok()) return scan.status();
      inputs_.scans.push_back(*std::move(scan));
    }
    return absl::OkStatus();
  }

  absl::Status Outlines() {
    for (const v1::SectionMeasurement& measurement : inputs_.sections) {
      const auto rows = sources_.sections->Outlines(runtime::LastSegment(measurement.name()), caller_.deadline);
      if (!rows.ok()) return rows.status();
      if (rows->size() != static_cast<std::size_t>(measurement.sections_size()))
        return absl::DataLossError(measurement.name() + ": outlines of " + std::to_string(rows->size()) +
                                   " sections, want " + std::to_string(measurement.sections_size()));
      std::vector<v1::SectionOutline>& outlines = inputs_.outlines.emplace_back();
      for (std::size_t i = 0; i < rows->size(); ++i)
        outlines.push_back(ToProto(measurement.sections(static_cast<int>(i)).plane().section(), (*rows)[i]));
    }
    return absl::OkStatus();
  }

  // Of the first maps.
  absl::Status Pictures() {
    if (inputs_.maps.empty()) {
      inputs_.no_picture_reason = "No deviation map is among the results.";
      return absl::OkStatus();
    }
    const auto surface = peers_.plant.GetSurface(inputs_.part, caller_.make_context(), caller_.keep_going);
    if (!surface.ok()) return surface.status();
    for (std::size_t i = 0; i < std::min(inputs_.maps.size(), report::kMostPicturedMaps); ++i) {
      const v1::DeviationMap& map = inputs_.maps[i];
      const auto patches = sources_.deviations->Patches(runtime::LastSegment(map.name()), caller_.deadline);
      if (!patches.ok()) return patches.status();
      if (!patches->has_value()) return absl::DataLossError(map.name() + ": no patches, want those of its surface");
      auto picture = DrawMap(**surface, map, (*patches)->means_um);
      // A surface that cannot be drawn is no reason to tell nothing of it.
      if (absl::IsInvalidArgument(picture.status())) {
        inputs_.no_picture_reason = "It cannot be drawn: " + std::string(picture.status().message());
        return absl::OkStatus();
      }
      if (!picture.ok()) return picture.status();
      inputs_.pictures.push_back(*std::move(picture));
    }
    return absl::OkStatus();
  }

 private:
  absl::Status Result(const std::string& field, const std::string& name) {
    // Its values stand in the assessment's findings; whose they are is told with them.
    if (IsInCollection(name, "measurements/")) return Keep(field, FindMeasurement(name), &inputs_.measurements);
    if (IsInCollection(name, "inspections/"))
      return Keep(field,
                  Find<v1::Inspection>(*sources_.inspections, "inspections", name, errors::v1::INSPECTION_NOT_FOUND),
                  &inputs_.inspections);
    if (IsInCollection(name, "deviations/"))
      return Keep(field,
                  Find<v1::DeviationMap>(*sources_.deviations, "deviations", name, errors::v1::DEVIATION_MAP_NOT_FOUND),
                  &inputs_.maps);
    return Keep(
        field,
        Find<v1::SectionMeasurement>(*sources_.sections, "sections", name, errors::v1::SECTION_MEASUREMENT_NOT_FOUND),
        &inputs_.sections);
  }

  absl::StatusOr<v1::Measurement> FindMeasurement(const std::string& name) const {
    return Find<v1::Measurement>(*sources_.measurements, "measurements", name, errors::v1::MEASUREMENT_NOT_FOUND);
  }

  template <typename Message, typename Row, typename Filter>
  absl::StatusOr<Message> Find(const storage::ResultReader<Row, Filter>& reader, const char* collection,
                               const std::string& name, errors::v1::ErrorReason reason) const {
    return runtime::GetResult<Message>(reader, caller_.deadline, collection, name, reason, ToProto);
  }

  // Of the same blade as those before.
  template <typename Message>
  absl::Status Keep(const std::string& field, absl::StatusOr<Message> result, std::vector<Message>* all) {
    if (!result.ok()) return result.status();
    if (blade_.empty()) blade_ = result->blade();
    if (result->blade() != blade_)
      return runtime::Refuse(field, result->name() + " of " + result->blade(), "a result of " + blade_);
    all->push_back(*std::move(result));
    return absl::OkStatus();
  }

  void Take(const registration::v1::Registration& registration) {
    const std::pair<std::string, int> machine(registration.machine(), registration.machine_revision());
    if (std::find(machines_.begin(), machines_.end(), machine) == machines_.end()) machines_.push_back(machine);
    calibrations_.Add(registration.sensor_calibration());
    calibrations_.Add(registration.rotation_calibration());
    for (const registration::v1::ScanAngle& angle : registration.angles()) calibrations_.Add(angle.characterisation());
    for (const std::string& scan : registration.scans()) scans_.Add(scan);
  }

  absl::Status OnePart() {
    const auto part_of = [](const registration::v1::Registration& registration) {
      return registration.part() + "@" + std::to_string(registration.part_revision());
    };
    std::string name = inputs_.assessment ? inputs_.assessment->part() : "";
    int revision = inputs_.assessment ? inputs_.assessment->part_revision() : 0;
    for (const registration::v1::Registration& registration : inputs_.registrations) {
      if (name.empty()) name = registration.part(), revision = registration.part_revision();
      if (registration.part() != name || registration.part_revision() != revision)
        return runtime::Refuse("results", "one by " + registration.name() + " against " + part_of(registration),
                               "all against " + name + "@" + std::to_string(revision));
    }
    auto part = peers_.plant.GetPart(name, revision, caller_.make_context());
    if (!part.ok()) return part.status();
    inputs_.part = *std::move(part);
    return absl::OkStatus();
  }

  const ReportSources& sources_;
  const clients::BladePeers& peers_;
  const runtime::Caller& caller_;
  ReportInputs& inputs_;
  std::string blade_;
  Names registrations_, calibrations_, scans_;
  std::vector<std::pair<std::string, int>> machines_;
};

}  // namespace

FindAssessment AssessmentsOf(
    std::shared_ptr<const storage::ResultReader<storage::AssessmentRow, storage::AssessmentFilter>> reader) {
  return [reader = std::move(reader)](const std::string& name, storage::Deadline deadline) {
    return runtime::GetResult<v1::Assessment>(*reader, deadline, "assessments", name, errors::v1::ASSESSMENT_NOT_FOUND,
                                              ToProto);
  };
}

absl::Status CheckResults(const ResultNames& results) {
  if (results.empty()) return runtime::Refuse("results", "0", "1 to 64 of one blade");
  if (results.size() > kMostReportedResults)
    return runtime::Refuse("results", std::to_string(results.size()), "1 to 64 of one blade");
  runtime::Refusals refusals;
  std::set<std::string> seen;
  for (std::size_t i = 0; i < results.size(); ++i) {
    const std::string& name = results[i];
    const std::string field = At("results", static_cast<int>(i));
    const std::string collection = name.substr(0, name.find('/'));
    const bool is_assessment = collection == "assessments";
    if (!is_assessment && collection != "inspections" && collection != "deviations" && collection != "sections")
      refusals.Add(runtime::Refuse(field, name, kKinds));
    else if (absl::Status status = runtime::IdOf(field, collection, name).status(); !status.ok())
      refusals.Add(status);
    else if (is_assessment && results.size() > 1)
      refusals.Add(runtime::Refuse(field, name, "it alone: it names its results"));
    else if (!seen.insert(name).second)
      refusals.Add(runtime::Refuse(field, name, "each once"));
  }
  return refusals.status();
}

absl::StatusOr<ReportInputs> FetchReport(const ReportSources& sources, const clients::BladePeers& peers,
                                         const ResultNames& results, const runtime::Caller& caller) {
  ReportInputs inputs;
  Fetch fetch(sources, peers, caller, &inputs);
  const bool is_assessed = IsInCollection(results.front(), "assessments/");
  if (is_assessed) {
    auto assessment = sources.assessment(results.front(), caller.deadline);
    if (!assessment.ok()) return assessment.status();
    auto drawing = peers.plant.GetDrawing(assessment->drawing(), caller.make_context());
    if (!drawing.ok()) return drawing.status();
    inputs.assessment = *std::move(assessment);
    inputs.drawing = *std::move(drawing);
  }
  const auto named = [&] {
    return ResultNames(inputs.assessment->results().begin(), inputs.assessment->results().end());
  };
  absl::Status status = fetch.Results(is_assessed ? named() : results);
  if (status.ok()) status = fetch.Registrations();
  if (status.ok()) status = fetch.Equipment();
  if (status.ok()) status = fetch.Outlines();
  if (status.ok()) status = fetch.Pictures();
  if (!status.ok()) return status;
  return inputs;
}

}  // namespace sixpoint::inspection
