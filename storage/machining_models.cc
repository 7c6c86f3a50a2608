#include "storage/machining_models.h"

#include <utility>

#include "storage/blobs.h"
#include "storage/clearances.h"
#include "storage/reasons.h"
#include "storage/requests.h"

namespace sixpoint::storage {
namespace {

constexpr char kLockModelId[] = "SELECT pg_advisory_xact_lock(hashtextextended('machining_models/' || $1, 0))";
constexpr char kInsertModelId[] =
    "INSERT INTO machining_models (machining_model_id, part_id) VALUES ($1, $2) ON CONFLICT DO NOTHING";
#define SIXPOINT_MODEL_COLUMNS                                                               \
  "content_sha256, part_id, part_revision, w_mm, nc_template_sha256, nc_work_offset_codes, " \
  "nc_work_offsets, nc_tool_numbers, nc_tool_lengths_mm"
constexpr char kInsertModelRevision[] =
    "INSERT INTO machining_model_revisions (machining_model_id, revision, record_id, " SIXPOINT_MODEL_COLUMNS
    ") VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11::integer[], $12)";
constexpr char kSelectModelRevision[] =
    "SELECT revision, record_sequence, recorded_at, " SIXPOINT_MODEL_COLUMNS
    " FROM machining_model_revisions JOIN record_names USING (record_id) WHERE machining_model_id = $1 AND "
    "($2::integer = 0 OR revision = $2) ORDER BY revision DESC LIMIT 1";
#undef SIXPOINT_MODEL_COLUMNS
constexpr char kInsertOperations[] =
    "INSERT INTO machining_operations (machining_model_id, revision, position_index, operation, hole_group, "
    "electrode_diameter_mm, electrode_length_mm, electrode_wear_mm, tool_number, feed_mm_min) "
    "SELECT $1::text, $2::integer, (position - 1)::integer, operation, nullif(hole_group, ''), diameter, length, wear, "
    "nullif(tool, 0), nullif(feed, 0) FROM unnest($3::text[], $4::text[], $5::double precision[], "
    "$6::double precision[], $7::double precision[], $8::integer[], $9::double precision[]) "
    "WITH ORDINALITY AS operations (operation, hole_group, diameter, length, wear, tool, feed, position)";
#define SIXPOINT_POST_COLUMNS                                                                                  \
  "axis_words, linear_decimals, rotary_decimals, direction_decimals, explicit_plus, directions, "              \
  "semicolon_comments, leaves_out_repeated, first_number, number_step, program_start, operation_start, hole, " \
  "path_start, path_pose, path_end, operation_end, program_end"
constexpr char kInsertPost[] =
    "INSERT INTO machining_post_processors (machining_model_id, revision, " SIXPOINT_POST_COLUMNS
    ") VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18, $19, $20)";
constexpr char kSelectPost[] =
    "SELECT " SIXPOINT_POST_COLUMNS " FROM machining_post_processors WHERE machining_model_id = $1 AND revision = $2";
#undef SIXPOINT_POST_COLUMNS
#define SIXPOINT_PATH_COLUMNS                                                                        \
  "path, a_nominal_deg, b_nominal_deg, position_tolerance_mm, inclination_tolerance_deg, mouth_mm, " \
  "greatest_step_deg, tips_in_part_mm, axes_in_part"
constexpr char kInsertPath[] =
    "INSERT INTO machining_tool_paths (machining_model_id, revision, operation_index, "
    "position_index, " SIXPOINT_PATH_COLUMNS ") VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13)";
constexpr char kSelectPaths[] = "SELECT operation_index, " SIXPOINT_PATH_COLUMNS
                                " FROM machining_tool_paths WHERE machining_model_id = $1 AND revision = $2 ORDER BY "
                                "operation_index, position_index";
// Of a list.
constexpr char kSelectPathsAlone[] =
    "SELECT operation_index, path, a_nominal_deg, b_nominal_deg, position_tolerance_mm, inclination_tolerance_deg, "
    "mouth_mm, greatest_step_deg, '{}'::double precision[], '{}'::double precision[] FROM machining_tool_paths "
    "WHERE machining_model_id = $1 AND revision = $2 ORDER BY operation_index, position_index";
#undef SIXPOINT_PATH_COLUMNS
constexpr char kSelectOperations[] =
    "SELECT operation, coalesce(hole_group, ''), electrode_diameter_mm, electrode_length_mm, electrode_wear_mm, "
    "tool_number, feed_mm_min FROM machining_operations WHERE machining_model_id = $1 AND revision = $2 ORDER BY "
    "position_index";

absl::Status InsertPaths(Transaction& transaction, const MachiningModelRow& model, std::size_t operation) {
  int position = 0;
  for (const MachiningToolPathRow& path : model.operations[operation].paths) {
    Params params;
    params.Text(model.machining_model_id).Int(model.revision).Int(static_cast<int>(operation)).Int(position++);
    params.Text(path.path).Real(path.a_nominal_deg).Real(path.b_nominal_deg).Real(path.position_tolerance_mm);
    params.Real(path.inclination_tolerance_deg).Real(path.mouth_mm).OptionalReal(path.greatest_step_deg);
    const auto inserted = transaction.Execute(kInsertPath, params.Reals(path.tips_in_part_mm).Reals(path.axes_in_part));
    if (!inserted.ok()) return inserted.status();
  }
  return absl::OkStatus();
}

absl::Status InsertOperations(Transaction& transaction, const MachiningModelRow& model) {
  std::vector<std::string> operations, groups;
  std::vector<double> diameters_mm, lengths_mm, wears_mm, tools, feeds_mm_min;  // 0: none
  for (const MachiningOperationRow& one : model.operations) {
    operations.push_back(one.operation);
    groups.push_back(one.hole_group);
    diameters_mm.push_back(one.electrode_diameter_mm);
    lengths_mm.push_back(one.electrode_length_mm);
    wears_mm.push_back(one.electrode_wear_mm);
    tools.push_back(one.tool_number.value_or(0));
    feeds_mm_min.push_back(one.feed_mm_min.value_or(0));
  }
  Params params;
  params.Text(model.machining_model_id).Int(model.revision).Texts(operations).Texts(groups);
  const auto inserted = transaction.Execute(
      kInsertOperations, params.Reals(diameters_mm).Reals(lengths_mm).Reals(wears_mm).Reals(tools).Reals(feeds_mm_min));
  if (!inserted.ok()) return inserted.status();
  for (std::size_t i = 0; i < model.operations.size(); ++i)
    if (absl::Status paths = InsertPaths(transaction, model, i); !paths.ok()) return paths;
  return absl::OkStatus();
}

absl::Status InsertPost(Transaction& transaction, const MachiningModelRow& model) {
  if (!model.post_processor) return absl::OkStatus();
  const PostProcessorRow& post = *model.post_processor;
  Params params;
  params.Text(model.machining_model_id).Int(model.revision).Texts(post.axis_words);
  params.Int(post.linear_decimals).Int(post.rotary_decimals).Int(post.direction_decimals).Bool(post.explicit_plus);
  params.Bool(post.directions).Bool(post.semicolon_comments).Bool(post.leaves_out_repeated);
  params.Int(post.first_number).Int(post.number_step).Text(post.program_start).Text(post.operation_start);
  params.Text(post.hole).Text(post.path_start).Text(post.path_pose).Text(post.path_end);
  return transaction.Execute(kInsertPost, params.Text(post.operation_end).Text(post.program_end)).status();
}

absl::Status ReadPost(Transaction& transaction, MachiningModelRow* model) {
  const absl::StatusOr<Rows> rows =
      transaction.Execute(kSelectPost, Params().Text(model->machining_model_id).Int(model->revision));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return absl::OkStatus();
  PostProcessorRow& post = model->post_processor.emplace();
  post.axis_words = rows->Texts(0, 0);
  post.linear_decimals = static_cast<int>(rows->Int(0, 1));
  post.rotary_decimals = static_cast<int>(rows->Int(0, 2));
  post.direction_decimals = static_cast<int>(rows->Int(0, 3));
  post.explicit_plus = rows->Bool(0, 4);
  post.directions = rows->Bool(0, 5);
  post.semicolon_comments = rows->Bool(0, 6);
  post.leaves_out_repeated = rows->Bool(0, 7);
  post.first_number = static_cast<int>(rows->Int(0, 8));
  post.number_step = static_cast<int>(rows->Int(0, 9));
  int column = 10;
  for (std::string* const text : {&post.program_start, &post.operation_start, &post.hole, &post.path_start,
                                  &post.path_pose, &post.path_end, &post.operation_end, &post.program_end})
    *text = rows->Text(0, column++);
  return rows->status();
}

absl::Status ReadPaths(Transaction& transaction, const char* sql, MachiningModelRow* model) {
  const absl::StatusOr<Rows> rows =
      transaction.Execute(sql, Params().Text(model->machining_model_id).Int(model->revision));
  if (!rows.ok()) return rows.status();
  for (int row = 0; row < rows->count(); ++row) {
    const auto operation = static_cast<std::size_t>(rows->Int(row, 0));
    if (operation >= model->operations.size())
      return absl::DataLossError("a stored path of operation " + std::to_string(operation) +
                                 ", want one that there is");
    MachiningToolPathRow& path = model->operations[operation].paths.emplace_back();
    path.path = rows->Text(row, 1);
    path.a_nominal_deg = rows->Real(row, 2);
    path.b_nominal_deg = rows->Real(row, 3);
    path.position_tolerance_mm = rows->Real(row, 4);
    path.inclination_tolerance_deg = rows->Real(row, 5);
    path.mouth_mm = rows->Real(row, 6);
    path.greatest_step_deg = rows->OptionalReal(row, 7);
    path.tips_in_part_mm = rows->Reals(row, 8);
    path.axes_in_part = rows->Reals(row, 9);
  }
  return rows->status();
}

// Whose part it is was said with the first revision.
absl::Status IsOfAnotherPart(Transaction& transaction, const Reader& reader, const MachiningModelRow& known,
                             const MachiningModelRow& asked) {
  const std::string name = "machining_models/" + known.machining_model_id;
  const auto hidden = FirstHidden(transaction, reader, {name}, Unrecorded::kIsSeen);
  if (!hidden.ok()) return hidden.status();
  if (hidden->has_value()) return NotSeen("machining_model_id", name, reader);
  return WithReason(absl::AlreadyExistsError("machining_model.part: parts/" + asked.part_id + ", want parts/" +
                                             known.part_id + ", whose model " + name + " is"),
                    kOfAnotherPart);
}

absl::StatusOr<std::optional<MachiningModelRow>> ReadModel(Transaction& transaction, const std::string& id,
                                                           int revision, const char* paths) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectModelRevision, Params().Text(id).Int(revision));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  MachiningModelRow model;
  model.machining_model_id = id;
  model.revision = static_cast<int>(rows->Int(0, 0));
  model.recorded = {rows->Int(0, 1), rows->Time(0, 2)};
  model.content_sha256 = rows->Digest(0, 3);
  model.part_id = rows->Text(0, 4);
  model.part_revision = static_cast<int>(rows->Int(0, 5));
  model.w_mm = rows->OptionalReal(0, 6);
  model.nc_template_sha256 = rows->Digest(0, 7);
  model.work_offsets = WorkOffsetsAt(*rows, 0, 8);
  model.tool_lengths = ToolLengthsAt(*rows, 0, 10);
  const absl::StatusOr<Rows> operations = transaction.Execute(kSelectOperations, Params().Text(id).Int(model.revision));
  if (!operations.ok()) return operations.status();
  for (int row = 0; row < operations->count(); ++row) {
    MachiningOperationRow& one = model.operations.emplace_back();
    one.operation = operations->Text(row, 0);
    one.hole_group = operations->Text(row, 1);
    one.electrode_diameter_mm = operations->Real(row, 2);
    one.electrode_length_mm = operations->Real(row, 3);
    one.electrode_wear_mm = operations->Real(row, 4);
    if (!operations->IsNull(row, 5)) one.tool_number = static_cast<int>(operations->Int(row, 5));
    one.feed_mm_min = operations->OptionalReal(row, 6);
  }
  if (absl::Status read = rows->status(); !read.ok()) return read;
  if (absl::Status read = operations->status(); !read.ok()) return read;
  if (absl::Status read = ReadPaths(transaction, paths, &model); !read.ok()) return read;
  return model;
}

}  // namespace

absl::StatusOr<MachiningModelRow> InsertMachiningModel(Transaction& transaction, MachiningModelRow model,
                                                       RecordEntry entry) {
  const std::string& id = model.machining_model_id;
  if (const absl::StatusOr<Rows> locked = transaction.Execute(kLockModelId, Params().Text(id)); !locked.ok())
    return locked.status();
  absl::StatusOr<std::optional<MachiningModelRow>> newest = FindMachiningModel(transaction, id, 0);
  if (!newest.ok()) return newest.status();
  if (*newest && (*newest)->part_id != model.part_id)
    return IsOfAnotherPart(transaction, entry.reader, **newest, model);
  const bool known = *newest && (*newest)->content_sha256 == model.content_sha256;
  model.revision = (*newest ? (*newest)->revision : 0) + (known ? 0 : 1);
  entry.kind = "machining_model";
  entry.name = RevisionName("machining_model", id, model.revision);
  if (known) {
    // Nothing new: the request gives what was there.
    if (absl::Status kept = KeepRequest(transaction, entry.request, entry.name); !kept.ok()) return kept;
    return **std::move(newest);
  }
  if (const auto inserted = transaction.Execute(kInsertModelId, Params().Text(id).Text(model.part_id)); !inserted.ok())
    return inserted.status();
  absl::StatusOr<std::string> nc_template = PutBlob(transaction, model.nc_template);
  if (!nc_template.ok()) return nc_template.status();
  model.nc_template_sha256 = *std::move(nc_template);
  const std::string record_id = NewUuid();
  Params params;
  params.Text(id).Int(model.revision).Uuid(record_id).Digest(model.content_sha256).Text(model.part_id);
  params.Int(model.part_revision).OptionalReal(model.w_mm).Digest(model.nc_template_sha256);
  Add(model.work_offsets, &params);
  Add(model.tool_lengths, &params);
  if (const absl::StatusOr<Rows> inserted = transaction.Execute(kInsertModelRevision, params); !inserted.ok())
    return inserted.status();
  if (absl::Status operations = InsertOperations(transaction, model); !operations.ok()) return operations;
  if (absl::Status post = InsertPost(transaction, model); !post.ok()) return post;
  const absl::StatusOr<Recorded> recorded = AppendRecord(transaction, record_id, entry);
  if (!recorded.ok()) return recorded.status();
  model.recorded = *recorded;
  return model;
}

absl::StatusOr<std::optional<MachiningModelRow>> FindMachiningModelWithoutTemplate(Transaction& transaction,
                                                                                   const std::string& id,
                                                                                   int revision) {
  return ReadModel(transaction, id, revision, kSelectPathsAlone);
}

absl::StatusOr<std::optional<MachiningModelRow>> FindMachiningModel(Transaction& transaction, const std::string& id,
                                                                    int revision) {
  absl::StatusOr<std::optional<MachiningModelRow>> model = ReadModel(transaction, id, revision, kSelectPaths);
  if (!model.ok() || !model->has_value()) return model;
  absl::StatusOr<std::string> nc_template = GetBlob(transaction, (*model)->nc_template_sha256);
  if (!nc_template.ok()) return nc_template.status();
  (*model)->nc_template = *std::move(nc_template);
  if (absl::Status post = ReadPost(transaction, &**model); !post.ok()) return post;
  return model;
}

}  // namespace sixpoint::storage
