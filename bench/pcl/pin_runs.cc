// Pins in drilled holes with chips and a neighbour about them: the robust cylinder through every point off the surface, PCL's
// clusters after it (as the product has them), before it, PCL's outlier removal before it, and PCL's cylinder in its place.
#include <Eigen/Geometry>
#include <cstdio>
#include <functional>

#include "bench/pcl/pcl_points.h"
#include "bench/pcl/runs.h"
#include "metrology/inspection/hole_error.h"
#include "metrology/kinematics/rotary_axes.h"
#include "metrology/parallel/loops.h"
#include "tests/metrology/inspection/simulated_pin.h"

namespace sixpoint::bench {
namespace {

using Eigen::Vector3d;
using metrology::NominalPin;
using metrology::Points;

constexpr double kPinLimitUm = 10;  // of the hole's start; a pin is measured to one or two
constexpr double kRegionMm = 0.65;  // about the nominal axis, as the inspection has it for a hole of 0.44 mm

struct PinCase {
  NominalPin nominal;
  Vector3d true_start_mm;
  Points points_mm;
};

class Drawing {
 public:
  explicit Drawing(std::uint64_t seed) : random_(seed) {
    one_.nominal.start_mm = {0.5, 9.1, -20};
    one_.nominal.axis = Vector3d(-0.65, 0.76, -0.03).normalized();
    one_.nominal.normal = Vector3d(-0.27, 0.96, 0.05).normalized();
    one_.nominal.hole_diameter_mm = 0.44;
    one_.nominal.hole_depth_mm = 6;
    across_ = metrology::TangentBasis(one_.nominal.axis);
  }
  // Displaced by some hundredths of a millimetre, tilted by some tenths of a degree.
  PinCase Pin(double seen_deg, int views, int count) {
    pin_.start_mm = one_.nominal.start_mm + metrology::TangentBasis(one_.nominal.normal) * Plane(0.03);
    pin_.axis = (one_.nominal.axis + across_ * Plane(4e-3)).normalized();
    one_.true_start_mm = pin_.start_mm;
    directions_.clear();
    for (int i = 0; i < views; ++i) {
      const double angle = M_PI / 180 * seen_deg * i / views;
      directions_.push_back(
          (-0.6 * pin_.axis + std::cos(angle) * across_.col(0) + std::sin(angle) * across_.col(1)).normalized());
    }
    one_.points_mm = metrology::SeenFrom(pin_, directions_, count, &random_);
    return one_;
  }
  // Single readings anywhere in the region.
  void Strays(double share, PinCase* one) {
    const auto count = static_cast<std::size_t>(share * static_cast<double>(one->points_mm.size()));
    for (std::size_t i = 0; i < count; ++i)
      one->points_mm.push_back(one->nominal.start_mm + (0.2 + 5 * uniform_(random_)) * one->nominal.axis +
                               across_ * kRegionMm * Disc());
  }
  // A curl of metal beside the pin, or against it.
  void Chip(double share, double gap_mm, PinCase* one) {
    const double angle = 2 * M_PI * uniform_(random_), height = 0.5 + 3 * uniform_(random_);
    const Eigen::Vector2d out(std::cos(angle), std::sin(angle)), along(-out.y(), out.x());
    const auto count = static_cast<std::size_t>(share * static_cast<double>(one->points_mm.size()));
    for (std::size_t i = 0; i < count; ++i) {
      const double s = 2 * uniform_(random_) - 1, r = pin_.radius_mm + gap_mm + 0.1 * s * s;
      one->points_mm.push_back(pin_.start_mm + (height + 0.4 * s + 0.1 * uniform_(random_)) * pin_.axis +
                               across_ * (r * out + 0.3 * s * along));
    }
  }
  // Another pin that stands so near that its side is within the region.
  void Neighbour(PinCase* one) {
    metrology::SimulatedPin other = pin_;
    const double angle = 2 * M_PI * uniform_(random_);
    other.start_mm += 0.75 * across_ * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    const std::size_t own = one->points_mm.size();
    for (const Vector3d& p :
         metrology::SeenFrom(other, directions_, static_cast<int>(own / directions_.size()), &random_)) {
      const Vector3d from = p - one->nominal.start_mm;
      if (from.cross(one->nominal.axis).norm() < kRegionMm) one->points_mm.push_back(p);
    }
  }

 private:
  Eigen::Vector2d Plane(double scale) {
    const double x = normal_(random_), y = normal_(random_);
    return scale * Eigen::Vector2d(x, y);
  }
  Eigen::Vector2d Disc() {
    const double angle = 2 * M_PI * uniform_(random_), radius = std::sqrt(uniform_(random_));
    return radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  }
  std::mt19937_64 random_;
  std::uniform_real_distribution<double> uniform_{0, 1};
  std::normal_distribution<double> normal_{0, 1};
  PinCase one_;
  metrology::SimulatedPin pin_;
  Eigen::Matrix<double, 3, 2> across_;
  std::vector<Vector3d> directions_;
};

struct Kind {
  const char* name;
  std::function<PinCase(Drawing*)> draw;
};
std::vector<Kind> Kinds() {
  const auto with = [](const std::function<void(Drawing*, PinCase*)>& add) {
    return [add](Drawing* drawing) {
      PinCase one = drawing->Pin(360, 6, 300);
      add(drawing, &one);
      return one;
    };
  };
  return {{"clean, all round", with([](Drawing*, PinCase*) {})},
          {"clean, seen over 150 deg, few points", [](Drawing* d) { return d->Pin(150, 3, 60); }},
          {"a tenth strays", with([](Drawing* d, PinCase* one) { d->Strays(0.1, one); })},
          {"30 % strays", with([](Drawing* d, PinCase* one) { d->Strays(0.3, one); })},
          {"a chip beside it", with([](Drawing* d, PinCase* one) { d->Chip(0.3, 0.25, one); })},
          {"a chip against it", with([](Drawing* d, PinCase* one) { d->Chip(0.3, 0.02, one); })},
          {"a neighbour", with([](Drawing* d, PinCase* one) { d->Neighbour(one); })},
          {"a neighbour, chips, strays", with([](Drawing* d, PinCase* one) {
             d->Neighbour(one);
             d->Chip(0.2, 0.1, one);
             d->Strays(0.1, one);
           })}};
}

struct PinContender {
  const char* name;
  std::function<std::optional<Vector3d>(const NominalPin&, const Points&)> start;
};
std::vector<PinContender> PinContenders() {
  using Kept = std::function<Points(const Points&)>;
  const auto fitted = [](double apart_mm, const Kept& kept) {
    return [=](const NominalPin& nominal, const Points& points) -> std::optional<Vector3d> {
      metrology::PinLimits limits;
      limits.apart_mm = apart_mm;
      const metrology::PinFit fit = metrology::FitPin(nominal, kept(points), limits);
      if (!fit.measured) return std::nullopt;
      return metrology::HoleErrorOf(nominal, fit, fit.noise_covariance).start_in_part_mm;
    };
  };
  const auto all = [](const Points& points) { return points; };
  return {{"product: clusters where refused", fitted(metrology::PinLimits().apart_mm, all)},
          {"all points", fitted(0, all)},
          {"clusters 0.15 mm first", fitted(0, [](const Points& p) { return PclLargestCluster(p, 0.15); })},
          {"clusters 0.25 mm first", fitted(0, [](const Points& p) { return PclLargestCluster(p, 0.25); })},
          {"outlier removal first", fitted(0, [](const Points& p) { return PclWithoutOutliers(p, 1); })},
          {"PCL cylinder", PclCylinderStart}};
}

}  // namespace

void RunPins(const RunOptions& options, Figures* figures) {
  const std::vector<Kind> kinds = Kinds();
  const std::vector<PinContender> contenders = PinContenders();
  const auto seeds = static_cast<std::size_t>(options.seeds);
  std::vector<std::vector<Result>> all(contenders.size(), std::vector<Result>(kinds.size() * seeds));
  metrology::ForEach(kinds.size() * seeds, options.threads, [&](std::size_t i) {
    Drawing drawing(1 + i % seeds);
    const PinCase one = kinds[i / seeds].draw(&drawing);
    for (std::size_t c = 0; c < contenders.size(); ++c) {
      const double begin = ThreadSeconds();
      const std::optional<Vector3d> start = contenders[c].start(one.nominal, one.points_mm);
      all[c][i] = {start.has_value(), start ? 1e3 * (*start - one.true_start_mm).norm() : 0, ThreadSeconds() - begin};
    }
  });
  const auto compare = [&](const std::string& title, std::size_t begin, std::size_t end) {
    std::vector<Tally> tallies;
    for (std::size_t c = 0; c < contenders.size(); ++c)
      tallies.emplace_back(contenders[c].name,
                           std::vector<Result>(all[c].begin() + static_cast<std::ptrdiff_t>(begin),
                                               all[c].begin() + static_cast<std::ptrdiff_t>(end)),
                           kPinLimitUm);
    return PrintTallies(title, "um", tallies);
  };
  std::printf("\n-- pins: %zu of each kind\n", seeds);
  for (std::size_t k = 0; k < kinds.size(); ++k) compare(kinds[k].name, k * seeds, (k + 1) * seeds);
  figures->Add("pins", compare("all of these", 0, kinds.size() * seeds));
}

}  // namespace sixpoint::bench
