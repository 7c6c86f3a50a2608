#include "storage/correction_tool_paths.h"

#include <algorithm>
#include <utility>

#include "storage/optional_reals.h"

namespace sixpoint::storage {
namespace {

#define SIXPOINT_TOOL_PATH_COLUMNS                                                                                  \
  "tips_mm, nominal_tips_mm, commanded_deg, nominal_deg, reached_deg, tilts_deg, standard_uncertainties_deg, "      \
  "expanded_uncertainties_um, greatest_chord_um, greatest_axis_deviation_deg, adapted_shift_mm, adapted_turn_deg, " \
  "shape_gouge_um, shape_rest_um, deepest_compensation_um"
constexpr char kInsertToolPath[] =
    "INSERT INTO correction_tool_paths (correction_id, group_name, " SIXPOINT_TOOL_PATH_COLUMNS
    ") VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17)";
constexpr char kSelectToolPaths[] =
    "SELECT group_name, " SIXPOINT_TOOL_PATH_COLUMNS " FROM correction_tool_paths WHERE correction_id = $1";
#undef SIXPOINT_TOOL_PATH_COLUMNS

template <std::size_t kCount>
void Append(const std::array<double, kCount>& from, std::vector<double>* to) {
  to->insert(to->end(), from.begin(), from.end());
}

template <std::size_t kCount>
std::array<double, kCount> At(const std::vector<double>& values, std::size_t pose) {
  std::array<double, kCount> at;
  std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(kCount * pose), kCount, at.begin());
  return at;
}

absl::StatusOr<CorrectionToolPathRow> ReadPath(const Rows& rows, int row) {
  const std::vector<double> tips = rows.Reals(row, 1), nominal_tips = rows.Reals(row, 2),
                            commanded = rows.Reals(row, 3), nominal = rows.Reals(row, 4), tilts = rows.Reals(row, 6),
                            turns = rows.Reals(row, 7), starts = rows.Reals(row, 8);
  const std::vector<double> reached = OptionalRealsAt(rows, row, 5);
  CorrectionToolPathRow path;
  path.greatest_chord_um = rows.Real(row, 9);
  path.greatest_axis_deviation_deg = rows.Real(row, 10);
  if (!rows.IsNull(row, 11))
    path.adaptation = {rows.Real(row, 11), rows.Real(row, 12), rows.Real(row, 13), rows.Real(row, 14),
                       rows.OptionalReal(row, 15)};
  if (absl::Status read = rows.status(); !read.ok()) return read;
  const std::size_t count = tilts.size();
  if (tips.size() != 3 * count || nominal_tips.size() != 3 * count || commanded.size() != 2 * count ||
      nominal.size() != 2 * count || turns.size() != 2 * count || starts.size() != count ||
      (!reached.empty() && reached.size() != 2 * count))
    return absl::DataLossError("a stored path with columns of other lengths, want as many poses in each");
  for (std::size_t i = 0; i < count; ++i) {
    CorrectionToolPoseRow& pose = path.poses.emplace_back();
    pose.tip_mm = At<3>(tips, i);
    pose.nominal_tip_mm = At<3>(nominal_tips, i);
    pose.commanded_deg = At<2>(commanded, i);
    pose.nominal_deg = At<2>(nominal, i);
    if (!reached.empty()) pose.reached_deg = At<2>(reached, i);
    pose.tilt_deg = tilts[i];
    pose.standard_uncertainty_deg = At<2>(turns, i);
    pose.expanded_uncertainty_um = starts[i];
  }
  return path;
}

}  // namespace

absl::Status InsertCorrectionToolPath(Transaction& transaction, const std::string& correction_id,
                                      const std::string& group, const CorrectionToolPathRow& path) {
  std::vector<double> tips, nominal_tips, commanded, nominal, reached, tilts, turns, starts;
  for (const CorrectionToolPoseRow& pose : path.poses) {
    Append(pose.tip_mm, &tips);
    Append(pose.nominal_tip_mm, &nominal_tips);
    Append(pose.commanded_deg, &commanded);
    Append(pose.nominal_deg, &nominal);
    if (pose.reached_deg) Append(*pose.reached_deg, &reached);
    tilts.push_back(pose.tilt_deg);
    Append(pose.standard_uncertainty_deg, &turns);
    starts.push_back(pose.expanded_uncertainty_um);
  }
  Params params;
  params.Uuid(correction_id).Text(group).Reals(tips).Reals(nominal_tips).Reals(commanded).Reals(nominal);
  AddOptionalReals(reached, &params);
  params.Reals(tilts).Reals(turns).Reals(starts).Real(path.greatest_chord_um).Real(path.greatest_axis_deviation_deg);
  if (const auto& adapted = path.adaptation)
    params.Real(adapted->greatest_shift_mm)
        .Real(adapted->greatest_turn_deg)
        .Real(adapted->gouge_um)
        .Real(adapted->rest_um)
        .OptionalReal(adapted->deepest_compensation_um);
  else
    params.Null().Null().Null().Null().Null();
  return transaction.Execute(kInsertToolPath, params).status();
}

absl::StatusOr<std::map<std::string, CorrectionToolPathRow>> CorrectionToolPathsOf(Transaction& transaction,
                                                                                   const std::string& correction_id) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectToolPaths, Params().Uuid(correction_id));
  if (!rows.ok()) return rows.status();
  std::map<std::string, CorrectionToolPathRow> paths;
  for (int row = 0; row < rows->count(); ++row) {
    absl::StatusOr<CorrectionToolPathRow> path = ReadPath(*rows, row);
    if (!path.ok()) return path.status();
    paths[rows->Text(row, 0)] = *std::move(path);
  }
  return rows->Checked(std::move(paths));
}

}  // namespace sixpoint::storage
