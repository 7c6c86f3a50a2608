// The kernel on a plant's real clouds, with the true calibrations: what is left is the fit's own error.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "metrology/cad/tessellation.h"
#include "metrology/cloud/draco_codec.h"
#include "metrology/frames/angles.h"
#include "metrology/registration/six_point.h"
#include "tests/metrology/plant_files.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;
using nlohmann::json;
using testing::PoseOf;
using testing::ReadFile;
using testing::VectorOf;

constexpr double kBoundUm = 1.5;  // what a plant wants; calibrations at their bound leave 0.8

class PlantA : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* shared = std::getenv("SIXPOINT_SHARED_DIR");
    folder_ = std::string(shared == nullptr ? "" : shared) + "/data/plant-a";
    if (!std::ifstream(folder_ + "/dataset.json")) GTEST_SKIP() << folder_ << " is absent";
    dataset_ = json::parse(ReadFile(folder_ + "/dataset.json"));
    const json truth = json::parse(ReadFile(folder_ + "/truth.json"));
    for (int row = 0; row < 3; ++row)
      calibration_.sensor.rotation.row(row) = VectorOf(truth["machine_from_sensor_rotation"][row]);
    calibration_.sensor.t_sm_mm = VectorOf(truth["T_sm_mm"]);
    calibration_.axes.a = {VectorOf(truth["a_axis"]["direction"]).normalized(), VectorOf(truth["a_axis"]["point"])};
    calibration_.axes.b = {VectorOf(truth["b_axis"]["direction"]).normalized(), VectorOf(truth["b_axis"]["point"])};
    truth_ = PoseOf(truth["zero_from_part"]);
    nominal_ = PoseOf(dataset_["part"]["zero_from_part_nominal"]);
    for (const json& group : dataset_["part"]["hole_groups"])
      for (const json& hole : group["holes"]) {
        judged_mm_.push_back(VectorOf(hole["start_in_part_mm"]));
        if (group["name"] == "G2") judged_g2_mm_.push_back(judged_mm_.back());
      }
    for (const json& datum : dataset_["part"]["six_points"]) {
      datums_.push_back({datum["name"], VectorOf(datum["point_in_part_mm"]), VectorOf(datum["normal_in_part"])});
      judged_mm_.push_back(datums_.back().point_mm);
    }
    static const auto* mesh =
        new absl::StatusOr<TriangleMesh>(TessellateCad(CadFormat::kStep, folder_ + "/cad.step", {1.0, 1'500'000, 4.0}));
    ASSERT_TRUE(mesh->ok()) << mesh->status();
    surface_ = *Surface::Prepare(**mesh);
  }

  std::vector<ScanPortion> Portions(const std::string& blade, const std::string& kind) const {
    std::vector<json> scans;
    for (const json& scan : dataset_["scans"])
      if (scan["subject"] == "blade:" + blade && scan["kind"] == kind) scans.push_back(scan);
    Thinning thinning;
    thinning.target_count = 200'000 / static_cast<std::int64_t>(scans.size());
    for (const DatumPoint& datum : datums_) thinning.dense_places_mm.push_back(nominal_ * datum.point_mm);
    std::vector<ScanPortion> portions;
    for (const json& in : scans) {
      auto points = DecodeBlock(ReadFile(folder_ + "/" + in["file"].get<std::string>()), in["point_count"]);
      EXPECT_TRUE(points.ok()) << points.status();
      LineScan scan{in["id"],
                    *std::move(points),
                    VectorOf(in["v0_mm"]),
                    in["a_deg"].get<double>() * kRadPerDeg,
                    in["b_deg"].get<double>() * kRadPerDeg,
                    in["profile_pitch_mm"]};
      portions.push_back(Thin(scan, calibration_, thinning));
    }
    return portions;
  }

  double WorstUm(const PoseFit& fit, const Points& judged_mm) const {
    double worst = 0;
    for (const Vector3d& p : judged_mm)
      worst = std::max(worst, 1e3 * (fit.placed.value().zero_from_part * p - truth_ * p).norm());
    return worst;
  }

  std::string folder_;
  json dataset_;
  MachineCalibration calibration_ = MachineCalibration::Exact();
  Eigen::Isometry3d truth_, nominal_;
  Points judged_mm_, judged_g2_mm_;
  std::vector<DatumPoint> datums_;
  std::shared_ptr<const Surface> surface_;
};

TEST_F(PlantA, FindsTheTrueBladeByBestFitAndSixPoint) {
  const std::vector<ScanPortion> portions = Portions("SN-0001", "airfoil");
  const auto fit = FitToSurface(*surface_, portions, nominal_, calibration_, {});
  ASSERT_TRUE(fit.ok()) << fit.status();
  ASSERT_EQ(fit->outcome, Outcome::kConverged) << fit->evidence.remark;
  EXPECT_LT(WorstUm(*fit, judged_mm_), kBoundUm);
  EXPECT_EQ(fit->evidence.remark, "");
  for (const PortionEvidence& portion : fit->evidence.portions)
    EXPECT_GT(portion.points_used, portion.point_count * 8 / 10) << portion.scan;
  const auto six = FitSixPoints(*surface_, portions, datums_, *fit, SixPointVariant::kPairs, calibration_, {});
  ASSERT_TRUE(six.ok()) << six.status();
  ASSERT_EQ(six->outcome, Outcome::kConverged) << six->evidence.remark;
  EXPECT_LT(WorstUm(*six, judged_mm_), kBoundUm);
}

TEST_F(PlantA, FindsGroupG2ByItsLocalScan) {
  const auto fit = FitToSurface(*surface_, Portions("SN-0001", "local"), nominal_, calibration_, {});
  ASSERT_TRUE(fit.ok()) << fit.status();
  ASSERT_EQ(fit->outcome, Outcome::kConverged) << fit->evidence.remark;
  EXPECT_LT(WorstUm(*fit, judged_g2_mm_), kBoundUm);
}

// Its surface deviates from CAD nearly everywhere, by up to 0.3 mm (3 % of it lies within 5 um). The loss must stay as wide
// as that, lose no scan, and the evidence must name a scan whose points it takes for less than the others'.
TEST_F(PlantA, TakesACastingWhole) {
  const auto fit = FitToSurface(*surface_, Portions("SN-0002", "airfoil"), nominal_, calibration_, {});
  ASSERT_TRUE(fit.ok()) << fit.status();
  EXPECT_EQ(fit->outcome, Outcome::kConverged) << fit->evidence.remark;
  EXPECT_GT(1e3 * fit->evidence.residual_sigma_mm, 20);
  EXPECT_GT(fit->evidence.overlap, 0.75);
  for (const PortionEvidence& portion : fit->evidence.portions) {
    const double used = static_cast<double>(portion.points_used) / static_cast<double>(portion.point_count);
    EXPECT_GT(used, 0.25) << portion.scan;
    EXPECT_EQ(used < 0.6 * fit->evidence.overlap, fit->evidence.remark.find(portion.scan + " (") != std::string::npos)
        << portion.scan << ": " << fit->evidence.remark;
  }
}

}  // namespace
}  // namespace sixpoint::metrology
