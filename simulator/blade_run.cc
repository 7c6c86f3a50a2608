#include "simulator/blade_run.h"

#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "metrology/frames/angles.h"
#include "services/runtime/geometry_proto.h"
#include "simulator/blade_requests.h"
#include "simulator/fixture.h"
#include "simulator/hole_comparison.h"
#include "simulator/nc_program.h"
#include "simulator/registry.h"

namespace sixpoint::simulator {
namespace {

using metrology::kRadPerDeg;
constexpr double kPinStandsOut_mm = 2.5;
using Clock = std::chrono::steady_clock;
double SecondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

template <typename... Values>
std::string Text(const char* format, Values... values) {
  char text[256];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

// Streams of random numbers, each for one purpose.
enum Stream : std::uint64_t { kMounting, kClamping, kProbing, kSphere, kCasting, kDrilling, kNeighbours, kScans = 100 };

class BladeRun {
 public:
  BladeRun(PlantLink& plant, const MachineDesign& design, const DesignedPart& part, const BladeRunPlan& plan,
           const std::function<void(const std::string&)>& say, BladeRunResult* result)
      : plant_(plant), design_(design), part_(part), plan_(plan), say_(say), result_(*result) {
    truth_ = MountedByHand(design, plan.mounting_seed == 0 ? SeedOf(kMounting) : plan.mounting_seed);
    for (const auto& group : part.hole_groups)
      for (const auto& hole : group.holes) checked_points_mm_.push_back(hole.start_mm);
    for (const auto& datum : part.six_points) checked_points_mm_.push_back(datum.point_mm);
  }

  absl::Status Run() {
    const auto start = Clock::now();
    if (absl::Status status = Clamp(); !status.ok()) return status;
    using Step = absl::Status (BladeRun::*)();
    std::vector<Step> steps = {&BladeRun::Register};
    if (plan_.calibrate) steps.insert(steps.end(), {&BladeRun::CalibrateSensor, &BladeRun::CalibrateRotation});
    steps.insert(steps.end(), {&BladeRun::Position, &BladeRun::Correct});
    if (!plan_.stop_at_correction) steps.insert(steps.end(), {&BladeRun::DrillByProgram, &BladeRun::Inspect});
    for (const Step step : steps) {
      if (step == &BladeRun::Position && plan_.since_calibration) plan_.since_calibration(&truth_);
      if (step == &BladeRun::Correct && plan_.before_correction)
        if (absl::Status status = plan_.before_correction(); !status.ok()) return status;
      const absl::Status status = (this->*step)();
      result_.total_s = SecondsSince(start);
      if (!status.ok()) return status;
    }
    return absl::OkStatus();
  }

 private:
  std::uint64_t SeedOf(std::uint64_t stream) const { return Random::StreamSeed(plan_.seed, stream); }
  void Say(const std::string& text) const { say_(plan_.machine_id + "  " + text); }

  absl::Status Clamp() {
    auto there = AtStation(part_, plan_.station);
    if (!there.ok()) return there.status();
    there_ = *std::move(there);
    zero_from_part_ = plan_.zero_from_part ? *plan_.zero_from_part : ClampedByHand(there_, 1, 1, SeedOf(kClamping));
    neighbours_ = NeighboursByHand(part_, plan_.station, 1, 1, SeedOf(kNeighbours));
    return absl::OkStatus();
  }

  absl::Status Register() {
    auto machine = RegisterMachine(plant_, plan_.machine_id, design_);
    if (!machine.ok()) return machine.status();
    auto blade = RegisterBlade(plant_, plan_.blade_serial, plan_.part);
    if (!blade.ok()) return blade.status();
    result_.machine = *machine;
    result_.blade = *blade;
    result_.is_casting = plan_.casting_mm > 0;
    return absl::OkStatus();
  }

  // Scans, streams, and returns when the scan is durable.
  absl::StatusOr<std::string> ScanAndUpload(const std::string& name, ingest::v1::ScanKind kind,
                                            const std::string& subject, const Scene& scene, const ScanPlan& scan_plan) {
    const auto start = Clock::now();
    ingest::v1::ScanHeader header;
    header.set_scan_id(plan_.scan_prefix + name);
    header.set_machine(result_.machine);
    header.set_subject(subject);
    header.set_kind(kind);
    if (subject == result_.blade) header.set_station(plan_.station);
    runtime::ToProto(scan_plan.v0_mm, header.mutable_v0_mm());
    header.set_a_deg(scan_plan.a_deg);
    header.set_b_deg(scan_plan.b_deg);
    header.set_profile_pitch_mm(scan_plan.pitch_mm);
    header.set_columns_per_profile(design_.scanner.columns);
    header.set_raw_step_um(design_.scanner.raw_step_um);
    *header.mutable_measured_at() = google::protobuf::util::TimeUtil::GetCurrentTime();
    const ScanProfiles profiles =
        Scan(scene, truth_, design_.scanner, scan_plan, SeedOf(kScans + scan_count_++), plan_.threads);
    auto uploaded = plant_.Upload(std::move(header), profiles, plan_.profiles_per_s);
    if (!uploaded.ok()) return uploaded.status();
    result_.scans.push_back(uploaded->scan().name());
    result_.point_count += uploaded->scan().header().point_count();
    result_.scan_s += SecondsSince(start);
    return uploaded->scan().name();
  }

  absl::Status CalibrateSensor() {
    const ArtefactGeometry artefact;
    constexpr double kProbeNoise_um = 1;
    calibration::v1::CalibrateSensorRequest request =
        SensorRequest(result_.machine, plan_.artefact,
                      ProbeArtefact(artefact, truth_.machine_from_artefact, kProbeNoise_um, Random(SeedOf(kProbing))),
                      kProbeNoise_um);
    int height = 0;
    for (const ScanPlan& scan_plan : PlanArtefact(design_)) {
      Say(Text("scans the artefact, height %d of 2", ++height));
      auto scan = ScanAndUpload("artefact-" + std::to_string(height), ingest::v1::SCAN_KIND_ARTEFACT, plan_.artefact,
                                ArtefactScene(artefact, truth_), scan_plan);
      if (!scan.ok()) return scan.status();
      request.add_scans(*scan);
    }
    const auto start = Clock::now();
    auto calibration = plant_.Call("calibration", &calibration::v1::CalibrationService::Stub::CalibrateSensor, request);
    if (!calibration.ok()) return calibration.status();
    result_.calibrate_s += SecondsSince(start);
    result_.sensor_calibration = *calibration;

    const auto& values = calibration->sensor().machine_from_sensor_rotation();
    if (values.size() != 9) return absl::InternalError("sensor calibration without a rotation");
    Eigen::Matrix3d rotation;
    for (int i = 0; i < 9; ++i) rotation(i / 3, i % 3) = values.Get(i);
    auto t_sm = runtime::FromProto("t_sm_mm", calibration->sensor().t_sm_mm());
    if (!t_sm.ok()) return t_sm.status();
    result_.sensor_angle_error_deg =
        metrology::VectorFromRotation(rotation * truth_.machine_from_sensor.transpose()).cwiseAbs().maxCoeff() /
        kRadPerDeg;
    result_.t_sm_error_um = 1e3 * (*t_sm - truth_.t_sm_mm).norm();
    Say(Text("sensor calibrated: %.4f deg and %.2f um from the truth", result_.sensor_angle_error_deg,
             result_.t_sm_error_um));
    return absl::OkStatus();
  }

  absl::Status CalibrateRotation() {
    constexpr double kProbeNoise_um = 1;
    const calibration::v1::CalibrateRotationRequest request =
        RotationRequest(result_.machine, ProbeSphere(truth_, kProbeNoise_um, SeedOf(kSphere)));
    const auto start = Clock::now();
    auto calibration =
        plant_.Call("calibration", &calibration::v1::CalibrationService::Stub::CalibrateRotation, request);
    if (!calibration.ok()) return calibration.status();
    result_.calibrate_s += SecondsSince(start);
    result_.rotation_calibration = *calibration;
    auto a = runtime::FromProto("a_axis", calibration->rotation().a_axis());
    if (!a.ok()) return a.status();
    auto b = runtime::FromProto("b_axis", calibration->rotation().b_axis());
    if (!b.ok()) return b.status();
    const metrology::RotaryAxes axes{*a, *b};
    for (int a_deg = -50; a_deg <= 50; a_deg += 25)
      for (int b_deg = 0; b_deg < 360; b_deg += 45) {
        const Eigen::Isometry3d found = axes.MachineFromZero(a_deg * kRadPerDeg, b_deg * kRadPerDeg) * zero_from_part_;
        const Eigen::Isometry3d is =
            truth_.axes.MachineFromZero(a_deg * kRadPerDeg, b_deg * kRadPerDeg) * zero_from_part_;
        result_.axes_error_um = std::max(result_.axes_error_um, WorstPlace_um(found, is, checked_points_mm_));
      }
    Say(Text("rotary axes identified: %.2f um from the truth at worst over the part", result_.axes_error_um));
    return absl::OkStatus();
  }

  // All portions of the blade with what stands in it.
  absl::Status ScanBlade(const std::string& name, ingest::v1::ScanKind kind, double pitch_mm, int step_deg,
                         google::protobuf::RepeatedPtrField<std::string>* scans) {
    std::vector<std::pair<double, double>> poses = plan_.poses_deg;
    if (poses.empty()) {
      poses = {{-50, 0}, {-50, 180}};
      for (int b_deg = 0; b_deg < 360; b_deg += step_deg) poses.push_back({0, b_deg});
    }
    std::vector<ScanPlan> plans = PlanBlade(there_, design_, pitch_mm, poses);
    if (!neighbours_.empty()) std::transform(plans.begin(), plans.end(), plans.begin(), OverNeighbours);
    return ScanBy(plans, name, kind, scans);
  }

  // The blade with its pins, and the blades beside it.
  Scene SceneAt(const ScanPlan& scan_plan) const {
    const double a_deg = scan_plan.a_deg, b_deg = scan_plan.b_deg;
    Scene scene = BladeScene(blade_shapes_, truth_, zero_from_part_, a_deg, b_deg);
    for (const Eigen::Isometry3d& neighbour : neighbours_)
      scene.Add(blade_shapes_.front(), truth_.axes.MachineFromZero(a_deg * kRadPerDeg, b_deg * kRadPerDeg) * neighbour);
    return scene;
  }

  absl::Status ScanBy(const std::vector<ScanPlan>& plans, const std::string& name, ingest::v1::ScanKind kind,
                      google::protobuf::RepeatedPtrField<std::string>* scans) {
    for (std::size_t i = 0; i < plans.size(); ++i) {
      const ScanPlan& scan_plan = plans[i];
      Say(Text("scans %s, portion %zu of %zu (A %g, B %g)", name.c_str(), i + 1, plans.size(), scan_plan.a_deg,
               scan_plan.b_deg));
      auto scan = ScanAndUpload(name + "-" + std::to_string(i + 1), kind, result_.blade, SceneAt(scan_plan), scan_plan);
      // A portion that the sensor does not reach is left out, as on a machine.
      if (scan.status().code() == absl::StatusCode::kOutOfRange) continue;
      if (!scan.ok()) return scan.status();
      *scans->Add() = *scan;
    }
    return absl::OkStatus();
  }

  // As the plant's measuring plan has it, instead of what is in `scans`.
  absl::Status ScanByPlan(const std::string& name, bool six_points,
                          google::protobuf::RepeatedPtrField<std::string>* scans) {
    const auto start = Clock::now();
    const auto plan = plant_.Call("registration", &registration::v1::MeasuringPlanService::Stub::PlanMeasurement,
                                  PlanRequest(result_.machine, plan_.part, plan_.station, six_points));
    if (!plan.ok()) return plan.status();
    (six_points ? result_.six_point_plan : result_.whole_plan) = *plan;
    scans->Clear();
    Say(Text("measuring plan of %s in %.1f s: %d sweeps, %.1f %% covered", name.c_str(), SecondsSince(start),
             plan->portions_size(), 100 * LeastCoverage(*plan)));
    return ScanBy(ScansOf(*plan, plan_.airfoil_pitch_mm), name, ingest::v1::SCAN_KIND_AIRFOIL, scans);
  }

  absl::Status Position() {
    metrology::TriangleMesh mesh = plan_.casting_mm == 0 ? part_.mesh : Cast(part_, plan_.casting_mm, SeedOf(kCasting));
    if (plan_.foil_mm > 0) StickFoil(part_.six_points.front(), plan_.foil_mm, &mesh);
    blade_shapes_ = {std::make_shared<TriangleShape>(std::move(mesh))};
    registration::v1::RegisterRequest request;
    request.set_blade(result_.blade);
    const absl::Status scanned = plan_.by_plan ? ScanByPlan("airfoil", false, request.mutable_scans())
                                               : ScanBlade("airfoil", ingest::v1::SCAN_KIND_AIRFOIL,
                                                           plan_.airfoil_pitch_mm, 60, request.mutable_scans());
    if (!scanned.ok()) return scanned;
    request.set_clamping(Clamping());
    for (const registration::v1::Freedom free : plan_.free) request.mutable_options()->add_degrees_of_freedom(free);
    // A casting deviates everywhere but at its datum points, where the nest holds it: only the 3-2-1 variant finds that.
    struct Fit {
      registration::v1::Method method;
      const char* name;
      registration::v1::Registration* registration;
      double* error_um;
    };
    for (const Fit& fit :
         {Fit{registration::v1::METHOD_BEST_FIT, "best fit", &result_.best_fit, &result_.best_fit_error_um},
          Fit{plan_.method != registration::v1::METHOD_UNSPECIFIED ? plan_.method
              : plan_.casting_mm > 0                               ? registration::v1::METHOD_SIX_POINT_NORMALS
                                                                   : registration::v1::METHOD_SIX_POINT,
              "six-point", &result_.six_point, &result_.six_point_error_um}}) {
      if (plan_.only_six_point && fit.registration == &result_.best_fit) continue;
      if (plan_.by_plan && fit.registration == &result_.six_point)
        if (absl::Status status = ScanByPlan("datums", true, request.mutable_scans()); !status.ok()) return status;
      request.set_method(fit.method);
      request.set_request_id(NewRequestId());
      const auto start = Clock::now();
      auto registration = plant_.Call("registration", &registration::v1::RegistrationService::Stub::Register, request);
      if (!registration.ok()) return registration.status();
      result_.register_s += SecondsSince(start);
      *fit.registration = *registration;
      if (registration->evidence().outcome() != registration::v1::OUTCOME_CONVERGED)
        return absl::FailedPreconditionError(std::string(fit.name) + " ended with " +
                                             registration::v1::Outcome_Name(registration->evidence().outcome()));
      auto pose = runtime::FromProto("zero_from_part", registration->zero_from_part());
      if (!pose.ok()) return pose.status();
      *fit.error_um = WorstPlace_um(*pose, zero_from_part_, checked_points_mm_);
      Say(Text("positioned by %s in %.1f s: %.2f um from the truth at the worst hole or datum point", fit.name,
               SecondsSince(start), *fit.error_um));
    }
    return absl::OkStatus();
  }

  absl::Status Correct() {
    correction::v1::CorrectRequest request;
    request.set_registration(result_.six_point.name());
    request.set_nc_template(NominalProgram(part_, design_));
    request.set_request_id(NewRequestId());
    const auto start = Clock::now();
    auto correction = plant_.Call("correction", &correction::v1::CorrectionService::Stub::Correct, request);
    if (!correction.ok()) return correction.status();
    result_.correct_s += SecondsSince(start);
    result_.correction = *correction;
    result_.correction_error_um = WorstStart_um(result_.correction, part_, truth_, zero_from_part_);
    if (plan_.stop_at_correction) return absl::OkStatus();
    if (correction->state() == correction::v1::CORRECTION_STATE_DRAFT) {
      std::string reasons = "the correction waits for a person:";
      for (const std::string& reason : correction->release_reasons()) reasons += " " + reason + ";";
      if (plan_.casting_mm == 0) return absl::FailedPreconditionError(reasons);
      Say(reasons);
      if (absl::Status status = ReleaseAsEngineer(); !status.ok()) return status;
    }
    if (absl::Status status = FetchProgram(); !status.ok()) return status;
    Say(Text("program corrected in %.2f s for %d hole groups", SecondsSince(start), correction->groups_size()));
    return absl::OkStatus();
  }

  // A casting is off its CAD, and the gate says so; who cast it knows that its datum points are true.
  absl::Status ReleaseAsEngineer() {
    return plant_
        .Call("correction", &correction::v1::CorrectionService::Stub::ReleaseCorrection,
              ReleaseRequest(result_.correction.name(), "a casting whose datum points are true to CAD"))
        .status();
  }

  absl::Status FetchProgram() {
    auto fetched = plant_.Call("correction", &correction::v1::CorrectionService::Stub::FetchProgram,
                               FetchRequest(result_.correction.name(), result_.machine, result_.blade, Clamping()));
    if (!fetched.ok()) return fetched.status();
    program_ = fetched->nc_program();
    return absl::OkStatus();
  }

  // The machine counts its clampings: this run has one.
  std::string Clamping() const { return plan_.scan_prefix + "1"; }

  // The machine reads the corrected program, as a real one would, and pins are put into what it drilled.
  absl::Status DrillByProgram() {
    auto commands = ReadProgram(program_);
    if (!commands.ok()) return commands.status();
    std::uint64_t number = 0;
    for (const DesignedHoleGroup& group : part_.hole_groups) {
      for (const DesignedHole& hole : group.holes) {
        const auto command = commands->find(group.name + "/" + hole.name);
        if (command == commands->end())
          return absl::NotFoundError("the corrected program does not drill " + group.name + "/" + hole.name);
        HoleComparison comparison;
        comparison.truth = Drill(part_, group, hole, truth_, zero_from_part_, command->second, plan_.drilling,
                                 Random(Random::StreamSeed(SeedOf(kDrilling), number++)));
        blade_shapes_.push_back(PinIn(comparison.truth, group.diameter_mm, kPinStandsOut_mm));
        result_.holes.push_back(std::move(comparison));
      }
    }
    Say(Text("drilled %zu holes, put a pin into each", result_.holes.size()));
    return plant_
        .Call("correction", &correction::v1::CorrectionService::Stub::ReportCut,
              CutRequest(result_.correction.name(), part_))
        .status();
  }

  // A casting's datum points are true to CAD: the nest judges its holes as a true blade's.
  absl::Status InspectByNest(inspection::v1::InspectRequest request) {
    request.set_method(registration::v1::METHOD_SIX_POINT_NORMALS);
    request.set_request_id(NewRequestId());
    auto inspection = plant_.Call("inspection", &inspection::v1::InspectionService::Stub::Inspect, request);
    if (!inspection.ok()) return inspection.status();
    result_.nest_position_difference_um = WorstPositionDifference_um(*inspection, result_.holes);
    return absl::OkStatus();
  }

  absl::Status Inspect() {
    inspection::v1::InspectRequest request;
    request.set_blade(result_.blade);
    const absl::Status scanned =
        ScanBlade("pins", ingest::v1::SCAN_KIND_PINS, plan_.pins_pitch_mm, 45, request.mutable_scans());
    if (!scanned.ok()) return scanned;
    request.set_request_id(NewRequestId());
    const auto start = Clock::now();
    auto inspection = plant_.Call("inspection", &inspection::v1::InspectionService::Stub::Inspect, request);
    if (!inspection.ok()) return inspection.status();
    result_.inspect_s += SecondsSince(start);
    result_.inspection = *inspection;
    CompareHoles(*inspection, &result_);
    if (plan_.casting_mm > 0)
      if (absl::Status status = InspectByNest(request); !status.ok()) return status;
    Say(Text(
        "judged in %.1f s: %d of %zu holes measured, position within %.1f um and inclination within %.3f deg of the "
        "truth",
        SecondsSince(start), result_.measured_count, result_.holes.size(), result_.worst_position_difference_um,
        result_.worst_inclination_difference_deg));
    return absl::OkStatus();
  }

  PlantLink& plant_;
  const MachineDesign& design_;
  const DesignedPart& part_;
  const BladeRunPlan& plan_;
  const std::function<void(const std::string&)>& say_;
  BladeRunResult& result_;
  MachineTruth truth_;
  DesignedPart there_;  // as it is drawn where the blade is clamped
  Eigen::Isometry3d zero_from_part_;
  std::vector<Eigen::Isometry3d> neighbours_;       // zero_from_part of each
  std::vector<Eigen::Vector3d> checked_points_mm_;  // part frame
  std::vector<std::shared_ptr<const Shape>> blade_shapes_;
  std::uint64_t scan_count_ = 0;
  std::string program_;
};

}  // namespace

absl::Status RunBlade(PlantLink& plant, const MachineDesign& design, const DesignedPart& part, const BladeRunPlan& plan,
                      const std::function<void(const std::string&)>& say, BladeRunResult* result) {
  return BladeRun(plant, design, part, plan, say, result).Run();
}

}  // namespace sixpoint::simulator
