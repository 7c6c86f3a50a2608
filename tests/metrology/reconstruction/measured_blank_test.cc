// A blank seen by a scanner turned about it, beside where it truly stands: walls of a thin blade told apart, and what its places are uncertain by.
#include "metrology/reconstruction/measured_blank.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "metrology/frames/angles.h"
#include "tests/metrology/inspection/pinned_block.h"
#include "tests/metrology/reconstruction/blank_worlds.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;
using sixpoint::testing::BlankPoint;
using ::testing::HasSubstr;

// Edges of 0.2 mm radius. 0.25 mm too thick, more so towards the tip.
class Blade : public ::testing::Test {
 protected:
  Blade() {
    plant_.surface = sixpoint::testing::LensBlade({14, 1.7, 12}, 90);
    const auto design = SampleDesign(plant_.surface, 0.12, 2);
    points_ = sixpoint::testing::BlankPoints(*plant_.surface, design->places, [](const Vector3d& x, const Vector3d& n) {
      return Vector3d(x + (0.25 + 0.005 * x.z()) * n);
    });
  }

  Eigen::Isometry3d MachineFromPart(double b_deg) const {
    return plant_.axes.MachineFromZero(0, b_deg * kRadPerDeg) * plant_.pose.zero_from_part;
  }

  // What is seen at 10 deg from grazing at least.
  std::vector<LineScan> Scans() const {
    std::mt19937_64 random(11);
    std::vector<LineScan> scans;
    for (const double b_deg : {90.0, -90.0, 50.0, -130.0}) {
      Points seen;
      for (const BlankPoint& point : points_)
        if ((MachineFromPart(b_deg).linear() * point.outward).z() > 0.17) seen.push_back(point.point_mm);
      scans.push_back(Scanned(plant_, b_deg, seen, &random));
    }
    return scans;
  }

  absl::StatusOr<std::vector<BlankPatch>> Measured(const std::vector<LineScan>& scans, int threads = 2,
                                                   BlankCounts* counts = nullptr) const {
    MeasuredBlankOptions options;
    options.threads = threads;
    MeasuredBlank blank(plant_.surface, PartMapping(plant_.pose, plant_.sensor, plant_.axes), options);
    for (const LineScan& scan : scans) {
      if (absl::Status begun = blank.Begin(scan); !begun.ok()) return begun;
      if (absl::Status added = blank.AddPoints(scan.points_mm); !added.ok()) return added;
    }
    auto patches = blank.Finish(*SurfacePatches::Make(*plant_.surface, 0.5));
    if (counts != nullptr) *counts = blank.counts();
    return patches;
  }

  const BlankPoint& NearestTo(const BlankPatch& patch) const {
    return *std::min_element(points_.begin(), points_.end(), [&](const BlankPoint& a, const BlankPoint& b) {
      return (a.point_mm - patch.point_mm).squaredNorm() < (b.point_mm - patch.point_mm).squaredNorm();
    });
  }

  PinnedBlock plant_ = MakePinnedBlock();
  std::vector<BlankPoint> points_;
};

TEST_F(Blade, PatchesStandOnTheirOwnWall) {
  BlankCounts counts;
  const auto patches = Measured(Scans(), 2, &counts);
  ASSERT_TRUE(patches.ok()) << patches.status();
  EXPECT_EQ(counts.far_off, 0);
  EXPECT_LT(counts.shapeless, counts.taken / 50);
  int seen = 0, beyond = 0;
  for (const BlankPatch& patch : *patches) {
    const BlankPoint& truth = NearestTo(patch);
    EXPECT_GT(patch.normal.dot(truth.outward), std::cos(50 * kRadPerDeg)) << patch.point_mm.transpose();
    // A plane's height misses what a patch's surface bends by: on the flat of the blade that is nothing beside the noise.
    if (std::abs(patch.point_mm.x()) > 10) continue;
    ++seen;
    const double error_mm = (patch.point_mm - truth.point_mm).dot(truth.outward);
    beyond += std::abs(error_mm) > 3 * patch.standard_uncertainty_mm + 1e-3;
  }
  EXPECT_GT(seen, 3000);
  EXPECT_LT(beyond, seen / 50);
}

// What moves the whole part shows where the surface faces that way, and nowhere else.
TEST_F(Blade, WhatThePoseIsUncertainByIsInEachPlace) {
  const auto exact = Measured(Scans());
  ASSERT_TRUE(exact.ok()) << exact.status();
  Matrix6d covariance = Matrix6d::Zero();
  covariance(5, 5) = 0.02 * 0.02;  // of a shift along z at zero
  plant_.pose.noise.values = covariance;
  const auto patches = Measured(Scans());
  ASSERT_EQ(patches->size(), exact->size());
  for (std::size_t i = 0; i < patches->size(); ++i) {
    const double shift_mm = 0.02 * (plant_.pose.zero_from_part.linear() * (*exact)[i].normal).z();
    EXPECT_NEAR((*patches)[i].standard_uncertainty_mm, std::hypot((*exact)[i].standard_uncertainty_mm, shift_mm), 1e-9);
  }
}

TEST_F(Blade, ChipsAndSprayAreNoBlank) {
  std::vector<LineScan> scans = Scans();
  const auto clean = Measured(scans);
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  Points spray;
  for (int i = 0; i < 300; ++i)
    spray.push_back(Vector3d(14 * unit(random), 1.7 + 1.2 * unit(random), 12 * unit(random)));
  spray.push_back(Vector3d(0, 40, 0));
  scans.push_back(Scanned(plant_, 70, spray, &random));
  BlankCounts counts;
  const auto patches = Measured(scans, 2, &counts);
  ASSERT_TRUE(patches.ok()) << patches.status();
  EXPECT_EQ(counts.far_off, 1);
  EXPECT_GE(counts.shapeless, 290);
  ASSERT_EQ(patches->size(), clean->size());
  for (std::size_t i = 0; i < patches->size(); ++i)
    EXPECT_LT(((*patches)[i].point_mm - (*clean)[i].point_mm).norm(), 0.02);
}

TEST_F(Blade, IsTheSameBitsOnAnyNumberOfThreads) {
  const auto one = Measured(Scans(), 1), other = Measured(Scans(), 3);
  ASSERT_EQ(one->size(), other->size());
  for (std::size_t i = 0; i < one->size(); ++i) {
    EXPECT_TRUE((*one)[i].point_mm == (*other)[i].point_mm && (*one)[i].normal == (*other)[i].normal);
    EXPECT_EQ((*one)[i].standard_uncertainty_mm, (*other)[i].standard_uncertainty_mm);
  }
}

TEST_F(Blade, SaysWhatItCannotTake) {
  EXPECT_EQ(Measured({}).status().code(), absl::StatusCode::kFailedPrecondition);
  MeasuredBlankOptions options;
  options.greatest_point_count = 100;
  MeasuredBlank small(plant_.surface, PartMapping(plant_.pose, plant_.sensor, plant_.axes), options);
  const std::vector<LineScan> scans = Scans();
  ASSERT_TRUE(small.Begin(scans[0]).ok());
  const absl::Status full = small.AddPoints(scans[0].points_mm);
  EXPECT_EQ(full.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(full.message()), HasSubstr("more than 100 points"));
  options.keep_going = [] { return false; };
  MeasuredBlank gone(plant_.surface, PartMapping(plant_.pose, plant_.sensor, plant_.axes), options);
  ASSERT_TRUE(gone.Begin(scans[0]).ok());
  EXPECT_EQ(gone.AddPoints(scans[0].points_mm).code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace sixpoint::metrology
