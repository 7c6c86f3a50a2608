#include "services/plant/drawing_service.h"

#include <optional>
#include <string>
#include <utility>

#include "services/plant/drawing_checks.h"
#include "services/plant/registry_calls.h"

namespace sixpoint::plant {
namespace {

// Against each revision that it says it is valid for, one at a time: a part may have 20,000 holes.
absl::Status FitToRevisions(const storage::RevisionReader<storage::PartRow>& parts, const storage::DrawingRow& drawing,
                            storage::Deadline deadline) {
  const std::string name = runtime::NameOf("parts", drawing.part_id);
  const absl::StatusOr<storage::PartRow> newest =
      Require(parts.Find(drawing.part_id, 0, deadline), errors::v1::PART_NOT_FOUND, name);
  if (!newest.ok()) return newest.status();
  runtime::Refusals refusals;
  for (std::size_t i = 0; i < drawing.part_revisions.size(); ++i) {
    const int revision = drawing.part_revisions[i];
    const absl::StatusOr<std::optional<storage::PartRow>> part = parts.Find(drawing.part_id, revision, deadline);
    if (!part.ok()) return part.status();
    refusals.Add(part->has_value() ? FitToPart(drawing, **part)
                                   : runtime::Refuse("drawing.part_revisions[" + std::to_string(i) + "]", revision,
                                                     "a revision of " + name + ", whose newest is " +
                                                         std::to_string(newest->revision)));
  }
  return refusals.status();
}

}  // namespace

DrawingService::DrawingService(std::shared_ptr<storage::DrawingStore> drawings,
                               std::shared_ptr<const storage::RevisionReader<storage::PartRow>> parts)
    : drawings_(std::move(drawings)), parts_(std::move(parts)) {}

grpc::Status DrawingService::CreateDrawing(grpc::ServerContext* context, const v1::CreateDrawingRequest* request,
                                           v1::Drawing* response) {
  absl::StatusOr<storage::DrawingRow> drawing = Validated(*request);
  if (!drawing.ok()) return runtime::ToGrpc(drawing.status());
  const auto make = [&]() -> absl::StatusOr<runtime::Made<storage::DrawingRow>> {
    const absl::Status fits = FitToRevisions(*parts_, *drawing, runtime::DeadlineOf(*context));
    if (!fits.ok()) return fits;
    runtime::Made<storage::DrawingRow> made{*std::move(drawing), NewEntry()};
    for (const int revision : made.row.part_revisions)
      made.entry.inputs.push_back(runtime::RevisedName("parts", made.row.part_id, revision));
    return made;
  };
  return Once(context, drawings_.get(), "CreateDrawing", *request, response, make);
}

grpc::Status DrawingService::GetDrawing(grpc::ServerContext* context, const v1::GetDrawingRequest* request,
                                        v1::Drawing* response) {
  return Get(
      Require(*drawings_, "drawings", request->name(), errors::v1::DRAWING_NOT_FOUND, runtime::DeadlineOf(*context)),
      response);
}

grpc::Status DrawingService::ListDrawings(grpc::ServerContext* context, const v1::ListDrawingsRequest* request,
                                          v1::ListDrawingsResponse* response) {
  return runtime::ToGrpc(
      ListNewest(*drawings_, *context, *request, response->mutable_drawings(), response->mutable_next_page_token()));
}

}  // namespace sixpoint::plant
