#include "cli/calibration_documents.h"

#include <cctype>
#include <nlohmann/json.hpp>

#include "cli/plant_documents.h"
#include "services/runtime/geometry_proto.h"

namespace sixpoint::cli {
namespace {

constexpr std::size_t kGreatestProbedPointCount = 10000;

void ReadProbedPoints(const Field& touch, const std::string& key,
                      google::protobuf::RepeatedPtrField<geometry::v1::Point>* out) {
  const auto points = touch.Find(key);
  if (!points) return;
  for (const Field& point : points->Items(0, kGreatestProbedPointCount)) runtime::ToProto(point.Vector3(), out->Add());
}

absl::StatusOr<nlohmann::json> LoadMember(const std::string& path, const std::string& key, std::string* member_path) {
  absl::StatusOr<nlohmann::json> document = LoadDocument(path);
  if (!document.ok()) return document.status();
  if (document->is_object() && document->contains(key)) {
    *member_path = key;
    return nlohmann::json((*document)[key]);
  }
  return document;
}

}  // namespace

calibration::v1::TouchData ReadTouchData(const Field& touch) {
  touch.OnlyKeys({"frame", "centres", "plane", "side_x", "side_y", "standard_uncertainty_um"});
  calibration::v1::TouchData out;
  if (const auto frame = touch.Find("frame")) frame->Choice({"table", "machine"});
  for (const auto& [feature, centre] : touch.At("centres").Members(1, kGreatestFeatureCount)) {
    calibration::v1::NamedPoint* point = out.add_centres();
    point->set_feature(feature);
    runtime::ToProto(centre.Vector3(), point->mutable_point_mm());
  }
  ReadProbedPoints(touch, "plane", out.mutable_plane_mm());
  ReadProbedPoints(touch, "side_x", out.mutable_side_x_mm());
  ReadProbedPoints(touch, "side_y", out.mutable_side_y_mm());
  if (const auto sigma = touch.Find("standard_uncertainty_um")) out.set_standard_uncertainty_um(sigma->Positive(1000));
  return out;
}

std::vector<calibration::v1::SpherePose> ReadSpherePoses(const Field& poses, const AxisPair& axes) {
  const auto key_of = [](std::string letter) {
    for (char& c : letter) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return letter + "_deg";
  };
  const std::string bed = key_of(axes[0]), carried = key_of(axes[1]);
  std::vector<calibration::v1::SpherePose> out;
  for (const Field& item : poses.Items(1, kGreatestProbedPointCount)) {
    item.OnlyKeys({bed, carried, "centre_mm", "use"});
    calibration::v1::SpherePose& pose = out.emplace_back();
    pose.set_a_deg(item.At(bed).Number(-3600, 3600));
    pose.set_b_deg(item.At(carried).Number(-3600, 3600));
    runtime::ToProto(item.At("centre_mm").Vector3(), pose.mutable_centre_mm());
    const auto use = item.Find("use");
    pose.set_held_out(use && use->Choice({"fit", "check"}) == "check");
  }
  return out;
}

absl::StatusOr<calibration::v1::TouchData> LoadTouchData(const std::string& path) {
  std::string member_path;
  absl::StatusOr<nlohmann::json> document = LoadMember(path, "touch_probe", &member_path);
  if (!document.ok()) return document.status();
  Problems problems(member_path.empty());
  calibration::v1::TouchData touch = ReadTouchData(Field(&*document, member_path, &problems));
  if (!problems.empty()) return problems.ToStatus();
  return touch;
}

absl::StatusOr<std::vector<calibration::v1::SpherePose>> LoadSpherePoses(const std::string& path,
                                                                         const AxisPair& axes) {
  std::string member_path;
  absl::StatusOr<nlohmann::json> document = LoadMember(path, "sphere_poses", &member_path);
  if (!document.ok()) return document.status();
  Problems problems(member_path.empty());
  std::vector<calibration::v1::SpherePose> poses = ReadSpherePoses(Field(&*document, member_path, &problems), axes);
  if (!problems.empty()) return problems.ToStatus();
  return poses;
}

calibration::v1::AxisRun ReadAxisRun(const Field& in) {
  constexpr std::size_t kMostReadings = 200'000;
  in.OnlyKeys({"commanded_deg", "measured_deg", "error_deg", "direction"});
  calibration::v1::AxisRun run;
  for (const Field& value : in.At("commanded_deg").Items(1, kMostReadings)) run.add_commanded_deg(value.Number());
  // An error is measured minus commanded.
  const std::optional<Field> errors = in.Find("error_deg");
  const Field measured = errors ? *errors : in.At("measured_deg");
  for (const Field& value : measured.Items(1, kMostReadings)) {
    const int i = run.measured_deg_size();
    run.add_measured_deg(value.Number() + (errors && i < run.commanded_deg_size() ? run.commanded_deg(i) : 0));
  }
  if (const std::optional<Field> directions = in.Find("direction"))
    for (const Field& value : directions->Items(1, kMostReadings)) {
      const std::int64_t direction = value.Whole(-1, 1);
      if (direction == 0) value.Refuse("1 or -1");
      run.add_travel(direction > 0 ? calibration::v1::TRAVEL_FORWARD : calibration::v1::TRAVEL_BACKWARD);
    }
  return run;
}

absl::StatusOr<calibration::v1::AxisRun> LoadAxisRun(const std::string& path, const std::string& axis) {
  std::string member_path;
  const absl::StatusOr<nlohmann::json> document = LoadMember(path, "axis_runs", &member_path);
  if (!document.ok()) return document.status();
  Problems problems(member_path.empty());
  const Field root(&*document, member_path, &problems);
  calibration::v1::AxisRun run = ReadAxisRun(member_path.empty() ? root : root.At(axis));
  if (!problems.empty()) return problems.ToStatus();
  return run;
}

absl::StatusOr<calibration::v1::StandardProbing> LoadStandardProbing(const std::string& path) {
  const absl::StatusOr<nlohmann::json> document = LoadDocument(path);
  if (!document.ok()) return document.status();
  Problems problems(true);
  const Field root(&*document, "", &problems);
  root.OnlyKeys({"bore_mm", "face_mm", "face_above_centre_mm"});
  calibration::v1::StandardProbing probing;
  for (const Field& point : root.At("bore_mm").Items(4, kGreatestProbedPointCount))
    runtime::ToProto(point.Vector3(), probing.add_bore_mm());
  for (const Field& point : root.At("face_mm").Items(3, kGreatestProbedPointCount))
    runtime::ToProto(point.Vector3(), probing.add_face_mm());
  probing.set_face_above_centre_mm(root.At("face_above_centre_mm").Number());
  if (!problems.empty()) return problems.ToStatus();
  return probing;
}

}  // namespace sixpoint::cli
