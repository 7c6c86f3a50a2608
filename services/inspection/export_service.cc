#include "services/inspection/export_service.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "exchange/aqdef.h"
#include "exchange/csv.h"
#include "exchange/qif.h"
#include "services/inspection/exported.h"
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

constexpr int kMostResults = 1000;                    // of inspections, and of maps
constexpr std::size_t kMostValues = 400'000;          // of all of them: what an answer holds in memory
constexpr std::size_t kChunk = std::size_t{1} << 20;  // bytes
constexpr int kPage = 50;

absl::Status TooMany() {
  return runtime::Refuse("recorded", "more than " + std::to_string(kMostResults) + " results",
                         "a part, a machine or a time with fewer of them");
}

// The row's machine, each revision fetched once.
class Machines {
 public:
  Machines(const Peers& peers, const runtime::Caller& caller) : peers_(peers), caller_(caller) {}

  absl::StatusOr<const plant::v1::Machine*> Of(const std::string& id, int revision) {
    const auto known = known_.find({id, revision});
    if (known != known_.end()) return &known->second;
    auto machine = peers_.plant.GetMachine(runtime::NameOf("machines", id), revision, caller_.make_context());
    if (!machine.ok()) return machine.status();
    return &known_.emplace(std::pair(id, revision), *std::move(machine)).first->second;
  }

 private:
  const Peers& peers_;
  const runtime::Caller& caller_;
  std::map<std::pair<std::string, int>, plant::v1::Machine> known_;
};

InspectedPart PartOf(const storage::InspectionRow& row, const plant::v1::Machine* machine) {
  return Exported(row, machine);
}
std::optional<InspectedPart> PartOf(const storage::DeviationMapRow& row, const plant::v1::Machine* machine) {
  return Exported(row, machine);
}

// All of the filter's rows that have something to tell, the newest first.
template <typename Row, typename Filter>
absl::Status Collect(const storage::ResultReader<Row, Filter>& reader, const Filter& filter, bool only_newest,
                     const runtime::Caller& caller, Machines* machines, std::vector<InspectedPart>* parts) {
  std::set<std::string> seen;
  int count = 0;
  for (std::int64_t before = 0;;) {
    if (!caller.keep_going()) return absl::CancelledError("export: the caller is gone or its time is over");
    const absl::StatusOr<std::vector<Row>> rows = reader.List(filter, before, kPage, caller.deadline);
    if (!rows.ok()) return rows.status();
    for (const Row& row : *rows) {
      before = row.recorded.sequence;
      if (only_newest && seen.count(row.blade_serial) > 0) continue;
      const auto machine = machines->Of(row.machine_id, row.machine_revision);
      if (!machine.ok()) return machine.status();
      std::optional<InspectedPart> part = PartOf(row, *machine);
      if (!part) continue;
      seen.insert(row.blade_serial);
      parts->push_back(*std::move(part));
      if (++count > kMostResults) return TooMany();
    }
    if (rows->size() < kPage) return absl::OkStatus();
  }
}

class Writer {
 public:
  explicit Writer(grpc::ServerWriter<v1::ExportResultsResponse>* writer) : writer_(writer) {}
  // In pieces; an empty one tells of an empty file.
  absl::Status Write(const std::string& file, const std::string& content) {
    for (std::size_t at = 0; at == 0 || at < content.size(); at += kChunk) {
      v1::ExportResultsResponse response;
      response.set_file(file);
      response.set_content(content.substr(at, kChunk));
      if (!writer_->Write(response)) return absl::CancelledError("export: the client went away");
    }
    return absl::OkStatus();
  }

 private:
  grpc::ServerWriter<v1::ExportResultsResponse>* const writer_;
};

std::string RevisedPart(const InspectedPart& part) { return part.part + "@" + std::to_string(part.part_revision); }

absl::Status WriteQif(const std::vector<InspectedPart>& parts, Writer* writer) {
  std::set<std::string> planned;
  for (const InspectedPart& part : parts) {
    // Inspections and maps have other characteristics, each with a plan of its own.
    const std::string plan_id = exchange::QifPlanId(part);
    if (planned.insert(plan_id).second) {
      const auto plan = exchange::QifPlanOf(part);
      if (!plan.ok()) return plan.status();
      const std::string file = RevisedPart(part) + "_plan_" + plan_id.substr(0, 8) + ".qif";
      if (absl::Status sent = writer->Write(file, *plan); !sent.ok()) return sent;
    }
    const auto document = exchange::ToQif(part);
    if (!document.ok()) return document.status();
    const absl::Status sent = writer->Write(part.serial + "_" + runtime::LastSegment(part.result) + ".qif", *document);
    if (!sent.ok()) return sent;
  }
  return absl::OkStatus();
}

// Of each part revision, and of inspections and maps apart: a file's values all have the same characteristics.
absl::Status WriteAqdef(std::vector<InspectedPart> parts, Writer* writer) {
  while (!parts.empty()) {
    const auto same = [first = parts.front()](const InspectedPart& other) {
      return exchange::SameCharacteristics(first, other);
    };
    const auto rest = std::stable_partition(parts.begin(), parts.end(), same);
    const std::vector<InspectedPart> together(parts.begin(), rest);
    const auto text = exchange::ToAqdef(together);
    if (!text.ok()) return text.status();
    const std::string file =
        RevisedPart(together.front()) + "_" + runtime::LastSegment(together.front().result) + ".dfq";
    if (absl::Status sent = writer->Write(file, *text); !sent.ok()) return sent;
    parts.erase(parts.begin(), rest);
  }
  return absl::OkStatus();
}

absl::Status WriteCsv(const std::vector<InspectedPart>& parts, Writer* writer) {
  if (absl::Status sent = writer->Write("results.csv", exchange::CsvHead()); !sent.ok()) return sent;
  for (const InspectedPart& part : parts)
    if (absl::Status sent = writer->Write("results.csv", exchange::ToCsv(part)); !sent.ok()) return sent;
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
                             std::shared_ptr<storage::DeviationStore> deviations, std::shared_ptr<const Peers> peers)
    : inspections_(std::move(inspections)),
      deviations_(std::move(deviations)),
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
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto slot = running_.Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return ToGrpc(slot.status());
  std::vector<InspectedPart> parts;
  Machines machines(*peers_, caller);
  const storage::ResultReader<storage::InspectionRow, storage::InspectionFilter>& rows = *inspections_;
  absl::Status status = Collect(rows, *of_inspections, request->only_newest(), caller, &machines, &parts);
  const storage::ResultReader<storage::DeviationMapRow, storage::DeviationFilter>& maps = *deviations_;
  if (status.ok()) status = Collect(maps, *of_maps, request->only_newest(), caller, &machines, &parts);
  std::size_t value_count = 0;
  for (const InspectedPart& part : parts) value_count += part.values.size();
  if (status.ok() && value_count > kMostValues) status = TooMany();
  Writer pieces(writer);
  if (status.ok() && request->format() == v1::EXPORT_FORMAT_QIF) status = WriteQif(parts, &pieces);
  if (status.ok() && request->format() == v1::EXPORT_FORMAT_AQDEF) status = WriteAqdef(std::move(parts), &pieces);
  if (status.ok() && request->format() == v1::EXPORT_FORMAT_CSV) status = WriteCsv(parts, &pieces);
  return ToGrpc(status);
}

}  // namespace sixpoint::inspection
