#include "services/inspection/export_service.h"

#include <algorithm>
#include <functional>
#include <future>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "exchange/aqdef.h"
#include "exchange/csv.h"
#include "exchange/qif.h"
#include "services/inspection/exported.h"
#include "services/inspection/file_pieces.h"
#include "services/inspection/profile_points.h"
#include "services/inspection/stored_verdict.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/list_filters.h"
#include "services/runtime/recorded_results.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::inspection {
namespace {

using exchange::InspectedPart;
using runtime::ToGrpc;

constexpr int kMostExportedResults = 5000;            // of inspections, and of maps
constexpr std::size_t kMostExportedValues = 400'000;  // of all of them: what an answer holds in memory
// Of profiles: what a client holds of an answer that may begin anew.
constexpr std::size_t kMostExportedPoints = 1'000'000;

absl::Status TooMany() {
  return runtime::Refuse("recorded", "more than " + std::to_string(kMostExportedResults) + " results",
                         "a part, a machine or a time with fewer of them");
}

// The row's machine, each revision fetched once.
class Machines {
 public:
  Machines(const clients::BladePeers& peers, const runtime::Caller& caller) : peers_(peers), caller_(caller) {}

  // Null where there is none.
  absl::StatusOr<const plant::v1::Machine*> Of(const std::string& id, int revision) {
    if (id.empty()) return nullptr;
    const auto known = known_.find({id, revision});
    if (known != known_.end()) return &known->second;
    auto machine = peers_.plant.GetMachine(runtime::NameOf("machines", id), revision, caller_.make_context());
    if (!machine.ok()) return machine.status();
    return &known_.emplace(std::pair(id, revision), *std::move(machine)).first->second;
  }

 private:
  const clients::BladePeers& peers_;
  const runtime::Caller& caller_;
  std::map<std::pair<std::string, int>, plant::v1::Machine> known_;
};

using TakePart = std::function<absl::Status(InspectedPart part)>;
template <typename Row>
using TakeOf = std::function<absl::Status(const Row& row, InspectedPart part)>;

// All of the filter's rows that have something to tell, the newest first. The next page is read meanwhile.
template <typename Row, typename Filter>
absl::Status ForEach(const storage::ResultReader<Row, Filter>& reader, Filter filter, bool only_newest,
                     const runtime::Caller& caller, Machines* machines, const TakeOf<Row>& take) {
  using Page = absl::StatusOr<std::vector<Row>>;
  // Of a blade's results the newest is looked for first: an older one that has the verdict does not stand for it.
  const std::string verdict = only_newest ? std::exchange(filter.verdict, "") : "";
  const auto read = [&](std::int64_t before) { return reader.List(filter, before, kExportPage, caller.deadline); };
  std::future<Page> next = std::async(std::launch::async, read, 0);
  std::set<std::string> seen;
  int count = 0;
  while (next.valid()) {
    const Page rows = next.get();
    if (!rows.ok()) return rows.status();
    if (!caller.keep_going()) return absl::CancelledError("export: the caller is gone or its time is over");
    if (rows->size() == kExportPage) next = std::async(std::launch::async, read, rows->back().recorded.sequence);
    for (const Row& row : *rows) {
      if (only_newest && seen.count(row.blade_serial) > 0) continue;
      const auto machine = machines->Of(row.machine_id, row.machine_revision);
      if (!machine.ok()) return machine.status();
      ExportedPart part = Exported(row, *machine);
      if (!part.ok()) return part.status();
      if (!part->has_value()) continue;
      seen.insert(row.blade_serial);
      if (!verdict.empty() && row.verdict != verdict) continue;
      if (++count > kMostExportedResults) return TooMany();
      if (absl::Status taken = take(row, **std::move(part)); !taken.ok()) return taken;
    }
  }
  return absl::OkStatus();
}

using Files = FilesOnTheirWay<v1::ExportResultsResponse>;

std::string RevisedPart(const InspectedPart& part) { return part.part + "@" + std::to_string(part.part_revision); }

// The plan of each before its first result. Results of one revision mostly follow each other.
TakePart QifInto(Files* files) {
  struct Plans {
    std::set<std::string> sent;
    std::optional<exchange::QifPlan> last;
  };
  const auto plans = std::make_shared<Plans>();
  return [files, plans](const InspectedPart& part) {
    if (!plans->last || !plans->last->IsOf(part)) {
      auto plan = exchange::QifPlan::Of(part);
      if (!plan.ok()) return plan.status();
      plans->last = *std::move(plan);
    }
    const exchange::QifPlan& plan = *plans->last;
    // Inspections and maps have other characteristics, each with a plan of its own.
    if (plans->sent.insert(plan.id()).second) {
      const std::string file = RevisedPart(part) + "_plan_" + plan.id().substr(0, 8) + ".qif";
      if (absl::Status sent = files->Write(file, plan.PlanDocument()); !sent.ok()) return sent;
    }
    auto document = plan.ResultDocument(part);
    if (!document.ok()) return document.status();
    return files->Write(part.serial + "_" + runtime::LastSegment(part.result) + ".qif", *std::move(document));
  };
}

// Each profile of the maps with its points, before they are taken.
class WithPoints {
 public:
  WithPoints(const storage::DeviationStore& store, const runtime::Caller& caller, const TakePart& take)
      : store_(store), caller_(caller), take_(take) {}

  absl::Status operator()(const storage::DeviationMapRow& map, InspectedPart part) {
    const auto patches = store_.Patches(map.deviation_id, caller_.deadline);
    if (!patches.ok()) return patches.status();
    if (!patches->has_value()) return absl::DataLossError(part.result + ": no patches, want those of its surface");
    for (std::size_t i = 0; i < part.values.size(); ++i) {
      if (!part.values[i].value) continue;
      auto points = ProfilePoints(map, map.profiles[i], **patches);
      if (!points.ok()) return points.status();
      if ((count_ += points->size()) > kMostExportedPoints)
        return runtime::Refuse("deviation_points", "more than " + std::to_string(kMostExportedPoints) + " points",
                               "a blade or a time with fewer of them");
      part.values[i].points = *std::move(points);
    }
    return take_(std::move(part));
  }

 private:
  const storage::DeviationStore& store_;
  const runtime::Caller& caller_;
  const TakePart& take_;
  std::size_t count_ = 0;
};

TakePart CsvInto(Files* files) {
  return [files](const InspectedPart& part) { return files->Write("results.csv", exchange::ToCsv(part)); };
}

TakePart Into(std::vector<InspectedPart>* parts) {
  const auto value_count = std::make_shared<std::size_t>(0);
  return [parts, value_count](InspectedPart part) {
    *value_count += part.values.size();
    parts->push_back(std::move(part));
    return *value_count > kMostExportedValues ? TooMany() : absl::OkStatus();
  };
}

// Of each part revision, and of inspections and maps apart: a file's values all have the same characteristics.
absl::Status WriteAqdef(std::vector<InspectedPart> parts, Files* files) {
  while (!parts.empty()) {
    const auto same = [first = parts.front()](const InspectedPart& other) {
      return exchange::SameCharacteristics(first, other);
    };
    const auto rest = std::stable_partition(parts.begin(), parts.end(), same);
    const std::vector<InspectedPart> together(std::make_move_iterator(parts.begin()), std::make_move_iterator(rest));
    auto text = exchange::ToAqdef(together);
    if (!text.ok()) return text.status();
    const std::string file =
        RevisedPart(together.front()) + "_" + runtime::LastSegment(together.front().result) + ".dfq";
    if (absl::Status sent = files->Write(file, *std::move(text)); !sent.ok()) return sent;
    parts.erase(parts.begin(), rest);
  }
  return absl::OkStatus();
}

template <typename Filter>
absl::StatusOr<Filter> FilterOf(const v1::ExportResultsRequest& request, const grpc::ServerContext& context) {
  Filter filter;
  if (absl::Status status = runtime::ReadFilter(request, &filter); !status.ok()) return status;
  absl::StatusOr<std::string> verdict = VerdictFilterOf(request.verdict());
  if (!verdict.ok()) return verdict.status();
  filter.verdict = *std::move(verdict);
  filter.reader = runtime::ReaderOf(context);
  return filter;
}

}  // namespace

ExportService::ExportService(std::shared_ptr<storage::InspectionStore> inspections,
                             std::shared_ptr<storage::DeviationStore> deviations,
                             std::shared_ptr<storage::AssessmentStore> assessments,
                             std::shared_ptr<const clients::BladePeers> peers)
    : inspections_(std::move(inspections)),
      deviations_(std::move(deviations)),
      assessments_(std::move(assessments)),
      peers_(std::move(peers)),
      running_({2, 32}, "exports", errors::v1::DOWNLOADS_FULL) {}

grpc::Status ExportService::ExportResults(grpc::ServerContext* context, const v1::ExportResultsRequest* request,
                                          grpc::ServerWriter<v1::ExportResultsResponse>* writer) {
  if (request->format() == v1::EXPORT_FORMAT_UNSPECIFIED || !v1::ExportFormat_IsValid(request->format()))
    return ToGrpc(runtime::Refuse("format", v1::ExportFormat_Name(request->format()),
                                  "EXPORT_FORMAT_QIF, EXPORT_FORMAT_AQDEF or EXPORT_FORMAT_CSV"));
  const auto of_inspections = FilterOf<storage::InspectionFilter>(*request, *context);
  if (!of_inspections.ok()) return ToGrpc(of_inspections.status());
  const auto of_maps = FilterOf<storage::DeviationFilter>(*request, *context);
  if (!of_maps.ok()) return ToGrpc(of_maps.status());
  const auto of_assessments = FilterOf<storage::AssessmentFilter>(*request, *context);
  if (!of_assessments.ok()) return ToGrpc(of_assessments.status());
  if (request->deviation_points() && (request->format() != v1::EXPORT_FORMAT_QIF || request->assessments()))
    return ToGrpc(runtime::Refuse("deviation_points", "true", "false, unless maps are written as EXPORT_FORMAT_QIF"));
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto slot = running_.Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return ToGrpc(slot.status());
  Files files(writer);
  std::vector<InspectedPart> parts;
  const bool as_csv = request->format() == v1::EXPORT_FORMAT_CSV,
             as_aqdef = request->format() == v1::EXPORT_FORMAT_AQDEF;
  const TakePart take = as_csv ? CsvInto(&files) : as_aqdef ? Into(&parts) : QifInto(&files);
  Machines machines(*peers_, caller);
  const storage::ResultReader<storage::InspectionRow, storage::InspectionFilter>& inspections = *inspections_;
  const storage::ResultReader<storage::DeviationMapRow, storage::DeviationFilter>& maps = *deviations_;
  const storage::ResultReader<storage::AssessmentRow, storage::AssessmentFilter>& assessments = *assessments_;
  const bool only_newest = request->only_newest();
  absl::Status status = as_csv ? files.Write("results.csv", exchange::CsvHead()) : absl::OkStatus();
  const auto plainly = [&take](const auto&, InspectedPart part) { return take(std::move(part)); };
  const TakeOf<storage::DeviationMapRow> take_map =
      request->deviation_points() ? TakeOf<storage::DeviationMapRow>(WithPoints(*deviations_, caller, take)) : plainly;
  if (status.ok() && request->assessments())
    status = ForEach<storage::AssessmentRow>(assessments, *of_assessments, only_newest, caller, &machines, plainly);
  if (status.ok() && !request->assessments())
    status = ForEach<storage::InspectionRow>(inspections, *of_inspections, only_newest, caller, &machines, plainly);
  if (status.ok() && !request->assessments())
    status = ForEach<storage::DeviationMapRow>(maps, *of_maps, only_newest, caller, &machines, take_map);
  if (status.ok() && as_aqdef) status = WriteAqdef(std::move(parts), &files);
  const absl::Status sent = files.Finish();
  return ToGrpc(status.ok() ? sent : status);
}

}  // namespace sixpoint::inspection
