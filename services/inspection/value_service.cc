#include "services/inspection/value_service.h"

#include <algorithm>
#include <string>
#include <tuple>
#include <utility>

#include "services/inspection/stored_verdict.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/list_filters.h"
#include "services/runtime/pages.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/stored_enum.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::inspection {
namespace {

using runtime::ToGrpc;

constexpr int kMostPageValues = 10'000;  // of a page, but for the last inspection's: some 2 MB
constexpr char kPosition[] = "position", kInclination[] = "inclination";

// What is asked for, and how to say it.
struct WantedValues {
  storage::ValueFilter filter;
  bool position = true, inclination = true;
  runtime::Page page;
};

// "group/hole", with /position, /inclination or neither.
absl::Status ReadCharacteristic(const std::string& text, WantedValues* wanted) {
  if (text.empty()) return absl::OkStatus();
  const std::size_t first = text.find('/'), second = text.find('/', first + 1);
  const bool has_hole = first != std::string::npos && first > 0 && first + 1 < std::min(second, text.size());
  const std::string kind = second == std::string::npos ? "" : text.substr(second + 1);
  const bool is_known = second == std::string::npos || kind == kPosition || kind == kInclination;
  if (!has_hole || !is_known)
    return runtime::Refuse("characteristic", text, "group/hole/position, group/hole/inclination or group/hole");
  wanted->filter.group_name = text.substr(0, first);
  wanted->filter.hole_name = text.substr(first + 1, second == std::string::npos ? second : second - first - 1);
  wanted->position = kind != kInclination;
  wanted->inclination = kind != kPosition;
  return absl::OkStatus();
}

absl::StatusOr<WantedValues> Read(const v1::ListValuesRequest& request, const grpc::ServerContext& context) {
  WantedValues wanted;
  runtime::Refusals refusals;
  storage::ValueFilter& filter = wanted.filter;
  for (const auto& [field, collection, name, id] :
       {std::tuple("blade", "blades", &request.blade(), &filter.blade_serial),
        std::tuple("machine", "machines", &request.machine(), &filter.machine_id),
        std::tuple("part", "parts", &request.part(), &filter.part_id),
        std::tuple("calibration", "calibrations", &request.calibration(), &filter.calibration_id)}) {
    absl::StatusOr<std::string> read = runtime::FilterIdOf(field, collection, *name);
    refusals.Add(read.status());
    if (read.ok()) *id = *std::move(read);
  }
  refusals.Add(ReadCharacteristic(request.characteristic(), &wanted));
  const absl::StatusOr<storage::TimeSpan> recorded = runtime::SpanOf("recorded", request.recorded());
  refusals.Add(recorded.status());
  if (recorded.ok()) filter.recorded = *recorded;
  absl::StatusOr<std::string> verdict = VerdictFilterOf(request.verdict());
  refusals.Add(verdict.status());
  const absl::StatusOr<runtime::Page> page =
      runtime::PageOf(runtime::FiltersOf(request), request.page_size(), request.page_token());
  refusals.Add(page.status());
  if (!refusals.status().ok()) return refusals.status();
  filter.verdict = *std::move(verdict);
  filter.serial_prefix = request.serial_prefix();
  filter.only_newest = request.only_newest();
  filter.reader = runtime::ReaderOf(context);
  wanted.page = *page;
  // A part has hundreds of holes, and a message its bounds.
  if (request.characteristic().empty()) wanted.page.size = std::min(wanted.page.size, runtime::kGreatestFullPageSize);
  return wanted;
}

// What both characteristics of a hole have in common.
absl::StatusOr<v1::Value> Begin(const storage::HoleValuesRow& row, const char* kind, const std::string& verdict) {
  v1::Value value;
  const absl::StatusOr<v1::Verdict> of_value = VerdictOf(verdict, "inspection " + row.inspection_id);
  if (!of_value.ok()) return of_value.status();
  const auto method = runtime::StoredEnum<registration::v1::Method>(row.method, "inspection " + row.inspection_id);
  if (!method.ok()) return method.status();
  value.set_blade(runtime::NameOf("blades", row.blade_serial));
  value.set_characteristic(row.group_name + "/" + row.hole_name + "/" + kind);
  value.set_nominal(0);
  value.set_verdict(*of_value);
  value.set_method(*method);
  value.set_inspection(runtime::NameOf("inspections", row.inspection_id));
  value.set_machine(runtime::RevisedName("machines", row.machine_id, row.machine_revision));
  value.set_part(runtime::RevisedName("parts", row.part_id, row.part_revision));
  runtime::ToProto(row.recorded_at, value.mutable_recorded_at());
  value.set_record_sequence(row.sequence);
  return value;
}

absl::Status AddValues(const WantedValues& wanted, const storage::HoleValuesRow& row,
                       google::protobuf::RepeatedPtrField<v1::Value>* out) {
  if (wanted.position) {
    auto value = Begin(row, kPosition, row.position_verdict);
    if (!value.ok()) return value.status();
    value->set_unit("mm");
    if (row.position_error_mm) value->set_value(*row.position_error_mm);
    if (row.position_expanded_uncertainty_um)
      value->set_expanded_uncertainty(*row.position_expanded_uncertainty_um / 1e3);
    value->set_upper_limit(row.position_tolerance_mm);
    *out->Add() = *std::move(value);
  }
  if (wanted.inclination) {
    auto value = Begin(row, kInclination, row.inclination_verdict);
    if (!value.ok()) return value.status();
    value->set_unit("deg");
    if (row.inclination_error_deg) value->set_value(*row.inclination_error_deg);
    if (row.inclination_expanded_uncertainty_deg)
      value->set_expanded_uncertainty(*row.inclination_expanded_uncertainty_deg);
    value->set_upper_limit(row.inclination_tolerance_deg);
    *out->Add() = *std::move(value);
  }
  return absl::OkStatus();
}

// The page, and the sequence below which the next begins; 0: there is none.
absl::StatusOr<std::int64_t> AddPage(const storage::ValueReader& values, const WantedValues& wanted,
                                     storage::Deadline deadline, google::protobuf::RepeatedPtrField<v1::Value>* out) {
  // One inspection more than asked tells whether there is another page.
  const auto rows = values.Values(wanted.filter, wanted.page.before_sequence, wanted.page.size + 1, deadline);
  if (!rows.ok()) return rows.status();
  int inspection_count = 0;
  std::int64_t last_sequence = 0;
  for (const storage::HoleValuesRow& row : *rows) {
    if (row.sequence != last_sequence && (++inspection_count > wanted.page.size || out->size() >= kMostPageValues))
      return last_sequence;
    last_sequence = row.sequence;
    if (absl::Status added = AddValues(wanted, row, out); !added.ok()) return added;
  }
  return 0;
}

}  // namespace

grpc::Status ValueService::ListValues(grpc::ServerContext* context, const v1::ListValuesRequest* request,
                                      v1::ListValuesResponse* response) {
  const absl::StatusOr<WantedValues> wanted = Read(*request, *context);
  if (!wanted.ok()) return ToGrpc(wanted.status());
  const auto next = AddPage(*values_, *wanted, runtime::DeadlineOf(*context), response->mutable_values());
  if (!next.ok()) return ToGrpc(next.status());
  if (*next > 0) response->set_next_page_token(runtime::TokenAfter(runtime::FiltersOf(*request), *next));
  return grpc::Status::OK;
}

grpc::Status ValueService::DownloadValues(grpc::ServerContext* context, const v1::DownloadValuesRequest* request,
                                          grpc::ServerWriter<v1::ListValuesResponse>* writer) {
  absl::StatusOr<WantedValues> wanted = Read(request->values(), *context);
  if (!wanted.ok()) return ToGrpc(wanted.status());
  do {
    v1::ListValuesResponse response;
    const auto next = AddPage(*values_, *wanted, runtime::DeadlineOf(*context), response.mutable_values());
    if (!next.ok()) return ToGrpc(next.status());
    wanted->page.before_sequence = *next;
    if (*next > 0) response.set_next_page_token(runtime::TokenAfter(runtime::FiltersOf(request->values()), *next));
    if (!writer->Write(response)) return ToGrpc(absl::CancelledError("values: the client went away"));
  } while (wanted->page.before_sequence > 0);
  return grpc::Status::OK;
}

}  // namespace sixpoint::inspection
