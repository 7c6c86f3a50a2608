// `calibrate probe`: the document of readings, the call and what an engineer reads of it.
#include "cli/calibrate_probe.h"

#include <cmath>

#include "cli/calibration_options.h"
#include "cli/commands.h"
#include "cli/document.h"
#include "cli/number_format.h"
#include "cli/output.h"
#include "cli/reports.h"
#include "cli/table.h"
#include "services/runtime/geometry_proto.h"
#include "sixpoint/calibration/v1/calibration.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using calibration::v1::CalibrateProbeRequest;
using calibration::v1::CalibrationService;

constexpr std::size_t kMostFaces = 24, kMostReadings = 5000, kMostTouched = 1000;
constexpr double kGreatestUm = 1000;

void ReadFaces(const Field& faces, google::protobuf::RepeatedPtrField<calibration::v1::ProbedFace>* out) {
  for (const Field& item : faces.Items(1, kMostFaces)) {
    item.OnlyKeys({"face", "nominal_normal", "touched_mm"});
    calibration::v1::ProbedFace* face = out->Add();
    face->set_face(item.At("face").Id());
    const Field normal = item.At("nominal_normal");
    const Eigen::Vector3d direction = normal.Vector3();
    if (normal.present() && !(direction.norm() > 0)) normal.Refuse("a direction that is not zero");
    runtime::ToProto(Eigen::Vector3d(direction.normalized()), face->mutable_nominal_normal());
    for (const Field& point : item.At("touched_mm").Items(3, kMostTouched))
      runtime::ToProto(point.Vector3(), face->add_touched_mm());
  }
}

void ReadReadings(const Field& readings, google::protobuf::RepeatedPtrField<calibration::v1::ProbeReading>* out) {
  for (const Field& item : readings.Items(1, kMostReadings)) {
    item.OnlyKeys({"face", "position_mm", "displacement_mm"});
    calibration::v1::ProbeReading* reading = out->Add();
    reading->set_face(item.At("face").Id());
    runtime::ToProto(item.At("position_mm").Vector3(), reading->mutable_position_mm());
    reading->set_displacement_mm(item.At("displacement_mm").Number());
  }
}

}  // namespace

CalibrateProbeRequest ReadProbeReadings(const Field& root) {
  root.OnlyKeys({"block", "noise_um", "touch_standard_uncertainty_um", "position_standard_uncertainty_um",
                 "least_displacement_mm", "greatest_displacement_mm", "greatest_approach_angle_deg", "faces",
                 "readings", "moved"});
  CalibrateProbeRequest request;
  request.set_block(root.At("block").Id());
  request.set_noise_um(root.At("noise_um").Positive(kGreatestUm));
  if (const auto u = root.Find("touch_standard_uncertainty_um"))
    request.set_touch_standard_uncertainty_um(u->Positive(kGreatestUm));
  if (const auto u = root.Find("position_standard_uncertainty_um"))
    request.set_position_standard_uncertainty_um(u->Number(0, kGreatestUm));
  request.set_least_displacement_mm(root.At("least_displacement_mm").Number());
  request.set_greatest_displacement_mm(root.At("greatest_displacement_mm").Number());
  if (const auto angle = root.Find("greatest_approach_angle_deg"))
    request.set_greatest_approach_angle_deg(angle->Number(1, 90));
  ReadFaces(root.At("faces"), request.mutable_faces());
  ReadReadings(root.At("readings"), request.mutable_readings());
  if (const auto moved = root.Find("moved")) {
    moved->OnlyKeys({"faces", "readings"});
    ReadFaces(moved->At("faces"), request.mutable_moved_faces());
    ReadReadings(moved->At("readings"), request.mutable_moved_readings());
  }
  return request;
}

absl::StatusOr<CalibrateProbeRequest> LoadProbeReadings(const std::string& path) {
  const absl::StatusOr<nlohmann::json> document = LoadDocument(path);
  if (!document.ok()) return document.status();
  Problems problems(true);
  CalibrateProbeRequest request = ReadProbeReadings(Field(&*document, "", &problems));
  if (!problems.empty()) return problems.ToStatus();
  return request;
}

std::string ProbeText(const calibration::v1::ProbeCalibration& probe) {
  Table table({"parameter", ">value", ">standard uncertainty", "unit"});
  const auto sigma = [&](int k) {
    const int at = 7 * k;
    return at < probe.covariance().values_size() ? std::sqrt(probe.covariance().values(at)) : std::nan("");
  };
  const char* const axes[] = {"x", "y", "z"};
  for (int k = 0; k < 3 && k < probe.approach_size(); ++k)
    table.AddRow({std::string("approach ") + axes[k], Fixed(probe.approach(k), 7), FixedOrTiny(sigma(k), 7), "mm/mm"});
  const geometry::v1::Point& t = probe.offset_mm();
  const double offset[] = {t.x_mm(), t.y_mm(), t.z_mm()};
  for (int k = 0; k < 3; ++k)
    table.AddRow({std::string("offset ") + axes[k], Fixed(offset[k], 5), FixedOrTiny(sigma(3 + k), 5), "mm"});
  table.AddRow({"scale", Fixed(probe.scale(), 7), FixedOrTiny(probe.scale_standard_uncertainty(), 7), "mm/mm"});
  std::string beam;
  for (const double a : probe.approach()) beam += (beam.empty() ? "" : ", ") + Fixed(a / probe.scale(), 6);
  table.AddRow({"beam direction", beam, FixedOrTiny(probe.direction_standard_uncertainty_urad(), 1), "urad"});
  const geometry::v1::Point& p = probe.point_standard_uncertainty_mm();
  table.AddRow({"point at mid range x", "", FixedOrTiny(p.x_mm(), 5), "mm"});
  table.AddRow({"point at mid range y", "", FixedOrTiny(p.y_mm(), 5), "mm"});
  table.AddRow({"point at mid range z", "", FixedOrTiny(p.z_mm(), 5), "mm"});
  std::string text = table.ToText() + "block " + probe.block() + ": residual rms " +
                     FixedOrTiny(probe.residual_rms_um(), 3) + " um of displacement (stated " +
                     Fixed(probe.noise_um(), 3) + "), touch rms " + FixedOrTiny(probe.touch_rms_um(), 3) +
                     " um; condition number " + Fixed(probe.condition_number(), 1) + ", of the displacement matrix " +
                     Fixed(probe.displacement_matrix_condition_number(), 1) + "; steepest approach " +
                     Fixed(probe.worst_approach_angle_deg(), 1) + " deg\n";
  if (probe.noise_factor() > 1)
    text +=
        "Residuals are " + Fixed(probe.noise_factor(), 1) + " times what was stated; the uncertainties follow them.\n";
  Table check(
      {"check: block moved", ">readings", ">angle mrad", ">distance um", ">distance to origin um", ">range um"});
  for (const auto& face : probe.check())
    check.AddRow({face.face(), std::to_string(face.reading_count()), Fixed(1e-3 * face.angle_urad(), 3),
                  Fixed(face.distance_um(), 2), Fixed(face.origin_distance_um(), 2),
                  Fixed(face.residual_range_um(), 2)});
  return text + (check.empty() ? "" : check.ToText());
}

void AddCalibrateProbeCommand(Command* calibrate, Session* session) {
  struct Arguments : CalibrationOptions {
    std::string machine, file, method;
  };
  const auto arguments = std::make_shared<Arguments>();
  Command* probe = calibrate->AddCommand("probe", "Point laser probe, from readings on the faces of a touched block");
  probe->AddOption("--machine", &arguments->machine, "The machine")->Required();
  probe->AddOption("--readings", &arguments->file, "The block's touched faces and the readings (YAML or JSON)")
      ->Required();
  probe->AddOption("--method", &arguments->method, "weighted (the default) or linear")->OneOf({"weighted", "linear"});
  AddCalibrationOptions(probe, arguments);
  session->OnCommand(probe, [session, arguments]() -> absl::Status {
    absl::StatusOr<CalibrateProbeRequest> request = LoadProbeReadings(arguments->file);
    if (!request.ok()) return request.status();
    request->set_machine(NameText("machines", arguments->machine));
    request->set_method(arguments->method == "linear" ? calibration::v1::PROBE_METHOD_LINEAR
                                                      : calibration::v1::PROBE_METHOD_WEIGHTED);
    SetCalibrationOptions(*arguments, &*request);
    return CallAndPrint<CalibrationService>(session, "calibration", &CalibrationService::Stub::CalibrateProbe, *request,
                                            CalibrationText, "calibrating the probe")
        .status();
  });
}

}  // namespace sixpoint::cli
