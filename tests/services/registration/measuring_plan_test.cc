// PlanMeasurement through the handler, on stand-ins for the services that it asks: no PostgreSQL, for a plan is not recorded.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <thread>

#include "services/registration/measuring_plan_service.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "tests/services/correction/stand_ins.h"

namespace sixpoint::registration {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using namespace std::chrono_literals;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();

// Knows one machine and one part, by their names alone: what they are now.
class PlantOfNow final : public plant::v1::PlantService::Service {
 public:
  explicit PlantOfNow(testing::StandInPlant* plant) : plant_(*plant) {}
  grpc::Status GetMachine(grpc::ServerContext*, const plant::v1::GetMachineRequest* request,
                          plant::v1::Machine* response) override {
    return Get(request->name(), plant_.machine, response);
  }
  grpc::Status GetPart(grpc::ServerContext*, const plant::v1::GetPartRequest* request,
                       plant::v1::Part* response) override {
    return Get(request->name(), plant_.part, response);
  }
  grpc::Status DownloadSurface(grpc::ServerContext* context, const plant::v1::DownloadSurfaceRequest* request,
                               grpc::ServerWriter<plant::v1::DownloadSurfaceResponse>* writer) override {
    return plant_.DownloadSurface(context, request, writer);
  }

 private:
  template <typename Thing>
  static grpc::Status Get(const std::string& name, const Thing& known, Thing* response) {
    if (name != known.name()) return {grpc::StatusCode::NOT_FOUND, name + " is not known"};
    *response = known;
    return grpc::Status::OK;
  }
  testing::StandInPlant& plant_;
};

class MeasuringPlanTest : public ::testing::Test {
 protected:
  MeasuringPlanTest() {
    plant::v1::Sensor& sensor = *plant_.plant.machine.mutable_sensor();
    sensor.set_mid_range_mm(66);
    sensor.set_range_mm(25);
    sensor.set_line_angle_deg(20);
  }
  // X, Y, Z under the scanner, within +-limit_mm.
  void AddLinear(double limit_mm) {
    for (const auto& [axis, direction] : {std::pair("X", Eigen::Vector3d(Eigen::Vector3d::UnitX())),
                                          {"Y", Eigen::Vector3d(Eigen::Vector3d::UnitY())},
                                          {"Z", Eigen::Vector3d(Eigen::Vector3d::UnitZ())}}) {
      plant::v1::Joint& joint = *plant_.plant.machine.mutable_kinematics()->add_tool_side();
      joint.set_axis(axis);
      joint.set_kind(plant::v1::JOINT_KIND_LINEAR);
      runtime::ToProto(direction, joint.mutable_direction());
      joint.set_sign(1);
      joint.set_minimum(-limit_mm);
      joint.set_maximum(limit_mm);
    }
  }
  // Three on the block's top, two and one on its sides.
  void AddSixPoints() {
    const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(), z = Eigen::Vector3d::UnitZ();
    for (const auto& [point, normal] : {std::pair(Eigen::Vector3d(-10, -10, 0), z),
                                        {Eigen::Vector3d(10, -10, 0), z},
                                        {Eigen::Vector3d(0, 10, 0), z},
                                        {Eigen::Vector3d(15, -10, -5), x},
                                        {Eigen::Vector3d(15, 10, -5), x},
                                        {Eigen::Vector3d(0, 15, -5), y}}) {
      plant::v1::DatumPoint& datum = *plant_.plant.part.add_six_points();
      datum.set_datum("D" + std::to_string(plant_.plant.part.six_points_size()));
      runtime::ToProto(point, datum.mutable_point_in_part_mm());
      runtime::ToProto(normal, datum.mutable_normal_in_part());
    }
  }
  static v1::PlanMeasurementRequest Request() {
    v1::PlanMeasurementRequest request;
    request.set_machine("machines/m1");
    request.set_part("parts/p1");
    return request;
  }
  absl::StatusOr<v1::MeasuringPlan> Plan(const v1::PlanMeasurementRequest& request, double seconds = 60) const {
    v1::MeasuringPlan plan;
    const grpc::Status status = stub_->PlanMeasurement(runtime::ContextFor(seconds).get(), request, &plan);
    if (!status.ok()) return runtime::FromGrpc(status);
    return plan;
  }
  v1::MeasuringPlan GoodPlan(const v1::PlanMeasurementRequest& request) const {
    const auto plan = Plan(request);
    EXPECT_TRUE(plan.ok()) << plan.status();
    return plan.ok() ? *plan : v1::MeasuringPlan();
  }
  PlanInputs Inputs() const {
    auto inputs = fetcher_.FetchForPlan(Request(), CallerFor(60s));
    EXPECT_TRUE(inputs.ok()) << inputs.status();
    return *std::move(inputs);
  }
  static runtime::Caller CallerFor(std::chrono::seconds time) {
    runtime::Caller caller;
    caller.deadline = std::chrono::steady_clock::now() + time;
    caller.make_context = [] { return runtime::ContextFor(20); };
    return caller;
  }

  testing::StandIns plant_;
  PlantOfNow now_{&plant_.plant};
  testing::InProcessServer now_server_{{&now_}};
  InputFetcher fetcher_{Peers{now_server_.Connect(), plant_.Connect(), plant_.Connect()},
                        FetcherMemory{std::size_t{64} << 20, 0}, 1};
  runtime::ComputePool pool_{{1, 0}, "registrations", errors::v1::REGISTRATIONS_FULL};
  MeasuringPlanService service_{fetcher_, &pool_, 2};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<v1::MeasuringPlanService::Stub> stub_ = v1::MeasuringPlanService::NewStub(server_.Connect());
};

double SumOf(const v1::RegionCoverage& region) {
  return region.seen_mm2() + region.left_out_mm2() + region.clearance_mm2() + region.travel_mm2() +
         region.hidden_mm2() + region.beyond_rotary_mm2() + region.too_steep_mm2();
}

// Where the part has stations it stands at one of them: a plan for each is the part's own, moved.
TEST_F(MeasuringPlanTest, PlansForAPartAtItsStation) {
  AddLinear(400);
  v1::PlanMeasurementRequest request = Request();
  request.set_station("s1");
  EXPECT_THAT(std::string(Plan(request).status().message()),
              HasSubstr("station: s1, want none: parts/p1 has no stations"));
  const v1::MeasuringPlan alone = GoodPlan(Request());
  for (const double x_mm : {0.0, 120.0}) {
    plant::v1::Station& station = *plant_.plant.part.add_stations();
    station.set_station("s" + std::to_string(plant_.plant.part.stations_size()));
    station.set_capture_mm(5);
    *station.mutable_zero_from_part_nominal() = plant_.plant.part.zero_from_part_nominal();
    geometry::v1::Point& at_mm = *station.mutable_zero_from_part_nominal()->mutable_translation_mm();
    at_mm.set_x_mm(at_mm.x_mm() + x_mm);
  }
  EXPECT_THAT(std::string(Plan(Request()).status().message()),
              HasSubstr("station: empty, want a station of parts/p1 (s1, s2)"));
  const v1::MeasuringPlan first = GoodPlan(request);
  EXPECT_NEAR(first.regions(0).coverage(), alone.regions(0).coverage(), 0.05);
  request.set_station("s2");
  const v1::MeasuringPlan second = GoodPlan(request);
  EXPECT_NEAR(second.regions(0).coverage(), alone.regions(0).coverage(), 0.05);
  EXPECT_NE(second.portions(0).v0_mm().x_mm(), first.portions(0).v0_mm().x_mm());
}

TEST_F(MeasuringPlanTest, SaysHowTheWholePartIsScannedAndByWhat) {
  AddLinear(400);
  v1::PlanMeasurementRequest request = Request();
  request.set_feed_mm_per_min(900);
  request.set_output(7);
  const v1::MeasuringPlan plan = GoodPlan(request);
  EXPECT_EQ(plan.machine(), "machines/m1");
  EXPECT_EQ(plan.machine_revision(), 1);
  EXPECT_EQ(plan.part(), "parts/p1");
  EXPECT_EQ(plan.part_revision(), 1);
  EXPECT_EQ(plan.sensor_calibration(), testing::kSensorCalibration);
  EXPECT_EQ(plan.rotation_calibration(), testing::kRotationCalibration);
  EXPECT_THAT(plan.axes(), ElementsAre("A", "B", "X", "Y", "Z"));
  EXPECT_THAT(plan.assumed_axes(), IsEmpty());
  ASSERT_GE(plan.portions_size(), 3);
  double sweep_mm = 0;
  for (const v1::PlannedPortion& portion : plan.portions()) {
    sweep_mm += portion.length_mm();
    for (const auto* place : {&portion.enter(), &portion.start(), &portion.end(), &portion.leave()}) {
      ASSERT_EQ(place->size(), 5);
      EXPECT_NEAR(place->Get(0), portion.a_deg(), 1e-9);
      EXPECT_NEAR(place->Get(1), portion.b_deg(), 1e-9);
    }
    // The linear axes carry the scanner: V0 is what they are commanded, negative.
    EXPECT_NEAR(portion.start(2), -portion.v0_mm().x_mm(), 1e-6);
    EXPECT_NEAR(portion.start(3), -portion.v0_mm().y_mm(), 1e-6);
    EXPECT_NEAR(portion.start(4), -portion.v0_mm().z_mm(), 1e-6);
    EXPECT_NEAR(portion.end(2) - portion.start(2), portion.length_mm(), 1e-6);
    EXPECT_GE(portion.enter(4), portion.start(4));
    EXPECT_GE(portion.leave(4), portion.end(4));
  }
  EXPECT_NEAR(plan.sweep_mm(), sweep_mm, 1e-9);
  ASSERT_EQ(plan.regions_size(), 1);
  EXPECT_EQ(plan.regions(0).region(), "");
  EXPECT_NEAR(plan.regions(0).wanted_mm2(), 2 * 30 * 30 + 4 * 30 * 10, 30);
  EXPECT_NEAR(SumOf(plan.regions(0)), plan.regions(0).wanted_mm2(), 1e-6);
  EXPECT_EQ(plan.covered(), plan.regions(0).coverage() >= 0.95);
  EXPECT_THAT(plan.nc_program(), HasSubstr("M62 P7\nG1 X"));
  EXPECT_THAT(plan.nc_program(), HasSubstr(" F900.0000\nM63 P7\n"));
  EXPECT_EQ(plan.without_program(), "");
  EXPECT_EQ(GoodPlan(request).SerializeAsString(), plan.SerializeAsString());  // again, whatever the threads did
}

TEST_F(MeasuringPlanTest, SaysHowEachOfTheSixPointsIsSeen) {
  AddLinear(400);
  AddSixPoints();
  v1::PlanMeasurementRequest request = Request();
  request.set_six_points(true);
  const v1::MeasuringPlan plan = GoodPlan(request);
  ASSERT_EQ(plan.regions_size(), 6);
  EXPECT_TRUE(plan.covered());
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(plan.regions(i).region(), "D" + std::to_string(i + 1));
    EXPECT_GE(plan.regions(i).coverage(), 0.95);
    EXPECT_NEAR(plan.regions(i).wanted_mm2(), M_PI * 9, 1.5);
  }
  request.set_region_radius_mm(2);
  EXPECT_NEAR(GoodPlan(request).regions(0).wanted_mm2(), M_PI * 4, 1);
}

// A dataset's machine has no linear joints: it is planned on, and said what is not known.
TEST_F(MeasuringPlanTest, WithoutLinearJointsSaysThatItsReachIsNotKnown) {
  const v1::MeasuringPlan plan = GoodPlan(Request());
  EXPECT_THAT(plan.assumed_axes(), ElementsAre("X", "Y", "Z"));
  EXPECT_THAT(plan.axes(), ElementsAre("A", "B", "X", "Y", "Z"));
  EXPECT_NE(plan.nc_program(), "");
  AddLinear(400);
  EXPECT_THAT(GoodPlan(Request()).assumed_axes(), IsEmpty());
}

TEST_F(MeasuringPlanTest, OfWhatIsOutOfReachSaysWhatKeepsIt) {
  AddLinear(5);
  const auto plan = Plan(Request());
  EXPECT_EQ(plan.status().code(), absl::StatusCode::kOutOfRange) << plan.status();
  EXPECT_THAT(std::string(plan.status().message()), HasSubstr("part: nothing of it is seen: "));
  EXPECT_THAT(std::string(plan.status().message()), HasSubstr(" % beyond a linear axis's limits"));
  AddSixPoints();
  v1::PlanMeasurementRequest request = Request();
  request.set_six_points(true);
  const absl::Status points = Plan(request).status();
  EXPECT_EQ(points.code(), absl::StatusCode::kOutOfRange) << points;
  EXPECT_THAT(std::string(points.message()), HasSubstr("part.six_points[D1]: nothing of it is seen: "));
}

struct Wrong {
  const char* field;
  const char* value;
  std::function<void(v1::PlanMeasurementRequest*)> make;
};

TEST_F(MeasuringPlanTest, RefusesEachFieldByItsNameAndBeforeAnyWork) {
  using R = v1::PlanMeasurementRequest;
  const auto body = [](R* request, double low_x_mm, double high_x_mm) {
    request->mutable_body()->mutable_low_mm()->set_x_mm(low_x_mm);
    request->mutable_body()->mutable_high_mm()->set_x_mm(high_x_mm);
    for (auto* corner : {request->mutable_body()->mutable_low_mm(), request->mutable_body()->mutable_high_mm()}) {
      corner->set_y_mm(corner == request->mutable_body()->mutable_low_mm() ? -50 : 50);
      corner->set_z_mm(corner->y_mm() + 120);
    }
  };
  std::vector<Wrong> wrongs = {
      {"machine", "m1", [](R* r) { r->set_machine("m1"); }},
      {"machine", "parts/p1", [](R* r) { r->set_machine("parts/p1"); }},
      {"machine", "empty", [](R* r) { r->clear_machine(); }},
      {"machine", "machines/m2", [](R* r) { r->set_machine("machines/m2"); }},
      {"part", "parts/p2", [](R* r) { r->set_part("parts/p2"); }},
      {"part", "empty", [](R* r) { r->clear_part(); }},
      {"region_radius_mm", "4", [](R* r) { r->set_region_radius_mm(4); }},
      {"region_radius_mm", "nan", [](R* r) { r->set_region_radius_mm(kNaN); }},
      {"most_portions", "0", [](R* r) { r->set_most_portions(0); }},
      {"most_portions", "501", [](R* r) { r->set_most_portions(501); }},
      {"output", "-1", [](R* r) { r->set_output(-1); }},
      {"output", "64", [](R* r) { r->set_output(64); }},
      {"body.low_mm", "empty", [](R* r) { r->mutable_body()->mutable_high_mm()->set_x_mm(20); }},
      {"body.low_mm.x_mm", "nan", [&](R* r) { body(r, kNaN, 20); }},
      {"body.high_mm.x_mm", "1e+300", [&](R* r) { body(r, -20, 1e300); }},
      {"body", "low and high corners out of order", [&](R* r) { body(r, 20, -20); }},
      {"margin_mm", "12.5", [](R* r) { r->set_margin_mm(12.5); }},
  };
  using Set = void (R::*)(double);
  const auto each = [&](const char* field, Set set, const std::vector<std::pair<double, const char*>>& values,
                        bool six_points = false) {
    for (const auto& [value, shown] : values)
      wrongs.push_back({field, shown, [set, value = value, six_points](R* r) {
                          r->set_six_points(six_points);
                          (r->*set)(value);
                        }});
  };
  each("region_radius_mm", &R::set_region_radius_mm,
       {{0, "0"}, {-1, "-1"}, {1001, "1001"}, {kNaN, "nan"}, {kInfinity, "inf"}}, true);
  each("coverage", &R::set_coverage, {{0, "0"}, {-0.1, "-0.1"}, {1.01, "1.01"}, {kNaN, "nan"}, {kInfinity, "inf"}});
  each("greatest_incidence_deg", &R::set_greatest_incidence_deg,
       {{0, "0"}, {-5, "-5"}, {85.1, "85.1"}, {kNaN, "nan"}, {kInfinity, "inf"}});
  each("margin_mm", &R::set_margin_mm, {{-1, "-1"}, {1001, "1001"}, {kNaN, "nan"}, {kInfinity, "inf"}});
  each("clearance_mm", &R::set_clearance_mm, {{-1, "-1"}, {1001, "1001"}, {kNaN, "nan"}, {-kInfinity, "-inf"}});
  each("rotary_travel_mm_per_deg", &R::set_rotary_travel_mm_per_deg,
       {{-1, "-1"}, {1001, "1001"}, {kNaN, "nan"}, {kInfinity, "inf"}});
  each("feed_mm_per_min", &R::set_feed_mm_per_min,
       {{0, "0"}, {-1, "-1"}, {100001, "100001"}, {kNaN, "nan"}, {kInfinity, "inf"}});
  AddSixPoints();
  for (const Wrong& wrong : wrongs) {
    v1::PlanMeasurementRequest request = Request();
    wrong.make(&request);
    const auto plan = Plan(request);
    EXPECT_EQ(plan.status().code(), absl::StatusCode::kInvalidArgument) << wrong.field << " " << wrong.value;
    const auto violations = ViolationsOf(plan.status());
    ASSERT_EQ(violations.size(), 1u) << wrong.field << ": " << plan.status();
    EXPECT_EQ(violations[0].field, wrong.field);
    std::string value = violations[0].value;
    for (char& c : value) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    EXPECT_EQ(value, wrong.value) << wrong.field;
    EXPECT_NE(violations[0].wanted, "") << wrong.field;
  }
}

TEST_F(MeasuringPlanTest, NamesAllThatIsWrongAtOnce) {
  v1::PlanMeasurementRequest request = Request();
  request.set_machine("m1");
  request.set_coverage(2);
  request.set_output(64);
  std::vector<std::string> fields;
  for (const Violation& violation : ViolationsOf(Plan(request).status())) fields.push_back(violation.field);
  EXPECT_THAT(fields, ElementsAre("machine", "coverage", "output"));
}

TEST_F(MeasuringPlanTest, SixPointsOfAPartThatHasNoneAreRefusedWithTheirReason) {
  v1::PlanMeasurementRequest request = Request();
  request.set_six_points(true);
  const auto plan = Plan(request);
  EXPECT_EQ(plan.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(runtime::ReasonOf(plan.status()), "SIX_POINTS_MISSING");
}

TEST_F(MeasuringPlanTest, WithoutCalibrationsThatHoldThereIsNoPlan) {
  plant_.calibration.sensor.mutable_interim_check()->set_verdict(calibration::v1::STUDY_VERDICT_REJECTED);
  EXPECT_EQ(runtime::ReasonOf(Plan(Request()).status()), "SENSOR_MOVED");
  plant_.calibration.expired = true;
  EXPECT_EQ(Plan(Request()).status().code(), absl::StatusCode::kFailedPrecondition);
}

// A record that says nothing of the scanner, or too few axes, is named; so is a scanner that sees volumes.
TEST_F(MeasuringPlanTest, AMachineThatCannotBePlannedOnIsNamed) {
  plant::v1::Machine& machine = plant_.plant.machine;
  const plant::v1::Machine good = machine;
  machine.mutable_sensor()->clear_mid_range_mm();
  EXPECT_THAT(std::string(Plan(Request()).status().message()), HasSubstr("machine.sensor.mid_range_mm: 0, want > 0"));
  machine = good;
  machine.mutable_sensor()->set_kind(plant::v1::SENSOR_KIND_SNAPSHOT);
  EXPECT_EQ(runtime::ReasonOf(Plan(Request()).status()), "SENSOR_UNSUITABLE");
  machine = good;
  machine.mutable_kinematics()->mutable_part_side()->RemoveLast();
  EXPECT_THAT(std::string(Plan(Request()).status().message()), HasSubstr("kinematics"));
  EXPECT_FALSE(Plan(Request()).ok());
  machine = good;
  machine.mutable_kinematics()->clear_part_side();
  EXPECT_FALSE(Plan(Request()).ok());
}

TEST_F(MeasuringPlanTest, StopsWhereItsCallerIsGone) {
  const PlanInputs inputs = Inputs();
  for (const int questions : {0, 1, 5, 50}) {
    int asked = 0;
    const auto plan = PlanOf(Request(), inputs, 1, [&] { return ++asked <= questions; });
    EXPECT_TRUE(absl::IsCancelled(plan.status())) << questions << ": " << plan.status();
    EXPECT_EQ(asked, questions + 1);  // none after the first no
  }
}

TEST_F(MeasuringPlanTest, ACancelledCallGivesItsPlaceBack) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + 60s);
  std::thread leaves([&] {
    std::this_thread::sleep_for(20ms);
    context.TryCancel();
  });
  v1::MeasuringPlan plan;
  EXPECT_EQ(stub_->PlanMeasurement(&context, Request(), &plan).error_code(), grpc::StatusCode::CANCELLED);
  leaves.join();
  const auto until = std::chrono::steady_clock::now() + 20s;
  absl::Status next;
  do {
    next = Plan(Request()).status();
    std::this_thread::sleep_for(20ms);
  } while (absl::IsResourceExhausted(next) && std::chrono::steady_clock::now() < until);
  EXPECT_TRUE(next.ok()) << next;
}

TEST_F(MeasuringPlanTest, ItsTimeIsTheCalls) {
  EXPECT_EQ(Plan(Request(), 0.02).status().code(), absl::StatusCode::kDeadlineExceeded);
}

TEST_F(MeasuringPlanTest, TakesItsTurnAmongTheRegistrations) {
  const auto slot = pool_.Enter(std::chrono::steady_clock::now() + 1s, nullptr);
  ASSERT_TRUE(slot.ok());
  const auto plan = Plan(Request());
  EXPECT_EQ(plan.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(runtime::ReasonOf(plan.status()), "REGISTRATIONS_FULL");
}

}  // namespace
}  // namespace sixpoint::registration
