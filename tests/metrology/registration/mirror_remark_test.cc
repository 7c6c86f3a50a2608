#include "metrology/registration/mirror_remark.h"

#include <gtest/gtest.h>

#include <ctime>

#include "tests/metrology/registration/sampled_blade.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::size_t kViewPoints = 6'000;
const Vector3d kBladeCentreMm(3, -2, 5);  // a mirrored CAD stands elsewhere, too

TriangleMesh TrueBlade() { return shapes::Blade(160, 80, kBladeCentreMm); }

TriangleMesh Mapped(TriangleMesh mesh, const Matrix3d& map) {
  for (Vector3d& vertex : mesh.vertices_mm) vertex = map * vertex;
  mesh.corner_normals.clear();
  if (map.determinant() < 0)
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}
Matrix3d Scaled(double x, double y, double z) { return Vector3d(x, y, z).asDiagonal(); }
std::shared_ptr<const Surface> SurfaceOf(const TriangleMesh& mesh) { return *Surface::Prepare(mesh); }

// What a scanner sees of a body at `view_count` turns about x, half a turn apart.
std::vector<ScanPortion> ViewsOfBody(
    const Surface& body, const Isometry3d& zero_from_body, int view_count, std::uint64_t seed,
    const std::function<Vector3d(const Vector3d&, const Vector3d&)>& changed = nullptr) {
  std::vector<ScanPortion> portions;
  for (int view = 0; view < view_count; ++view) {
    const Matrix3d sensor_from_zero = RotationFromVector(Vector3d(M_PI * view, 0, 0));
    SpreadSamples seen = Spread(
        body, kViewPoints, 2 * seed + static_cast<std::uint64_t>(view),
        [&](const SurfacePoint& on) { return (sensor_from_zero * zero_from_body.linear() * on.normal).z() > 0.35; });
    if (changed)
      for (std::size_t i = 0; i < seen.points_mm.size(); ++i)
        seen.points_mm[i] = changed(seen.points_mm[i], seen.normals[i]);
    ScanPortion portion;
    portion.id = std::to_string(view);
    portion.zero_from_sensor.linear() = sensor_from_zero.transpose();
    for (const Vector3d& p : Scanned(seen.points_mm, zero_from_body, 2e-3, seed))
      portion.sensor.Add(sensor_from_zero * p);
    portions.push_back(portion);
  }
  return portions;
}

// Where the blade stands and where it should: up to about a millimetre and a degree and a half beside.
struct Stand {
  Isometry3d zero_from_body, nominal;
  explicit Stand(std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal(0, 1);
    const auto draw = [&](double scale) {
      const double x = normal(random), y = normal(random), z = normal(random);
      return Vector3d(scale * Vector3d(x, y, z));
    };
    nominal.setIdentity();
    nominal.linear() = RotationFromVector({M_PI / 2, 0, 0}) * RotationFromVector(draw(0.3));  // seen from its sides
    nominal.translation() = Vector3d(20, 50, -190) + draw(10);
    Vector6d off;
    off << draw(0.01), draw(0.4);
    zero_from_body = Perturbed(nominal, off, nominal * kBladeCentreMm);
  }
};

std::string RemarkOn(const Surface& cad, const std::vector<ScanPortion>& portions, const Isometry3d& nominal,
                     const FitOptions& options = {}) {
  const auto remark = MirrorRemark(cad, portions, nominal, MachineCalibration::Exact(), options);
  EXPECT_TRUE(remark.ok()) << remark.status();
  return remark.ok() ? *remark : "";
}
bool IsSaid(const std::string& remark) { return remark.find("fit the CAD's mirror image") != std::string::npos; }

// 18 stands; through each of the CAD's planes; a true blade, and a casting that deviates by 0.1 mm: each is found.
TEST(MirrorRemark, SaysThatTheCadIsMirrored) {
  const auto truth = SurfaceOf(TrueBlade());
  const std::vector<std::shared_ptr<const Surface>> cads = {SurfaceOf(Mapped(TrueBlade(), Scaled(-1, 1, 1))),
                                                            SurfaceOf(Mapped(TrueBlade(), Scaled(1, -1, 1))),
                                                            SurfaceOf(Mapped(TrueBlade(), Scaled(1, 1, -1)))};
  for (std::uint64_t seed = 0; seed < 18; ++seed) {
    const Stand stand(seed);
    const Surface& cad = *cads[seed % 3];
    const auto portions =
        ViewsOfBody(*truth, stand.zero_from_body, 2, seed, [&](const Vector3d& p, const Vector3d& normal) {
          return Vector3d(seed % 2 == 0 ? p : p + 0.1 * std::sin(0.3 * p.z()) * normal);
        });
    const auto fit = FitToSurface(cad, portions, stand.nominal, MachineCalibration::Exact(), {});
    ASSERT_TRUE(fit.ok()) << fit.status();
    EXPECT_NE(fit->outcome, Outcome::kConverged) << seed;
    const std::string remark = RemarkOn(cad, portions, stand.nominal);
    EXPECT_TRUE(IsSaid(remark)) << seed << ": " << remark;
    EXPECT_NE(remark.find("; want the CAD of the hand that was scanned"), std::string::npos) << remark;
  }
}

TEST(MirrorRemark, LooksAtAnyTurnWhereTheFitDid) {
  const auto truth = SurfaceOf(TrueBlade());
  const auto cad = SurfaceOf(Mapped(TrueBlade(), Scaled(-1, 1, 1)));
  FitOptions options;
  options.coarse_start = true;
  int said = 0;
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    const auto portions = ViewsOfBody(*truth, Stand(seed).zero_from_body, 2, seed);
    Isometry3d elsewhere = Stand(seed).nominal;
    elsewhere.linear() = RotationFromVector({0.9, -0.6, 0.4}) * elsewhere.linear();
    EXPECT_TRUE(IsSaid(RemarkOn(*cad, portions, elsewhere, options))) << seed;
    said += IsSaid(RemarkOn(*cad, portions, elsewhere));
  }
  EXPECT_LT(said, 4);  // so it is the option that finds it
}

// Nothing of a blade of another shape or size, one clamped the other way round, scans in another unit, of one side of
// another blade, of a fixture with little of the blade: 6 stands each.
TEST(MirrorRemark, SaysNothingOfWhatIsNotMirrored) {
  const auto truth = SurfaceOf(TrueBlade()), torus = SurfaceOf(shapes::Torus(14, 5, 80, 80, kBladeCentreMm)),
             small = SurfaceOf(Mapped(TrueBlade(), Matrix3d::Identity() / 25.4));
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    const Stand stand(seed);
    const auto other =
        SurfaceOf(Mapped(TrueBlade(), Scaled(0.85 + 0.3 * unit(random), 0.7 + 0.2 * unit(random), 1.05)));
    EXPECT_EQ(RemarkOn(*truth, ViewsOfBody(*other, stand.zero_from_body, 2, seed), stand.nominal), "") << seed;
    EXPECT_EQ(RemarkOn(*truth, ViewsOfBody(*other, stand.zero_from_body, 1, seed), stand.nominal), "") << seed;
    EXPECT_EQ(RemarkOn(*truth, ViewsOfBody(*torus, stand.zero_from_body, 2, seed), stand.nominal), "") << seed;
    EXPECT_EQ(RemarkOn(*small, ViewsOfBody(*truth, stand.zero_from_body, 2, seed), stand.nominal), "") << seed;
    Isometry3d round = stand.zero_from_body;
    round.linear() = round.linear() * Matrix3d(Scaled(-1, -1, 1));
    EXPECT_EQ(RemarkOn(*truth, ViewsOfBody(*truth, round, 2, seed), stand.nominal), "") << seed;
    EXPECT_EQ(RemarkOn(*truth, ViewsOfBody(*truth, round, 1, seed), stand.nominal), "") << seed;
    const auto fixture = [&](const Vector3d& p, const Vector3d&) {
      return unit(random) < 0.15 ? p : Vector3d(40 * unit(random) - 20, 20 + 20 * unit(random), 3);
    };
    EXPECT_EQ(RemarkOn(*truth, ViewsOfBody(*truth, stand.zero_from_body, 2, seed, fixture), stand.nominal), "") << seed;
  }
}

// Of a blank it is said where its stock is little and even enough, never where it is of the CAD's own hand.
TEST(MirrorRemark, OfABlankSaysWhatItsStockLeaves) {
  const auto truth = SurfaceOf(TrueBlade()), cad = SurfaceOf(Mapped(TrueBlade(), Scaled(-1, 1, 1)));
  FitOptions options;
  options.greatest_spread_mm = 1;
  int said = 0;
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    const Stand stand(seed);
    const auto portions =
        ViewsOfBody(*truth, stand.zero_from_body, 2, seed, [&](const Vector3d& p, const Vector3d& normal) {
          const Vector3d q = p - kBladeCentreMm;
          const double phase = static_cast<double>(seed);
          return Vector3d(p + 0.2 * (1 + 0.3 * std::sin(0.2 * q.z() + phase) + 0.2 * std::sin(0.3 * q.x())) * normal);
        });
    EXPECT_EQ(RemarkOn(*truth, portions, stand.nominal, options), "") << seed;
    said += IsSaid(RemarkOn(*cad, portions, stand.nominal, options));
  }
  EXPECT_GE(said, 2);
  RecordProperty("said_of_8", said);
  std::printf("said of %d mirrored blanks of 8\n", said);
}

// With three planes of symmetry, or with one. The image is found, and the part itself as well.
TEST(MirrorRemark, SaysNothingOfAPartThatIsItsOwnMirrorImage) {
  const TriangleMesh ellipse = Mapped(shapes::Torus(14, 5, 160, 80, Vector3d(1, 2, 3)),
                                      RotationFromVector({0.3, 0.4, 0.5}) * Scaled(1.2, 0.5, 1.6));
  TriangleMesh one_plane = shapes::Torus(14, 5, 160, 80, Vector3d::Zero());
  for (Vector3d& v : one_plane.vertices_mm)
    v = Vector3d(1.3 * v.x(), 0.8 * v.y() + 0.01 * v.x() * v.x() + 0.2 * v.z(), v.z());
  one_plane.corner_normals.clear();
  for (const TriangleMesh& mesh : {ellipse, one_plane}) {
    const auto cad = SurfaceOf(mesh);
    for (std::uint64_t seed = 0; seed < 6; ++seed) {
      const Stand stand(seed);
      Isometry3d turned = stand.zero_from_body;
      turned.linear() = turned.linear() * RotationFromVector({0.3, 0.9, -0.5 + 0.2 * static_cast<double>(seed)});
      const auto portions = ViewsOfBody(*cad, seed % 2 == 0 ? turned : stand.zero_from_body, 2, seed);
      EXPECT_EQ(RemarkOn(*cad, portions, stand.nominal), "") << seed;
    }
  }
}

TEST(MirrorRemark, SameOnAnyNumberOfThreadsSoonDoneAndStoppedWhenToldTo) {
  // As many triangles as the twisted blade of the bench.
  const auto truth = SurfaceOf(shapes::Blade(500, 200, kBladeCentreMm));
  const auto cad = SurfaceOf(Mapped(shapes::Blade(500, 200, kBladeCentreMm), Scaled(-1, 1, 1)));
  const Stand stand(3);
  const auto portions = ViewsOfBody(*truth, stand.zero_from_body, 2, 3);
  FitOptions options;
  options.thread_count = 1;
  const auto cpu_s = [](const auto& work) {
    const std::clock_t begin = std::clock();
    work();
    return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  };
  std::string one;
  const double remark_s = cpu_s([&] { one = RemarkOn(*cad, portions, stand.nominal, options); });
  EXPECT_TRUE(IsSaid(one)) << one;
  const double surface_s = cpu_s([&] { SurfaceOf(shapes::Blade(500, 200, kBladeCentreMm)); });
  const double ratio = remark_s / surface_s;
  std::printf("%.2f s of CPU time, %.1f times what the surface took\n", remark_s, ratio);
  RecordProperty("of_surface", std::to_string(ratio));
  EXPECT_LT(ratio, 25);  // 8 with AVX-512
  options.thread_count = 3;
  EXPECT_EQ(RemarkOn(*cad, portions, stand.nominal, options), one);

  int asked = 0;
  options.keep_going = [&] { return ++asked < 3; };
  const auto stopped = MirrorRemark(*cad, portions, stand.nominal, MachineCalibration::Exact(), options);
  EXPECT_TRUE(absl::IsCancelled(stopped.status())) << stopped.status();
}

}  // namespace
}  // namespace sixpoint::metrology
