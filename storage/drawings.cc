#include "storage/drawings.h"

#include <utility>

#include "refusal/refusal.h"
#include "storage/clearances.h"
#include "storage/drawing_children.h"
#include "storage/each_row.h"
#include "storage/optional_reals.h"
#include "storage/reasons.h"
#include "storage/requests.h"

namespace sixpoint::storage {
namespace {

constexpr char kLockDrawingId[] = "SELECT pg_advisory_xact_lock(hashtextextended('drawings/' || $1, 0))";
constexpr char kInsertDrawingId[] = "INSERT INTO drawings (drawing_id, part_id) VALUES ($1, $2) ON CONFLICT DO NOTHING";
#define SIXPOINT_DRAWING_COLUMNS                                                                             \
  "content_sha256, part_id, drawing_number, drawing_revision, part_number, part_name, part_revision_level, " \
  "additional_changes, decision_rule, decision_rule_edition, guard_factor, neighbour_offset_in_part_mm, "    \
  "neighbour_standard_uncertainty_um, requested_by"
constexpr char kInsertDrawingRevision[] =
    "INSERT INTO drawing_revisions (drawing_id, revision, record_id, " SIXPOINT_DRAWING_COLUMNS
    ") VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17)";
constexpr char kSelectDrawingRevision[] =
    "SELECT revision, record_sequence, recorded_at, (SELECT count(*) FROM drawing_characteristics c WHERE "
    "c.drawing_id = d.drawing_id AND c.revision = d.revision), name_of(requested_by), " SIXPOINT_DRAWING_COLUMNS
    " FROM drawing_revisions d JOIN record_names USING (record_id) WHERE drawing_id = $1 AND "
    "($2::integer = 0 OR revision = $2) ORDER BY revision DESC LIMIT 1";
#undef SIXPOINT_DRAWING_COLUMNS
constexpr char kInsertPartRevisions[] =
    "INSERT INTO drawing_part_revisions (drawing_id, revision, part_id, part_revision) "
    "SELECT $1::text, $2::integer, $3::text, part_revision FROM unnest($4::integer[]) AS valid (part_revision)";
constexpr char kSelectPartRevisions[] =
    "SELECT part_revision FROM drawing_part_revisions WHERE drawing_id = $1 AND revision = $2 ORDER BY part_revision";
// The newest revision's time decides.
constexpr char kSelectIds[] =
    "SELECT drawing_id FROM (SELECT DISTINCT ON (drawing_id) drawing_id, part_id, recorded_at FROM drawing_revisions "
    "JOIN record_names USING (record_id) WHERE drawing_id > $1 ORDER BY drawing_id, revision DESC) newest "
    "WHERE ($2::timestamptz IS NULL OR recorded_at >= $2) AND ($3::timestamptz IS NULL OR recorded_at < $3) "
    "AND part_id <> ALL ($5::text[]) AND ($6 = '' OR part_id = $6) ORDER BY drawing_id LIMIT $4";

// Whose drawing it is was said with the first revision.
absl::Status IsOfAnotherPart(Transaction& transaction, const Reader& reader, const DrawingRow& known,
                             const DrawingRow& asked) {
  const std::string name = "drawings/" + known.drawing_id;
  const auto hidden = FirstHidden(transaction, reader, {name}, Unrecorded::kIsSeen);
  if (!hidden.ok()) return hidden.status();
  if (hidden->has_value()) return NotSeen("drawing_id", name, reader);
  return WithReason(absl::AlreadyExistsError("drawing.part: parts/" + asked.part_id + ", want parts/" + known.part_id +
                                             ", whose drawing " + name + " is"),
                    kOfAnotherPart);
}

absl::Status CheckRevises(const DrawingRow& drawing, int newest) {
  if (!drawing.revises || *drawing.revises == newest) return absl::OkStatus();
  return Refuse("revises", *drawing.revises,
                newest == 0 ? "0: drawings/" + drawing.drawing_id + " is not there yet"
                            : std::to_string(newest) + ": drawings/" + drawing.drawing_id +
                                  " has been revised, or is there already");
}

absl::Status InsertRevision(Transaction& transaction, const DrawingRow& drawing, const std::string& record_id) {
  Params params;
  params.Text(drawing.drawing_id).Int(drawing.revision).Uuid(record_id).Digest(drawing.content_sha256);
  params.Text(drawing.part_id).Text(drawing.drawing_number).Text(drawing.drawing_revision);
  params.Text(drawing.part_number).Text(drawing.part_name).OptionalText(drawing.part_revision_level);
  drawing.additional_changes.empty() ? params.Null() : params.Texts(drawing.additional_changes);
  Add(drawing.decision_rule, &params);
  AddOptionalReals(drawing.neighbour_offset_in_part_mm, &params);
  drawing.neighbour_offset_in_part_mm.empty() ? params.Null() : params.Real(drawing.neighbour_standard_uncertainty_um);
  params.Text(drawing.requested_by);
  if (const auto inserted = transaction.Execute(kInsertDrawingRevision, params); !inserted.ok())
    return inserted.status();
  Params valid;
  valid.Text(drawing.drawing_id).Int(drawing.revision).Text(drawing.part_id);
  valid.Reals({drawing.part_revisions.begin(), drawing.part_revisions.end()});
  if (const auto put = transaction.Execute(kInsertPartRevisions, valid); !put.ok()) return put.status();
  return InsertDrawingChildren(transaction, drawing);
}

}  // namespace

absl::StatusOr<DrawingRow> InsertDrawing(Transaction& transaction, DrawingRow drawing, RecordEntry entry) {
  const std::string id = drawing.drawing_id;
  if (const absl::StatusOr<Rows> locked = transaction.Execute(kLockDrawingId, Params().Text(id)); !locked.ok())
    return locked.status();
  absl::StatusOr<std::optional<DrawingRow>> newest = FindDrawing(transaction, id, 0);
  if (!newest.ok()) return newest.status();
  if (*newest && (*newest)->part_id != drawing.part_id)
    return IsOfAnotherPart(transaction, entry.reader, **newest, drawing);
  if (*newest && (*newest)->content_sha256 == drawing.content_sha256) {
    // Nothing new: the request gives what was there.
    const absl::Status kept = KeepRequest(transaction, entry.request, RevisionName("drawing", id, (*newest)->revision));
    if (!kept.ok()) return kept;
    return **std::move(newest);
  }
  const int before = *newest ? (*newest)->revision : 0;
  if (absl::Status revises = CheckRevises(drawing, before); !revises.ok()) return revises;
  drawing.revision = before + 1;
  drawing.characteristic_count = static_cast<int>(drawing.characteristics.size());
  entry.kind = "drawing";
  entry.name = RevisionName("drawing", id, drawing.revision);
  if (const auto put = transaction.Execute(kInsertDrawingId, Params().Text(id).Text(drawing.part_id)); !put.ok())
    return put.status();
  const std::string record_id = NewUuid();
  if (absl::Status put = InsertRevision(transaction, drawing, record_id); !put.ok()) return put;
  const absl::StatusOr<Recorded> recorded = AppendRecord(transaction, record_id, entry);
  if (!recorded.ok()) return recorded.status();
  drawing.recorded = *recorded;
  return drawing;
}

absl::StatusOr<std::optional<DrawingRow>> FindListedDrawing(Transaction& transaction, const std::string& id,
                                                            int revision) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectDrawingRevision, Params().Text(id).Int(revision));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  DrawingRow drawing;
  drawing.drawing_id = id;
  drawing.revision = static_cast<int>(rows->Int(0, 0));
  drawing.recorded = {rows->Int(0, 1), rows->Time(0, 2)};
  drawing.characteristic_count = static_cast<int>(rows->Int(0, 3));
  drawing.requested_by = rows->Text(0, 4);
  drawing.content_sha256 = rows->Digest(0, 5);
  int column = 6;
  for (std::string* const text : {&drawing.part_id, &drawing.drawing_number, &drawing.drawing_revision,
                                  &drawing.part_number, &drawing.part_name, &drawing.part_revision_level})
    *text = rows->OptionalText(0, column++);
  if (!rows->IsNull(0, column)) drawing.additional_changes = rows->Texts(0, column);
  drawing.decision_rule = DecisionRuleAt(*rows, 0, column + 1);
  drawing.neighbour_offset_in_part_mm = OptionalRealsAt(*rows, 0, column + 4);
  drawing.neighbour_standard_uncertainty_um = rows->OptionalReal(0, column + 5).value_or(0);
  if (absl::Status read = rows->status(); !read.ok()) return read;
  const auto valid = transaction.Execute(kSelectPartRevisions, Params().Text(id).Int(drawing.revision));
  if (!valid.ok()) return valid.status();
  for (int row = 0; row < valid->count(); ++row) drawing.part_revisions.push_back(static_cast<int>(valid->Int(row, 0)));
  return valid->Checked(std::move(drawing));
}

absl::StatusOr<std::optional<DrawingRow>> FindDrawing(Transaction& transaction, const std::string& id, int revision) {
  absl::StatusOr<std::optional<DrawingRow>> drawing = FindListedDrawing(transaction, id, revision);
  if (!drawing.ok() || !drawing->has_value()) return drawing;
  if (absl::Status read = ReadDrawingChildren(transaction, &**drawing); !read.ok()) return read;
  return drawing;
}

absl::StatusOr<std::vector<std::string>> ListDrawingIds(Transaction& transaction, const RegisteredFilter& filter,
                                                        const std::string& after, int limit) {
  const absl::StatusOr<Sight> sight = SightOf(transaction, filter.reader);
  if (!sight.ok()) return sight.status();
  Params params;
  params.Text(after);
  AddSpan(filter.recorded, &params);
  params.Int(limit).Texts(sight->hidden_parts).Text(filter.part_id);
  return AllRows(transaction, kSelectIds, params,
                 [](const Rows& rows, int row) -> std::string { return rows.Text(row, 0); });
}

}  // namespace sixpoint::storage
