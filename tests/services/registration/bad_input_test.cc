// Every input that a registration must not take for a good one, by the real service: what is refused names its field, stores
// nothing; what is a result without a pose says what is wrong and has nothing that looks like one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "metrology/cloud/draco_codec.h"
#include "metrology/mesh/mesh_bytes.h"
#include "services/runtime/geometry_proto.h"
#include "storage/blobs.h"
#include "tests/metrology/mesh/shapes.h"
#include "tests/services/registration/fake_plant.h"

namespace sixpoint::registration {
namespace {

using Eigen::Vector3d;
using metrology::SurfacePoint;
using metrology::TriangleMesh;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr char kMirrored[] = "fit the CAD's mirror image";

class BadInputTest : public FakePlantTest {
 protected:
  BadInputTest() { Design(TrueBlade()); }

  static void ExpectAPlanesFreedoms(const v1::Registration& plane) {
    const std::string& remark = plane.evidence().remark();
    EXPECT_THAT(remark, HasSubstr("3 directions free"));
    EXPECT_THAT(remark, HasSubstr("shift along the part's x"));
    EXPECT_THAT(remark, HasSubstr("shift along the part's y"));
    EXPECT_THAT(remark, HasSubstr("turn about the part's z"));
    EXPECT_THAT(remark, Not(HasSubstr("shift along the part's z")));
  }
};

TEST_F(BadInputTest, FewerPointsThanUnknownsAreRefused) {
  for (std::size_t view = 0; view < plant_.scans.size(); ++view) ScanPoints(view, {{1, 2, 3}});
  for (const v1::Method method : {v1::METHOD_BEST_FIT, v1::METHOD_LOCAL, v1::METHOD_SIX_POINT, v1::METHOD_ALLOWANCE})
    EXPECT_THAT(RefusalOf(Request(method)), StartsWith("scans: 4 points, want at least 6")) << v1::Method_Name(method);
  // With fewer unknowns as well: so few tell nothing of their own noise.
  v1::RegisterRequest along = Request(v1::METHOD_BEST_FIT);
  along.mutable_options()->add_degrees_of_freedom(v1::FREEDOM_SHIFT_Z);
  EXPECT_THAT(RefusalOf(along), StartsWith("scans: 4 points, want at least 6"));
  Scan(TrueBlade());
  v1::RegisterRequest beside = Request(v1::METHOD_LOCAL);
  v1::Ball& ball = *beside.mutable_options()->add_regions_in()->mutable_ball();
  runtime::ToProto(Vector3d(100, 0, 0), ball.mutable_centre_mm());
  ball.set_radius_mm(1);
  EXPECT_THAT(RefusalOf(beside), HasSubstr("regions: 0 points in them, want at least 6"));
}

TEST_F(BadInputTest, TheWrongBladeAndTheWrongUnitAreToldApart) {
  struct Case {
    const char* name;
    TriangleMesh cad, body;
    const char* remark;
  };
  for (const Case& c :
       {Case{"other blade", TrueBlade(), metrology::shapes::Torus(14, 5, 80, 80, Vector3d::Zero()), "another blade"},
        Case{"broader blade", TrueBlade(), Mapped(TrueBlade(), Vector3d(1.3, 0.7, 1.1).asDiagonal()), "another blade"},
        Case{"CAD in inches", Mapped(TrueBlade(), Eigen::Matrix3d::Identity() / 25.4), TrueBlade(), "inches"},
        Case{"CAD taken for inches", Mapped(TrueBlade(), Eigen::Matrix3d::Identity() * 25.4), TrueBlade(), "25.4"},
        Case{"CAD in metres", Mapped(TrueBlade(), Eigen::Matrix3d::Identity() / 1000), TrueBlade(), "metres"}}) {
    SCOPED_TRACE(c.name);
    Design(c.cad);
    Scan(c.body);
    const std::string remark =
        WithoutPose(Request(v1::METHOD_BEST_FIT), v1::OUTCOME_TOO_LITTLE_OVERLAP).evidence().remark();
    EXPECT_THAT(remark, HasSubstr(c.remark));
    EXPECT_EQ(remark.find("inches") != std::string::npos, std::string(c.name).find("inches") != std::string::npos);
    EXPECT_THAT(remark, Not(HasSubstr(kMirrored)));
  }
  // A fixture beside the blade, of which little is seen.
  Design(TrueBlade());
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  Scan(TrueBlade(), nullptr, [&](const SurfacePoint& on) {
    return unit(random) < 0.15 ? on.point_mm : Vector3d(40 * unit(random) - 20, 20 + 20 * unit(random), 3);
  });
  const v1::Registration little = WithoutPose(Request(v1::METHOD_BEST_FIT), v1::OUTCOME_TOO_LITTLE_OVERLAP);
  EXPECT_THAT(little.evidence().remark(), Not(HasSubstr(kMirrored)));
}

// By every method that fits to the surface, of all the blade and of a region.
TEST_F(BadInputTest, AMirroredCadIsSaid) {
  Design(Mapped(TrueBlade(), Vector3d(-1, 1, 1).asDiagonal()));
  Scan(TrueBlade());
  std::vector<v1::RegisterRequest> requests;
  for (const v1::Method method :
       {v1::METHOD_BEST_FIT, v1::METHOD_LOCAL, v1::METHOD_SIX_POINT, v1::METHOD_SIX_POINT_NORMALS})
    requests.push_back(Request(method));
  v1::HoleGroupNeighbourhood& near =
      *requests.emplace_back(Request(v1::METHOD_LOCAL)).mutable_options()->add_regions_in()->mutable_hole_group();
  near.set_group("G2");
  near.set_margin_mm(7);
  for (const v1::RegisterRequest& request : requests) {
    SCOPED_TRACE(request.ShortDebugString());
    const v1::Registration mirrored = WithoutPose(request);
    EXPECT_THAT(mirrored.evidence().remark(), HasSubstr(kMirrored));
    EXPECT_THAT(mirrored.evidence().remark(), HasSubstr("want the CAD of the hand that was scanned"));
  }
}

// The plant refuses such CAD (plant_service_test); what came from elsewhere is refused here.
TEST_F(BadInputTest, MeshesThatBoundNoBodyAreRefused) {
  Scan(TrueBlade());
  const auto give = [&](const TriangleMesh& mesh) {
    plant_.plant.surface_bytes = metrology::MeshBytes(mesh);
    plant_.plant.part.mutable_surface()->set_surface_sha256(storage::Sha256Hex(plant_.plant.surface_bytes));
  };
  TriangleMesh fin = TrueBlade();
  fin.corner_normals.clear();
  fin.vertices_mm.emplace_back(0, 30, 0);
  fin.triangles.push_back(
      {fin.triangles[0][0], fin.triangles[0][1], static_cast<std::uint32_t>(fin.vertices_mm.size() - 1)});
  give(fin);
  EXPECT_THAT(RefusalOf(Request(v1::METHOD_BEST_FIT)),
              HasSubstr("surface.triangles: 1 edges with more than two triangles, the first at"));
  TriangleMesh inside_out = TrueBlade();
  inside_out.corner_normals.clear();
  for (auto& t : inside_out.triangles) std::swap(t[0], t[1]);
  give(inside_out);
  EXPECT_THAT(RefusalOf(Request(v1::METHOD_BEST_FIT)), HasSubstr("surface.triangles: inside out"));
  TriangleMesh line;
  line.vertices_mm = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  line.triangles = {{0, 1, 2}};
  give(line);
  EXPECT_THAT(RefusalOf(Request(v1::METHOD_BEST_FIT)), HasSubstr("surface.triangles: none has an area, want"));
  line.vertices_mm[1].y() = kNan;
  give(line);
  EXPECT_THAT(RefusalOf(Request(v1::METHOD_BEST_FIT)), HasSubstr("mesh.vertices_mm: not finite"));
}

// An open sheet is a surface, and triangles without area are no part of one: the blade is found as with whole CAD. The plant's
// answer counts both (plant_service_test).
TEST_F(BadInputTest, HolesAndTrianglesWithoutAreaDoNotMoveThePose) {
  Scan(TrueBlade());
  const double whole_um = ErrorUm(Register(Request(v1::METHOD_BEST_FIT)), NestMm());
  TriangleMesh holed = TrueBlade();
  std::size_t kept = 0;
  for (std::size_t t = 0; t < holed.triangles.size(); ++t) {
    const Vector3d& at = holed.vertices_mm[holed.triangles[t][0]];
    if ((at - Vector3d(0, 4, 0)).norm() < 4) continue;
    holed.triangles[kept] = holed.triangles[t];
    holed.corner_normals[kept++] = holed.corner_normals[t];
  }
  ASSERT_LT(kept, holed.triangles.size() - 20);
  holed.triangles.resize(kept);
  holed.corner_normals.resize(kept);
  holed.closed = false;
  TriangleMesh with_lines = TrueBlade();
  for (std::size_t t = 0; t < 50; ++t) {
    with_lines.triangles.push_back(
        {with_lines.triangles[t][0], with_lines.triangles[t][1], with_lines.triangles[t][1]});
    with_lines.corner_normals.push_back(with_lines.corner_normals[t]);
  }
  for (const TriangleMesh& mesh : {holed, with_lines}) {
    Design(mesh);
    const v1::Registration found = Register(Request(v1::METHOD_BEST_FIT));
    ASSERT_EQ(found.evidence().outcome(), v1::OUTCOME_CONVERGED) << found.evidence().remark();
    EXPECT_LT(ErrorUm(found, NestMm()), whole_um + 0.5);
  }
}

TEST_F(BadInputTest, WhatPointsDoNotHoldIsNamed) {
  Scan(TrueBlade(), [](const SurfacePoint& on) { return on.normal.z() > 0.999; });  // the flat cap of the tip
  const v1::Registration plane = WithoutPose(Request(v1::METHOD_BEST_FIT), v1::OUTCOME_NOT_DETERMINED);
  ExpectAPlanesFreedoms(plane);
  // The same region of whole scans, by either method.
  Scan(TrueBlade());
  for (const v1::Method method : {v1::METHOD_LOCAL, v1::METHOD_BEST_FIT}) {
    v1::RegisterRequest cap = Request(method);
    v1::Ball& ball = *cap.mutable_options()->add_regions_in()->mutable_ball();
    runtime::ToProto(Vector3d(0, 0, 20), ball.mutable_centre_mm());
    ball.set_radius_mm(1.2);  // the flanks begin at 1.8 mm
    ExpectAPlanesFreedoms(WithoutPose(cap, v1::OUTCOME_NOT_DETERMINED));
  }

  Scan(TrueBlade(), [](const SurfacePoint& on) { return on.normal.y() > 0.3 && std::abs(on.point_mm.z()) < 12; });
  const v1::Registration side = Register(Request(v1::METHOD_BEST_FIT));
  ASSERT_EQ(side.evidence().outcome(), v1::OUTCOME_CONVERGED) << side.evidence().remark();
  EXPECT_THAT(side.evidence().remark(), HasSubstr("weakly held: "));
  EXPECT_THAT(side.evidence().remark(), HasSubstr("along the part's z"));
  EXPECT_THAT(side.evidence().weakest_direction_in_words(), HasSubstr("along the part's z"));

  Scan(TrueBlade());
  const v1::Registration whole = Register(Request(v1::METHOD_BEST_FIT));
  EXPECT_EQ(whole.evidence().remark(), "");
}

TEST_F(BadInputTest, SixPointsThatAreNoNestAreRefusedOrSaid) {
  Scan(TrueBlade());
  const plant::v1::Part good = plant_.plant.part;
  plant::v1::DatumPoint& datum = *plant_.plant.part.mutable_six_points(2);
  datum.mutable_point_in_part_mm()->set_y_mm(datum.point_in_part_mm().y_mm() + 0.5);
  EXPECT_THAT(RefusalOf(Request(v1::METHOD_SIX_POINT)), HasSubstr("part.six_points[D3].point_in_part_mm"));
  plant_.plant.part = good;
  plant_.plant.part.mutable_six_points(4)->mutable_normal_in_part()->set_x(-good.six_points(4).normal_in_part().x());
  EXPECT_THAT(RefusalOf(Request(v1::METHOD_SIX_POINT_NORMALS)), HasSubstr("part.six_points[D5].normal_in_part"));
  plant_.plant.part.mutable_six_points(4)->mutable_point_in_part_mm()->set_x_mm(kNan);
  EXPECT_THAT(RefusalOf(Request(v1::METHOD_SIX_POINT)), HasSubstr("six_points"));
  plant_.plant.part = good;
  for (int i = 1; i < 6; ++i) {
    *plant_.plant.part.mutable_six_points(i)->mutable_point_in_part_mm() = good.six_points(0).point_in_part_mm();
    *plant_.plant.part.mutable_six_points(i)->mutable_normal_in_part() = good.six_points(0).normal_in_part();
  }
  const v1::Registration flat = WithoutPose(Request(v1::METHOD_SIX_POINT_NORMALS), v1::OUTCOME_NOT_DETERMINED);
  EXPECT_THAT(flat.evidence().remark(), HasSubstr("the six points do not locate the part"));
  EXPECT_FALSE(flat.evidence().has_disagreement());
}

// One point, a few, a whole scan, all scans.
TEST_F(BadInputTest, PointsFarAwayAreRefusedOrSaid) {
  // No stored block can hold a point at 1e9 mm beside others: its numbers would be rounded to tens of millimetres.
  EXPECT_FALSE(metrology::EncodeBlock({{0, 0, 3}, {1, 0, 3}, {1e9, 0, 3}}, metrology::kDefaultErrorBoundMm).ok());
  for (const int far_count : {1, 2}) {
    Scan(TrueBlade());
    metrology::Points points;
    for (int i = 0; i < 2000; ++i)
      points.push_back(Vector3d(0.01 * i, 0, i % 1000 == 999 && i >= 2000 - 1000 * far_count ? 3500 : 3));
    ScanPoints(1, points);
    for (const v1::Method method : {v1::METHOD_BEST_FIT, v1::METHOD_SIX_POINT, v1::METHOD_ALLOWANCE})
      EXPECT_THAT(RefusalOf(Request(method)),
                  StartsWith("scans[s1]: " + std::to_string(far_count) + " points metres away"))
          << v1::Method_Name(method);
  }
  // A whole scan 1e6 m off: the others hold the blade, and the remark names it.
  Scan(TrueBlade());
  const auto v0_of = [&](std::size_t i) {
    return plant_.ingest.scans.at(plant_.scans[i]).mutable_header()->mutable_v0_mm();
  };
  v0_of(1)->set_x_mm(1e9);
  const v1::Registration three = Register(Request(v1::METHOD_BEST_FIT));
  EXPECT_EQ(three.evidence().outcome(), v1::OUTCOME_CONVERGED);
  EXPECT_LT(ErrorUm(three, NestMm()), 1);
  EXPECT_THAT(three.evidence().remark(), HasSubstr("few points used of: s1 (0 %)"));
  EXPECT_EQ(Count("registration_scans WHERE residual_median_um IS NULL AND points_used = 0"), 1);
  EXPECT_EQ(Count("registration_scans WHERE residual_median_um IS NOT NULL"), 3);
  for (std::size_t i = 0; i < plant_.scans.size(); ++i) v0_of(i)->set_x_mm(1e9);
  for (const v1::Method method : {v1::METHOD_BEST_FIT, v1::METHOD_LOCAL, v1::METHOD_SIX_POINT})
    EXPECT_THAT(WithoutPose(Request(method), v1::OUTCOME_TOO_LITTLE_OVERLAP).evidence().remark(),
                HasSubstr("of the points 0 % lie"))
        << v1::Method_Name(method);
  EXPECT_THAT(RefusalOf(Request(v1::METHOD_ALLOWANCE)), StartsWith("scans: 0 patches with points within 5 mm"));
}

TEST_F(BadInputTest, WhatIsNotFiniteIsRefused) {
  EXPECT_FALSE(metrology::EncodeBlock({{0, 0, 3}, {1, kNan, 3}}, metrology::kDefaultErrorBoundMm).ok());
  Scan(TrueBlade());
  ingest::v1::ScanHeader& header = *plant_.ingest.scans.at(plant_.scans[1]).mutable_header();
  const ingest::v1::ScanHeader good = header;
  header.mutable_v0_mm()->set_x_mm(kNan);
  EXPECT_THAT(RefusalOf(Request(v1::METHOD_BEST_FIT)),
              HasSubstr("scans[1]: scans/s1, of whose 20000 points none is at a finite place"));
  header = good;
  header.set_b_deg(std::numeric_limits<double>::infinity());
  EXPECT_THAT(RefusalOf(Request(v1::METHOD_BEST_FIT)), HasSubstr("none is at a finite place"));
  header = good;
  plant_.plant.part.mutable_zero_from_part_nominal()->mutable_translation_mm()->set_y_mm(kNan);
  EXPECT_THAT(RefusalOf(Request(v1::METHOD_BEST_FIT)), HasSubstr("part.zero_from_part_nominal"));
  Design(TrueBlade());
  runtime::ToProto(plant_.block.pose.zero_from_part, plant_.plant.part.mutable_zero_from_part_nominal());
  v1::RegisterRequest request = Request(v1::METHOD_BEST_FIT);
  for (int i = 0; i < request.scans_size(); ++i) request.mutable_options()->add_scan_weights(i == 2 ? kNan : 1);
  EXPECT_THAT(RefusalOf(request), StartsWith("options.scan_weights[2]: NaN"));
}

}  // namespace
}  // namespace sixpoint::registration
