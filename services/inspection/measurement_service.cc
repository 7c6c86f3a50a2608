#include "services/inspection/measurement_service.h"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include "services/inspection/compare_measurements.h"
#include "services/inspection/drawn_characteristics.h"
#include "services/inspection/measured_values.h"
#include "services/inspection/measurement_messages.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/list_filters.h"
#include "services/runtime/recorded_results.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::inspection {
namespace {

using runtime::ToGrpc;

// A file may take a hundred megabytes while it is read.
constexpr int kMostCompared = 200;
constexpr runtime::PoolLimits kImportLimits{2, runtime::kAllLetIn};

// The revisions that the drawing is valid for, one at a time: a part may have 20,000 holes.
absl::StatusOr<std::vector<plant::v1::Part>> PartsOf(const clients::BladePeers& peers,
                                                     const plant::v1::Drawing& drawing, const runtime::Caller& caller) {
  std::vector<plant::v1::Part> parts;
  for (const int revision : drawing.part_revisions()) {
    auto part = peers.plant.GetPart(drawing.part(), revision, caller.make_context());
    if (!part.ok()) return part.status();
    plant::v1::Part& holes = parts.emplace_back();
    holes.mutable_hole_groups()->Swap(part->mutable_hole_groups());
  }
  return parts;
}

// All of them registered, and of the drawing's part.
absl::Status CheckBlades(const clients::BladePeers& peers, const std::vector<storage::MeasurementRow>& measurements,
                         const std::string& part, const runtime::Caller& caller) {
  runtime::Refusals refusals;
  for (const storage::MeasurementRow& measurement : measurements) {
    if (!caller.keep_going()) return absl::CancelledError("the call was ended while its blades were looked for");
    const std::string name = runtime::NameOf("blades", measurement.blade_serial);
    const auto blade = peers.plant.GetBlade(name, caller.make_context());
    if (!blade.ok())
      refusals.Add(runtime::NotKnown("serial", name, blade.status()));
    else if (blade->part() != part)
      refusals.Add(runtime::Refuse("serial", name + " of " + blade->part(), "a blade of " + part));
  }
  return refusals.status();
}

absl::Status CheckMoments(const std::vector<storage::MeasurementRow>& measurements) {
  runtime::Refusals refusals;
  for (const storage::MeasurementRow& measurement : measurements) {
    google::protobuf::Timestamp time;
    runtime::ToProto(measurement.measured_at, &time);
    refusals.Add(runtime::CheckPast("measured_at of " + measurement.blade_serial, time));
  }
  return refusals.status();
}

}  // namespace

MeasurementService::MeasurementService(
    std::shared_ptr<const storage::ResultReader<storage::MeasurementRow, storage::MeasurementFilter>> measurements,
    std::shared_ptr<storage::ResultWriter<storage::MeasurementImport>> imports, std::shared_ptr<const OurValues> ours,
    std::shared_ptr<const clients::BladePeers> peers)
    : measurements_(std::move(measurements)),
      imports_(std::move(imports)),
      ours_(std::move(ours)),
      peers_(std::move(peers)),
      reading_(kImportLimits, "imports", errors::v1::INSPECTIONS_FULL) {}

grpc::Status MeasurementService::ImportMeasurements(grpc::ServerContext* context,
                                                    const v1::ImportMeasurementsRequest* request,
                                                    v1::ImportMeasurementsResponse* response) {
  if (const auto order = OrderOf(*request); !order.ok()) return ToGrpc(order.status());
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto slot = reading_.Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return ToGrpc(slot.status());
  return runtime::Answer(runtime::RecordedResult<v1::ImportMeasurementsResponse>(
                             imports_.get(), "inspection.ImportMeasurements", *request, caller,
                             [&] { return Make(*request, caller); }, ToProto),
                         response);
}

absl::StatusOr<runtime::Made<storage::MeasurementImport>> MeasurementService::Make(
    const v1::ImportMeasurementsRequest& request, const runtime::Caller& caller) const {
  auto order = OrderOf(request);
  if (!order.ok()) return order.status();
  const auto drawing = peers_->plant.GetDrawing(request.drawing(), caller.make_context());
  if (!drawing.ok()) return runtime::NotKnown("drawing", request.drawing(), drawing.status());
  const auto parts = PartsOf(*peers_, *drawing, caller);
  if (!parts.ok()) return parts.status();
  const auto rows = exchange::ReadMeasuredFile(order->format, request.content());
  if (!rows.ok()) return Under("content: ", rows.status());
  auto measurements = MeasuredBlades(*rows, DrawnCharacteristics(*drawing, *parts), order->statement);
  if (!measurements.ok()) return Under("content: ", measurements.status());
  if (absl::Status good = CheckMoments(*measurements); !good.ok()) return Under("content: ", good);
  if (absl::Status good = CheckBlades(*peers_, *measurements, drawing->part(), caller); !good.ok())
    return Under("content: ", good);
  order->file.drawing_id = runtime::LastSegment(drawing->name());
  order->file.drawing_revision = drawing->revision();
  order->file.part_id = runtime::LastSegment(drawing->part());
  runtime::Made<storage::MeasurementImport> made;
  for (storage::MeasurementRow& measurement : *measurements) {
    measurement.measurement_id = storage::NewUuid();
    measurement.file = order->file;
    made.row.measurements.push_back(std::move(measurement));
  }
  made.entry.kind = "measurement";
  made.entry.software_version = order->file.software_version;
  return made;
}

grpc::Status MeasurementService::GetMeasurement(grpc::ServerContext* context, const v1::GetMeasurementRequest* request,
                                                v1::Measurement* response) {
  return runtime::Answer(
      runtime::GetResult<v1::Measurement>(*measurements_, runtime::DeadlineOf(*context), "measurements",
                                          request->name(), errors::v1::MEASUREMENT_NOT_FOUND, ToProto),
      response);
}

grpc::Status MeasurementService::ListMeasurements(grpc::ServerContext* context,
                                                  const v1::ListMeasurementsRequest* request,
                                                  v1::ListMeasurementsResponse* response) {
  storage::MeasurementFilter filter;
  runtime::Refusals refusals;
  for (const auto& [field, collection, name, id] :
       {std::tuple("blade", "blades", &request->blade(), &filter.blade_serial),
        std::tuple("part", "parts", &request->part(), &filter.part_id),
        std::tuple("drawing", "drawings", &request->drawing(), &filter.drawing_id)}) {
    const absl::StatusOr<std::string> read = runtime::FilterIdOf(field, collection, *name);
    refusals.Add(read.status());
    if (read.ok()) *id = *read;
  }
  const auto recorded = runtime::SpanOf("recorded", request->recorded());
  refusals.Add(recorded.status());
  const std::string& sha256 = request->file_sha256();
  if (!sha256.empty() && (sha256.size() != 64 || sha256.find_first_not_of("0123456789abcdef") != std::string::npos))
    refusals.Add(runtime::Refuse("file_sha256", sha256, "64 hexadecimal digits"));
  if (!refusals.status().ok()) return ToGrpc(refusals.status());
  filter.recorded = *recorded;
  filter.instrument_serial_number = request->instrument_serial_number();
  filter.file_sha256 = sha256;
  filter.reader = runtime::ReaderOf(*context);
  filter.with_values = request->view() == list::v1::VIEW_FULL;
  return ToGrpc(runtime::ListResults(*measurements_, runtime::DeadlineOf(*context), *request, filter, ToProto,
                                     LeaveBasic, response->mutable_measurements(),
                                     response->mutable_next_page_token()));
}

grpc::Status MeasurementService::CompareMeasurements(grpc::ServerContext* context,
                                                     const v1::CompareMeasurementsRequest* request,
                                                     v1::CompareMeasurementsResponse* response) {
  storage::MeasurementFilter filter;
  runtime::Refusals refusals;
  const auto drawing = runtime::RevisedIdOf("drawing", "drawings", request->drawing());
  const auto recorded = runtime::SpanOf("recorded", request->recorded());
  refusals.Add(drawing.status()).Add(recorded.status());
  if (!refusals.status().ok()) return ToGrpc(refusals.status());
  filter.drawing_id = drawing->id;
  filter.recorded = *recorded;
  filter.instrument_serial_number = request->instrument_serial_number();
  filter.reader = runtime::ReaderOf(*context);
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto slot = reading_.Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return ToGrpc(slot.status());
  return runtime::Answer(Compare(*request, std::move(filter), caller), response);
}

absl::StatusOr<v1::CompareMeasurementsResponse> MeasurementService::Compare(
    const v1::CompareMeasurementsRequest& request, storage::MeasurementFilter filter,
    const runtime::Caller& caller) const {
  const auto drawing = peers_->plant.GetDrawing(request.drawing(), caller.make_context());
  if (!drawing.ok()) return runtime::NotKnown("drawing", request.drawing(), drawing.status());
  auto theirs = measurements_->List(filter, 0, kMostCompared + 1, caller.deadline);
  if (!theirs.ok()) return theirs.status();
  // A balloon's number may mean something else in another revision.
  const auto other = [&](const storage::MeasurementRow& row) {
    return row.file.drawing_revision != drawing->revision();
  };
  theirs->erase(std::remove_if(theirs->begin(), theirs->end(), other), theirs->end());
  const bool truncated = theirs->size() > kMostCompared;
  if (truncated) theirs->resize(kMostCompared);
  std::set<std::string> serials;
  for (const storage::MeasurementRow& measurement : *theirs) serials.insert(measurement.blade_serial);
  const auto ours =
      ours_->Of(filter.drawing_id, drawing->revision(), {serials.begin(), serials.end()}, caller.deadline);
  if (!ours.ok()) return ours.status();
  auto response = ComparedMeasurements(*drawing, *ours, *theirs);
  if (!response.ok()) return response.status();
  response->set_measurement_count(static_cast<int>(theirs->size()));
  response->set_truncated(truncated);
  return response;
}

}  // namespace sixpoint::inspection
