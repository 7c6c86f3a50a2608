#include "services/registration/inputs.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <future>
#include <utility>

#include "services/clients/references.h"
#include "services/clients/stations.h"
#include "services/registration/validate.h"
#include "services/runtime/call_scope.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"
#include "services/runtime/units.h"

namespace sixpoint::registration {
namespace {

using runtime::NotKnown;

constexpr std::int64_t kPointBudget = 400'000;          // of all scans together, after thinning
constexpr std::int64_t kRegionPointBudget = 4'000'000;  // where only regions of them count
constexpr std::int64_t kMostPoints = 100'000'000;

std::string FieldOf(int scan) { return "scans[" + std::to_string(scan) + "]"; }

absl::Status AddRegions(const std::string& field, const google::protobuf::RepeatedPtrField<v1::Region>& in,
                        const plant::v1::Part& part, std::vector<metrology::Region>* out) {
  using Shape = metrology::Region::Shape;
  for (int i = 0; i < in.size(); ++i) {
    if (in[i].has_box()) {
      const auto low = runtime::FromProto(field, in[i].box().minimum_mm());
      const auto high = runtime::FromProto(field, in[i].box().maximum_mm());
      if (!low.ok() || !high.ok()) return low.ok() ? high.status() : low.status();
      out->push_back({Shape::kBox, (*low + *high) / 2, (*high - *low) / 2});
    } else if (in[i].has_ball()) {
      const auto centre = runtime::FromProto(field, in[i].ball().centre_mm());
      if (!centre.ok()) return centre.status();
      out->push_back({Shape::kBall, *centre, Eigen::Vector3d::Constant(in[i].ball().radius_mm())});
    } else {
      const v1::HoleGroupNeighbourhood& asked = in[i].hole_group();
      const auto group = std::find_if(part.hole_groups().begin(), part.hole_groups().end(),
                                      [&](const plant::v1::HoleGroup& g) { return g.group() == asked.group(); });
      if (group == part.hole_groups().end()) {
        std::string known;
        for (const plant::v1::HoleGroup& g : part.hole_groups()) known += (known.empty() ? "" : ", ") + g.group();
        return runtime::Refuse(field + "[" + std::to_string(i) + "].hole_group.group", asked.group(),
                               known.empty() ? "none: " + part.name() + " has no hole groups" : "one of " + known);
      }
      for (const plant::v1::Hole& hole : group->holes()) {
        const auto start = runtime::FromProto("part.hole_groups[" + group->group() + "].holes[" + hole.hole() + "]",
                                              hole.start_in_part_mm());
        if (!start.ok()) return start.status();
        out->push_back({Shape::kBall, *start, Eigen::Vector3d::Constant(group->diameter_mm() / 2 + asked.margin_mm())});
      }
    }
  }
  return absl::OkStatus();
}

std::vector<Eigen::Vector3d> PlacesOf(const std::vector<metrology::DatumPoint>& datums,
                                      const Eigen::Isometry3d& zero_from_part) {
  std::vector<Eigen::Vector3d> places_mm;
  for (const metrology::DatumPoint& datum : datums) places_mm.push_back(zero_from_part * datum.point_mm);
  return places_mm;
}

// shared: an inspection may register the same scans by datum points, as a best fit and by the nest.
ScanThinning ThinningOf(const Inputs& inputs, int scan_count, bool shared) {
  const Eigen::Isometry3d& nominal = inputs.task.zero_from_part_nominal;
  // A scan of a whole fixture holds one blade's points among those of as many as there are stations.
  const std::int64_t budget = std::min(kRegionPointBudget, kPointBudget * std::max(1, inputs.part.stations_size()));
  ScanThinning thinning;
  thinning.own.target_count = (inputs.task.options.regions_in.empty() ? budget : kRegionPointBudget) / scan_count;
  thinning.own.dense_places_mm = PlacesOf(inputs.task.datums, nominal);
  if (!shared) return thinning;
  thinning.shared.emplace().target_count = budget / scan_count;
  if (const auto datums = DatumsOf(inputs.part); datums.ok())
    thinning.shared->dense_places_mm = PlacesOf(*datums, nominal);
  return thinning;
}

// Where the blade nominally stands, and its neighbours where it has such.
absl::Status PlaceAt(const std::string& station, Inputs* inputs) {
  const auto nominal = clients::NominalPoseAt("scans[0].station", station, inputs->part);
  if (!nominal.ok()) return nominal.status();
  inputs->task.zero_from_part_nominal = *nominal;
  inputs->station = station;
  if (station.empty()) return absl::OkStatus();
  inputs->left_out_count = 0;
  auto neighbours = clients::NeighboursOf(station, inputs->part);
  if (!neighbours.ok()) return neighbours.status();
  double capture_mm = 0;
  for (const plant::v1::Station& one : inputs->part.stations())
    if (one.station() == station) capture_mm = one.capture_mm();
  inputs->task.station = {*nominal, capture_mm, *std::move(neighbours)};
  return absl::OkStatus();
}

// As many as a blade that stands alone keeps: with more, what is judged by its scatter (MERGE) would be judged by another measure.
void KeepAtMost(std::int64_t count, metrology::ScanPortion* portion) {
  const auto all = static_cast<std::int64_t>(portion->sensor.size());
  const auto stride = static_cast<std::size_t>((all + count - 1) / std::max<std::int64_t>(1, count));
  if (stride < 2) return;
  metrology::CompactPoints kept;
  for (std::size_t i = 0; i < portion->sensor.size(); i += stride) kept.Add(portion->sensor[i]);
  portion->sensor = std::move(kept);
}

// Of a scan that may hold its neighbours, the station's own points.
absl::Status LeaveOutOthers(const std::string& field, int scan_count, Inputs* inputs) {
  if (!inputs->task.station.has_value()) return absl::OkStatus();
  metrology::ScanPortion& portion = inputs->portions.back();
  *inputs->left_out_count +=
      metrology::LeaveOutOthers(*inputs->surface, *inputs->task.station, inputs->task.options.thread_count, &portion);
  KeepAtMost((inputs->task.options.regions_in.empty() ? kPointBudget : kRegionPointBudget) / scan_count, &portion);
  if (!portion.sensor.empty()) return absl::OkStatus();
  return runtime::Refuse(field, "scans/" + portion.id + ", of whose points none is at station " + inputs->station,
                         "a scan of the part that stands there");
}

// What a scan was thinned to, in the order of the scans.
absl::Status Take(const v1::RegisterRequest& request, int i, absl::StatusOr<metrology::ScanPortion> portion,
                  Inputs* inputs) {
  if (!portion.ok()) return portion.status();
  inputs->portions.push_back(*std::move(portion));
  const metrology::ScanPortion& taken = inputs->portions.back();
  if (taken.sensor.size() == 0 || !taken.zero_from_sensor.matrix().allFinite())
    return runtime::Refuse(
        FieldOf(i),
        request.scans(i) + ", of whose " + std::to_string(taken.scan_point_count) + " points none is at a finite place",
        "points, v0_mm and angles that are finite");
  return LeaveOutOthers(FieldOf(i), request.scans_size(), inputs);
}

}  // namespace

void Say(const Caller& caller, v1::RegistrationStep step, int scan_count, int iteration_count) {
  if (!caller.on_progress) return;
  v1::RegistrationProgress progress;
  progress.set_step(step);
  progress.set_scan_count(scan_count);
  progress.set_iteration_count(iteration_count);
  caller.on_progress(progress);
}

absl::StatusOr<std::vector<metrology::DatumPoint>> DatumsOf(const plant::v1::Part& part) {
  if (part.six_points_size() != 6)
    return runtime::Failure(errors::v1::SIX_POINTS_MISSING,
                            "method: six-point for " + part.name() + ", whose six_points has " +
                                std::to_string(part.six_points_size()) +
                                " points, want 6; add them to the part or ask for METHOD_BEST_FIT",
                            {{"resource", part.name()}});
  std::vector<metrology::DatumPoint> datums;
  for (const plant::v1::DatumPoint& in : part.six_points()) {
    const std::string field = "part.six_points[" + in.datum() + "]";
    const auto point = runtime::FromProto(field + ".point_in_part_mm", in.point_in_part_mm());
    if (!point.ok()) return point.status();
    const auto normal = runtime::FromProto(field + ".normal_in_part", in.normal_in_part());
    if (!normal.ok()) return normal.status();
    datums.push_back({in.datum(), *point, *normal});
  }
  return datums;
}

absl::StatusOr<metrology::FitOptions> FitOptionsOf(const v1::FitOptions& options, const plant::v1::Part& part) {
  metrology::FitOptions out;
  if (options.degrees_of_freedom_size() > 0) out.free.fill(false);
  for (const int freedom : options.degrees_of_freedom())
    out.free[static_cast<std::size_t>(freedom - v1::FREEDOM_TURN_X)] = true;
  out.scan_weights.assign(options.scan_weights().begin(), options.scan_weights().end());
  out.held_turn_rad = runtime::kRadPerDeg * options.held_turn_standard_uncertainty_deg();
  out.held_shift_mm = 1e-3 * options.held_shift_standard_uncertainty_um();
  out.coarse_start = options.coarse_start();
  absl::Status status = AddRegions("options.regions_in", options.regions_in(), part, &out.regions_in);
  if (status.ok()) status = AddRegions("options.regions_out", options.regions_out(), part, &out.regions_out);
  if (!status.ok()) return status;
  return out;
}

InputFetcher::InputFetcher(const Peers& peers, const FetcherMemory& memory, int thread_count)
    : plant_(peers.plant, memory.surface_bytes),
      scans_(peers.ingest, memory.scan_bytes, thread_count),
      calibrations_(peers.calibration),
      thread_count_(thread_count) {}

absl::StatusOr<Inputs> InputFetcher::Fetch(const v1::RegisterRequest& request, const Caller& caller) const {
  return FetchBy(BasisOfNow(plant_, calibrations_, request, caller), request, caller);
}

absl::StatusOr<Inputs> InputFetcher::FetchAsRecorded(const v1::Registration& recorded, const Caller& caller) const {
  auto entry = plant_.GetRecordEntry(recorded.name(), caller.make_context());
  if (!entry.ok()) return entry.status();
  const std::vector<std::string> named(entry->inputs().begin(), entry->inputs().end());
  return FetchBy(BasisOfThen(plant_, calibrations_, recorded, named, caller), RequestOf(recorded), caller);
}

absl::StatusOr<Inputs> InputFetcher::FetchBy(const Basis& basis, const v1::RegisterRequest& request,
                                             const Caller& caller) const {
  Inputs inputs;
  auto part = basis.PartOfBlade(request.blade());
  if (!part.ok()) return part.status();
  inputs.part = *std::move(part);
  if (IsSixPoint(request.method())) {
    auto datums = DatumsOf(inputs.part);
    if (!datums.ok()) return datums.status();
    inputs.task.datums = *std::move(datums);
  }
  auto options = FitOptionsOf(request.options(), inputs.part);
  if (!options.ok()) return options.status();
  inputs.task.options = *std::move(options);
  inputs.task.options.thread_count = thread_count_;
  inputs.task.options.keep_going = caller.keep_going;
  inputs.task.options.on_iteration = [&caller, scan_count = request.scans_size()](int count) {
    Say(caller, v1::REGISTRATION_STEP_FITTING, scan_count, count);
  };
  inputs.task.allowance = AllowanceOptionsOf(request.options());
  inputs.task.method = MethodOf(request.method());
  auto surface = plant_.GetSurface(inputs.part, caller.make_context(), caller.keep_going);
  if (!surface.ok()) return surface.status();
  inputs.surface = *std::move(surface);
  if (absl::Status status = FetchScans(basis, request, caller, &inputs); !status.ok()) return status;
  return inputs;
}

// Scan by scan, each decoded by blocks and thinned. Meanwhile the next is fetched and looked at, and its thinning begins: the few blocks of
// one scan do not keep the processors busy to their end. The calibrations are those of the first scan's machine, and of when it was received.
absl::Status InputFetcher::FetchScans(const Basis& basis, const v1::RegisterRequest& request, const Caller& caller,
                                      Inputs* inputs) const {
  const bool may_be_kept = basis.IsOfNow() && request.for_inspection();
  ScanThinning thinning;
  const auto fetch = [&, call = runtime::CurrentCall()](int i) {
    const runtime::CallScope scope(call);
    return scans_.Fetch(request.scans(i), may_be_kept, caller.make_context);
  };
  const auto thin = [&, call = runtime::CurrentCall()](int i, ScanAtHand scan) {
    const runtime::CallScope scope(call);
    return scans_.Thin(request.scans(i), std::move(scan), inputs->calibration, thinning, caller.make_context);
  };
  ingest::v1::Scan first;
  std::int64_t point_count = 0;
  double stretches = 0;
  std::future<absl::StatusOr<ScanAtHand>> next = std::async(std::launch::async, fetch, 0);
  const auto look = [&](int i, absl::StatusOr<ScanAtHand>* at_hand) -> absl::Status {
    const std::string field = FieldOf(i);
    if (!at_hand->ok()) return NotKnown(field, request.scans(i), at_hand->status());
    clients::StoredBlocks* const fetched = &(*at_hand)->stored;
    if (caller.keep_going && !caller.keep_going()) return absl::CancelledError("register: stopped by its caller");
    if (i == 0) first = fetched->record;
    if (absl::Status status = CheckScan(request, fetched->record, first); !status.ok()) return status;
    point_count += fetched->record.header().point_count();
    if (point_count > kMostPoints)
      return runtime::Refuse("scans", std::to_string(point_count) + " points", "at most 100000000 together");
    if (i + 1 < request.scans_size()) next = std::async(std::launch::async, fetch, i + 1);
    absl::Status known = i == 0 ? PlaceAt(first.header().station(), inputs) : absl::OkStatus();
    if (i == 0) thinning = ThinningOf(*inputs, request.scans_size(), may_be_kept);
    // Of merged views nobody knows from which side a point was seen: that alone tells a part from the nest that it lies in.
    if (known.ok() && !inputs->station.empty()) known = clients::CheckProfiles(field, fetched->record);
    if (known.ok() && i == 0) known = FetchMachine(basis, request, first, inputs);
    if (known.ok()) known = basis.CheckMapped(field, fetched->record, &inputs->sensor);
    if (!known.ok()) return known;
    inputs->scans_received_at = std::max(inputs->scans_received_at, runtime::MomentOf(fetched->record.received_at()));
    const auto stretch = clients::StretchOf({inputs->machine, inputs->part, fetched->record.header()});
    if (!stretch.ok()) return stretch.status();
    fetched->scan.stretch = stretch->ratio;
    stretches += stretch->ratio / request.scans_size();
    fetched->scan.id = runtime::LastSegment(request.scans(i));
    return absl::OkStatus();
  };
  std::future<absl::StatusOr<metrology::ScanPortion>> before;  // the scan before
  const auto take_before = [&](int i) {
    absl::Status taken = Take(request, i, before.get(), inputs);
    if (taken.ok()) Say(caller, v1::REGISTRATION_STEP_FETCHING, i + 1, 0);
    return taken;
  };
  for (int i = 0; i < request.scans_size(); ++i) {
    absl::StatusOr<ScanAtHand> at_hand = next.get();
    const absl::Status known = look(i, &at_hand);
    std::future<absl::StatusOr<metrology::ScanPortion>> now;
    if (known.ok()) now = std::async(std::launch::async, thin, i, *std::move(at_hand));
    // What is wrong with an earlier scan is said first.
    if (absl::Status taken = i == 0 ? absl::OkStatus() : take_before(i - 1); !taken.ok()) return taken;
    if (!known.ok()) return known;
    before = std::move(now);
  }
  if (absl::Status taken = take_before(request.scans_size() - 1); !taken.ok()) return taken;
  inputs->clamping = request.clamping().empty() ? first.header().clamping() : request.clamping();
  if (first.header().has_subject_temperature_c()) inputs->thermal_stretch = stretches;
  return absl::OkStatus();
}

// The machine of the scans, its calibrations and, where asked for, its axis tables.
absl::Status InputFetcher::FetchMachine(const Basis& basis, const v1::RegisterRequest& request,
                                        const ingest::v1::Scan& scan, Inputs* inputs) {
  const std::string& machine = scan.header().machine();
  auto record = basis.Machine(machine);
  if (!record.ok()) return record.status();
  inputs->machine = *std::move(record);
  const bool is_snapshot = scan.header().cloud() == ingest::v1::CLOUD_KIND_SNAPSHOT;
  // What the record states of its sensor is of the one that scanned.
  absl::Status suitable =
      is_snapshot ? clients::CheckSnapshotSensor(inputs->machine) : clients::CheckLineScanner(inputs->machine);
  if (!suitable.ok()) return suitable;
  auto chosen = basis.Sensor(scan);
  if (!chosen.ok()) return chosen.status();
  inputs->sensor = *std::move(chosen);
  const clients::FetchedSensorCalibration* const sensor = &inputs->sensor.calibration;
  suitable = clients::CalibrationClient::CheckMaps("scans[" + scan.name() + "]", *sensor, scan.header());
  if (!suitable.ok()) return suitable;
  const std::string& serial = scan.header().sensor_serial_number();
  if (!serial.empty() && !sensor->sensor_serial_number.empty() && serial != sensor->sensor_serial_number)
    return runtime::Refuse("scans[" + scan.name() + "].sensor_serial_number", serial,
                           sensor->sensor_serial_number + ", the sensor of " + sensor->name);
  auto rotation = basis.Rotation(machine);
  if (!rotation.ok()) return rotation.status();
  absl::StatusOr<std::optional<clients::FetchedArmStudy>> arm = std::nullopt;  // a study is of a line scanner's
  if (!is_snapshot) arm = basis.Arm(machine);
  if (!arm.ok()) return arm.status();
  auto further = clients::FurtherSources({inputs->machine, inputs->part, scan.header()}, *sensor, *rotation, *arm);
  if (!further.ok()) return further.status();
  metrology::MachineCalibration& calibration = inputs->calibration;
  calibration = {sensor->sensor, rotation->axes, rotation->covariance};
  calibration.sensor.field = clients::FieldOf(inputs->machine.sensor());
  calibration.sensor_name = sensor->name;
  calibration.axes_name = rotation->name;
  calibration.axes_degrees_of_freedom = rotation->degrees_of_freedom;
  calibration.further = *std::move(further);
  if (arm->has_value()) inputs->further_names.push_back((*arm)->name);
  inputs->sensor_calibration = sensor->name;
  inputs->rotation_calibration = rotation->name;
  inputs->letters = rotation->letters;
  return FetchPositioning(basis, request.apply_axis_tables(), *rotation, inputs);
}

absl::Status InputFetcher::FetchPositioning(const Basis& basis, bool apply_axis_tables,
                                            const clients::FetchedRotationCalibration& rotation, Inputs* inputs) {
  metrology::RotaryPositioning& positioning = inputs->calibration.positioning;
  const std::string& machine = inputs->machine.name();
  std::string without;
  for (std::size_t i = 0; i < rotation.letters.size(); ++i) {
    const std::string& letter = rotation.letters[i];
    const double figure_deg = clients::PositioningFigure_deg(inputs->machine, letter);
    auto axis = basis.Axis(machine, letter);
    // One that is over says nothing any more: what the record states holds again.
    if (absl::IsFailedPrecondition(axis.status()) && !apply_axis_tables && figure_deg > 0) axis = std::nullopt;
    if (!axis.ok()) return axis.status();
    metrology::AxisPositioning& of_axis = i == 0 ? positioning.a : positioning.b;
    if (!axis->has_value() || !apply_axis_tables) {
      if (!axis->has_value() && !(figure_deg > 0))
        return runtime::Failure(errors::v1::AXIS_UNCERTAINTY_MISSING,
                                machine + ", axis " + letter +
                                    ": neither a characterisation in force nor "
                                    "positioning_standard_uncertainty_deg, want one of both",
                                {{"resource", machine}, {"axis", letter}});
      of_axis.standard_uncertainty_rad =
          axis->has_value() ? (*axis)->whole_standard_uncertainty_rad : figure_deg * runtime::kRadPerDeg;
      if (axis->has_value()) inputs->further_names.push_back((*axis)->name);
      continue;
    }
    of_axis = (*axis)->positioning;
    of_axis.approach = clients::ApproachOf(inputs->machine);
    inputs->characterisations[i] = (*axis)->name;
    inputs->further_names.push_back((*axis)->name);
    if (std::find(rotation.inputs.begin(), rotation.inputs.end(), (*axis)->name) == rotation.inputs.end())
      without += (without.empty() ? "" : ", ") + letter;
  }
  if (apply_axis_tables && !positioning.Applies())
    return runtime::Failure(errors::v1::AXIS_NOT_CHARACTERISED,
                            "apply_axis_tables: " + machine + ", whose axes " + rotation.letters[0] + " and " +
                                rotation.letters[1] +
                                " have no characterisation in force, want one; run `calibrate axis` first",
                            {{"resource", machine}});
  if (!without.empty())
    inputs->remark = "the rotary axes were calibrated without the table of " + without +
                     " that is applied here; calibrate them with it";
  return absl::OkStatus();
}

}  // namespace sixpoint::registration
