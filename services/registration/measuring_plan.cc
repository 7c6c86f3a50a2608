#include "services/registration/measuring_plan.h"

#include <cmath>
#include <tuple>
#include <utility>
#include <vector>

#include "metrology/kinematics/beyond_reach.h"
#include "services/clients/stations.h"
#include "services/registration/inputs.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/machine_chain.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/units.h"

namespace sixpoint::registration {
namespace {

using Eigen::Vector3d;
using metrology::Seen;

constexpr double kUsualRegion_mm = 3, kUsualHousing_mm[] = {40, 100, 100};

template <typename Field>
Field Or(bool given, Field value, Field usual) {
  return given ? value : usual;
}

absl::StatusOr<metrology::PlanOptions> OptionsOf(const v1::PlanMeasurementRequest& request, const PlanInputs& inputs) {
  metrology::PlanOptions options;
  options.coverage = Or(request.has_coverage(), request.coverage(), options.coverage);
  if (request.has_greatest_incidence_deg())
    options.greatest_incidence_rad = runtime::kRadPerDeg * request.greatest_incidence_deg();
  options.margin_mm = Or(request.has_margin_mm(), request.margin_mm(), options.margin_mm);
  options.clearance_mm = Or(request.has_clearance_mm(), request.clearance_mm(), options.clearance_mm);
  options.most_portions = Or(request.has_most_portions(), request.most_portions(), options.most_portions);
  options.rotary_travel_mm_per_rad =
      Or(request.has_rotary_travel_mm_per_deg(), request.rotary_travel_mm_per_deg(), 1.0) / runtime::kRadPerDeg;
  const double face_mm = inputs.machine.sensor().mid_range_mm();
  options.body = {{-kUsualHousing_mm[0] / 2, -kUsualHousing_mm[1] / 2, face_mm},
                  {kUsualHousing_mm[0] / 2, kUsualHousing_mm[1] / 2, face_mm + kUsualHousing_mm[2]}};
  if (!request.has_body()) return options;
  const auto low = runtime::FromProto("body.low_mm", request.body().low_mm());
  const auto high = runtime::FromProto("body.high_mm", request.body().high_mm());
  if (!low.ok() || !high.ok()) return low.ok() ? high.status() : low.status();
  options.body = {*low, *high};
  return options;
}

// Where a record has no linear joint the scanner goes along the machine's own axes, as scans are mapped; how far, nobody said.
std::vector<metrology::Joint> AssumedLinear() {
  std::vector<metrology::Joint> joints;
  for (const auto& [axis, direction] : {std::pair("X", Vector3d(Vector3d::UnitX())),
                                        {"Y", Vector3d(Vector3d::UnitY())},
                                        {"Z", Vector3d(Vector3d::UnitZ())}}) {
    metrology::Joint& joint = joints.emplace_back();
    joint.axis = axis;
    joint.motion = {metrology::JointKind::kLinear, {direction, Vector3d::Zero()}};
  }
  return joints;
}

bool HasLinear(const plant::v1::Machine& machine) {
  for (const auto* joints : {&machine.kinematics().part_side(), &machine.kinematics().tool_side()})
    for (const plant::v1::Joint& joint : *joints)
      if (joint.kind() == plant::v1::JOINT_KIND_LINEAR) return true;
  return false;
}

// The record's, with both rotary axes where they were identified; they turn by the command's own sense.
absl::StatusOr<metrology::JointChain> ChainOf(const PlanInputs& inputs) {
  const auto recorded = runtime::ChainOf(inputs.machine);
  if (!recorded.ok()) return recorded.status();
  std::vector<metrology::Joint> part_side, tool_side;
  for (int i = 0; i < recorded->size(); ++i)
    (i < recorded->part_side_size() ? part_side : tool_side).push_back(recorded->joints()[static_cast<std::size_t>(i)]);
  const std::vector<int> rotary = recorded->PartSideRotary();
  for (std::size_t k = 0; k < rotary.size() && k < 2; ++k) {
    metrology::Joint& joint = part_side[static_cast<std::size_t>(rotary[k])];
    joint.motion.line = k == 0 ? inputs.rotation.axes.a : inputs.rotation.axes.b;
    joint.sign = 1;
  }
  if (!HasLinear(inputs.machine))
    for (metrology::Joint& joint : AssumedLinear()) tool_side.push_back(std::move(joint));
  return metrology::JointChain::Make(std::move(part_side), std::move(tool_side));
}

absl::StatusOr<std::vector<metrology::NamedDisc>> DiscsOf(const v1::PlanMeasurementRequest& request,
                                                          const plant::v1::Part& part) {
  std::vector<metrology::NamedDisc> discs;
  if (!request.six_points()) return discs;
  const auto datums = DatumsOf(part);
  if (!datums.ok()) return datums.status();
  const double radius_mm = Or(request.has_region_radius_mm(), request.region_radius_mm(), kUsualRegion_mm);
  for (const metrology::DatumPoint& datum : *datums)
    discs.push_back({datum.name, {datum.point_mm, datum.normal, radius_mm}});
  return discs;
}

void AddPositions(const Eigen::VectorXd& positions, const metrology::JointChain& chain,
                  google::protobuf::RepeatedField<double>* out) {
  for (int i = 0; i < chain.size(); ++i)
    out->Add(positions(i) / (chain.motion(i).kind == metrology::JointKind::kRotary ? runtime::kRadPerDeg : 1));
}

void AddPortion(const metrology::PlannedPortion& from, const metrology::JointChain& chain, v1::MeasuringPlan* plan) {
  v1::PlannedPortion& to = *plan->add_portions();
  to.set_region(from.region);
  to.set_a_deg(from.pose.a_rad / runtime::kRadPerDeg);
  to.set_b_deg(from.pose.b_rad / runtime::kRadPerDeg);
  runtime::ToProto(from.v0_mm, to.mutable_v0_mm());
  to.set_length_mm(from.length_mm);
  to.set_seen_mm2(from.seen_mm2);
  AddPositions(from.enter, chain, to.mutable_enter());
  AddPositions(from.start, chain, to.mutable_start());
  AddPositions(from.end, chain, to.mutable_end());
  AddPositions(from.leave, chain, to.mutable_leave());
}

void AddRegion(const metrology::RegionCoverage& from, v1::MeasuringPlan* plan) {
  const auto area_mm2 = [&](Seen seen) { return from.area_mm2[static_cast<std::size_t>(seen)]; };
  v1::RegionCoverage& to = *plan->add_regions();
  to.set_region(from.name);
  to.set_wanted_mm2(from.wanted_mm2);
  to.set_seen_mm2(area_mm2(Seen::kSeen));
  to.set_coverage(from.Share());
  to.set_left_out_mm2(area_mm2(Seen::kLeftOut));
  to.set_clearance_mm2(area_mm2(Seen::kClearance));
  to.set_travel_mm2(area_mm2(Seen::kTravel));
  to.set_hidden_mm2(area_mm2(Seen::kHidden));
  to.set_beyond_rotary_mm2(area_mm2(Seen::kRotaryLimits));
  to.set_too_steep_mm2(area_mm2(Seen::kTooSteep));
}

// What the kernel calls six discs are the part's points.
absl::Status AsAsked(const absl::Status& status) {
  std::vector<Violation> violations = ViolationsOf(status);
  if (violations.empty()) return status;
  for (Violation& violation : violations) {
    const std::string radius = "].radius_mm";
    if (violation.field.size() > radius.size() &&
        violation.field.compare(violation.field.size() - radius.size(), radius.size(), radius) == 0)
      violation.field = "region_radius_mm";
    else if (violation.field.rfind("regions[", 0) == 0)
      violation.field = "part.six_points" + violation.field.substr(std::string("regions").size());
    else if (violation.field.rfind("kinematics", 0) == 0 || violation.field.rfind("sensor.", 0) == 0)
      violation.field = "machine." + violation.field;
  }
  return absl::IsOutOfRange(status) ? metrology::BeyondReach(violations) : runtime::Refuse(violations);
}

absl::Status AddProgram(const v1::PlanMeasurementRequest& request, const metrology::MeasuringPlan& plan,
                        const metrology::JointChain& chain, v1::MeasuringPlan* out) {
  metrology::ScanProgramOptions options;
  options.feed_mm_per_min = Or(request.has_feed_mm_per_min(), request.feed_mm_per_min(), options.feed_mm_per_min);
  options.output = Or(request.has_output(), request.output(), options.output);
  options.remarks = {"OF " + out->part() + "@" + std::to_string(out->part_revision()) + ", ON " + out->machine() + "@" +
                     std::to_string(out->machine_revision())};
  if (!out->assumed_axes().empty()) options.remarks.push_back("REACH NOT CHECKED: LIMITS OF X, Y, Z ARE NOT KNOWN");
  auto program = metrology::WriteScanProgram(plan, chain, options);
  if (program.ok()) {
    if (absl::Status proven = metrology::ProveScanProgram(*program, plan, chain, options); !proven.ok())
      return absl::InternalError("the program does not go the plan's way: " + std::string(proven.message()));
    out->set_nc_program(*std::move(program));
    return absl::OkStatus();
  }
  for (const Violation& violation : ViolationsOf(program.status()))
    if (violation.field.rfind("kinematics", 0) != 0) return program.status();
  out->set_without_program(std::string(program.status().message()));
  return absl::OkStatus();
}

// Inside out it is refused by the kernel.
absl::Status CheckBody(const v1::SensorBody& body) {
  constexpr double kGreatest_mm = 2000;
  Refusals refusals;
  for (const auto& [field, is_given, corner] : {std::tuple("body.low_mm", body.has_low_mm(), &body.low_mm()),
                                                {"body.high_mm", body.has_high_mm(), &body.high_mm()}}) {
    if (!is_given) refusals.Add(runtime::Refuse(field, "", "a point"));
    for (const auto& [name, value] :
         {std::pair(".x_mm", corner->x_mm()), {".y_mm", corner->y_mm()}, {".z_mm", corner->z_mm()}})
      if (!(std::abs(value) <= kGreatest_mm))
        refusals.Add(runtime::Refuse(std::string(field) + name, value, "-2000 to 2000"));
  }
  return refusals.status();
}

}  // namespace

absl::Status CheckPlanRequest(const v1::PlanMeasurementRequest& request) {
  Refusals refusals;
  refusals.Add(runtime::IdOf("machine", "machines", request.machine()).status())
      .Add(runtime::IdOf("part", "parts", request.part()).status());
  if (request.has_region_radius_mm() && !request.six_points())
    refusals.Add(runtime::Refuse("region_radius_mm", request.region_radius_mm(), "none without six_points"));
  const auto check = [&](bool given, const char* field, double value, bool is_within, const char* wanted) {
    if (given && !is_within) refusals.Add(runtime::Refuse(field, value, wanted));
  };
  // False of what is not a number, too.
  const auto up_to = [](double value, double most) { return value > 0 && value <= most; };
  const auto from_0_to = [](double value, double most) { return value >= 0 && value <= most; };
  check(request.has_region_radius_mm() && request.six_points(), "region_radius_mm", request.region_radius_mm(),
        up_to(request.region_radius_mm(), 1000), "more than 0, at most 1000");
  check(request.has_coverage(), "coverage", request.coverage(), up_to(request.coverage(), 1), "more than 0, at most 1");
  check(request.has_greatest_incidence_deg(), "greatest_incidence_deg", request.greatest_incidence_deg(),
        up_to(request.greatest_incidence_deg(), 85), "more than 0, at most 85");
  check(request.has_margin_mm(), "margin_mm", request.margin_mm(), from_0_to(request.margin_mm(), 1000), "0 to 1000");
  check(request.has_clearance_mm(), "clearance_mm", request.clearance_mm(), from_0_to(request.clearance_mm(), 1000),
        "0 to 1000");
  check(request.has_most_portions(), "most_portions", request.most_portions(),
        request.most_portions() >= 1 && request.most_portions() <= metrology::kMostPlanPortions, "1 to 500");
  check(request.has_rotary_travel_mm_per_deg(), "rotary_travel_mm_per_deg", request.rotary_travel_mm_per_deg(),
        from_0_to(request.rotary_travel_mm_per_deg(), 1000), "0 to 1000");
  check(request.has_feed_mm_per_min(), "feed_mm_per_min", request.feed_mm_per_min(),
        up_to(request.feed_mm_per_min(), 1e5), "more than 0, at most 100000");
  check(request.has_output(), "output", request.output(), from_0_to(request.output(), 63), "0 to 63");
  if (request.has_body()) refusals.Add(CheckBody(request.body()));
  return refusals.status();
}

absl::StatusOr<v1::MeasuringPlan> PlanOf(const v1::PlanMeasurementRequest& request, const PlanInputs& inputs,
                                         int threads, const std::function<bool()>& keep_going) {
  auto options = OptionsOf(request, inputs);
  if (!options.ok()) return options.status();
  options->threads = threads;
  options->keep_going = keep_going;
  const auto nominal = clients::NominalPoseAt("station", request.station(), inputs.part);
  if (!nominal.ok()) return nominal.status();
  auto neighbours = clients::NeighboursOf(request.station(), inputs.part);
  if (!neighbours.ok()) return neighbours.status();
  auto chain = ChainOf(inputs);
  if (!chain.ok()) return chain.status();
  auto discs = DiscsOf(request, inputs.part);
  if (!discs.ok()) return discs.status();
  const plant::v1::Sensor& sensor = inputs.machine.sensor();
  const metrology::PlanTask task{
      *inputs.surface,
      *nominal,
      *chain,
      inputs.sensor.sensor,
      {sensor.mid_range_mm(), sensor.range_mm(), runtime::kRadPerDeg * sensor.line_angle_deg()},
      *std::move(discs),
      *std::move(options),
      *std::move(neighbours)};
  const auto made = metrology::MakeMeasuringPlan(task);
  if (!made.ok()) return AsAsked(made.status());

  v1::MeasuringPlan plan;
  plan.set_machine(inputs.machine.name());
  plan.set_machine_revision(inputs.machine.revision());
  plan.set_part(inputs.part.name());
  plan.set_part_revision(inputs.part.revision());
  plan.set_sensor_calibration(inputs.sensor.name);
  plan.set_rotation_calibration(inputs.rotation.name);
  for (const metrology::Joint& joint : chain->joints()) plan.add_axes(joint.axis);
  if (!HasLinear(inputs.machine))
    for (const metrology::Joint& joint : AssumedLinear()) plan.add_assumed_axes(joint.axis);
  for (const metrology::PlannedPortion& portion : made->portions) AddPortion(portion, *chain, &plan);
  plan.set_covered(true);
  for (const metrology::RegionCoverage& region : made->regions) {
    AddRegion(region, &plan);
    if (region.Share() < task.options.coverage) plan.set_covered(false);
  }
  plan.set_travel_mm(made->travel_mm);
  plan.set_turned_deg(made->turned_rad / runtime::kRadPerDeg);
  plan.set_sweep_mm(made->sweep_mm);
  if (absl::Status status = AddProgram(request, *made, *chain, &plan); !status.ok()) return status;
  return plan;
}

}  // namespace sixpoint::registration
