// Whether corrections were right, asked of a plant that cut several blades: a machine whose tool stands off is found out, and one that is off by
// nothing is offered nothing. Both run the whole way, each blade clamped anew, through the real processes.
#include <gmock/gmock.h>
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "services/runtime/credentials.h"
#include "simulator/blade_run.h"
#include "simulator/registry.h"
#include "sixpoint/inspection/v1/efficacy.grpc.pb.h"
#include "tests/end_to_end/plant_processes.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::testing {
namespace {

using inspection::v1::EfficacyPeriod;
using inspection::v1::OffsetComponent;
using simulator::BladeRunPlan;

constexpr int kBlades = 6;

class EfficacyRun : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const std::string& area : PlantProcesses::Areas())
      ASSERT_TRUE(plant_.WaitUntilUp(area, 30)) << area << "\n" << plant_.Logs();
    auto link = simulator::PlantLink::Connect(plant_.server(), plant_.credentials(), 30, [](const std::string&) {});
    ASSERT_TRUE(link.ok()) << link.status();
    link_ = *std::move(link);
    artefact_ = simulator::RegisterArtefact(*link_, "efficacy-plate", simulator::ArtefactGeometry()).value();
    registered_ = simulator::RegisterPart(*link_, "efficacy-blade", part_).value();
  }

  // Blades of one machine, one after the other, under one calibration.
  void CutBlades(const std::string& machine, std::uint64_t seed, const Eigen::Vector3d& tool_off_mm) {
    for (int i = 0; i < kBlades; ++i) {
      BladeRunPlan plan;
      plan.machine_id = machine;
      plan.blade_serial = machine + "-SN-" + std::to_string(i + 1);
      plan.artefact = artefact_;
      plan.part = registered_;
      plan.scan_prefix = plan.blade_serial + "-";
      plan.seed = seed + static_cast<std::uint64_t>(i);
      plan.mounting_seed = seed;
      plan.calibrate = i == 0;
      plan.only_six_point = true;
      plan.airfoil_pitch_mm = 0.4;
      plan.pins_pitch_mm = 0.15;
      plan.threads = 2;
      plan.drilling.tool_off_mm = tool_off_mm;
      simulator::BladeRunResult result;
      const absl::Status done = simulator::RunBlade(
          *link_, design_, part_, plan, [](const std::string&) {}, &result);
      ASSERT_TRUE(done.ok()) << plan.blade_serial << ": " << done << "\n" << plant_.Logs();
    }
  }

  EfficacyPeriod Asked(const std::string& machine) {
    inspection::v1::ComputeEfficacyRequest request;
    request.set_machine("machines/" + machine);
    const auto efficacy = link_->Call("inspection", &inspection::v1::EfficacyService::Stub::ComputeEfficacy, request);
    EXPECT_TRUE(efficacy.ok()) << efficacy.status();
    if (!efficacy.ok() || efficacy->periods_size() != 1) {
      ADD_FAILURE() << "want one period of " << machine;
      return {};
    }
    EXPECT_EQ(efficacy->periods(0).blades_size(), kBlades);
    return efficacy->periods(0);
  }

  static std::map<OffsetComponent, inspection::v1::OffsetEstimate> Estimates(const EfficacyPeriod& period) {
    std::map<OffsetComponent, inspection::v1::OffsetEstimate> estimates;
    for (const auto& estimate : period.offsets()) {
      estimates[estimate.component()] = estimate;
      std::printf("  %s %.2f, U %.2f (thousandths of mm or deg)\n",
                  inspection::v1::OffsetComponent_Name(estimate.component()).c_str(), 1e3 * estimate.value(),
                  1e3 * estimate.expanded_uncertainty());
    }
    return estimates;
  }

  ThrowawayDatabase database_;
  PlantProcesses plant_{database_.conninfo()};
  const simulator::MachineDesign design_;
  const simulator::DesignedPart part_ = simulator::DesignPart({}, design_.centre_mm);
  std::unique_ptr<simulator::PlantLink> link_;
  std::string artefact_, registered_;
};

TEST_F(EfficacyRun, FindsOutAToolThatStandsOff) {
  const Eigen::Vector3d off_mm(0.03, -0.018, 0.01);
  CutBlades("off-1", 811, off_mm);
  const EfficacyPeriod period = Asked("off-1");
  auto estimates = Estimates(period);
  const auto& x = estimates[inspection::v1::OFFSET_COMPONENT_X];
  const auto& y = estimates[inspection::v1::OFFSET_COMPONENT_Y];
  EXPECT_NEAR(x.value(), off_mm.x(), x.expanded_uncertainty());
  EXPECT_NEAR(y.value(), off_mm.y(), y.expanded_uncertainty());
  // Nothing tells Z, along which every hole is drilled.
  EXPECT_EQ(estimates.count(inspection::v1::OFFSET_COMPONENT_Z), 0u);
  EXPECT_THAT(period.not_determined(), ::testing::Contains(inspection::v1::OFFSET_COMPONENT_Z));
  std::vector<int> offered;
  for (const auto& component : period.offered_offset().components()) offered.push_back(component.component());
  EXPECT_THAT(offered, ::testing::ElementsAre(inspection::v1::OFFSET_COMPONENT_X, inspection::v1::OFFSET_COMPONENT_Y))
      << period.ShortDebugString();
}

TEST_F(EfficacyRun, OffersNothingOfAMachineThatIsOffByNothing) {
  CutBlades("true-1", 823, Eigen::Vector3d::Zero());
  const EfficacyPeriod period = Asked("true-1");
  // Of four intervals of 95 % one may miss 0 by a little in one plant of five; none by half of itself.
  for (const auto& [component, estimate] : Estimates(period))
    EXPECT_NEAR(estimate.value(), 0, 1.5 * estimate.expanded_uncertainty()) << component;
  EXPECT_FALSE(period.has_offered_offset()) << period.ShortDebugString();
  EXPECT_GT(period.not_offered_size(), 0);
}

}  // namespace
}  // namespace sixpoint::testing
