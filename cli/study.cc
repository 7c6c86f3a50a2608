
#include <filesystem>

#include "cli/calibration_options.h"
#include "cli/cloud_files.h"
#include "cli/commands.h"
#include "cli/document.h"
#include "cli/output.h"
#include "cli/study_reports.h"
#include "cli/table.h"
#include "services/runtime/geometry_proto.h"
#include "sixpoint/calibration/v1/study.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using calibration::v1::Study;
using calibration::v1::StudyService;

constexpr std::size_t kMostItems = 100000;

struct StudyArguments : CalibrationOptions {
  std::string machine, file, calibration;
  std::vector<std::string> names, region;
  double limit = 0, pitch_mm = 0;
};

template <typename Request>
absl::Status Run(Session* session,
                 grpc::Status (StudyService::Stub::*method)(grpc::ClientContext*, const Request&, Study*),
                 const StudyArguments& arguments, Request request) {
  SetStudyOptions(arguments, &request);
  const absl::StatusOr<Study> study =
      CallAndPrint<StudyService>(session, "calibration", method, request, StudyText, "at work on the study");
  if (!study.ok()) return study.status();
  if (study->verdict() == calibration::v1::STUDY_VERDICT_REJECTED ||
      study->verdict() == calibration::v1::STUDY_VERDICT_UNDECIDABLE)
    session->MarkNotUsable();
  return absl::OkStatus();
}

absl::Status RunGauge(Session* session, const StudyArguments& arguments) {
  calibration::v1::RunGaugeStudyRequest request;
  for (const std::string& scan : arguments.names) request.add_scans(NameText("scans", scan));
  if (!arguments.region.empty()) {
    auto* region = request.mutable_region();
    region->set_x_minimum_mm(std::stod(arguments.region[0]));
    region->set_x_maximum_mm(std::stod(arguments.region[1]));
    region->set_y_minimum_mm(std::stod(arguments.region[2]));
    region->set_y_maximum_mm(std::stod(arguments.region[3]));
  }
  request.set_station_pitch_mm(arguments.pitch_mm);
  request.set_limit_um(arguments.limit);
  return Run(session, &StudyService::Stub::RunGaugeStudy, arguments, request);
}

absl::Status RunArm(Session* session, const StudyArguments& arguments) {
  calibration::v1::RunArmStudyRequest request;
  for (const std::string& scan : arguments.names) request.add_scans(NameText("scans", scan));
  if (!arguments.calibration.empty()) request.set_sensor_calibration(CalibrationNameText(arguments.calibration));
  request.set_limit_um(arguments.limit);
  return Run(session, &StudyService::Stub::RunArmStudy, arguments, request);
}

absl::Status RunCheck(Session* session, const StudyArguments& arguments) {
  calibration::v1::RunInterimCheckRequest request;
  request.set_machine(NameText("machines", arguments.machine));
  for (const std::string& scan : arguments.names) request.add_scans(NameText("scans", scan));
  if (!arguments.calibration.empty()) request.set_sensor_calibration(CalibrationNameText(arguments.calibration));
  request.set_limit_um(arguments.limit);
  return Run(session, &StudyService::Stub::RunInterimCheck, arguments, request);
}

absl::Status RunRepeat(Session* session, const StudyArguments& arguments) {
  calibration::v1::RunRepeatStudyRequest request;
  for (const std::string& name : arguments.names) request.add_calibrations(CalibrationNameText(name));
  return Run(session, &StudyService::Stub::RunRepeatStudy, arguments, request);
}

// {outer, inner, unit, part: inner | outer, observations: [[outer level, inner level, value], ...]}
absl::Status RunRr(Session* session, const StudyArguments& arguments) {
  const absl::StatusOr<nlohmann::json> document = LoadDocument(arguments.file);
  if (!document.ok()) return document.status();
  Problems problems(/*strict=*/true);
  const Field root(&*document, "", &problems);
  root.OnlyKeys({"outer", "inner", "unit", "part", "confidence", "balanced_only", "limit_percent", "observations"});
  calibration::v1::RunGaugeRrRequest request;
  request.set_outer_name(root.At("outer").Text());
  request.set_inner_name(root.At("inner").Text());
  request.set_unit(root.At("unit").Text());
  if (const auto part = root.Find("part"))
    request.set_part_level(part->Choice({"inner", "outer"}) == "outer" ? calibration::v1::PART_LEVEL_OUTER
                                                                       : calibration::v1::PART_LEVEL_INNER);
  if (const auto confidence = root.Find("confidence")) request.set_confidence(confidence->Number(0.5, 0.999));
  if (const auto balanced = root.Find("balanced_only")) request.set_balanced_only(balanced->Flag());
  if (const auto limit = root.Find("limit_percent")) request.set_limit_percent(limit->Positive(1000));
  for (const Field& item : root.At("observations").Items(1, kMostItems)) {
    item.OnlyKeys({"outer", "inner", "value"});
    calibration::v1::Observation* out = request.add_observations();
    out->set_outer(item.At("outer").Text());
    out->set_inner(item.At("inner").Text());
    out->set_value(item.At("value").Number());
  }
  if (!problems.empty()) return problems.ToStatus();
  if (!arguments.machine.empty()) request.set_machine(NameText("machines", arguments.machine));
  return Run(session, &StudyService::Stub::RunGaugeRr, arguments, request);
}

absl::Status RunSphere(Session* session, const StudyArguments& arguments) {
  const absl::StatusOr<nlohmann::json> document = LoadDocument(arguments.file);
  if (!document.ok()) return document.status();
  Problems problems(/*strict=*/true);
  const Field root(&*document, "", &problems);
  root.OnlyKeys({"points_mm", "diameter_mm", "diameter_standard_uncertainty_um", "sphere_form_um", "form_mpe_um",
                 "size_mpe_um", "length_mpe_um", "length_mpe_divisor", "least_points", "lengths", "points_file",
                 "optical", "dispersion_mpe_um", "plane_points_file", "plane_form_um", "flat_form_mpe_um"});
  calibration::v1::RunSphereCheckRequest request;
  // A scanner's thousands of points come as a cloud.
  const auto points_of = [&](const char* key, auto* out) -> absl::Status {
    const auto field = root.Find(key);
    if (!field) return absl::OkStatus();
    const absl::StatusOr<metrology::Points> points =
        ReadCloud((std::filesystem::path(arguments.file).parent_path() / field->Text()).string());
    if (!points.ok()) return points.status();
    for (const Eigen::Vector3d& point : *points) runtime::ToProto(point, out->Add());
    return absl::OkStatus();
  };
  absl::Status read = points_of("points_file", request.mutable_points_mm());
  if (read.ok()) read = points_of("plane_points_file", request.mutable_plane_points_mm());
  if (!read.ok()) return read;
  if (request.points_mm().empty())
    for (const Field& point : root.At("points_mm").Items(1, kMostItems))
      runtime::ToProto(point.Vector3(), request.add_points_mm());
  if (const auto optical = root.Find("optical")) request.set_optical(optical->Flag());
  request.set_diameter_mm(root.At("diameter_mm").Positive(10000));
  const auto optional = [&](const char* key) {
    const auto field = root.Find(key);
    return field ? field->Number(0, 1e6) : 0.0;
  };
  request.set_diameter_standard_uncertainty_um(optional("diameter_standard_uncertainty_um"));
  request.set_sphere_form_um(optional("sphere_form_um"));
  request.set_form_mpe_um(optional("form_mpe_um"));
  request.set_size_mpe_um(optional("size_mpe_um"));
  request.set_length_mpe_um(optional("length_mpe_um"));
  request.set_length_mpe_divisor(optional("length_mpe_divisor"));
  request.set_dispersion_mpe_um(optional("dispersion_mpe_um"));
  request.set_plane_form_um(optional("plane_form_um"));
  request.set_flat_form_mpe_um(optional("flat_form_mpe_um"));
  if (const auto least = root.Find("least_points"))
    request.set_least_points(static_cast<std::int32_t>(least->Whole(5, 100000)));
  if (const auto lengths = root.Find("lengths"))
    for (const Field& item : lengths->Items(0, kMostItems)) {
      item.OnlyKeys({"standard", "calibrated_mm", "calibrated_standard_uncertainty_um", "measured_mm"});
      calibration::v1::LengthMeasurement* out = request.add_lengths();
      out->set_standard(item.At("standard").Text());
      out->set_calibrated_mm(item.At("calibrated_mm").Positive(100000));
      out->set_calibrated_standard_uncertainty_um(item.At("calibrated_standard_uncertainty_um").Number(0, 1e6));
      out->set_measured_mm(item.At("measured_mm").Number());
    }
  if (!problems.empty()) return problems.ToStatus();
  if (!arguments.machine.empty()) request.set_machine(NameText("machines", arguments.machine));
  return Run(session, &StudyService::Stub::RunSphereCheck, arguments, request);
}

Option* AddScans(Command* command, const std::shared_ptr<StudyArguments>& arguments) {
  return command->AddOption("--scans", &arguments->names, "ID,ID,... in the order in which they were made")
      ->Required()
      ->List();
}

absl::Status ShowStudy(Session* session, const std::string& name) {
  calibration::v1::GetStudyRequest request;
  request.set_name(NameText("studies", name));
  return CallAndPrint<StudyService>(session, "calibration", &StudyService::Stub::GetStudy, request, StudyText).status();
}

}  // namespace

void AddCalibrateStudyCommands(Command* calibrate, Session* session) {
  const auto gauge_arguments = std::make_shared<StudyArguments>();
  Command* gauge = calibrate->AddCommand("gauge", "What the scanner repeats, from superposed scans of a ground face");
  AddScans(gauge, gauge_arguments);
  gauge->AddOption("--region-mm", &gauge_arguments->region, "X0,X1,Y0,Y1 in the sensor frame; without it, all")
      ->List()
      ->Count(4)
      ->Numbers();
  gauge->AddOption("--station-pitch-mm", &gauge_arguments->pitch_mm, "0.1 without it");
  gauge->AddOption("--limit-um", &gauge_arguments->limit, "Greatest median oscillation that is accepted");
  AddTemperatureOption(gauge, gauge_arguments);
  session->OnCommand(gauge, [session, gauge_arguments] { return RunGauge(session, *gauge_arguments); });

  const auto arm_arguments = std::make_shared<StudyArguments>();
  Command* arm = calibrate->AddCommand("arm", "What the arm repeats, from scans of kind arm");
  AddScans(arm, arm_arguments);
  arm->AddOption("--calibration", &arm_arguments->calibration, "Of the sensor; without it, the one in force");
  arm->AddOption("--limit-um", &arm_arguments->limit, "Greatest standard deviation of dx, dy, dz that is accepted");
  AddTemperatureOption(arm, arm_arguments);
  session->OnCommand(arm, [session, arm_arguments] { return RunArm(session, *arm_arguments); });

  const auto check_arguments = std::make_shared<StudyArguments>();
  Command* check =
      calibrate->AddCommand("check", "Whether the scanner still stands as calibrated: the artefact scanned again");
  check->AddOption("--machine", &check_arguments->machine, "Whose scanner")->Required();
  AddScans(check, check_arguments);
  check->AddOption("--calibration", &check_arguments->calibration,
                   "Of the sensor; without it, the one that was in force when the scans came");
  check->AddOption("--limit-um", &check_arguments->limit,
                   "Greatest displacement that is accepted; without it, what the machine's record says");
  AddTemperatureOption(check, check_arguments);
  session->OnCommand(check, [session, check_arguments] { return RunCheck(session, *check_arguments); });
}

void AddStudyCommands(Command* app, Session* session) {
  Command* study = app->AddCommand("study", "What instruments and procedures can do (also: calibrate gauge, arm)");
  study->RequireCommand();
  const auto arguments = std::make_shared<StudyArguments>();

  AddListCommand<StudyService>(study, session, "Lists studies", "calibration", &StudyService::Stub::ListStudies,
                               calibration::v1::ListStudiesRequest(),
                               Table({"study", "kind", "machine", "verdict", "by", "recorded"}),
                               &calibration::v1::ListStudiesResponse::studies, [](const Study& made) {
                                 return Cells{IdText(made.name()),
                                              StudyKindText(made.kind()),
                                              made.machine().empty() ? "-" : IdText(made.machine()),
                                              StudyVerdictName(made.verdict()),
                                              made.requested_by(),
                                              TimeText(made.recorded_at())};
                               });

  Command* show = study->AddCommand("show", "Shows a study with the uncertainty of each number");
  show->AddOption("ID", &arguments->file, "The study")->Required();
  session->OnCommand(show, [session, arguments] { return ShowStudy(session, arguments->file); });

  Command* repeat = study->AddCommand("repeat", "The tables of a sensor calibration made several times");
  repeat->AddOption("--calibrations", &arguments->names, "ID,ID,...; drafts too")->Required()->List();
  AddTemperatureOption(repeat, arguments);
  session->OnCommand(repeat, [session, arguments] { return RunRepeat(session, *arguments); });

  Command* rr = study->AddCommand("rr", "Gauge R&R: components of variance of nested data");
  rr->AddOption("FILE", &arguments->file, "YAML or JSON, as docs/examples/gauge_rr.yaml")->Required();
  rr->AddOption("--machine", &arguments->machine, "Which it concerns");
  AddTemperatureOption(rr, arguments);
  session->OnCommand(rr, [session, arguments] { return RunRr(session, *arguments); });

  Command* sphere = study->AddCommand("sphere", "A probe on a calibrated sphere and length standards");
  sphere->AddOption("FILE", &arguments->file, "YAML or JSON, as docs/examples/sphere_check.yaml")->Required();
  sphere->AddOption("--machine", &arguments->machine, "Which it concerns");
  AddTemperatureOption(sphere, arguments);
  session->OnCommand(sphere, [session, arguments] { return RunSphere(session, *arguments); });
}

}  // namespace sixpoint::cli
